"""Coordinate systems of files: comparison, and area of use."""

from __future__ import annotations

import numpy as np
from pyproj import CRS, Transformer
from pyproj.exceptions import CRSError, ProjError

from tunneldb.arrays import Float

LOCAL = 0
"""SRID of a tunnel in local coordinates, metres without a place on Earth; PostGIS's number for no reference system."""

LOCAL_NAME = "local coordinates"

MARGIN = 0.5
"""Greatest distance beyond the bounds of a system's area of use, degrees: surveys may cross the border of a zone or a
country."""


def same_horizontally(one: CRS, other: CRS) -> bool:
    """Return True if two coordinate systems agree in the plane, whatever their height systems."""
    a, b = horizontal(one), horizontal(other)
    if a.equals(b, ignore_axis_order=True):
        return True
    code = a.to_epsg()
    return code is not None and code == b.to_epsg()


def horizontal(crs: CRS) -> CRS:
    """Return the horizontal part of a coordinate system that may be compound, bound or three-dimensional."""
    if crs.is_bound and crs.source_crs is not None:
        crs = crs.source_crs
    if crs.is_compound:
        crs = crs.sub_crs_list[0]
    return crs.to_2d()


def describe_crs(crs: CRS) -> str:
    """Return the name of a coordinate system, with its EPSG code if it has one."""
    code = horizontal(crs).to_epsg()
    return f"EPSG:{code} ({crs.name})" if code is not None else crs.name


def is_local(crs: CRS) -> bool:
    """Return True if a coordinate system has no place on Earth, such as engineering systems of WKT."""
    return bool(horizontal(crs).is_engineering)


def srid_name(srid: int) -> str:
    """Return the name of a tunnel's SRID (EPSG code or LOCAL) for a message."""
    return LOCAL_NAME if srid == LOCAL else f"EPSG:{srid}"


def fits_srid(crs: CRS, srid: int) -> bool:
    """Return True if a coordinate system agrees with an SRID (EPSG code or LOCAL) in the plane."""
    return is_local(crs) if srid == LOCAL else same_horizontally(crs, CRS.from_epsg(srid))


def describe_srid(srid: int) -> str:
    """Return the name of a tunnel's SRID with the name of the system."""
    return LOCAL_NAME if srid == LOCAL else describe_crs(CRS.from_epsg(srid))


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
        east, north = degrees.transform(xy[:, 0], xy[:, 1])
    except (CRSError, ProjError):
        return None
    area = crs.area_of_use
    # Longitudes are relative to the western bound, since the area may cross 180°.
    width = (area.east - area.west) % 360.0 or 360.0
    along = (np.asarray(east) - area.west + MARGIN) % 360.0
    inside = (along <= width + 2.0 * MARGIN) & (area.south - MARGIN <= north) & (north <= area.north + MARGIN)
    if inside.any():
        return None
    return (
        f"the coordinates are outside the area of use of EPSG:{srid} ({crs.name}), {area.name.rstrip('.')}, and would be shown"
        " in a wrong place on the map; check the SRID, or use local coordinates (tunnel add --srid local)"
    )
