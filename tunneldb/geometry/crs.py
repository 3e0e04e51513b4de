"""Coordinate systems that files name, compared, and where on Earth they are made for."""

from __future__ import annotations

import numpy as np
from pyproj import CRS, Transformer
from pyproj.exceptions import CRSError, ProjError

from tunneldb.arrays import Float

LOCAL = 0
"""SRID of a tunnel in local coordinates: metres that have no place on Earth; PostGIS's own number for no reference system."""

LOCAL_NAME = "local coordinates"

MARGIN = 0.5
"""How far beyond the bounds of its area of use a system is still taken for meant, degrees: surveys run on over the border of
a zone or a country."""


def same_horizontally(one: CRS, other: CRS) -> bool:
    """Tell whether two coordinate systems agree in the plane, whatever their heights refer to."""
    a, b = horizontal(one), horizontal(other)
    if a.equals(b, ignore_axis_order=True):
        return True
    code = a.to_epsg()
    return code is not None and code == b.to_epsg()


def horizontal(crs: CRS) -> CRS:
    """Horizontal part of a coordinate system that may be compound, bound or three-dimensional."""
    if crs.is_bound and crs.source_crs is not None:
        crs = crs.source_crs
    if crs.is_compound:
        crs = crs.sub_crs_list[0]
    return crs.to_2d()


def describe_crs(crs: CRS) -> str:
    """Name of a coordinate system with its EPSG code, where it has one."""
    code = horizontal(crs).to_epsg()
    return f"EPSG:{code} ({crs.name})" if code is not None else crs.name


def is_local(crs: CRS) -> bool:
    """Tell whether a coordinate system has no place on Earth, as the engineering systems of WKT."""
    return bool(horizontal(crs).is_engineering)


def srid_name(srid: int) -> str:
    """Name of a tunnel's SRID, an EPSG code or LOCAL, in a sentence."""
    return LOCAL_NAME if srid == LOCAL else f"EPSG:{srid}"


def fits_srid(crs: CRS, srid: int) -> bool:
    """Tell whether coordinates in a system are those of an SRID, an EPSG code or LOCAL, in the plane."""
    return is_local(crs) if srid == LOCAL else same_horizontally(crs, CRS.from_epsg(srid))


def describe_srid(srid: int) -> str:
    """Name of a tunnel's SRID with the name of the system."""
    return LOCAL_NAME if srid == LOCAL else describe_crs(CRS.from_epsg(srid))


def outside_area(srid: int | None, xy: Float) -> str | None:
    """Say that coordinates lie outside the area that their system is made for.

    Parameters
    ----------
    srid : int or None
        EPSG code; None or LOCAL have no area.
    xy : (n, 2) float64 array
        Easting and northing, m.

    Returns
    -------
    str or None
        Which area, and what is to be done; None if any of them lies in it, within MARGIN, or it is not known.
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
    # Longitudes are counted from the western bound, for the area may lie across 180°.
    width = (area.east - area.west) % 360.0 or 360.0
    along = (np.asarray(east) - area.west + MARGIN) % 360.0
    inside = (along <= width + 2.0 * MARGIN) & (area.south - MARGIN <= north) & (north <= area.north + MARGIN)
    if inside.any():
        return None
    return (
        f"the coordinates lie outside the area that EPSG:{srid} ({crs.name}) is made for, {area.name.rstrip('.')}: the map"
        " shows them in a wrong place; is it another SRID, or are they local (tunnel add --srid local)?"
    )
