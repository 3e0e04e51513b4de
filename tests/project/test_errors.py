"""Errors by their class, for callers of the API, and by exit code 2 and one line, for users of the command line."""

from __future__ import annotations

from pathlib import Path

import psycopg
import pytest
from click.testing import CliRunner
from support.loaded_survey import SURVEY, add_survey

from tunneldb.cli.main import main
from tunneldb.database.failures import describe_failure
from tunneldb.errors import BusyError, InputError, NotReadyError, UserError
from tunneldb.pointcloud.reader import read_header
from tunneldb.stages.ledger import stage_run
from tunneldb.stages.parameters import settings
from tunneldb.store.surface import load_surface
from tunneldb.store.survey import get_survey


def refused(*words: str) -> str:
    """Run a command that ends with exit code 2, and return its line on standard error."""
    result = CliRunner().invoke(main, words)
    assert result.exit_code == 2, result.output
    assert isinstance(result.exception, SystemExit)  # no traceback
    return result.stderr


def test_all_are_errors_that_the_user_can_fix() -> None:
    assert all(issubclass(kind, UserError) for kind in (InputError, NotReadyError, BusyError))


def test_a_file_that_cannot_be_read_is_an_input_error(tmp_path: Path) -> None:
    path = tmp_path / "scan.las"
    path.write_bytes(b"no scan")
    with pytest.raises(InputError, match="truncated, corrupt or not a LAS"):
        read_header(path)
    assert "truncated, corrupt or not a LAS" in refused("inspect", str(path))


def test_a_value_out_of_bounds_is_an_input_error() -> None:
    with pytest.raises(InputError, match="out of bounds"):
        settings(["axis.half_width=99"])


def test_a_stage_that_was_not_run_is_a_not_ready_error(conn: psycopg.Connection) -> None:
    add_survey(conn)
    with pytest.raises(NotReadyError, match="no sections yet: tunneldb run s --to sections"):
        load_surface(conn, get_survey(conn, SURVEY), 0.0, 10.0)
    assert "holds no points yet: tunneldb load s FILE..." in refused("run", SURVEY)


def test_another_run_at_work_is_a_busy_error(conn: psycopg.Connection, dsn: str) -> None:
    add_survey(conn)
    survey = get_survey(conn, SURVEY)
    conn.commit()
    with psycopg.connect(dsn) as other:
        other.execute("SELECT pg_advisory_xact_lock(%s, 0)", [survey.id])
        with (
            pytest.raises(BusyError, match="another process is at work on kilometre 0"),
            stage_run(conn, survey.id, 0, "axis", {}),
        ):
            pass


@pytest.mark.parametrize(
    "error",
    [
        psycopg.errors.InternalError_("cache lookup failed for function 18709\nPL/pgSQL function …"),
        psycopg.errors.UndefinedTable("relation with OID 18709 does not exist"),
    ],
)
def test_functions_that_init_replaces_under_a_stage_are_no_bug(error: psycopg.Error) -> None:
    """As a stage meets them that runs while `tunneldb init` makes the functions anew."""
    message = describe_failure(error)
    assert message is not None
    assert message.startswith("tunneldb init replaced the functions, the current work was rolled back: ")
    assert message.endswith("; run it again")
    assert describe_failure(psycopg.errors.UndefinedTable('relation "tunnel.nothing" does not exist')) is None


def test_a_survey_that_another_program_removes_is_no_bug(conn: psycopg.Connection, monkeypatch: pytest.MonkeyPatch) -> None:
    """As a report meets it that has found the survey, and then asks for its leaks."""
    add_survey(conn)
    conn.commit()
    found = get_survey(conn, SURVEY)
    monkeypatch.setattr("tunneldb.cli.report.get_survey", lambda *args, **kwargs: found)
    conn.execute("DELETE FROM tunnel.survey")
    conn.commit()
    result = CliRunner().invoke(main, ["report", SURVEY, "-o", "a.html", "--from", "980", "--to", "990"])
    assert (result.exit_code, len(result.stderr.splitlines())) == (2, 1), result.output
    assert "another program removed it, the current work was rolled back: there is no survey" in result.stderr
