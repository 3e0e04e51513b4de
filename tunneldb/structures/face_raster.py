"""Unrolled pixels of each face, scan by scan: face and pixel of each point, and sums of its intensity."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Float, Int32, Int64, Single, UInt16
from tunneldb.compiled import inner, kernel
from tunneldb.structures.merging import Faces
from tunneldb.structures.models import RADIUS, distance, gradient, unroll
from tunneldb.structures.voxel_grid import VoxelGrid
from tunneldb.structures.voxel_moments import find_slot, key_table, voxel_key
from tunneldb.threads import in_blocks

CANDIDATES = 4
"""Maximum number of faces that a point in a voxel may be on."""

TOLERANCE = 3.5
"""Standard deviations, of the noise along the oblique beam or of the face's own, within which a point is on a face."""

MIN_POINT_TOLERANCE = 0.0015
"""Maximum distance of a point on a face, m."""

BEAM, DIVERGENCE = 0.003, 0.0003
"""Diameter of a beam at the scanner, m, and its increase per metre: of a typical terrestrial scanner."""

POINTS_A_PIXEL = 2.0
"""Mean number of points of a pixel."""

FINEST, COARSEST = 0.003, 0.05
"""Limits of a pixel's side, m."""

MAX_PIXELS = 40_000_000
"""Maximum number of pixels of all faces and scans; beyond it pixels are made larger."""

BLOCK = 1 << 15
"""Number of points that a thread processes at a time."""

STEP = 0.01
"""Step in which levels are summed, dB."""

NONE = np.int32(-(2**31))
"""Level of a point without intensity."""


@dataclass(frozen=True)
class Layout:
    """Places of each face's pixels in one long array.

    Attributes
    ----------
    models : (k, WIDTH) float array
    pixel : (k,) float array
        Side of a pixel, m.
    shape : (k, 4) int array
        Lowest column and row, counted from the model's own point, number of columns and of rows.
    start : (k, scans) int array
        First pixel of a face as a scan sees it, -1 where it does not.
    size : int
        Pixels of all.
    """

    models: Float
    pixel: Float
    shape: Int64
    start: Int64
    size: int

    def centres(self, face: int) -> tuple[Float, Float]:
        """Return the unrolled coordinates u (columns,) and v (rows,) of a face's pixels, m."""
        column, row, columns, rows = self.shape[face]
        return (column + np.arange(columns) + 0.5) * self.pixel[face], (row + np.arange(rows) + 0.5) * self.pixel[face]


@dataclass(frozen=True)
class Sums:
    """Number of points in each pixel, and the sum of their levels in steps of `STEP` dB."""

    count: UInt16
    level: Int32

    @classmethod
    def empty(cls, size: int) -> Sums:
        """Make empty sums."""
        return cls(np.zeros(size, np.uint16), np.zeros(size, np.int32))


