"""Target spheres through the real commands: simulated files, database, report, control points."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import psycopg
import pytest
from support.command import command
from support.databases import Copies

from tunneldb.simulate import Parameters, Simulation, write

NAME = "t"
START = 990.0
"""The end of a kilometre lies in the middle of it."""


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Simulation]:
    folder = tmp_path_factory.mktemp("spheres")
    simulation = Simulation(
        Parameters(
            name=NAME, length=20.0, section="horseshoe", seed=3, slope=2.0, start_chainage=START, station_spacing=7.0,
            angular_step=0.22, leaks=1, people=1, bollards=1, globes=1, spheres=6,
        )
    )  # fmt: skip
    write(simulation, folder)
    return folder, simulation


@pytest.fixture(scope="module")
def template(copies: Copies, template: str, survey: tuple[Path, Simulation]) -> Iterator[str]:
    """The scan, loaded."""
    folder, _ = survey

    def fill() -> None:
        command("tunnel", "add", NAME, "--srid", 25830, "--axis", folder / f"{NAME}.axis.csv", "--start-chainage", START)
        add(folder, NAME)
        command("load", NAME, *sorted(folder.glob("*.laz")))

    with copies.prepared(template, fill) as name:
        yield name


def add(folder: Path, name: str) -> None:
    """Add a survey of the tunnel."""
    command(
        "survey", "add", name, "--tunnel", NAME, "--date", "2024-05-04", "--stations", folder / f"{NAME}.stations.csv",
        "--intensity-kind", "none",
    )  # fmt: skip


@pytest.fixture
def loaded(survey: tuple[Path, Simulation], dsn: str) -> tuple[Path, Simulation]:
    return survey


def stored(conn: psycopg.Connection) -> list[tuple]:
    rows = conn.execute(
        "SELECT number, scan_id, km, chainage, x, y, z, radius, nominal, sigma, coverage, points, segment"
        " FROM tunnel_api.target_sphere ORDER BY number, scan_id"
    ).fetchall()
    conn.rollback()
    return rows


def nearest(row: tuple, simulation: Simulation) -> tuple[int, float]:
    gaps = [float(np.linalg.norm(np.array(row[4:7]) - sphere.centre)) for sphere in simulation.spheres]
    return int(np.argmin(gaps)), min(gaps)


def test_spheres_of_a_survey(loaded: tuple[Path, Simulation], conn: psycopg.Connection, tmp_path: Path) -> None:
    """Rows are true spheres only, a number each, along the tunnel, over the end of a kilometre; nothing is applied."""
    folder, simulation = loaded
    report = tmp_path / "report.md"
    said = command(
        "spheres", NAME, "--radius", 0.0725, "--control", folder / f"{NAME}.spheres.csv", "--report", report
    ).output  # fmt: skip
    rows = stored(conn)
    number_of: dict[int, int] = {}
    for row in rows:
        true, error = nearest(row, simulation)
        assert error < 0.003
        assert error < 4 * row[9]
        assert number_of.setdefault(row[0], true) == true
        assert row[2] == int(simulation.tunnel.unroll(np.array([row[4:7]])).chainage[0] // 1000)
        assert row[3] is None
    assert {row[2] for row in rows} == {0, 1}
    assert len(set(number_of.values())) == len(number_of)
    assert sorted(number_of) == list(range(1, len(number_of) + 1))
    chainages = simulation.tunnel.unroll(np.array([simulation.spheres[number_of[n]].centre for n in sorted(number_of)]))
    assert np.all(np.diff(chainages.chainage) > -0.02)
    assert len(number_of) >= 4
    assert len({row[1] for row in rows}) > 1

    assert f"{len(number_of)} of 6 control points matched by their places" in said
    text = report.read_text("utf-8")
    for heading in ("## Spheres", "## Control points", "## Between scans"):
        assert heading in text
    assert "not applied" in text

    command("run", NAME, "--to", "sections")
    command("spheres", NAME, "--radius", 0.0725)
    again = stored(conn)
    assert [row[:3] + row[4:12] for row in again] == [row[:3] + row[4:12] for row in rows]
    for row in again:
        expected = simulation.tunnel.unroll(np.array([row[4:7]])).chainage[0]
        assert row[3] == pytest.approx(expected, abs=0.05)
        assert row[12] is not None
    counts = conn.execute("SELECT counts, outcome FROM tunnel.run WHERE stage = 'spheres' ORDER BY id").fetchall()
    conn.rollback()
    assert [outcome for _, outcome in counts] == ["done", "done"]
    assert counts[0][0]["rows"] == len(rows)


def test_control_in_another_frame_and_short_of_points(
    loaded: tuple[Path, Simulation], conn: psycopg.Connection, tmp_path: Path
) -> None:
    folder, _ = loaded
    with (folder / f"{NAME}.spheres.csv").open(encoding="utf-8") as file:
        points = [(row["id"], np.array([float(row[axis]) for axis in "xyz"])) for row in csv.DictReader(file)]
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])

    def control(chosen: list[tuple[str, np.ndarray]]) -> Path:
        path = tmp_path / "control.csv"
        path.write_text("id,x,y,z\n" + "".join(f"{name},{x:.5f},{y:.5f},{z:.5f}\n" for name, (x, y, z) in chosen))
        return path

    local = [(name, turn @ (place - points[0][1]) + 100.0) for name, place in points]
    said = command("spheres", NAME, "--radius", 0.0725, "--control", control(local)).output
    assert "matched by their distances among themselves" in said
    assert "+90.0" in said
    numbers = {row[0] for row in stored(conn)}
    seen = next(p for p in points if min(np.linalg.norm(np.array(row[4:7]) - p[1]) for row in stored(conn)) < 0.01)
    said = command("spheres", NAME, "--radius", 0.0725, "--control", control([seen, ("far", seen[1] + 50.0)])).output
    assert "a rotation cannot be determined" in said
    assert "Control points without a sphere: far." in said
    assert {row[0] for row in stored(conn)} == numbers


def test_what_is_wrong_is_said_and_changes_nothing(
    loaded: tuple[Path, Simulation], conn: psycopg.Connection, tmp_path: Path
) -> None:
    folder, _ = loaded
    command("spheres", NAME, "--radius", 0.0725)
    before = stored(conn)
    assert before
    bad = tmp_path / "control.csv"
    bad.write_text("id,x,y,z\nA,1,2,3\nB,4,5,six\n")
    for arguments, said in (
        (["--control", bad], f"{bad}, line 3: z is 'six', not a number"),
        (["--control", tmp_path / "none.csv"], "none.csv"),
        (["--report", tmp_path / "no" / "report.md"], "there is no folder"),
        (["--tolerance", 0.02], "--tolerance 0.02 is too much for a radius of 0.0725 m"),
    ):
        output = command("spheres", NAME, "--radius", 0.0725, *arguments, code=2).output
        assert said in output
        assert len(output.strip().splitlines()) == 1
    command("spheres", "nobody", "--radius", 0.0725, code=2)
    command("spheres", NAME, code=2)
    command("spheres", NAME, "--radius", 7, code=2)
    (scan,) = folder.glob("*.laz")
    aside = scan.rename(tmp_path / scan.name)
    try:
        assert "is gone since it was loaded" in command("spheres", NAME, "--radius", 0.0725, code=2).output
    finally:
        aside.rename(scan)
    assert stored(conn) == before


def test_spheres_of_a_radius_that_there_is_none_of(loaded: tuple[Path, Simulation], conn: psycopg.Connection) -> None:
    assert "0 target spheres" in command("spheres", NAME, "--radius", 0.15).output
    assert stored(conn) == []


def test_nothing_is_loaded(loaded: tuple[Path, Simulation]) -> None:
    add(loaded[0], "empty")
    assert "holds no points yet" in command("spheres", "empty", "--radius", 0.0725, code=2).output
