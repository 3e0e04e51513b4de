"""Schema tunnel_shared of each server: the views of tunnel_api with the name by which a hub knows the server."""

from __future__ import annotations

import psycopg
import pytest

COLUMNS = """
SELECT c.relname, array_agg(a.attname || ' ' || format_type(a.atttypid, a.atttypmod) ORDER BY a.attnum)
  FROM pg_class c JOIN pg_attribute a ON a.attrelid = c.oid AND a.attnum > 0
 WHERE c.relnamespace = %s::regnamespace AND c.relkind = 'v' GROUP BY c.relname
"""


def test_it_has_every_view_of_tunnel_api(conn: psycopg.Connection) -> None:
    shared = dict(conn.execute(COLUMNS, ["tunnel_shared"]).fetchall())
    api = dict(conn.execute(COLUMNS, ["tunnel_api"]).fetchall())
    assert shared.keys() - api.keys() == {"database_state", "view_comment"}
    assert {view: ["server text", *columns] for view, columns in api.items()} == {view: shared[view] for view in api}


def test_the_name_of_the_server_is_that_of_the_session(example: str, conn: psycopg.Connection) -> None:
    query = "SELECT DISTINCT server FROM tunnel_shared.leak"
    assert conn.execute(query).fetchall() == [(None,)]
    conn.execute("SET LOCAL tunneldb.server = 'north'")
    assert conn.execute(query).fetchall() == [("north",)]
    state = "SELECT server, login, may_write, tunnels, surveys FROM tunnel_shared.database_state"
    assert conn.execute(state).fetchone() == ("north", conn.info.user, True, 1, 1)


@pytest.mark.parametrize("person", ["vera"], indirect=True)
def test_a_viewer_reads_it(person: psycopg.Connection, example: str) -> None:
    assert person.execute("SELECT may_write, surveys FROM tunnel_shared.database_state").fetchone() == (False, 1)
    with pytest.raises(psycopg.errors.InsufficientPrivilege):
        person.execute("UPDATE tunnel_shared.leak SET review = 'confirmed'")


@pytest.mark.parametrize("person", ["nobody"], indirect=True)
def test_others_do_not(person: psycopg.Connection, example: str) -> None:
    with pytest.raises(psycopg.errors.InsufficientPrivilege):
        person.execute("SELECT * FROM tunnel_shared.leak")
