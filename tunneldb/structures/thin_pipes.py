"""Pipes too thin for the voxels, found in finer ones.

Faces are grown in voxels of one width, from the density of most points. A pipe with a radius of a few voxels at most shows as
narrow strips, or not at all. Points on no face, or on a possible strip, are examined again in voxels half as wide, and in
others half as wide as these.
"""

from __future__ import annotations

import numpy as np

from tunneldb.arrays import Bool, Float, Int64
from tunneldb.structures.growing import MIN_RADIUS_SIGMAS, Grown, grow
from tunneldb.structures.merging import Faces, merge
from tunneldb.structures.models import RADIUS, WIDTH
from tunneldb.structures.voxel_grid import VoxelGrid, voxel_planes
from tunneldb.structures.voxel_moments import VoxelMoments

THIN = 4.0
"""Maximum radius of a thin pipe, in voxel edges: such voxels have no usable normal (see `growing`)."""

TAKEN = 0.5
"""Minimum share of a voxel's, or a strip's, points on a thin pipe."""


def with_thin_pipes(moments: VoxelMoments, level: int, grid: VoxelGrid, faces: Faces, stations: Float, noise: float) -> Faces:
    """Return the remaining faces, and thin pipes beside them or on them as strips.

    Parameters
    ----------
    moments : VoxelMoments
    level : int
        Faces in the usual voxels.
    grid : VoxelGrid
        These.
    faces : Faces
        Found in them.
    stations : (k, 3) float array
        m from the grid's origin.
    noise : float
        Standard deviation of ranges, m.
    """
    for finer in range(level + 1, moments.level + 1):
        widest = THIN * 2.0 ** (1 - finer)
        if widest < MIN_RADIUS_SIGMAS * noise:
            break
        fine, place = moments.within(grid, level, _open(grid, faces, widest), finer)
        if len(fine):
            faces = _together(grid, faces, fine, place, _pipes(fine, stations, noise, widest))
    return faces


def _pipes(fine: VoxelGrid, stations: Float, noise: float, widest: float) -> Faces:
    """Find pipes of radii up to ``widest``, m, in voxels."""
    starts, neighbours = fine.neighbours()
    towards = stations[fine.scan] - fine.centroids
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    grown = grow(fine, starts, neighbours, voxel_planes(fine, starts, neighbours, stations, noise), towards, noise)
    thin = (grown.models[:, RADIUS] > 0.0) & (grown.models[:, RADIUS] <= widest)
    return merge(fine, starts, neighbours, towards, _chosen(grown, thin), noise)


def _open(grid: VoxelGrid, faces: Faces, widest: float) -> Bool:
    """Return voxels (n,) on no face, on a plane as narrow as ``widest``, m, or on a pipe of no greater radius."""
    count = len(faces.models)
    held = faces.owner >= 0
    owner, at = faces.owner[held], grid.centroids[held]
    many = np.bincount(owner, minlength=count)
    mean = np.column_stack([np.bincount(owner, at[:, k], count) for k in range(3)]) / np.maximum(many, 1)[:, None]
    off = at - mean[owner]
    spread = np.zeros((count, 3, 3))
    for a in range(3):
        for b in range(3):
            spread[:, a, b] = np.bincount(owner, off[:, a] * off[:, b], count) / np.maximum(many, 1)
    # Evenly covered, a strip's standard deviation across is its width over √12.
    width = np.sqrt(12.0 * np.maximum(np.linalg.eigvalsh(spread)[:, 1], 0.0))
    narrow = np.where(faces.models[:, RADIUS] > 0.0, faces.models[:, RADIUS], width) <= widest
    return np.asarray(np.append(narrow, True)[faces.owner])


def _chosen(grown: Grown, wanted: Bool) -> Grown:
    number = np.append(np.where(wanted, np.cumsum(wanted) - 1, -1), -1).astype(np.int32)
    return Grown(number[grown.owner], grown.models[wanted].reshape(-1, WIDTH), grown.rms[wanted])


def _together(grid: VoxelGrid, faces: Faces, fine: VoxelGrid, place: Int64, pipes: Faces) -> Faces:
    """Add thin pipes to faces; they take the voxels, and the strips, with most points on them."""
    held = np.flatnonzero(pipes.owner >= 0)
    if not len(held):
        return faces
    pairs, number = np.unique(np.column_stack([place[held], pipes.owner[held]]), axis=0, return_inverse=True)
    points = np.bincount(number, fine.moments[held, 0])
    theirs = points > TAKEN * grid.moments[pairs[:, 0], 0]
    voxel, pipe = pairs[theirs].T
    before, count = faces.owner, len(faces.models)
    owner = before.copy()
    lost = np.bincount(before[voxel][before[voxel] >= 0], grid.moments[voxel, 0][before[voxel] >= 0], count)
    gone = lost > TAKEN * faces.points
    owner[np.append(gone, False)[before]] = -1
    owner[voxel] = count + pipe
    models, rms = np.concatenate([faces.models, pipes.models]), np.concatenate([faces.rms, pipes.rms])
    size = np.bincount(owner[owner >= 0], grid.moments[owner >= 0, 0], len(models))
    order = np.lexsort([models[:, 0], -size])
    order = order[size[order] > 0.0]
    renumbered = np.full(len(models) + 1, -1, np.int32)
    renumbered[order] = np.arange(len(order))
    return Faces(renumbered[owner], models[order], size[order].astype(np.float64), rms[order])
