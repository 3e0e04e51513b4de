"""Points in the nodes of an octree: each node has an even sample of the points in its cube, the nodes below have the rest.

It is built in pieces of bounded size. The points are counted by cells of one metre; cubes of the octree with few enough
points are the pieces (*tiles*), processed depth first. A node above the tiles is complete after the last tile below it. Its
sample is never larger than the number of cells in its grid.

Sampling by one point for each cell of a grid of 128³ is what COPC calls the spacing of a node (COPC 1.0, section *info VLR*).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from tunneldb.arrays import Float, Int64, Intp, UInt8

CELL = 1.0
"""Edge of the cells in which points are counted, m; a power of two, so that the edges of nodes are exact."""

TILE = 1_000_000
"""Greatest number of points of a tile, unless a single cell has more."""

LEAF = 50_000
"""Greatest number of points of a node that keeps all its points and has no nodes below it."""

GRID = 7  # a node's sample has one point for each cell of a grid of 2**GRID to each side
_BITS = 21  # bits of a position within a tile, per axis: three fit into 64 bits
_MAX_LEVELS = _BITS - GRID
_PLAN_BITS, _HEIGHT_BITS = 24, 15  # bits of a cell's index in plan, and in height

Key = tuple[int, int, int, int]
"""Level of a node, 0 for the root, and its index there in x, y and z."""


class CellCounts:
    """Number of points in each cell of space.

    Parameters
    ----------
    origin : (3,) float array
        A position near the points, m.

    Attributes
    ----------
    numbers, counts : (c,) int64 arrays
        Packed numbers of the cells, ascending, and their numbers of points.
    """

    def __init__(self, origin: Float) -> None:
        self.origin = np.floor(np.asarray(origin, np.float64) / CELL).astype(np.int64)
        self.numbers = np.empty(0, np.int64)
        self.counts = np.empty(0, np.int64)

    def add(self, xyz: Float) -> None:
        """Count points (n, 3), m.

        Raises
        ------
        ValueError
            If a point is too far from the origin for a cell number: 8388 km in plan, 16 km in height.
        """
        found, counts = np.unique(self.number(xyz), return_counts=True)
        numbers, inverse = np.unique(np.concatenate([self.numbers, found]), return_inverse=True)
        self.counts = np.bincount(inverse, np.concatenate([self.counts, counts])).astype(np.int64)
        self.numbers = numbers

    def number(self, xyz: Float) -> Int64:
        """Return the packed numbers (n,) of the cells that contain points (n, 3)."""
        cell = np.floor(xyz / CELL).astype(np.int64) - self.origin
        half = np.array([1 << (_PLAN_BITS - 1), 1 << (_PLAN_BITS - 1), 1 << (_HEIGHT_BITS - 1)])
        cell += half
        if len(cell) and (cell.min() < 0 or (cell >= 2 * half).any()):
            raise ValueError("its points are more than 16 km apart in height, or thousands of kilometres in plan")
        return (cell[:, 0] << (_PLAN_BITS + _HEIGHT_BITS)) | (cell[:, 1] << _HEIGHT_BITS) | cell[:, 2]

    def cells(self) -> Int64:
        """Return the cells (c, 3) of the numbers; their lower corners are these × CELL, m."""
        x, y, z = (
            self.numbers >> (_PLAN_BITS + _HEIGHT_BITS),
            self.numbers >> _HEIGHT_BITS & (1 << _PLAN_BITS) - 1,
            self.numbers & (1 << _HEIGHT_BITS) - 1,
        )
        half = np.array([1 << (_PLAN_BITS - 1), 1 << (_PLAN_BITS - 1), 1 << (_HEIGHT_BITS - 1)])
        return np.column_stack([x, y, z]) - half + self.origin


@dataclass(frozen=True)
class Tile:
    """Cube of the octree whose points are put into nodes together.

    Attributes
    ----------
    level : int
    place : tuple of three int
        As in `Key`.
    low : (3,) float array
        Lower corner, m.
    edge : float
        Edge of the cube, m.
    points : int
    """

    level: int
    place: tuple[int, int, int]
    low: Float
    edge: float
    points: int

    def above(self, level: int) -> Key:
        """Return the node of a level (not below the tile) that contains the tile."""
        x, y, z = (place >> (self.level - level) for place in self.place)
        return level, x, y, z


@dataclass(frozen=True)
class Tiling:
    """Cube around all points, and its tiles, depth first.

    Attributes
    ----------
    low : (3,) float array
        Lower corner of the cube, m.
    edge : float
        Edge of the cube, m.
    tiles : tuple of Tile
    """

    low: Float
    edge: float
    tiles: tuple[Tile, ...]
    _counts: CellCounts = field(repr=False)
    _tile_of: Intp = field(repr=False)

    @classmethod
    def of(cls, counts: CellCounts, max_points: int = TILE) -> Tiling:
        """Divide space into tiles of at most ``max_points`` points, or of one cell."""
        cells = counts.cells()
        corner = cells.min(axis=0)
        relative = cells - corner
        depth = int(relative.max()).bit_length()
        tile_of = np.empty(len(cells), np.intp)
        found: list[Tile] = []
        rest = np.arange(len(cells))
        for level in range(depth + 1):
            places, inverse = np.unique(relative[rest] >> (depth - level), axis=0, return_inverse=True)
            inverse = inverse.reshape(-1)
            points = np.bincount(inverse, counts.counts[rest]).astype(np.int64)
            small = points <= max_points if level < depth else np.ones(len(places), np.bool_)
            edge = CELL * 2.0 ** (depth - level)
            number = np.cumsum(small) - 1 + len(found)
            for place, count in zip(places[small].tolist(), points[small].tolist(), strict=True):
                found.append(Tile(level, tuple(place), corner * CELL + np.array(place) * edge, edge, count))
            done = small[inverse]
            tile_of[rest[done]] = number[inverse[done]]
            rest = rest[~done]
        order = sorted(range(len(found)), key=lambda index: _octants(found[index], depth))
        renumbered = np.empty(len(found), np.intp)
        renumbered[order] = np.arange(len(found))
        tiles = tuple(found[index] for index in order)
        return cls(corner * CELL, CELL * 2.0**depth, tiles, counts, renumbered[tile_of])

    def tiles_of(self, xyz: Float) -> Intp:
        """Return the index of the tile of each of these points (n, 3), (n,); all must have been counted."""
        return self._tile_of[np.searchsorted(self._counts.numbers, self._counts.number(xyz))]


def _octants(tile: Tile, depth: int) -> list[int]:
    """Return the path of octants down to a tile's first cell."""
    x, y, z = (place << (depth - tile.level) for place in tile.place)
    return [(x >> bit & 1) << 2 | (y >> bit & 1) << 1 | z >> bit & 1 for bit in reversed(range(depth))]


