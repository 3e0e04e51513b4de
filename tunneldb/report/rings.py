"""The chapter on the rings of the lining: the worst ones, and ovality, deviation and steps along the tunnel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import psycopg
from psycopg.rows import dict_row

from tunneldb.arrays import Float
from tunneldb.report.drawing import line_path, step_for, ticks
from tunneldb.store.survey import Survey

WIDTH, HEIGHT = 1000.0, 110.0
"""Size of a plot, in its own unit."""

WORST = 10
"""Number of listed rings: those with the greatest ovality, and those with the greatest steps."""


@dataclass(frozen=True)
class Curve:
    """A quantity along the tunnel, drawn.

    Attributes
    ----------
    name : str
        Name: ovality, deviation, or step.
    paths : list of (str, str)
        Class and path of each line.
    heights, places : list of (float, str)
        Positions of lines of equal size and ticks of chainage, and their labels.
    """

    name: str
    paths: list[tuple[str, str]]
    heights: list[tuple[float, str]]
    places: list[tuple[float, str]]


@dataclass(frozen=True)
class RingsChapter:
    """Content of the chapter.

    Attributes
    ----------
    count, measured, unseen, missing : int
        Rings in the stretch; those with centre and radius, those without measured lining, joints that were not seen.
    length : float
        Median length, m.
    ovality : dict or None
        Median and greatest, ‰, and the diameter that they refer to; None if no ring has one.
    worst : list of dict
        Columns of view ``ring`` of the worst rings, in order of chainage.
    curves : list of Curve
    stale : bool
        True if their data have changed since.
    """

    count: int
    measured: int
    unseen: int
    missing: int
    length: float
    ovality: dict[str, Any] | None
    worst: list[dict[str, Any]]
    curves: list[Curve]
    stale: bool


def read_rings(conn: psycopg.Connection[Any], survey: Survey, low: float, high: float) -> RingsChapter | None:
    """Read the rings of a stretch, m; None if none was measured."""
    with conn.cursor(row_factory=dict_row) as cursor:
        rows = cursor.execute(
            "SELECT number, label, chainage_from, chainage_to, joint, seen_share, shape, centre_right, centre_up, radius,"
            " ovality, ovality_se, diameter_from, step_greatest, step_greatest_se, lip, remark, circle_x, circle_y, circle_z,"
            " circle_radius FROM tunnel_api.ring"
            " WHERE survey_id = %s AND shape IS NOT NULL AND (chainage_from + chainage_to) / 2 BETWEEN %s AND %s"
            " ORDER BY chainage_from",
            [survey.id, low, high],
        ).fetchall()
    if not rows:
        return None
    found = conn.execute(
        "SELECT coalesce(bool_or(reason IS NOT NULL), false) FROM tunnel_internal.result_state(%s, 'rings')"
        " WHERE (km + 1) * 1000 > %s AND km * 1000 < %s",
        [survey.id, low, high],
    ).fetchone()
    oval = [row for row in rows if row["ovality"] is not None]
    sizes = [1e3 * row["ovality"] for row in oval]
    return RingsChapter(
        len(rows),
        sum(row["radius"] is not None for row in rows),
        sum(not row["seen_share"] for row in rows),
        sum(row["joint"] == "missing" for row in rows),
        float(np.median([row["chainage_to"] - row["chainage_from"] for row in rows])),
        {"median": float(np.median(sizes)), "greatest": max(sizes), "of": sorted({row["diameter_from"] for row in oval})}
        if oval
        else None,
        _worst(rows),
        _curves(rows),
        bool(found and found[0]),
    )


def _worst(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the rings with the greatest ovality and with the greatest steps, in order of chainage."""
    chosen: set[int] = set()
    for name in ("ovality", "step_greatest"):
        there = sorted((row for row in rows if row[name] is not None), key=lambda row: -abs(row[name]))
        chosen |= {row["number"] for row in there[:WORST]}
    return [row for row in rows if row["number"] in chosen]


def _curves(rows: Sequence[dict[str, Any]]) -> list[Curve]:
    middle = np.array([(row["chainage_from"] + row["chainage_to"]) / 2.0 for row in rows])
    joint = np.array([row["chainage_from"] for row in rows])
    table = {
        name: np.array([np.nan if row[name] is None else 1e3 * row[name] for row in rows])
        for name in ("ovality", "centre_right", "centre_up", "step_greatest")
    }
    steps = np.abs(table["step_greatest"])
    drawn = [
        ("ovality", [("ovality", middle, table["ovality"])], "‰"),
        ("deviation", [("right", middle, table["centre_right"]), ("up", middle, table["centre_up"])], "mm"),
        ("step", [("step", joint, steps)], "mm"),
    ]
    start, end = float(joint[0]), float(rows[-1]["chainage_to"])
    return [
        curve(name, lines, unit, start, end) for name, lines, unit in drawn if any(np.isfinite(y).any() for _, _, y in lines)
    ]


def curve(name: str, lines: Sequence[tuple[str, Float, Float]], unit: str, start: float, end: float) -> Curve:
    """Draw lines of one quantity from a chainage to another, m: class, places and values of each; NaN is left open."""
    values = np.concatenate([y[np.isfinite(y)] for _, _, y in lines])
    low, high = min(0.0, float(values.min())), max(0.0, float(values.max()))
    span = max(high - low, 0.1)
    low, high = low - 0.05 * span * (low < 0.0), high + 0.05 * span
    across, down = WIDTH / (end - start), HEIGHT / max(high - low, 0.1)
    paths = []
    for kind, x, y in lines:
        points = np.column_stack([(x - start) * across, (high - y) * down])
        # A line is not drawn over rings of which the quantity is not known.
        known = np.isfinite(y)
        pieces = np.split(np.arange(len(y)), np.flatnonzero(np.diff(known.astype(int))) + 1)
        paths.append((kind, "".join(line_path(points[piece], 1) for piece in pieces if known[piece[0]] and len(piece) > 1)))
    raw = (high - low) / 6.0
    scale = 10.0 ** np.floor(np.log10(raw))
    step = float(scale * next(m for m in (1.0, 2.0, 5.0, 10.0) if m * scale >= raw))
    levels = step * np.arange(np.ceil(low / step), np.floor(high / step) + 1)
    return Curve(
        name,
        paths,
        [((high - level) * down, f"{level:g} {unit}") for level in (levels + 0.0).tolist()],
        [((x - start) * across, f"{x:.0f}") for x in ticks(start, end, step_for(end - start, 10))],
    )
