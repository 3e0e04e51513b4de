"""The tests' own databases: each test finds its own as its template is, whatever those before it have done."""

from __future__ import annotations

import psycopg
import pytest
from support.databases import Copies

HELD = "SELECT (SELECT count(*) FROM tunnel.tunnel), (SELECT count(*) FROM pg_class WHERE relname = 'mine')"
ADD = (
    "INSERT INTO tunnel.tunnel (name, srid, start_chainage, alignment)"
    " VALUES ('t', 25830, 0, 'SRID=25830;LINESTRING Z (0 0 0, 1 0 0)') RETURNING id"
)


def test_what_is_committed_is_seen_by_no_other(copies: Copies, template: str) -> None:
    names = []
    for commit in (True, False, False, True, False):
        with copies.copy(template) as dsn, psycopg.connect(dsn) as conn:
            names.append(conn.info.dbname)
            assert conn.execute(HELD).fetchone() == (0, 0)
            assert conn.execute(ADD).fetchone() == (1,)
            conn.execute("CREATE TABLE tunnel.mine ()")
            if not commit:
                conn.rollback()
    # one in which nothing was committed serves the next as well
    assert names[1] == names[2] == names[3]
    assert len(set(names)) == 3


def test_the_server_itself_commits_nothing(copies: Copies, template: str) -> None:
    with copies.copy(template) as dsn, psycopg.connect(dsn) as conn:
        assert conn.execute("SHOW autovacuum").fetchone() == ("off",)


def test_one_that_somebody_is_still_in_is_given_to_nobody(
    copies: Copies, template: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("support.databases.PATIENCE", 0.1)
    with copies.copy(template) as dsn:
        left = psycopg.connect(dsn)
    with copies.copy(template) as again:
        assert again != dsn
    left.close()
