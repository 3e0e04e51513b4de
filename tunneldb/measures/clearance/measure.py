"""Clearance of a survey's tracks, kilometre by kilometre: tracks from rails or a file, distances from an outline."""

from __future__ import annotations

import hashlib
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import psycopg
import shapely

from tunneldb.arrays import Bool, Float
from tunneldb.classification.classes import PointClass
from tunneldb.classification.objects.spacing import Spacing
from tunneldb.csvfile import find_column, read_csv, read_header
from tunneldb.errors import UserError
from tunneldb.geometry.alignment import Alignment
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.geometry.surface import Surface
from tunneldb.measures.clearance.compute.clearance import STEP, TEMPORARY_CLASSES, Clearance, Grouping, clearance, clock
from tunneldb.measures.clearance.compute.gauge import Widening, halved, terms, widened
from tunneldb.measures.clearance.compute.track import GAUGE, HEAD, Pairs, Track, curvature, fit_track, follow, rail_pairs
from tunneldb.measures.clearance.rows import (
    SavedInfringement,
    SavedSection,
    classed_kilometres,
    clusters_at,
    flat_outline,
    load_classed,
    save_clearance,
)
from tunneldb.progress import StartProgress
from tunneldb.shape.outline import Outline
from tunneldb.stages.on_demand import measure_kilometres, refuse_beyond
from tunneldb.stages.run import nothing_yet
from tunneldb.stages.stale import Result, refuse_blocked, result_states
from tunneldb.store.surface import load_alignment, load_surface, survey_ends
from tunneldb.store.survey import Survey

_STATIONS = 1.0  # m between stations of the given axis
_BESIDE = 60.0  # m beyond a kilometre's ends that its track is fitted to and its curvature taken from
_EDGE = 2.0  # m beyond them from which points may belong to it: its ends are those of the measured axis


@dataclass(frozen=True)
class Options:
    """Options of a clearance; ``radius`` and ``cant`` replace those of the track, m."""

    track_gauge: float = GAUGE
    widening: Widening = field(default_factory=Widening)
    radius: float | None = None
    cant: float | None = None
    group_points: int = 3
    group_radius: float = 0.3


@dataclass(frozen=True)
class Tracks:
    """Tracks by name: approximate ones of the whole survey, to be fitted, or a given one."""

    rough: dict[str, Pairs]
    given: Track | None = None
    source: str = "rails"

    @property
    def names(self) -> list[str]:
        """Names, from left to right."""
        return ["given"] if self.given is not None else list(self.rough)


def find_tracks(conn: psycopg.Connection[Any], survey: Survey, gauge: float = GAUGE) -> Tracks:
    """Find the tracks of a survey from the rails that stage ground classified.

    Raises
    ------
    UserError
        If there is none, or two share a rail.
    """
    axis = load_alignment(conn, survey, _STATIONS)
    kilometres = classed_kilometres(conn, survey)
    if not kilometres:
        raise nothing_yet(conn, survey, "has no classes of points")
    parts = []
    for km in kilometres:
        xyz, _ = load_classed(conn, survey, km, km * KILOMETRE, (km + 1) * KILOMETRE, rails=True)
        points = axis.across(xyz)
        parts.append(rail_pairs(points[np.isfinite(points[:, 0])], gauge))
    try:
        found = follow(Pairs.joined(parts))
    except ValueError as error:
        raise UserError(f"survey {survey.name}: {error}; give the track with --track-axis") from None
    if not found:
        raise UserError(
            f"survey {survey.name}: no two rails {gauge:g} m apart were found along 25 m or more; give the track with"
            " --track-axis, or its gauge with --track-gauge"
        )
    names = {1: ["single"], 2: ["left", "right"]}.get(len(found)) or [str(k + 1) for k in range(len(found))]
    return Tracks(dict(zip(names, found, strict=True)))


def read_track(path: Path, axis: Alignment) -> Tracks:
    """Read the axis of a track or lane: chainage,right,up[,cant] about the given axis, or x,y,z[,cant]; m.

    Raises
    ------
    UserError
        If it can't be read, doesn't grow along the axis, or has one row.
    """
    columns = ("x", "y", "z") if find_column(path, read_header(path), "x") else ("chainage", "right", "up")
    table = read_csv(path, (*columns, "cant"), {"cant": 0.0}, {})
    places = table.columns(columns)
    if columns[0] == "x":
        places = axis.across(places)
        if not np.isfinite(places).all():
            row = int(np.flatnonzero(~np.isfinite(places[:, 0]))[0])
            raise table.error(row, "the place is beyond the given axis")
    if len(table) < 2 or (np.diff(places[:, 0]) <= 0.0).any():
        raise UserError(f"{path}: a track needs at least two rows, in increasing chainage")
    zero = np.zeros(len(table))
    reach = float(np.diff(places[:, 0]).max()) / 2.0
    chainage, right, up = places.T
    track = Track(chainage, right, up, table["cant"], zero, zero, zero, np.ones(len(table), np.bool_), reach=reach)
    return Tracks({}, track, hashlib.md5(path.read_bytes(), usedforsecurity=False).hexdigest())


