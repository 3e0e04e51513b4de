"""Sections of a track with the outline that is to be clear and the points of that metre, as a DXF drawing."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import psycopg
from ezdxf import filemanagement
from ezdxf.units import M

from tunneldb.export.exchange.entity import write
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.measures.clearance.compute.track import metre_places
from tunneldb.measures.clearance.rows import load_classed
from tunneldb.numerals import percent_number
from tunneldb.store.surface import load_alignment
from tunneldb.store.survey import Survey

LAYERS = {
    "OUTLINE": (3, "Outline that is to be clear, widened, in the track's frame, looking up-chainage"),
    "POINTS": (8, "Points of that metre, of any class"),
    "NEAREST": (1, "Point with the least margin"),
    "TRACK": (5, "Middle of the track on its running surface"),
    "TEXT": (7, "Station, least margin, what causes it, share seen"),
}
"""Colour (ACI) and description of each layer."""

ROW = 10
"""Number of sections in a row."""

_TEXT, _CROSS, _GAP, _FAR = 0.25, 0.5, 3.0, 8.0  # m


def write_clearance(
    conn: psycopg.Connection[Any], survey: Survey, gauge: str, track: str, low: float, high: float, every: float, path: Path
) -> int:
    """Write the tightest section of every so many metres of a stretch, side by side in rows; return how many."""
    rows = conn.execute(
        "SELECT DISTINCT ON (floor(chainage_from / %(every)s)) km, chainage_from, label, margin, class, seen_share,"
        " track_right, track_up, cant, outline,"
        " public.ST_X(geom), public.ST_Y(geom), public.ST_Z(geom) FROM tunnel_api.clearance_section"
        " WHERE survey_id = %(survey)s AND gauge = %(gauge)s AND track = %(track)s AND chainage_to > %(low)s"
        " AND chainage_from < %(high)s ORDER BY floor(chainage_from / %(every)s), margin NULLS LAST",
        {"every": every, "survey": survey.id, "gauge": gauge, "track": track, "low": low, "high": high},
    ).fetchall()
    axis = load_alignment(conn, survey, 1.0)
    document = filemanagement.new("R2010", units=M)
    for name, (colour, said) in LAYERS.items():
        document.layers.add(name, color=colour).description = said
    space = document.modelspace()
    for number, (km, begin, label, margin, klass, seen, right, up, cant, outline, *nearest) in enumerate(rows):
        at = np.array([(number % ROW) * (2.0 * _FAR + _GAP), -(number // ROW) * (2.0 * _FAR + _GAP)])
        frame = (begin, right, up, cant)
        vertices = np.reshape(outline, (-1, 3))
        flat = [(*(vertex[:2] + at), vertex[2]) for vertex in vertices]
        space.add_lwpolyline(flat, format="xyb", dxfattribs={"layer": "OUTLINE"})
        xyz, _ = load_classed(conn, survey, km, max(begin - 1.0, (km - 1) * KILOMETRE), begin + 2.0)
        places, _ = metre_places(axis.across(xyz), *frame)
        for point in places[np.abs(places).max(axis=1) < _FAR] + at:
            space.add_point(point, dxfattribs={"layer": "POINTS"})
        if nearest[0] is not None:
            for point in metre_places(axis.across(np.array([nearest])), *frame)[0] + at:
                space.add_circle(point, 0.1, dxfattribs={"layer": "NEAREST"})
        for arm in ((_CROSS, 0.0), (0.0, _CROSS)):
            space.add_line(at - arm, at + arm, dxfattribs={"layer": "TRACK"})
        found = "nothing seen" if margin is None else f"{margin:.3f} m, {klass}"
        said = f"{label}  {found}, seen {percent_number(seen, 0)} %"
        write(space, said, (at[0] - 3.0, at[1] - 2.0), _TEXT, "TEXT")
    document.saveas(path)
    return len(rows)
