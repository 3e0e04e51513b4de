"""Bars: on a terminal with rate and time left, beside results that go where they are sent; nothing of it in a pipe."""

from __future__ import annotations

import os
import pty
import re
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import laspy
import psycopg
import pytest
from click.testing import CliRunner
from pyproj import CRS
from support.command import command
from support.loaded_survey import SURVEY, add_survey, tube, write

from tunneldb.cli.main import main

pytestmark = pytest.mark.slow

TUNNELDB = [sys.executable, "-c", "from tunneldb.cli.main import main; main()"]


def on_a_terminal(*words: object, program: Sequence[str] = TUNNELDB, output_too: bool = False) -> tuple[str, str]:
    """Run a command whose standard error is a terminal of 100 columns, and standard output a pipe unless it is there, too."""
    ours, theirs = pty.openpty()
    environment = os.environ | {"TERM": "xterm-256color", "COLUMNS": "100"}
    with subprocess.Popen(
        [*program, *map(str, words)],
        stdin=subprocess.DEVNULL,
        stdout=theirs if output_too else subprocess.PIPE,
        stderr=theirs,
        env=environment,
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
        output = b"" if process.stdout is None else process.stdout.read()
        assert process.wait() == 0, shown.decode()
    os.close(ours)
    return re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", shown.decode()), output.decode()


@pytest.fixture
def survey(conn: psycopg.Connection, tmp_path: Path) -> Path:
    """A survey, and a file that is to be loaded into it: large enough for a bar to move."""
    add_survey(conn)
    path = write(tmp_path / "s.laz", tube(1000, 1025, 3000, seed=1))
    las = laspy.read(path)
    las.header.add_crs(CRS(25830))
    las.write(path)
    return path


def test_a_bar_shows_rate_and_time_left_and_leaves_the_pipe_to_results(survey: Path, conn: psycopg.Connection) -> None:
    shown, output = on_a_terminal("load", SURVEY, survey)
    assert re.search(r"s\.laz\S* .*[0-9] points/s|million points/s", shown)
    assert re.search(r"[0-9]+:[0-9]{2}:[0-9]{2} left", shown)
    assert "s.laz" in output
    assert not re.search(r"\x1b|━|[0-9] left", output)
    shown, output = on_a_terminal("run", SURVEY, "--to", "segments", "--km", "1")
    assert re.search(r"\[[12]/2\] (axis|segments) km 1", shown)  # a stage may end before it is drawn
    assert re.search(r"stages/(s|min|h) ", shown)
    assert [line.split(":")[0] for line in output.splitlines()] == ["[1/2] axis km 1", "[2/2] segments km 1"]
    shown, output = on_a_terminal("spheres", SURVEY, "--radius", 0.07, "--json")
    assert "points/s" in shown
    assert output.startswith("{")


def test_lines_are_printed_above_the_bar_and_not_into_it(survey: Path) -> None:
    command("load", SURVEY, survey)
    shown, _ = on_a_terminal("run", SURVEY, "--to", "segments", output_too=True)
    for line in (r"\[1/2\] axis km 1: vertices: ", r"\[2/2\] segments km 1: [0-9]+ segments? with"):
        assert re.search(rf"(^|[\r\n]){line}", shown)
    assert not re.search(r"left\[", shown)


def test_the_bar_of_simulate_shows_the_time_left(tmp_path: Path) -> None:
    shown, output = on_a_terminal("simulate", tmp_path, "--preset", "small", "--density", 900, "--no-truth")  # three blocks
    assert re.search(r"scanning .*[0-9] (million )?points/s [0-9]+:[0-9]{2}:[0-9]{2} left", shown)
    assert re.search(r"^[0-9,]+ points, ", output)


def test_a_pipe_gets_no_bar(survey: Path) -> None:
    for words in (["load", SURVEY, str(survey)], ["run", SURVEY, "--to", "axis"], ["spheres", SURVEY, "--radius", "0.07"]):
        done = subprocess.run([*TUNNELDB, *words], capture_output=True, text=True, check=True)
        assert done.stderr == ""
        assert not re.search(r"\x1b|\r|━|[0-9] left", done.stdout)


def test_what_is_written_and_compared_shows_it_too(
    example: str, conn: psycopg.Connection, chromium: Path, tmp_path: Path
) -> None:
    conn.execute(
        "INSERT INTO tunnel.station (survey_id, scan_id, geom) SELECT s.id, v.n, v.geom"
        "  FROM tunnel.survey s, tunnel.axis_vertex v WHERE v.n % 5 = 0"
    )
    conn.commit()
    truth = tmp_path / "truth.gpkg"
    assert CliRunner().invoke(main, ["leaks", example, "-o", str(truth)]).exit_code == 0
    for verb, words, expected in (
        ("export", ["-o", tmp_path / "x.gpkg"], "parts/"),
        ("export", ["-o", tmp_path / "x.dxf"], "parts/"),
        ("evaluate", [truth], "leaks/"),
        ("report", ["-o", tmp_path / "x.pdf"], "strips/"),
    ):
        shown, output = on_a_terminal(verb, example, *words)
        assert re.search(rf"[0-9] (million )?{expected}(s|min)", shown), (verb, shown)
        assert re.search(r"[0-9]+:[0-9]{2}:[0-9]{2} left", shown), (verb, shown)
        assert not re.search(r"\x1b|━|left", output)
    assert "printing" in shown
    scan = write(tmp_path / "t.laz", tube(1000, 1005, 1000, seed=1))
    how = ("--intensity", "Amplitude", "--intensity-kind", "amplitude", "--scanner", 500032.5, 4500000, 100)
    shown, output = on_a_terminal("intensity", scan, *how)
    assert re.search(r"t\.laz [^%]*100% [0-9 ]+(\.[0-9] million )?points/s 0:00:00 left", shown)
    assert not re.search(r"\x1b|━|left", output)


COMPILES = """
from numba import njit
from tunneldb.cli import progress
progress._PATIENCE = 0.05
with progress.bar("points") as bar:
    bar.add_task("x", total=1)
    bar.refresh()
    if {first}:
        njit(lambda x: [y for y in x if y > 2.0])([1.0, 2.0, 3.0])
    bar.refresh()
"""


@pytest.mark.parametrize("first", [True, False])
def test_that_it_compiles_is_said_once(first: bool) -> None:
    shown, output = on_a_terminal(program=[sys.executable, "-c", COMPILES.format(first=first)])
    assert shown.count("compiling, on first use only") == first
    assert output == ""


def test_a_pipe_does_not_hear_that_it_compiles() -> None:
    done = subprocess.run([sys.executable, "-c", COMPILES.format(first=True)], capture_output=True, text=True, check=True)
    assert done.stdout + done.stderr == ""


NAMED = """
from tunneldb.cli.progress import bar, step
with bar("points") as shown:
    step(shown)("[red]a\\x1b]0;owned\\x07\\n.laz", 1)(1)
    shown.refresh()
"""


def test_a_name_is_shown_as_it_is() -> None:
    shown, _ = on_a_terminal(program=[sys.executable, "-c", NAMED])
    assert r"[red]a\x1b]0;owned\x07\n.laz" in shown
    assert "\x07" not in shown
