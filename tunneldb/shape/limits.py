"""From how many points on they are judged together, and at which levels they are tested one by one."""

from __future__ import annotations

FEW = 30
"""Up to so many points each is tested against the others."""

BAD_SHARE = 1 / 8
"""Of few points so many may be left out, rounded up."""

LEVEL_KNOWN = 1e-4
"""Chance by which a ring without an error loses a point, where what a point is good for is known."""

LEVEL_OWN = 1e-2
"""The same where that must come from the ring itself. At LEVEL_KNOWN, of eight points none could ever be told."""

WORSE = 1e-3
"""Level at which a ring's own residuals are taken to be worse than what is known of points."""
