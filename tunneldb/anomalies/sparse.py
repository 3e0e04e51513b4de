"""Parts of an image with too few points for detecting leaks; they count as not inspected."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.ndimage import convolve

from tunneldb.anomalies.threshold import MEDIAN_PIXELS
from tunneldb.anomalies.windows import count_in_columns, on_lining
from tunneldb.arrays import Int64
from tunneldb.raster.geotiff import NODATA
from tunneldb.raster.image import MAX_MEDIAN, LiningImage
from tunneldb.raster.state import PixelState

TILE = MAX_MEDIAN // 3
"""Side of the tiles, pixels: three by three are as large as the widest median filter."""

WIDE_REACH = 4
"""Number of tiles to either side for the wider test: a square three times as wide."""

CERTAIN_FACTOR = 2.0
"""Factor on the required number of points that is not reached by chance: with a third less expected, in fewer than 1 of
100 000 places (Poisson)."""

MAX_POINT_SHARE = 0.25
"""Maximum required share of pixels with points, for pixels so coarse that each has one."""


def least_density(density: float, pixel: float) -> float:
    """Return the points per m² that lining must have to be searched.

    The widest median filter then has MEDIAN_PIXELS pixels with points; at least ``density``.

    Parameters
    ----------
    density : float
        Required density, points per m².
    pixel : float
        Side of a pixel, m.
    """
    return max(density, MEDIAN_PIXELS / (MAX_MEDIAN * pixel) ** 2)


def leave_out_sparse(picture: LiningImage, density: float) -> float:
    """Remove from a picture, in place, the lining with too few points around it, as if it had none.

    Around each tile, in a square as large as the widest median filter, the possible lining must have as many pixels with points
    as this density of random points fills. A square three times as wide must too, unless the first has so many that chance is
    excluded. Values from a nearby profile count as they do for the filter.

    Parameters
    ----------
    picture : LiningImage
        State and level of its pixels.
    density : float
        Points per m², see `least_density`.

    Returns
    -------
    float
        Share removed of the kilometre's lining that has any points.
    """
    grid, state = picture.grid, picture.state
    rows = _edges(grid.rows, -grid.bottom - grid.rows)
    columns = _edges(grid.columns, grid.first_column)
    selected, possible = np.zeros((2, len(rows) - 1, len(columns) - 1), np.int64)
    for k, (top, stop) in enumerate(pairwise(rows.tolist())):
        part = state[top:stop]
        selected[k] = np.add.reduceat(count_in_columns(on_lining(part)), columns[:-1])
        possible[k] = np.add.reduceat(count_in_columns(part <= PixelState.RECESS), columns[:-1])
    share = min(1.0 - np.exp(-density * grid.pixel**2), MAX_POINT_SHARE)
    there, room = _about(selected, 1), _about(possible, 1)
    by_chance = (_about(selected, WIDE_REACH) < share * _about(possible, WIDE_REACH)) & (
        there < CERTAIN_FACTOR * share * (3 * TILE) ** 2
    )
    sparse = (there < share * room) | by_chance
    for k in np.flatnonzero((sparse & (selected > 0)).any(axis=1)).tolist():
        here = slice(rows[k], rows[k + 1])
        gone = on_lining(state[here]) & np.repeat(sparse[k], np.diff(columns))
        state[here][gone] = PixelState.EMPTY
        picture.level[here][gone] = NODATA
    inner = (columns[:-1] >= grid.inner.start) & (columns[:-1] < grid.inner.stop)
    shown = np.where((there > 0) & inner, possible, 0)
    return float(shown[sparse].sum() / max(shown.sum(), 1))


def _about(tiles: Int64, reach: int) -> Int64:
    """Sum each tile and those up to ``reach`` around it; there is nothing beyond the ends."""
    around: Int64 = convolve(tiles, np.ones((2 * reach + 1, 2 * reach + 1), np.int64), mode="constant")
    return around


def _edges(count: int, first: int) -> Int64:
    """Return the edges of tiles among so many pixels, the first with this number, and the end of the last."""
    inside = np.arange(-first % TILE, count, TILE, dtype=np.int64)
    return np.unique(np.concatenate([[0], inside, [count]]))
