"""Tukey's biweight: what lies farther off than a limit has no weight at all."""

from __future__ import annotations

import numpy as np

from tunneldb.arrays import Float

CUT = 4.685
"""Multiple of the standard deviation from which a residual has no weight: 95 % efficient on normal residuals."""


def weights(u: Float) -> Float:
    """Weights (n,) of residuals (n,) in units of the limit."""
    return np.clip(1.0 - u**2, 0.0, None) ** 2


def rate(u: Float) -> Float:
    """Derivative (n,) of weight times residual by the residual, of residuals (n,) in units of the limit."""
    inside = np.clip(1.0 - u**2, 0.0, None)
    return inside * (1.0 - 5.0 * u**2)
