"""`tunneldb federate`: refusals in one line, no password anywhere, renewal, removal, a kill in the middle, rights."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import psycopg
import pytest
from psycopg import sql
from psycopg.conninfo import make_conninfo
from support.command import errors_of
from support.federation import READER, Federation, reader

TUNNELDB = [sys.executable, "-c", "from tunneldb.cli.main import main; main()"]
SECRET = "Geheim-4711"


def refused(federation: Federation, *words: object) -> str:
    return errors_of("--dsn", federation.hub, "federate", *words, code=2)


def traces(dsn: str) -> list[tuple[str, ...]]:
    """Schemas and functions of a hub in its database."""
    with psycopg.connect(dsn) as connection:
        return connection.execute(
            "SELECT 'schema', nspname::text FROM pg_namespace WHERE nspname !~ '^pg_' UNION ALL"
            " SELECT 'server', srvname FROM pg_foreign_server UNION ALL"
            " SELECT 'mapping', srvname FROM pg_user_mappings UNION ALL"
            " SELECT 'setting', unnest(setconfig) FROM pg_db_role_setting s JOIN pg_database d ON d.oid = s.setdatabase"
            "  WHERE d.datname = current_database() ORDER BY 1, 2"
        ).fetchall()


def test_what_cannot_be_added_is_refused_in_one_line(federation: Federation, empty_dsn: str) -> None:
    before = traces(federation.hub)
    north = reader(federation.north)
    for name in ("North", "1north", "a" * 32, "a-b", "", "x; DROP"):
        assert "is not valid as a name" in refused(federation, "add", name, "--dsn", north)
    assert "names no user" in refused(federation, "add", "north", "--dsn", "host=/tmp dbname=x")
    assert "names no database" in refused(federation, "add", "north", "--dsn", "host=/tmp user=x")
    assert "not valid for libpq" in refused(federation, "add", "north", "--dsn", "host")
    assert "cannot use north: connection to server" in refused(
        federation, "add", "north", "--dsn", "host=/tmp/none dbname=x user=x"
    )
    assert "no schema tunnel_shared: type tunneldb init there" in refused(
        federation, "add", "north", "--dsn", reader(empty_dsn)
    )
    nobody = make_conninfo(federation.north, user="nobody")
    assert "may not read there" in refused(federation, "add", "north", "--dsn", nobody)
    assert "the hub has no server north" in refused(federation, "add", "north")
    assert "the hub has no server north" in refused(federation, "remove", "north")
    assert "the hub has no servers" in refused(federation, "check")
    assert traces(federation.hub) == before
    federation.add("north")
    assert "Did you mean 'north'?" in refused(federation, "remove", "nort")


def test_a_password_is_refused_and_nowhere_stored(federation: Federation, tmp_path: Path) -> None:
    log = tmp_path / "log"
    for dsn in (
        f"host=localhost dbname=x user=y password={SECRET}",
        f"postgresql://y:{SECRET}@localhost/x",
        f"host=localhost dbname=x user=y sslpassword={SECRET}",
        f"host=localhost user=y password={SECRET} nonsense",
        f"postgresql://y:{SECRET}@localhost:port/x",
    ):
        said = errors_of("--log", log, "--dsn", federation.hub, "federate", "add", "north", "--dsn", dsn, code=2)
        assert SECRET not in said
    assert "passfile=" in refused(federation, "add", "north", "--dsn", f"user=y dbname=x password={SECRET}")
    assert SECRET not in log.read_text()
    with psycopg.connect(federation.hub) as connection:
        assert connection.execute("SELECT to_regnamespace('tunnel_hub')").fetchone() == (None,)


def test_a_list_shows_servers_and_a_second_add_renews(federation: Federation) -> None:
    assert json.loads(federation.federate("list", "--json"))["servers"] == []
    federation.add("north")
    federation.add("south")
    with psycopg.connect(federation.hub) as owner:
        owner.execute("CREATE VIEW public.mine AS SELECT server, area FROM tunnel_hub.leak")
    federation.federate("add", "north")
    federation.add("north", federation.south)
    (north, south) = json.loads(federation.federate("list", "--json"))["servers"]
    assert (north["name"], north["state"], north["user"], north["surveys"]) == ("north", "present", READER, 1)
    assert north["database"] == south["database"]
    with psycopg.connect(federation.hub) as owner:
        assert owner.execute("SELECT DISTINCT survey FROM tunnel_hub.leak").fetchall() == [("south-2024",)]
        assert owner.execute("SELECT count(DISTINCT server) FROM mine").fetchone() == (2,)
        schemas = owner.execute("SELECT nspname FROM pg_namespace WHERE nspname LIKE 'tunnel\\_server%' ORDER BY 1").fetchall()
        assert schemas == [("tunnel_server_north",), ("tunnel_server_south",)]
    federation.federate("remove", "north")
    with psycopg.connect(federation.hub) as owner:
        assert owner.execute("SELECT DISTINCT server FROM mine").fetchall() == [("south",)]
    assert "view mine depends on view tunnel_hub.leak" in refused(federation, "remove", "south")


def test_a_removal_leaves_nothing(federation: Federation) -> None:
    with psycopg.connect(federation.hub) as connection:
        connection.execute("CREATE EXTENSION postgis; CREATE EXTENSION postgres_fdw")
    before = traces(federation.hub)
    federation.add("north")
    federation.add("south")
    both = traces(federation.hub)
    assert ("setting", "enable_partitionwise_aggregate=on") in both
    federation.federate("remove", "south")
    assert [trace for trace in both if trace not in traces(federation.hub)] == [
        ("mapping", "tunnel_server_south"),
        ("schema", "tunnel_server_south"),
        ("server", "tunnel_server_south"),
    ]
    federation.federate("remove", "north")
    assert traces(federation.hub) == before


def definitions(dsn: str) -> list[tuple[str, ...]]:
    with psycopg.connect(dsn) as connection:
        return connection.execute(
            "SELECT viewname::text, definition FROM pg_views WHERE schemaname = 'tunnel_hub' UNION ALL"
            " SELECT inhparent::regclass::text, inhrelid::regclass::text FROM pg_inherits UNION ALL"
            " SELECT name, state FROM tunnel_hub.server UNION ALL"
            " SELECT 'foreign', oid::regclass::text FROM pg_class WHERE relkind = 'f' ORDER BY 1, 2"
        ).fetchall()


def test_a_kill_in_the_middle_leaves_the_former_state(federation: Federation) -> None:
    federation.add("north")
    before = definitions(federation.hub), traces(federation.hub)
    words = ["--dsn", federation.hub, "federate", "add", "south", "--dsn", reader(federation.south)]
    with psycopg.connect(federation.hub) as reading, psycopg.connect(federation.hub, autocommit=True) as watching:
        reading.execute("SELECT * FROM tunnel_hub.worker")  # one of the last views: it cannot be replaced meanwhile
        with subprocess.Popen([*TUNNELDB, *words]) as process:
            waiting = "SELECT count(*) FROM pg_locks WHERE NOT granted AND relation = 'tunnel_hub.worker'::regclass"
            _wait_until(watching, waiting, 1)
            os.kill(process.pid, signal.SIGKILL)
        reading.rollback()
        _wait_until(watching, "SELECT count(*) FROM pg_stat_activity WHERE application_name = 'tunneldb'", 0)
    assert (definitions(federation.hub), traces(federation.hub)) == before


def _wait_until(connection: psycopg.Connection, query: str, value: int) -> None:
    end = time.monotonic() + 60
    while connection.execute(query.encode()).fetchone() != (value,):
        assert time.monotonic() < end, query
        time.sleep(0.05)


@pytest.fixture
def anna(server_dsn: str) -> Iterator[str]:
    """An ordinary login."""
    with psycopg.connect(server_dsn, autocommit=True) as server:
        server.execute("CREATE ROLE anna LOGIN")
        yield "anna"
        server.execute("DROP ROLE anna")


def test_an_ordinary_owner_is_told_what_a_superuser_must_run(anna: str, federation: Federation) -> None:
    with psycopg.connect(federation.hub, autocommit=True) as superuser:
        superuser.execute(sql.SQL("ALTER DATABASE {} OWNER TO anna").format(sql.Identifier(superuser.info.dbname)))
        superuser.execute("ALTER SCHEMA public OWNER TO anna; CREATE EXTENSION postgis")
        ordinary = Federation(make_conninfo(federation.hub, user=anna), federation.north, federation.south)
        said = refused(ordinary, "add", "north", "--dsn", reader(federation.north))
        assert said.endswith("have a superuser run there: CREATE EXTENSION postgres_fdw;\n")
        superuser.execute("CREATE EXTENSION postgres_fdw")
        said = refused(ordinary, "add", "north", "--dsn", reader(federation.north))
        superuser.execute(said.partition("and add north again: ")[2].encode())
        ordinary.add("north")
        ordinary.federate("add", "north")
        with psycopg.connect(reader(federation.hub)) as viewer:
            assert viewer.execute("SELECT count(*) > 0 FROM tunnel_hub.leak").fetchone() == (True,)
        assert "present" in ordinary.federate("check")
        ordinary.federate("remove", "north")
        superuser.execute(sql.SQL("ALTER DATABASE {} OWNER TO CURRENT_USER").format(sql.Identifier(superuser.info.dbname)))
        superuser.execute("ALTER SCHEMA public OWNER TO pg_database_owner; DROP OWNED BY anna")


def test_a_login_that_may_write_is_named(federation: Federation) -> None:
    dsn = make_conninfo(federation.north, user="ines")
    assert "the login ines may write there" in federation.federate("add", "north", "--dsn", dsn)
    assert "the login ines may write there" in federation.federate("check")
