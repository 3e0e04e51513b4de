"""Coordinate systems of files: comparison, and area of use."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from pyproj import CRS, Transformer
from pyproj.exceptions import CRSError, ProjError

from tunneldb.arrays import Float
from tunneldb.geometry.crs_equality import epsg_code, horizontal, same_horizontally, vertical
from tunneldb.geometry.local import LOCAL, LOCAL_NAME
from tunneldb.geometry.units import METRES, unit_name, unit_option

if TYPE_CHECKING:
    from pyproj._crs import Axis

MARGIN = 0.5
"""Greatest distance beyond the bounds of a system's area of use, degrees: surveys may cross the border of a zone or a
country."""

_NAMELESS = re.compile("^(unknown|unnamed|)$", re.IGNORECASE)


class StatedUnit(NamedTuple):
    """Unit of coordinates that a file states.

    Attributes
    ----------
    name : str
        Its name.
    metres : float or None
        Its length, m; None for an angle.
    """

    name: str
    metres: float | None


def plan_unit(crs: CRS) -> StatedUnit | None:
    """Return the unit of a coordinate system in plan; None if it has no axes there."""
    axes = horizontal(crs).axis_info
    if not axes:
        return None
    return _unit(axes[0], is_angle=horizontal(crs).is_geographic)


def height_unit(crs: CRS | None, heights: CRS | None) -> StatedUnit | None:
    """Return the unit of a system of heights, else of the ellipsoidal heights of another; None if unknown."""
    if heights is not None:
        return _unit(heights.axis_info[0]) if heights.axis_info else None
    if crs is not None and len(crs.axis_info) == 3 and not crs.is_geocentric:
        return _unit(crs.axis_info[2])
    return None


def _unit(axis: Axis, *, is_angle: bool = False) -> StatedUnit:
    if is_angle:
        return StatedUnit(axis.unit_name, None)
    metres = float(axis.unit_conversion_factor)
    named = unit_option(metres)
    return StatedUnit(axis.unit_name, metres) if named is None else StatedUnit(unit_name(named), METRES[named])


def in_metres(crs: CRS) -> CRS:
    """Return a projected system in plan with the same projection and its axes in metres; others as they are."""
    plan = horizontal(crs)
    unit = plan_unit(plan)
    if not plan.is_projected or unit is None or unit.metres == 1.0:
        return plan
    text = plan.to_json_dict()
    for axis in text["coordinate_system"]["axis"]:
        axis["unit"] = "metre"
    conversion = text["conversion"]
    for parameter in conversion["parameters"]:
        length = parameter.get("unit")
        if isinstance(length, dict) and length["type"] == "LinearUnit":
            parameter["value"] = round(parameter["value"] * length["conversion_factor"], 6)
            parameter["unit"] = "metre"
    # Without names, by which PROJ would look for the system in its own unit only.
    text["name"] = conversion["name"] = "unknown"
    for named in (text, conversion):
        named.pop("id", None)
    return CRS.from_json_dict(text)


def describe_crs(crs: CRS) -> str:
    """Return the name of a coordinate system, with its EPSG code if it has one."""
    code = epsg_code(crs)
    return f"EPSG:{code} ({crs.name})" if code is not None else crs.name


def describe_heights(crs: CRS | None, heights: CRS | None) -> str | None:
    """Return the system of the heights with its unit; None if none is stated."""
    unit = height_unit(crs, heights)
    if heights is None:
        return None if unit is None else f"ellipsoidal, {unit.name}"
    name = "not named" if _NAMELESS.match(heights.name) else heights.name
    return ", ".join(filter(None, (name, unit and unit.name, "depths" if _is_depth(heights) else "")))


def heights_differ(heights: CRS | None, srid: int) -> str | None:
    """Return a note if heights are of another system than those of a tunnel's SRID; None if either is unknown."""
    if heights is None or srid == LOCAL or _NAMELESS.match(heights.name):
        return None
    own = vertical(CRS.from_epsg(srid))
    if own is None or _same_heights(own, heights):
        return None
    return f"its heights are {heights.name}, the tunnel's are {own.name}"