def measure_clearance(
    conn: psycopg.Connection[Any], survey: Survey, tracks: Tracks, track: str, gauge: str, outline: Outline, options: Options,
    low: float, high: float, begin: StartProgress,
) -> list[int]:  # fmt: skip
    """Bring the clearance of a stretch up to date, each kilometre in one transaction; return those that were made.

    Raises
    ------
    UserError
        If a kilometre's ground is out of date, or there is none in the stretch.
    """
    refuse_beyond(conn, survey, low, high)
    ends = survey_ends(conn, survey) or (-np.inf, np.inf)
    result = Result(survey, "clearance", {"track": track, "gauge": gauge})
    states = result_states(conn, result, low, high)
    if not states:
        raise nothing_yet(conn, survey, "has no classes of points there")
    refuse_blocked(states, survey.name, "clearance")
    axis = load_alignment(conn, survey, _STATIONS)
    return measure_kilometres(
        conn, result, states, lambda km: {"axis": tracks.source, **asdict(options)},
        lambda km: measure_kilometre(conn, survey, km, axis, tracks, track, gauge, outline, options, ends),
        f"clearance of {survey.name}", begin,
    )  # fmt: skip


def measure_kilometre(
    conn: psycopg.Connection[Any], survey: Survey, km: int, axis: Alignment, tracks: Tracks, name: str, gauge: str,
    outline: Outline, options: Options, ends: tuple[float, float],
) -> dict[str, Any]:  # fmt: skip
    """Measure the clearance of a track in a kilometre between the survey's ends and save it; counts for the ledger."""
    first, stop = km * KILOMETRE, (km + 1) * KILOMETRE
    first, stop = max(first, np.floor(ends[0])), min(stop, np.ceil(ends[1]))
    track = tracks.given or _fitted(conn, survey, km, axis, tracks.rough[name], options.track_gauge)
    begins = np.arange(first, stop, STEP)
    valid = np.isfinite(track.at(begins + STEP / 2.0)[:, 0]) if len(track.chainage) else np.zeros(len(begins), np.bool_)
    seen = _share_seen(track, begins, valid)
    counts: dict[str, Any] = {"metres": len(begins), "track_metres": int(valid.sum()), "track_seen": round(seen, 4)}
    begins = begins[valid]
    if not len(begins):
        save_clearance(conn, survey, km, gauge, name, [], [])
        return counts
    middle = begins + STEP / 2.0
    bend = np.full(len(begins), 1.0 / options.radius) if options.radius else _bend(axis, track, middle)
    at = track.at(middle)
    cant = at[:, 2] if options.cant is None else np.full(len(begins), options.cant)
    wide = terms(options.widening, bend, cant, track.spacing)
    to_right = bend > 0.0
    allowance = options.widening.allowance
    left = np.where(to_right, wide.outward, wide.inward) + allowance
    right = np.where(to_right, wide.inward, wide.outward) + allowance
    about = options.widening.roll_height
    halves = halved(outline)
    outlines = [widened(halves, a, b, r, about) for a, b, r in zip(left, right, wide.roll, strict=True)]
    xyz, classes = load_classed(conn, survey, km, first - _EDGE, stop + _EDGE)
    about_axis = axis.across(xyz)
    places = np.column_stack([about_axis[:, 0], track.places(*about_axis.T)])
    spacing = Spacing.of(places[(classes == PointClass.LINING) & np.isfinite(places).all(axis=1)])
    grouping = Grouping(options.group_points, options.group_radius, spacing.shrink if spacing else 1.0)
    found = clearance(places, classes, begins, outlines, grouping)
    keys = [s.index for s in found.sections if s.index >= 0] + [int(i.points[0]) for i in found.infringements]
    cluster = dict(zip(keys, clusters_at(conn, survey, km, xyz[keys]), strict=True))
    sections = []
    for k, s in enumerate(found.sections):
        there = s.index >= 0
        error = (
            float(np.hypot(np.hypot(at[k, 3], at[k, 4]), _arm(places, s.index) * at[k, 5] / track.spacing)) if there else None
        )
        sections.append(SavedSection((
            s.chainage, s.chainage + STEP, *(float(v) for v in (at[k, 0], at[k, 1], cant[k], bend[k], left[k], right[k])),
            float(wide.roll[k]), s.margin if there else None, error, s.clock if there else None,
            int(classes[s.index]) if there else None, cluster.get(s.index), s.margins.tolist(), s.seen, s.points, s.inside,
            s.stray, s.passing, s.ground, flat_outline(outlines[k]),
        ), xyz[s.index] if there else None))  # fmt: skip
    surface = load_surface(conn, survey, first, stop)
    save_clearance(
        conn, survey, km, gauge, name, sections, _infringements(found, places, xyz, classes, begins, outlines, cluster, surface)
    )
    margins = [s.margin for s in found.sections if s.index >= 0]
    counts.update(
        margin=round(min(margins), 4) if margins else None, infringements=len(found.infringements),
        axis_se=round(float(np.hypot(at[:, 3], at[:, 4]).mean()), 5), cant_se=round(float(at[:, 5].mean()), 5),
        **{key: sum(getattr(s, key) for s in found.sections) for key in ("inside", "stray", "passing", "ground")},
    )  # fmt: skip
    return counts


