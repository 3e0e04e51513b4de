"""3D view of a project: camera and content."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from copy import deepcopy
from dataclasses import dataclass

import psycopg
from psycopg import sql

from tunneldb.export.qgis.extent import Extent
from tunneldb.export.qgis.layer import SPACE, VectorLayer

DISTANCE = 60.0
"""Distance from the camera to its target, m: about 50 m of tunnel in a square picture."""

PITCH = 65.0
"""Angle between the camera's direction and the vertical, degrees."""

CAMERA_AZIMUTH = 50.0
"""Angle between the camera's direction and the axis', in plan, degrees."""

VIEW_SIZES = 1.2
"""Distance from the camera to the middle of a site, in diagonals of it."""


@dataclass(frozen=True)
class Viewpoint:
    """Camera of the 3D view.

    Attributes
    ----------
    x, y : float
        The place on the axis, tunnel's SRID, m.
    height : float
        The axis' height there, m.
    bearing : float
        Direction of the axis there, degrees from grid north, clockwise.
    distance : float
        From the camera, m.
    """

    x: float
    y: float
    height: float
    bearing: float
    distance: float = DISTANCE

    @property
    def yaw(self) -> float:
        """Rotation of the camera from grid north, anticlockwise as in QGIS; degrees."""
        return (CAMERA_AZIMUTH - self.bearing) % 360.0


def viewpoint(conn: psycopg.Connection, survey: str, chainage: float | None) -> Viewpoint:
    """Return the place of the axis at a chainage, or in its middle.

    Parameters
    ----------
    conn : psycopg.Connection
        The database.
    survey : str
        Name of a survey that has an axis.
    chainage : float, optional
        Target of the camera, m.
    """
    near = conn.execute(
        "SELECT chainage, ST_X(geom), ST_Y(geom), ST_Z(geom) FROM tunnel_api.axis_vertex WHERE survey = %s "
        "ORDER BY abs(chainage - coalesce(%s, (SELECT (min(chainage) + max(chainage)) / 2 FROM tunnel_api.axis_vertex "
        "WHERE survey = %s))), id LIMIT 2",
        (survey, chainage, survey),
    ).fetchall()
    (first, *start), (last, *end) = sorted((near[0], near[-1]))
    share = 0.0 if chainage is None or first == last else (chainage - first) / (last - first)
    x, y, z = (a + min(max(share, 0.0), 1.0) * (b - a) for a, b in zip(start, end, strict=True))
    return Viewpoint(x, y, z, math.degrees(math.atan2(end[0] - start[0], end[1] - start[1])))


def site_viewpoint(conn: psycopg.Connection, survey: str) -> Viewpoint:
    """Return the middle of a survey's faces, a distance from which all are visible, and the direction that most of them face.

    The camera looks against the normals of its planes, by area; CAMERA_AZIMUTH is taken off again.
    """
    row = conn.execute(
        "SELECT (ST_XMin(e) + ST_XMax(e)) / 2, (ST_YMin(e) + ST_YMax(e)) / 2, (ST_ZMin(e) + ST_ZMax(e)) / 2, "
        "sqrt((ST_XMax(e) - ST_XMin(e)) ^ 2 + (ST_YMax(e) - ST_YMin(e)) ^ 2 + (ST_ZMax(e) - ST_ZMin(e)) ^ 2), x, y "
        "FROM (SELECT ST_3DExtent(geom) AS e, coalesce(sum(area * axis[1]) FILTER (WHERE kind = 'flat'), 0) AS x, "
        "coalesce(sum(area * axis[2]) FILTER (WHERE kind = 'flat'), 0) AS y FROM tunnel_api.face WHERE survey = %s) f",
        (survey,),
    ).fetchone()
    assert row is not None
    x, y, z, size, east, north = row
    return Viewpoint(x, y, z, math.degrees(math.atan2(-east, -north)) + CAMERA_AZIMUTH, VIEW_SIZES * size)


