"""Grey in which intensity is drawn."""

from __future__ import annotations

import numpy as np

from tunneldb.arrays import Float, Single


def grey_range(values: Float | Single) -> tuple[float, float]:
    """Return the intensities, dB, that are drawn black and white, for a sample of all, dB.

    The lining, which is most of an image, becomes a light grey, and a leak, darker by some decibels, stands out from its
    noise and from soot: black is the 2 % quantile or lower, at least 4 dB below the median; white 98 %, at least 1.6 dB
    above it.
    """
    if not len(values):
        return 0.0, 1.0
    low, middle, high = np.quantile(values, [0.02, 0.5, 0.98])
    return float(min(low, middle - 4.0)), float(max(high, middle + 1.6))