class PointFinder:
    """Finds the face and the pixel of points.

    Parameters
    ----------
    grid : VoxelGrid
    candidates : (n, CANDIDATES) int32 array
        Faces in or beside each voxel.
    faces : Faces
    layout : Layout
    stations : (scans, 3) float array
        m from the grid's origin.
    noise : float
        Standard deviation of ranges, m.
    """

    def __init__(self, grid: VoxelGrid, candidates: Int32, faces: Faces, layout: Layout, stations: Float, noise: float) -> None:
        self.origin, self.edge = grid.origin, grid.edge
        self.keys, self.table = grid.keys, key_table(grid.keys)
        self.candidates, self.layout, self.stations, self.noise = candidates, layout, stations, noise
        self.rms = faces.rms

    def find(self, xyz: Float, scan: Int32) -> tuple[Int32, Int32]:
        """Return the face of points (n, 3) of scans (n,), -1 for none, and their pixel in it: row × columns + column.

        -2 - pixel within a beam's footprint of another face.
        """
        face, pixel = np.empty(len(xyz), np.int32), np.empty(len(xyz), np.int32)
        layout = self.layout
        xyz, scan = np.ascontiguousarray(xyz), np.ascontiguousarray(scan, np.int32)

        def some(begin: int, end: int) -> None:
            of = slice(begin, end)
            _find(
                xyz[of], scan[of], self.origin, self.edge, self.keys, self.table, self.candidates, layout.models, self.rms,
                layout.pixel, layout.shape, self.stations, self.noise, face[of], pixel[of],
            )  # fmt: skip

        in_blocks(some, len(xyz), BLOCK)
        return face, pixel

    def add(self, xyz: Float, scan: Int32, level: Single, sums: Sums) -> None:
        """Add the levels of points, dB; NaN and edge points do not count."""
        face, pixel = self.find(xyz, scan)
        with np.errstate(invalid="ignore"):
            steps = np.where(np.isfinite(level), np.clip(np.rint(level / STEP), -32767, 32767), float(NONE))
        _sum(
            face, pixel, np.ascontiguousarray(scan, np.int32), steps.astype(np.int32), self.layout.start, sums.count, sums.level
        )


def lay_out(grid: VoxelGrid, faces: Faces, scans: int) -> Layout:
    """Lay out the pixels of all faces, with a size that depends on the point density of each."""
    held = np.flatnonzero(faces.owner >= 0)
    order = held[np.argsort(faces.owner[held], kind="stable")]
    owner = faces.owner[order]
    count = len(faces.models)
    starts = np.searchsorted(owner, np.arange(count + 1))
    centroid, scan = grid.centroids, grid.scan
    box, pixel = np.zeros((count, 4)), np.full(count, FINEST)
    for k in range(count):
        of = order[starts[k] : starts[k + 1]]
        u, v, _ = unroll(faces.models[k], centroid[of])
        box[k] = u.min(), v.min(), u.max(), v.max()
        column, row = (np.floor(at / grid.edge).astype(np.int64) for at in (u, v))
        cells = np.unique((row - row.min()) * (np.ptp(column) + 1) + column - column.min())
        spacing = math.sqrt(len(cells) * grid.edge**2 / faces.points[k])
        pixel[k] = min(max(math.sqrt(POINTS_A_PIXEL) * spacing, FINEST), COARSEST)
    seen = np.zeros((count, scans), np.bool_)
    seen[faces.owner[held], scan[held]] = True
    margin = grid.edge + 2.0 * FINEST
    scale = 1.0
    while True:
        side = np.round(scale * pixel, 4)
        low = np.floor((box[:, :2] - margin) / side[:, None]).astype(np.int64)
        high = np.ceil((box[:, 2:] + margin) / side[:, None]).astype(np.int64)
        size = high - low
        area = size.prod(axis=1)
        if (total := int((area * seen.sum(axis=1)).sum())) <= MAX_PIXELS:
            break
        scale *= 1.05 * math.sqrt(total / MAX_PIXELS)
    pixels = (seen * area[:, None]).ravel()
    start = np.where(seen.ravel(), np.cumsum(pixels) - pixels, -1).reshape(count, scans)
    return Layout(faces.models, side, np.column_stack([low, size]), start, total)


def candidates_of(owner: Int32, starts: Int64, neighbours: Int32) -> Int32:
    """Return the faces in each voxel and beside it, (n, CANDIDATES): its own first, then by number of voxels; -1 if none."""
    out = np.full((len(owner), CANDIDATES), -1, np.int32)
    _candidates(owner, starts, neighbours, out)
    return out