def filled_layers(conn: psycopg.Connection, survey: str, layers: Sequence[VectorLayer]) -> set[str]:
    """Return the ids of those layers in space that have rows.

    A single layer that has a 3D style and no rows leaves the whole view blank in QGIS 3.22.
    """
    return {layer.id for layer in layers if SPACE in layer.themes and has_rows(conn, survey, layer)}


def has_rows(conn: psycopg.Connection, survey: str, layer: VectorLayer) -> bool:
    """Return True if a layer has rows of its geometry."""
    query = sql.SQL("SELECT EXISTS (SELECT FROM tunnel_api.{} WHERE survey = %s AND public.GeometryType({}) = upper(%s){})")
    condition = sql.SQL(f" AND {layer.where}" if layer.where else "")
    rows = query.format(sql.Identifier(layer.view), sql.Identifier(layer.column), condition)
    row = conn.execute(rows, (survey, layer.wkb.removesuffix("Z"))).fetchone()
    return row is not None and bool(row[0])


def scene(view: Viewpoint, extent: Extent, crs: ET.Element, layers: Sequence[str]) -> ET.Element:
    """Return the element ``qgis3d``: heights as they are, without terrain.

    Its height would shift all layers in QGIS 3.22, including those with absolute heights, and hide layers below it.

    Parameters
    ----------
    view : Viewpoint
        Origin; only in plan, because layers keep their heights.
    extent : Extent
        Extent of the scene, in the tunnel's SRID, m.
    crs : xml.etree.ElementTree.Element
        The tunnel's SRID, as :func:`tunneldb.export.qgis.crs.crs_element` returns it.
    layers : sequence of str
        Ids of the layers shown.
    """
    element = ET.Element("qgis3d")
    ET.SubElement(element, "origin", x=repr(view.x), y=repr(view.y), z="0")
    sides = {side: repr(getattr(extent, side.lower())) for side in ("xMin", "yMin", "xMax", "yMax")}
    ET.SubElement(element, "extent", sides, showIn2dView="0")
    ET.SubElement(
        element, "camera", {
            "field-of-view": "45", "projection-type": "1", "camera-navigation-mode": "terrain-based-navigation",
            "camera-movement-speed": "5",
        },
    )  # fmt: skip
    ET.SubElement(element, "color", background="255,255,255,255", selection="255,255,0,255")
    ET.SubElement(element, "crs").append(deepcopy(crs))
    ET.SubElement(element, "point-lights")
    ET.SubElement(
        ET.SubElement(element, "directional-lights"), "directional-light", x="-0.32", y="-0.91", z="-0.27", intensity="1",
        color="255,255,255,255",
    )  # fmt: skip
    terrain = ET.SubElement(
        element, "terrain", {
            "terrain-rendering-enabled": "0", "exaggeration": "1", "elevation-offset": "0", "map-theme": "",
            "show-labels": "0",
        },
    )  # fmt: skip
    shown = ET.SubElement(terrain, "layers")
    for layer in layers:
        ET.SubElement(shown, "layer", id=layer)
    generator = ET.SubElement(terrain, "generator", type="flat")
    ET.SubElement(generator, "extent", {side.lower(): value for side, value in sides.items()})
    return element


def docks(view: Viewpoint, scene: ET.Element) -> ET.Element:
    """Return the element ``mapViewDocks3D``: a view that QGIS 3.24 and later open when asked to, 3.22 with the project."""
    root = ET.Element("mapViewDocks3D")
    # area 2 is the right edge of the window
    dock = ET.SubElement(
        root, "view", name=SPACE, isOpen="0", isDocked="1", floating="0", area="2", x="0", y="0", width="700", height="500",
    )  # fmt: skip
    dock.append(scene)
    # Older versions read x, elev and y (southward) from the origin, later ones the place in the tunnel's SRID.
    ET.SubElement(
        dock, "camera", x="0", y="0", elev=repr(view.height), xMap=repr(view.x), yMap=repr(view.y), zMap=repr(view.height),
        dist=repr(view.distance), pitch=repr(PITCH), yaw=repr(view.yaw),
    )  # fmt: skip
    return root
