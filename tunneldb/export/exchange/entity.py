"""Building blocks of a drawing: text, and outlines with their attributes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from ezdxf.enums import TextEntityAlignment as Align
from shapely.geometry import Polygon

from tunneldb.export.exchange.lines import plain_ring

APPLICATION = "TUNNELDB"
"""Name of the extended data with the attributes of each leak, joint or dry dark area; also the name of the text style."""


@dataclass(frozen=True)
class Spot:
    """A leak, a joint or a dry dark area.

    Attributes
    ----------
    id, kind, review : int, str, str
        Attributes as in the database.
    text : str
        Label beside it.
    facts : list of str
        Extended data.
    shape : Polygon
        In the coordinates asked for.
    """

    id: int
    kind: str
    review: str
    text: str
    facts: list[str]
    shape: Polygon

    @property
    def rings(self) -> Iterator[np.ndarray[Any, Any]]:
        """Outline and holes."""
        for ring in (self.shape.exterior, *self.shape.interiors):
            yield shapely.get_coordinates(ring, include_z=self.shape.has_z)[:-1]


def write(
    space: Any, text: str, place: Any, height: float, layer: str, align: Align = Align.LEFT, along: Any = (1.0, 0.0)
) -> None:
    """Write text at a place, along a direction."""
    turned = float(np.degrees(np.arctan2(along[1], along[0])))
    attributes = {"layer": layer, "style": APPLICATION, "rotation": turned}
    space.add_text(text, height=height, dxfattribs=attributes).set_placement(tuple(place[:2]), align=align)


def draw_spot(space: Any, spot: Spot, place: str, shift: Any = 0.0) -> None:
    """Draw outline and holes of a spot on the layer of its kind for ``place`` (MAP, 3D or UNROLLED), shifted by (x, y), m."""
    attributes = {"layer": f"{spot.kind.upper()}_{place}"}
    for ring in spot.rings:
        line = (
            space.add_polyline3d(plain_ring(ring), close=True, dxfattribs=attributes)
            if place == "3D"
            else space.add_lwpolyline(ring + shift, format="xy", close=True, dxfattribs=attributes)
        )
        line.set_xdata(APPLICATION, [(1000, fact) for fact in spot.facts])
