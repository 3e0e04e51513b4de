"""Limits of outlier tests: number of points and significance levels."""

from __future__ import annotations

FEW = 30
"""Maximum number of points that are tested one by one."""

BAD_SHARE = 1 / 8
"""Maximum share of few points to reject, rounded up."""

LEVEL_KNOWN = 1e-4
"""Probability that a ring without outliers loses a point, if the accuracy of points is known."""

LEVEL_OWN = 1e-2
"""Probability if the accuracy is estimated from the ring itself. At LEVEL_KNOWN no outlier of eight points could be found."""

WORSE = 1e-3
"""Level at which a ring's own residuals count as worse than the known accuracy of points."""
