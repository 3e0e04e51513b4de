"""Scene without an axis: lining found by clusters and their normals, and a surface of sections fitted to it."""

from __future__ import annotations

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from tunneldb.arrays import Bool, Float, Int64
from tunneldb.classification.objects.dbscan import dbscan
from tunneldb.classification.objects.objects import ClusterSettings, ResidualPoints
from tunneldb.classification.objects.spacing import Spacing
from tunneldb.compiled import kernel
from tunneldb.geometry.frame import frame_of, locate, nearest_segment, segment_rows, tangents
from tunneldb.geometry.normals import principal_planes
from tunneldb.geometry.plan_line import PlanLine
from tunneldb.geometry.robust_plane import DELTA
from tunneldb.geometry.surface import Surface
from tunneldb.geometry.unrolling import CROWN, NODES
from tunneldb.threads import in_blocks

MIN_COHERENCE = 0.8
"""Minimum mean cosine of the angle between neighbouring normals in clusters of lining."""

MIN_HEIGHT_SHARE = 0.5
"""Minimum height of these clusters, as a share of the region of interest's height."""

MIN_POINT_SHARE = 0.02
"""Minimum number of their points, as a share of the region of interest's points."""

MIN_CLOSED_SHARE = 0.6
"""Minimum share of the directions above the ground that a tunnel's lining closes, seen from its middle."""

VERTICES, SECTIONS = 10.0, 2.5
"""Distance of the vertices of the axis and of the sections, m."""

_DEGREES = 2  # width of an angular class of a section
_CLASSES = 360 // _DEGREES
_NOTCH = 5  # classes: 10 degrees; fixtures on the wall are narrower
_MIN_POINTS = 3  # minimum points of a class
_NEIGHBOURS = 16  # of a normal
_BLOCK = 16_384  # points at a time


def find_lining(residual: ResidualPoints, spacing: Spacing, settings: ClusterSettings) -> Bool:
    """Select the points of the lining: clusters of the region by their size and normals, and all above it."""
    kept = residual.height >= residual.top
    region = np.flatnonzero(~kept)
    places = np.column_stack([residual.along * spacing.shrink, residual.across, residual.xyz[:, 2]])[region]
    if len(region) < settings.min_points:
        return kept
    radius = settings.radius * spacing.across
    labels = dbscan(places, radius, settings.min_points)
    count = int(labels.max()) + 1
    if count == 0:
        return kept
    order = np.argsort(labels, kind="stable")
    bounds = np.searchsorted(labels[order], np.arange(count + 1))
    good = np.zeros(count, np.bool_)
    for k in range(count):
        group = order[bounds[k] : bounds[k + 1]]
        size = len(group) >= MIN_POINT_SHARE * len(region)
        share = residual.height[region[group]] / np.maximum(residual.top[region[group]], 1e-9)
        if size and np.ptp(share) >= MIN_HEIGHT_SHARE:
            good[k] = coherence(places[group]) >= MIN_COHERENCE
    kept[region] = (labels >= 0) & good[labels]
    return kept


