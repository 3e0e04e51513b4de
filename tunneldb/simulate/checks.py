"""Checks that the parameters of all simulators share."""

from __future__ import annotations

import math
from collections.abc import Mapping

import pyproj
from pyproj.exceptions import CRSError

from tunneldb.errors import UserError

Limits = Mapping[str, tuple[float, float, str]]
"""Lowest and highest value of parameters, and their unit."""


def require_within(parameters: object, limits: Limits, separator: str = "-") -> None:
    """Refuse a value outside its limits; None, which leaves it to the simulator, is allowed.

    Raises
    ------
    UserError
        Names the parameter, with this separator between its words, its value and its limits.
    """
    for name, (low, high, unit) in limits.items():
        value = getattr(parameters, name)
        if value is not None and not low <= value <= high:
            shown = f"{value:g}" if abs(value) < 1e15 else f"{str(value)[:12]}…"  # whole numbers may have any length
            raise UserError(f"{name.replace('_', separator)} is {shown}: give {low:g} to {high:g} {unit}")


def metric_crs(srid: int) -> pyproj.CRS:
    """Return the coordinate system of an EPSG code; projected, in metres.

    Raises
    ------
    UserError
        It is unknown, or not projected in metres.
    """
    try:
        crs = pyproj.CRS.from_epsg(srid)
    except CRSError:
        raise UserError(f"SRID {srid} is unknown: give the EPSG code of a projected system") from None
    if not crs.is_projected or not math.isclose(crs.axis_info[0].unit_conversion_factor, 1.0):
        raise UserError(f"SRID {srid} ({crs.name}) is not projected in metres: give one that is")
    return crs
