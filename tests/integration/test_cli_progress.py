"""Bars: on a terminal with rate and time left, beside results that go where they are sent; nothing of it in a pipe."""

from __future__ import annotations

import os
import pty
import re
import subprocess
import sys
from pathlib import Path

import psycopg
import pytest
from loading import SURVEY, add_survey, tube, write

TUNNELDB = [sys.executable, "-c", "from tunneldb.cli.main import main; main()"]


def on_a_terminal(*words: object) -> tuple[str, str]:
    """Run a verb whose standard error is a terminal of 100 columns, and standard output a pipe; returns both."""
    ours, theirs = pty.openpty()
    environment = os.environ | {"TERM": "xterm-256color", "COLUMNS": "100"}
    with subprocess.Popen(
        [*TUNNELDB, *map(str, words)], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=theirs, env=environment
    ) as process:
        os.close(theirs)
        shown = bytearray()
        while True:
            try:
                read = os.read(ours, 4096)
            except OSError:  # so a terminal ends on Linux
                break
            if not read:
                break
            shown += read
        assert process.stdout is not None
        output = process.stdout.read()
        assert process.wait() == 0, shown.decode()
    os.close(ours)
    return re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", shown.decode()), output.decode()


@pytest.fixture
def survey(conn: psycopg.Connection, tmp_path: Path) -> Path:
    """A survey, and a file that is to be loaded into it: large enough for a bar to move."""
    add_survey(conn)
    return write(tmp_path / "s.laz", tube(1000, 1025, 3000, seed=1))


def test_a_bar_shows_rate_and_time_left_and_leaves_the_pipe_to_results(survey: Path, conn: psycopg.Connection) -> None:
    shown, output = on_a_terminal("load", SURVEY, survey)
    assert re.search(r"s\.laz\S* .*[0-9] points/s|million points/s", shown)
    assert re.search(r"[0-9]+:[0-9]{2}:[0-9]{2} left", shown)
    assert "s.laz" in output
    assert not re.search(r"\x1b|━|left", output)
    shown, output = on_a_terminal("run", SURVEY, "--to", "segments", "--km", "1")
    assert re.search(r"\[[12]/2\] (axis|segments) km 1", shown)  # a stage may end before it is drawn
    assert re.search(r"stages/(s|min|h) ", shown)
    assert [line.split(":")[0] for line in output.splitlines()] == ["[1/2] axis km 1", "[2/2] segments km 1"]
    shown, output = on_a_terminal("spheres", SURVEY, "--radius", 0.07, "--json")
    assert "points/s" in shown
    assert output.startswith("{")


def test_a_pipe_gets_no_bar(survey: Path) -> None:
    for words in (["load", SURVEY, str(survey)], ["run", SURVEY, "--to", "axis"], ["spheres", SURVEY, "--radius", "0.07"]):
        done = subprocess.run([*TUNNELDB, *words], capture_output=True, text=True, check=True)
        assert done.stderr == ""
        assert not re.search(r"\x1b|\r|━| left", done.stdout)
