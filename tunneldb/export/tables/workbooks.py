"""Findings and leaks as Excel workbooks: list, counts, uncounted findings, gaps in the inspection, dry regions."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tunneldb.export.tables.finding_counts import ORIGINS, SEVERITIES, UNCOUNTED, KindCount
from tunneldb.export.tables.findings import FindingList
from tunneldb.export.tables.leaks import clock_label
from tunneldb.export.tables.notes import note_rows
from tunneldb.export.tables.workbook import Column, Sheet, write_workbook
from tunneldb.finding_kind import DRY
from tunneldb.store.coverage import Coverage
from tunneldb.store.dry_regions import DryRegion
from tunneldb.store.findings import Finding
from tunneldb.store.leaks import LeakList
from tunneldb.store.remarks import REMARK, Remark

_METRES, _WHOLE = "0.000", "0"

_PLACE = (
    (Column("Easting, m", _METRES), "easting"), (Column("Northing, m", _METRES), "northing"),
    (Column("Height, m", _METRES), "height"),
)  # fmt: skip
_IMAGES = ((Column("Other images"), "other_images"), (Column("Contrast there, σ", "0.0"), "other_contrast"))
_FINDING = (
    (Column("No.", _WHOLE), "id"), (Column("Chainage"), "label"), (Column("Chainage from, m", _METRES), "chainage_from"),
    (Column("Chainage to, m", _METRES), "chainage_to"), (Column("Arc from, m", _METRES), "arc_from"),
    (Column("Arc to, m", _METRES), "arc_to"), (Column("Clock"), "clock"), (Column("Kind"), "kind_label"),
    (Column("Code of kind"), "kind"), (Column("Origin"), "origin"), (Column("Severity", _WHOLE), "severity"),
    (Column("Severity in words"), "severity_label"), (Column("Area, m²", "0.0000"), "area"),
    (Column("Length, m", _METRES), "length"), (Column("Width, mm", "0.00"), "width_mm"),
    (Column("Orientation, °", "0.0"), "orientation"), (Column("Direction"), "orientation_class"), (Column("State"), "state"),
    (Column("Counted"), "counted"), (Column("Also detected"), "also_detected"),
    (Column("Merged into", _WHOLE), "merged_into"), (Column("Same as", _WHOLE), "same_as"),
    (Column("Split off", _WHOLE), "parent_id"), (Column("Dry region", _WHOLE), "dry_region_id"),
    (Column("Drawn by"), "drawn_by"), (Column("Drawn, UTC"), "drawn_at"), (Column("Reviewed by"), "reviewed_by"),
    (Column("Reviewed, UTC"), "reviewed_at"), (Column("Mean drop, dB", "0.0"), "darkening_mean"),
    (Column("Confidence", "0.00"), "confidence"), (Column("Photos", _WHOLE), "photos"), (Column("Remark"), "remark"),
    *_PLACE, *_IMAGES,
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
    (Column("Severity", _WHOLE), "severity"), (Column("Severity in words"), "severity_label"), (Column("Remark"), "remark"),
    *_PLACE, *_IMAGES,
)  # fmt: skip

_NAMES = {"leak": "Leaks", "joint": "Joints", "dark": "Dry dark areas", "all": "Leaks, joints, dry dark areas"}


def write_findings(
    path: Path,
    title: str,
    findings: FindingList,
    others: Sequence[Finding],
    counts: Sequence[tuple[KindCount, Sequence[KindCount]]],
    severities: dict[int, str],
    regions: Sequence[DryRegion],
    rating: Sequence[Sheet] = (),
) -> None:
    """Write findings as a workbook.

    Parameters
    ----------
    path, title
        Target, and its title.
    findings : FindingList
        Requested findings, with the statements on the stretch, which come first.
    others : sequence of Finding
        Findings excluded only by their state: rejected, gone, merged, …
    counts : sequence of (KindCount, sequence of KindCount)
        Sum and kinds of each group, of both together.
    severities : dict of int to str
        The owner's words.
    regions : sequence of DryRegion
        Dry regions of the stretch.
    rating : sequence of Sheet
        Sheets of a rating.
    """
    columns = [column for column, _ in _FINDING]
    write_workbook(
        path,
        [
            Sheet(
                "Findings",
                columns,
                [
                    *_notes(_FINDING, findings.coverage, findings.remarks, "remark"),
                    *(_cells(row, _FINDING) for row in findings.rows),
                ],
            ),
            _counts(counts, severities),
            _missed(findings.coverage, findings.remarks),
            Sheet("Left out", columns, [_cells(row, _FINDING) for row in others]),
            _regions(regions),
            *rating,
        ],
        title,
    )


def write_leaks(path: Path, title: str, leaks: LeakList, regions: Sequence[DryRegion]) -> None:
    """Write leaks, or other anomalies, as a workbook, with a sheet of gaps in the inspection and notes."""
    heads = ("Kind", "Counted", "Open", "Confirmed", "Rejected", "Not found again")
    write_workbook(
        path,
        [
            Sheet(
                _NAMES[leaks.kind],
                [column for column, _ in _LEAK],
                [
                    *_notes(_LEAK, leaks.coverage, leaks.remarks, "reasons"),
                    *(_cells(row, _LEAK) for row in leaks.rows),
                ],
            ),
            Sheet(
                "Counts",
                [*(Column(head, _WHOLE) for head in heads), Column("Area in the stretch, m²", "0.0000")],
                _leak_counts(leaks),
            ),
            _missed(leaks.coverage, leaks.remarks),
            _regions(regions),
        ],
        title,
    )


def _leak_counts(leaks: LeakList) -> list[list[Any]]:
    """Make a row of counts for each kind, and one of all; where dry kinds are listed too, of all leaks."""
    if not leaks.rows and not leaks.coverage.seen_area:
        return [[leaks.total, *[None] * 6]]
    kinds = sorted({row.kind for row in leaks.rows})
    counts = [_reviews(kind, [row for row in leaks.rows if row.kind == kind], leaks.sums.get(kind)) for kind in kinds]
    if leaks.kind == "all":
        wet = [row for row in leaks.rows if row.kind not in DRY]
        return [*counts, _reviews("all leaks", wet, leaks.sums.get("leak", (0, 0.0)))]
    return [*counts, _reviews("all", leaks.rows, (leaks.count, leaks.area))]


def _reviews(name: str, rows: Sequence[Finding], total: tuple[int, float] | None) -> list[Any]:
    """Make a row of counts: included, by review, not found again; and the area within the stretch, if it is known."""
    reviews = [sum(row.review == review for row in rows) for review in ("open", "confirmed", "rejected")]
    return [name, sum(row.counted for row in rows), *reviews, sum(not row.detected for row in rows), total and total[1]]


def _missed(coverage: Coverage, remarks: Sequence[Remark]) -> Sheet:
    """Make the sheet of stretches where leaks could be missed, and of notes."""
    known = [[gap.label_from, gap.label_to, gap.state, gap.reason, gap.seen_share] for gap in coverage.gaps]
    return Sheet(
        "Could be missed",
        [Column("From"), Column("To"), Column("State"), Column("Why"), Column("Lining seen", "0.0 %")],
        [*known, *([None, None, REMARK, remark.said, None] for remark in remarks)],
    )


def _notes(columns: Sequence[tuple[Column, str]], coverage: Coverage, remarks: Sequence[Remark], text: str) -> list[list[Any]]:
    """Make the rows before a list that state gaps and notes; the state is in the first column with the kind."""
    names = [name for _, name in columns]
    if "kind_label" in names:
        names = ["kind" if name == "kind_label" else "" if name == "kind" else name for name in names]
    return [[row.get(name) for name in names] for row in note_rows(coverage, remarks, text)]


def _cells(row: Any, columns: Sequence[tuple[Column, str]]) -> list[Any]:
    return [_cell(name, getattr(row, name)) for _, name in columns]


def _cell(name: str, value: Any) -> Any:
    if name == "clock":
        return clock_label(value)
    return ", ".join(map(str, value)) if isinstance(value, list) else value


def _counts(groups: Sequence[tuple[KindCount, Sequence[KindCount]]], severities: dict[int, str]) -> Sheet:
    """Make rows by kind, and the sum of each group: number counted, by origin and by severity; then uncounted ones."""
    counts = [count for total, kinds in groups for count in (*kinds, total)]
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
    return Sheet(
        "Counts",
        [
            Column("Kind"), Column("Code of kind"), *(Column(head, _WHOLE) for head in heads), Column("Area, m²", "0.0000"),
            Column("Length, m", _METRES),
        ],
        [[count.label, count.kind, *row] for count, row in zip(counts, rows, strict=True)],
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
