"""All that is done with each point of a scan file, in one compiled pass: unrolled, seen, corrected, given its pixel.

The formulas are those of `Surface.unroll`, `Edges.normals_of`, `PoseModel.positions`, `observe` and `Observations.corrected`,
whose compiled parts are called here. What is known of the point before (its segment, section and degree, interval of the
trajectory and of the reference curve) shortens the search and changes nothing of what is found, so that neither the
order of points nor the number of threads does. Points are unrolled block by block, so that what is found lies in the
processor's cache when their pixels are looked for.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tunneldb.arrays import Bool, Float, Int32, Int64, Single
from tunneldb.compiled import point_inner, point_kernel
from tunneldb.geometry.unrolling import to_plane
from tunneldb.pointcloud.poses import known_interval, position_at, station_of
from tunneldb.radiometry.correction import decibel, reference_at
from tunneldb.radiometry.edge_normals import face_at, face_normal
from tunneldb.raster.limits import Limits, near_surface, steep_enough, within_range
from tunneldb.threads import in_blocks

BLOCK = 8192
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
    """Scanner positions, see `PoseModel`; no longer interval of the trajectory than ``longest`` (s) is interpolated over.

    Where there are none at all, intensity is taken as it is.
    """

    scan_id: Int64
    station: Float
    time: Float
    track: Float
    longest: float


class CorrectionArrays(NamedTuple):
    """Correction of intensity.

    ``wanted`` is False for a survey without it, then nothing below counts. ``knots`` (m) and ``values`` (dB) are the
    reference curve, empty where none is needed; ``low`` and ``high`` (m) the ranges that it serves for; ``loss`` is the
    loss by incidence at each of COSINES steps of the cosine from 0 to 1, dB.
    """

    wanted: bool
    linear: bool
    knots: Float
    values: Float
    low: float
    high: float
    loss: Float


class PixelTarget(NamedTuple):
    """Destination of points.

    ``low`` and ``high`` (3) are the box of points to look at, m; ``limits`` are those of depth, range and incidence; ``west``
    is the chainage at column 0, m; ``bottom`` the arc of the lower edge of the last row, in pixels; ``first`` to ``stop`` are
    the columns that take points, ``start`` to ``end`` those of the kilometre itself. The floor begins at the arcs ``left`` and
    ``right`` (m) at each metre from ``floor`` on.
    """

    low: Float
    high: Float
    limits: Limits
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


class BlockPoints(NamedTuple):
    """Points of a block: ``xyz``, ``unrolled`` and the surface's ``normals`` (n, 3), m, and columns of the file (n,)."""

    xyz: Float
    unrolled: Float
    normals: Float
    time: Float
    scan_id: Int32
    intensity: Single


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

    def part(self, begin: int, end: int) -> Pixels:
        """Return the pixels of the points from ``begin`` to before ``end``, as views."""
        return Pixels(
            self.row[begin:end], self.column[begin:end], self.weight[begin:end],
            self.offset[begin:end], self.raw[begin:end], self.corrected[begin:end],
        )  # fmt: skip