@kernel
def _candidates(owner: Int32, starts: Int64, neighbours: Int32, out: Int32) -> None:  # pragma: no cover - compiled
    found, number = np.empty(27, np.int32), np.empty(27, np.int32)
    for i in range(owner.shape[0]):
        many = 0
        if owner[i] >= 0:
            found[0], number[0], many = owner[i], 1000, 1
        for e in range(starts[i], starts[i + 1]):
            face = owner[neighbours[e]]
            if face < 0:
                continue
            k = 0
            while k < many and found[k] != face:
                k += 1
            if k == many:
                found[k], number[k] = face, 0
                many += 1
            number[k] += 1
        for place in range(min(many, out.shape[1])):
            best = place
            for k in range(place + 1, many):
                if number[k] > number[best] or (number[k] == number[best] and found[k] < found[best]):
                    best = k
            found[place], found[best] = found[best], found[place]
            number[place], number[best] = number[best], number[place]
            out[i, place] = found[place]


@inner
def pixel_of(model: Float, side: float, shape: Int64, x: float, y: float, z: float) -> int:  # pragma: no cover - compiled
    """Return the pixel of a place, row × columns + column; -1 outside the face's box."""
    qx, qy, qz = x - model[0], y - model[1], z - model[2]
    ax, ay, az = model[3], model[4], model[5]
    bx, by, bz = model[8], model[9], model[10]
    cx, cy, cz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    across, other = qx * bx + qy * by + qz * bz, qx * cx + qy * cy + qz * cz
    if model[RADIUS] == 0.0:
        u, v = across, other
    else:
        u, v = qx * ax + qy * ay + qz * az, model[RADIUS] * math.atan2(other, across)
    column, row = math.floor(u / side) - shape[0], math.floor(v / side) - shape[1]
    if column < 0 or row < 0 or column >= shape[2] or row >= shape[3]:
        return -1
    return row * shape[2] + column


@kernel
def _find(
    xyz: Float, scan: Int32, origin: Float, edge: float, keys: Int64, table: Int32, candidates: Int32, models: Float,
    rms: Float, side: Float, shape: Int64, stations: Float, noise: float, face: Int32, pixel: Int32,
) -> None:  # pragma: no cover - compiled  # fmt: skip
    per_metre = 1.0 / edge
    for i in range(xyz.shape[0]):
        face[i], pixel[i] = -1, -1
        x, y, z = xyz[i, 0] - origin[0], xyz[i, 1] - origin[1], xyz[i, 2] - origin[2]
        key = voxel_key(x, y, z, scan[i], per_metre)
        if key < 0:
            continue
        voxel = table[find_slot(key, keys, table)]
        if voxel < 0 or candidates[voxel, 0] < 0:
            continue
        tx, ty, tz = stations[scan[i], 0] - x, stations[scan[i], 1] - y, stations[scan[i], 2] - z
        far = math.sqrt(tx * tx + ty * ty + tz * tz)
        best, nearest, second = -1, np.inf, np.inf
        for k in range(candidates.shape[1]):
            f = candidates[voxel, k]
            if f < 0:
                break
            off = abs(distance(models[f], x, y, z))
            gx, gy, gz = gradient(models[f], x, y, z)
            cosine = abs(gx * tx + gy * ty + gz * tz) / far
            limit = max(TOLERANCE * noise * cosine, MIN_POINT_TOLERANCE, min(TOLERANCE * rms[f], 0.006))
            if off < nearest and off <= limit:
                second = nearest
                best, nearest = f, off
            elif off < second:
                second = off
        if best < 0:
            continue
        at = pixel_of(models[best], side[best], shape[best], x, y, z)
        if at < 0:
            continue
        face[i] = best
        pixel[i] = at if second > 0.5 * (BEAM + DIVERGENCE * far) else -2 - at


@kernel
def _sum(
    face: Int32, pixel: Int32, scan: Int32, level: Int32, start: Int64, count: UInt16, total: Int32
) -> None:  # pragma: no cover - compiled
    for i in range(face.shape[0]):
        if face[i] >= 0 and pixel[i] >= 0 and level[i] != NONE:
            first = start[face[i], scan[i]]
            if first >= 0 and count[first + pixel[i]] < 65535:
                count[first + pixel[i]] += 1
                total[first + pixel[i]] += level[i]
