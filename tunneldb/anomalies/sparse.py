"""Where an image has too few points for its leaks to be told: what is left out there counts as unseen."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.ndimage import convolve

from tunneldb.anomalies.threshold import MEDIAN_PIXELS
from tunneldb.anomalies.windows import count_in_columns, on_lining
from tunneldb.arrays import Int64
from tunneldb.raster.geotiff import NODATA
from tunneldb.raster.image import MAX_MEDIAN, LiningImage
from tunneldb.raster.pixel_state import PixelState

TILE = MAX_MEDIAN // 3
"""Side of the tiles that are judged as a whole, pixels: three by three are as large as the widest median filter."""

WIDE = 4
"""Tiles about one that tell whether it holds enough points by chance: a square three times as wide."""

CERTAIN = 2.0
"""So many times as many points as are asked for are there by no chance: where a third less is due, in fewer than 1 of 100 000
places (Poisson)."""

MOST = 0.25
"""Of pixels so coarse that each holds points no larger share is asked for."""


def least_density(density: float, pixel: float) -> float:
    """Points per m² that lining must hold to be searched.

    So many that the widest median filter holds MEDIAN_PIXELS pixels with points, no fewer than ``density``.

    Parameters
    ----------
    density : float
        What is wanted, points per m².
    pixel : float
        Side of a pixel, m.
    """
    return max(density, MEDIAN_PIXELS / (MAX_MEDIAN * pixel) ** 2)


def leave_out_sparse(picture: LiningImage, density: float) -> float:
    """Take from a picture, in place, the lining about which it holds too few points, as if there were none.

    About each tile the lining that could be seen, in a square as large as the widest median filter, must show in as many
    pixels as so many points strewn at random fill; and so it must in a square three times as wide, unless the first holds so
    many that it's by no chance. What is taken from a profile nearby counts as it does for the filter.

    Parameters
    ----------
    picture : LiningImage
        State and level of its pixels.
    density : float
        Points per m², see `least_density`.

    Returns
    -------
    float
        Share of the kilometre's lining, where there are points at all, that was left out.
    """
    grid, state = picture.grid, picture.state
    rows = _edges(grid.rows, -grid.bottom - grid.rows)
    columns = _edges(grid.columns, grid.first_column)
    held, possible = np.zeros((2, len(rows) - 1, len(columns) - 1), np.int64)
    for k, (top, stop) in enumerate(pairwise(rows.tolist())):
        part = state[top:stop]
        held[k] = np.add.reduceat(count_in_columns(on_lining(part)), columns[:-1])
        possible[k] = np.add.reduceat(count_in_columns(part <= PixelState.RECESS), columns[:-1])
    share = min(1.0 - np.exp(-density * grid.pixel**2), MOST)
    there, room = _about(held, 1), _about(possible, 1)
    by_chance = (_about(held, WIDE) < share * _about(possible, WIDE)) & (there < CERTAIN * share * (3 * TILE) ** 2)
    sparse = (there < share * room) | by_chance
    for k in np.flatnonzero((sparse & (held > 0)).any(axis=1)).tolist():
        here = slice(rows[k], rows[k + 1])
        gone = on_lining(state[here]) & np.repeat(sparse[k], np.diff(columns))
        state[here][gone] = PixelState.EMPTY
        picture.level[here][gone] = NODATA
    inner = (columns[:-1] >= grid.inner.start) & (columns[:-1] < grid.inner.stop)
    shown = np.where((there > 0) & inner, possible, 0)
    return float(shown[sparse].sum() / max(shown.sum(), 1))


def _about(tiles: Int64, reach: int) -> Int64:
    """Sum of each tile and those so far about it, beyond the ends of which there is nothing."""
    around: Int64 = convolve(tiles, np.ones((2 * reach + 1, 2 * reach + 1), np.int64), mode="constant")
    return around


def _edges(count: int, first: int) -> Int64:
    """Where tiles begin among so many pixels, the first of which has this number, and the end of the last."""
    inside = np.arange(-first % TILE, count, TILE, dtype=np.int64)
    return np.unique(np.concatenate([[0], inside, [count]]))
