"""Binary COPY of NumPy arrays: rows are packed by one structured array, not one by one.

Format: PostgreSQL documentation, "COPY", section "Binary Format". Every field is an int32 length and its
big-endian bytes; a geometry is its EWKB (PostGIS documentation, "Well-Known Binary", extended by the SRID).
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import psycopg
from numpy.typing import NDArray
from psycopg import sql

from tunneldb.arrays import Float, Int32

_HEADER = b"PGCOPY\n\xff\r\n\0" + struct.pack(">ii", 0, 0)
_TRAILER = struct.pack(">h", -1)
_EWKB_POINT_Z = 0xA0000001  # point, with Z (0x80000000) and SRID (0x20000000)
_EWKB_BYTES = 33  # byte order, type, SRID, three coordinates


@dataclass(frozen=True)
class PointZ:
    """Column of PostGIS points.

    Attributes
    ----------
    xyz
        Coordinates, (n, 3), m.
    srid
        Spatial reference of all of them.
    """

    xyz: Float
    srid: int


Column = NDArray[Any] | PointZ


def pack(columns: Sequence[Column]) -> bytes:
    """Pack columns of n values each as n rows of binary COPY, without header and trailer.

    Parameters
    ----------
    columns
        Arrays of shape (n,) of int16, int32, int64, float32, float64 or bool (PostgreSQL's int2, int4, int8,
        float4, float8, bool: the types must be the table's exactly), or `PointZ`. NULL cannot be expressed.

    Returns
    -------
    bytes
        Rows for `copy_binary`.

    Raises
    ------
    TypeError, ValueError
        If an array has another type, or another shape.
    """
    count = len(_values(columns[0]))
    fields: list[tuple[str, Any]] = [("fields", ">i2")]
    for index, column in enumerate(columns):
        fields += [(f"length{index}", ">i4"), *_field(index, column, count)]
    rows = np.empty(count, dtype=np.dtype(fields))
    rows["fields"] = len(columns)
    for index, column in enumerate(columns):
        if isinstance(column, PointZ):
            rows[f"length{index}"] = _EWKB_BYTES
            rows[f"order{index}"] = 1  # little-endian, like the coordinates in memory
            rows[f"type{index}"] = _EWKB_POINT_Z
            rows[f"srid{index}"] = column.srid
            rows[f"xyz{index}"] = column.xyz
        else:
            rows[f"length{index}"] = column.dtype.itemsize
            rows[f"value{index}"] = column
    return rows.tobytes()


def _values(column: Column) -> NDArray[Any]:
    return column.xyz if isinstance(column, PointZ) else column


def _field(index: int, column: Column, count: int) -> list[tuple[Any, ...]]:
    """Return the structured fields for one column's payload."""
    values = _values(column)
    shape = (count, 3) if isinstance(column, PointZ) else (count,)
    if values.shape != shape:
        raise ValueError(f"column {index} has the shape {values.shape}, not {shape}")
    if isinstance(column, PointZ):
        return [
            (f"order{index}", "u1"),
            (f"type{index}", "<u4"),
            (f"srid{index}", "<i4"),
            (f"xyz{index}", "<f8", (3,)),
        ]
    if values.dtype.kind not in "ifb" or values.dtype.str[1:] not in ("i2", "i4", "i8", "f4", "f8", "b1"):
        raise TypeError(f"column {index} has the type {values.dtype}, which PostgreSQL does not have")
    return [(f"value{index}", values.dtype.newbyteorder(">"))]


def copy_binary(
    conn: psycopg.Connection[Any],
    table: sql.Composable,
    columns: Sequence[str],
    chunks: Iterable[bytes | memoryview],
    *,
    fresh: bool = False,
) -> int:
    """COPY rows packed by `pack` into a table, and return the number of rows.

    The rows are copied in the connection's transaction; if the table was created in the same transaction, the embedded
    server writes no WAL for them.

    Parameters
    ----------
    fresh
        True if the table was created in the same transaction (and the same savepoint). Its rows are frozen: the first reader
        need not mark them as committed, which the server would write to the WAL as whole pages, for its checksums.
    """
    command = sql.SQL("COPY {} ({}) FROM STDIN (FORMAT binary, FREEZE {})").format(
        table, sql.SQL(", ").join(map(sql.Identifier, columns)), sql.Literal(fresh)
    )
    with conn.cursor() as cursor:
        with cursor.copy(command) as copy:
            copy.write(_HEADER)
            for chunk in chunks:
                copy.write(chunk)
            copy.write(_TRAILER)
        return cursor.rowcount


def pack_row(fields: Sequence[bytes | None]) -> bytes:
    """Pack one row of binary COPY from encoded fields; None is NULL. For rows whose arrays differ in length."""
    parts = [struct.pack(">h", len(fields))]
    for value in fields:
        parts.append(struct.pack(">i", -1 if value is None else len(value)))
        if value is not None:
            parts.append(value)
    return b"".join(parts)


def pack_value(value: float | int | None, kind: str) -> bytes | None:
    """Encode one number: ``kind`` is that of `struct`, ``h``, ``i``, ``q`` (int2, int4, int8) or ``d`` (float8)."""
    return None if value is None else struct.pack(f">{kind}", value)


def pack_array(values: Float | Int32) -> bytes:
    """Encode one array of float8 or int4.

    Format: ``array_send`` of PostgreSQL: dimensions, flag for NULLs, type, length, lower bound, elements.

    Parameters
    ----------
    values : (n,) float64 or int32 array

    Raises
    ------
    TypeError
        If the array has another type.
    """
    if values.dtype not in _ARRAYS:
        raise TypeError(f"arrays of {values.dtype} are not supported")
    kind, oid = _ARRAYS[values.dtype]
    if len(values) == 0:
        return struct.pack(">iii", 0, 0, oid)
    elements = np.empty(len(values), [("length", ">i4"), ("value", kind)])
    elements["length"], elements["value"] = values.dtype.itemsize, values
    return struct.pack(">iiiii", 1, 0, oid, len(values), 1) + elements.tobytes()


def unpack_array(sent: bytes, dtype: type[np.float64] | type[np.int32]) -> NDArray[Any]:
    """Decode an array (n,) of ``array_send`` of ``float8[]`` or ``int4[]`` without NULLs."""
    kind, _ = _ARRAYS[np.dtype(dtype)]
    elements = np.frombuffer(sent, [("length", ">i4"), ("value", kind)], offset=20) if len(sent) > 12 else None
    return np.empty(0, dtype) if elements is None else elements["value"].astype(dtype)


_ARRAYS = {np.dtype(np.float64): (">f8", 701), np.dtype(np.int32): (">i4", 23)}
