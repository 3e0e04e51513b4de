"""Constants of robust statistics."""

from __future__ import annotations

MAD_TO_SIGMA = 1.4826
"""Ratio of standard deviation to median absolute deviation for a normal distribution: 1 / Φ⁻¹(3/4)."""
