"""`tunneldb federate check`: a server that is away, that comes back, that is of another version."""

from __future__ import annotations

import getpass
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import psycopg
import pytest
from psycopg import sql
from psycopg.conninfo import make_conninfo
from support.federation import READER, Federation, reader

from tunneldb.database import install, open_connection
from tunneldb.database.binaries import find_binaries
from tunneldb.database.server import Server
from tunneldb.stages.registry import REGISTRY

TUNNELDB = [sys.executable, "-c", "from tunneldb.cli.main import main; main()"]
SECRET = "Geheim-4711"
COUNT = "SELECT server, count(*) FROM tunnel_hub.tunnel GROUP BY server ORDER BY server"


@pytest.fixture(scope="module")
def own_server() -> Iterator[tuple[Server, str]]:
    """A server beside that of the tests with one tunnel, and its DSN for the hub."""
    home = Path(tempfile.mkdtemp(prefix="tunneldb-west-"))
    server = Server(home, {"fsync": "off", "shared_buffers": "32MB"})
    try:
        dsn = server.start()
        with open_connection(dsn) as connection:
            install(connection, REGISTRY)
            connection.execute(f"CREATE ROLE {READER} LOGIN IN ROLE tunnel_viewer".encode())
            connection.execute(
                "INSERT INTO tunnel.tunnel (name, srid, start_chainage, spacing, alignment)"
                " VALUES ('west', 25830, 0, 10, 'SRID=25830;LINESTRING Z (0 0 0, 10 0 0)')"
            )
        yield server, make_conninfo(dsn, user=READER)
    finally:
        server.stop()
        shutil.rmtree(home)


@pytest.fixture
def west(own_server: tuple[Server, str]) -> tuple[Server, str]:
    """That server, running, whatever another test did to it."""
    own_server[0].start()
    return own_server


@pytest.fixture
def asking(west: tuple[Server, str]) -> Iterator[Server]:
    """That server, while it asks the reader for the password SECRET."""
    server, dsn = west
    home = server.home()
    rules = home.state / "rules.conf"
    rules.write_text(f"local all {READER} scram-sha-256\nlocal all all trust\n")
    rules.chmod(0o600)
    if home.user is not None:
        os.chown(rules, home.user.pw_uid, home.user.pw_gid)
    with psycopg.connect(make_conninfo(dsn, user=getpass.getuser()), autocommit=True) as owner:
        owner.execute(f"ALTER ROLE {READER} PASSWORD '{SECRET}'".encode())
        owner.execute(sql.SQL("ALTER SYSTEM SET hba_file = {}").format(sql.Literal(str(rules))))
    server.stop()
    server.start()
    yield server
    with psycopg.connect(make_conninfo(dsn, user=getpass.getuser()), autocommit=True) as owner:
        owner.execute("ALTER SYSTEM RESET hba_file")
    server.stop()


def test_a_password_comes_from_a_file_of_the_hub(
    federation: Federation, west: tuple[Server, str], asking: Server, server_dsn: str
) -> None:
    home = asking.home()
    passwords = Path(server_dsn.partition("host=")[2].split()[0]) / "passwords"
    passwords.touch(0o600)
    if home.user is not None:
        os.chown(passwords, home.user.pw_uid, home.user.pw_gid)
    target = make_conninfo(west[1], passfile=str(passwords))
    assert "no password supplied" in federation.federate("add", "west", "--dsn", target, code=2)
    passwords.write_text(f"*:*:*:{READER}:{SECRET}\n")
    federation.federate("add", "west", "--dsn", target)
    assert "present" in federation.federate("check")
    assert ask(federation.hub, "SELECT server, name FROM tunnel_hub.tunnel") == ([("west", "west")], [])
    dump = subprocess.run([find_binaries()["pg_dump"], "--dbname", federation.hub], capture_output=True, text=True, check=True)
    assert str(passwords) in dump.stdout
    assert SECRET not in dump.stdout
    assert SECRET not in Server().home().log.read_text()


