"""One cross-section as a DXF drawing."""

from __future__ import annotations

import io
from collections.abc import Sequence

from ezdxf import filemanagement
from ezdxf.document import Drawing
from ezdxf.units import M

from tunneldb.classification.classes import PointClass
from tunneldb.export.exchange.entity import APPLICATION, write
from tunneldb.export.exchange.section_lines import SectionLine
from tunneldb.store.desk.sections import Section

LAYERS = {
    "SECTION": (7, "Measured section, smooth curve, looking up-chainage"),
    "DESIGN": (3, "Design profiles"),
    "GAUGE": (6, "Gauges, as widened when the clearance was measured"),
    "AXIS": (1, "Measured axis"),
    "TEXT": (8, "Survey and station"),
}
"""Colour (ACI) and description of each layer; points have a layer for each class."""

_TEXT, _CROSS = 0.25, 0.5  # m


def section_dxf(title: str, section: Section, lines: Sequence[SectionLine]) -> str:
    """Return a section with its points as a drawing in metres; the origin is the measured axis."""
    document = filemanagement.new("R2010", units=M)
    document.styles.new(APPLICATION, dxfattribs={"font": "arial.ttf"})
    for name, (colour, said) in LAYERS.items():
        document.layers.add(name, color=colour).description = said
    space = document.modelspace()
    space.add_lwpolyline(section.curve, format="xy", dxfattribs={"layer": "SECTION"})
    for line in lines:
        space.add_lwpolyline(line.places, format="xy", dxfattribs={"layer": line.kind.upper()})
    for place, code in zip(section.points, section.classes.tolist(), strict=True):
        space.add_point(place, dxfattribs={"layer": _layer(document, code)})
    for arm in ((_CROSS, 0.0), (0.0, _CROSS)):
        space.add_line((-arm[0], -arm[1]), arm, dxfattribs={"layer": "AXIS"})
    write(space, title, (section.curve[:, 0].min(), section.curve[:, 1].min() - 3.0 * _TEXT), _TEXT, "TEXT")
    text = io.StringIO()
    document.write(text)
    return text.getvalue()


def _layer(document: Drawing, code: int) -> str:
    """Return the layer of a class of points, made on first use."""
    known = {int(member): member.name for member in PointClass}
    name = f"POINTS_{known.get(code, code)}"
    if name not in document.layers:
        document.layers.add(name, color=8).description = f"Points of class {code}"
    return name
