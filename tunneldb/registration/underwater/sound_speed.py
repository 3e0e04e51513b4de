"""Speed of sound that all scans share: the water of a canal has nearly one temperature."""

from __future__ import annotations

import numpy as np

from tunneldb.arrays import Int64
from tunneldb.registration.underwater.observations import POSE, Pose, Rows

# Standard deviation of a scan's range scale about the mean of all scans: a quarter of a kelvin. Scans whose scale differs
# more, for example of another day, get less weight (Geman and McClure).
SCAN_SPREAD = 0.0006


def sound_rows(pose: Pose, mean: float, scan: int, columns: Int64) -> Rows:
    """Return the equation that the range scale of a scan is that of all scans.

    ``mean`` is the scale of all scans less 1; ``columns`` (1,) is its index among the common parameters.
    """
    design = np.zeros((1, POSE))
    design[0, -1] = 1.0
    one = np.ones(1)
    return Rows(
        np.array([pose.scale - 1.0 - mean]), SCAN_SPREAD * one, design, scan, None, None, -one[:, None], columns,
        np.zeros(1, np.int64), SCAN_SPREAD * one, "sound", "",
    )  # fmt: skip
