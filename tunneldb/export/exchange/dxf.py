"""A survey as a DXF drawing: the tunnel in its true place, and below it the unrolled lining and a sheet of profiles."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import psycopg
import shapely
from ezdxf import filemanagement
from ezdxf.enums import TextEntityAlignment as Align
from ezdxf.units import M
from shapely.geometry.base import BaseGeometry

from tunneldb import __version__
from tunneldb.export.exchange.entity import APPLICATION, Spot, draw_spot, write
from tunneldb.export.exchange.lines import (
    axis_line,
    edges,
    in_space,
    is_hundred,
    on_map,
    profiles,
    stretches,
    tick_chainages,
    ticks,
)  # fmt: skip
from tunneldb.export.exchange.sheet import Box, draw_profiles, draw_unrolled
from tunneldb.export.exchange.table import Table, read_table
from tunneldb.export.qgis.catalogue import looks_of
from tunneldb.finding_kind import DRY, REVIEW_COLOURS
from tunneldb.geometry.surface import Surface
from tunneldb.store.alignment import labels
from tunneldb.store.catalog import crs_text
from tunneldb.store.coverage import Coverage, read_coverage
from tunneldb.store.remarks import Remark, read_remarks
from tunneldb.store.survey import Survey

MARGIN = 50.0
"""Distance between the map, the unrolled lining and the profiles, m."""

TEXT = 1.0
"""Height of text on the map, m: 2 mm at 1:500."""

LETTERS, LINE = 120, 1.6
"""Maximum number of letters in a line of the text above the map; line spacing, relative to the text height."""

PARTS = 7
"""Steps of writing: map, leaks on it and in space, unrolled lining, profiles, sections in space, the file."""

MAX_TICKS_ALL_LABELLED = 20
"""Number of ticks below which all have a station label, not only those of whole hundreds."""

_BLACK, _RED, _GREEN, _CYAN, _BLUE, _MAGENTA, _GREY = 7, 1, 94, 4, 150, 6, 8

_PLACES = {
    "MAP": "beside the axis, on the map",
    "3D": "on the lining, in space",
    "UNROLLED": "in the unrolled lining",
}
"""Place where each finding is drawn: end of the layer's name, and its description."""

LAYERS = {
    "AXIS": (_RED, "Axis through the middle of the tunnel, 3D"),
    "AXIS_VERTEX": (_RED, "Vertices of the axis, 3D"),
    "CHAINAGE": (_BLACK, "Ticks every 10 m, stations every 100 m, on the map"),
    "LINING_MAP": (_GREY, "Edges of the lining unrolled beside the axis, on the map"),
    "SECTION_3D": (_CYAN, "Cross-sections in space"),
    **{
        f"{kind}_{place}": (colour, f"{text} {where}")
        for kind, colour, text in (
            ("LEAK", _BLUE, "Leaks"), ("JOINT", _GREEN, "Joints"), ("DARK", _MAGENTA, "Dry dark areas"),
        )
        for place, where in _PLACES.items()
    },
    "LEAK_TEXT": (_BLUE, "Number and area of leaks"),
    "LEAK_PROFILE": (_BLUE, "Leaks on the profiles"),
    "COVERAGE_GAP": (_MAGENTA, "Unrolled lining: where leaks could be missed, and why"),
    "REMARK": (_MAGENTA, "Above the map: notes and limitations of the results"),
    "UNROLLED": (_GREY, "Unrolled lining: edges and crown"),
    "UNROLLED_CHAINAGE": (_GREY, "Unrolled lining: lines every 10 m, with stations"),
    "PROFILE": (_BLACK, "Profiles, looking up-chainage"),
    "PROFILE_AXIS": (_RED, "Profiles: the axis, level and plumb"),
    "PROFILE_TEXT": (_BLACK, "Profiles: station, width and height, m"),
}  # fmt: skip
"""Colour (ACI) and description of each layer that always exists; layers of further kinds of findings are added as needed."""

_OTHER_KIND = _CYAN
"""Colour of kinds of findings without a colour of their own."""