class ProjectionCounts(NamedTuple):
    """Counts of `project`.

    Points used in the kilometre itself; those whose scanner position is unknown (they go nowhere); of the others, in the
    halo too, that are not floor, how many there are, how many lie outside the reference curve's ranges (they go nowhere
    either), and the nearest and farthest range, m.
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
    found: list[tuple[int, int, int, int, float, float]] = []

    def block(begin: int, end: int) -> None:
        part = slice(begin, end)
        unrolled, normals = np.empty((end - begin, 3)), np.empty((end - begin, 3))
        to_plane(*shape, target.low, target.high, xyz[part], unrolled, normals)
        points = BlockPoints(xyz[part], unrolled, normals, time[part], scan_id[part], intensity[part])
        found.append(_project(faces, scanner, optics, target, points, pixels.part(begin, end)))

    in_blocks(block, len(xyz), BLOCK)
    used, lost, lining, outside, nearest, farthest = zip(*found, strict=True) if found else ((),) * 6
    return ProjectionCounts(
        sum(used), sum(lost), sum(lining), sum(outside), min(nearest, default=np.inf), max(farthest, default=-np.inf)
    )


@point_inner
def pixel_weight(cosine: float, distance: float, least: float, far: float) -> int:  # pragma: no cover - compiled
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


@point_inner
def loss_at(loss: Float, cosine: float) -> float:  # pragma: no cover - compiled
    """Return the loss by incidence at a cosine, dB, interpolated in the table ``loss`` of COSINES steps."""
    place = cosine * COSINES
    step = int(place)
    if step > COSINES - 1:
        step = COSINES - 1
    return loss[step] + (place - step) * (loss[step + 1] - loss[step])


@point_inner
def on_floor(left: Float, right: Float, place: float, arc: float) -> bool:  # pragma: no cover - compiled
    """Return True if an arc (m) belongs to the floor, which begins at ``left`` and ``right`` at each metre of ``place``."""
    metre = int(np.rint(place))
    metre = 0 if metre < 0 else (metre if metre < left.shape[0] else left.shape[0] - 1)
    return not left[metre] < arc < right[metre]


@point_kernel
def _project(
    faces: EdgeArrays,
    scanner: PoseArrays,
    optics: CorrectionArrays,
    target: PixelTarget,
    points: BlockPoints,
    pixels: Pixels,
) -> tuple[int, int, int, int, float, float]:  # pragma: no cover - compiled
    """Project a block of unrolled points, see `project`."""
    limits = target.limits
    feet, face_normals, sharp = faces.feet, faces.normals, faces.sharp
    trajectory, track, scans = scanner.time, scanner.track, scanner.scan_id
    knots, values, loss = optics.knots, optics.values, optics.loss
    left, right = target.left, target.right
    posed = trajectory.shape[0] > 0 or scans.shape[0] > 0
    curve = knots.shape[0] > 0
    moment, knot, station, scan = np.int64(0), np.int64(0), np.int64(-1), np.int64(-1)
    used, lost, lining, outside = 0, 0, 0, 0
    nearest, farthest = np.inf, -np.inf
    for k in range(points.xyz.shape[0]):
        pixels.column[k] = -1
        chainage, arc, offset = points.unrolled[k, 0], points.unrolled[k, 1], points.unrolled[k, 2]
        if not near_surface(offset, limits):
            continue
        c = np.floor((chainage - target.west) * target.per_metre)
        r = target.rows - 1 - (np.floor(arc * target.per_metre) - target.bottom)
        if c < target.first or c >= target.stop or r < 0 or r >= target.rows:
            continue
        raw, corrected, weight = 0.0, 0.0, 1
        if optics.wanted and not posed:
            raw = decibel(points.intensity[k], optics.linear)
            if not np.isfinite(raw):
                continue
            corrected = raw
        elif optics.wanted:
            x, y, z = points.xyz[k, 0], points.xyz[k, 1], points.xyz[k, 2]
            if trajectory.shape[0] > 0:
                moment, known = known_interval(trajectory, scanner.longest, points.time[k], moment)
                if not known:
                    lost += 1
                    continue
                dx, dy, dz = position_at(trajectory, track, points.time[k], moment)
            else:
                if station < 0 or points.scan_id[k] != scan:
                    scan = np.int64(points.scan_id[k])
                    station = station_of(scans, scan)
                if station < 0:
                    lost += 1
                    continue
                dx, dy, dz = scanner.station[station, 0], scanner.station[station, 1], scanner.station[station, 2]
            dx, dy, dz = dx - x, dy - y, dz - z
            distance = np.sqrt(dx * dx + dy * dy + dz * dz)
            if not within_range(distance, limits):
                continue
            nx, ny, nz = points.normals[k, 0], points.normals[k, 1], points.normals[k, 2]
            if faces.any:
                along, across = face_at(faces.start, faces.first, sharp, chainage, arc)
                if along >= 0:
                    nx, ny, nz = face_normal(feet, face_normals, along, across, x, y, z)
            cosine = (dx * nx + dy * ny + dz * nz) / (distance if distance > 1e-9 else 1e-9)
            if cosine > 1.0:
                cosine = 1.0
            raw = decibel(points.intensity[k], optics.linear)
            if not steep_enough(cosine, limits) or not np.isfinite(raw):
                continue
            corrected = raw - loss_at(loss, cosine)
            weight = pixel_weight(cosine, distance, limits.cosine, limits.far)
            if curve:
                level, knot = reference_at(knots, values, distance, knot)
                corrected -= level
                if not on_floor(left, right, chainage - target.floor, arc):
                    lining += 1
                    if distance < nearest:
                        nearest = distance
                    if distance > farthest:
                        farthest = distance
                    if distance < optics.low or distance > optics.high:
                        outside += 1
                        continue
        pixels.row[k] = int(r)
        pixels.column[k] = int(c)
        pixels.weight[k] = weight
        pixels.offset[k] = offset
        pixels.raw[k] = raw
        pixels.corrected[k] = corrected
        if target.start <= c < target.end:
            used += 1
    return used, lost, lining, outside, nearest, farthest