def _same_heights(one: CRS, other: CRS) -> bool:
    """Return True if two height systems have the same datum, whatever their units."""
    return one.equals(other) or (one.datum is not None and other.datum is not None and one.datum.name == other.datum.name)


def _is_depth(heights: CRS) -> bool:
    return bool(heights.axis_info) and heights.axis_info[0].direction == "down"


def is_local(crs: CRS) -> bool:
    """Return True if a coordinate system has no place on Earth, such as engineering systems of WKT."""
    return bool(horizontal(crs).is_engineering)


def srid_name(srid: int) -> str:
    """Return the name of a tunnel's SRID (EPSG code or LOCAL) for a message."""
    return LOCAL_NAME if srid == LOCAL else f"EPSG:{srid}"


def fits_srid(crs: CRS, srid: int) -> bool:
    """Return True if a coordinate system agrees with an SRID (EPSG code or LOCAL) in the plane, in its unit too."""
    return is_local(crs) if srid == LOCAL else same_horizontally(crs, CRS.from_epsg(srid))


def describe_srid(srid: int) -> str:
    """Return the name of a tunnel's SRID with the name of the system."""
    return LOCAL_NAME if srid == LOCAL else describe_crs(CRS.from_epsg(srid))


def mirroring_axes(srid: int) -> tuple[str, str] | None:
    """Return the directions of x and y of an EPSG code if left and right are exchanged in its coordinates; else None."""
    try:
        directions = tuple(axis.direction for axis in horizontal(CRS.from_epsg(srid)).axis_info[:2])
    except CRSError:
        return None
    return directions if directions in (("south", "west"), ("west", "north")) else None


def outside_area(srid: int | None, xy: Float) -> str | None:
    """Return a warning if coordinates are outside the area of use of their system.

    Parameters
    ----------
    srid : int or None
        EPSG code; None and LOCAL have no area.
    xy : (n, 2) float64 array
        Easting and northing, m.

    Returns
    -------
    str or None
        The area, and what to do; None if any point is inside it, within MARGIN, or the area is unknown.
    """
    if not srid or not len(xy):
        return None
    try:
        crs = CRS.from_epsg(srid)
        if crs.geodetic_crs is None or crs.area_of_use is None:
            return None
        degrees = Transformer.from_crs(crs, crs.geodetic_crs, always_xy=True)
        if _inside(crs.area_of_use.bounds, degrees, xy):
            return None
        likely = [cause for cause, change in _CAUSES.items() if _inside(crs.area_of_use.bounds, degrees, change(xy))]
    except (CRSError, ProjError):
        return None
    why = f"; they would be inside {' or '.join(likely)}" if likely else ""
    return (
        f"the coordinates are outside the area of use of EPSG:{srid} ({crs.name}), {crs.area_of_use.name.rstrip('.')}, and"
        f" would be shown in a wrong place on the map{why}; check the SRID, or use local coordinates (tunnel add --srid local)"
    )


_CAUSES: dict[str, Callable[[Float], Float]] = {
    "with east and north swapped": lambda xy: xy[:, ::-1],
    "if they are millimetres": lambda xy: xy / 1000.0,
    "if they are feet": lambda xy: xy * 0.3048,
}
"""Likely causes of coordinates outside the area of use, and what undoes them."""


def _inside(area: tuple[float, float, float, float], degrees: Transformer, xy: Float) -> bool:
    """Return True if any point is inside an area of use (west, south, east, north, degrees), within MARGIN."""
    west, south, area_east, area_north = area
    east, north = degrees.transform(xy[:, 0], xy[:, 1])
    # Longitudes are relative to the western bound, since the area may cross 180°.
    width = (area_east - west) % 360.0 or 360.0
    with np.errstate(invalid="ignore"):  # no place on Earth
        along = (np.asarray(east) - west + MARGIN) % 360.0
    return bool(((along <= width + 2.0 * MARGIN) & (south - MARGIN <= north) & (north <= area_north + MARGIN)).any())
