"""Binary COPY against PostgreSQL's own text COPY: the same rows."""

from __future__ import annotations

import numpy as np
import psycopg
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from psycopg import sql

from tunneldb.database import PointZ, copy_binary, pack
from tunneldb.database.copy import pack_array, pack_row, pack_value, unpack_array

TYPES = {"i2": "int2", "i4": "int4", "i8": "int8", "f4": "float4", "f8": "float8", "?": "bool"}


def test_every_type_arrives_as_by_text(conn: psycopg.Connection) -> None:
    random = np.random.default_rng(0)
    count = 1000
    columns = {
        "i2": random.integers(-(2**15), 2**15, count).astype("i2"),
        "i4": random.integers(-(2**31), 2**31, count).astype("i4"),
        "i8": random.integers(-(2**63), 2**63 - 1, count),
        "f4": random.normal(size=count).astype("f4"),
        "f8": random.normal(size=count) * 1e6,
        "?": random.random(count) < 0.5,
    }
    xyz = random.normal(size=(count, 3)) * 1e5
    definition = ", ".join(f'"{name}" {TYPES[name]}' for name in columns)
    for table in ("by_binary", "by_text"):
        conn.execute(f"CREATE TEMP TABLE {table} ({definition}, geom geometry(PointZ, 3794))")
    names = [*columns, "geom"]
    copied = copy_binary(conn, sql.Identifier("by_binary"), names, [pack([*columns.values(), PointZ(xyz, 3794)])])
    with conn.cursor().copy("COPY by_text FROM STDIN") as copy:
        for *values, point in zip(*columns.values(), xyz, strict=True):
            ewkt = "SRID=3794;POINT Z ({:.17g} {:.17g} {:.17g})".format(*point)
            copy.write_row([*(value.item() for value in values), ewkt])
    assert copied == count
    differing = conn.execute("(TABLE by_binary EXCEPT TABLE by_text) UNION ALL (TABLE by_text EXCEPT TABLE by_binary)")
    assert differing.fetchall() == []


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(hnp.arrays("f8", st.integers(0, 20), elements=st.floats(width=64)))
def test_floats_survive_bit_by_bit(conn: psycopg.Connection, values: np.ndarray) -> None:
    with conn.transaction(force_rollback=True):
        conn.execute("CREATE TEMP TABLE there_and_back (n int, x float8)")
        numbers = np.arange(len(values), dtype="i4")
        copy_binary(conn, sql.Identifier("there_and_back"), ["n", "x"], [pack([numbers, values])])
        back = conn.cursor(binary=True).execute("SELECT x FROM there_and_back ORDER BY n").fetchall()
    np.testing.assert_array_equal(np.array([row[0] for row in back], dtype="f8"), values)


def test_a_type_that_postgresql_lacks_is_refused() -> None:
    with pytest.raises(TypeError, match="uint32"):
        pack([np.zeros(2, dtype="u4")])


def test_unequal_lengths_are_refused() -> None:
    with pytest.raises(ValueError, match="shape"):
        pack([np.zeros(2), np.zeros(3)])


def test_arrays_of_any_length_and_nulls_are_sent_and_come_back(conn: psycopg.Connection) -> None:
    conn.execute("CREATE TEMP TABLE kept (n int, few int[], many float8[])")
    rows = [(1, np.array([1, -7], np.int32), np.array([0.5, np.nan, -np.inf])), (None, np.empty(0, np.int32), np.empty(0))]
    packed = [pack_row([pack_value(n, "i"), pack_array(few), pack_array(many)]) for n, few, many in rows]
    assert copy_binary(conn, sql.Identifier("kept"), ("n", "few", "many"), packed) == 2
    assert conn.execute("SELECT n, few, many[1], many[3] FROM kept").fetchall() == [
        (1, [1, -7], 0.5, -np.inf), (None, [], None, None),
    ]  # fmt: skip
    sent = conn.execute("SELECT array_send(few), array_send(many) FROM kept", binary=True).fetchall()
    for (few, many), (_, expected, others) in zip(sent, rows, strict=True):
        np.testing.assert_array_equal(unpack_array(few, np.int32), expected)
        np.testing.assert_array_equal(unpack_array(many, np.float64), others)
    with pytest.raises(TypeError, match="float32"):
        pack_array(np.zeros(3, np.float32))
