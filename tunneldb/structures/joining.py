"""Surfaces: faces of one plane or pipe that something before it parts (Ono et al., 3.2.1 to 3.2.4).

Two faces are joined if they are on one plane or cylinder (3.2.1), have two rims in common, or one and a short gap along it
(3.2.2 and 3.2.3), and if beams through the gap between them returned from nearer objects (3.2.4).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely
from scipy.cluster.hierarchy import DisjointSet
from scipy.spatial import cKDTree

from tunneldb.arrays import Bool, Float, Int32, Int64, Single
from tunneldb.compiled import kernel
from tunneldb.structures.merging import ANGLE, MAX_DISTANCE_IN_SCAN
from tunneldb.structures.models import AXIS, POINT, RADIUS, SIDE, normals_at, to_space, unroll

COMMON_ANGLE = 5.0
"""Maximum angle between rims on one line, degrees."""

COMMON_APART = 2.5
"""Maximum distance between rims on one line, in pixels."""

MIN_RIM_PIXELS = 6
"""Minimum length of a rim, in pixels."""

GAP = 0.05
"""Maximum gap along a common rim, in metres (Table 1, whose unit is missing) …"""

GAP_SPACINGS = 10.0
"""… or in pixels, or twice the length of the smaller face."""

OCCLUDED = 0.8
"""Minimum share of the places of the gap without a line of sight through it."""

CLEARANCE = 0.02
"""Distance behind the surface from which a beam has passed through, m."""

MIN_FACING_COSINE, MIN_PIPE_FACING_COSINE = 0.1, 0.5
"""Minimum cosine of the incidence for a line of sight to count: it always passes beside a thin pipe."""

CELL = 0.1
"""Angle of a cell of the range image, degrees."""


class RangeImages:
    """Range image of each scan: the nearest point of each cell.

    Parameters
    ----------
    stations : (k, 3) float array
        m from the origin.
    """

    def __init__(self, stations: Float) -> None:
        self.stations = stations
        # Of many scans the images are coarser, so that they take no more memory.
        self.cell = math.radians(CELL * max(1.0, math.sqrt(len(stations) / 8.0)))
        self.rows, self.columns = round(math.pi / self.cell), round(2.0 * math.pi / self.cell)
        self.nearest: Single = np.full((len(stations), self.rows, self.columns), np.inf, np.float32)

    def add(self, xyz: Float, scan: Int32) -> None:
        """Add points (n, 3), m from the origin, of scans (n,)."""
        _add_ranges(np.ascontiguousarray(xyz), np.ascontiguousarray(scan, np.int32), self.stations, self.cell, self.nearest)

    def closed(self, places: Float, scan: int) -> Bool:
        """Return True for places (n, 3) at or beyond the range seen by a scan: it does not see behind them."""
        row, column, far = self._cell(places, scan)
        nearest = self.nearest[scan]
        seen = nearest[row, column]
        # An empty cell takes the nearest of those about it: rays may lie farther apart than cells.
        empty = np.flatnonzero(np.isinf(seen))
        for i in (-1, 0, 1):
            for j in (-1, 0, 1):
                about = nearest[np.clip(row[empty] + i, 0, self.rows - 1), (column[empty] + j) % self.columns]
                seen[empty] = np.minimum(seen[empty], about)
        return np.asarray(seen < far + CLEARANCE)

    def _cell(self, places: Float, scan: int) -> tuple[Int64, Int64, Float]:
        """Return row, column and distance of places (n, 3)."""
        towards = places - self.stations[scan]
        far = np.linalg.norm(towards, axis=1)
        row = np.clip(((np.arcsin(towards[:, 2] / far) + math.pi / 2) / self.cell).astype(np.int64), 0, self.rows - 1)
        column = ((np.arctan2(towards[:, 1], towards[:, 0]) + math.pi) / self.cell).astype(np.int64) % self.columns
        return row, column, far


@dataclass(frozen=True)
class Extent:
    """A face, as joining looks at it.

    Attributes
    ----------
    model : (WIDTH,) float array
    outline : MultiPolygon
        Unrolled, m.
    pixel : float
        m.
    scans : tuple of int
        Scans that saw it.
    points : float
    rms : float
        Distance of its points from the model, m.
    """

    model: Float
    outline: shapely.MultiPolygon
    pixel: float
    scans: tuple[int, ...]
    points: float
    rms: float = 0.0


def join(faces: list[Extent], images: RangeImages, noise: float) -> Int64:
    """Return the surface of each face (n,), numbered from 0 in the order of their first faces.

    Parameters
    ----------
    faces : list of Extent
        The largest first.
    images : RangeImages
    noise : float
        Standard deviation of ranges, m.
    """
    found = DisjointSet(range(len(faces)))
    rims = [_rims(face.outline, face.pixel) if face.model[RADIUS] == 0.0 else np.empty((0, 5)) for face in faces]
    for a, b in coplanar(faces, noise):
        if not found.connected(a, b) and _joined(faces[a], faces[b], rims[a], rims[b], images, noise):
            found.merge(a, b)
    return numbered(found)


def numbered(found: DisjointSet) -> Int64:
    """Return the subset number of each element (n,), from 0 in the order of their first elements."""
    number = np.empty(len(found), np.int64)
    for place, subset in enumerate(sorted(found.subsets(), key=min)):
        number[list(subset)] = place
    return number


def coplanar(faces: list[Extent], noise: float) -> list[tuple[int, int]]:
    """Pair faces on one plane or cylinder (3.2.1): the smaller is on the surface of the larger."""
    if not faces:
        return []
    models = np.array([face.model for face in faces])
    places = [_corners(face) for face in faces]
    middles = np.array([at.mean(axis=0) for at in places])
    least, found = math.cos(math.radians(ANGLE)), []
    for a in range(len(faces)):
        one = models[a]
        apart = max(MAX_DISTANCE_IN_SCAN, 3.0 * noise, 3.0 * faces[a].rms if is_rough(faces[a], noise) else 0.0)
        alike = (models[:, RADIUS] > 0.0) == (one[RADIUS] > 0.0)
        alike[: a + 1] = False
        turn = models[:, AXIS] @ one[AXIS]
        if one[RADIUS] == 0.0:
            alike &= (turn > least) & (np.abs((middles - one[POINT]) @ one[AXIS]) < apart)
        else:
            alike &= (np.abs(turn) > least) & (models[:, SIDE] == one[SIDE])
            alike &= np.abs(models[:, RADIUS] - one[RADIUS]) < np.maximum(0.05 * one[RADIUS], apart)
        for b in np.flatnonzero(alike).tolist():
            off = np.abs(unroll(one, places[b])[2]).mean()
            back = np.abs(unroll(models[b], places[a])[2]).mean()
            if one[RADIUS] > 0.0:
                back = off  # a short piece knows its axis less well than a long one
            if off < apart and (back < 4.0 * apart):
                found.append((a, b))
    return found


def _corners(face: Extent) -> Float:
    """Return places along a face's outline (n, 3)."""
    at = shapely.get_coordinates(face.outline)
    return to_space(face.model, at[:, 0], at[:, 1])