def _fitted(conn: psycopg.Connection[Any], survey: Survey, km: int, axis: Alignment, rough: Pairs, gauge: float) -> Track:
    low, high = km * KILOMETRE - _BESIDE, (km + 1) * KILOMETRE + _BESIDE
    if rough.chainage[0] > high or rough.chainage[-1] < low:
        none = np.empty(0)
        return Track(none, none, none, none, none, none, none, np.empty(0, np.bool_), gauge + HEAD)
    xyz, _ = load_classed(conn, survey, km, low, high, rails=True)
    points = axis.across(xyz)
    return fit_track(points[np.isfinite(points[:, 0])], rough, low, high, gauge)


def _share_seen(track: Track, begins: Float, measured: Bool) -> float:
    """Return the share of metres whose nearest station saw both rails; 0 without a track."""
    if not measured.any():
        return 0.0
    k = np.abs(track.chainage[None, :] - begins[measured][:, None] - STEP / 2.0).argmin(axis=1)
    return float(track.seen[k].sum() / len(begins))


def _bend(axis: Alignment, track: Track, middle: Float) -> Float:
    """Return the curvature of the track in plan at places along the axis (n,), 1/m, positive to the right, by metre."""
    low, high = max(middle[0] - _BESIDE, track.chainage[0]), min(middle[-1] + _BESIDE, track.chainage[-1])
    along = np.arange(low, high, STEP)
    if len(along) < 5:
        return np.zeros(len(middle))
    bend = curvature(along, axis.plan_points(along, np.interp(along, track.chainage, track.right)))
    return np.asarray(np.interp(middle, along, bend))


def _arm(places: Float, index: int) -> float:
    return float(np.hypot(*places[index, 1:]))


def _infringements(
    found: Clearance, places: Float, xyz: Float, classes: Any, begins: Float, outlines: list[Outline],
    cluster: dict[int, int | None], surface: Surface,
) -> list[SavedInfringement]:  # fmt: skip
    rows = []
    for one in found.infringements:
        deepest = int(one.points[0])
        ends = outlines[int(np.searchsorted(begins, places[deepest, 0], side="right")) - 1].elements[:, :2]
        at = float(clock(places[deepest, 1:][None], (ends.min(axis=0) + ends.max(axis=0)) / 2.0)[0])
        along = places[one.points, 0]
        rows.append(SavedInfringement((
            float(along.min()), float(along.max()), one.depth, at, one.klass, one.klass not in TEMPORARY_CLASSES,
            cluster.get(deepest),
            len(one.points),
        ), _covered(surface, xyz[one.points], one.klass), xyz[one.points]))  # fmt: skip
    return rows


def _covered(surface: Surface, xyz: Float, klass: int) -> shapely.Geometry | None:
    """Return the area of the unrolled plane within 0.1 m of points on the lining; None for other classes."""
    if klass not in (PointClass.LINING, PointClass.NICHE, PointClass.APPENDAGE):
        return None
    unrolled = surface.unroll(xyz)
    flat = np.column_stack([unrolled.chainage, unrolled.arc])
    flat = flat[np.isfinite(flat).all(axis=1)]
    if not len(flat):
        return None
    area = shapely.union_all(shapely.buffer(shapely.points(flat), 0.1, quad_segs=2))
    return shapely.MultiPolygon([area] if area.geom_type == "Polygon" else list(area.geoms))
