"""Malformed files, hostile words, extreme values, sources without end: a right result, or exit code 2 and one line.

`make fuzz` for more than a glance, with a table.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import click
import numpy as np
import psycopg
import pytest
from click.testing import CliRunner
from support.fuzz.cases import OF_FILES, OF_WORDS, UNTRIED, command_of, verb_of
from support.fuzz.run import Outcome, table
from support.fuzz.seeds import write_seeds

from tunneldb.cli.main import COMMANDS, main
from tunneldb.store.surface import load_surface
from tunneldb.store.survey import get_survey


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


def test_each_verb_and_each_file_is_tried() -> None:
    """A command, or an option that takes a file, which is new has to be put into the tables of cases."""
    named = {"new": "n", "stretch": "", "out": "o", "seeds": "s", "file": "FILE"}
    of_files = [command.format(**named).split() for _, command in OF_FILES]
    of_words = {verb_of(command.format(**named).split()) for command in OF_WORDS}
    assert not of_words & set(UNTRIED)
    assert of_words | set(UNTRIED) == set(_commands())
    # the file stands after an option, or as an argument
    read = {(verb_of(words), _option(words)) for words in of_files}
    assert read == {(verb, name) for verb, command in _commands().items() for name in _files_of(verb, command)}


def _commands() -> dict[str, click.Command]:
    verbs = {}
    for name in COMMANDS:
        command = main.get_command(click.Context(main), name)
        assert command is not None
        group = command.commands if isinstance(command, click.Group) else {"": command}
        verbs |= {f"{name} {sub}".strip(): one for sub, one in group.items()}
    return verbs


WRITTEN = {"-o", "--output", "--report", "--picture", "--pictures", "--axis-out", "--images"}
TEXTS_OF_FILES = {("tunnel add", "--axis"), ("survey set", "--reference"), ("members", ""), ("profile add", "")}
"""Values that may be a file, or else a word."""


def _files_of(verb: str, command: click.Command) -> set[str]:
    names = {"" if isinstance(p, click.Argument) else p.opts[0] for p in command.params if isinstance(p.type, click.Path)}
    names |= {name for of, name in TEXTS_OF_FILES if of == verb}
    return set() if verb.startswith("simulate") else names - WRITTEN - {"--photos"}  # a folder is written; photos are in one


def _option(words: list[str]) -> str:
    place = words.index("FILE")
    option = next((p for p in command_of(words).params if isinstance(p, click.Option) and words[place - 1] in p.opts), None)
    return "" if option is None or option.is_flag else option.opts[0]


def test_what_is_wrong_is_said_in_one_line(people: None, conn: psycopg.Connection, dsn: str, tmp_path: Path) -> None:
    axis = np.array(
        conn.execute("SELECT ST_X(geom), ST_Y(geom), ST_Z(geom) FROM tunnel_api.axis_vertex ORDER BY n").fetchall(), dtype=float
    )
    write_seeds(tmp_path, axis, load_surface(conn, get_survey(conn, "demo-2024"), 12_000, 13_000))
    conn.close()  # what is copied must be in nobody's use
    of_scans = ["--intensity", "intensity", "--intensity-kind", "linear"]
    for name, kind in (("scan-2024", "stations"), ("walk-2024", "trajectory")):
        poses = ["--date", "2024-05-04", f"--{kind}", str(tmp_path / f"{kind}.csv"), *of_scans]
        _done("survey", "add", name, "--tunnel", "demo", *poses)
    _done("survey", "export", "demo-2024", "-o", str(tmp_path / "survey.tdb"))
    command = ["--seeds", str(tmp_path)]
    for name, given in (("CASES", "100"), ("SECONDS", "8"), ("SEED", "1"), ("FIRST", "0"), ("RIGHT", "6")):
        command += [f"--{name.lower()}", os.environ.get(name, given)]
    done = subprocess.run(
        [sys.executable, "-m", "support.fuzz.run", *command],
        env=os.environ | {"TUNNELDB_DSN": dsn, "PYTHONPATH": os.pathsep.join([str(Path(__file__).parents[1]), *sys.path])},
        stdout=subprocess.PIPE, text=True, check=True,
    )  # fmt: skip
    if kept := os.environ.get("OUTCOMES"):
        Path(kept).write_text(done.stdout, encoding="utf-8")
    outcomes = [Outcome(**one) for one in json.loads(done.stdout)]
    allowed = {"right": (0, 1, 3, 4, 5), "refused": (2,)}
    wrong = [f"{one.command}: {one.said}{one.fault}" for one in outcomes if one.code not in allowed.get(one.kind, (one.code,))]
    assert not wrong, "\n".join(wrong)
    print(table(outcomes, "kind"), table(outcomes, "verb"), sep="\n\n")
    assert {one.code for one in outcomes} >= {0, 2}
    faults = [f"{one.number}: {one.command} ({one.wrong}): {one.fault}" for one in outcomes if one.fault]
    assert not faults, "\n".join(faults)


def _done(*words: str) -> None:
    result = CliRunner().invoke(main, words)
    assert result.exit_code == 0, result.stderr
