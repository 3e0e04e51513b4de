"""Segment a structure into faces from the moments of its voxels, and assign points to them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tunneldb.arrays import Float
from tunneldb.structures.curving import curve
from tunneldb.structures.face_raster import Layout, PointFinder, candidates_of, lay_out
from tunneldb.structures.growing import UNKNOWN_NOISE, grow, noise_of
from tunneldb.structures.merging import Faces, merge, refine
from tunneldb.structures.models import RADIUS, with_directions
from tunneldb.structures.thin_pipes import with_thin_pipes
from tunneldb.structures.voxel_grid import VoxelGrid, voxel_planes
from tunneldb.structures.voxel_moments import COARSEST, VoxelMoments

POINTS_A_VOXEL = 3
"""Minimum number of points of a voxel for half of all points; the voxel edge is the smallest that reaches it."""


@dataclass(frozen=True)
class Segmentation:
    """Faces, and how to find a point's.

    Attributes
    ----------
    edge : float
        Edge of the voxels, m.
    voxels : int
    noise : float
        Standard deviation of ranges, m.
    origin : (3,) float array
        Origin of the models' lengths, m.
    stations : (k, 3) float array
        m from there.
    faces : Faces
    layout : Layout
    finder : PointFinder
    """

    edge: float
    voxels: int
    noise: float
    origin: Float
    stations: Float
    faces: Faces
    layout: Layout
    finder: PointFinder


def find_faces(moments: VoxelMoments, stations: Float) -> Segmentation:
    """Find the faces of a structure.

    Parameters
    ----------
    moments : VoxelMoments
        Moments of all points.
    stations : (k, 3) float array
        Scanner positions, by the numbers of the scans, m.
    """
    level = level_of(moments)
    grid = moments.grid(level)
    at = np.ascontiguousarray(stations - grid.origin)
    starts, neighbours = grid.neighbours()
    towards = at[grid.scan] - grid.centroids
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    noise = noise_of(voxel_planes(grid, starts, neighbours, at, UNKNOWN_NOISE), towards)
    planes = voxel_planes(grid, starts, neighbours, at, noise)
    grown = grow(grid, starts, neighbours, planes, towards, noise)
    faces = merge(grid, starts, neighbours, towards, grown, noise)
    curved = curve(grid, starts, neighbours, faces, noise)
    if curved is not None:
        faces = merge(grid, starts, neighbours, towards, curved, noise)
    faces = with_thin_pipes(moments, level, grid, faces, at, noise)
    round_ = np.append(faces.models[:, RADIUS] > 0.0, False)[faces.owner]
    if round_.any():
        fine, place = moments.within(grid, level, round_, moments.level)
        refine(fine, faces.owner[place], faces, noise)
    faces = replace(faces, models=with_directions(faces.models, _middles(grid, faces)))
    layout = lay_out(grid, faces, len(stations))
    candidates = candidates_of(faces.owner, starts, neighbours)
    finder = PointFinder(grid, candidates, faces, layout, at, noise)
    return Segmentation(grid.edge, len(grid), noise, grid.origin, at, faces, layout, finder)


def level_of(moments: VoxelMoments) -> int:
    """Return the level of the voxels in which faces are grown."""
    for level in range(moments.level, COARSEST, -1):
        counts = np.sort(moments.counts(level))
        until = np.cumsum(counts)
        if len(counts) and counts[np.searchsorted(until, 0.5 * until[-1])] >= POINTS_A_VOXEL:
            return level
    return COARSEST


def _middles(grid: VoxelGrid, faces: Faces) -> Float:
    held = faces.owner >= 0
    owner, count = faces.owner[held], len(faces.models)
    sums = np.column_stack([np.bincount(owner, grid.moments[held, k], count) for k in range(4)])
    return np.asarray(sums[:, 1:] / sums[:, :1])
