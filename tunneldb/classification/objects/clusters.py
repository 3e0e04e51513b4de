"""Clusters: objects in the tunnel or fixtures on its lining, and the cells that they fill."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import shapely

from tunneldb.arrays import Float, Int32, Int64, UInt8
from tunneldb.compiled import inner
from tunneldb.pointcloud.voxels import key_slot, value_table

CELL = 0.1
"""Edge of a cell, m."""

MAX_CLUSTER_LENGTH = 10.0
"""Maximum length of clusters along the tunnel, m; longer ones are split at whole multiples, which divide a kilometre."""

MAX_CELL_DISTANCE = 2
"""Distance, in cells, within which a point belongs to a cell: points of survey density leave cells of a surface empty."""

_SQUARE = np.array([(0, 0), (0, 1), (1, 0), (1, 1)])


@dataclass(frozen=True)
class Cluster:
    """Object or fixture in the tunnel, or a piece of it.

    Attributes
    ----------
    klass : int
        Class of its points, see :class:`tunneldb.classification.classes.PointClass`.
    cells : (m, 3) int32 array
        Cells with its points: floor(xyz / 0.1 m), without duplicates, sorted.
    points : int
        Number of points it was found from.
    along_from, along_to : float
        First and last place along the tunnel, m.
    height_from, height_to : float or None
        Lowest and highest point above the ground, m; None without ground.
    hull : (k, 2) float array
        Convex hull of the cells in plan, x and y of its corners counter-clockwise, not closed, m.
    """

    klass: int
    cells: Int32
    points: int
    along_from: float
    along_to: float
    height_from: float | None
    height_to: float | None
    hull: Float = field(repr=False)

    @classmethod
    def of(cls, klass: int, xyz: Float, along: Float, height: Float) -> Cluster:
        """Make a cluster of points (n, 3), n ≥ 1, their places along the tunnel and heights above ground (n,); NaN: none."""
        cells = _distinct(np.floor(xyz / CELL).astype(np.int32))
        known = height[np.isfinite(height)]
        low, high = (float(known.min()), float(known.max())) if len(known) else (None, None)
        return cls(int(klass), cells, len(xyz), float(along.min()), float(along.max()), low, high, _hull(cells))


def pieces(klass: int, xyz: Float, along: Float, height: Float) -> list[Cluster]:
    """Make a cluster, or the pieces of one longer than ``MAX_CLUSTER_LENGTH``; arguments as for :meth:`Cluster.of`."""
    if along.max() - along.min() <= MAX_CLUSTER_LENGTH:
        return [Cluster.of(klass, xyz, along, height)]
    piece = np.floor(along / MAX_CLUSTER_LENGTH)
    return [Cluster.of(klass, xyz[m], along[m], height[m]) for m in (piece == p for p in np.unique(piece))]


def _distinct(cells: Int32) -> Int32:
    """Return the unique cells (n, 3), sorted; as whole numbers, because array rows compare slowly."""
    low = cells.min(axis=0)
    width = (cells.max(axis=0) - low).astype(np.int64) + 1
    number = (cells[:, 0] - low[0]).astype(np.int64)
    for axis in range(1, cells.shape[1]):
        number = number * width[axis] + (cells[:, axis] - low[axis])
    number = np.sort(number)
    number = number[np.diff(number, prepend=-1) > 0]
    columns = []
    for axis in range(cells.shape[1] - 1, -1, -1):
        number, rest = np.divmod(number, width[axis])
        columns.append(rest + low[axis])
    return np.column_stack(columns[::-1]).astype(np.int32)


def _hull(cells: Int32) -> Float:
    """Return the convex hull in plan of cells as squares, so that it always has an area."""
    flat = cells[np.r_[True, (np.diff(cells[:, :2], axis=0) != 0).any(axis=1)], :2]  # sorted by x and y
    # Relative to a corner: millions of metres would cost precision.
    corners = (flat - flat[0] + _SQUARE[:, None]).reshape(-1, 2)
    ring = shapely.get_coordinates(shapely.convex_hull(shapely.multipoints(corners)))[:-1]
    x, y = ring.T
    if np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) < 0.0:
        ring = ring[::-1]
    return np.asarray((ring + flat[0]) * CELL)


@dataclass(frozen=True)
class Lookup:
    """Cells of clusters in a hash table, for finding the class of the cluster that contains a point.

    Attributes
    ----------
    first, last : (3,) int arrays
        Box around all cells.
    keys : (slots,) int array
        Numbers of the cells in the box, at the slot given by `tunneldb.pointcloud.voxels.key_slot`; -1 for an empty slot.
    klass : (slots,) uint8 array
        Their classes.
    """

    first: Int64
    last: Int64
    keys: Int64
    klass: UInt8

    @classmethod
    def of(cls, clusters: list[Cluster]) -> Lookup:
        """Fill the table with the cells of clusters and those within ``MAX_CELL_DISTANCE``, each with the nearest class.

        Of two classes equally near the lower one is used, so the order of the clusters does not matter.
        """
        ordered = sorted(clusters, key=lambda cluster: cluster.klass)
        cells = np.concatenate([np.empty((0, 3), np.int64), *(cluster.cells.astype(np.int64) for cluster in ordered)])
        klass = np.repeat(
            np.array([cluster.klass for cluster in ordered], np.uint8), [len(cluster.cells) for cluster in ordered]
        )
        if len(cells) == 0:
            return cls(np.zeros(3, np.int64), np.full(3, -1, np.int64), *value_table(np.empty(0, np.int64), klass))
        first, last = cells.min(axis=0) - MAX_CELL_DISTANCE, cells.max(axis=0) + MAX_CELL_DISTANCE
        _, wide, tall = last - first + 1
        place = cells - first
        keys, lowest = np.unique((place[:, 0] * wide + place[:, 1]) * tall + place[:, 2], return_index=True)
        classes = klass[lowest]
        centres, own = keys, classes
        for step in _shells():
            about = ((step[:, 0] * wide + step[:, 1]) * tall + step[:, 2])[:, None] + centres
            found, nearest = np.unique(about, return_index=True)
            free = ~np.isin(found, keys, assume_unique=True)
            keys, classes = np.append(keys, found[free]), np.append(classes, own[nearest[free] % len(own)])
        return cls(first, last, *value_table(keys, classes))


def _shells() -> list[Int64]:
    """Return steps (k, 3) to the cells within ``MAX_CELL_DISTANCE``, grouped by length, the shortest first."""
    side = np.arange(-MAX_CELL_DISTANCE, MAX_CELL_DISTANCE + 1)
    steps = np.stack(np.meshgrid(side, side, side, indexing="ij"), axis=-1).reshape(-1, 3)
    length = (steps**2).sum(axis=1)
    return [steps[length == square] for square in range(1, MAX_CELL_DISTANCE**2 + 1)]


@inner
def look_up(
    x: float, y: float, z: float, first: Int64, last: Int64, keys: Int64, klass: UInt8
) -> int:  # pragma: no cover - compiled
    """Return the class of the cluster that contains a point; 0 if none does."""
    cx, cy, cz = math.floor(x / CELL), math.floor(y / CELL), math.floor(z / CELL)
    if not (first[0] <= cx <= last[0] and first[1] <= cy <= last[1] and first[2] <= cz <= last[2]):
        return 0
    wide, tall = last[1] - first[1] + 1, last[2] - first[2] + 1
    slot = key_slot(((cx - first[0]) * wide + cy - first[1]) * tall + cz - first[2], keys)
    return np.int64(klass[slot]) if keys[slot] >= 0 else np.int64(0)  # type: ignore[return-value]