def write_survey_dxf(
    conn: psycopg.Connection[Any],
    survey: Survey,
    surface: Surface,
    low: float,
    high: float,
    path: Path,
    progress: Callable[[float], None] = lambda count: None,
) -> dict[str, int]:
    """Write a stretch of a survey as a DXF drawing (2010, metres), and return the number of entities on each layer.

    The tunnel is in its SRID, lines in space at their height, flat ones at height 0. Below the map is the unrolled lining, arc
    upwards and chainage to the right, and below that the profiles side by side, as seen looking up-chainage. Rejected findings
    are not drawn. Stretches in which leaks could be missed are drawn on the unrolled lining. They are also listed, with notes
    and limitations of the results, above the map and in the properties ``Coverage`` and ``Remark 1``, ….

    Parameters
    ----------
    conn, survey
        Survey to draw.
    surface : Surface
        The survey's surface, for the whole stretch.
    low, high : float
        Chainage, m.
    path : Path
        File that isn't there yet.
    progress : callable
        Given 1 after each of the PARTS.
    """
    coverage = read_coverage(conn, survey, low, high)
    remarks = read_remarks(conn, survey, low, high)
    document = _document(conn, survey, coverage, remarks)
    space = document.modelspace()
    parts = stretches(surface, low, high)
    box = _draw_map(conn, survey, surface, parts, space)
    progress(1)
    for place, geometry in (("MAP", "map"), ("3D", "3d")):
        spots = read_spots(conn, survey, geometry, low, high)
        _add_kinds(conn, document, spots)
        for spot in spots:
            draw_spot(space, spot, place)
        progress(1)
    unrolled = read_spots(conn, survey, "unrolled", low, high)
    _add_kinds(conn, document, unrolled)
    sides = [side for side in (edges(surface, part) for part in parts) if len(side[0]) > 1]
    ticked = tick_chainages(surface, low, high)
    stations = list(zip(ticked.tolist(), labels(conn, survey, ticked), strict=True))
    gaps = [(gap.chainage_from, gap.chainage_to, f"{gap.state}: {gap.reason}") for gap in coverage.gaps]
    strip = draw_unrolled(space, (box[0], box[1] - MARGIN), sides, stations, unrolled, gaps)
    progress(1)
    found = profiles(surface, low, high)
    named = list(zip(found, labels(conn, survey, np.array([profile.chainage for profile in found])), strict=True))
    sheet = draw_profiles(space, (box[0], strip[1] - MARGIN), surface, named, unrolled)
    progress(1)
    for profile in found:
        space.add_polyline3d(in_space(surface, profile), close=True, dxfattribs={"layer": "SECTION_3D"})
    progress(1)
    for name, (west, south, east, north) in (("MAP", box), ("UNROLLED", strip), ("PROFILES", sheet)):
        document.views.new(
            name,
            dxfattribs={"center": ((west + east) / 2, (south + north) / 2), "width": east - west, "height": north - south},
        )
    head = _write_remarks(space, (box[0], box[3] + MARGIN / 2), [coverage.statement, *(remark.said for remark in remarks)])
    boxes = (box, strip, sheet, head)
    whole = min(b[0] for b in boxes), sheet[1], max(b[2] for b in boxes), head[3]
    document.set_modelspace_vport(whole[3] - whole[1], ((whole[0] + whole[2]) / 2, (whole[1] + whole[3]) / 2))
    document.header["$EXTMIN"], document.header["$EXTMAX"] = (*whole[:2], 0.0), (*whole[2:], 0.0)
    document.saveas(path)
    progress(1)
    counts = {layer.dxf.name: 0 for layer in document.layers if layer.description}  # not what each drawing has: 0, Defpoints
    for entity in space:
        counts[entity.dxf.layer] += 1
    return counts


