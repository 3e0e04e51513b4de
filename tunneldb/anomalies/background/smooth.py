"""Smooth changes along and across the lining, separated from areas with a sharp edge; on tiles of half a metre."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from tunneldb.arrays import Bool, Float, Single
from tunneldb.robust import MAD_TO_SIGMA

OUTLIER_LEVEL = 3.0
"""Deviation from which a tile is an outlier, in standard deviations of the tiles at similar arcs."""

BAND_TILES = 4
"""Number of tiles to either side in arc, over the whole kilometre, for the scatter of tiles."""

EDGE_WINDOW, SURROUNDING_WINDOW = 3, 7
"""Sides of the windows, in tiles, that show the edge itself and its surroundings: 1 m and 3 m from middle to middle."""

MIN_SHARP_SHARE = 0.6
"""Share of the surrounding step from which an edge is sharp: an edge that fades over more than 1.7 m is not."""

LEVEL_WINDOW = (7, 13)
"""Tiles down and along of the windows for the level around a tile."""

MEDIAN_WINDOW = (5, 9)
"""Tiles down and along of the median filter."""

MIN_TILES = 20
"""Minimum number of tiles for their scatter."""


def smooth_level(level: Single, before: Single, spread: float, fixed: Bool) -> tuple[Single, Bool]:
    """Follow smooth changes, but no areas with a sharp edge.

    Dry lining varies as much towards dark as towards bright, while wet lining is only ever darker. So the brighter half of the
    tiles at similar arcs gives the expected scatter of tiles (at least ``spread``). Connected outlying tiles are followed if
    their boundary is soft: soot fades over metres, a leak or a patch ends within a decimetre. Otherwise the surrounding level
    is extended over them.

    Parameters
    ----------
    level : (tiles down, tiles along) float32 array
        Level of the background in each tile relative to base, rings and bands, dB; NaN where it is unknown.
    before : (tiles down, tiles along) float32 array
        Smooth part known so far, dB; the new part is added to it.
    spread : float
        Standard deviation of the pixels of the background, dB.
    fixed : (tiles down, tiles along) bool array
        True for tiles whose level is known and stays.

    Returns
    -------
    smooth : (tiles down, tiles along) float32 array
        dB; 0 everywhere if nothing is known.
    outlying : (tiles down, tiles along) bool array
        True for tiles set off by a sharp edge, and for fixed ones.
    """
    known = np.isfinite(level)
    outlying = _outlying(level, known, spread)
    # Varying soot hides leaks until it is removed.
    about = ndimage.uniform_filter(extrapolate(np.where(outlying | fixed, np.nan, level)), LEVEL_WINDOW, mode="nearest")
    outlying |= _outlying(level - about, known & ~outlying, spread)
    residual = extrapolate(np.where(outlying | fixed, np.nan, level - before))
    smooth = before + ndimage.uniform_filter(ndimage.median_filter(residual, MEDIAN_WINDOW, mode="nearest"), 3, mode="nearest")
    smooth[fixed] = level[fixed]
    return smooth.astype(np.float32), outlying


def extrapolate(values: Single) -> Single:
    """Fill unknown tiles (NaN) with the mean of known ones in ever larger windows; 0 if none is known."""
    out = np.asarray(values, dtype=np.float32).copy()
    known = np.isfinite(out)
    if not known.any():
        return np.zeros_like(out)
    weight, total = known.astype(np.float32), np.where(known, out, np.float32(0.0))
    size = 3
    while not known.all():
        selected = ndimage.uniform_filter(weight, size, mode="constant")
        # A window's share of known tiles is a sum with rounding errors.
        new = ~known & (selected * size * size > 0.5)
        out[new] = (ndimage.uniform_filter(total, size, mode="constant") / np.maximum(selected, 1e-9))[new]
        known |= new
        size = 2 * size + 1
    return out


def _outlying(level: Single, free: Bool, spread: float) -> Bool:
    """Return the tiles in outlying pieces with a sharp boundary, and the tiles partly inside them."""
    limit = _limits(level, free, spread)
    outlying = np.zeros(level.shape, np.bool_)
    for sign in (1.0, -1.0):
        with np.errstate(invalid="ignore"):
            out = free & (sign * level > limit[:, None])
        outlying |= _sharp(level, out)
    grown: Bool = ndimage.binary_dilation(outlying, np.ones((3, 3), np.bool_))
    return grown


def _limits(level: Single, used: Bool, spread: float) -> Float:
    """Return the permitted deviation of a tile, for each row of tiles, dB."""
    limit = np.full(len(level), np.nan)
    for row in range(len(level)):
        about = slice(max(row - BAND_TILES, 0), row + BAND_TILES + 1)
        bright = level[about][used[about]]
        bright = bright[bright > 0.0]
        if len(bright) >= MIN_TILES:
            limit[row] = OUTLIER_LEVEL * MAD_TO_SIGMA * float(np.median(bright))
    usual = np.nanmedian(limit) if np.isfinite(limit).any() else 0.0
    return np.maximum(np.where(np.isfinite(limit), limit, usual), spread)


def _sharp(level: Single, out: Bool) -> Bool:
    """Return those outlying tiles in pieces with a sharp boundary; a piece without a boundary counts as sharp."""
    pieces, count = ndimage.label(out)
    if not count:
        return out
    boundary = out & ndimage.binary_dilation(np.isfinite(level) & ~out)
    steep = (_range(level, EDGE_WINDOW)[boundary] / np.maximum(_range(level, SURROUNDING_WINDOW)[boundary], 1e-6)).astype(
        np.float64
    )
    part = ndimage.labeled_comprehension(steep, pieces[boundary], np.arange(1, count + 1), np.median, float, 1.0)
    sharp: Bool = np.concatenate([[False], part > MIN_SHARP_SHARE])[pieces]
    return sharp


def _range(level: Single, size: int) -> Single:
    """Return the range of known tiles in windows of so many tiles a side."""
    known = np.isfinite(level)
    highest = ndimage.maximum_filter(np.where(known, level, -np.inf), size, mode="nearest")
    lowest = ndimage.minimum_filter(np.where(known, level, np.inf), size, mode="nearest")
    return highest - lowest
