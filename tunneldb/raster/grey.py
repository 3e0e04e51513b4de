"""Grey scale of intensity images."""

from __future__ import annotations

import numpy as np

from tunneldb.arrays import Float, Single


def grey_range(values: Float | Single) -> tuple[float, float]:
    """Return the intensities, dB, for black and white, from a sample of all values, dB.

    The lining, most of an image, becomes light grey, so that a leak, darker by some decibels, stands out from noise and soot.
    Black is the 2 % quantile or lower, at least 4 dB below the median; white is the 98 % quantile or higher, at least 1.6 dB
    above the median.
    """
    if not len(values):
        return 0.0, 1.0
    low, middle, high = np.quantile(values, [0.02, 0.5, 0.98])
    return float(min(low, middle - 4.0)), float(max(high, middle + 1.6))
