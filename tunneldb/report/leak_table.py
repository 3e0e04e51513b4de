"""Table of the leaks of a report, for the page's script."""

from __future__ import annotations

from typing import Any

from markupsafe import Markup

from tunneldb.export.tables.leaks import clock_label
from tunneldb.report import text
from tunneldb.report.facts import Facts

CARDS = 400
"""Maximum number of leaks with picture and section in a printed report, the largest first; the HTML file has all."""

TABLE = [
    *(
        "id",
        "chainage",
        "label",
        "length",
        "arcFrom",
        "arcTo",
        "clock",
        "clockLabel",
        "area",
        "inside",
        "drop",
        "dropMax",
        "contrast",
        "confidence",
    ),
    *("imageShare", "review", "by", "at", "remark", "detected", "strip", "kind", "origin", "severity", "severityLabel"),
    *("easting", "northing", "height", "otherImages", "otherContrast"),
]
"""Columns of the table, as in the page's script."""


def leak_table(facts: Facts) -> Markup:
    """Return the table of the leaks as JSON: names of the columns, and rows."""
    rows = [
        [
            leak.id, round(leak.middle, 3), leak.label, round(leak.chainage_to - leak.chainage_from, 2),
            round(leak.arc_from, 2), round(leak.arc_to, 2), round(leak.clock, 3), clock_label(leak.clock),
            round(leak.area, 5), round(leak.inside, 5), text.rounded(leak.darkening_mean, 1),
            text.rounded(leak.darkening_max, 1),
            text.rounded(leak.contrast, 1), text.rounded(leak.confidence, 2), text.rounded(leak.image_share, 2),
            leak.review, leak.reviewed_by or "", text.when(leak.reviewed_at) if leak.reviewed_at else "",
            leak.remark or "", int(leak.detected), facts.strips.of(leak), *_as_finding(facts, leak.id),
        ]
        for leak in facts.leaks
    ]  # fmt: skip
    return text.script_json(
        {
            "columns": TABLE,
            "rows": rows,
            "cards": min(CARDS, len(facts.pictured)),
            "strip": facts.strips.length,
            "place": facts.place,
            "searched": facts.request.search.searched_share > 0,
            "words": facts.request.owner.words.other_than_english(),
        }
    )


def _as_finding(facts: Facts, key: int) -> tuple[Any, ...]:
    """Return name of the kind, origin, severity and its name, coordinates (m), and other images of a leak."""
    assert facts.findings is not None  # leaks are findings
    finding = facts.findings.by_id[key]
    place = (round(value, 3) for value in (finding.easting, finding.northing, finding.height))
    others = finding.other_images or "", text.rounded(finding.other_contrast, 1)
    return finding.kind_label, finding.origin, finding.severity, finding.severity_label or "", *place, *others
