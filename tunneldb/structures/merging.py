"""Merge faces that are one: pieces that touch, and views of several scans of one surface."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Float, Int32, Int64
from tunneldb.compiled import kernel
from tunneldb.structures.growing import MAX_NOISE, Grown
from tunneldb.structures.models import AXIS, POINT, RADIUS, SIDE, distance, fit_cylinder, fit_plane
from tunneldb.structures.voxel_grid import AXIS_BITS, VoxelGrid

ANGLE = 10.0
"""Maximum angle between two such faces, degrees (Ono et al., Table 1)."""

MAX_DISTANCE_IN_SCAN = 0.005
"""Maximum mean distance between two such faces, m (Table 1): registered scans fit that well."""

STEP = 0.002
"""The same within one scan, m, whose only error is noise: plates lie on each other."""

ROUNDS = 6

BLOCK = 100_000
"""Number of voxels whose neighbours are examined together."""

MIN_VOXELS_OF_ROUGH = 250
"""Minimum number of voxels of a face if the flattest surfaces are rougher than scanner noise, as rock or soil."""


@dataclass(frozen=True)
class Faces:
    """Faces, the largest first.

    Attributes
    ----------
    owner : (n,) int32 array
        Face of each voxel, -1 for none.
    models : (k, WIDTH) float array
    points : (k,) float array
        Points of its voxels.
    rms : (k,) float array
        Distance of these from the model, m.
    """

    owner: Int32
    models: Float
    points: Float
    rms: Float


def merge(grid: VoxelGrid, starts: Int64, neighbours: Int32, towards: Float, grown: Grown, noise: float) -> Faces:
    """Merge faces that touch and fit one model, within a scan and across scans.

    Parameters
    ----------
    grid, starts, neighbours
        Voxels, and which touch.
    towards : (n, 3) float array
        Unit vectors to the scanner.
    grown : Grown
    noise : float
        Standard deviation of ranges, m.
    """
    owner, models = grown.owner.copy(), grown.models.copy()
    count = len(models)
    centroid = grid.centroids
    within = touching(owner, starts, neighbours)
    across = _at_one_place(grid.keys, owner)
    tolerance = np.concatenate(
        [np.full(len(within), max(STEP, 3.0 * noise)), np.full(len(across), max(MAX_DISTANCE_IN_SCAN, 3.0 * noise))]
    )
    pairs = np.concatenate([within, across])
    merged_into = np.arange(count)
    for _ in range(ROUNDS):
        sums, held = sums_of(grid, owner, count), MembersOf(owner, count)
        ends = merged_into[pairs]
        differ = ends[:, 0] != ends[:, 1]
        ends, limit = ends[differ], tolerance[differ]
        big = np.where(sums[ends[:, 0], 0] >= sums[ends[:, 1], 0], ends[:, 0], ends[:, 1])
        small = ends.sum(axis=1) - big
        order = np.lexsort([small, big, -sums[big, 0]])
        into = np.arange(count)
        changed = np.zeros(count, np.bool_)
        for k in order.tolist():
            a, b = int(big[k]), int(small[k])
            if changed[a] or (changed[b] and into[b] != b) or into[a] != a:
                continue
            if _fits(models[a], models[b], grid, centroid, sums[b], held(b), limit[k]):
                into[b] = a
                changed[b] = True
        if not changed.any():
            break
        merged_into = into[merged_into]
        owner = np.where(owner >= 0, into[np.maximum(owner, 0)], -1).astype(np.int32)
        held = MembersOf(owner, count)
        sums = sums_of(grid, owner, count)
        for a in np.unique(into[changed]).tolist():
            refit(grid, centroid, sums[a], held(a), noise, models[a])
    return _ordered(grid, centroid, towards, owner, models, noise)


def _ordered(grid: VoxelGrid, centroid: Float, towards: Float, owner: Int32, models: Float, noise: float) -> Faces:
    """Return faces in order of size, oriented to the scanner; those with too much scatter are left out."""
    count = len(models)
    sums, held = sums_of(grid, owner, count), MembersOf(owner, count)
    rms, good = np.zeros(count), np.zeros(count, np.bool_)
    for k in range(count):
        voxels = held(k)
        if not len(voxels):
            continue
        if models[k, RADIUS] == 0.0:
            side = float(np.sum((towards[voxels] @ models[k, AXIS]) * grid.moments[voxels, 0]))
            if side < 0.0:
                models[k, AXIS] *= -1.0
            row = models[k].copy()
            rms[k] = _plane_rms(np.ascontiguousarray(sums[k]), row)
            cosine = np.abs(towards[voxels] @ models[k, AXIS]).mean()
        else:
            rms[k] = float(np.sqrt(np.mean(distances(models[k], centroid[voxels]) ** 2)))
            cosine = 1.0
        good[k] = rms[k] < 3.0 * max(noise * cosine, 0.0005) and (noise < MAX_NOISE or len(voxels) >= MIN_VOXELS_OF_ROUGH)
    order = np.lexsort([models[:, 0], -sums[:, 0]])
    order = order[good[order]]
    number = np.full(count + 1, -1, np.int32)
    number[order] = np.arange(len(order))
    return Faces(number[owner], models[order], sums[order, 0], rms[order])


def distances(model: Float, xyz: Float) -> Float:
    """Return the distance of places (n, 3) from a surface, towards the scanner's side, m."""
    out = np.empty(len(xyz))
    _distances(model, np.ascontiguousarray(xyz), out)
    return out


