"""Fast fetch of many rows into a NumPy array: the server concatenates them, so that Python gets one value.

Row by row, psycopg takes about 5 µs for each; two million rows are four times as fast this way.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import psycopg
from numpy.typing import NDArray
from psycopg import sql

_SEND = {"f8": "float8send", "f4": "float4send", "i8": "int8send", "i4": "int4send", "i2": "int2send"}


def fetch_array(
    conn: psycopg.Connection[Any],
    fields: Sequence[tuple[str, str, sql.Composable]],
    source: sql.Composable,
    parameters: Mapping[str, Any],
) -> NDArray[Any]:
    """Fetch rows as a structured array.

    Parameters
    ----------
    fields
        Name, type (``f8``, ``f4``, ``i8``, ``i4`` or ``i2``, exactly the type of the expression) and expression of each
        column; none may be NULL.
    source
        Rest of the query after SELECT …: FROM, WHERE; at most about ten million rows.
    parameters
        Values of the placeholders.

    Returns
    -------
    (n,) structured array
        Rows in native byte order, in the order of the server.
    """
    packed = sql.SQL(" || ").join(sql.SQL("{}({})").format(sql.SQL(_SEND[kind]), expression) for _, kind, expression in fields)
    query = sql.SQL("SELECT string_agg({}, ''::bytea) {}").format(packed, source)
    with conn.cursor(binary=True) as cursor:
        row = cursor.execute(query, parameters).fetchone()
    assert row is not None
    rows = np.frombuffer(row[0] or b"", np.dtype([(name, f">{kind}") for name, kind, _ in fields]))
    return rows.astype(np.dtype([(name, kind) for name, kind, _ in fields]))