def _write_remarks(space: Any, corner: tuple[float, float], said: Sequence[str | None]) -> Box:
    """Write the notes upwards from a corner, m, and return their box."""
    lines = [
        line
        for text in filter(None, said)
        for line in textwrap.wrap(text, LETTERS, initial_indent="– ", subsequent_indent="  ")
    ]
    if not lines:
        return *corner, corner[0], corner[1] - MARGIN / 2
    lines.insert(0, "Notes and limitations:")
    for n, line in enumerate(reversed(lines)):
        write(space, line, (corner[0], corner[1] + n * LINE * TEXT), TEXT, "REMARK")
    return *corner, corner[0] + TEXT * max(map(len, lines)), corner[1] + len(lines) * LINE * TEXT


_DRAWN = "NOT superseded AND review <> 'rejected' AND (detected OR review = 'confirmed')"


def read_spots(conn: psycopg.Connection[Any], survey: Survey, geometry: str, low: float, high: float) -> list[Spot]:
    """Read findings of all kinds that were found, drawn or confirmed and not rejected, in one of their geometries."""
    table = read_table(conn, survey, f"finding_{geometry}", low, high, _DRAWN)
    colours = {kind: f"#{bytes(map(int, look.colour.split(','))).hex()}" for kind, look in looks_of(conn).items()}
    shapes = shapely.from_wkb(table.geometry)
    return [_spot(row, shape, colours[row["kind"]]) for row, shape in zip(_rows(table), shapes, strict=True)]


def _rows(table: Table) -> Iterator[dict[str, Any]]:
    """Yield the rows of a table, None for a missing value."""
    names = [column.name for column in table.columns]
    columns = [
        [None if missing else value for value, missing in zip(column.values, column.missing, strict=True)]
        for column in table.columns
    ]
    for values in zip(*columns, strict=True):
        yield dict(zip(names, values, strict=True))


_FACTS = {
    "id": ("id", "{}"), "kind": ("kind", "{}"), "station": ("label", "{}"), "chainage_from": ("chainage_from", "{:.3f}"),
    "chainage_to": ("chainage_to", "{:.3f}"), "area_m2": ("area", "{:.3f}"), "confidence": ("confidence", "{:.2f}"),
    "review": ("review", "{}"), "reviewed_by": ("reviewed_by", "{}"), "severity": ("severity", "{}"),
    "severity_label": ("severity_label", "{}"), "length_m": ("length", "{:.3f}"), "width_mm": ("width_mm", "{:.2f}"),
    "easting": ("easting", "{:.3f}"), "northing": ("northing", "{:.3f}"), "height": ("height", "{:.3f}"),
    "remark": ("remark", "{}"),
}  # fmt: skip
"""Extended data of a finding: name, column and format."""

MAX_FACT = 250
"""Maximum number of bytes of a fact: a string of extended data has at most 255."""

MAX_FACTS = 16
"""Maximum number of facts of one text: the extended data of an entity have at most 16 kB."""


def _spot(row: dict[str, Any], shape: BaseGeometry, colour: str) -> Spot:
    texts = {
        name: " ".join(form.format(row[column]).split())  # a string is a line of the file
        for name, (column, form) in _FACTS.items()
        if row[column] is not None
    }
    facts = [fact for name, text in texts.items() for fact in facts_of(name, text)]
    facts.append(f"counted={'yes' if row['counted'] else 'no'}")
    size = f"{row['area']:.2f} m²" if row["length"] is None else f"{row['length']:.2f} m"
    width = "" if row["width_mm"] is None else f", {row['width_mm']:.2f} mm"
    named = "" if row["kind"] == "leak" else row["kind_label"]
    text = " ".join(f"{row['id']}: {named} {size if row['area'] or row['length'] else ''}{width}".split())
    if row["wet"]:
        colour = REVIEW_COLOURS[row["review"]]
    return Spot(int(row["id"]), row["kind"], bool(row["wet"]), colour, text, facts, shape)


def facts_of(name: str, text: str) -> Iterator[str]:
    """Yield a text as facts of at most MAX_FACT bytes: ``name=…``, continued in ``name_2=…``; an ellipsis ends a cut text."""
    for number in range(1, MAX_FACTS + 1):
        head = f"{name}=" if number == 1 else f"{name}_{number}="
        data, room = text.encode(), MAX_FACT - len(head)
        part = data[:room].decode(errors="ignore")
        text = text[len(part) :]
        if text and number == MAX_FACTS:
            part = data[: room - len("…".encode())].decode(errors="ignore") + "…"
        yield head + part
        if not text:
            return


