"""Coordinate reference systems in the form of a QGIS project."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import psycopg
import pyproj
from pyproj.exceptions import CRSError

from tunneldb.errors import UserError
from tunneldb.geometry.local import LOCAL


def crs_element(conn: psycopg.Connection, srid: int) -> ET.Element:
    """Return the element ``spatialrefsys`` of an SRID of the database; of local coordinates it is that of no system.

    Raises
    ------
    UserError
        The SRID isn't in ``spatial_ref_sys``, or its definition can't be understood.
    """
    if srid == LOCAL:
        return no_crs()
    row = conn.execute("SELECT auth_name, auth_srid, srtext FROM spatial_ref_sys WHERE srid = %s", (srid,)).fetchone()
    if row is None:
        raise UserError(f"SRID {srid} is not in the database's spatial_ref_sys; add its definition there")
    authority, code, text = row
    try:
        crs = pyproj.CRS.from_authority(authority, code)
        known = True
    except CRSError:
        known = False
        try:
            crs = pyproj.CRS.from_wkt(text)
        except CRSError as error:
            raise UserError(f"the definition of SRID {srid} in spatial_ref_sys cannot be read: {error}") from error
    element = ET.Element("spatialrefsys")
    ET.SubElement(element, "wkt").text = crs.to_wkt("WKT2_2019")
    if known:
        # QGIS takes the authority's code only beside an internal number of its own, which it then looks up itself.
        ET.SubElement(element, "srsid").text = "1"
        ET.SubElement(element, "srid").text = str(srid)
        ET.SubElement(element, "authid").text = f"{authority}:{code}"
    ET.SubElement(element, "description").text = crs.name
    ET.SubElement(element, "geographicflag").text = "true" if crs.is_geographic else "false"
    return element


def no_crs() -> ET.Element:
    """Return the element ``spatialrefsys`` for data without a coordinate reference system, such as the unrolled plane."""
    return ET.Element("spatialrefsys")
