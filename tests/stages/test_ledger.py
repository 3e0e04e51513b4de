"""What the ledger says of a stage that failed."""

from __future__ import annotations

import psycopg
import pytest

from tunneldb.errors import UserError
from tunneldb.stages.ledger import describe


def test_a_failure_of_the_database_is_one_line_without_where_it_was(conn: psycopg.Connection) -> None:
    with pytest.raises(psycopg.errors.DiskFull) as full:
        conn.execute("DO $$ BEGIN RAISE EXCEPTION 'could not extend file' USING ERRCODE = 'disk_full'; END $$")
    assert "CONTEXT" in str(full.value)
    assert describe(full.value) == "the database's disk is full, the current work was rolled back: could not extend file"
    conn.rollback()
    with pytest.raises(psycopg.errors.RaiseException) as raised:
        conn.execute("DO $$ BEGIN RAISE EXCEPTION 'no such vertex'; END $$")
    assert describe(raised.value) == "RaiseException: no such vertex"
    assert describe(UserError("line 3:  x is nan")) == "line 3: x is nan"
