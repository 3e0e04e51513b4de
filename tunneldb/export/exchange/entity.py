"""Building blocks of a drawing: text, and outlines with their attributes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from ezdxf.colors import rgb2int
from ezdxf.enums import TextEntityAlignment as Align
from shapely.geometry.base import BaseGeometry

from tunneldb.export.exchange.lines import plain_ring
from tunneldb.finding_kind import rgb

APPLICATION = "TUNNELDB"
"""Name of the extended data with the attributes of each finding; also the name of the text style."""

POINT_RADIUS = 0.1
"""Radius of the circle of a finding that is a point, m."""


@dataclass(frozen=True)
class Spot:
    """A finding as it is drawn.

    Attributes
    ----------
    id, kind, wet : int, str, bool
        Attributes as in the database.
    colour : str
        Colour, such as ``#e67e00``.
    text : str
        Label beside it.
    facts : list of str
        Extended data.
    shape : Polygon, LineString or Point
        In the coordinates asked for.
    """

    id: int
    kind: str
    wet: bool
    colour: str
    text: str
    facts: list[str]
    shape: BaseGeometry

    @property
    def lines(self) -> Iterator[tuple[np.ndarray[Any, Any], bool]]:
        """Outline and holes of a polygon, or a line; True for closed ones."""
        if self.shape.geom_type == "LineString":
            yield shapely.get_coordinates(self.shape, include_z=self.shape.has_z), False
        elif self.shape.geom_type == "Polygon":
            for ring in (self.shape.exterior, *self.shape.interiors):
                yield shapely.get_coordinates(ring, include_z=self.shape.has_z)[:-1], True


def write(
    space: Any, text: str, place: Any, height: float, layer: str, align: Align = Align.LEFT, along: Any = (1.0, 0.0)
) -> None:
    """Write text at a place, along a direction."""
    turned = float(np.degrees(np.arctan2(along[1], along[0])))
    attributes = {"layer": layer, "style": APPLICATION, "rotation": turned}
    space.add_text(text, height=height, dxfattribs=attributes).set_placement(tuple(place[:2]), align=align)


def draw_spot(space: Any, spot: Spot, place: str, shift: Any = 0.0) -> None:
    """Draw a spot on the layer of its kind for ``place`` (MAP, 3D or UNROLLED), shifted by (x, y), m; a point as a circle."""
    attributes = {"layer": f"{spot.kind.upper()}_{place}", "true_color": rgb2int(rgb(spot.colour))}
    drawn = []
    for line, closed in spot.lines:
        if place == "3D":
            drawn.append(space.add_polyline3d(plain_ring(line) if closed else line, close=closed, dxfattribs=attributes))
        else:
            drawn.append(space.add_lwpolyline(line + shift, format="xy", close=closed, dxfattribs=attributes))
    if spot.shape.geom_type == "Point":
        at = shapely.get_coordinates(spot.shape, include_z=spot.shape.has_z)[0]
        drawn.append(space.add_circle(at if place == "3D" else at + shift, POINT_RADIUS, dxfattribs=attributes))
    for entity in drawn:
        entity.set_xdata(APPLICATION, [(1000, fact) for fact in spot.facts])
