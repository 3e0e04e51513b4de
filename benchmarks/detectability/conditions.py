"""Conditions on which detection of a leak depends, by tiles of the picture: noise, density of points, and clutter."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy import ndimage

from tunneldb.anomalies.background.contrast import ContrastImage
from tunneldb.anomalies.windows import on_lining
from tunneldb.arrays import Bool, Float, Int64, UInt8
from tunneldb.raster.pixel_state import PixelState

REACH = 1
"""Number of tiles around one whose points and clutter count."""

NAMES = ("noise", "filled", "clutter")
"""Names of the conditions."""

LEAST_FILLED = 1e-3
"""Minimum share of pixels with points, for its logarithm."""


@dataclass(frozen=True)
class Conditions:
    """Conditions by tile (tiles down, tiles along).

    Attributes
    ----------
    tile : int
        Side of a tile, pixels.
    lining : int array
        Number of pixels of inspected lining.
    values : (len(NAMES), tiles down, tiles along) float array
        Logarithm of the standard deviation of dry lining, dB; logarithm of the share of pixels with points; share of the
        surroundings that are dark, or fixtures.
    """

    tile: int
    lining: Int64
    values: Float


def measure_conditions(contrast: ContrastImage, state: UInt8, dark: Bool) -> Conditions:
    """Measure the conditions of a picture.

    Parameters
    ----------
    contrast : ContrastImage
        Picture as detected.
    state : (rows, columns) uint8 array
        State of its pixels; pixels between profiles without points are empty.
    dark : (rows, columns) bool array
        Dark pixels.
    """
    tile = contrast.tile
    lining = on_lining(state)
    filled, possible, obstacle = (
        _sums(mask, tile) for mask in (lining, state <= PixelState.RECESS, dark | (state == PixelState.OFF))
    )
    size = _sums(np.ones(state.shape, np.bool_), tile)
    share = _around(filled) / np.maximum(_around(possible), 1.0)
    clutter = _around(obstacle) / _around(size)
    noise = np.log(np.maximum(contrast.sigma[: len(size), : size.shape[1]].astype(np.float64), 1e-3))
    return Conditions(tile, filled.astype(np.int64), np.stack([noise, np.log(np.maximum(share, LEAST_FILLED)), clutter]))


def _sums(mask: Bool, tile: int) -> Float:
    """Count the pixels of a mask by tiles."""
    rows, columns = (np.arange(0, count, tile) for count in mask.shape)
    found = np.zeros((len(rows), len(columns)))
    for k, (top, stop) in enumerate(pairwise([*rows.tolist(), len(mask)])):
        found[k] = np.add.reduceat(np.count_nonzero(mask[top:stop], axis=0), columns)
    return found


def _around(values: Float) -> Float:
    """Sum the tiles and their neighbours."""
    around: Float = ndimage.uniform_filter(values, 2 * REACH + 1, mode="constant") * (2 * REACH + 1) ** 2
    return around