def _joined(one: Extent, other: Extent, rims: Float, others: Float, images: RangeImages, noise: float) -> bool:
    """Return True if only objects in front separate two faces of one surface, given their rims."""
    common: list[Float] = []
    pixel = max(one.pixel, other.pixel)
    if _continued(one, other, pixel, noise):
        return True
    if one.model[RADIUS] == 0.0:
        common = _common_rims(rims, _rims_on(one.model, other.model, others), pixel)
        if not common:
            return False
    moved = _unrolled_on(one, other)
    if one.outline.is_empty or moved.is_empty:
        return False
    if len(common) == 1 and _gap_along(common[0], one.outline, moved) > _longest_gap(one, other, pixel):
        return False
    return _occluded(one, moved, set(one.scans) | set(other.scans), images)


def is_rough(face: Extent, noise: float) -> bool:
    """Return True for a plane whose relief exceeds the noise, as masonry."""
    return bool(face.model[RADIUS] == 0.0 and face.rms > noise)


def _continued(one: Extent, other: Extent, pixel: float, noise: float) -> bool:
    """Return True if two rough planes touch: the relief of stones divides their wall along ragged lines, without rims."""
    return (
        is_rough(one, noise)
        and is_rough(other, noise)
        and bool(shapely.dwithin(one.outline, _unrolled_on(one, other), COMMON_APART * pixel))
    )


def _longest_gap(one: Extent, other: Extent, pixel: float) -> float:
    smaller = min(math.sqrt(one.outline.area), math.sqrt(other.outline.area))
    return max(GAP, GAP_SPACINGS * pixel, 2.0 * smaller)


def _unrolled_on(one: Extent, other: Extent) -> shapely.MultiPolygon:
    """Return the outline of a face in the unrolled coordinates of another; empty if it has no area there."""

    def move(at: Float) -> Float:
        u, v, _ = unroll(one.model, to_space(other.model, at[:, 0], at[:, 1]))
        return np.column_stack([u, v])

    return shapely.make_valid(shapely.transform(other.outline, move), method="structure", keep_collapsed=False)


def _rims(outline: shapely.Geometry, pixel: float) -> Float:
    """Return the straight pieces of an outline (n, 5), the longest first: middle (2), direction (2), length."""
    found = [np.empty((0, 5))]
    for part in shapely.get_parts(outline):
        ring = shapely.get_coordinates(shapely.simplify(part.exterior, 2.0 * pixel))
        step = np.diff(ring, axis=0)
        length = np.linalg.norm(step, axis=1)
        long = length >= MIN_RIM_PIXELS * pixel
        middle, along = 0.5 * (ring[:-1] + ring[1:])[long], step[long] / length[long, None]
        found.append(np.column_stack([middle, along, length[long]]))
    rims = np.concatenate(found)
    return rims[np.argsort(-rims[:, 4], kind="stable")]


