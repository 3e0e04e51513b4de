"""Chapter on changes since an older survey: leaks, regions of lining, moved sections, and series over surveys."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import psycopg
from psycopg.rows import dict_row

from tunneldb.measures.change.rows import older_compared
from tunneldb.measures.change.tables import Row, change_rows, summary
from tunneldb.report.change_series import ovality_curve, wet_curve
from tunneldb.report.drawing import step_for, ticks
from tunneldb.report.rings import Curve
from tunneldb.store.survey import Survey

WIDTH, HEIGHT = 1000.0, 120.0
"""Size of the drawing of sections, in its own unit."""

MAX_LISTED_REGIONS = 40
"""Maximum number of listed regions, the largest ones."""


CHANGE_WORDS = {
    "new": "new", "grown": "grown", "shrunk": "shrunk", "same": "the same", "dry": "dry again", "kind": "of another kind",
    "unseen": "not inspected",
}  # fmt: skip
"""States of leaks in words."""


@dataclass(frozen=True)
class ChangeChapter:
    """Content of the chapter.

    Attributes
    ----------
    old : Survey
        The compared older survey: the last one before this.
    summary : dict
        Totals as in `tunneldb compare`.
    leaks, regions : list of dict
        Leaks that are not the same, and the largest regions.
    more : int
        Regions that are not listed.
    shift, shape, unseen : str, str, list
        Paths of the shift of sections and of the change of their shape; where nothing was compared.
    most : float
        Top of the drawing, m.
    ticks : list of (float, str)
        Places along it, with chainages.
    series : list of dict
        Wet area of each survey of the tunnel in the stretch.
    wet, ovality : Curve or None
        Wet area by date; ovality of rings before and after, where both surveys have some.
    stale : list of int
        Kilometres whose comparison is out of date.
    """

    old: Survey
    summary: Row
    leaks: list[Row]
    regions: list[Row]
    more: int
    shift: str
    shape: str
    unseen: list[tuple[float, float]]
    most: float
    ticks: list[tuple[float, str]]
    series: list[Row]
    wet: Curve | None
    ovality: Curve | None
    stale: list[int]


def read_change(conn: psycopg.Connection[Any], survey: Survey, low: float, high: float) -> ChangeChapter | None:
    """Read the changes in a stretch; None if the survey was not compared with an older one there."""
    old = older_compared(conn, survey, low, high)
    if old is None:
        return None
    sections = change_rows(conn, "change_section", old, survey, low, high)
    regions = change_rows(conn, "change_region", old, survey, low, high)
    leaks = change_rows(conn, "leak_change", old, survey, low, high)
    largest = sorted(regions, key=lambda region: -region["area"])[:MAX_LISTED_REGIONS]
    most = max([row[name] for row in sections for name in ("shift", "change_rms") if row[name] is not None], default=0.0)
    scale = WIDTH / (high - low)
    series = _series(conn, survey, low, high)
    stale = conn.execute(
        "SELECT km FROM tunnel_internal.result_state(%s, 'compare', %s)"
        " WHERE reason IS NOT NULL AND done_at IS NOT NULL ORDER BY km",
        [survey.id, str(old.id)],
    ).fetchall()
    return ChangeChapter(
        old, summary(sections, regions, leaks), [leak for leak in leaks if leak["state"] != "same"],
        sorted(largest, key=lambda region: region["chainage_from"]), len(regions) - len(largest),
        _path(sections, "shift", low, scale, most), _path(sections, "change_rms", low, scale, most),
        [((one["chainage_from"] - low) * scale, (one["chainage_to"] - one["chainage_from"]) * scale)
         for one in sections if not one["seen_both"]],
        most, [((x - low) * scale, f"{x:.0f}") for x in ticks(low, high, step_for(high - low, 10))],
        series, wet_curve(series), ovality_curve(conn, old, survey, low, high), [km for (km,) in stale],
    )  # fmt: skip


def _path(sections: list[Row], name: str, low: float, scale: float, most: float) -> str:
    """Return the steps of the sections, with gaps where unknown."""
    parts, before = [], None
    for one in sections:
        if one[name] is None:
            before = None
            continue
        y = HEIGHT * (1.0 - one[name] / max(most, 1e-9))
        start, end = ((one[end] - low) * scale for end in ("chainage_from", "chainage_to"))
        parts.append(f"{'L' if before == one['chainage_from'] else 'M'}{start:.1f} {y:.1f}H{end:.1f}")
        before = one["chainage_to"]
    return "".join(parts)


def _series(conn: psycopg.Connection[Any], survey: Survey, low: float, high: float) -> list[Row]:
    with conn.cursor(row_factory=dict_row) as cursor:
        return cursor.execute(
            "SELECT name AS survey, date, tunnel_api.wet_area(name, %(low)s, %(high)s) AS area FROM tunnel.survey"
            " WHERE tunnel_id = %(tunnel)s AND intensity_kind <> 'none' AND (id = %(own)s OR id NOT IN"
            " (SELECT survey_id FROM tunnel_internal.survey_copy UNION SELECT of_id FROM tunnel_internal.survey_copy"
            " WHERE survey_id = %(own)s)) ORDER BY date, name",
            {"low": low, "high": high, "tunnel": survey.tunnel_id, "own": survey.id},
        ).fetchall()