def ask(dsn: str, query: str) -> tuple[list[tuple[object, ...]], list[str]]:
    """Rows of a query of a viewer, and the warnings that it gets."""
    warnings: list[str] = []
    with psycopg.connect(reader(dsn)) as connection:
        connection.add_notice_handler(lambda notice: warnings.append(notice.message_primary or ""))
        return connection.execute(query.encode()).fetchall(), warnings


def test_others_answer_while_a_server_is_away(federation: Federation, west: tuple[Server, str]) -> None:
    federation.add("north")
    federation.federate("add", "west", "--dsn", west[1])
    assert federation.federate("check").count("present") == 2
    assert ask(federation.hub, COUNT) == ([("north", 1), ("west", 1)], [])

    west[0].stop()
    with pytest.raises(psycopg.OperationalError, match="tunnel_server_west"):  # nothing is missing in silence
        ask(federation.hub, COUNT)
    assert ask(federation.hub, "SELECT name FROM tunnel_hub.tunnel WHERE server = 'north'") == ([("demo",)], [])
    with psycopg.connect(federation.hub) as owner:
        owner.execute("CREATE VIEW public.mine AS SELECT server, name FROM tunnel_hub.tunnel")
    said = federation.federate("check", code=1)
    assert "away" in said
    assert "connection to server on socket" in said

    rows, warnings = ask(federation.hub, COUNT)
    assert rows == [("north", 1)]
    assert len(warnings) == 1
    assert warnings[0].startswith("server west is away since 20")
    assert warnings[0].endswith(": its tunnels are missing here")
    joined = "SELECT t.name FROM tunnel_hub.tunnel t JOIN tunnel_hub.survey s ON s.server = t.server AND s.tunnel_id = t.id"
    rows, warnings = ask(federation.hub, joined)
    assert (rows, len(warnings)) == ([("demo",)], 1)  # once, of two views
    assert ask(federation.hub, "SELECT name FROM tunnel_hub.tunnel WHERE server = 'north'") == ([("demo",)], [])
    rows, warnings = ask(federation.hub, "SELECT name FROM tunnel_hub.tunnel WHERE server = 'west'")
    assert (rows, len(warnings)) == ([], 1)
    for query in ("SELECT name FROM tunnel_hub.tunnel LIMIT 1", "SELECT EXISTS (SELECT FROM tunnel_hub.tunnel)"):
        assert len(ask(federation.hub, query)[1]) == 1
    ((state, message, tunnels),), _ = ask(
        federation.hub, "SELECT state, message, tunnels FROM tunnel_hub.server WHERE name = 'west'"
    )
    assert (state, tunnels) == ("away", 1)
    assert "connection to server" in str(message)
    federation.federate("check", code=1)
    with psycopg.connect(reader(federation.hub), autocommit=True) as prepared:  # a plan that is kept warns each time
        warnings = []
        prepared.add_notice_handler(lambda notice: warnings.append(notice.message_primary or ""))
        for _ in range(7):
            assert prepared.execute(COUNT.encode(), prepare=True).fetchall() == [("north", 1)]
        assert len(warnings) == 7

        west[0].start()
        federation.federate("check")
        assert prepared.execute(COUNT.encode(), prepare=True).fetchall() == [("north", 1), ("west", 1)]
    with psycopg.connect(federation.hub) as owner:
        assert owner.execute("SELECT name FROM mine ORDER BY name").fetchall() == [("demo",), ("west",)]
    assert ask(federation.hub, COUNT) == ([("north", 1), ("west", 1)], [])


def test_a_server_that_hangs_is_away(federation: Federation, west: tuple[Server, str]) -> None:
    federation.add("north")
    federation.federate("add", "west", "--dsn", west[1])
    postmaster = int((west[0].home().cluster / "postmaster.pid").read_text().split("\n", 1)[0])
    os.kill(postmaster, signal.SIGSTOP)  # accepts connections, and answers none
    try:
        begin = time.monotonic()
        assert "timeout expired" in federation.federate("check", code=1)
        assert time.monotonic() - begin < 10
    finally:
        os.kill(postmaster, signal.SIGCONT)
    assert ask(federation.hub, COUNT)[0] == [("north", 1)]
    federation.federate("check")
    assert ask(federation.hub, COUNT) == ([("north", 1), ("west", 1)], [])


