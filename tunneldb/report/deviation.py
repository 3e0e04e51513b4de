"""The chapter on the design: volumes, the image of deviation, over- and underbreak along the tunnel, the worst sections."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, LiteralString

import numpy as np
import psycopg
from PIL import Image
from psycopg.rows import dict_row

from tunneldb.arrays import Float, Single, UInt8
from tunneldb.export.images.preview import shrink
from tunneldb.export.tables.deviation import stretch_rows, volume
from tunneldb.raster.gap_fill import FILL, fill_gaps
from tunneldb.raster.geotiff import DEVIATION_KINDS
from tunneldb.raster.grid import BLOCK
from tunneldb.report.data import label_chainages
from tunneldb.report.drawing import line_path, step_for, ticks
from tunneldb.report.lining import QUALITY, Form, Picture, Window
from tunneldb.shape.profile import Stretch
from tunneldb.store.design import load_design
from tunneldb.store.images import load_block
from tunneldb.store.survey import Survey

STRIP, STRIPS = 250.0, 25
"""Length of a strip of the image, m, where there are no more than so many; else they are longer."""

PIXELS = 2500
"""Columns of a strip at most."""

WORST = 6
"""Sections that are drawn: those with the greatest area on either side of the design."""

ROWS = 40
"""Stretches in the table of volumes at most."""

WIDTH, HEIGHT = 1000.0, 90.0
"""Of the plot along the tunnel, above and below its base, in its own unit."""

SPANS = (0.02, 0.05, 0.1, 0.2, 0.5)
"""Deviation that has the full colour, m: the first that nine tenths of the cells stay within."""

_EXAGGERATED = 0.25  # of the design's size, how far the greatest deviation of a drawn section is to go at most
_LEVELS = np.array([-1.0, -0.4, 0.0, 0.4, 1.0])
_COLOURS = np.array([[33, 102, 172], [146, 197, 222], [230, 230, 230], [244, 165, 130], [178, 24, 43]])
_NOTHING = (255, 255, 255)


@dataclass(frozen=True)
class Plot:
    """Over- and underbreak along the tunnel, drawn: paths above and below the base, ticks of area and of chainage."""

    under: str
    over: str
    areas: list[tuple[float, str]]
    places: list[tuple[float, str]]


@dataclass(frozen=True)
class DrawnSection:
    """A section with the design behind: its figures, the paths of both, m, y downwards, and how much it is exaggerated."""

    row: dict[str, Any]
    design: str
    lining: str
    box: str
    exaggeration: int


@dataclass(frozen=True)
class DeviationStrip:
    """A stretch of the image of deviation, with its title."""

    title: str
    picture: Picture


@dataclass(frozen=True)
class LayerChapter:
    """What is stated of a layer.

    Attributes
    ----------
    layer : str
    whole : dict
        Columns of function ``deviation_volume``.
    stretches : list of dict
        Columns of function ``deviation_stretches``.
    step : float
        Length of these, m.
    stale : list of (int, str)
        Kilometres that are out of date, and why.
    span : float
        Deviation that has the full colour, m.
    strips : list of DeviationStrip
    plot : Plot
    worst : list of DrawnSection
    """

    layer: str
    whole: dict[str, Any]
    stretches: list[dict[str, Any]]
    step: float
    stale: list[tuple[int, str]]
    span: float
    strips: list[DeviationStrip]
    plot: Plot
    worst: list[DrawnSection]


def read_deviation(conn: psycopg.Connection[Any], survey: Survey, low: float, high: float, form: Form) -> list[LayerChapter]:
    """Read what is stated of a stretch against each layer's design, m; nothing where it was not held against one."""
    layers = conn.execute(
        "SELECT layer FROM tunnel.deviation_section WHERE survey_id = %s AND chainage_to > %s AND chainage_from < %s"
        " GROUP BY layer ORDER BY array_position(%s, layer)",
        [survey.id, low, high, list(DEVIATION_KINDS)],
    ).fetchall()
    return [_layer(conn, survey, layer, low, high, form) for (layer,) in layers]


def _layer(conn: psycopg.Connection[Any], survey: Survey, layer: str, low: float, high: float, form: Form) -> LayerChapter:
    whole = volume(conn, survey, layer, low, high, 0.0)
    assert whole is not None
    step = max(step_for(high - low, ROWS), 1.0)
    span = _span(conn, survey, layer, low, high)
    stale = conn.execute(
        "SELECT km, reason FROM tunnel_api.deviation_state(%s) WHERE layer = %s AND reason IS NOT NULL"
        " AND (km + 1) * 1000.0 > %s AND km * 1000.0 < %s ORDER BY km",
        [survey.id, layer, low, high],
    ).fetchall()
    return LayerChapter(
        layer, whole, stretch_rows(conn, survey, layer, low, high, step, 0.0), step, stale, span,
        list(_strips(conn, survey, layer, low, high, span, form)), _plot(conn, survey, layer, low, high),
        _worst(conn, survey, layer, low, high),
    )  # fmt: skip


