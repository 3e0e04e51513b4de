"""What changes slowly along and across the lining, told from what is set off by a sharp edge; on tiles of half a metre."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from tunneldb.arrays import Bool, Float, Single

ASIDE = 3.0
"""A tile stands out when it differs by so many standard deviations of the tiles at like arcs."""

BAND = 4
"""So many tiles to either side in arc, of the whole kilometre, say how much tiles differ."""

EDGE, ABOUT = 3, 7
"""Tiles to a side of the windows that show an edge itself and what it is part of: 1 m and 3 m from middle to middle."""

SHARP = 0.6
"""Part of the step about it from which an edge is sharp: one that fades over more than 1.7 m is not."""

WIDE = (7, 13)
"""Tiles down and along of the windows that show the level about a tile."""

SMOOTH = (5, 9)
"""Tiles down and along of the median filter."""

FEW = 20
"""So many tiles tell by how much they differ."""


def slow(level: Single, before: Single, spread: float, pinned: Bool) -> tuple[Single, Bool]:
    """Follow what changes slowly, and nothing that is set off by a sharp edge.

    Dry lining differs from place to place as much towards dark as towards bright, and wet lining is only ever darker. So
    the brighter half of the tiles at like arcs tells by how much tiles may differ (at least ``spread``). Tiles that stand
    out in one piece are followed when their rim is soft: soot fades over metres, a leak or a patch ends within a
    decimetre. Otherwise the level about them is laid over them.

    Parameters
    ----------
    level : (tiles down, tiles along) float32 array
        Level of dry lining in each tile beyond base, rings and bands, dB; NaN where it is unknown.
    before : (tiles down, tiles along) float32 array
        What is known already to change slowly, dB; what is found is added to it.
    spread : float
        Standard deviation of the pixels of dry lining, dB.
    pinned : (tiles down, tiles along) bool array
        Tiles whose level is known, and kept.

    Returns
    -------
    smooth : (tiles down, tiles along) float32 array
        dB; 0 everywhere if nothing is known.
    odd : (tiles down, tiles along) bool array
        Tiles set off by a sharp edge; pinned ones too.
    """
    known = np.isfinite(level)
    odd = _odd(level, known, spread)
    # Soot that comes and goes hides leaks until it is taken off.
    about = ndimage.uniform_filter(fill(np.where(odd | pinned, np.nan, level)), WIDE, mode="nearest")
    odd |= _odd(level - about, known & ~odd, spread)
    rest = fill(np.where(odd | pinned, np.nan, level - before))
    smooth = before + ndimage.uniform_filter(ndimage.median_filter(rest, SMOOTH, mode="nearest"), 3, mode="nearest")
    smooth[pinned] = level[pinned]
    return smooth.astype(np.float32), odd


def fill(values: Single) -> Single:
    """Fill unknown tiles (NaN) with the mean of known ones in ever larger windows; 0 where nothing is known at all."""
    out = np.asarray(values, dtype=np.float32).copy()
    known = np.isfinite(out)
    if not known.any():
        return np.zeros_like(out)
    weight, total = known.astype(np.float32), np.where(known, out, np.float32(0.0))
    size = 3
    while not known.all():
        held = ndimage.uniform_filter(weight, size, mode="constant")
        # A window's share of known tiles comes out as a sum with rounding errors.
        new = ~known & (held * size * size > 0.5)
        out[new] = (ndimage.uniform_filter(total, size, mode="constant") / np.maximum(held, 1e-9))[new]
        known |= new
        size = 2 * size + 1
    return out


def _odd(level: Single, free: Bool, spread: float) -> Bool:
    """Tiles that stand out in pieces with a sharp rim, and those that lie partly in them."""
    limit = _limits(level, free, spread)
    odd = np.zeros(level.shape, np.bool_)
    for sign in (1.0, -1.0):
        with np.errstate(invalid="ignore"):
            out = free & (sign * level > limit[:, None])
        odd |= _sharp(level, out)
    grown: Bool = ndimage.binary_dilation(odd, np.ones((3, 3), np.bool_))
    return grown


def _limits(level: Single, used: Bool, spread: float) -> Float:
    """By how much a tile may differ, for each row of tiles, dB."""
    limit = np.full(len(level), np.nan)
    for row in range(len(level)):
        about = slice(max(row - BAND, 0), row + BAND + 1)
        bright = level[about][used[about]]
        bright = bright[bright > 0.0]
        if len(bright) >= FEW:
            limit[row] = ASIDE * 1.4826 * float(np.median(bright))
    rest = np.nanmedian(limit) if np.isfinite(limit).any() else 0.0
    return np.maximum(np.where(np.isfinite(limit), limit, rest), spread)


def _sharp(level: Single, out: Bool) -> Bool:
    """Of tiles that stand out from the level, those in pieces whose rim is sharp; pieces without a rim are."""
    pieces, count = ndimage.label(out)
    if not count:
        return out
    rim = out & ndimage.binary_dilation(np.isfinite(level) & ~out)
    steep = (_span(level, EDGE)[rim] / np.maximum(_span(level, ABOUT)[rim], 1e-6)).astype(np.float64)
    part = ndimage.labeled_comprehension(steep, pieces[rim], np.arange(1, count + 1), np.median, float, 1.0)
    sharp: Bool = np.concatenate([[False], part > SHARP])[pieces]
    return sharp


def _span(level: Single, size: int) -> Single:
    """By how much known tiles differ in windows of so many tiles to a side."""
    known = np.isfinite(level)
    highest = ndimage.maximum_filter(np.where(known, level, -np.inf), size, mode="nearest")
    lowest = ndimage.minimum_filter(np.where(known, level, np.inf), size, mode="nearest")
    span: Single = highest - lowest
    return span
