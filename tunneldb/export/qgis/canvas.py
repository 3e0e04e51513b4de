"""Canvases of a project, their extents, and bookmarks."""

from __future__ import annotations

import uuid
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from copy import deepcopy

import psycopg

from tunneldb.export.qgis.extent import Extent, View, first_window, map_extent, unrolled_extents
from tunneldb.export.qgis.layer import FACES, MAP, UNROLLED
from tunneldb.store.survey import Survey


def project_views(conn: psycopg.Connection, survey: Survey, cells: Extent | None) -> list[View]:
    """Return bookmarks: the whole map first, then a window on the unrolled lining, each of its kilometres, unrolled faces."""
    views = [View("Map", MAP, map_extent(conn, survey))]
    kilometres = unrolled_extents(conn, survey.name)
    if kilometres:
        views.append(View("Unrolled", UNROLLED, first_window(conn, survey.name, kilometres)))
        views += [View(f"Unrolled, km {km}", UNROLLED, extent.grown()) for km, extent in kilometres]
    if cells is not None:
        views.append(View(FACES, FACES, cells.grown()))
    return views


def add_canvases(root: ET.Element, views: Sequence[View], crs: ET.Element) -> None:
    """Add the main canvas with the map, and below it a second one that follows theme Unrolled, or Faces for a site."""
    _canvas(root, "theMapCanvas", views[0], crs)
    docks = ET.SubElement(root, "mapViewDocks")
    if len(views) > 1:
        # Its layers have no reference system and are drawn as they are; the tunnel's gives the canvas its unit, the metre.
        _canvas(root, views[1].theme, views[1], crs).set("theme", views[1].theme)
        # area 8 is the bottom edge of the window
        ET.SubElement(
            docks, "view", name=views[1].theme, area="8", floating="0", x="0", y="0", width="1200", height="360",
            synced="0", showCursor="0", showExtent="0", scaleSynced="0", scaleFactor="1", showLabels="1",
            zoomSelected="0",
        )  # fmt: skip


def _canvas(root: ET.Element, name: str, view: View, crs: ET.Element) -> ET.Element:
    canvas = ET.SubElement(root, "mapcanvas", name=name, annotationsVisible="1")
    ET.SubElement(canvas, "units").text = "meters"
    add_extent(canvas, view.extent, "extent")
    ET.SubElement(canvas, "rotation").text = "0"
    ET.SubElement(canvas, "destinationsrs").append(deepcopy(crs))
    ET.SubElement(canvas, "rendermaptile").text = "0"
    return canvas


def add_extent(parent: ET.Element, extent: Extent, tag: str) -> ET.Element:
    """Add an extent: in elements of its own where the tag is ``extent``, else in attributes."""
    element = ET.SubElement(parent, tag)
    sides = {side: repr(getattr(extent, side)) for side in ("xmin", "ymin", "xmax", "ymax")}
    if tag == "extent":
        for side, value in sides.items():
            ET.SubElement(element, side).text = value
    else:
        element.attrib.update(sides)
    return element


def bookmarks_element(views: Sequence[View], crs: ET.Element) -> ET.Element:
    """Return a bookmark for each view; its id follows from the name."""
    bookmarks = ET.Element("Bookmarks")
    for view in views:
        bookmark = ET.SubElement(
            bookmarks, "Bookmark", id=f"{{{uuid.uuid5(uuid.NAMESPACE_OID, view.name)}}}", name=view.name,
            group=view.theme, extent=view.extent.wkt(),
        )  # fmt: skip
        bookmark.append(deepcopy(crs))
    return bookmarks
