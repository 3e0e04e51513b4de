"""Planes of a lining, fitted so that what hangs on it and what is let into it does not draw them to itself."""

from __future__ import annotations

DELTA = 0.03
"""Distance from the plane from which a pixel is an appendage (eq. 23), m."""