def _rims_on(plane: Float, other: Float, rims: Float) -> Float:
    """Return the rims of a plane in the unrolled coordinates of another."""
    half = 0.5 * rims[:, 4:] * rims[:, 2:4]
    ends = (to_space(other, at[:, 0], at[:, 1]) for at in (rims[:, :2] - half, rims[:, :2] + half))
    first, last = (np.column_stack(unroll(plane, at)[:2]) for at in ends)
    step = last - first
    length = np.linalg.norm(step, axis=1)
    return np.column_stack([0.5 * (first + last), step / np.maximum(length, 1e-12)[:, None], length])


def _common_rims(mine: Float, yours: Float, pixel: float) -> list[Float]:
    """Return the lines (middle, direction, length) that are rims of both (3.2.2), without duplicates."""
    found: list[Float] = []
    least = math.cos(math.radians(COMMON_ANGLE))
    i, j = np.nonzero(np.abs(mine[:, 2:4] @ yours[:, 2:4].T) >= least)
    first = (mine[i, 4] >= yours[j, 4])[:, None]
    longer, shorter = np.where(first, mine[i], yours[j]), np.where(first, yours[j], mine[i])
    across = np.column_stack([-longer[:, 3], longer[:, 2]])
    middle = np.einsum("ni,ni->n", shorter[:, :2] - longer[:, :2], across)
    half = 0.5 * shorter[:, 4] * np.einsum("ni,ni->n", shorter[:, 2:4], across)
    off = 0.5 * (np.abs(middle - half) + np.abs(middle + half))
    for line in longer[off <= COMMON_APART * pixel]:
        if all(abs(known[2:4] @ line[2:4]) < least or _apart(known, line) > COMMON_APART * pixel for known in found):
            found.append(line)
    return found


def _apart(one: Float, other: Float) -> float:
    return float(abs((other[:2] - one[:2]) @ np.array([-one[3], one[2]])))


def _gap_along(line: Float, one: shapely.Geometry, other: shapely.Geometry) -> float:
    """Return the gap between two faces along a line (3.2.3)."""
    spans = []
    for shape in (one, other):
        at = (shapely.get_coordinates(shape) - line[:2]) @ line[2:4]
        spans.append((at.min(), at.max()))
    return max(spans[0][0] - spans[1][1], spans[1][0] - spans[0][1], 0.0)


def _occluded(one: Extent, moved: shapely.Geometry, scans: set[int], images: RangeImages) -> bool:
    """Return True if no scan that saw one of two faces sees through between them (3.2.4).

    Beams there returned from nearer objects, or from the surface itself, which continues where points are too few for a face.
    """
    places = _gap_places(one.outline, moved, one.pixel)
    if not len(places):
        return True  # they touch
    space = to_space(one.model, places[:, 0], places[:, 1])
    normal = normals_at(one.model, places[:, 0], places[:, 1])
    least = MIN_PIPE_FACING_COSINE if one.model[RADIUS] > 0.0 else MIN_FACING_COSINE
    closed, faced = np.ones(len(space), np.bool_), np.zeros(len(space), np.bool_)
    for scan in sorted(scans):
        towards = images.stations[scan] - space
        faces = np.einsum("ni,ni->n", towards, normal) > least * np.linalg.norm(towards, axis=1)
        closed &= ~faces | images.closed(space, scan)
        faced |= faces
    return bool(faced.any() and closed[faced].mean() >= OCCLUDED)


def _gap_places(one: shapely.Geometry, other: shapely.Geometry, pixel: float) -> Float:
    """Return places (n, 2) between the facing rims of two faces, on the shortest paths between them."""
    ends = []
    for shape in (one, other):
        dense = shapely.get_coordinates(shapely.segmentize(shape.boundary, 2.0 * pixel))
        ends.append(dense[:: max(1, len(dense) // 2000)])
    found = []
    for here, there in (ends, ends[::-1]):
        far, which = cKDTree(there).query(here)
        # Rims that turn away from the other face have their shortest way along it; the facing ones are the nearer half.
        facing = far <= np.quantile(far, 0.25) * 1.5 + 2.0 * pixel
        chosen = np.flatnonzero(facing)[:: max(1, int(facing.sum()) // 60)]
        way = there[which[chosen]] - here[chosen]
        found += [here[chosen] + share * way for share in (0.2, 0.35, 0.5, 0.65, 0.8)]
    places = np.concatenate(found)
    points = shapely.points(places)
    shapely.prepare([one, other])
    return places[~shapely.dwithin(one, points, pixel) & ~shapely.dwithin(other, points, pixel)]


@kernel
def _add_ranges(xyz: Float, scan: Int32, stations: Float, cell: float, nearest: Single) -> None:  # pragma: no cover - compiled
    rows, columns = nearest.shape[1], nearest.shape[2]
    for i in range(xyz.shape[0]):
        s = scan[i]
        x, y, z = xyz[i, 0] - stations[s, 0], xyz[i, 1] - stations[s, 1], xyz[i, 2] - stations[s, 2]
        far = math.sqrt(x * x + y * y + z * z)
        if not far > 0.0:
            continue
        row = min(max(int((math.asin(z / far) + math.pi / 2) / cell), 0), rows - 1)
        column = int((math.atan2(y, x) + math.pi) / cell) % columns
        if far < nearest[s, row, column]:
            nearest[s, row, column] = far
