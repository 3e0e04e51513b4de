"""``--json`` of every command in the tree of commands: one document on standard output, messages on standard error."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
import pytest
from click.testing import CliRunner

from tunneldb.cli.main import main

NOISY = """
import os, subprocess, sys, click
from tunneldb.cli.main import main
from tunneldb.cli.output import add_to_json, command
from tunneldb.cli import check

@command()
def noisy():
    print("printed")
    click.echo("said")
    os.write(1, b"written\\n")
    subprocess.run(["echo", "from a program"], check=True)
    click.echo("a message", err=True)
    add_to_json(rows=[{"km": 12, "share": float("nan")}])

check.check = noisy
main()
"""
WAIT = {"worker", "serve"}
"""Verbs that go on until they are told to stop."""


def leaves(
    command: click.Command, words: tuple[str, ...], ctx: click.Context
) -> Iterator[tuple[tuple[str, ...], click.Command]]:
    if not isinstance(command, click.Group):
        yield words, command
        return
    for name in command.list_commands(ctx):
        found = command.get_command(ctx, name)
        assert found is not None
        yield from leaves(found, (*words, name), ctx)


def verbs() -> dict[tuple[str, ...], click.Command]:
    return {words: verb for words, verb in leaves(main, (), click.Context(main)) if words != ("psql",)}


def document(words: list[str]) -> tuple[dict[str, Any], str]:
    """The document that a command line prints, which must be all of standard output, and what it says on standard error."""
    done = CliRunner().invoke(main, words)
    assert done.exception is None or isinstance(done.exception, SystemExit), (words, done.exception)
    said = json.loads(done.stdout, parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))
    assert (said["exit_code"], said["ok"]) == (done.exit_code, done.exit_code == 0), words
    return said, done.stderr


def test_every_verb_takes_it() -> None:
    assert len(verbs()) > 45
    assert [words for words, verb in verbs().items() if not any("--json" in option.opts for option in verb.params)] == []


def test_a_line_that_is_wrong_is_answered_by_a_document() -> None:
    for words in verbs():
        said, errors = document([*words, "--no-such-option", "--json"])
        assert (said["command"], said["exit_code"]) == (" ".join(words), 2)
        assert "--no-such-option" in said["error"]
        assert said["error"] in errors
    for line in (
        ["--json"],
        ["--no-such-option", "leaks", "x", "--json"],
        ["no-such-verb", "--json"],
        ["survey", "nonesuch", "--json"],
    ):
        said, errors = document(line)
        assert said["exit_code"] == 2
        assert said["error"] in errors


def given(parameter: click.Parameter, nowhere: str) -> str:
    """A value that the command line takes for a parameter, of a thing that there is not."""
    if isinstance(parameter.type, click.Choice):
        return str(parameter.type.choices[0])
    if isinstance(parameter.type, click.DateTime):
        return "2024-05-04"
    return {"--srid": "25830", "--radius": "0.07", "--up": "+z", "--water-level": "1"}.get(parameter.opts[0], nowhere)


def test_every_verb_answers_with_a_document_on_an_empty_database(
    dsn: str, tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of things that there are not most say so; lists are empty, and done is done."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").touch()
    nowhere = str(tmp_path / "file" / "x")
    good = set()
    for words, verb in verbs().items():
        if words[0] in WAIT:
            continue
        line = [*words]
        for parameter in verb.params:
            if isinstance(parameter, click.Argument):
                line.append(given(parameter, nowhere))
            elif parameter.required:
                line += [parameter.opts[0], given(parameter, nowhere)]
        said, errors = document([*line, "--json"])
        assert " ".join(words).startswith(said["command"])  # of a group that is refused as a whole, the group
        assert ("error" in said) is (said["exit_code"] == 2), said
        assert said.get("error", "") in errors
        good |= {words} if said["ok"] else set()
    assert good >= {("init",), ("tunnel", "list"), ("survey", "list"), ("stop",), ("check",)}
    assert capfd.readouterr().out == ""


def test_nothing_else_comes_to_standard_output() -> None:
    done = subprocess.run([sys.executable, "-c", NOISY, "check", "--json"], capture_output=True, text=True, check=True)
    assert json.loads(done.stdout)["rows"] == [{"km": 12, "share": None}]
    assert done.stderr == "a message\n"
    plain = subprocess.run([sys.executable, "-c", NOISY, "check"], capture_output=True, text=True, check=True)
    assert sorted(plain.stdout.splitlines()) == ["from a program", "printed", "said", "written"]
