"""Settings of roles, databases and PGOPTIONS, and encodings of terminals, that change no output and end no command."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
import zipfile
from pathlib import Path
from typing import Any

import psycopg
import pytest
from click.testing import CliRunner
from psycopg import sql

from tunneldb.cli.main import main

SURVEY = "demo-2024"
HOSTILE = {
    "DateStyle": "German, DMY",
    "IntervalStyle": "sql_standard",
    "TimeZone": "Asia/Kathmandu",
    "client_encoding": "LATIN1",
    "extra_float_digits": "-15",
    "bytea_output": "escape",
    "standard_conforming_strings": "off",
    "search_path": "pg_catalog",
    "quote_all_identifiers": "on",
    "transform_null_equals": "on",
    "default_transaction_isolation": "serializable",
}


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


def outputs(folder: Path) -> list[Any]:
    """Answers of commands, without the seconds that they took."""
    answers: list[Any] = []
    for command in (["status", SURVEY], ["leaks", SURVEY], ["findings", SURVEY], ["tunnel", "list"], ["check"]):
        result = CliRunner().invoke(main, [*command, "--json"])
        assert result.exit_code in (0, 1), (command, result.output)
        told = json.loads(result.stdout)
        answers.append({key: value for key, value in told.items() if key not in ("seconds", "now", "waits", "findings")})
    result = CliRunner().invoke(main, ["export", SURVEY, "-o", str(folder / "survey.gpkg")])
    assert result.exit_code in (0, 1), result.output
    return answers


@pytest.mark.slow
def test_a_clock_that_is_set_back_prevents_no_file(example: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """ZIP states times from 1980 on."""
    local = time.localtime
    monkeypatch.setattr(time, "localtime", lambda seconds=None: local(1000 if seconds is None else seconds))
    monkeypatch.setattr(time, "time", lambda: 1000.0)
    for words in (["qgis", example, "-o"], ["survey", "export", example, "-o"], ["leaks", example, "-o"]):
        path = tmp_path / {"qgis": "a.qgz", "survey": "a.tdb", "leaks": "a.xlsx"}[words[0]]
        result = CliRunner().invoke(main, [*words, str(path)])
        assert result.exit_code == 0, result.exception
        with zipfile.ZipFile(path) as archive:
            assert archive.testzip() is None


def test_settings_of_others_change_no_output(conn: psycopg.Connection, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("plain", "database", "options"):
        (tmp_path / name).mkdir()
    expected = outputs(tmp_path / "plain")
    for name, value in HOSTILE.items():
        conn.execute(
            sql.SQL("ALTER DATABASE {} SET {} = {}").format(sql.Identifier(conn.info.dbname), sql.Identifier(name), value)
        )
    conn.commit()
    assert outputs(tmp_path / "database") == expected
    monkeypatch.setenv("PGOPTIONS", " ".join(f"-c {name}={value.replace(' ', '')}" for name, value in HOSTILE.items()))
    assert outputs(tmp_path / "options") == expected


@pytest.mark.parametrize(
    "environment", [{"PYTHONIOENCODING": "ascii"}, {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}]
)
@pytest.mark.slow
def test_a_terminal_without_the_characters_gets_their_codes(dsn: str, environment: dict[str, str]) -> None:
    for command in (["leaks", SURVEY], ["status", SURVEY], ["--help"]):
        done = subprocess.run(
            [sys.executable, "-c", "from tunneldb.cli.main import main; main()", *command],
            env=os.environ | environment, capture_output=True, timeout=120, check=False,
        )  # fmt: skip
        assert done.returncode in (0, 1), done.stderr
        assert b"Traceback" not in done.stderr
