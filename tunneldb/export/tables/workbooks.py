"""Findings and leaks as Excel workbooks: list, counts, uncounted findings, gaps in the inspection, dry regions."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tunneldb.export.tables.finding_counts import ORIGINS, SEVERITIES, UNCOUNTED, KindCount
from tunneldb.export.tables.leaks import clock_label
from tunneldb.export.tables.workbook import Column, Sheet, write_workbook
from tunneldb.store.dry_regions import DryRegion
from tunneldb.store.findings import Finding
from tunneldb.store.leaks import LeakList

_METRES, _WHOLE = "0.000", "0"

_FINDING = (
    (Column("No.", _WHOLE), "id"), (Column("Chainage"), "label"), (Column("Chainage from, m", _METRES), "chainage_from"),
    (Column("Chainage to, m", _METRES), "chainage_to"), (Column("Arc from, m", _METRES), "arc_from"),
    (Column("Arc to, m", _METRES), "arc_to"), (Column("Clock"), "clock"), (Column("Kind"), "kind_label"),
    (Column("Code of kind"), "kind"), (Column("Origin"), "origin"), (Column("Severity", _WHOLE), "severity"),
    (Column("Severity in words"), "severity_label"), (Column("Area, m²", "0.0000"), "area"),
    (Column("Length, m", _METRES), "length"), (Column("Width, m", "0.0000"), "width"), (Column("State"), "state"),
    (Column("Counted"), "counted"), (Column("Also detected"), "also_detected"),
    (Column("Merged into", _WHOLE), "merged_into"), (Column("Same as", _WHOLE), "same_as"),
    (Column("Split off", _WHOLE), "parent_id"), (Column("Dry region", _WHOLE), "dry_region_id"),
    (Column("Drawn by"), "drawn_by"), (Column("Drawn, UTC"), "drawn_at"), (Column("Reviewed by"), "reviewed_by"),
    (Column("Reviewed, UTC"), "reviewed_at"), (Column("Mean drop, dB", "0.0"), "darkening_mean"),
    (Column("Confidence", "0.00"), "confidence"), (Column("Photos", _WHOLE), "photos"), (Column("Remark"), "remark"),
)  # fmt: skip
_LEAK = (
    (Column("No.", _WHOLE), "id"), (Column("Chainage"), "label"), (Column("Chainage from, m", _METRES), "chainage_from"),
    (Column("Chainage to, m", _METRES), "chainage_to"), (Column("Arc from, m", _METRES), "arc_from"),
    (Column("Arc to, m", _METRES), "arc_to"), (Column("Clock"), "clock"), (Column("Kind"), "kind"),
    (Column("Area, m²", "0.0000"), "area"), (Column("Mean drop, dB", "0.0"), "darkening_mean"),
    (Column("Greatest drop, dB", "0.0"), "darkening_max"), (Column("Contrast, σ", "0.0"), "contrast"),
    (Column("Confidence", "0.00"), "confidence_in_kind"), (Column("Share measured", "0.00"), "image_share"),
    (Column("Review"), "review"), (Column("Found again"), "detected"), (Column("Counted"), "counted"),
    (Column("Reviewed by"), "reviewed_by"), (Column("Reviewed, UTC"), "reviewed_at"), (Column("Reasons"), "reasons"),
)  # fmt: skip

_NAMES = {"leak": "Leaks", "joint": "Joints", "dark": "Dry dark areas", "all": "Leaks, joints, dry dark areas"}


def write_findings(
    path: Path,
    title: str,
    findings: Sequence[Finding],
    others: Sequence[Finding],
    counts: Sequence[KindCount],
    severities: dict[int, str],
    regions: Sequence[DryRegion],
) -> None:
    """Write findings as a workbook.

    Parameters
    ----------
    path, title
        Target, and its title.
    findings, others : sequence of Finding
        Requested findings, and those excluded only by their state: rejected, gone, merged, …
    counts : sequence of KindCount
        Counts of both together.
    severities : dict of int to str
        The owner's words.
    regions : sequence of DryRegion
        Dry regions of the stretch.
    """
    columns = [column for column, _ in _FINDING]
    write_workbook(
        path,
        [
            Sheet("Findings", columns, [_cells(row, _FINDING) for row in findings]),
            _counts(counts, severities),
            Sheet("Left out", columns, [_cells(row, _FINDING) for row in others]),
            _regions(regions),
        ],
        title,
    )


def write_leaks(path: Path, title: str, leaks: LeakList, regions: Sequence[DryRegion]) -> None:
    """Write leaks, or other anomalies, as a workbook, with a sheet of gaps in the inspection and notes."""
    kinds = sorted({row.kind for row in leaks.rows})
    reviews = ("open", "confirmed", "rejected")
    of_kind = {kind: [row for row in leaks.rows if row.kind == kind] for kind in kinds}
    counted = [
        [
            kind, sum(row.counted for row in rows), *(sum(row.review == review for row in rows) for review in reviews),
            sum(not row.detected for row in rows), None,
        ]
        for kind, rows in of_kind.items()
    ]  # fmt: skip
    total = ["all", leaks.count, *(sum(row.review == review for row in leaks.rows) for review in reviews)]
    known = [[gap.label_from, gap.label_to, gap.state, gap.reason, gap.seen_share] for gap in leaks.coverage.gaps]
    known += [[None, None, "remark", remark.said, None] for remark in leaks.remarks]
    heads = ("Kind", "Counted", "Open", "Confirmed", "Rejected", "Not found again")
    write_workbook(
        path,
        [
            Sheet(_NAMES[leaks.kind], [column for column, _ in _LEAK], [_cells(row, _LEAK) for row in leaks.rows]),
            Sheet(
                "Counts",
                [*(Column(head, _WHOLE) for head in heads), Column("Area in the stretch, m²", "0.0000")],
                [*counted, [*total, sum(not row.detected for row in leaks.rows), leaks.area]],
            ),
            Sheet(
                "Could be missed",
                [Column("From"), Column("To"), Column("State"), Column("Why"), Column("Lining seen", "0.0 %")],
                known,
            ),
            _regions(regions),
        ],
        title,
    )


def _cells(row: Any, columns: Sequence[tuple[Column, str]]) -> list[Any]:
    return [_cell(name, getattr(row, name)) for _, name in columns]


def _cell(name: str, value: Any) -> Any:
    if name == "clock":
        return clock_label(value)
    return ", ".join(map(str, value)) if isinstance(value, list) else value


def _counts(counts: Sequence[KindCount], severities: dict[int, str]) -> Sheet:
    """Make rows by kind: number counted, by origin and by severity; then uncounted ones; then the total of each column."""
    degrees = [f"Severity {n} {severities.get(n, '')}".rstrip() if n else "No severity" for n in SEVERITIES]
    heads = [
        "Counted",
        "Open",
        "Confirmed",
        *(f"Counted, {origin}" for origin in ORIGINS),
        *degrees,
        *(f"Not counted: {s}" for s in UNCOUNTED),
    ]
    rows = [
        [
            count.counted, count.states["open"], count.states["confirmed"], *count.origins.values(), *count.severities.values(),
            *(count.states[state] for state in UNCOUNTED), count.area, count.length,
        ]
        for count in counts
    ]  # fmt: skip
    sums = [sum(column) for column in zip(*rows, strict=True)] if rows else []
    named = [[count.label, count.kind, *row] for count, row in zip(counts, rows, strict=True)]
    return Sheet(
        "Counts",
        [
            Column("Kind"), Column("Code of kind"), *(Column(head, _WHOLE) for head in heads), Column("Area, m²", "0.0000"),
            Column("Length, m", _METRES),
        ],
        [*named, *([["All", None, *sums]] if rows else [])],
    )  # fmt: skip


def _regions(regions: Sequence[DryRegion]) -> Sheet:
    return Sheet(
        "Dry regions",
        [
            Column("No.", _WHOLE), Column("From"), Column("To"), Column("Arc from, m", _METRES), Column("Arc to, m", _METRES),
            Column("Area, m²", "0.00"), Column("Drawn by"), Column("Drawn, UTC"), Column("Why"),
            Column("Pending approval"), Column("Approved by"), Column("Approved, UTC"),
            Column("Leaks removed", _WHOLE), Column("Their area, m²", "0.0000"), Column("Their numbers"),
        ],
        [
            [
                region.id, region.label_from, region.label_to, region.arc_from, region.arc_to, region.area, region.drawn_by,
                region.drawn_at, region.reason, region.pending_approval, region.approved_by, region.approved_at,
                region.leaks, region.leaks_area, ", ".join(map(str, region.leak_ids or [])),
            ]
            for region in regions
        ],
    )  # fmt: skip
