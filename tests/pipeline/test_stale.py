"""`tunneldb run --stale`: after a vertex is moved it runs exactly what is stale, in order, as it was made."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import psycopg
import pytest
from support.command import command
from support.databases import Copies

from tunneldb.simulate import Parameters, Simulation, write

NAME = "curve"
MOVE = "UPDATE tunnel_api.axis_vertex SET geom = ST_Translate(geom, 0, 0, 0.05) WHERE n = %s"
STALE = "SELECT stage, km FROM tunnel_api.stage_status WHERE stale ORDER BY step, km"


@pytest.fixture(scope="module")
def scans(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """220 m of a tunnel at survey density, over a kilometre's border."""
    folder = tmp_path_factory.mktemp("scans")
    parameters = Parameters(
        name=NAME, section="circular", seed=3, length=220.0, start_chainage=890.0, scanner="profiler", density=25.0, leaks=0
    )
    write(Simulation(parameters), folder)
    return folder


@pytest.fixture(scope="module")
def prepared(copies: Copies, template: str, scans: Path) -> Iterator[str]:
    """A database brought to sections of two widths, to be copied: those of kilometre 0 have other parameters."""

    def fill() -> None:
        command("tunnel", "add", NAME, "--srid", 25830, "--axis", scans / f"{NAME}.axis.csv", "--start-chainage", 890)
        command(
            "survey", "add", NAME, "--tunnel", NAME, "--date", "2024-05-04",
            "--trajectory", scans / f"{NAME}.trajectory.csv", "--intensity", "Amplitude", "--intensity-kind", "reflectance",
        )  # fmt: skip
        command("load", NAME, *sorted(scans.glob("*.laz")))
        command("run", NAME, "--to", "segments")
        command("run", NAME, "--from", "sections", "--to", "sections", "--km", 0, "--set", "section.half_width=0.4")
        command("run", NAME, "--from", "sections", "--to", "sections", "--km", 1)

    with copies.prepared(template, fill) as name:
        yield name


@pytest.fixture
def surveyed(copies: Copies, prepared: str) -> Iterator[psycopg.Connection]:
    """Connection to a copy, in autocommit."""
    with copies.connected(prepared) as conn:
        conn.autocommit = True
        yield conn


def runs(conn: psycopg.Connection, since: int) -> list[tuple[Any, ...]]:
    return conn.execute("SELECT stage, km, outcome FROM tunnel.run WHERE id > %s ORDER BY id", [since]).fetchall()


def last_run(conn: psycopg.Connection) -> int:
    (number,) = conn.execute("SELECT max(id) FROM tunnel.run").fetchone()  # type: ignore[misc]
    assert isinstance(number, int)
    return number


def test_exactly_what_is_stale_runs_in_order(surveyed: psycopg.Connection) -> None:
    conn, since = surveyed, last_run(surveyed)
    assert "nothing of curve is stale" in command("run", NAME, "--stale").output
    # 930 m: far enough from the border that the next kilometre's segments stay, yet its sections rest on them
    conn.execute(MOVE, [93])
    stale = [("segments", 0), ("sections", 0), ("sections", 1)]
    assert conn.execute(STALE).fetchall() == stale
    former = conn.execute("SELECT id FROM tunnel.segment WHERE km = 1 ORDER BY n").fetchall()
    command("run", NAME, "--stale")
    assert runs(conn, since) == [(stage, km, "done") for stage, km in stale]
    assert conn.execute(STALE).fetchall() == []
    assert conn.execute("SELECT count(*) FROM tunnel_api.segment WHERE stale").fetchone() == (0,)
    assert conn.execute("SELECT id FROM tunnel.segment WHERE km = 1 ORDER BY n").fetchall() == former
    assert conn.execute("SELECT source FROM tunnel.axis_vertex WHERE n = 93").fetchone() == ("edited",)


def test_each_keeps_the_parameters_that_it_had(surveyed: psycopg.Connection) -> None:
    conn = surveyed
    widths = (
        "SELECT km, max((parameters ->> 'section.half_width')::float8) FROM tunnel.run "
        "WHERE id > %s AND stage = 'sections' GROUP BY 1"
    )
    default = dict(conn.execute(widths, [0]).fetchall())[1]
    conn.execute(MOVE, [100])
    since = last_run(conn)
    command("run", NAME, "--stale")
    assert dict(conn.execute(widths, [since]).fetchall()) == {0: 0.4, 1: default}
    since = last_run(conn)
    conn.execute(MOVE, [100])
    command("run", NAME, "--stale", "--set", "section.half_width=0.3")
    assert dict(conn.execute(widths, [since]).fetchall()) == {0: 0.3, 1: 0.3}
    since = last_run(conn)
    conn.execute(MOVE, [100])
    result = command("run", NAME, "--stale", "--set", "section.max_half_width=0.2", code=2)
    assert "sections of kilometre 0" in result.stderr, "0.3 m is kept, and wider"
    assert runs(conn, since) == []


def test_part_of_it_can_be_chosen_but_not_before_points_that_wait(surveyed: psycopg.Connection) -> None:
    conn = surveyed
    conn.execute(MOVE, [100])
    since = last_run(conn)
    command("run", NAME, "--stale", "--km", 1, "--to", "segments")
    assert runs(conn, since) == [("segments", 1, "done")]
    conn.execute("UPDATE tunnel.file_km SET read_at = clock_timestamp(), loaded_at = NULL WHERE km = 0")
    since = last_run(conn)
    result = command("run", NAME, "--stale", code=2)
    assert result.stderr.count("\n") == 1
    assert f"tunneldb batch {NAME}" in result.stderr
    assert runs(conn, since) == []


def test_a_segment_stays_stale_when_only_those_of_the_next_kilometre_are_made_anew(surveyed: psycopg.Connection) -> None:
    """The last plane of kilometre 0 turns with a vertex of kilometre 1, whose segments know where it is now."""
    conn = surveyed
    conn.execute(MOVE, [101])
    segments = "SELECT n FROM tunnel_api.segment WHERE stale ORDER BY n"
    assert conn.execute(segments).fetchall() == [(99,), (100,), (101,), (102,)]
    command("run", NAME, "--from", "segments", "--to", "segments", "--km", 1)
    assert conn.execute(segments).fetchall() == [(99,)]
    assert ("segments", 0) in conn.execute(STALE).fetchall()
    command("run", NAME, "--from", "segments", "--to", "segments", "--km", 0)
    assert conn.execute(segments).fetchall() == []


def test_a_vertex_that_is_moved_back_leaves_all_as_it_is(surveyed: psycopg.Connection) -> None:
    conn = surveyed
    conn.execute(MOVE, [100])
    conn.execute(MOVE.replace("0.05", "-0.05"), [100])
    assert conn.execute("SELECT count(*) FROM tunnel_api.segment WHERE stale").fetchone() == (0,)
    assert conn.execute(STALE).fetchall() == []
