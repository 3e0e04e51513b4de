"""Findings of another system into a survey: whole, or not at all."""

from __future__ import annotations

import math
import textwrap
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import psycopg
import pyogrio
import pyogrio.raw
import shapely
from psycopg import sql
from pyogrio.errors import DataLayerError, DataSourceError
from pyproj import CRS
from shapely.geometry.base import BaseGeometry

from tunneldb.csvfile import find_column, read_header, read_texts, row_lines
from tunneldb.errors import UserError
from tunneldb.files import gdal_fault, vector_source
from tunneldb.geometry.crs import fits_srid, is_local, srid_name
from tunneldb.numerals import parse_number
from tunneldb.store.alignment import station_chainages
from tunneldb.store.coverage import GAP_STATES
from tunneldb.store.remarks import REMARK
from tunneldb.store.survey import Survey

COLUMNS = ("kind", "severity", "width_mm", "review", "remark", "photo")
"""Columns read from each row besides its place; all except the kind are optional."""


_TEXT = (".csv", ".txt")
_LAYERED = (".gpkg", ".geojson", ".json")
"""Extensions of imported files: tables, and layers."""


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


@dataclass(frozen=True)
class Imported:
    """Result of an import: number of each kind and ids in order of the file; or the errors by row."""

    kinds: Counter[str]
    ids: list[int]
    wrong: list[str]


def import_findings(
    conn: psycopg.Connection[Any],
    survey: Survey,
    path: Path,
    kinds: Mapping[str, str],
    columns: Mapping[str, str],
    layer: str | None = None,
) -> Imported:
    """Import findings from a CSV, GeoPackage or GeoJSON file in one transaction; none if any row is wrong.

    Parameters
    ----------
    conn, survey
        Target. The connection must not be in autocommit.
    path : Path
        The file. A CSV gives places by ``wkt`` or ``geometry`` (WKT: chainage and arc; with heights in space), by
        ``chainage_from``, ``chainage_to``, ``arc_from`` and ``arc_to`` (a rectangle), by ``chainage`` and ``arc``, or by ``x``,
        ``y``, ``z`` (points); a chainage may be a station of the tunnel. Shapes of other files are in the unrolled plane if
        they have no coordinate system, else in space, in the tunnel's.
    kinds : mapping
        Our kind by theirs; missing ones are ours.
    columns : mapping
        Their column by ours.
    layer : str, optional
        Layer of a GeoPackage; by default its only one.

    Raises
    ------
    UserError
        If the file cannot be read, or lacks a column.
    """
    rows = _read_csv(conn, survey, path, columns) if path.suffix.lower() in _TEXT else _read_layer(path, survey, columns, layer)
    ids, wrong = [], []
    made: Counter[str] = Counter()
    for row in rows:
        theirs = row.values.get("kind", "")
        if row.shape is None and theirs in (*GAP_STATES, REMARK):  # a list of findings begins with such rows
            continue
        kind = kinds.get(theirs, theirs)
        try:
            with conn.transaction():
                ids.append(_insert(conn, survey, row, kind))
            made[kind] += 1
        except ValueError as error:
            wrong.append(f"{path}, row {row.number}: {error}")
        except psycopg.Error as error:
            wrong.append(f"{path}, row {row.number}: {error.diag.message_primary or str(error).splitlines()[0]}")
    if wrong:
        conn.rollback()
        return Imported(Counter(), [], wrong)
    conn.commit()
    return Imported(made, ids, [])


def _insert(conn: psycopg.Connection[Any], survey: Survey, row: Row, kind: str) -> int:
    if row.shape is None:
        raise ValueError(row.wrong or "it has no geometry; draw it, or delete the row")
    query = sql.SQL(
        "INSERT INTO tunnel_api.{} (survey_id, kind, severity, width_mm, review, remark, geom)"
        " VALUES (%s, %s, %s, %s, %s, %s, public.ST_GeomFromWKB(%s, %s)) RETURNING id"
    ).format(sql.Identifier(f"finding_{row.view}"))
    found = conn.execute(
        query,
        [
            survey.id,
            kind or None,
            _number(row, "severity", int),
            _number(row, "width_mm", float),
            row.values.get("review"),
            row.values.get("remark"),
            shapely.to_wkb(row.shape),
            survey.srid if row.view == "3d" else 0,
        ],
    ).fetchone()
    assert found is not None
    if "photo" in row.values:
        conn.execute("INSERT INTO tunnel_api.finding_photo (finding_id, path) VALUES (%s, %s)", [found[0], row.values["photo"]])
    return int(found[0])


def _number(row: Row, name: str, kind: type[int] | type[float]) -> float | None:
    text = row.values.get(name)
    if text is None:
        return None
    try:
        value = parse_number(text.replace(",", "."))
    except ValueError:
        raise ValueError(f"{name} is {text!r}, not a number") from None
    if not math.isfinite(value) or kind(value) != value:
        raise ValueError(f"{name} is {text}, not a {'whole ' if kind is int else ''}number")
    return kind(value)