def coherence(points: Float) -> float:
    """Return the mean cosine between the normals of neighbouring points (n, 3): 1 on a plane, 0.5 if random."""
    points = points[:: 1 + len(points) // 20_000] if len(points) > 40_000 else points
    near = min(_NEIGHBOURS, len(points))
    if near < 4:
        return 0.0
    _, index = cKDTree(points).query(points, k=near)
    normals = np.concatenate(
        [principal_planes(points[index[first : first + _BLOCK]])[1] for first in range(0, len(points), _BLOCK)]
    )
    cosines = [np.abs((normals * normals[neighbour]).sum(axis=1)).mean() for neighbour in index[:, 1:].T]
    return float(np.mean(cosines))


def surface_through(line: PlanLine, along: Float, across: Float, z: Float, wall: Bool) -> Surface | None:
    """Fit sections to points in the frame of a line; None if walls and roof (``wall``) do not close around the middle."""
    if wall.sum() < _MIN_POINTS:
        return None
    first, last = float(along[wall].min()) - 0.5, float(along[wall].max()) + 0.5
    segments = max(1, round((last - first) / VERTICES))
    at = np.linspace(first, last, segments + 1)
    middle = _middles(at, along, across, z, wall)
    vertices = np.column_stack([line.point(at, middle[:, 0]), middle[:, 1]])
    rows = segment_rows(vertices, tangents(vertices))
    ends = np.column_stack([at[:-1], at[1:]])
    count = max(1, round((last - first) / SECTIONS))
    sections = first + (np.arange(count) + 0.5) * (last - first) / count
    places = _placed(rows, ends, np.column_stack([line.point(along, across), z]))
    valid = np.isfinite(places[:, 0])
    (along, u, w), wall = places[valid].T, wall[valid]
    angle = np.mod(np.degrees(np.arctan2(u, w)) + 180.0, 360.0)
    bins = np.minimum((angle / _DEGREES).astype(np.int64), _CLASSES - 1)
    slab = np.clip(((along - first) * count / (last - first)).astype(np.int64), 0, count - 1)
    key = slab * _CLASSES + bins
    radius = _medians(key, np.hypot(u, w), count * _CLASSES).reshape(count, _CLASSES)
    radius = _without_notches(radius)
    walls = np.bincount(key[wall], minlength=count * _CLASSES).reshape(count, _CLASSES) >= _MIN_POINTS
    floor = np.isfinite(radius) & ~walls
    closed = walls.sum(axis=1) / np.maximum(_CLASSES - floor.sum(axis=1), 1)
    roof = walls[:, _CLASSES // 4 : 3 * _CLASSES // 4].mean(axis=1)
    if np.median(np.minimum(closed, roof)) < MIN_CLOSED_SHARE:
        return None
    nodes = _nodes(radius)
    arcs = _arcs(nodes)
    return Surface(np.arange(segments), rows, ends, sections, nodes, arcs, 2.0 * VERTICES)


def _middles(at: Float, along: Float, across: Float, z: Float, wall: Bool) -> Float:
    """Return the middle between the walls and between floor and roof at each vertex: across and z, m.

    The middles of stretches as long as a section's are computed, and a line is fitted to those around a vertex.
    """
    stretch = np.floor((along - at[0]) / SECTIONS).astype(np.int64)
    order = np.argsort(stretch, kind="stable")
    found = []
    for part in np.split(order, np.flatnonzero(np.diff(stretch[order])) + 1):
        sides = part[wall[part]]
        if len(sides) >= _MIN_POINTS:
            middle = np.mean(np.quantile(across[sides], (0.02, 0.98)))
            height = 0.5 * (np.quantile(z[part], 0.02) + np.quantile(z[sides], 0.98))
            found.append((float(along[part].mean()), float(middle), float(height)))
    where, *middles = np.array(found or [(at[0], across[wall].mean(), z[wall].mean())]).T
    out = np.empty((len(at), 2))
    for k, a in enumerate(at):
        near = np.abs(where - a) <= max(VERTICES, float(np.abs(where - a).min()) + 2.0 * SECTIONS)
        for c, values in enumerate(middles):
            _, level = np.polyfit(where[near] - a, values[near], 1) if near.sum() > 2 else (0.0, values[near].mean())
            out[k, c] = level
    return out


def _placed(segments: Float, ends: Float, points: Float) -> Float:
    """Return the chainage of points (n, 3) and their place right of and above the axis, (n, 3), m; NaN beyond its ends."""
    out = np.full((len(points), 3), np.nan)
    number = np.arange(len(segments))
    in_blocks(lambda begin, end: _place(segments, number, ends, points, out, begin, end), len(points), _BLOCK)
    return out


@kernel
def _place(
    segments: Float, number: Int64, ends: Float, points: Float, out: Float, begin: int, end: int
) -> None:  # pragma: no cover - compiled
    for i in range(begin, end):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        k, f = locate(segments, number, nearest_segment(segments, x, y, z), x, y, z)
        if k >= 0:
            ox, oy, oz, tx, ty, tz, rx, ry = frame_of(segments, k, f)
            out[i, 0] = ends[k, 0] + f * (ends[k, 1] - ends[k, 0])
            out[i, 1] = (x - ox) * rx + (y - oy) * ry
            out[i, 2] = (x - ox) * ry * tz - (y - oy) * rx * tz + (z - oz) * (rx * ty - ry * tx)


def _medians(key: Int64, value: Float, count: int) -> Float:
    """Return the median of the values of each key below a count; NaN for fewer than ``_MIN_POINTS``."""
    order = np.lexsort((value, key))
    bounds = np.searchsorted(key[order], np.arange(count + 1))
    size = np.diff(bounds)
    at = np.minimum(bounds[:-1] + size // 2, max(len(value) - 1, 0))
    return np.where(size >= _MIN_POINTS, value[order][at], np.nan)


def _without_notches(radius: Float) -> Float:
    """Remove from sections what protrudes from both its sides by more than δ: a cable or a box on the wall."""
    filled = np.where(np.isnan(radius), 0.0, radius)
    closed = ndimage.grey_closing(filled, size=(1, _NOTCH), mode="wrap")
    return np.where(closed - radius > DELTA, closed, radius)


def _nodes(radius: Float) -> Float:
    """Interpolate the radius at each whole degree from the classes; gaps are bridged, wide ones along the tunnel."""
    centres = (np.arange(_CLASSES) + 0.5) * _DEGREES
    known = np.isfinite(radius).any(axis=0)
    typical = np.interp(centres, centres[known], np.nanmedian(radius[:, known], axis=0), period=360.0)
    out = np.empty((len(radius), NODES))
    for row, classes in zip(out, radius, strict=True):
        deviation = classes - typical
        full = np.isfinite(deviation)
        if full.any():
            deviation = np.interp(centres, centres[full], deviation[full], period=360.0)
        row[:] = np.interp(np.arange(NODES), centres, typical + np.where(np.isfinite(deviation), deviation, 0.0), period=360.0)
    return out


def _arcs(radius: Float) -> Float:
    """Return the length along each section from the crown at each whole degree, m."""
    angle = np.radians(np.arange(NODES) - 180.0)
    u, w = radius * np.sin(angle), radius * np.cos(angle)
    length = np.concatenate([np.zeros((len(radius), 1)), np.cumsum(np.hypot(np.diff(u), np.diff(w)), axis=1)], axis=1)
    return np.asarray(length - length[:, CROWN : CROWN + 1])