def refit(grid: VoxelGrid, centroid: Float, sums: Float, voxels: Int64, noise: float, model: Float) -> None:
    """Fit a model again to voxels, in place."""
    if model[RADIUS] == 0.0:
        _plane_rms(np.ascontiguousarray(sums), model)
    else:
        _refit_cylinder(grid.moments, centroid, voxels.astype(np.int32), noise, model)


def refine(fine: VoxelGrid, face: Int32, faces: Faces, noise: float) -> None:
    """Fit cylinders again to finer voxels, in place: those in which they were grown may be as wide as they are.

    Parameters
    ----------
    fine : VoxelGrid
    face : (n,) int32 array
        Face of each of its voxels.
    faces : Faces
    noise : float
        Standard deviation of ranges, m.
    """
    centroid = fine.centroids
    held = MembersOf(face, len(faces.models))
    for k in np.flatnonzero(faces.models[:, RADIUS] > 0.0).tolist():
        voxels = held(k)
        if len(voxels):
            model = faces.models[k].copy()
            _refit_cylinder(fine.moments, centroid, voxels.astype(np.int32), noise, model)
            if abs(model[RADIUS] - faces.models[k, RADIUS]) < 0.2 * faces.models[k, RADIUS] + noise:
                faces.models[k] = model


def _fits(one: Float, other: Float, grid: VoxelGrid, centroid: Float, sums: Float, voxels: Int64, limit: float) -> bool:
    """Return True if the smaller face belongs to the larger one's surface."""
    if (one[RADIUS] == 0.0) != (other[RADIUS] == 0.0):
        # A strip of a cylinder that was taken for flat.
        if one[RADIUS] == 0.0 or len(voxels) > 200:
            return False
        return bool(np.sqrt(np.mean(distances(one, centroid[voxels]) ** 2)) < 0.5 * limit)
    cosine = float(one[AXIS] @ other[AXIS])
    least = math.cos(math.radians(ANGLE))
    if one[RADIUS] == 0.0:
        small = len(voxels) < 60  # their own normals say little
        if cosine < (0.5 if small else least):
            return False
        n = sums[0]
        mean = sums[1:4] / n
        xx, yy, zz, xy, xz, yz = sums[4:] / n
        square = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        normal, at = one[AXIS], float(one[AXIS] @ one[POINT])
        off = normal @ square @ normal - 2.0 * at * float(normal @ mean) + at * at
        return math.sqrt(max(off, 0.0)) < limit
    if abs(cosine) < least or one[SIDE] != other[SIDE]:
        return False
    if abs(one[RADIUS] - other[RADIUS]) > max(0.1 * one[RADIUS], limit):
        return False
    return bool(np.sqrt(np.mean(distances(one, centroid[voxels]) ** 2)) < limit)


