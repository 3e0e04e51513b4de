"""Conditions on which detection of a leak depends, by tiles of the picture: noise, density of points, and clutter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from tunneldb.anomalies.background.contrast import ContrastImage
from tunneldb.anomalies.threshold import seen_lining
from tunneldb.anomalies.windows import count_in_columns, on_lining
from tunneldb.arrays import Bool, Float, Int64, UInt8
from tunneldb.raster.state import PixelState

REACH = 1
"""Number of tiles around one whose points and clutter count."""

NAMES = ("noise", "filled", "clutter")
"""Names of the conditions."""

LEAST_NOISE = 1e-3
"""Minimum standard deviation, dB, for its logarithm."""

LEAST_FILLED = 1e-3
"""Minimum share of pixels with points, for its logarithm."""


@dataclass(frozen=True)
class Conditions:
    """Conditions by tile (tiles down, tiles along).

    Attributes
    ----------
    tile : int
        Side of a tile, pixels.
    seen : int array
        Number of pixels of inspected lining.
    values : (len(NAMES), tiles down, tiles along) float array
        Logarithm of the standard deviation of dry lining, dB; logarithm of the share of pixels with points; share of the
        surroundings that are dark, or fixtures.
    """

    tile: int
    seen: Int64
    values: Float


def measure_conditions(contrast: ContrastImage, dark: Bool, size: int) -> Conditions:
    """Measure the conditions of a picture.

    Parameters
    ----------
    contrast : ContrastImage
        Picture as detected.
    dark : (rows, columns) bool array
        Its dark pixels.
    size : int
        Side of the median filter, pixels.
    """
    tile, state = contrast.tile, contrast.state
    counts = np.zeros((4, -(-state.shape[0] // tile), -(-state.shape[1] // tile)))
    for k, top in enumerate(range(0, len(state), tile)):
        rows = slice(top, top + tile)
        here = state[rows]
        filled = on_lining(here) if contrast.between is None else on_lining(here) & ~contrast.between[rows]
        masks = filled, here <= PixelState.RECESS, dark[rows] | (here == PixelState.OFF), np.ones_like(filled)
        for count, mask in zip(counts, masks, strict=True):
            count[k] = _along(count_in_columns(mask), tile)
    filled_pixels, possible, obstacle, pixels = (_around(count) for count in counts)
    share = filled_pixels / np.maximum(possible, 1.0)
    sigma = contrast.sigma[: counts.shape[1], : counts.shape[2]].astype(np.float64)
    values = np.log(np.maximum(sigma, LEAST_NOISE)), np.log(np.maximum(share, LEAST_FILLED)), obstacle / pixels
    return Conditions(tile, _seen(state, size, tile), np.stack(values))


def _seen(state: UInt8, size: int, tile: int) -> Int64:
    """Count the pixels of inspected lining by tiles."""
    counts = np.zeros((-(-state.shape[0] // tile), -(-state.shape[1] // tile)), np.int64)
    for rows, seen in seen_lining(state, size):
        for row in range(rows.start // tile, (rows.stop - 1) // tile + 1):
            part = seen[max(row * tile - rows.start, 0) : (row + 1) * tile - rows.start]
            counts[row] += _along(count_in_columns(part), tile)
    return counts


def _along(columns: Int64, tile: int) -> Int64:
    """Sum counts of columns by tiles."""
    sums: Int64 = np.add.reduceat(columns, np.arange(0, len(columns), tile))
    return sums


def _around(values: Float) -> Float:
    """Sum the tiles and their neighbours."""
    around: Float = ndimage.uniform_filter(values, 2 * REACH + 1, mode="constant") * (2 * REACH + 1) ** 2
    return around
