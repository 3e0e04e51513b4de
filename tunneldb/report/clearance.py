"""Chapter on clearance: margins along each track, the tightest places, infringements, the tightest metre drawn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import psycopg
import shapely

from tunneldb.arrays import Bool, Float
from tunneldb.classification.classes import PointClass
from tunneldb.geometry.alignment import Alignment
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.measures.clearance.compute.clearance import TEMPORARY_CLASSES, TRACK_CLASSES
from tunneldb.measures.clearance.compute.track import metre_places
from tunneldb.measures.clearance.rows import load_classed
from tunneldb.measures.clearance.tables import Row, infringement_rows, section_rows
from tunneldb.report.data import label_chainages
from tunneldb.report.drawing import line_path, step_for, ticks
from tunneldb.shape.outline import Outline
from tunneldb.store.surface import load_alignment
from tunneldb.store.survey import Survey

PLACES = 10
"""Number of tightest places listed, at least MIN_PLACE_DISTANCE from each other."""

MIN_PLACE_DISTANCE = 5.0
"""Minimum distance between the beginnings of listed places, m."""

ROWS = 40
"""Maximum number of infringements in a table, the deepest ones."""

WIDTH, HEIGHT = 1000.0, 120.0
"""Size of the plot of margins, in its own unit."""

DRAWN_DISTANCE = 2.0
"""Maximum distance of drawn points from the outline, m."""

POINT = 0.02
"""Approximate distance below which points are one in the drawing, m."""


@dataclass(frozen=True)
class MarginPlot:
    """Plot of margins along a track: the least of each metre, or of each unit if metres are narrower.

    Attributes
    ----------
    outside, inside : str
        Paths of bars from the outline at ``zero``.
    zero : float
    seen : str
        Path of the share of directions seen, from 0 at y = HEIGHT + 30 up to 1 at HEIGHT + 10.
    unmeasured, unseen : list of (float, float)
        Begin and width of where no track was, and of metres in which nothing was seen that counts.
    margins, places : list of (float, str)
        Ticks of margin, by y, and of chainage, by x.
    """

    outside: str
    inside: str
    zero: float
    seen: str
    unmeasured: list[tuple[float, float]]
    unseen: list[tuple[float, float]]
    margins: list[tuple[float, str]]
    places: list[tuple[float, str]]


@dataclass(frozen=True)
class TightestMetre:
    """A metre looking up-chainage, in the track's frame: paths, m, y downwards, and the point with the least margin.

    ``points`` has a path for each of ``counts``, ``inside``, ``passing`` and ``ground``, those inside counting.
    """

    row: Row
    outline: str
    points: dict[str, str]
    nearest: tuple[float, float] | None
    box: str


@dataclass(frozen=True)
class TrackChapter:
    """Results for an outline around a track.

    Attributes
    ----------
    gauge, track, source : str
        The outline's name, the track's, and the file of the outline.
    length, measured : float
        Length of the stretch, and its measured part, m.
    seen_share : float
        Mean share of the directions with a return, in the measured part.
    metres_inside, metres_without : int
        Metres with something inside that counts, and in which nothing was seen that counts.
    stray, passing, ground : int
        Points inside that do not count.
    tightest : list of dict
        Rows of the tightest places, tightest first.
    counted, others : list of dict
        Infringements that count, and those that may be gone, deepest first.
    stale : list of (int, str)
        Kilometres that are out of date, and why.
    plot : MarginPlot
    metre : TightestMetre or None
        None where nothing was seen that counts.
    """

    gauge: str
    track: str
    source: str
    length: float
    measured: float
    seen_share: float
    metres_inside: int
    metres_without: int
    stray: int
    passing: int
    ground: int
    tightest: list[Row]
    counted: list[Row]
    others: list[Row]
    stale: list[tuple[int, str]]
    plot: MarginPlot
    metre: TightestMetre | None

    @property
    def most(self) -> int:
        """Infringements in a table at most."""
        return ROWS


def read_clearance(conn: psycopg.Connection[Any], survey: Survey, low: float, high: float) -> list[TrackChapter]:
    """Read the results of a stretch, m, for each outline and track that was measured; empty if none was."""
    measured = conn.execute(
        "SELECT c.gauge, c.track, (SELECT g.source FROM tunnel.gauge g WHERE g.tunnel_id = %(tunnel)s AND g.name = c.gauge)"
        "  FROM (SELECT DISTINCT gauge, track FROM tunnel.clearance_section WHERE survey_id = %(survey)s"
        "           AND chainage_to > %(low)s AND chainage_from < %(high)s) c ORDER BY c.gauge, c.track",
        {"tunnel": survey.tunnel_id, "survey": survey.id, "low": low, "high": high},
    ).fetchall()
    if not measured:
        return []
    axis = load_alignment(conn, survey, 1.0)
    return [_track(conn, survey, axis, gauge, track, source or "", low, high) for gauge, track, source in measured]


def _track(
    conn: psycopg.Connection[Any], survey: Survey, axis: Alignment, gauge: str, track: str, source: str, low: float, high: float
) -> TrackChapter:
    rows = section_rows(conn, survey, gauge, track, low, high)
    found = infringement_rows(conn, survey, gauge, track, low, high)
    stale = conn.execute(
        "SELECT km, reason FROM tunnel_internal.result_state(%s, 'clearance') WHERE subject = %s AND reason IS NOT NULL"
        " AND (km + 1) * 1000.0 > %s AND km * 1000.0 < %s ORDER BY km",
        [survey.id, f"{track} {gauge}", low, high],
    ).fetchall()
    tightest = _tightest(rows)
    return TrackChapter(
        gauge, track, source, high - low, sum(_within(row, low, high) for row in rows),
        float(np.mean([row["seen_share"] for row in rows])), sum(row["inside"] > 0 for row in rows),
        sum(row["margin"] is None for row in rows), sum(row["stray"] for row in rows), sum(row["passing"] for row in rows),
        sum(row["ground"] for row in rows),
        tightest, [row for row in found if row["counts"]], [row for row in found if not row["counts"]], stale,
        _plot(conn, survey, rows, low, high), _metre(conn, survey, axis, gauge, track, tightest[0]) if tightest else None,
    )  # fmt: skip


def _within(row: Row, low: float, high: float) -> float:
    return float(min(row["chainage_to"], high) - max(row["chainage_from"], low))


def _tightest(rows: Sequence[Row]) -> list[Row]:
    chosen: list[Row] = []
    for row in sorted((row for row in rows if row["margin"] is not None), key=lambda row: float(row["margin"])):
        if all(abs(row["chainage_from"] - one["chainage_from"]) >= MIN_PLACE_DISTANCE for one in chosen):
            chosen.append(row)
        if len(chosen) == PLACES:
            break
    return chosen


def _plot(conn: psycopg.Connection[Any], survey: Survey, rows: Sequence[Row], low: float, high: float) -> MarginPlot:
    count = int(min(np.ceil(high - low), WIDTH))
    place = np.array([(row["chainage_from"] + row["chainage_to"]) / 2.0 for row in rows])
    bins = np.clip(((place - low) / (high - low) * count).astype(np.int64), 0, count - 1)
    margin = np.array([np.inf if row["margin"] is None else row["margin"] for row in rows], np.float64)
    least, seen = np.full(count, np.inf), np.full(count, np.inf)
    np.minimum.at(least, bins, margin)
    np.minimum.at(seen, bins, np.array([row["seen_share"] for row in rows], np.float64))
    covered, measured = np.isfinite(seen), np.isfinite(least)
    top, bottom = max(float(least[measured].max(initial=0.0)), 0.01), min(float(least[measured].min(initial=0.0)), 0.0)
    scale = HEIGHT / (top - bottom)
    x = np.repeat(np.linspace(0.0, WIDTH, count + 1), 2)

    def path(values: Float, base: float, height: float) -> str:
        y = base - height * np.concatenate([[0.0], np.repeat(values, 2), [0.0]])
        return line_path(np.column_stack([x, y]), 1) + "Z"

    known = np.where(measured, least, 0.0)
    step = step_for(1000.0 * (top - bottom), 6) / 1000.0
    at = ticks(low, high, step_for(high - low, 8))
    labels = label_chainages(conn, survey, at) if at else []
    return MarginPlot(
        path(np.maximum(known, 0.0), top * scale, scale), path(np.minimum(known, 0.0), top * scale, scale), top * scale,
        path(np.where(covered, seen, 0.0), HEIGHT + 30.0, 20.0), _runs(~covered), _runs(covered & ~measured),
        [((top - value) * scale, f"{value:g}".replace("-", "−")) for value in ticks(bottom, top, step)],
        [((value - low) / (high - low) * WIDTH, label) for value, label in zip(at, labels, strict=True)],
    )  # fmt: skip


def _runs(mask: Bool) -> list[tuple[float, float]]:
    """Return begin and width of the runs where a mask along the plot is true, in the plot's unit."""
    ends = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8))).reshape(-1, 2)
    unit = WIDTH / len(mask)
    return [(begin * unit, (end - begin) * unit) for begin, end in ends.tolist()]


