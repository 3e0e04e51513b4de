"""What changes slowly along and across the lining, told from what is set off by a sharp edge; on tiles of half a metre."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

Float = NDArray[np.float64]
Single = NDArray[np.float32]
Mask = NDArray[np.bool_]

ASIDE = 3.0
"""A tile stands out when it differs by so many standard deviations of the tiles at like arcs."""

BAND = 4
"""So many tiles to either side in arc, of the whole kilometre, say how much tiles differ."""

REACH = 2
"""An edge is sharp when most of the step lies within so many tiles."""

SHARP = 0.6
"""Part of the step within REACH from which an edge is sharp: a smooth passage over twice that length has less."""

SMOOTH = (5, 9)
"""Tiles down and along of the median filter."""

FEW = 20
"""So many tiles tell by how much they differ."""


def slow(beyond: Single, spread: float, pinned: Mask) -> tuple[Single, Mask]:
    """Follow what changes slowly, and nothing that is set off by a sharp edge.

    Dry lining differs from place to place as much towards dark as towards bright, and wet lining is only ever darker. So
    the brighter half of the tiles at like arcs tells by how much tiles may differ (at least ``spread``). Tiles that stand
    out in one piece are followed when their rim is soft: soot fades over metres, a leak or a patch ends within a
    decimetre. Otherwise the level about them is laid over them.

    Parameters
    ----------
    beyond : (tiles down, tiles along) float32 array
        Level of dry lining in each tile beyond the model so far, dB; NaN where it is unknown.
    spread : float
        Standard deviation of the pixels of dry lining, dB.
    pinned : (tiles down, tiles along) bool array
        Tiles whose level is known, and kept.

    Returns
    -------
    smooth : (tiles down, tiles along) float32 array
        dB; 0 everywhere if nothing is known.
    odd : (tiles down, tiles along) bool array
        Tiles set off by a sharp edge.
    """
    known = np.isfinite(beyond)
    limit = _limits(beyond, known & ~pinned, spread)
    odd = np.zeros(beyond.shape, np.bool_)
    for sign in (1.0, -1.0):
        with np.errstate(invalid="ignore"):
            out = known & ~pinned & (sign * beyond > limit[:, None])
        odd |= _sharp(np.where(known, sign * beyond, np.nan), out)
    # The tiles about them lie partly in them.
    odd = ndimage.binary_dilation(odd, np.ones((3, 3), np.bool_)) & ~pinned
    filled = fill(np.where(odd, np.nan, beyond))
    smooth = ndimage.uniform_filter(ndimage.median_filter(filled, SMOOTH, mode="nearest"), 3, mode="nearest")
    smooth[pinned] = beyond[pinned]
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


def _limits(beyond: Single, used: Mask, spread: float) -> Float:
    """By how much a tile may differ, for each row of tiles, dB."""
    limit = np.full(len(beyond), np.nan)
    for row in range(len(beyond)):
        about = slice(max(row - BAND, 0), row + BAND + 1)
        bright = beyond[about][used[about]]
        bright = bright[bright > 0.0]
        if len(bright) >= FEW:
            limit[row] = ASIDE * 1.4826 * float(np.median(bright))
    rest = np.nanmedian(limit) if np.isfinite(limit).any() else 0.0
    return np.maximum(np.where(np.isfinite(limit), limit, rest), spread)


def _sharp(step: Single, out: Mask) -> Mask:
    """Of tiles that stand out by ``step``, those in pieces whose rim is sharp; pieces without a rim are."""
    pieces, count = ndimage.label(out)
    if not count:
        return out
    rest = np.isfinite(step) & ~out
    about = ndimage.minimum_filter(np.where(rest, step, np.inf), 2 * REACH + 1, mode="nearest")
    with np.errstate(invalid="ignore"):
        rise = step - about
    rim = out & ndimage.binary_dilation(rest)
    number = np.arange(1, count + 1)
    height = ndimage.labeled_comprehension(step, pieces, number, lambda v: np.percentile(v, 90), float, np.nan)
    edge = ndimage.labeled_comprehension(rise[rim], pieces[rim], number, np.median, float, np.inf)
    chosen = np.concatenate([[False], edge > SHARP * height])
    sharp: Mask = chosen[pieces]
    return sharp
