"""Findings in layers of GeoPackage and GeoJSON, and lines of drawings, as rows to import."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import psycopg
import pyogrio
import pyogrio.raw
import shapely
from pyogrio.errors import DataLayerError, DataSourceError
from pyproj import CRS
from shapely.geometry.base import BaseGeometry

from tunneldb.errors import InputError, UserError
from tunneldb.files import gdal_fault, vector_source
from tunneldb.geometry.crs import fits_srid, is_local, srid_name
from tunneldb.pipeline.drawn_lines import read_drawn_lines
from tunneldb.store.imported_images import section_extent
from tunneldb.store.survey import Survey

COLUMNS = ("kind", "severity", "width_mm", "review", "remark", "photo")
"""Columns read from each row besides its place; all except the kind are optional."""

TABLES, LAYERED, DRAWINGS = (".csv", ".txt"), (".gpkg", ".geojson", ".json"), (".dxf",)
"""Extensions of imported files: tables, layers, and drawings."""


@dataclass(frozen=True)
class Row:
    """A row of a file.

    Attributes
    ----------
    number : int
        Its number: of a CSV the line, else the feature, from 1.
    values : mapping of str to str
        Its values, by our names; empty ones are left out.
    shape : geometry or None
        Its place.
    view : {'unrolled', '3d'}
        In which coordinates.
    wrong : str
        Why it has no shape, if it is known.
    """

    number: int
    values: Mapping[str, str]
    shape: BaseGeometry | None
    view: str
    wrong: str = ""


def read_drawing(
    path: Path, columns: Mapping[str, str], layer: str | None, needed: Sequence[str], notes: list[str]
) -> Iterator[Row]:
    """Read the lines of a drawing, in space if they have heights, else in the unrolled plane.

    Parameters
    ----------
    path, layer
        Drawing, and its layer; None for all.
    columns : mapping
        Their column by ours; a line has the column ``layer`` only.
    needed : sequence of str
        Our columns that it must have.
    notes : list of str
        Receives a remark on entities that are not lines.

    Raises
    ------
    InputError
        If it cannot be read, or lacks a column.
    """
    if others := [theirs for theirs in columns.values() if theirs != "layer"]:
        raise InputError(
            f"{path} has no column {', '.join(others)}: lines of a drawing have their layer only (--column kind=layer)"
        )
    if needed and "kind" not in columns:
        raise InputError(
            f"{path} has no column kind: say the kind of all lines by --kind, or take their layers by --column kind=layer"
        )
    lines, left_out = read_drawn_lines(path, layer)
    if left_out:
        listed = ", ".join(f"{number} {what}" for what, number in left_out.items())
        notes.append(f"{path}: left out, because they are not lines: {listed}")
    for k, (name, vertices) in enumerate(lines):
        space = bool(vertices[:, 2].any())
        shape = shapely.LineString(vertices if space else vertices[:, :2])
        yield Row(k + 1, dict.fromkeys(columns, name), shape, "3d" if space else "unrolled")


def read_layer(
    path: Path, survey: Survey, columns: Mapping[str, str], layer: str | None, needed: Sequence[str]
) -> Iterator[Row]:
    """Read a layer of a GeoPackage or GeoJSON.

    Parameters
    ----------
    path, layer
        File, and its layer; None for its only one.
    survey : Survey
        Target.
    columns : mapping
        Their column by ours.
    needed : sequence of str
        Our columns that it must have.

    Raises
    ------
    UserError
        If it cannot be read, or lacks a column.
    """
    if path.suffix.lower() not in LAYERED:
        raise UserError(
            f"{path}: findings are imported from {', '.join((*TABLES, *LAYERED, *DRAWINGS))}; save a workbook as CSV, and"
            " import a mask by: tunneldb findings trace"
        )
    if not path.is_file():
        raise UserError(f"{path}: no such file")
    source = vector_source(path)
    try:
        there = [name for name, geometry in pyogrio.list_layers(source).tolist() if geometry is not None]
        if layer is None and len(there) > 1:
            raise UserError(f"{path} has {len(there)} layers: say which by --layer: {', '.join(there)}")
        if layer is None and there:
            layer = there[0]
        meta, _, shapes, found = pyogrio.raw.read(source, layer=layer)
    except (DataSourceError, DataLayerError, RuntimeError, ValueError) as error:
        raise UserError(f"{path}: cannot be read: {gdal_fault(error)}") from None
    view = _view(path, meta["crs"], survey)
    names = list(meta["fields"])
    wanted = {ours: columns.get(ours, ours) for ours in COLUMNS}
    if missing := [theirs for ours, theirs in wanted.items() if theirs not in names and (ours in needed or ours in columns)]:
        raise UserError(
            f"{path} has no column {', '.join(missing)}: it has {', '.join(names) or 'none'}; say which by --column"
            " OURS=THEIRS, or the kind of all by --kind"
        )
    require_unit(path, names, columns)
    held = {ours: found[names.index(theirs)] for ours, theirs in wanted.items() if theirs in names}
    for k, data in enumerate([] if shapes is None else shapes):
        values = {ours: str(column[k]) for ours, column in held.items() if not _empty(column[k])}
        yield Row(k + 1, values, None if data is None else shapely.from_wkb(data, on_invalid="ignore"), view)


def require_unit(path: Path, names: Sequence[str], columns: Mapping[str, str]) -> None:
    """Raise UserError if a file has a width without a unit, and none is named for ``width_mm``."""
    if "width" in names and "width_mm" not in names and "width_mm" not in columns:
        raise UserError(f"{path} has a column width without a unit: if it is in millimetres, add --column width_mm=width")


def _empty(value: Any) -> bool:
    return value is None or value == "" or (isinstance(value, float) and math.isnan(value)) or value != value


def _view(path: Path, given: str | None, survey: Survey) -> str:
    """Return the coordinates of a layer: the unrolled plane, which has no system, or the tunnel's."""
    crs = None if given is None else CRS(given)
    if crs is None or is_local(crs) or (path.suffix.lower() in (".geojson", ".json") and b'"crs"' not in path.read_bytes()):
        return "unrolled"
    if fits_srid(crs, survey.srid):
        return "3d"
    raise UserError(
        f"{path} is in {crs.name}: findings are in the unrolled plane, without a coordinate system, or 3D"
        f" in {srid_name(survey.srid)}"
    )


