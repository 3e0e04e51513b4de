"""Thinning to survey density: one point per voxel.

A plane with unit normal n cuts (|nx| + |ny| + |nz|) / h² voxels of edge h per square metre: 1/h² if it is parallel to
the grid, √3/h² at the steepest, and 1.5/h² on average over all orientations. So h = √(1.5 / density) keeps the requested
number of points per square metre on a tunnel's lining, which faces all directions; walls parallel to the grid get two thirds
of it.

The measured point nearest to the centre of each voxel is kept. Voxels lie at whole multiples of h of the absolute
coordinates, and ties are decided by the points' own values. So the selection depends only on the set of points: not on
their order, nor on whether they were thinned in parts before.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tunneldb.arrays import Bool, Float, Int32, Int64, Intp, Single, UInt8
from tunneldb.compiled import kernel
from tunneldb.pointcloud.spool import ROW, Rows
from tunneldb.pointcloud.voxels import CellCounts

CUTS = 1.5
TIES = ("x", "y", "z", "time", "intensity", "scan_id", "classification", "tag")
"""Sort keys for rows equally near to the centre of their voxel: the lowest row by these, one after the other, is kept."""

Columns = Sequence[NDArray[Any]]


def voxel_edge(density: float) -> float:
    """Return the voxel edge, m, for a mean density of points per m² on surfaces of all orientations."""
    return math.sqrt(CUTS / density)


def thin(xyz: Float, edge: float) -> Bool:
    """Choose the point nearest to the centre of each voxel.

    Parameters
    ----------
    xyz : (n, 3) float64 array
        Coordinates, m.
    edge : float
        Voxel edge, m.

    Returns
    -------
    (n,) bool array
        True for the points that are kept, one in each occupied voxel.
    """
    rows: Rows = np.zeros(len(xyz), ROW)
    for column, name in enumerate("xyz"):
        rows[name] = xyz[:, column]
    return first_of_voxels(rows, edge, np.ones(len(xyz), np.bool_))[0]


def first_of_voxels(rows: Rows, edge: float, good: Bool) -> tuple[Bool, Bool]:
    """Choose the good row nearest to the centre of each voxel.

    Parameters
    ----------
    rows : (n,) array of ROW
        Rows at the same place are ordered by time, intensity, scan, class and tag, the lowest first.
    edge : float
        Voxel edge, m.
    good : (n,) bool array
        Rows that may be chosen.

    Returns
    -------
    chosen : (n,) bool array
        One row of each voxel that has a good row.
    before : (n,) bool array
        Rows that are not good and would precede it; all rows of a voxel without good rows.
    """
    xyz = np.empty((len(rows), 3))
    for column, name in enumerate("xyz"):
        xyz[:, column] = rows[name]
    voxel, count = _voxels(xyz, edge)
    ties = [rows[name] for name in TIES]
    distance, least, leader = _leaders(xyz, voxel, count, edge, good, ties)
    chosen = np.zeros(len(rows), np.bool_)
    chosen[leader[leader >= 0]] = True
    before = ~good & (distance < least[voxel])
    tied = np.flatnonzero(~good & (distance == least[voxel]))
    before[tied] = _is_lower(ties, tied, leader[voxel[tied]])
    return chosen, before


def pick(
    xyz: Float, time: Float, intensity: Single, scan_id: Int32, classification: UInt8,
    whole: Bool, edge: float, limit: float, points: int,
) -> tuple[Int32, Bool]:  # fmt: skip
    """Choose the points of a chunk that may be the first good one of their voxel.

    The first point of a voxel is certain not to be noise if `points` points, itself included, lie within the distance whose
    square is `limit`: no search radius is less, and the file has at least the points of the chunk. Then only this point is
    picked, otherwise all points of the voxel. All points that are not `whole` are picked, too, since a kilometre may end in
    their voxels.

    Returns
    -------
    picked : (k,) int32 array
        Indices of points.
    certain : (k,) bool array
        True for those that are certain not to be noise.
    """
    voxel, count = _voxels(xyz, edge)
    voxel[~whole] = -1
    _, _, leader = _leaders(xyz, voxel, count, edge, whole, (*xyz.T, time, intensity, scan_id, classification))
    found = np.zeros(count, np.int32)
    _count_near(xyz, voxel, leader, limit, found)
    crowded = (found >= points) & (leader >= 0)
    sure = whole & crowded[voxel]
    staying = ~sure
    staying[leader[crowded]] = True
    picked = np.flatnonzero(staying).astype(np.int32)
    return picked, sure[picked]


def _voxels(xyz: Float, edge: float) -> tuple[Int32, int]:
    """Return the index of the voxel of each point, (n,), and the number of voxels."""
    voxels = CellCounts(edge, max(1024, len(xyz) // 2))
    return voxels.add(xyz), len(voxels.counts)


def _leaders(xyz: Float, voxel: Int32, count: int, edge: float, good: Bool, ties: Columns) -> tuple[Float, Float, Int64]:
    """Find the good point nearest to the centre of each voxel.

    Parameters
    ----------
    xyz, voxel, good : (n, 3), (n,), (n,) arrays
        Points, m; index of the voxel of each, less than the count (-1: none); True for points that may lead.
    ties : sequence of (n,) arrays
        Sort keys for points equally near.

    Returns
    -------
    distance : (n,) float array
        Distance from the centre of the voxel, squared, m².
    least : (count,) float array
        Least distance of the good points of each voxel; infinite if there is none.
    leader : (count,) int array
        Index of the point; -1 for none.
    """
    distance, least = np.empty(len(xyz)), np.full(count, np.inf)
    _find_nearest(xyz, voxel, edge, good, distance, least)
    first = np.flatnonzero(good & (distance == least[voxel]))
    several = np.bincount(voxel[first], minlength=count)[voxel[first]] > 1
    if several.any():
        tied = first[several]
        # The last key is the primary one; equal elements keep their order.
        tied = tied[np.lexsort([column[tied] for column in reversed(ties)])]
        first = np.concatenate([tied, first[~several]])
    leader = np.full(count, -1, np.int64)
    leader[voxel[first[::-1]]] = first[::-1]  # the last assignment wins: the first in order
    return distance, least, leader


def _is_lower(ties: Columns, one: Intp, other: Intp) -> Bool:
    """Return True for points that precede others by the sort keys."""
    lower, equal = np.zeros(len(one), np.bool_), np.ones(len(one), np.bool_)
    for column in ties:
        a, b = column[one], column[other]
        lower |= equal & (a < b)
        equal &= a == b
    return lower


@kernel
def _find_nearest(
    xyz: Float, voxel: Int32, edge: float, good: Bool, distance: Float, least: Float
) -> None:  # pragma: no cover - compiled
    """Write the squared distance of each point from the centre of its voxel, and the least of the good points of each voxel."""
    for i in range(voxel.shape[0]):
        x, y, z = xyz[i, 0], xyz[i, 1], xyz[i, 2]
        cx, cy, cz = (
            (math.floor(x / edge) + 0.5) * edge,
            (math.floor(y / edge) + 0.5) * edge,
            (math.floor(z / edge) + 0.5) * edge,
        )
        away = (x - cx) ** 2 + (y - cy) ** 2 + (z - cz) ** 2
        distance[i] = away
        if good[i] and away < least[voxel[i]]:
            least[voxel[i]] = away


@kernel
def _count_near(xyz: Float, voxel: Int32, leader: Int64, limit: float, found: Int32) -> None:  # pragma: no cover - compiled
    """Count the points of each voxel whose squared distance from its leader is within a limit."""
    for i in range(voxel.shape[0]):
        if voxel[i] >= 0:
            j = leader[voxel[i]]
            x, y, z = xyz[i, 0] - xyz[j, 0], xyz[i, 1] - xyz[j, 1], xyz[i, 2] - xyz[j, 2]
            if x * x + y * y + z * z <= limit:
                found[voxel[i]] += 1
