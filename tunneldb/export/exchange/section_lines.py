"""Design profiles and gauges in the plane of a section."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import psycopg

from tunneldb.arrays import Float
from tunneldb.measures.clearance.compute.track import metre_track
from tunneldb.shape.outline import Outline
from tunneldb.shape.profile import stretches
from tunneldb.store.design import load_profiles, outline_of
from tunneldb.store.desk.sections import Frame
from tunneldb.store.surface import alignment_of

CHORD_ERROR = 0.001
"""Maximum deviation of the drawn chords from arcs, m."""

_STATIONS = 1.0  # m between stations of the given axis


@dataclass(frozen=True)
class SectionLine:
    """A line of a section.

    Attributes
    ----------
    kind : str
        design or gauge.
    name : str
        Layer and name of a design profile; name of a gauge, and its track.
    places : (n, 2) float array
        Right and up of the measured axis, m.
    """

    kind: str
    name: str
    places: Float


def section_lines(conn: psycopg.Connection[Any], tunnel_id: int, survey_id: int, frame: Frame) -> list[SectionLine]:
    """Return the design profiles of all layers, and the gauges of all tracks, at a section.

    Both refer to the given axis. A survey whose clearance was not measured has no gauge: its track is not known.
    """
    axis = alignment_of(conn, tunnel_id, _STATIONS)
    assert axis is not None
    chainage = float(axis.chainage(frame.centre[None])[0])
    if not np.isfinite(chainage):
        return []

    def line(kind: str, name: str, about_axis: Float) -> SectionLine:
        places = np.column_stack([np.full(len(about_axis), chainage), about_axis])
        return SectionLine(kind, name, frame.places(axis.in_space(places)))

    designs = [line("design", name, outline.flattened(CHORD_ERROR)) for name, outline in _designs(conn, tunnel_id, chainage)]
    gauges = [line("gauge", name, places) for name, places in _gauges(conn, survey_id, chainage)]
    return designs + gauges


def _designs(conn: psycopg.Connection[Any], tunnel_id: int, chainage: float) -> list[tuple[str, Outline]]:
    """Return the outlines of the design at a chainage of the given axis."""
    rows = conn.execute(
        "SELECT DISTINCT p.layer FROM tunnel_api.design_profile p WHERE p.tunnel_id = %s ORDER BY 1", [tunnel_id]
    )
    return [
        (f"{layer}: {stretch.name}", stretch.at(chainage))
        for (layer,) in rows.fetchall()
        for stretch in stretches(load_profiles(conn, tunnel_id, layer))
        if stretch.low <= chainage < stretch.high
    ]


def _gauges(conn: psycopg.Connection[Any], survey_id: int, chainage: float) -> list[tuple[str, Float]]:
    """Return the gauges at a chainage, widened as they were measured, about the given axis."""
    rows = conn.execute(
        "SELECT c.gauge, c.track, c.chainage_from, c.track_right, c.track_up, c.cant, c.outline"
        " FROM tunnel_api.clearance_section c WHERE c.survey_id = %s AND c.chainage_from <= %s AND c.chainage_to > %s"
        " ORDER BY c.gauge, c.track",
        [survey_id, chainage, chainage],
    ).fetchall()
    found = []
    for gauge, track, begin, right, up, cant, outline in rows:
        flat = outline_of(outline).flattened(CHORD_ERROR)
        placed = metre_track(begin, right, up, cant).about_axis(np.full(len(flat), chainage), *flat.T)
        found.append((f"{gauge}, track {track}", placed))
    return found
