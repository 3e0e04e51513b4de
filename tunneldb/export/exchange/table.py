"""Views of the database as columns of a file."""

from __future__ import annotations

import datetime as dt
import itertools
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import psycopg
from numpy.typing import NDArray
from psycopg import sql

from tunneldb.arrays import Bool
from tunneldb.store.survey import Survey

_ALONG = ("chainage_from", "chainage_to"), ("chainage", "chainage")
"""Columns with the position along the tunnel: of a stretch, and of a place."""


@dataclass(frozen=True)
class Column:
    """A column of a table, with a flag on each value that is missing."""

    name: str
    values: NDArray[Any]
    missing: Bool


@dataclass(frozen=True)
class Table:
    """Rows of one kind.

    Attributes
    ----------
    columns : list of Column
        Remarks on them.
    geometry : (n,) array of bytes
        WKB.
    description : str
        Description of the rows, for users of the file.
    """

    columns: list[Column]
    geometry: NDArray[np.object_]
    description: str


def read_table(
    conn: psycopg.Connection[Any], survey: Survey, view: str, low: float, high: float, where: str = "", geometry: str = "geom"
) -> Table:
    """Read the rows of a view of ``tunnel_api`` for a stretch of a survey.

    Parameters
    ----------
    conn, survey
        Connection.
    view : str
        A view with a column ``survey_id``.
    low, high : float
        Chainage, m; rows that reach into the stretch are read whole. A view without chainages is cut by its geometry, which
        must be in the unrolled plane.
    where : str
        One more condition, in SQL.
    geometry : str
        Column of the geometry.
    """
    name = sql.Identifier("tunnel_api", view)
    described = conn.execute(sql.SQL("SELECT * FROM {} LIMIT 0").format(name)).description or []
    kept = [(column.name, column.type_code) for column in described if column.name != geometry]
    along = next((pair for pair in _ALONG if set(pair) <= {name for name, _ in kept}), None)
    inside = (
        sql.SQL("{0} && public.ST_MakeEnvelope({1}, -1e6, {2}, 1e6, 0)").format(
            sql.Identifier(geometry), sql.Literal(max(low, -1e9)), sql.Literal(min(high, 1e9))
        )
        if along is None
        else sql.SQL("{} < {} AND {} > {}" if along[0] != along[1] else "{} <= {} AND {} >= {}").format(
            sql.Identifier(along[0]), sql.Literal(high), sql.Identifier(along[1]), sql.Literal(low)
        )
    )
    query = sql.SQL("SELECT {}, public.ST_AsBinary({}) FROM {} WHERE survey_id = {} AND {} AND {} ORDER BY id").format(
        sql.SQL(", ").join(sql.Identifier(name) for name, _ in kept), sql.Identifier(geometry), name,
        sql.Literal(survey.id), inside, sql.SQL(where or "true"),
    )  # fmt: skip
    rows = conn.execute(query).fetchall()
    told = conn.execute("SELECT obj_description(%s::regclass)", [f"tunnel_api.{view}"]).fetchone()
    text = told[0] if told and told[0] else ""
    return table_of([name for name, _ in kept], rows, text, [type_code for _, type_code in kept])


def table_of(names: Sequence[str], rows: Sequence[tuple[Any, ...]], description: str, types: Sequence[int]) -> Table:
    """Convert rows, whose last value is WKB, to columns.

    Parameters
    ----------
    names, types
        Name and type (its OID in PostgreSQL) of each column but the last.
    rows
        Values as psycopg gives them.
    description
        Description of the rows.
    """
    columns = []
    for k, (name, type_code) in enumerate(zip(names, types, strict=True)):
        dtype, convert = _FORM.get(type_code, (np.dtype(object), _text))
        values = [row[k] for row in rows]
        missing = np.array([value is None for value in values], dtype=bool)
        filled = [_EMPTY[dtype.kind] if value is None else convert(value) for value in values]
        columns.append(Column(name, np.array(filled, dtype=dtype), missing))
    geometry = np.array([None if row[-1] is None else bytes(row[-1]) for row in rows], dtype=object)
    return Table(columns, geometry, description)


def _text(value: Any) -> str:
    if isinstance(value, list):
        return ", ".join(map(str, value))
    return json.dumps(value, ensure_ascii=False) if isinstance(value, dict) else str(value)


def _moment(value: dt.datetime) -> np.datetime64:
    """Convert to UTC without a time zone, which NumPy does not support."""
    return np.datetime64(value.astimezone(dt.UTC).replace(tzinfo=None), "ms")


_EMPTY = {"i": 0, "f": np.nan, "b": False, "M": np.datetime64("NaT"), "O": None}
"""Placeholder for a missing value, by kind of column."""


def _forms() -> dict[int, tuple[np.dtype[Any], Callable[[Any], Any]]]:
    oid = psycopg.postgres.types
    whole = itertools.product(("int2", "int4", "int8"), [(np.dtype(np.int64), int)])
    broken = itertools.product(("float4", "float8", "numeric"), [(np.dtype(np.float64), float)])
    form: dict[str, tuple[np.dtype[Any], Callable[[Any], Any]]] = {
        **dict(whole), **dict(broken), "bool": (np.dtype(bool), bool), "timestamptz": (np.dtype("datetime64[ms]"), _moment),
        "date": (np.dtype("datetime64[D]"), np.datetime64),
    }  # fmt: skip
    return {oid[name].oid: value for name, value in form.items()}


_FORM = _forms()
"""Format of a column by its type in PostgreSQL; other types are written as text."""