def _metre(conn: psycopg.Connection[Any], survey: Survey, axis: Alignment, gauge: str, track: str, row: Row) -> TightestMetre:
    found = conn.execute(
        "SELECT km, outline, public.ST_X(geom), public.ST_Y(geom), public.ST_Z(geom) FROM tunnel.clearance_section"
        " WHERE survey_id = %s AND gauge = %s AND track = %s AND chainage_from = %s",
        [survey.id, gauge, track, row["chainage_from"]],
    ).fetchone()
    assert found is not None
    km, flat, *point = found
    vertices = np.reshape(flat, (-1, 3))[:-1]
    outline = Outline.of(vertices[:, :2], vertices[:, 2], closed=True).flattened(0.005)
    begin = float(row["chainage_from"])
    # Points are stored by chainage along the measured axis, sections by that along the given one.
    xyz, classes = load_classed(conn, survey, km, max(begin - 1.0, (km - 1) * KILOMETRE), begin + 2.0)
    place = (begin, row["track_right"], row["track_up"], row["cant"])
    places, chosen = metre_places(axis.across(xyz), *place)
    nearest = None
    if point[0] is not None:
        at = metre_places(axis.across(np.array([point], np.float64)), *place)[0]
        nearest = (float(at[0, 0]), -float(at[0, 1])) if len(at) else None
    (west, low), (east, high) = outline.min(axis=0) - DRAWN_DISTANCE, outline.max(axis=0) + DRAWN_DISTANCE
    return TightestMetre(
        row, line_path(outline * [1.0, -1.0]) + "Z", _point_paths(places, classes[chosen], outline), nearest,
        f"{west:.2f} {-high:.2f} {east - west:.2f} {high - low:.2f}",
    )  # fmt: skip


def _point_paths(places: Float, classes: Any, outline: Float) -> dict[str, str]:
    """Return paths of dots for the points (n, 2) around an outline, by class; noise is left out."""
    (west, low), (east, high) = outline.min(axis=0) - DRAWN_DISTANCE, outline.max(axis=0) + DRAWN_DISTANCE
    near = ((places > [west, low]) & (places < [east, high])).all(axis=1) & (classes != PointClass.NOISE)
    ground, passing = np.isin(classes, TRACK_CLASSES), np.isin(classes, TEMPORARY_CLASSES)
    counts = near & ~ground & ~passing
    inside = counts & shapely.contains_xy(shapely.Polygon(outline), places)
    kinds = {"counts": counts & ~inside, "inside": inside, "passing": near & passing, "ground": near & ground}
    return {kind: _dots(places[mask]) for kind, mask in kinds.items() if mask.any()}


def _dots(places: Float) -> str:
    cells = np.unique(np.round(places / POINT).astype(np.int64), axis=0) * POINT
    return "".join(f"M{x:.2f} {-y:.2f}h0" for x, y in cells.tolist())
