"""Class of each point of a registered sonar scan: bed, water surface, submerged lining, object, or false echo.

Places are along the axis, across it and in height above the water, m. Walls and bed are the farthest place with many points
in a cell: the few false echoes, by way of the surface or of a second wall, are behind them.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
import scipy  # its parts when they are used: they take long to import

from tunneldb.arrays import Bool, Float, Int64

SURFACE = 0.1  # maximum distance from the water level, m
WAVES = 0.05  # m above it, up to which noise puts points of a wall; higher points are mirror images
MIN_NEIGHBOUR_RADIUS = 0.15  # minimum radius for the neighbours of a point, m; more if rays are farther apart
SPREADING = 0.03  # distance of neighbouring rays, per range
MIN_NEIGHBOURS = 4  # others
STRIP, BAND = 1.0, 0.25  # cells of wall, m along and in height
SQUARE = 0.5  # cells of bed, m
BIN = 0.05  # m
MAX_BED_SLOPE = 0.84  # maximum slope of a bed, 40°: silt and rubble are not steeper
WALL_THICKNESS = 0.15  # m: four standard deviations of range, and a wall's relief
MAX_FILL_CELLS = 3.0  # cells
MAX_WALL_STEP = 0.5  # m between places of a wall at one chainage
MANY_SHARE = 0.4  # share of the maximum of a cell's bins from which a bin has many points
MIN_CELL_POINTS = 10  # minimum points of a cell for a wall or the bed


class WaterClass(IntEnum):
    """Class of a point below the water; 40, 41 and 43 are bathymetry in ASPRS LAS 1.4, 42 is the submerged lining."""

    FALSE = 7  # noise
    BED = 40
    SURFACE = 41
    LINING = 42
    OBJECT = 43


@dataclass(frozen=True)
class _Cells:
    """Value for each cell of a grid, NaN if unknown, and the place of its first cell."""

    value: Float
    low: Int64

    def at(self, keys: Int64) -> Float:
        """Return the values (n,) of cells (n, 2)."""
        place = np.clip(keys - self.low, 0, np.array(self.value.shape) - 1)
        return np.asarray(self.value[place[:, 0], place[:, 1]])


def classify(points: Float, spacing: Float) -> Int64:
    """Return the classes (n,) of points, see `WaterClass`.

    Parameters
    ----------
    points : (n, 3) float64 array
        Chainage, place right of the axis, and height above the water, m.
    spacing : (n,) float64 array
        Maximum distance of neighbouring points on one surface, m; see `spacing_of_rays`, `spacing_of_soundings`.
    """
    out = np.full(len(points), WaterClass.FALSE, np.int64)
    if len(points) == 0:
        return out
    height = points[:, 2]
    sound = (height < SURFACE) & _has_neighbours(points, spacing)
    middle = _middle(points[sound])
    below = sound & (height < -SURFACE)
    side = np.where(points[:, 1] > middle, 1.0, -1.0)
    away = np.abs(points[:, 1] - middle)
    wall, niche = np.full(len(points), np.nan), np.full(len(points), np.nan)
    keys = np.floor(points[:, [0, 2]] / [STRIP, BAND]).astype(np.int64)
    for sign in (-1.0, 1.0):
        mine = side == sign
        cells = _rear_of_cells(keys[mine & below], away[mine & below])
        if cells is not None:
            wall[mine] = _on_line(_smoothed(cells)).at(keys[mine])
            niche[mine] = cells.at(keys[mine])
    in_niche = (niche > wall) & (np.abs(away - niche) < WALL_THICKNESS)
    on_wall = sound & (height < WAVES) & ((np.abs(away - wall) < WALL_THICKNESS) | in_niche)
    inside = ~(away > wall + WALL_THICKNESS)  # also where no wall is known
    keys = np.floor(points[:, :2] / SQUARE).astype(np.int64)
    # with the foot of the walls: squares beside it contain little except objects in front of it
    floor = _rear_of_cells(keys[below & inside], -height[below & inside])
    depth = -_connected(_smoothed(floor)).at(keys) if floor is not None else np.full(len(points), np.nan)
    on_bed = below & inside & (np.abs(height - depth) < WALL_THICKNESS)
    # where the bed is hidden, the object that hides it
    out[below & inside & (height > np.where(np.isnan(depth), _deepest(depth), depth))] = WaterClass.OBJECT
    out[sound & inside & (np.abs(height) <= SURFACE) & (away < wall - WALL_THICKNESS)] = WaterClass.SURFACE
    out[on_wall & ~(height < depth - WALL_THICKNESS)] = WaterClass.LINING
    out[on_bed & ~on_wall] = WaterClass.BED
    return out


def _deepest(depth: Float) -> float:
    """Return the lowest height of the bed, m; the water surface if none is known."""
    known = depth[np.isfinite(depth)]
    return float(known.min()) if len(known) else 0.0


def spacing_of_rays(reach: Float) -> Float:
    """Return maximum distances (n,) of neighbouring points on one surface, m, from the ranges of the sonar, m."""
    return SPREADING * reach


def spacing_of_soundings(points: Float) -> Float:
    """Return the same for soundings (n, 3) with unknown sonar positions: twice their typical distance."""
    distance, _ = scipy.spatial.cKDTree(points).query(points, k=[MIN_NEIGHBOURS + 1])
    return np.full(len(points), 2.0 * float(np.median(distance)))


def _has_neighbours(points: Float, spacing: Float) -> Bool:
    distance, _ = scipy.spatial.cKDTree(points).query(points, k=[MIN_NEIGHBOURS + 1])
    return np.asarray(distance[:, 0] < np.maximum(MIN_NEIGHBOUR_RADIUS, spacing))


def _middle(points: Float) -> float:
    """Return the middle between the walls, m across."""
    return float(np.mean(np.percentile(points[:, 1], [2.0, 98.0]))) if len(points) else 0.0


def _rear_of_cells(keys: Int64, values: Float) -> _Cells | None:
    """Return the farthest place with many values (n,) of each cell (n, 2), smoothed over its neighbours; None if none.

    An object in front of a wall or on the bed has as many points as these, or more; false echoes behind them are few.
    """
    if len(values) == 0:
        return None
    low = keys.min(axis=0)
    shape = keys.max(axis=0) - low + 1
    cell = (keys[:, 0] - low[0]) * shape[1] + keys[:, 1] - low[1]
    lowest = float(values.min())
    level = np.floor((values - lowest) / BIN).astype(np.int64)
    levels = int(level.max()) + 1
    places, count = np.unique(cell * levels + level, return_counts=True)
    cells, level = places // levels, places % levels
    largest = np.zeros(int(shape.prod()), np.int64)
    np.maximum.at(largest, cells, count)
    total = np.bincount(cell, minlength=len(largest))
    many = (count >= MANY_SHARE * largest[cells]) & (total[cells] >= MIN_CELL_POINTS)
    if not many.any():
        return None
    rear = np.full(len(largest), -1, np.int64)
    np.maximum.at(rear, cells[many], level[many])
    grid = np.where(rear >= 0, lowest + (rear + 0.5) * BIN, np.nan)
    return _Cells(grid.reshape(shape), low)


def _smoothed(cells: _Cells) -> _Cells:
    """Return the median of the known cells among the 3 × 3 around each; else the nearest, if it is near enough."""
    grid = cells.value
    padded = np.pad(grid, 1, constant_values=np.nan)
    about = np.stack([padded[i : i + grid.shape[0], j : j + grid.shape[1]] for i in range(3) for j in range(3)])
    known = np.isfinite(grid)
    smooth = np.full(grid.shape, np.nan)
    smooth[known] = np.nanmedian(about[:, known], axis=0)
    away: Float
    nearest: Int64
    away, nearest = scipy.ndimage.distance_transform_edt(~known, return_indices=True)
    return _Cells(np.where(away <= MAX_FILL_CELLS, smooth[tuple(nearest)], np.nan), cells.low)


def _connected(cells: _Cells) -> _Cells:
    """Return the largest surface of cells connected at no more than MAX_BED_SLOPE: a hull over the bed is not the bed."""
    value = cells.value
    number = np.arange(value.size).reshape(value.shape)
    pairs = []
    for one, other in ((np.s_[:-1], np.s_[1:]), (np.s_[:, :-1], np.s_[:, 1:])):
        joined = np.abs(value[one] - value[other]) < MAX_BED_SLOPE * SQUARE
        pairs.append((number[one][joined], number[other][joined]))
    rows, columns = (np.concatenate(part) for part in zip(*pairs, strict=True))
    links = scipy.sparse.coo_array((np.ones(len(rows)), (rows, columns)), (value.size, value.size))
    _, label = scipy.sparse.csgraph.connected_components(links, directed=False)
    known = np.isfinite(value).ravel()
    if not known.any():
        return cells
    largest = np.bincount(label[known]).argmax()
    return _Cells(np.where((label == largest).reshape(value.shape), value, np.nan), cells.low)


def _on_line(cells: _Cells) -> _Cells:
    """Return the cells of a wall, with those far from the others of their strip moved: most points there are on the bed."""
    known = np.isfinite(cells.value).any(axis=1, keepdims=True)
    usual = np.nanmedian(np.where(known, cells.value, 0.0), axis=1, keepdims=True)
    return _Cells(np.where(np.abs(cells.value - usual) > MAX_WALL_STEP, usual, cells.value), cells.low)
