"""init, status, check, psql, server: what an administrator types."""

from __future__ import annotations

import importlib.metadata
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import psycopg
import pytest
from click.testing import CliRunner, Result
from psycopg.conninfo import make_conninfo

from tunneldb.cli.main import COMMANDS, main
from tunneldb.database.server import Server

pytestmark = pytest.mark.slow

TUNNELDB = [sys.executable, "-c", "from tunneldb.cli.main import main; main()"]


def run(*arguments: str) -> Result:
    return CliRunner().invoke(main, [*arguments])


@pytest.fixture
def home(monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A home without a server, and no DSN."""
    folder = Path(tempfile.mkdtemp(prefix="tunneldb-cli-"))
    monkeypatch.setenv("TUNNELDB_HOME", str(folder))
    monkeypatch.delenv("TUNNELDB_DSN", raising=False)
    yield folder
    Server(folder).stop()
    shutil.rmtree(folder)


def test_every_verb_can_be_imported_and_has_help() -> None:
    for name in COMMANDS:
        if name != "psql":  # --help is psql's own
            result = run(name, "--help")
            assert result.exit_code == 0, name
            assert result.output.startswith("Usage: ")
            assert "<=None" not in result.output, name


def test_help_imports_no_verb() -> None:
    program = (
        "import sys, tunneldb.cli.main as m\n"
        "try: m.main(['--help'])\n"
        "except SystemExit: pass\n"
        "print([name for name in ('numpy', 'psycopg', 'numba') if name in sys.modules])"
    )
    output = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout
    assert output.endswith("[]\n")


@pytest.mark.parametrize(
    "words",
    ["survey list", "tunnel list", "status", "leaks {}", "findings {}", "sections {}", "rating {}", "elements list demo",
     "actions list demo", "alarms demo", "profile list demo", "spots {}", "prune"],
)  # fmt: skip
def test_a_list_imports_no_library_that_computes(words: str, example: str) -> None:
    """Each would cost 0.1 to 0.5 s of a command that takes 0.5 s."""
    program = (
        "import sys, tunneldb.cli.main as m\n"
        "try: m.main(sys.argv[1:])\n"
        "except SystemExit: pass\n"
        "print([name for name in ('numba', 'scipy.ndimage', 'scipy.spatial', 'pyproj', 'pyogrio', 'laspy', 'xlsxwriter')"
        " if name in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, *words.format(example).split()], capture_output=True, text=True, check=True
    )
    assert done.stdout.endswith("[]\n"), done


def test_where_nothing_compiled_can_be_kept_one_line_says_what_to_do(tmp_path: Path) -> None:
    """As for a user without a home whose tunneldb root has installed: Numba finds no folder that it may write to."""
    nowhere = dict.fromkeys(["HOME", "XDG_CACHE_HOME"], "/proc/no") | {"NUMBA_CACHE_LOCATOR_CLASSES": "UserWideCacheLocator"}
    command = [*TUNNELDB, "simulate", str(tmp_path / "scan"), "--preset", "small"]
    done = subprocess.run(command, env=os.environ | nowhere, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert re.fullmatch(r"tunneldb: .* set NUMBA_CACHE_DIR to a folder of your own\n", done.stderr)


def test_without_a_dsn_everything_starts_by_itself(home: Path) -> None:
    environment = os.environ | {"TUNNELDB_HOME": str(home), "LESS": ""}

    def tunneldb(*arguments: str) -> str:
        result = subprocess.run([*TUNNELDB, *arguments], env=environment, capture_output=True, text=True, check=False)
        return f"{result.returncode} {result.stdout}{result.stderr}"

    assert tunneldb("server", "status").startswith("0 absent")
    assert "tunneldb init" in tunneldb("status")
    assert "schema tunnel created" in tunneldb("init")
    assert "is up to date" in tunneldb("init")
    assert tunneldb("psql", "-At", "-c", "SELECT tunnel_api.chainage_label(12345.678)") == "0 12+345.678\n"
    del environment["LESS"]
    assert tunneldb("psql", "-c", r"\! printenv LESS") == "0 FRX\n"  # a short answer does not wait for the pager's q
    assert "✓ disk" in tunneldb("check")
    assert tunneldb("server", "status").startswith("0 running")
    assert "stopped" in tunneldb("server", "stop")
    assert "was not running" in tunneldb("server", "stop")
    assert str(home) in tunneldb("server", "start")


def test_the_embedded_server_is_not_meant_when_a_dsn_is_given(dsn: str) -> None:
    result = run("server", "stop")
    assert result.exit_code == 2
    assert "DSN" in result.stderr


def test_check_says_what_is_missing_and_what_mends_it(empty_dsn: str) -> None:
    def check(code: int) -> str:
        result = run("--dsn", empty_dsn, "check")
        assert result.exit_code == code, result.output
        return result.output

    output = check(1)
    assert "✗ PostGIS" in output
    assert "tunneldb init" in output
    with psycopg.connect(empty_dsn) as connection:
        connection.execute("CREATE EXTENSION postgis")
    assert "✗ schema tunnel: missing" in check(1)
    assert run("--dsn", empty_dsn, "init").exit_code == 0
    assert "✗" not in check(0)
    with psycopg.connect(empty_dsn) as connection:
        connection.execute("COMMENT ON SCHEMA tunnel_api IS 'Functions and views of tunneldb 0.0.9, abc'")
    assert "✗ schema tunnel_api: not this program's" in check(1)
    with psycopg.connect(empty_dsn) as connection:
        connection.execute("UPDATE tunnel.alembic_version SET version_num = '9999'")
    assert "newer than this program" in check(1)


def test_check_sees_an_audit_that_is_open(dsn: str, conn: psycopg.Connection) -> None:
    assert "✓ audit" in run("check").output
    conn.execute("ALTER TABLE tunnel_audit.entry DISABLE TRIGGER append_only")
    conn.commit()
    result = run("check")
    assert result.exit_code == 1
    assert "✗ audit" in result.output
    mend = next(line.strip() for line in result.output.splitlines() if "ENABLE TRIGGER" in line)
    conn.execute(mend.encode())
    conn.execute("ALTER TABLE tunnel_audit.entry ENABLE REPLICA TRIGGER append_only")  # on, but not for what people do
    conn.commit()
    assert "✗ audit" in run("check").output
    conn.execute(mend.encode())
    conn.execute("ALTER TABLE tunnel_audit.entry OWNER TO tunnel_operator")
    conn.commit()
    result = run("check")
    assert (result.exit_code, "✗ audit" in result.output) == (1, True)
    conn.execute(next(line.strip() for line in result.output.splitlines() if "OWNER TO" in line).encode())
    conn.commit()
    assert run("check").exit_code == 0


@pytest.mark.parametrize("person", ["otto"], indirect=True)
def test_check_is_for_operators_too(person: psycopg.Connection, dsn: str, conn: psycopg.Connection) -> None:
    result = run("--dsn", make_conninfo(dsn, user="otto"), "check")
    assert result.exit_code == 0, result.output
    assert "✓ audit" in result.output
    conn.execute("DROP TABLE tunnel_audit.entry CASCADE")
    conn.commit()
    result = run("--dsn", make_conninfo(dsn, user="otto"), "check")
    assert (result.exit_code, "✗ audit" in result.output) == (1, True), result.output


@pytest.mark.parametrize("person", ["otto"], indirect=True)
def test_check_reports_triggers_that_are_not_the_projects(person: psycopg.Connection, dsn: str) -> None:
    """Of an operator, also one that takes the place and the name of the project's own."""
    assert "✓ triggers" in run("check").output
    body = "RETURNS trigger LANGUAGE plpgsql AS 'BEGIN RETURN NEW; END'"
    for name, table in (("mine", "point"), ("drop_points", "survey")):
        person.execute(f"DROP FUNCTION IF EXISTS tunnel.{name} CASCADE".encode())
        person.execute(f"CREATE FUNCTION tunnel.{name}() {body}".encode())
        person.execute(
            f"CREATE TRIGGER {name} BEFORE INSERT ON tunnel.{table} FOR EACH ROW EXECUTE FUNCTION tunnel.{name}()".encode()
        )
    for by in (dsn, make_conninfo(dsn, user="otto")):
        result = run("--dsn", by, "check")
        assert (result.exit_code, result.output.count("✗ triggers")) == (1, 2), result.output
        assert "mine on tunnel.point is not tunneldb's" in result.output
    for mend in [line.strip() for line in result.output.splitlines() if "DROP TRIGGER" in line]:
        person.execute(mend.encode())
    output = run("check").output
    assert "is not tunneldb's" not in output
    assert "drop_points on tunnel.survey is missing" in output  # its function went with the operator's DROP


def test_check_names_what_waits_and_what_is_stale(example: str, conn: psycopg.Connection) -> None:
    assert example not in run("check").output
    conn.execute("UPDATE tunnel_api.axis_vertex SET geom = ST_Translate(geom, 0, 0, 0.1) WHERE n = 1240")
    conn.execute(
        "INSERT INTO tunnel.incoming (survey_id, name, path, bytes, points, km_from, km_to, failed_at, message)"
        " SELECT id, 'b.laz', '/b.laz', 1, 1, 12, 12, now(), 'b.laz is cut off' FROM tunnel.survey"
    )
    conn.commit()
    output = run("check").output
    assert f"tunneldb run {example} --stale" in output
    assert "b.laz is cut off" in output


def test_check_of_a_server_that_is_down(tmp_path: Path) -> None:
    result = run("--dsn", make_conninfo(host=str(tmp_path)), "check")
    assert result.exit_code == 1
    assert "✗ server: cannot connect" in result.output


def test_a_server_that_is_down_is_one_line(tmp_path: Path) -> None:
    result = run("--dsn", make_conninfo(host=str(tmp_path)), "status")
    assert result.exit_code == 2
    assert result.stderr.startswith("tunneldb: cannot connect")
    assert result.stderr.count("\n") == 1


def test_status_of_all_surveys_counts_kilometres_by_stage(example: str) -> None:
    result = run("status")
    assert result.exit_code == 0
    lines = [line.split() for line in result.output.splitlines()]
    assert lines[0][-7:] == ["km", "load", "axis", "segments", "sections", "ground", "detect"]
    assert lines[1] == [example, "demo", "2024-05-04", "1", "60", "12+300.000", "12+500.000", *"1111111"]
    assert len(lines) == 2


def test_status_of_a_survey(example: str) -> None:
    lines = [line.split() for line in run("status", example).output.splitlines()]
    assert [example, "demo", "2024-05-04", "1", "60", "12+300.000", "12+500.000"] in lines
    assert lines[-1] == ["12", *["done"] * 6]
    unknown = run("status", "other")
    assert unknown.exit_code == 2
    assert example in unknown.stderr


def test_status_shows_a_run_whose_program_is_gone(example: str, conn: psycopg.Connection, dsn: str) -> None:
    with psycopg.connect(dsn) as worker:
        worker.execute(
            """
            INSERT INTO tunnel.run (survey_id, km, stage, backend_pid, backend_start)
            SELECT s.id, 12, 'axis', pid, backend_start FROM tunnel.survey s, pg_stat_activity WHERE pid = pg_backend_pid()
            """
        )
        worker.commit()
        assert "running" in run("status", example).output
        pid = worker.info.backend_pid
    while conn.execute("SELECT 1 FROM pg_stat_activity WHERE pid = %s", [pid]).fetchone():
        conn.rollback()
        time.sleep(0.02)
    assert "interrupted" in run("status", example).output
    assert f"tunneldb run {example} --km 12 --from axis" in run("check").output


def test_a_bug_keeps_its_traceback(monkeypatch: pytest.MonkeyPatch, dsn: str) -> None:
    monkeypatch.setattr("tunneldb.cli.status.get_survey", lambda *_, **__: 1 / 0)
    result = run("status", "x")
    assert isinstance(result.exception, ZeroDivisionError)


def test_the_database_of_somebody_without_rights_is_one_line(dsn: str) -> None:
    with psycopg.connect(dsn, autocommit=True) as connection:
        connection.execute("DO $$ BEGIN CREATE ROLE stranger LOGIN; EXCEPTION WHEN duplicate_object THEN END $$")
    result = run("--dsn", make_conninfo(dsn, user="stranger"), "status")
    assert result.exit_code == 2
    assert result.stderr.count("\n") == 1
    assert "Traceback" not in result.stderr


def test_the_wheel_brings_both_folders() -> None:
    installed = importlib.metadata.distribution("tunneldb")
    files = {str(file) for file in installed.files or ()}
    if "tunneldb/__init__.py" not in files:
        pytest.skip("tunneldb is installed from a checkout, not from a wheel")
    root = Path(__file__).parents[2]
    assert not Path(sys.modules["tunneldb"].__file__ or "").is_relative_to(root / "tunneldb")
    for folder, inside in (("sql", "_sql"), ("migrations", "_migrations")):
        for path in (root / folder).rglob("*"):
            if path.suffix in {".sql", ".txt", ".py", ".mako"}:
                packed = Path("tunneldb", inside, path.relative_to(root / folder))
                assert str(packed) in files
                assert Path(str(installed.locate_file(packed))).read_bytes() == path.read_bytes()
    assert not [file for file in files if file.startswith(("tests/", "benchmarks/"))]


def test_a_password_on_the_command_line_is_warned_of(dsn: str, monkeypatch: pytest.MonkeyPatch) -> None:
    secret = make_conninfo(dsn, password="swordfish")
    said = run("--dsn", secret, "status").stderr
    assert "all users of this machine can read the password in --dsn" in said
    assert "swordfish" not in said
    assert "password" not in run("--dsn", dsn, "status").stderr
    monkeypatch.setenv("TUNNELDB_DSN", secret)
    assert "password" not in run("status").stderr
