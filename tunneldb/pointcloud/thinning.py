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

from tunneldb.arrays import Bool, Float, Int32, Single, UInt8
from tunneldb.pointcloud.spool import ROW, Rows

CUTS = 1.5


def voxel_edge(density: float) -> float:
    """Voxel edge, m, for a mean density of points per m² on surfaces of all orientations."""
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
        True for the points that stay, one in each occupied voxel.
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
        Between rows at the same place time, intensity, scan, class and tag decide, the lowest first.
    edge : float
        Voxel edge, m.
    good : (n,) bool array
        Rows that may be chosen.

    Returns
    -------
    chosen : (n,) bool array
        One of each voxel that holds a good row.
    before : (n,) bool array
        Rows that are not good and would have stood before it; all of a voxel without good rows.
    """
    slots = 1 << max(8, math.ceil(math.log2(2 * len(rows) + 1)))
    chosen, before = _first(rows, edge, good, slots)
    return chosen, before


@njit(cache=True, nogil=True)
def _first(rows: Rows, edge: float, good: Bool, slots: int) -> tuple[Bool, Bool]:  # pragma: no cover - compiled
    n = len(rows)
    mask = slots - 1
    table = np.full(slots, -1, np.int32)  # a point of the voxel: its best good one so far, if it has one
    voxel = np.empty(n, np.int32)
    for i in range(n):
        row = rows[i]
        ix, iy, iz = math.floor(row.x / edge), math.floor(row.y / edge), math.floor(row.z / edge)
        slot = ((int(ix) * 73856093) ^ (int(iy) * 19349663) ^ (int(iz) * 83492791)) & mask
        while True:
            j = table[slot]
            if j < 0:
                table[slot] = i
                break
            other = rows[j]
            if math.floor(other.x / edge) == ix and math.floor(other.y / edge) == iy and math.floor(other.z / edge) == iz:
                if good[i] and (not good[j] or _before(rows, edge, i, j)):
                    table[slot] = i
                break
            slot = (slot + 1) & mask
        voxel[i] = slot
    chosen = np.zeros(n, np.bool_)
    before = np.zeros(n, np.bool_)
    for i in range(n):
        j = table[voxel[i]]
        if j == i:
            chosen[i] = good[i]
        if not good[i]:
            before[i] = not good[j] or _before(rows, edge, i, j)
    return chosen, before


@njit(cache=True, nogil=True)
def _before(rows: Rows, edge: float, i: int, j: int) -> bool:  # pragma: no cover - compiled
    """Tell whether row i stands before row j of the same voxel: nearer to the centre, else lower in its values."""
    a, b = rows[i], rows[j]
    cx, cy, cz = (
        (math.floor(a.x / edge) + 0.5) * edge,
        (math.floor(a.y / edge) + 0.5) * edge,
        (math.floor(a.z / edge) + 0.5) * edge,
    )
    da = (a.x - cx) ** 2 + (a.y - cy) ** 2 + (a.z - cz) ** 2
    db = (b.x - cx) ** 2 + (b.y - cy) ** 2 + (b.z - cz) ** 2
    if da != db:
        return bool(da < db)
    if a.x != b.x:
        return bool(a.x < b.x)
    if a.y != b.y:
        return bool(a.y < b.y)
    if a.z != b.z:
        return bool(a.z < b.z)
    if a.time != b.time:
        return bool(a.time < b.time)
    if a.intensity != b.intensity:
        return bool(a.intensity < b.intensity)
    if a.scan_id != b.scan_id:
        return bool(a.scan_id < b.scan_id)
    if a.classification != b.classification:
        return bool(a.classification < b.classification)
    return bool(a.tag < b.tag)


@njit(cache=True, nogil=True)
def pick(
    rows_xyz: Float, time: Float, intensity: Single, scan_id: Int32, classification: UInt8,
    whole: Bool, edge: float, limit: float, points: int, slots: int,
) -> tuple[Int32, Bool]:  # fmt: skip  # pragma: no cover - compiled
    """Of a chunk of points, those that may be the first good one of their voxel.

    The point of a voxel that stands before the others of the chunk is certain to be no noise when `points` of them,
    itself included, lie within the distance whose square is `limit`: no radius is less, and the file holds no fewer
    points than the chunk. Then it alone is picked, else all; all, too, that are not `whole`: what happens to their voxels
    is not known here, for a kilometre may end in them.

    Returns
    -------
    picked : (k,) int32 array
        Numbers of points.
    certain : (k,) bool array
        Which of them are certain to be no noise.
    """
    n = len(rows_xyz)
    mask = slots - 1
    table = np.full(slots, -1, np.int32)
    voxel = np.empty(n, np.int32)
    best = np.empty(n, np.int32)
    nearest = np.empty(n)
    used = 0
    v = -1
    lx, ly, lz = 0.0, 0.0, 0.0
    cx, cy, cz = 0.0, 0.0, 0.0
    for i in range(n):
        voxel[i] = -1
        if not whole[i]:
            continue
        x, y, z = rows_xyz[i, 0], rows_xyz[i, 1], rows_xyz[i, 2]
        ix, iy, iz = math.floor(x / edge), math.floor(y / edge), math.floor(z / edge)
        if v < 0 or ix != lx or iy != ly or iz != lz:
            lx, ly, lz = ix, iy, iz
            cx, cy, cz = (ix + 0.5) * edge, (iy + 0.5) * edge, (iz + 0.5) * edge
            slot = ((int(ix) * 73856093) ^ (int(iy) * 19349663) ^ (int(iz) * 83492791)) & mask
            while True:
                v = table[slot]
                if v < 0:
                    table[slot] = v = used
                    best[v] = i
                    nearest[v] = np.inf
                    used += 1
                    break
                j = best[v]
                if (
                    math.floor(rows_xyz[j, 0] / edge) == ix
                    and math.floor(rows_xyz[j, 1] / edge) == iy
                    and math.floor(rows_xyz[j, 2] / edge) == iz
                ):
                    break
                slot = (slot + 1) & mask
        voxel[i] = v
        distance = (x - cx) ** 2 + (y - cy) ** 2 + (z - cz) ** 2
        if distance < nearest[v]:
            best[v], nearest[v] = i, distance
        elif distance == nearest[v]:
            j = best[v]
            if x != rows_xyz[j, 0]:
                ahead = x < rows_xyz[j, 0]
            elif y != rows_xyz[j, 1]:
                ahead = y < rows_xyz[j, 1]
            elif z != rows_xyz[j, 2]:
                ahead = z < rows_xyz[j, 2]
            elif time[i] != time[j]:
                ahead = time[i] < time[j]
            elif intensity[i] != intensity[j]:
                ahead = intensity[i] < intensity[j]
            elif scan_id[i] != scan_id[j]:
                ahead = scan_id[i] < scan_id[j]
            else:
                ahead = classification[i] < classification[j]
            if ahead:
                best[v] = i
    found = np.zeros(used, np.int32)
    for i in range(n):
        v = voxel[i]
        if v < 0:
            continue
        j = best[v]
        ex, ey, ez = rows_xyz[i, 0] - rows_xyz[j, 0], rows_xyz[i, 1] - rows_xyz[j, 1], rows_xyz[i, 2] - rows_xyz[j, 2]
        if ex * ex + ey * ey + ez * ez <= limit:
            found[v] += 1
    picked = np.empty(n, np.int32)
    certain = np.empty(n, np.bool_)
    count = 0
    for i in range(n):
        v = voxel[i]
        sure = v >= 0 and found[v] >= points
        if not sure or best[v] == i:
            picked[count], certain[count] = i, sure
            count += 1
    return picked[:count], certain[:count]
