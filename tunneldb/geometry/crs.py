"""Coordinate systems that files name, compared."""

from __future__ import annotations

from pyproj import CRS


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
