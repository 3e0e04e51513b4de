"""Values as JSON, rates as text, and help as a manual: each example is a command line that the program takes."""

from __future__ import annotations

import datetime as dt
import json
import os
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path

import click
import numpy as np
import pytest
from click.testing import CliRunner
from shapely.geometry import Point

from tunneldb.cli import output
from tunneldb.cli.main import COMMANDS, EXAMPLES, main
from tunneldb.cli.output import Command, plain
from tunneldb.cli.progress import rate
from tunneldb.errors import UserError
from tunneldb.stages.parameters import check_together, settings


def verbs() -> Iterator[tuple[str, click.Command]]:
    """All commands, those of groups by two words; psql's command line is its own."""
    context = click.Context(main)
    for name in COMMANDS:
        command = main.get_command(context, name)
        assert command is not None
        if isinstance(command, click.Group):
            yield from ((f"{name} {part}", child) for part, child in command.commands.items())
        elif name != "psql":
            yield name, command


@pytest.mark.parametrize(("name", "command"), [pytest.param(*verb, id=verb[0]) for verb in verbs()])
def test_each_verb_has_examples_that_are_right(name: str, command: click.Command) -> None:
    assert isinstance(command, Command)
    lines = [line for line in "\n".join(command.examples).replace("\\\n", " ").split("\n") if line.startswith("tunneldb ")]
    assert lines or name == "server start"
    for line in lines:
        words = shlex.split(line, comments=True)
        words = words[3:] if words[1] == "--dsn" else words[1:]
        assert words[: len(name.split())] == name.split(), line
        context = command.make_context(name, words[len(name.split()) :])  # raises on what the verb does not take
        settings(context.params.get("assignments", ()))  # raises on what is no parameter


def test_the_examples_of_the_program_are_right() -> None:
    for line in EXAMPLES:
        words = shlex.split(line.partition("|")[0])[1:]
        command = main.get_command(click.Context(main), words[0])
        assert command is not None
        command.make_context(words[0], words[1:])


def test_help_reads_as_a_manual() -> None:
    whole = CliRunner().invoke(main, ["--help"]).output
    for said in ("Exit codes:", "Environment:", "TUNNELDB_DSN", "TUNNELDB_HOME", "Examples:"):
        assert said in whole
    of_verb = CliRunner().invoke(main, ["batch", "--help"]).output
    assert "\n  tunneldb batch pajares-2026 --km 3-7 --retry-failed\n" in of_verb
    assert of_verb.index("Options:") < of_verb.index("Examples:") < of_verb.index("Exit codes:")
    assert "  1  something failed" in of_verb


@dataclass(frozen=True)
class Thing:
    place: Path
    length: Decimal
    day: dt.date
    values: np.ndarray


def test_what_a_verb_tells_becomes_json() -> None:
    thing = Thing(Path("a/b"), Decimal("1.50"), dt.date(2024, 5, 4), np.array([1.0, np.nan, np.inf]))
    told = {"thing": thing, 12: (np.int64(3), True, None), "at": Point(1, 2), "for": dt.timedelta(seconds=90), "km": range(2)}
    assert json.loads(json.dumps(plain(told), allow_nan=False)) == {
        "thing": {"place": "a/b", "length": 1.5, "day": "2024-05-04", "values": [1.0, None, None]},
        "12": [3, True, None],
        "at": {"type": "Point", "coordinates": [1.0, 2.0]},
        "for": 90.0,
        "km": [0, 1],
    }


def test_names_that_are_not_utf8_can_be_told() -> None:
    name = os.fsdecode(b"n\xe9.laz")
    told = plain({"file": Path("a") / name, name: [name]})
    assert json.loads(json.dumps(told, ensure_ascii=False).encode()) == {"file": "a/n?.laz", "n?.laz": ["n?.laz"]}


def test_numbers_keep_all_their_digits() -> None:
    number = 512_345.678_901_234
    assert json.loads(json.dumps(plain({"x": np.float64(number)})))["x"] == number


@pytest.mark.parametrize(
    ("speed", "unit", "text"),
    [
        (2_340_000.0, "points", "2.3 million points/s"), (12_345.6, "points", "12 346 points/s"), (0.05, "km", "3.0 km/min"),
        (0.01, "stages", "36.0 stages/h"), (0.0, "km", ""), (None, "km", ""),
    ],
)  # fmt: skip
def test_rates(speed: float | None, unit: str, text: str) -> None:
    assert rate(speed, unit) == text


def test_a_wrong_command_line_is_told_in_json_too() -> None:
    for words, verb in (
        (["leaks", "--json"], "leaks"),
        (["leaks", "s", "--nonsense", "--json"], "leaks"),
        (["no", "--json"], None),
    ):
        result = CliRunner().invoke(main, words)
        said = json.loads(result.stdout)
        assert (result.exit_code, said["ok"], said["exit_code"], said["command"]) == (2, False, 2, verb)
        assert said["error"] in result.stderr


def test_a_survey_may_have_the_name_of_a_verb() -> None:
    result = CliRunner().invoke(main, ["--dsn", "host=/nowhere", "report", "psql", "-o", "psql.doc", "--json"])
    assert (result.exit_code, json.loads(result.stdout)["command"]) == (2, "report")


def test_parameters_are_checked_together() -> None:
    with pytest.raises(UserError, match="half_width must not exceed"):
        check_together(settings() | {"section.half_width": 2.0, "section.max_half_width": 1.0})


def test_a_line_of_an_error_is_one_line_of_a_readable_length() -> None:
    """Names in files may hold line breaks that forge lines, control sequences, or be thousands."""
    assert output.error_line("a\ntunneldb: forged \x1b[31m\r\u202e") == r"tunneldb: a\ntunneldb: forged \x1b[31m\r\u202e"
    names = ", ".join(f"column{n}" for n in range(100_000))
    line = output.error_line(f"a.csv: no column x: the header is {names}; name it x")
    assert len(line) < 2100
    assert line.startswith("tunneldb: a.csv: no column x: the header is column0, ")
    assert line.endswith("column99999; name it x")
