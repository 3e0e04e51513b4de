"""Which pixels are wet: three-sigma threshold and median filter (Xu et al., 2018, eq. 19–20 and fig. 9c)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

Single = NDArray[np.float32]
Mask = NDArray[np.bool_]

MEDIAN = 5
"""Side of the median filter where every pixel holds points, pixels."""

MEDIAN_PIXELS = 12
"""The filter is widened until it holds so many pixels with points on average."""


def filter_size(filled: float) -> int:
    """Side of the median filter, pixels (odd), for an image of whose pixels the share ``filled`` hold points.

    Where profiles are farther apart than pixels are wide, a filter of five pixels would hold a handful of
    values.
    """
    size = MEDIAN
    while size * size * filled < MEDIAN_PIXELS and size < 51:
        size += 2
    return size


def wet_pixels(corrected: Single, lining: Mask, closed: Mask, threshold: float, size: int) -> Mask:
    """Mark wet pixels.

    A lining pixel below the threshold is wet (eq. 20). The median of the wet and dry ones about each pixel
    then decides: single ones go, and pixels without a point take the state of those about them.

    Parameters
    ----------
    corrected : (rows, columns) float32 array
        Corrected intensity, dB, NaN where there is no point.
    lining : (rows, columns) bool array
        Pixels that show lining.
    closed : (rows, columns) bool array
        Pixels that can't be wet lining: appendages, floor.
    threshold : float
        dB.
    size : int
        Side of the median filter, pixels.
    """
    with np.errstate(invalid="ignore"):
        wet = lining & (corrected < threshold)
    votes = ndimage.uniform_filter(lining.astype(np.float32), size, mode="constant")
    wet_votes = ndimage.uniform_filter(wet.astype(np.float32), size, mode="constant")
    enough = votes > 0.2 * min(1.0, MEDIAN_PIXELS / (size * size))
    return np.asarray((wet_votes > 0.5 * votes) & enough & ~closed, dtype=np.bool_)
