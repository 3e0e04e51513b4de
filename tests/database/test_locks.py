"""Locks that others hold: whoever waits says for whom, and only members of the roles can connect and take locks."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import psycopg
import pytest
from click.testing import CliRunner
from psycopg import sql
from psycopg.conninfo import make_conninfo

from tunneldb.cli.main import main
from tunneldb.database import connect
from tunneldb.errors import BusyError
from tunneldb.stages.ledger import stage_run

SURVEY = "demo-2024"
KM = 12


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


@pytest.fixture
def survey(conn: psycopg.Connection) -> int:
    (key,) = conn.execute("SELECT id FROM tunnel.survey").fetchone()  # type: ignore[misc]
    conn.rollback()
    return int(key)


@pytest.fixture
def blocker(people: None, dsn: str) -> Iterator[psycopg.Connection]:
    """Connection of a login without any role, in a program of its own."""
    with psycopg.connect(make_conninfo(dsn, user="nobody", application_name="bench"), autocommit=True) as connection:
        yield connection


def named(blocker: psycopg.Connection) -> str:
    return f"nobody (process {blocker.info.backend_pid}, bench, since 2"


def test_whoever_waits_says_for_whom_and_gives_up(
    blocker: psycopg.Connection, survey: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    blocker.execute("SELECT pg_advisory_lock(-2, %s)", [survey])
    monkeypatch.setenv("PGOPTIONS", "-c lock_timeout=300ms")
    result = CliRunner().invoke(main, ["survey", "remove-file", SURVEY, "demo.laz", "--yes"])
    assert result.exit_code == 2
    waiting, refused = result.stderr.splitlines()[-2:]
    assert waiting.startswith(f"tunneldb: waiting for the queue of survey {survey}, which is locked by {named(blocker)}")
    assert f"the queue of survey {survey} is locked by {named(blocker)}" in refused
    blocker.execute("SELECT pg_advisory_unlock_all()")
    assert "locked" not in CliRunner().invoke(main, ["survey", "remove-file", SURVEY, "demo.laz", "--yes"]).stderr


def test_a_run_names_who_has_the_kilometre(blocker: psycopg.Connection, survey: int, conn: psycopg.Connection) -> None:
    blocker.execute("SELECT pg_advisory_lock(%s, %s)", [survey, KM])
    match = "another process is at work on kilometre 12"
    with pytest.raises(BusyError, match=match) as refused, stage_run(conn, survey, KM, "axis", {}):
        pass
    assert f"it is locked by {named(blocker)}" in str(refused.value)


def test_check_and_status_name_the_holder(blocker: psycopg.Connection, survey: int) -> None:
    said = "waiting: nobody waits for a lock"
    assert f"✓ {said}" in CliRunner().invoke(main, ["check"]).output
    blocker.execute("SELECT pg_advisory_lock(-2, %s)", [survey])
    for command in (["check"], ["status", SURVEY]):
        output = CliRunner().invoke(main, command).output
        assert any(named(blocker) in line and "holds an advisory lock" in line for line in output.splitlines()), command


def test_a_session_that_waits_is_listed_with_the_holder(conn: psycopg.Connection, dsn: str) -> None:
    conn.execute("LOCK TABLE tunnel.goal")
    look = "SELECT count(*) FROM tunnel_internal.lock_waits() WHERE waiting LIKE %s AND holder LIKE %s"
    with psycopg.connect(dsn, autocommit=True, options="-c statement_timeout=20s") as other, ThreadPoolExecutor(1) as pool:
        waits = pool.submit(other.execute, "SELECT count(*) FROM tunnel.goal")
        found = [f"%process {other.info.backend_pid},%", f"%process {conn.info.backend_pid},%"]
        while conn.execute(look, found).fetchone() != (1,):
            assert not waits.done()
            time.sleep(0.01)
        conn.rollback()


@pytest.mark.slow
def test_init_lets_only_members_of_the_roles_connect(people: None, conn: psycopg.Connection, dsn: str) -> None:
    conn.close()
    said = "logins that have none of the three roles can no longer connect"
    first = CliRunner().invoke(main, ["init"])
    assert first.exit_code == 0, first.output
    assert said in first.output
    assert "✓ logins" in CliRunner().invoke(main, ["check"]).output
    with pytest.raises(psycopg.OperationalError, match="permission denied for database"):
        psycopg.connect(make_conninfo(dsn, user="nobody"))
    for name in ("vera", "ines", "otto"):
        psycopg.connect(make_conninfo(dsn, user=name)).close()
    assert said not in CliRunner().invoke(main, ["init"]).output


def test_a_database_of_one_owner_is_closed_to_the_people_of_another(people: None, conn: psycopg.Connection, dsn: str) -> None:
    """As docs/howto-operate.md says: the roles are those of the whole server."""
    conn.close()
    assert CliRunner().invoke(main, ["init"]).exit_code == 0
    with psycopg.connect(dsn, autocommit=True) as owner:
        name = sql.Identifier(owner.info.dbname)
        owner.execute(sql.SQL("REVOKE CONNECT ON DATABASE {} FROM tunnel_viewer").format(name))
        owner.execute(sql.SQL("GRANT CONNECT ON DATABASE {} TO ines").format(name))
    assert CliRunner().invoke(main, ["init"]).exit_code == 0
    for stranger in ("vera", "otto"):
        with pytest.raises(psycopg.OperationalError, match="permission denied for database"):
            psycopg.connect(make_conninfo(dsn, user=stranger))
    with psycopg.connect(make_conninfo(dsn, user="ines")) as ines:
        ines.execute("SELECT * FROM tunnel_api.leak").fetchall()


def test_init_limits_queries_of_other_programs(people: None, conn: psycopg.Connection, dsn: str) -> None:
    """Commands of tunneldb are not limited; a limit that the owner sets stays."""
    conn.close()
    result = CliRunner().invoke(main, ["init"])
    (advice,) = re.findall(r"for another limit: (ALTER DATABASE \w+ SET statement_timeout = '1h')", result.output)
    shown = "SELECT current_setting('statement_timeout')"
    with psycopg.connect(make_conninfo(dsn, user="vera")) as vera, connect(dsn) as command:
        assert vera.execute(shown).fetchone() == ("10min",)
        assert command.execute(shown).fetchone() == ("0",)
        vera.execute("SET statement_timeout = '0.1s'")
        with pytest.raises(psycopg.errors.QueryCanceled):
            vera.execute("SELECT count(*) FROM generate_series(1, 1e9)")
    with psycopg.connect(dsn, autocommit=True) as owner:
        owner.execute(advice)
    assert "for another limit" not in CliRunner().invoke(main, ["init"]).output
    with psycopg.connect(make_conninfo(dsn, user="vera")) as vera:
        assert vera.execute(shown).fetchone() == ("1h",)
