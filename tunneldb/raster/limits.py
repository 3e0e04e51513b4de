"""Limits of the points that an image takes: depth, range and incidence.

Each test is one function for arrays and, in compiled loops, for single points. NaN is outside every limit.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from tunneldb.compiled import both


class Limits(NamedTuple):
    """Limits of the points that an image takes.

    Attributes
    ----------
    tolerance, recess : float
        Maximum distance in front of the surface and behind it, m.
    cosine : float
        Minimum cosine of the incidence angle.
    far : float
        Maximum range, m.
    """

    tolerance: float
    recess: float
    cosine: float
    far: float


@both
def near_surface(offset: Any, limits: Limits) -> Any:
    """Return True for offsets (m) within the limits of depth."""
    return (offset >= -limits.recess) & (offset <= limits.tolerance)


@both
def within_range(distance: Any, limits: Limits) -> Any:
    """Return True for ranges (m) within the limit."""
    return distance <= limits.far


@both
def steep_enough(cosine: Any, limits: Limits) -> Any:
    """Return True for cosines of the incidence angle within the limit."""
    return cosine >= limits.cosine