def test_an_open_transaction_does_not_stop_the_hub(
    federation: Federation, west: tuple[Server, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tunneldb.federation.check.VIEWS_TIMEOUT", "200ms")
    federation.add("north")
    federation.federate("add", "west", "--dsn", west[1])
    with psycopg.connect(reader(federation.hub), application_name="QGIS") as reading:
        reading.execute("SELECT * FROM tunnel_hub.class")
        west[0].stop()
        said = federation.federate("check", code=1)
        assert f"Warning: the views of the hub are in use: {READER} (process " in said
        assert "QGIS" in said
        state = "SELECT state, shown FROM tunnel_hub.server WHERE name = 'west'"
        assert ask(federation.hub, state)[0] == [("away", True)]
        reading.rollback()
    federation.federate("check", code=1)
    assert ask(federation.hub, state)[0] == [("away", False)]
    assert ask(federation.hub, COUNT)[0] == [("north", 1)]


def test_a_server_that_is_away_can_be_removed(federation: Federation, west: tuple[Server, str]) -> None:
    federation.add("north")
    federation.federate("add", "west", "--dsn", west[1])
    west[0].stop()
    federation.federate("check", code=1)
    federation.add("south")  # while another is away
    assert ask(federation.hub, COUNT)[0] == [("north", 1), ("south", 1)]
    federation.federate("remove", "west")
    assert ask(federation.hub, COUNT) == ([("north", 1), ("south", 1)], [])


def test_a_server_of_another_version_is_named(federation: Federation) -> None:
    federation.add("north")
    with psycopg.connect(federation.south) as owner:
        owner.execute(
            "DROP VIEW tunnel_shared.leak, tunnel_shared.ring;"
            "CREATE VIEW tunnel_shared.leak AS SELECT current_setting('tunneldb.server', true) AS server, id, survey, 1 AS area"
            " FROM tunnel_api.leak; GRANT SELECT ON tunnel_shared.leak TO tunnel_viewer"
        )
    said = federation.add("south")
    assert "Warning: south lacks leak." in said
    assert "different" in federation.federate("check", code=1)
    rows, _ = ask(
        federation.hub,
        "SELECT server, count(*) > 0, count(area), count(kind) > 0 FROM tunnel_hub.leak GROUP BY server ORDER BY 1",
    )
    assert [row[:2] for row in rows] == [("north", True), ("south", True)]
    assert rows[1][2:] == (0, False)  # area is of another type
    rows, warnings = ask(federation.hub, "SELECT server FROM tunnel_hub.ring GROUP BY server")
    assert (rows, warnings) == ([("north",)], ["server south has no view ring: its rows are missing here"])
    ((message,),), _ = ask(federation.hub, "SELECT message FROM tunnel_hub.server WHERE state = 'different'")
    assert "lacks leak." in str(message)

    with open_connection(federation.south) as connection:
        install(connection, REGISTRY)
        connection.execute("COMMENT ON SCHEMA tunnel_api IS 'Functions and views of tunneldb 9.9.9, 0123456789ab'")
    assert "was upgraded since its views were imported: type tunneldb federate add south" in federation.federate(
        "check", code=1
    )
    federation.federate("add", "south")
    assert "9.9.9 (0123456789ab)" in federation.federate("check")
    assert ask(federation.hub, "SELECT server FROM tunnel_hub.ring GROUP BY server ORDER BY 1")[0] == [("north",), ("south",)]


def test_a_service_goes_on_until_it_is_stopped(federation: Federation) -> None:
    federation.add("north")
    words = [*TUNNELDB, "--dsn", federation.hub, "federate", "check", "--every", "1"]
    with subprocess.Popen(words, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        assert process.stderr.readline() == "1 server; no warnings\n"
        with psycopg.connect(federation.south) as owner:
            owner.execute("COMMENT ON SCHEMA tunnel_api IS 'another'")
        federation.add("south")
        with psycopg.connect(federation.south) as owner:
            owner.execute("COMMENT ON SCHEMA tunnel_api IS 'a third'")
        assert process.stderr.readline().startswith("south is different: was upgraded")
        process.send_signal(signal.SIGTERM)
