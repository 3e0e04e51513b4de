"""Thinning to survey density: one point a voxel.

A plane with unit normal n cuts (|nx| + |ny| + |nz|) / h² voxels of edge h per square metre: 1/h² when it lies along
the grid, √3/h² at the steepest, and 1.5/h² on average over all orientations. So h = √(1.5 / density) keeps, on a
tunnel's lining that faces all ways, the wanted number of points per square metre; walls along the grid get two thirds
of it.

Of each voxel the measured point nearest to its centre stays. Voxels lie at whole multiples of h of the absolute
coordinates and ties fall by the points' own values, so which points stay depends only on which points there are: not
on their order, nor on whether they were thinned in parts before.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Float = NDArray[np.float64]
Int64 = NDArray[np.int64]
Bool = NDArray[np.bool_]

CUTS = 1.5


def voxel_edge(density: float) -> float:
    """Voxel edge, m, for a mean density of points per m² on surfaces of all orientations."""
    return math.sqrt(CUTS / density)


def thin(xyz: Float, edge: float, ties: Float | None = None) -> Bool:
    """Choose the point nearest to the centre of each voxel.

    Parameters
    ----------
    xyz : (n, 3) float64 array
        Coordinates, m.
    edge : float
        Voxel edge, m.
    ties : (n, k) float64 array, optional
        Further values that decide, lowest first, between points at the same place.

    Returns
    -------
    (n,) bool array
        True for the points that stay, one in each occupied voxel.
    """
    xyz = np.ascontiguousarray(xyz, np.float64)
    ties = np.empty((len(xyz), 0)) if ties is None else np.ascontiguousarray(ties, np.float64)
    slots = 1 << max(8, math.ceil(math.log2(2 * len(xyz) + 1)))
    keep: Bool = _choose(xyz, edge, ties, slots)
    return keep


@njit(cache=True, nogil=True)
def _choose(xyz: Float, edge: float, ties: Float, slots: int) -> Bool:  # pragma: no cover - compiled
    n = xyz.shape[0]
    mask = slots - 1
    table = np.full(slots, -1, np.int32)  # best point of a voxel so far
    for i in range(n):
        ix = math.floor(xyz[i, 0] / edge)
        iy = math.floor(xyz[i, 1] / edge)
        iz = math.floor(xyz[i, 2] / edge)
        slot = ((ix * 73856093) ^ (iy * 19349663) ^ (iz * 83492791)) & mask
        while True:
            j = table[slot]
            if j < 0:
                table[slot] = i
                break
            if math.floor(xyz[j, 0] / edge) == ix and math.floor(xyz[j, 1] / edge) == iy and math.floor(xyz[j, 2] / edge) == iz:
                if _before(xyz, ties, edge, ix, iy, iz, i, j):
                    table[slot] = i
                break
            slot = (slot + 1) & mask
    keep = np.zeros(n, np.bool_)
    for slot in range(slots):
        if table[slot] >= 0:
            keep[table[slot]] = True
    return keep


@njit(cache=True, nogil=True)
def _before(
    xyz: Float, ties: Float, edge: float, ix: float, iy: float, iz: float, i: int, j: int
) -> bool:  # pragma: no cover - compiled
    """Tell whether point i stands before point j: nearer to the centre, else lower in its values."""
    cx, cy, cz = (ix + 0.5) * edge, (iy + 0.5) * edge, (iz + 0.5) * edge
    di = (xyz[i, 0] - cx) ** 2 + (xyz[i, 1] - cy) ** 2 + (xyz[i, 2] - cz) ** 2
    dj = (xyz[j, 0] - cx) ** 2 + (xyz[j, 1] - cy) ** 2 + (xyz[j, 2] - cz) ** 2
    if di != dj:
        return bool(di < dj)
    for c in range(3):
        if xyz[i, c] != xyz[j, c]:
            return bool(xyz[i, c] < xyz[j, c])
    for c in range(ties.shape[1]):
        if ties[i, c] != ties[j, c]:
            return bool(ties[i, c] < ties[j, c])
    return False