def _document(conn: psycopg.Connection[Any], survey: Survey, coverage: Coverage, remarks: list[Remark]) -> Any:
    document = filemanagement.new("R2010", units=M)
    document.header["$MEASUREMENT"] = 1
    document.header["$LUNITS"], document.header["$LUPREC"] = 2, 3
    about = {"Survey": survey.name, "Tunnel": survey.tunnel, "Scanned": survey.date.isoformat(), "Unit": "metre"}
    if coverage.statement is not None:
        about["Coverage"] = coverage.statement
    about |= {f"Remark {n}": remark.said for n, remark in enumerate(remarks, 1)}
    for name, text in {**about, "CRS": crs_text(conn, survey.srid), "Writer": f"tunneldb {__version__}"}.items():
        document.header.custom_vars.append(name, " ".join(text.split()))  # a value is a line of the file; WKT may have many
    document.appids.new(APPLICATION)
    document.styles.new(APPLICATION, dxfattribs={"font": "arial.ttf"})
    for name, (colour, text) in LAYERS.items():
        document.layers.add(name, color=colour).description = text
    return document


def _add_kinds(conn: psycopg.Connection[Any], document: Any, spots: Sequence[Spot]) -> None:
    """Make layers for kinds of findings that occur and have none yet: the catalogue is the owner's, and grows."""
    named = dict(conn.execute("SELECT code, label FROM tunnel_api.finding_kind").fetchall())
    if any(not spot.wet and spot.kind not in DRY for spot in spots) and not document.layers.has_entry("FINDING_TEXT"):
        document.layers.add("FINDING_TEXT", color=_OTHER_KIND).description = "Number, kind and size of other findings"
    for kind in sorted({spot.kind for spot in spots}):
        for place, where in _PLACES.items():
            name = f"{kind.upper()}_{place}"
            if not document.layers.has_entry(name):
                document.layers.add(name, color=_OTHER_KIND).description = f"{named.get(kind) or kind} {where}"


def _draw_map(
    conn: psycopg.Connection[Any], survey: Survey, surface: Surface, parts: list[np.ndarray[Any, Any]], space: Any
) -> tuple[float, float, float, float]:
    """Draw axis, vertices, ticks and the edges of the strip, and return west, south, east and north of them, m."""
    corners = []
    for part in parts:
        line = axis_line(surface, part)
        space.add_polyline3d(line, dxfattribs={"layer": "AXIS"})
        corners.append(line[:, :2])
        for edge in edges(surface, part):
            if len(edge) > 1:
                beside = on_map(surface, edge)
                space.add_lwpolyline(beside, format="xy", dxfattribs={"layer": "LINING_MAP"})
                corners.append(beside)
    low, high = parts[0][0], parts[-1][-1]
    vertices = read_table(conn, survey, "axis_vertex", low, high)
    for point in shapely.get_coordinates(shapely.from_wkb(vertices.geometry), include_z=True):
        space.add_point(point, dxfattribs={"layer": "AXIS_VERTEX"})
    chainages = tick_chainages(surface, low, high)
    for (left, right), long, label in zip(
        ticks(surface, chainages)[:, :, :2], is_hundred(chainages), labels(conn, survey, chainages), strict=True
    ):
        space.add_line(left, right, dxfattribs={"layer": "CHAINAGE"})
        if long or len(chainages) < MAX_TICKS_ALL_LABELLED:
            away = right - left
            turned = away[0] < 0  # text that would stand on its head is written towards the tick instead
            align = Align.MIDDLE_RIGHT if turned else Align.MIDDLE_LEFT
            write(space, label.partition(".")[0], right, TEXT, "CHAINAGE", align, -away if turned else away)
    at = np.concatenate(corners)
    return (*at.min(axis=0).tolist(), *at.max(axis=0).tolist())
