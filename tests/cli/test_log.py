"""The log: a JSON object a line, also of workers, with tracebacks; text on standard error by -v; silence by -q."""

from __future__ import annotations

import json
import logging
import os
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any

import click
import psycopg
import pytest
from click.testing import CliRunner, Result
from support.loaded_survey import SURVEY, add_survey

from tunneldb.cli.main import main
from tunneldb.log import VARIABLE, fields, logging_to
from tunneldb.stages.ledger import stage_run
from tunneldb.store.survey import get_survey

TRIED = ("inspect", "no-such-file.las")
WRONG = "no-such-file.las"


def run(*words: str) -> Result:
    return CliRunner().invoke(main, words)


def lines(path: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in path.read_text("utf-8").splitlines()]


def test_a_command_is_logged_from_its_beginning_to_its_end(tmp_path: Path) -> None:
    log = tmp_path / "log"
    assert run("--log", str(log), *TRIED).exit_code == 2
    begun, error, ended = lines(log)
    assert begun["words"] == ["--log", str(log), *TRIED]
    assert (error["level"], WRONG in error["message"]) == ("ERROR", True)
    assert error["traceback"].startswith("Traceback (most recent call last):")
    assert (ended["exit_code"], ended["seconds"] >= 0.0) == (2, True)
    assert {"time", "level", "logger", "process", "message"} <= begun.keys()
    run("--log", str(log), *TRIED, "--json")  # appended
    assert [line["level"] for line in lines(log)] == ["INFO", "ERROR", "INFO"] * 2


def test_libraries_write_to_the_log_and_not_to_the_terminal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(logging.getLogger(), "handlers", [])  # without pytest's own
    for log in (None, tmp_path / "log"):
        with warnings.catch_warnings(), logging_to(log):
            warnings.simplefilter("always")
            logging.getLogger("ezdxf").warning("Found non-unique entity handle")
            warnings.warn("more than one layer found", UserWarning, stacklevel=1)
        assert capsys.readouterr().err == ""
    handle, layers = lines(tmp_path / "log")
    assert (handle["logger"], handle["message"]) == ("ezdxf", "Found non-unique entity handle")
    assert "more than one layer found" in layers["message"]


def test_a_wrong_command_line_and_a_bug_are_logged(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    log = tmp_path / "log"
    run("--log", str(log), "inspect", "--nonsense")
    assert "--nonsense" in lines(log)[1]["message"]

    def broken(*_: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(main, "get_command", lambda *_: click.Command("inspect", callback=broken))
    log.unlink()
    assert isinstance(run("--log", str(log), "inspect").exception, ZeroDivisionError)
    assert "ZeroDivisionError" in lines(log)[1]["traceback"]


@pytest.mark.parametrize("words", [["--dsn", "host=/no password=secret"], ["--dsn=host=/no password=secret"]])
def test_no_password_is_logged(words: list[str], tmp_path: Path) -> None:
    log = tmp_path / "log"
    assert run("--log", str(log), *words, "status").exit_code == 2
    assert "secret" not in log.read_text("utf-8")


def test_verbosity() -> None:
    result = run("-v", *TRIED)
    assert "INFO tunneldb -v inspect" in result.stderr
    assert "Traceback" not in result.stderr
    assert result.stderr.count(WRONG) == 2  # the command line, and the error once
    assert "Traceback" in run("-vv", *TRIED).stderr
    assert run(*TRIED).stderr.startswith("tunneldb: ")
    assert len(run(*TRIED).stderr.splitlines()) == 1


def test_quiet_prints_errors_only(dsn: str, tmp_path: Path) -> None:
    axis = tmp_path / "axis.csv"
    axis.write_text("x,y,z\n0,0,0\n10,0,0\n", encoding="utf-8")
    add = ("tunnel", "add", "{}", "--srid", "local", "--axis", str(axis))
    assert "10.000 m of axis" in run(*(word.format("a") for word in add)).stderr
    log = tmp_path / "log"
    quiet = run("-q", "--log", str(log), *(word.format("b") for word in add))
    assert (quiet.exit_code, quiet.stderr) == (0, "")
    assert any("10.000 m of axis" in line["message"] for line in lines(log))
    assert run("-q", *TRIED).stderr.startswith("tunneldb: ")


def test_a_log_that_cannot_be_written_is_refused() -> None:
    result = run("--log", "/no/such/folder/log", *TRIED)
    assert (result.exit_code, result.stderr) == (
        2, "tunneldb: /no/such/folder/log: the log cannot be written: No such file or directory\n",
    )  # fmt: skip


def test_stages_are_logged(conn: psycopg.Connection, tmp_path: Path) -> None:
    add_survey(conn)
    survey = get_survey(conn, SURVEY)
    conn.commit()
    log = tmp_path / "log"
    with logging_to(log):
        with stage_run(conn, survey.id, 0, "axis", {}) as under_way:
            under_way.counts["vertices"] = 3
        with pytest.raises(ZeroDivisionError), stage_run(conn, survey.id, 0, "axis", {}):
            raise ZeroDivisionError
    begun, done, _, failed = lines(log)
    assert (begun["stage"], begun["km"], begun["message"]) == ("axis", 0, "axis of kilometre 0 begins")
    assert (done["counts"], done["seconds"] >= 0.0) == ({"vertices": 3}, True)
    assert "ZeroDivisionError" in failed["traceback"]


def test_processes_that_are_started_find_the_log(tmp_path: Path) -> None:
    log = tmp_path / "log"
    before = os.environ.get(VARIABLE)
    with logging_to(log):
        command = [sys.executable, "-m", "tunneldb.queue.worker", json.dumps({"threads": 1, "survey": None})]
        environment = os.environ | {"TUNNELDB_DSN": "not a dsn"}
        with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE, env=environment) as worker:
            assert worker.wait(60) != 0
    assert os.environ.get(VARIABLE) == before
    assert log.exists()


def test_names_that_are_not_utf8_can_be_logged(tmp_path: Path) -> None:
    log = tmp_path / "log"
    with logging_to(log):
        logging.getLogger("tunneldb.test").info("%s", os.fsdecode(b"n\xe9"), extra=fields(path=Path("a")))
    assert (lines(log)[0]["message"], lines(log)[0]["path"]) == ("n\udce9", "a")
