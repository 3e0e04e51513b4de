"""All that is done with each point of a scan file, in one compiled pass: unrolled, seen, corrected, given its pixel.

The formulas are those of `Surface.unroll`, `Edges.normals_of`, `PoseModel.positions`, `observe` and `Observations.corrected`,
whose compiled parts are called here. What is known of the point before (its segment, section and degree, interval of the
trajectory and of the reference curve) shortens the search and changes nothing of what is found, so that neither the
order of points nor the number of threads does.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit, prange

from tunneldb.arrays import Bool, Float, Int32, Int64, Single
from tunneldb.geometry.unrolling import NOWHERE, unroll_point
from tunneldb.pointcloud.poses import TIME_TOLERANCE, interval, position_at
from tunneldb.radiometry.correction import level_of, reference_at
from tunneldb.radiometry.edge_normals import face_at, face_normal

BLOCK = 4096
"""Points that a thread takes at a time."""

WEIGHT = 64
"""Weight of a point seen straight on from near by; that of one at the limits of range or incidence is 1."""

COSINES = 2048
"""Steps of the cosine at which the loss by incidence is computed; between them it is interpolated, to less than 0.001 dB."""


class SurfaceArrays(NamedTuple):
    """A surface, see `Surface`."""

    segments: Float
    number: Int64
    ends: Float
    chainages: Float
    radius: Float
    arcs: Float
    reach: float


class EdgeArrays(NamedTuple):
    """Edges, see `Edges`; ``any`` tells whether there are any."""

    any: bool
    start: float
    first: float
    feet: Float
    normals: Float
    sharp: Bool


class PoseArrays(NamedTuple):
    """Scanner positions, see `PoseModel`."""

    scan_id: Int64
    station: Float
    time: Float
    track: Float


class CorrectionArrays(NamedTuple):
    """How intensity is corrected.

    ``wanted`` is False for a survey without it, then nothing below counts. ``knots`` (m) and ``values`` (dB) are the
    reference curve, empty where none is needed; ``low`` and ``high`` (m) the ranges that it serves for; ``loss`` is the
    loss by incidence at each of COSINES steps of the cosine from 0 to 1, dB; points seen at a lower cosine than ``cosine``
    or from farther than ``far`` (m) are left out.
    """

    wanted: bool
    linear: bool
    knots: Float
    values: Float
    low: float
    high: float
    loss: Float
    cosine: float
    far: float


class PixelTarget(NamedTuple):
    """Where points go.

    ``low`` and ``high`` (3) are the box of points to look at, m; ``tolerance`` and ``recess`` the greatest distances in
    front of the surface and behind it, m; ``west`` the chainage at column 0, m; ``bottom`` the arc of the lower edge of the
    last row, in pixels; ``first`` to ``stop`` are the columns that take points, ``start`` to ``end`` those of the kilometre
    itself. The floor begins at the arcs ``left`` and ``right`` (m) at each metre from ``floor`` on.
    """

    low: Float
    high: Float
    tolerance: float
    recess: float
    west: float
    per_metre: float
    bottom: int
    rows: int
    first: int
    stop: int
    start: int
    end: int
    floor: float
    left: Float
    right: Float


class Pixels(NamedTuple):
    """Pixel of each point (n,) and what it adds there; column -1 for a point that goes nowhere.

    ``row``, ``column`` and ``weight`` are int32, ``offset`` (m), ``raw`` and ``corrected`` (dB) float32 arrays.
    """

    row: Int32
    column: Int32
    weight: Int32
    offset: Single
    raw: Single
    corrected: Single

    @classmethod
    def empty(cls, count: int) -> Pixels:
        """Room for so many points."""
        whole, single = np.empty((3, count), np.int32), np.empty((3, count), np.float32)
        return cls(whole[0], whole[1], whole[2], single[0], single[1], single[2])


class ProjectionCounts(NamedTuple):
    """What `project` counts.

    Points used in the kilometre itself; those whose scanner position is unknown (they go nowhere); of those used, in the
    halo too, that are not floor, how many there are, how many lie outside the reference curve's ranges, and the nearest and
    farthest range, m.
    """

    used: int
    lost: int
    lining: int
    outside: int
    nearest: float
    farthest: float


def project(
    shape: SurfaceArrays,
    faces: EdgeArrays,
    scanner: PoseArrays,
    optics: CorrectionArrays,
    target: PixelTarget,
    xyz: Float,
    time: Float,
    scan_id: Int32,
    intensity: Single,
    pixels: Pixels,
) -> ProjectionCounts:
    """Find the pixel of each point and what it adds there.

    Parameters
    ----------
    shape, faces, scanner, optics, target
        What is the same for all points.
    xyz, time, scan_id, intensity : (n, 3) float64, (n,) float64, int32 and float32 arrays
        Points, see `Points`.
    pixels : Pixels
        Room for at least n points; overwritten.
    """
    counts, ranges = _look(shape, faces, scanner, optics, target, xyz, time, scan_id, intensity, pixels)
    used, lost, lining, outside = counts.sum(axis=0).tolist()
    return ProjectionCounts(
        used, lost, lining, outside, float(ranges[:, 0].min(initial=np.inf)), float(ranges[:, 1].max(initial=-np.inf))
    )


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def weight_of(cosine: float, distance: float, least: float, far: float) -> int:
    """Weight of a point in its pixel, 1 to WEIGHT, by the variance of its corrected intensity.

    An error of the normal goes into the level by the slope of the loss by incidence, for Lambert's law as tan² θ: if at 45°
    that is as large as the noise, the inverse variance is cos² θ. The noise of the signal, which weakens with the square of
    the range, adds to it as R²: here as much as the rest from half the greatest range on (Soudarissanane et al., 2011, find
    both effects). Either factor is lowered by its value at the limit, so that the view of a station fades out where it ends.

    Parameters
    ----------
    cosine, distance : float
        Cosine of the incidence angle and range, m.
    least, far : float
        Least cosine and greatest range that are taken, m.
    """
    floor = least * least
    slant = (cosine * cosine - floor) / (1.0 - floor)
    share = 2.0 * distance / far
    fade = (1.0 / (1.0 + share * share) - 0.2) * 1.25
    return 1 + int((WEIGHT - 1) * slant * fade + 0.5)


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def _loss_at(loss: Float, cosine: float) -> float:
    place = cosine * COSINES
    k = min(int(place), COSINES - 1)
    return float(loss[k] + (place - k) * (loss[k + 1] - loss[k]))


@njit(cache=True, nogil=True, parallel=True, error_model="numpy")
def _look(
    shape: SurfaceArrays,
    faces: EdgeArrays,
    scanner: PoseArrays,
    optics: CorrectionArrays,
    target: PixelTarget,
    xyz: Float,
    time: Float,
    scan_id: Int32,
    intensity: Single,
    pixels: Pixels,
) -> tuple[Int64, Float]:  # pragma: no cover - compiled
    points = xyz.shape[0]
    parts = (points + BLOCK - 1) // BLOCK
    counts = np.zeros((parts, 4), np.int64)
    ranges = np.empty((parts, 2))
    mobile = scanner.time.shape[0] > 0
    curve = optics.knots.shape[0] > 0
    low, high = target.low, target.high
    # By names of their own: Numba drops what is written to a field of a tuple inside a parallel loop.
    row, column, weights = pixels.row, pixels.column, pixels.weight
    offsets, raws, correcteds = pixels.offset, pixels.raw, pixels.corrected
    for part in prange(parts):
        near = NOWHERE
        moment, knot = 0, 0
        station, stands = np.int64(-1), np.int64(-1)
        used, lost, lining, outside = 0, 0, 0, 0
        nearest, farthest = np.inf, -np.inf
        i, end = part * BLOCK, min(points, (part + 1) * BLOCK)
        while i < end:
            x, y, z = xyz[i, 0], xyz[i, 1], xyz[i, 2]
            column[i] = -1
            if x < low[0] or x > high[0] or y < low[1] or y > high[1] or z < low[2] or z > high[2]:
                i += 1
                continue
            afresh = near[0] < 0
            near, chainage, arc, offset, nx, ny, nz = unroll_point(
                shape.segments, shape.number, shape.ends, shape.chainages, shape.radius, shape.arcs, shape.reach,
                x, y, z, near,
            )  # fmt: skip
            if near[0] < 0 and not afresh:
                continue  # the same point again, from nowhere on
            k = i
            i += 1
            if near[0] < 0 or offset > target.tolerance or offset < -target.recess:
                continue
            c = np.floor((chainage - target.west) * target.per_metre)
            r = target.rows - 1 - (np.floor(arc * target.per_metre) - target.bottom)
            if c < target.first or c >= target.stop or r < 0 or r >= target.rows:
                continue
            raw, corrected, weight = 0.0, 0.0, 1
            if optics.wanted:
                if mobile:
                    t = time[k]
                    if t < scanner.time[0] - TIME_TOLERANCE or t > scanner.time[-1] + TIME_TOLERANCE:
                        lost += 1
                        continue
                    moment = interval(scanner.time, t, moment)
                    dx, dy, dz = position_at(scanner.time, scanner.track, t, moment)
                else:
                    if station < 0 or scan_id[k] != stands:
                        stands = np.int64(scan_id[k])
                        station = np.int64(np.searchsorted(scanner.scan_id, stands))
                        if station == scanner.scan_id.shape[0] or scanner.scan_id[station] != stands:
                            station = np.int64(-1)
                    if station < 0:
                        lost += 1
                        continue
                    dx, dy, dz = scanner.station[station, 0], scanner.station[station, 1], scanner.station[station, 2]
                dx -= x
                dy -= y
                dz -= z
                distance = np.sqrt(dx * dx + dy * dy + dz * dz)
                if distance > optics.far:
                    continue
                if faces.any:
                    along, across = face_at(faces.start, faces.first, faces.sharp, chainage, arc)
                    if along >= 0:
                        nx, ny, nz = face_normal(faces.feet, faces.normals, along, across, x, y, z)
                cosine = min(1.0, (dx * nx + dy * ny + dz * nz) / max(distance, 1e-9))
                raw = level_of(intensity[k], optics.linear)
                if not cosine >= optics.cosine or not np.isfinite(raw):
                    continue
                corrected = raw - _loss_at(optics.loss, cosine)
                weight = weight_of(cosine, distance, optics.cosine, optics.far)
                if curve:
                    level, knot = reference_at(optics.knots, optics.values, distance, knot)
                    corrected -= level
                    metre = int(np.rint(chainage - target.floor))
                    metre = min(max(metre, 0), target.left.shape[0] - 1)
                    if target.left[metre] < arc < target.right[metre]:
                        lining += 1
                        nearest = min(nearest, distance)
                        farthest = max(farthest, distance)
                        if distance < optics.low or distance > optics.high:
                            outside += 1
            row[k] = int(r)
            column[k] = int(c)
            weights[k] = weight
            offsets[k] = offset
            raws[k] = raw
            correcteds[k] = corrected
            used += target.start <= c < target.end
        counts[part, 0], counts[part, 1], counts[part, 2], counts[part, 3] = used, lost, lining, outside
        ranges[part, 0], ranges[part, 1] = nearest, farthest
    return counts, ranges