def require_within(conn: psycopg.Connection[Any], survey: Survey, path: Path, rows: Iterator[Row]) -> Iterator[Row]:
    """Yield the rows of a layer or a drawing.

    Raises
    ------
    InputError
        If there are none, or all are outside the survey or without heights: one mistake instead of one for each row.
    """
    found = list(rows)
    if not found:
        raise InputError(f"{path} has no features; nothing was imported")
    placed = [row for row in found if row.shape is not None and not row.shape.is_empty]
    flat = [row.shape for row in placed if row.view == "unrolled"]
    spatial = [row.shape for row in placed if row.view == "3d"]
    if flat:
        _require_overlap(conn, survey, path, flat)
    if spatial and not shapely.has_z(spatial).any():
        raise InputError(
            f"{path} is in {srid_name(survey.srid)}, but without heights; give z on the lining, or chainage and arc without a"
            " coordinate system"
        )
    yield from found


def _require_overlap(conn: psycopg.Connection[Any], survey: Survey, path: Path, shapes: Sequence[BaseGeometry | None]) -> None:
    """Raise InputError if all shapes of the unrolled plane are outside the survey's lining."""
    low, high = shapely.total_bounds(shapes).reshape(2, 2)
    lining = section_extent(conn, survey)
    outside = (low > (lining.chainage_to, lining.arc_to)) | (high < (lining.chainage_from, lining.arc_from))
    if outside.any():
        raise InputError(
            f"{path}: it states no coordinate system, so x is the chainage and y the arc, but x is {low[0]:.2f} to"
            f" {high[0]:.2f} and y {low[1]:.2f} to {high[1]:.2f}, outside survey {survey.name} (chainage"
            f" {lining.chainage_from:.2f} to {lining.chainage_to:.2f} m, arc {lining.arc_from:.2f} to {lining.arc_to:.2f} m);"
            " correct the coordinates, or state their coordinate system"
        )
