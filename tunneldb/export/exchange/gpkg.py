"""A survey as a GeoPackage: the layers of the QGIS project with their styles, chainage ticks and the lining laid flat."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import psycopg
import pyogrio.raw
import shapely

from tunneldb import __version__
from tunneldb.export.exchange.lines import edges, is_hundred, on_map, outline, stretches, tick_chainages, ticks
from tunneldb.export.exchange.table import Column, Table, read_table
from tunneldb.export.qgis.catalogue import read_catalogue
from tunneldb.export.qgis.finding_style import finding_style_text
from tunneldb.export.qgis.layer import LAYERS, SPACE, VectorLayer, only
from tunneldb.export.qgis.styles import STYLE_NAME, style_text
from tunneldb.export.tables.geopackage import UNDEFINED_CARTESIAN, write_remarks
from tunneldb.finding_kind import DRY
from tunneldb.geometry.local import LOCAL
from tunneldb.geometry.surface import Surface
from tunneldb.store.alignment import labels
from tunneldb.store.catalog import crs_text
from tunneldb.store.coverage import read_coverage
from tunneldb.store.remarks import read_remarks
from tunneldb.store.surface import survey_ends
from tunneldb.store.survey import Survey

VERSION = {"VERSION": "1.2"}
"""Version of the GeoPackage, which QGIS and other programs of some years ago read without a warning."""

_TICK = "Chainage: a tick across the axis every 10 m, longer every 100 m"
_GRID = "Chainage in the unrolled plane: a line across the lining every 10 m"
_LINING = "Lining of each segment, unrolled and laid on the map beside the axis"
_FLAT = "Lining of each segment in the unrolled plane (chainage, arc)"

_DRAWN = (
    ("chainage", "LineStringZ", "chainage", True, _TICK),
    ("chainage_unrolled", "LineString", "chainage", False, _GRID),
    ("lining_map", "Polygon", "lining", True, _LINING),
    ("lining_unrolled", "Polygon", "lining", False, _FLAT),
)
"""Layers drawn from the surface: name, geometry, style, whether on the map, description."""


def layers() -> list[VectorLayer]:
    """Return the layers of the QGIS project that have rows of their own; only the first of those on the same view."""
    seen: dict[str, VectorLayer] = {}
    for layer in LAYERS:
        if layer.on_sheet:  # findings and leaks once more
            continue
        if layer.shows_findings:
            layer = replace(layer, where=f"{_DRY} AND NOT ({_DARK}) AND {only(layer.wkb.removesuffix('Z'))}")
        elif layer.style == "dark":
            layer = replace(layer, where=f"{_DRY} AND {_DARK}")
        seen.setdefault(layer.id if layer.view.startswith("finding_") else layer.view, layer)
    return list(seen.values())


_DRY = 'NOT "wet" AND NOT "superseded"'
_DARK = f'"kind" IN ({", ".join(map(repr, map(str, DRY)))}) AND {only("Polygon")}'
"""Conditions by which findings are divided, each in one layer: leaks have their own, and joints and dry dark areas."""


def parts() -> int:
    """Return the number of layers of a survey."""
    return len(layers()) + len(_DRAWN)


def write_survey_gpkg(
    conn: psycopg.Connection[Any],
    survey: Survey,
    surface: Surface,
    low: float,
    high: float,
    path: Path,
    progress: Callable[[float], None] = lambda count: None,
) -> dict[str, int]:
    """Write a stretch of a survey as a GeoPackage, and return the number of rows of each layer.

    Layers on the map and in space are in the tunnel's SRID; those of the unrolled plane (chainage, arc; m), and of local
    coordinates, in an undefined Cartesian system. QGIS finds the styles in the table ``layer_styles``. Notes and
    limitations of the results are in the table ``remark``.

    Parameters
    ----------
    conn, survey
        Survey to export.
    surface : Surface
        The survey's surface, for the whole stretch.
    low, high : float
        Chainage, m. Objects that reach into the stretch are written whole, only the axis is cut; leaks and dry dark areas must
        reach into the survey's part of it.
    path : Path
        File that isn't there yet.
    progress : callable
        Given 1 after each layer.

    Raises
    ------
    UserError
        The tunnel's coordinate system isn't known.
    """
    crs = None if survey.srid == LOCAL else crs_text(conn, survey.srid)
    ends = survey_ends(conn, survey) or (low, high)
    inside = max(low, ends[0]), min(high, ends[1])
    coverage = read_coverage(conn, survey, low, high)
    catalogue = read_catalogue(conn, survey)
    counts: dict[str, int] = {}
    styled: list[tuple[str, str, str]] = []
    for layer in layers():
        spots = layer.view.startswith(("leak", "finding"))
        table = read_table(conn, survey, layer.view, *(inside if spots else (low, high)), layer.where)
        if layer.view == "coverage_gap":
            table = replace(table, description=coverage.statement or table.description)
        if spots and coverage.statement is not None:
            table = replace(table, description=f"{coverage.statement}. {table.description}")
        if layer.view == "axis":
            table = _cut_axis(conn, survey, table, low, high)
        _write(path, layer.id, table, layer.wkb, crs if layer.on_map else None)
        counts[layer.id] = len(table.geometry)
        own = finding_style_text(catalogue, layer.geometry, in_space=layer.group == SPACE) if layer.shows_findings else None
        styled.append((layer.id, own or style_text(layer.style), layer.title))
        progress(1)
    made = _drawn(conn, survey, surface, low, high)
    for (name, wkb, style, with_crs, text), table in zip(_DRAWN, made, strict=True):
        _write(path, name, replace(table, description=text), wkb, crs if with_crs else None)
        counts[name] = len(table.geometry)
        styled.append((name, style_text(style), text))
        progress(1)
    remarks = read_remarks(conn, survey, low, high)
    write_remarks(path, remarks, **VERSION)
    _write_styles(path, styled)
    return counts | {"remark": len(remarks)}


def _write(path: Path, name: str, table: Table, wkb: str, crs: str | None) -> None:
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "'crs' was not provided")  # the unrolled plane has none, nor have local coordinates
        pyogrio.raw.write(
            str(path),
            table.geometry,
            [column.values for column in table.columns],
            np.array([column.name for column in table.columns]),
            field_mask=[column.missing if column.missing.any() else None for column in table.columns],
            geometry_type=wkb.replace("Z", " Z"),
            crs=crs,
            driver="GPKG",
            layer=name,
            DESCRIPTION=table.description,
            **({} if crs else UNDEFINED_CARTESIAN),
            **VERSION,
        )


def _write_styles(path: Path, styled: list[tuple[str, str, str]]) -> None:
    """Fill the table in which QGIS looks for the style of a layer, in the form that QGIS uses."""
    count = len(styled)
    table: dict[str, list[Any]] = {
        "f_table_catalog": [""] * count,
        "f_table_schema": [""] * count,
        "f_table_name": [name for name, _, _ in styled],
        "f_geometry_column": ["geom"] * count,
        "styleName": [STYLE_NAME] * count,
        "styleQML": [style for _, style, _ in styled],
        "styleSLD": [""] * count,
        "useAsDefault": [True] * count,
        "description": [title for _, _, title in styled],
        "owner": [f"tunneldb {__version__}"] * count,
        "ui": [""] * count,
        "update_time": [np.datetime64("now", "ms")] * count,
    }
    data = [np.array(values, dtype=object if isinstance(values[0], str) else None) for values in table.values()]
    pyogrio.raw.write(str(path), None, data, np.array(list(table)), geometry_type=None, driver="GPKG", layer="layer_styles")


def _cut_axis(conn: psycopg.Connection[Any], survey: Survey, table: Table, low: float, high: float) -> Table:
    """Return the axis between two chainages (m) as one row."""
    rows = conn.execute(
        "SELECT chainage, public.ST_X(geom), public.ST_Y(geom), public.ST_Z(geom) FROM tunnel_api.axis_vertex"
        " WHERE survey_id = %s ORDER BY chainage",
        [survey.id],
    ).fetchall()
    if len(rows) < 2 or not len(table.geometry):
        return table
    vertex = np.array(rows)
    start, end = max(low, vertex[0, 0]), min(high, vertex[-1, 0])
    at = np.unique(np.concatenate([[start, end], vertex[(vertex[:, 0] > start) & (vertex[:, 0] < end), 0]]))
    line = shapely.LineString(np.column_stack([np.interp(at, vertex[:, 0], vertex[:, k]) for k in (1, 2, 3)]))
    ends = dict(zip(("label_from", "label_to"), labels(conn, survey, np.array([start, end])), strict=True))
    told: dict[str, Any] = {"chainage_from": start, "chainage_to": end, **ends}
    columns = [
        replace(column, values=np.array([told[column.name]], dtype=column.values.dtype)) if column.name in told else column
        for column in table.columns
    ]
    return replace(table, columns=columns, geometry=np.array([shapely.to_wkb(line, flavor="iso")], dtype=object))


def _drawn(conn: psycopg.Connection[Any], survey: Survey, surface: Surface, low: float, high: float) -> Iterator[Table]:
    """Return ticks and grid lines of chainage, then the lining on the map and in the unrolled plane."""
    chainages = tick_chainages(surface, low, high)
    named = _columns(
        chainage=chainages, label=np.array(labels(conn, survey, chainages), dtype=object), hundred=is_hundred(chainages)
    )
    yield _table(named, [shapely.LineString(line) for line in ticks(surface, chainages)])
    left, right = edges(surface, chainages)
    there = np.isin(chainages, left[:, 0])
    grid = [Column(column.name, column.values[there], column.missing[there]) for column in named]
    yield _table(grid, [shapely.LineString(line) for line in np.stack([left, right], axis=1)])

    number, flat = [], []
    for n, (first, second) in zip(surface.number.tolist(), surface.ends, strict=True):
        for part in stretches(surface, max(low, first), min(high, second)):
            shape = outline(surface, part)
            if shape is not None:
                number.append(n)
                flat.append(shape)
    ends = np.array([shape.bounds for shape in flat]).reshape(-1, 4)
    segments = _columns(
        n=np.array(number, dtype=np.int64), chainage_from=ends[:, 0], chainage_to=ends[:, 2],
        label_from=np.array(labels(conn, survey, ends[:, 0]), dtype=object),
        label_to=np.array(labels(conn, survey, ends[:, 2]), dtype=object),
    )  # fmt: skip
    yield _table(segments, [shapely.transform(shape, lambda at: on_map(surface, at)) for shape in flat])
    yield _table(segments, flat)


def _columns(**values: np.ndarray[Any, Any]) -> list[Column]:
    return [Column(name, held, np.zeros(len(held), dtype=bool)) for name, held in values.items()]


def _table(columns: list[Column], shapes: list[Any]) -> Table:
    return Table(columns, np.array(shapely.to_wkb(shapes, flavor="iso"), dtype=object).reshape(-1), "")