def _span(conn: psycopg.Connection[Any], survey: Survey, layer: str, low: float, high: float) -> float:
    """Deviation that has the full colour, from a thousand sections or so."""
    row = conn.execute(
        "SELECT percentile_cont(0.9) WITHIN GROUP (ORDER BY abs(c.d)) FROM tunnel.deviation_section s,"
        " unnest(s.deviation) AS c (d) WHERE s.survey_id = %s AND s.layer = %s AND s.chainage_to > %s AND s.chainage_from < %s"
        " AND c.d <> 'NaN' AND floor(s.chainage_from)::int %% %s = 0",
        [survey.id, layer, low, high, max(int((high - low) / 1000.0), 1)],
    ).fetchone()
    usual = row[0] if row is not None and row[0] is not None else 0.0
    return next((span for span in SPANS if span >= usual - 1e-6), SPANS[-1])


def _strips(
    conn: psycopg.Connection[Any], survey: Survey, layer: str, low: float, high: float, span: float, form: Form
) -> Iterator[DeviationStrip]:
    kind = DEVIATION_KINDS[layer]
    length = STRIP * max(int(np.ceil((high - low) / STRIP / STRIPS)), 1)
    places: dict[int, int] = dict(
        conn.execute(
            "SELECT block, min(km) FROM tunnel.image WHERE survey_id = %s AND kind = %s AND (block + 1) * %s::float8 > %s"
            " AND block * %s::float8 < %s GROUP BY block",
            [survey.id, kind, BLOCK, low, BLOCK, high],
        ).fetchall()
    )
    for start in np.arange(np.floor(low / length) * length, high, length).tolist():
        west, east = max(start, low), min(start + length, high)
        blocks = {number: km for number, km in places.items() if (number + 1) * BLOCK > west and number * BLOCK < east}
        if not blocks:
            continue
        picture = _picture(conn, survey, kind, blocks, (west, east), length, span, form)
        begin, end = label_chainages(conn, survey, [west, east])
        yield DeviationStrip(f"{begin} – {end}", picture)


def _picture(
    conn: psycopg.Connection[Any],
    survey: Survey,
    kind: str,
    blocks: dict[int, int],
    ends: tuple[float, float],
    length: float,
    span: float,
    form: Form,
) -> Picture:
    """Draw the blocks (number and kilometre) of a strip, one in memory at a time."""
    parts: list[tuple[float, float, Single]] = []
    side = 0.0
    for number, km in sorted(blocks.items()):
        raster = load_block(conn, survey, km, kind, number)
        pixel = raster.transform.a
        factor = max(int(length / PIXELS / pixel), 1)
        while abs(BLOCK / (pixel * factor) - round(BLOCK / (pixel * factor))) > 1e-6:  # a block is a whole number of pixels
            factor -= 1
        if side and abs(pixel * factor - side) > 1e-9:
            continue  # a kilometre with pixels of another size
        side = pixel * factor
        parts.append((raster.transform.c, raster.transform.f, shrink(raster.values, factor)))
    north = max(f for _, f, _ in parts)
    south = min(f - len(values) * side for _, f, values in parts)
    west, east = ends
    values = np.full((round((north - south) / side), max(round((east - west) / side), 1)), np.nan, np.float32)
    for c, f, part in parts:
        row, column = round((north - f) / side), round((c - west) / side)
        first, last = max(column, 0), min(column + part.shape[1], values.shape[1])
        rows = values[row : row + len(part), first:last]
        rows[:] = part[: len(rows), first - column : last - column]
    values = fill_gaps(values, FILL / side)
    shown = np.flatnonzero(np.isfinite(values).any(axis=1))
    if len(shown):  # floor and what lies beyond the feet of the profile is left out
        values, north = values[shown[0] : shown[-1] + 1], north - float(shown[0]) * side
        south = north - len(values) * side
    out = io.BytesIO()
    Image.fromarray(colours(values, span)).save(out, form, quality=QUALITY[form])
    return Picture(Window(west, west + values.shape[1] * side, south, north), form, out.getvalue())


def colours(values: Single, span: float) -> UInt8:
    """Colours (rows, columns, 3) of deviations, m: blue outside the design, red inside, white where there is none."""
    share = np.clip(np.nan_to_num(values) / span, -1.0, 1.0)
    painted = np.stack([np.interp(share, _LEVELS, _COLOURS[:, k]) for k in range(3)], axis=-1)
    painted[np.isnan(values)] = _NOTHING
    return painted.astype(np.uint8)


