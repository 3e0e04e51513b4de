"""Limits of outlier tests: number of points and significance levels."""

from __future__ import annotations

MAX_TESTED_SINGLY = 30
"""Maximum number of points that are tested one by one."""

MAX_OUTLIER_SHARE = 1 / 8
"""Maximum share of few points to reject, rounded up."""

LEVEL_KNOWN_SIGMA = 1e-4
"""Probability that a ring without outliers loses a point, if the accuracy of points is known."""

LEVEL_OWN_SIGMA = 1e-2
"""Probability if the ring itself gives the accuracy. At LEVEL_KNOWN_SIGMA no outlier of eight points could be found."""

LEVEL_WORSE_SIGMA = 1e-3
"""Level at which a ring's own residuals count as worse than the known accuracy of points."""