class Nodes:
    """Nodes of an octree, built from the points of one tile after the other, in the order of the tiling."""

    def __init__(self) -> None:
        self.above: list[tuple[Key, list[UInt8]]] = []  # nodes above the current tile, from the root down
        self.occupied: dict[int, tuple[int, int, int]] = {}  # per level, the last cell larger than a tile that has its point

    def add(self, tile: Tile, xyz: Float, records: UInt8) -> Iterator[tuple[Key, UInt8]]:
        """Put the points of a tile into nodes; yield the nodes that are complete.

        Parameters
        ----------
        xyz : (n, 3) float array
            Coordinates, m.
        records : (n, size) uint8 array
            Records of the points; in a node they stay in this order.
        """
        yield from self._leave(tile)
        code = _morton(np.clip((xyz - tile.low) / tile.edge * 2.0**_BITS, 0, 2**_BITS - 1).astype(np.int64))
        order = np.argsort(code, kind="stable")
        code = code[order]
        for level in range(tile.level):
            picked = self._sample_above(tile, level, code)
            self.above[level][1].append(records[np.sort(order[picked])])
            kept = np.ones(len(code), np.bool_)
            kept[picked] = False
            code, order = code[kept], order[kept]
        for level, place, chosen in _below(code):
            x, y, z = (there + (own << level) for there, own in zip(place, tile.place, strict=True))
            yield (tile.level + level, x, y, z), records[np.sort(order[chosen])]

    def close(self) -> Iterator[tuple[Key, UInt8]]:
        """Yield the nodes that are still open."""
        yield from self._complete(0)

    def _leave(self, tile: Tile) -> Iterator[tuple[Key, UInt8]]:
        """Yield the nodes that don't contain the tile, and open those that do."""
        same = 0
        while same < min(len(self.above), tile.level) and self.above[same][0] == tile.above(same):
            same += 1
        yield from self._complete(same)
        self.above += [(tile.above(level), []) for level in range(same, tile.level)]

    def _complete(self, level: int) -> Iterator[tuple[Key, UInt8]]:
        for key, parts in self.above[level:]:
            records = np.concatenate(parts)
            if len(records):
                yield key, records
        del self.above[level:]

    def _sample_above(self, tile: Tile, level: int, code: Int64) -> Intp:
        """Return the indices of the tile's points that belong to the node of a level above it."""
        finer = level + GRID - tile.level
        if finer >= 0:
            return _middles(code >> 3 * (_BITS - finer))
        # A cell of the node's grid contains several consecutive tiles.
        x, y, z = (place >> -finer for place in tile.place)
        if self.occupied.get(level) == (x, y, z) or not len(code):
            return np.empty(0, np.intp)
        self.occupied[level] = (x, y, z)
        return np.array([len(code) // 2], np.intp)


def _below(code: Int64) -> Iterator[tuple[int, tuple[int, int, int], Intp]]:
    """Yield nodes within a tile: level below it, index there, and indices of their points, whose codes (n,) ascend."""
    index = np.arange(len(code))
    for level in range(_MAX_LEVELS + 1):
        if not len(code):
            return
        node = code >> 3 * (_BITS - level)
        starts = _starts(node)
        ends = np.append(starts[1:], len(node))
        whole = (ends - starts <= LEAF) | (level == _MAX_LEVELS)
        chosen = np.repeat(whole, ends - starts)
        chosen[_middles(code >> 3 * (_BITS - level - GRID))] = True
        for start, end in zip(starts.tolist(), ends.tolist(), strict=True):
            yield level, _place(int(node[start])), index[start:end][chosen[start:end]]
        code, index = code[~chosen], index[~chosen]


def _starts(key: Int64) -> Intp:
    """Return the first index of each run of equal numbers."""
    return np.flatnonzero(np.concatenate([np.ones(min(1, len(key)), np.bool_), key[1:] != key[:-1]]))


def _middles(key: Int64) -> Intp:
    """Return the middle index of each run of equal numbers."""
    starts = _starts(key)
    return (starts + np.append(starts[1:], len(key))[: len(starts)]) // 2


# Shifts that put two free bits before each of 21, with the masks to apply after them.
_SPREAD = (
    (32, 0x1F00000000FFFF),
    (16, 0x1F0000FF0000FF),
    (8, 0x100F00F00F00F00F),
    (4, 0x10C30C30C30C30C3),
    (2, 0x1249249249249249),
)


def _morton(cell: Int64) -> Int64:
    """Interleave the bits of x, y and z (n, 3); positions in the same cube have the same first bits."""
    code = np.zeros(len(cell), np.int64)
    for column in range(3):
        bits = cell[:, column].copy()
        for shift, mask in _SPREAD:
            bits = (bits | bits << shift) & mask
        code |= bits << (2 - column)
    return code


def _place(code: int) -> tuple[int, int, int]:
    """Return x, y and z of a number made by `_morton`."""
    bits = range((code.bit_length() + 2) // 3)
    x, y, z = (sum((code >> (3 * bit + 2 - column) & 1) << bit for bit in bits) for column in range(3))
    return x, y, z