def _plot(conn: psycopg.Connection[Any], survey: Survey, layer: str, low: float, high: float) -> Plot:
    """Draw the area of each metre, or the greatest of each pixel where metres are narrower than that."""
    rows = np.array(
        conn.execute(
            "SELECT chainage_from, underbreak, overbreak FROM tunnel.deviation_section WHERE survey_id = %s AND layer = %s"
            " AND chainage_to > %s AND chainage_from < %s ORDER BY chainage_from",
            [survey.id, layer, low, high],
        ).fetchall(),
        np.float64,
    )
    count = int(min(np.ceil(high - low), WIDTH))
    greatest = np.zeros((2, count))
    bins = np.clip(((rows[:, 0] - low) / (high - low) * count).astype(int), 0, count - 1)
    for k in (0, 1):
        np.maximum.at(greatest[k], bins, rows[:, 1 + k])
    top = max(float(greatest.max()), 0.01)
    x = np.repeat(np.linspace(0.0, WIDTH, count + 1), 2)

    def path(values: Float, way: float) -> str:
        y = HEIGHT * way * np.concatenate([[0.0], np.repeat(values / top, 2), [0.0]])
        return line_path(np.column_stack([x, y]), 1) + "Z"

    unit = step_for(1000.0 * top, 3) / 1000.0
    areas = [(-way * HEIGHT * area / top, f"{area:g}") for way in (1, -1) for area in ticks(0.0, top, unit) if area or way > 0]
    at = ticks(low, high, step_for(high - low, 8))
    places = [((place - low) / (high - low) * WIDTH, name) for place, name in _labelled(conn, survey, at)]
    return Plot(path(greatest[0], -1.0), path(greatest[1], 1.0), areas, places)


def _labelled(conn: psycopg.Connection[Any], survey: Survey, at: Sequence[float]) -> Iterator[tuple[float, str]]:
    return zip(at, label_chainages(conn, survey, list(at)) if at else [], strict=True)


def _worst(conn: psycopg.Connection[Any], survey: Survey, layer: str, low: float, high: float) -> list[DrawnSection]:
    """Draw the sections with the greatest areas, no two within 5 m of each other."""
    rows = _rows(
        conn,
        "SELECT chainage_from, chainage_to, label, profile, overbreak, underbreak, seen_share, deviation_least,"
        " deviation_greatest, deviation FROM tunnel_api.deviation_section WHERE survey_id = %s AND layer = %s"
        " AND chainage_to > %s AND chainage_from < %s AND seen_length > 0 ORDER BY overbreak + underbreak DESC LIMIT %s",
        [survey.id, layer, low, high, 20 * WORST],
    )
    by_name = {stretch.name: stretch for stretch in load_design(conn, survey.tunnel_id, survey.tunnel, layer)}
    chosen: list[dict[str, Any]] = []
    for row in rows:
        if row["profile"] in by_name and all(abs(row["chainage_from"] - one["chainage_from"]) > 5.0 for one in chosen):
            chosen.append(row)
    return [_drawn(row, by_name[row["profile"]]) for row in sorted(chosen[:WORST], key=lambda row: row["chainage_from"])]


def _drawn(row: dict[str, Any], stretch: Stretch) -> DrawnSection:
    """Draw a section: deviations enlarged by a round number, as far as they stay in the picture."""
    outline = stretch.at((row["chainage_from"] + row["chainage_to"]) / 2.0)
    values = np.array(row["deviation"], np.float64)
    held = np.isfinite(values)
    design = outline.flattened(0.005)
    size = float(np.ptp(design, axis=0).min())
    most = max(float(np.abs(values[held]).max()), 1e-3)
    times = next((times for times in (50, 20, 10, 5, 2) if times * most < _EXAGGERATED * size), 1)
    feet, inward = outline.places((np.arange(len(values)) + 0.5) / len(values))
    points = feet + times * values[:, None] * inward
    runs = [part for part in np.split(np.arange(len(values)), np.flatnonzero(np.diff(held)) + 1) if held[part[0]]]
    both = np.vstack([design, points[held]]) * [1.0, -1.0]
    (west, top), (east, bottom) = both.min(axis=0) - 0.2, both.max(axis=0) + 0.2
    return DrawnSection(
        row,
        line_path(design * [1.0, -1.0]),
        "".join(line_path(points[part] * [1.0, -1.0]) for part in runs if len(part) > 1),
        f"{west:.2f} {top:.2f} {east - west:.2f} {bottom - top:.2f}",
        times,
    )


def _rows(conn: psycopg.Connection[Any], query: LiteralString, values: list[Any]) -> list[dict[str, Any]]:
    with conn.cursor(row_factory=dict_row) as cursor:
        return cursor.execute(query, values).fetchall()
