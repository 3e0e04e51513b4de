"""Tukey's biweight: residuals beyond a limit have no weight."""

from __future__ import annotations

import numpy as np

from tunneldb.arrays import Float

CUT = 4.685
"""Multiple of the standard deviation from which a residual has no weight: 95 % efficient on normal residuals."""


def weights(u: Float) -> Float:
    """Return the weights (n,) of residuals (n,) in units of the limit."""
    return np.clip(1.0 - u**2, 0.0, None) ** 2


def rate(u: Float) -> Float:
    """Return the derivative (n,) of weight times residual by the residual, for residuals (n,) in units of the limit."""
    inside = np.clip(1.0 - u**2, 0.0, None)
    return inside * (1.0 - 5.0 * u**2)
