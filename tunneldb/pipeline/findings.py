"""Findings of another system into a survey: whole, or not at all."""

from __future__ import annotations

import math
import textwrap
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import psycopg
import shapely
from psycopg import sql
from shapely.geometry.base import BaseGeometry

from tunneldb.counted import counted
from tunneldb.csvfile import find_column, read_header, read_texts, row_lines
from tunneldb.errors import UserError
from tunneldb.numerals import parse_number
from tunneldb.pipeline.finding_layers import (
    COLUMNS,
    DRAWINGS,
    TABLES,
    Row,
    read_drawing,
    read_layer,
    require_unit,
    require_within,
)
from tunneldb.store.alignment import station_chainages
from tunneldb.store.coverage import GAP_STATES
from tunneldb.store.remarks import REMARK
from tunneldb.store.survey import Survey


@dataclass(frozen=True)
class Imported:
    """Result of an import.

    Attributes
    ----------
    kinds : Counter of str
        Number of each kind.
    ids : list of int
        In order of the file.
    wrong : list of str
        Errors by row; if there are any, nothing was imported.
    notes : list of str
        Remarks, such as parts of the file that were left out.
    """

    kinds: Counter[str]
    ids: list[int]
    wrong: list[str]
    notes: list[str] = field(default_factory=list)


def import_findings(
    conn: psycopg.Connection[Any],
    survey: Survey,
    path: Path,
    kinds: Mapping[str, str],
    columns: Mapping[str, str],
    layer: str | None = None,
    kind: str | None = None,
) -> Imported:
    """Import findings from a CSV, GeoPackage, GeoJSON or DXF file in one transaction; none if any row is wrong.

    Each part of a multi-part line is a finding, after parts that meet end to end were joined. Findings that the survey has
    already, of the same kind and outline, are left out: a second import adds nothing.

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
        Layer of a GeoPackage, by default its only one; or of a DXF, by default all.
    kind : str, optional
        Kind of the rows without one.

    Raises
    ------
    UserError
        If the file cannot be read, or lacks a column.
    """
    ids: list[int] = []
    wrong: list[str] = []
    notes: list[str] = []
    needed = ("kind",) if kind is None else ()
    if path.suffix.lower() in TABLES:
        rows = _read_csv(conn, survey, path, columns, needed)
    elif path.suffix.lower() in DRAWINGS:
        rows = require_within(conn, survey, path, read_drawing(path, columns, layer, needed, notes))
    else:
        rows = require_within(conn, survey, path, read_layer(path, survey, columns, layer, needed))
    made: Counter[str] = Counter()
    repeated = 0
    for row in rows:
        theirs = row.values.get("kind", "")
        if row.shape is None and theirs in (*GAP_STATES, REMARK):  # a list of findings begins with such rows
            continue
        ours = kinds.get(theirs, theirs) or kind or ""
        parts = _parts(row.shape)
        try:
            with conn.transaction():
                found = [insert_once(conn, survey, replace(row, shape=part), ours) for part in parts]
            new = [key for key in found if key is not None]
            ids += new
            made[ours] += len(new)
            repeated += len(found) - len(new)
        except ValueError as error:
            wrong.append(f"{path}, row {row.number}: {error}")
        except psycopg.Error as error:
            wrong.append(f"{path}, row {row.number}: {error.diag.message_primary or str(error).splitlines()[0]}")
    if wrong:
        conn.rollback()
        return Imported(Counter(), [], wrong)
    conn.commit()
    if repeated:
        notes.append(f"{path}: left out: {counted(repeated, 'finding')} of the same kind and outline as one in the survey")
    return Imported(+made, ids, [], notes)


def _parts(shape: BaseGeometry | None) -> list[BaseGeometry | None]:
    """Return the lines of a multi-part line, those that meet end to end joined; else the shape itself."""
    if isinstance(shape, shapely.MultiLineString) and len(shape.geoms) > 1:
        return list(shapely.get_parts(shapely.line_merge(shape)))
    return [shape]


def insert_once(conn: psycopg.Connection[Any], survey: Survey, row: Row, kind: str) -> int | None:
    """Insert a finding, and return its id; None if the survey has a drawn one of the same kind and outline.

    Raises
    ------
    ValueError, psycopg.Error
        If it is wrong; the message is for the person who imports it.
    """
    query = (
        "SELECT count(*) FROM tunnel_api.finding n JOIN tunnel_api.finding o ON o.survey_id = n.survey_id AND o.id <> n.id"
        " AND o.chainage_from = n.chainage_from AND o.chainage_to = n.chainage_to AND o.kind = n.kind AND o.manual"
        " AND public.ST_Equals(o.unrolled, n.unrolled) WHERE n.id = %s"
    )
    with conn.transaction():
        key = insert_finding(conn, survey, row, kind)
        repeated = conn.execute(query, [key]).fetchone() != (0,)
        if repeated:
            raise psycopg.Rollback
    return None if repeated else key


def insert_finding(conn: psycopg.Connection[Any], survey: Survey, row: Row, kind: str) -> int:
    """Insert a finding, and return its id.

    Raises
    ------
    ValueError, psycopg.Error
        If it is wrong; the message is for the person who imports it.
    """
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


def _read_csv(
    conn: psycopg.Connection[Any], survey: Survey, path: Path, columns: Mapping[str, str], needed: Sequence[str]
) -> Iterator[Row]:
    header = read_header(path)

    def column(name: str) -> list[str] | None:
        theirs = columns.get(name, name)
        if find_column(path, header, theirs) is None:
            if name in columns:
                raise UserError(f"{path} has no column {theirs}: its header is {','.join(header)!r}")
            return None
        return read_texts(path, theirs)

    require_unit(path, header, columns)
    texts = {name: found for name in (*COLUMNS, *_PLACES) if (found := column(name)) is not None}
    if "kind" in needed and "kind" not in texts:
        raise UserError(
            f"{path} has no column kind: say which by --column kind=THEIRS; its header is {','.join(header)!r}; or say the kind"
            " of all by --kind"
        )
    ways = [way for way in _WAYS if all(name in texts for name in way)]
    if not ways:
        raise UserError(
            f"{path} has no place of the findings: it needs columns wkt or geometry; chainage_from, chainage_to,"
            f" arc_from and arc_to; chainage and arc; or x, y and z (--column OURS=THEIRS); its header is {','.join(header)!r}"
        )
    lines = row_lines(path)
    for k in range(len(lines)):
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
