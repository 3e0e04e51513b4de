"""Pipes thinner than the voxels tell, from voxels half as wide.

Faces are grown in voxels of one width, by the density of most points. A pipe whose radius is a few of them at most shows as
narrow strips, or as nothing. What is no face, and what may be such a strip, is looked at once more.
"""

from __future__ import annotations

import numpy as np

from tunneldb.arrays import Bool, Float, Int64
from tunneldb.structures.growing import Grown, grow
from tunneldb.structures.merging import Faces, merge
from tunneldb.structures.models import RADIUS, WIDTH
from tunneldb.structures.voxel_grid import VoxelGrid, voxel_planes
from tunneldb.structures.voxel_moments import VoxelMoments, parents

THIN = 4.0
"""Radius, in edges of the usual voxels, up to which a pipe is thin: such voxels have no normal to speak of (see `growing`)."""

TAKEN = 0.5
"""Share of its points by which a voxel, or a strip, is a thin pipe's."""


def with_thin_pipes(moments: VoxelMoments, level: int, grid: VoxelGrid, faces: Faces, stations: Float, noise: float) -> Faces:
    """Faces and the thin pipes that these leave, or lie on as strips.

    Parameters
    ----------
    moments : VoxelMoments
    level : int
        Of the usual voxels.
    grid : VoxelGrid
        These.
    faces : Faces
        Found in them.
    stations : (k, 3) float array
        m from the grid's origin.
    noise : float
        Of ranges, m.
    """
    if level >= moments.level:
        return faces
    fine, place = _some(moments.grid(level + 1), grid, _open(grid, faces))
    if not len(fine):
        return faces
    starts, neighbours = fine.neighbours()
    towards = stations[fine.scan] - fine.centroids
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    grown = grow(fine, starts, neighbours, voxel_planes(fine, starts, neighbours, stations, noise), towards, noise)
    thin = (grown.models[:, RADIUS] > 0.0) & (grown.models[:, RADIUS] <= THIN * grid.edge)
    pipes = merge(fine, starts, neighbours, towards, _chosen(grown, thin), noise)
    return _together(grid, faces, fine, place, pipes)


def _open(grid: VoxelGrid, faces: Faces) -> Bool:
    """Voxels (n,) on no face, on a narrow plane, or on a thin pipe."""
    count = len(faces.models)
    narrow = np.ones(count + 1, np.bool_)
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
    round_ = faces.models[:, RADIUS] > 0.0
    narrow[:count] = np.where(round_, faces.models[:, RADIUS] <= THIN * grid.edge, width <= THIN * grid.edge)
    return narrow[faces.owner]


def _some(fine: VoxelGrid, grid: VoxelGrid, wanted: Bool) -> tuple[VoxelGrid, Int64]:
    """Voxels half as wide as a grid's that lie in some of these, and in which."""
    place = np.searchsorted(grid.keys, parents(fine.keys))
    chosen = wanted[place]
    return VoxelGrid(fine.edge, fine.origin, fine.keys[chosen], fine.moments[chosen]), place[chosen]


def _chosen(grown: Grown, wanted: Bool) -> Grown:
    number = np.append(np.where(wanted, np.cumsum(wanted) - 1, -1), -1).astype(np.int32)
    return Grown(number[grown.owner], grown.models[wanted].reshape(-1, WIDTH), grown.rms[wanted])


def _together(grid: VoxelGrid, faces: Faces, fine: VoxelGrid, place: Int64, pipes: Faces) -> Faces:
    """Faces with thin pipes, which take the voxels, and the strips, that are theirs by most points."""
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
    return Faces(renumbered[owner], models[order], size[order], rms[order])