def touching(owner: Int32, starts: Int64, neighbours: Int32) -> Int64:
    """Return pairs of faces (m, 2) whose voxels touch, or touch one voxel between them."""
    most, number = max(int(owner.max(initial=-1)) + 1, 1), 0
    pairs = np.empty(0, np.int64)
    for begin in range(0, len(owner), BLOCK):
        end = min(begin + BLOCK, len(owner))
        found = np.empty(starts[end] - starts[begin], np.int64)
        number = _contacts(owner, starts, neighbours, begin, end, most, found)
        pairs = np.union1d(pairs, found[:number])
    return np.column_stack([pairs // most, pairs % most])


def _at_one_place(keys: Int64, owner: Int32) -> Int64:
    """Return pairs of faces (m, 2) of different scans with voxels at one place."""
    held = owner >= 0
    place = keys[held] & ((1 << (3 * AXIS_BITS)) - 1)
    mine = owner[held].astype(np.int64)
    order = np.argsort(place, kind="stable")
    place, mine = place[order], mine[order]
    found = [np.empty((0, 2), np.int64)]
    for step in (1, 2, 3):
        same = (place[step:] == place[:-step]) & (mine[step:] != mine[:-step])
        pair = np.column_stack([mine[:-step][same], mine[step:][same]])
        found.append(np.unique(np.sort(pair, axis=1), axis=0))
    return np.unique(np.concatenate(found), axis=0)


def sums_of(grid: VoxelGrid, owner: Int32, count: int) -> Float:
    """Return the moments (count, 10) of faces."""
    out = np.zeros((count, grid.moments.shape[1]))
    _add_moments(owner, grid.moments, out)
    return out


class MembersOf:
    """Voxels of each face, looked up by its number."""

    def __init__(self, owner: Int32, count: int) -> None:
        self.order = np.argsort(owner, kind="stable")
        self.starts = np.searchsorted(owner[self.order], np.arange(count + 1))

    def __call__(self, face: int) -> Int64:
        """Return the voxels of a face."""
        return self.order[self.starts[face] : self.starts[face + 1]]


@kernel
def _contacts(
    owner: Int32, starts: Int64, neighbours: Int32, begin: int, end: int, most: int, found: Int64
) -> int:  # pragma: no cover - compiled
    """Write pairs of faces with touching voxels, as first × most + second, to ``found``; runs of one pair count once."""
    beside, number, before = np.empty(27, np.int32), 0, np.int64(-1)
    for i in range(begin, end):
        many = 0
        for e in range(starts[i], starts[i + 1]):
            other = owner[neighbours[e]]
            if other < 0 or other == owner[i]:
                continue
            k = 0
            while k < many and beside[k] < other:
                k += 1
            if k < many and beside[k] == other:
                continue
            for m in range(many, k, -1):
                beside[m] = beside[m - 1]
            beside[k] = other
            many += 1
        for k in range(many if owner[i] >= 0 else many - 1):
            first, second = (owner[i], beside[k]) if owner[i] >= 0 else (beside[k], beside[k + 1])
            pair = min(first, second) * most + max(first, second)
            if pair != before:
                found[number], before = pair, pair
                number += 1
    return number


@kernel
def _add_moments(owner: Int32, moments: Float, out: Float) -> None:  # pragma: no cover - compiled
    for i in range(owner.shape[0]):
        if owner[i] >= 0:
            for k in range(out.shape[1]):
                out[owner[i], k] += moments[i, k]


@kernel
def _plane_rms(sums: Float, model: Float) -> float:  # pragma: no cover - compiled
    return fit_plane(sums, model)


@kernel
def _refit_cylinder(
    moments: Float, centroid: Float, voxels: Int32, noise: float, model: Float
) -> float:  # pragma: no cover - compiled
    return fit_cylinder(moments, centroid, voxels, voxels.shape[0], noise, model, 12)


@kernel
def _distances(model: Float, xyz: Float, out: Float) -> None:  # pragma: no cover - compiled
    for i in range(xyz.shape[0]):
        out[i] = distance(model, xyz[i, 0], xyz[i, 1], xyz[i, 2])
