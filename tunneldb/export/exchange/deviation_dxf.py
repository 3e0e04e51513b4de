"""Sections of a lining with the design behind, as a DXF drawing."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import psycopg
from ezdxf import filemanagement
from ezdxf.units import M

from tunneldb.export.exchange.entity import write
from tunneldb.numerals import percent_number
from tunneldb.shape.outline import Outline
from tunneldb.store.design import load_design
from tunneldb.store.survey import Survey

LAYERS = {
    "DESIGN": (3, "Design profile, lines and arcs, looking up-chainage"),
    "LINING": (7, "Lining as measured: means of cells along the profile"),
    "AXIS": (1, "Design axis, level and plumb"),
    "TEXT": (8, "Station, over- and underbreak"),
}
"""Colour (ACI) and description of each layer."""

ROW = 10
"""Number of sections in a row."""

_TEXT, _CROSS, _GAP = 0.25, 0.5, 3.0  # m


def write_sections(
    conn: psycopg.Connection[Any], survey: Survey, layer: str, low: float, high: float, every: float, path: Path
) -> int:
    """Write a section every so many metres of a stretch, side by side in rows, in metres; return how many.

    Lining that was not measured is not drawn.
    """
    design = load_design(conn, survey.tunnel_id, survey.tunnel, layer)
    rows = conn.execute(
        "SELECT DISTINCT ON (floor(chainage_from / %(every)s)) chainage_from, chainage_to, label, overbreak, underbreak,"
        " seen_share, profile, deviation FROM tunnel_api.deviation_section"
        " WHERE survey_id = %(survey)s AND layer = %(layer)s AND chainage_to > %(low)s AND chainage_from < %(high)s"
        " ORDER BY floor(chainage_from / %(every)s), chainage_from",
        {"every": every, "survey": survey.id, "layer": layer, "low": low, "high": high},
    ).fetchall()
    document = filemanagement.new("R2010", units=M)
    for name, (colour, said) in LAYERS.items():
        document.layers.add(name, color=colour).description = said
    space = document.modelspace()
    by_name = {stretch.name: stretch for stretch in design}
    sizes = [np.ptp(outline.flattened(0.01), axis=0) for one in design for outline in (one.first, one.second)]
    wide, tall = np.max(sizes, axis=0) + _GAP
    for number, (begin, end, label, over, under, seen, profile, values) in enumerate(rows):
        if profile not in by_name:
            continue
        outline = by_name[profile].at((begin + end) / 2.0)
        at = np.array([(number % ROW) * wide, -(number // ROW) * tall])
        _draw(space, outline, np.array(values, dtype=np.float64), at)
        said = f"{label}  over {over:.3f} m2, under {under:.3f} m2, seen {percent_number(seen, 0)} %"
        write(space, said, (at[0] - wide / 2.0 + _GAP / 2.0, at[1] + outline.elements[:, 1].min() - 2.0 * _TEXT), _TEXT, "TEXT")
    document.saveas(path)
    return len(rows)


def _draw(space: Any, outline: Outline, values: np.ndarray[Any, Any], at: np.ndarray[Any, Any]) -> None:
    vertices = [(*(element[:2] + at), element[4]) for element in outline.elements]
    vertices.append((*(outline.elements[-1, 2:4] + at), 0.0))
    space.add_lwpolyline(vertices, format="xyb", dxfattribs={"layer": "DESIGN"})
    for arm in ((_CROSS, 0.0), (0.0, _CROSS)):
        space.add_line(at - arm, at + arm, dxfattribs={"layer": "AXIS"})
    feet, inward = outline.places((np.arange(len(values)) + 0.5) / len(values))
    points = feet + values[:, None] * inward + at
    seen = np.isfinite(values)
    for part in np.split(np.arange(len(values)), np.flatnonzero(np.diff(seen)) + 1):
        if seen[part[0]] and len(part) > 1:
            space.add_lwpolyline(points[part], format="xy", dxfattribs={"layer": "LINING"})