def _read_csv(conn: psycopg.Connection[Any], survey: Survey, path: Path, columns: Mapping[str, str]) -> Iterator[Row]:
    header = read_header(path)

    def column(name: str) -> list[str] | None:
        theirs = columns.get(name, name)
        if find_column(path, header, theirs) is None:
            if name in columns:
                raise UserError(f"{path} has no column {theirs}: its header is {','.join(header)!r}")
            return None
        return read_texts(path, theirs)

    _require_unit(path, header, columns)
    texts = {name: found for name in (*COLUMNS, *_PLACES) if (found := column(name)) is not None}
    if "kind" not in texts:
        raise UserError(f"{path} has no column kind: say which by --column kind=THEIRS; its header is {','.join(header)!r}")
    ways = [way for way in _WAYS if all(name in texts for name in way)]
    if not ways:
        raise UserError(
            f"{path} has no place of the findings: it needs columns wkt or geometry; chainage_from, chainage_to,"
            f" arc_from and arc_to; chainage and arc; or x, y and z (--column OURS=THEIRS); its header is {','.join(header)!r}"
        )
    lines = row_lines(path)
    for k in range(len(texts["kind"])):
        values = {name: found[k] for name, found in texts.items() if found[k]}
        yield _row(conn, survey, lines[k], values, next((way for way in ways if all(name in values for name in way)), None))


_WAYS = (("wkt",), ("geometry",), ("chainage_from", "chainage_to", "arc_from", "arc_to"), ("chainage", "arc"), ("x", "y", "z"))
"""Columns with the place of a finding; the first available ones are used. ``geometry`` is WKT too: lists are written with it,
together with the bounding box, which is less precise."""

_PLACES = tuple(name for way in _WAYS for name in way)


def _row(
    conn: psycopg.Connection[Any], survey: Survey, number: int, values: Mapping[str, str], way: tuple[str, ...] | None
) -> Row:
    """Row of a CSV; if its place cannot be read, with the reason."""
    try:
        shape = _shape(conn, survey, values, way)
    except ValueError as error:
        return Row(number, values, None, "unrolled", str(error))
    return Row(number, values, shape, "3d" if shape.has_z else "unrolled")


def _shape(
    conn: psycopg.Connection[Any], survey: Survey, values: Mapping[str, str], way: tuple[str, ...] | None
) -> BaseGeometry:
    if way is None:
        begun = next((one for one in _WAYS if any(name in values for name in one)), ())
        lacking = ", ".join(name for name in begun if name not in values)
        raise ValueError(f"it has no place: {lacking} is empty" if lacking else "it has no place: all columns of it are empty")
    if len(way) == 1:
        if _depth(values[way[0]]) > _MAX_NESTING:  # by which GEOS, that reads it, would go down
            raise ValueError(f"{way[0]} has more than {_MAX_NESTING} nested parentheses")
        try:
            return shapely.from_wkt(values[way[0]])
        except shapely.errors.GEOSException as error:
            why = str(error).splitlines()[0]
            raise ValueError(f"{way[0]} is {textwrap.shorten(values[way[0]], 60)!r}, which is not WKT: {why}") from None
    place = [
        read_chainage(conn, survey, name, values[name]) if name.startswith("chainage") else _float(name, values[name])
        for name in way
    ]
    return shapely.box(place[0], place[2], place[1], place[3]) if len(place) == 4 else shapely.Point(place)


_MAX_NESTING = 20
"""Maximum nesting of parentheses in WKT: a collection of polygons has four."""


def _depth(text: str) -> int:
    """Return the nesting depth of parentheses."""
    letters = np.frombuffer(text.encode("utf-32-le"), np.uint32)
    return int(np.cumsum((letters == ord("(")).astype(np.int64) - (letters == ord(")"))).max(initial=0))


def _float(name: str, text: str, said: str = "a number") -> float:
    try:
        value = parse_number(text.replace(",", "."))
    except ValueError:
        raise ValueError(f"{name} is {text!r}, not {said}") from None
    if not math.isfinite(value):
        raise ValueError(f"{name} is {text}, not {said}")
    return value


def read_chainage(conn: psycopg.Connection[Any], survey: Survey, name: str, text: str) -> float:
    """Return a chainage in metres, given so or as a station of the tunnel, which must exist exactly once."""
    text = text.replace(",", ".")
    if "+" not in text[1:]:
        return _float(name, text, "a chainage in metres or a station, as 12+345.678")
    try:
        chainages = station_chainages(conn, survey.tunnel_id, text)
    except ValueError:
        raise ValueError(f"{name} is {text!r}, not a station, as 12+345.678, nor a chainage in metres") from None
    if not chainages:
        raise ValueError(f"{name} is {text}: tunnel {survey.tunnel} has no such station")
    if len(chainages) > 1:
        where = " and ".join(f"{chainage:.3f}" for chainage in chainages)
        raise ValueError(f"{name} is {text}: tunnel {survey.tunnel} has that station at chainages {where} m; give one of these")
    return chainages[0]


def _read_layer(path: Path, survey: Survey, columns: Mapping[str, str], layer: str | None) -> Iterator[Row]:
    if path.suffix.lower() not in _LAYERED:
        raise UserError(f"{path}: findings are imported from {', '.join((*_TEXT, *_LAYERED))}; save a workbook as CSV")
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
    if missing := [theirs for ours, theirs in wanted.items() if theirs not in names and (ours == "kind" or ours in columns)]:
        raise UserError(
            f"{path} has no column {', '.join(missing)}: it has {', '.join(names)}; say which by --column OURS=THEIRS"
        )
    _require_unit(path, names, columns)
    held = {ours: found[names.index(theirs)] for ours, theirs in wanted.items() if theirs in names}
    for k, data in enumerate([] if shapes is None else shapes):
        values = {ours: str(column[k]) for ours, column in held.items() if not _empty(column[k])}
        yield Row(k + 1, values, None if data is None else shapely.from_wkb(data, on_invalid="ignore"), view)


def _require_unit(path: Path, names: Sequence[str], columns: Mapping[str, str]) -> None:
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
