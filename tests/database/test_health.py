"""What `check` says of the server's locks: enough for a dump of all tables, and for the removal of the longest survey."""

from __future__ import annotations

import re

import psycopg
import pytest

from tunneldb.database import health


def test_locks_suffice_for_a_dump_and_for_a_removal(conn: psycopg.Connection, monkeypatch: pytest.MonkeyPatch) -> None:
    assert health._locks(conn).level == "ok"
    row = conn.execute(
        "SELECT current_setting('max_locks_per_transaction')::int, current_setting('max_connections')::int"
        " + current_setting('max_prepared_transactions')::int"
    ).fetchone()
    assert row is not None
    locks, places = row
    # The survey has one partition: were as many locks needed for it as there are, all other sessions would find none.
    monkeypatch.setattr(health, "LOCKS_PER_TABLE", locks * places)
    conn.execute("CREATE TABLE tunnel.point_s9_km0 (LIKE tunnel.point)")
    found = health._locks(conn)
    assert found.level == "note"
    assert "remove the longest survey" in found.text
    advised = re.search(r"max_locks_per_transaction = (\d+)", found.remedy)
    assert advised is not None
    assert int(advised[1]) * places >= locks * places + places * health.LOCKS_OF_A_SESSION
