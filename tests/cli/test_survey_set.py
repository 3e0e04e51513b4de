"""`tunneldb survey set`, and what it makes stale; positions and intensities that cannot be."""

from __future__ import annotations

from pathlib import Path

import laspy
import numpy as np
import psycopg
import pytest
from click.testing import Result
from support.command import command

from tunneldb.simulate import Parameters, Simulation, write

NAME = "short"
START = 1200.0


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp(NAME)
    scene = Parameters(
        name=NAME, section="circular", length=30.0, start_chainage=START, straight=0.0, scanner="profiler", density=100.0,
        leaks=0, appendages=False, niches=False,
    )  # fmt: skip
    write(Simulation(scene), folder)
    return folder


def add(folder: Path, *more: object, trajectory: Path | None = None, code: int = 0) -> Result:
    command("tunnel", "add", NAME, "--srid", 25830, "--axis", folder / f"{NAME}.axis.csv", "--start-chainage", START)
    poses = trajectory or folder / f"{NAME}.trajectory.csv"
    return command("survey", "add", NAME, "--tunnel", NAME, "--date", "2024-05-04", "--trajectory", poses, *more, code=code)


def stale(conn: psycopg.Connection) -> dict[str, str]:
    rows = conn.execute("SELECT stage, reason FROM tunnel_api.stage_status WHERE stale").fetchall()
    conn.rollback()
    return dict(rows)


def settings(conn: psycopg.Connection) -> tuple[object, ...]:
    row = conn.execute(
        "SELECT date::text, intensity_kind, intensity_dimension, reference, platform FROM tunnel.survey"
    ).fetchone()
    conn.rollback()
    assert row is not None
    return tuple(row)


def test_what_is_set_makes_detection_stale_and_nothing_else(folder: Path, conn: psycopg.Connection, tmp_path: Path) -> None:
    add(folder, "--intensity", "Amplitude", "--intensity-kind", "amplitude", "--reference", folder / f"{NAME}.reference.csv")
    command("load", NAME, *folder.glob("*.laz"))
    coarse = "--set", "image.pixel=0.1"
    command("run", NAME, *coarse)
    assert stale(conn) == {}
    command("survey", "set", NAME, "--date", "2024-05-05")
    assert stale(conn) == {}
    said = command("survey", "set", NAME, "--trajectory", folder / f"{NAME}.trajectory.csv").stderr
    assert stale(conn) == {"detect": "positions, reference or intensity set since"}
    assert f"1 stage is stale: tunneldb run {NAME} --stale" in said
    command("run", NAME, "--stale", *coarse)
    assert stale(conn) == {}
    command("survey", "set", NAME, "--reference", "auto")
    assert settings(conn) == ("2024-05-05", "amplitude", "Amplitude", "auto", "mobile")
    said = command("survey", "set", NAME, "--intensity", "intensity", "--intensity-kind", "linear").stderr
    assert "1 file has to be loaded again" in said
    assert "was changed since it was loaded; load it again" in command("run", NAME, "--stale", code=2).stderr
    assert "replaced" in command("load", NAME, *folder.glob("*.laz")).output
    assert settings(conn)[1:3] == ("linear", "intensity")
    before = settings(conn)
    bad = tmp_path / "bad.csv"
    bad.write_text("range_m,intensity_db\n1,2\n1,3\n")
    assert (
        "line 3: range_m 1 repeats" in command("survey", "set", NAME, "--date", "2020-01-01", "--reference", bad, code=2).stderr
    )
    assert "nothing to set" in command("survey", "set", NAME, code=2).stderr
    assert settings(conn) == before


@pytest.mark.parametrize(
    ("scale", "says"),
    [(500.0, "are too far from zero to be dB"), (1 / 50.0, "are fractions of 1, not dB of a lining")],
    ids=["counts", "unit"],
)
def test_values_that_are_no_decibels_are_refused_as_such(
    folder: Path, conn: psycopg.Connection, tmp_path: Path, scale: float, says: str
) -> None:
    (path,) = folder.glob("*.laz")
    las = laspy.read(path)
    las.Amplitude = las.Amplitude * scale
    las.write(tmp_path / "a.laz")
    add(folder, "--intensity", "Amplitude", "--intensity-kind", "amplitude", "--reference", "auto")
    line = command("load", NAME, tmp_path / "a.laz", code=2).stderr.strip().splitlines()[-1]
    assert "Amplitude is no intensity of kind amplitude" in line
    assert says in line
    assert conn.execute("SELECT count(*) FROM tunnel.scan_file").fetchone() == (0,)


def test_a_saturated_scan_is_loaded_and_every_result_says_so(folder: Path, conn: psycopg.Connection, tmp_path: Path) -> None:
    (path,) = folder.glob("*.laz")
    las = laspy.read(path)
    las.Amplitude = np.minimum(las.Amplitude, np.quantile(las.Amplitude, 0.75))
    las.write(tmp_path / "a.laz")
    add(folder, "--intensity", "Amplitude", "--intensity-kind", "amplitude", "--reference", "auto")
    assert "the scan is saturated" in command("load", NAME, tmp_path / "a.laz").stderr
    ((said,),) = conn.execute("SELECT said FROM tunnel_api.remarks((SELECT id FROM tunnel.survey))").fetchall()
    share, _, rest = said.removeprefix("a.laz: ").partition(" % of the intensities are the greatest value")
    assert float(share) == pytest.approx(25.0, abs=2.0)
    assert rest


def test_poses_that_cannot_be_are_left_out_and_told(folder: Path, conn: psycopg.Connection, tmp_path: Path) -> None:
    rows = np.genfromtxt(folder / f"{NAME}.trajectory.csv", delimiter=",", skip_header=1)
    rows[len(rows) // 2, 1:] = 0.0
    path = tmp_path / "poses.csv"
    np.savetxt(path, rows, "%.4f", ",", header="time,x,y,z", comments="")
    said = add(folder, "--intensity-kind", "none", trajectory=path).stderr
    assert f"1 of {len(rows)} poses left out, where no scanner can have been: the first in line {len(rows) // 2 + 2}" in said
    assert conn.execute("SELECT count(*) FROM tunnel.pose").fetchone() == (len(rows) - 1,)
    # and every result says it
    remarks = conn.execute("SELECT said FROM tunnel_api.remarks((SELECT id FROM tunnel.survey))").fetchall()
    assert [text.partition(" poses")[0] for (text,) in remarks] == ["scanner positions: 1 of " + str(len(rows))]


def test_a_station_that_cannot_be_is_refused_by_its_number(folder: Path, conn: psycopg.Connection, tmp_path: Path) -> None:
    rows = np.genfromtxt(folder / f"{NAME}.trajectory.csv", delimiter=",", skip_header=1)[::20]
    rows[:, 0] = np.arange(len(rows))
    rows[1, 1:3] += 30.0 / np.sqrt(2) * np.array([1.0, -1.0])
    path = tmp_path / "stations.csv"
    np.savetxt(path, rows, "%.4f", ",", header="scan_id,x,y,z", comments="")
    command("tunnel", "add", NAME, "--srid", 25830, "--axis", folder / f"{NAME}.axis.csv", "--start-chainage", START)
    arguments = (
        "survey",
        "add",
        NAME,
        "--tunnel",
        NAME,
        "--date",
        "2024-05-04",
        "--stations",
        path,
        "--intensity-kind",
        "none",
    )
    line = command(*arguments, code=2).stderr.strip()
    assert "the station of scan_id 1 is" in line
    assert conn.execute("SELECT count(*) FROM tunnel.survey").fetchone() == (0,)


@pytest.mark.parametrize(("separator", "point"), [(";", ","), ("\t", "."), (" ", ".")])
def test_tables_may_have_other_separators(
    folder: Path, conn: psycopg.Connection, tmp_path: Path, separator: str, point: str
) -> None:
    """What is stored is the same, whichever separates the columns of trajectory and reference."""

    def stored() -> list[object]:
        tables = ("SELECT time, ST_AsText(geom) FROM tunnel.pose ORDER BY 1", "SELECT * FROM tunnel.reference ORDER BY 2")
        found: list[object] = [[row[-2:] for row in conn.execute(query).fetchall()] for query in tables]
        conn.rollback()
        return found

    kind = ("--intensity", "Amplitude", "--intensity-kind", "amplitude")
    add(folder, *kind, "--reference", folder / f"{NAME}.reference.csv")
    expected = stored()
    assert all(expected)
    for name in ("trajectory", "reference"):
        text = (folder / f"{NAME}.{name}.csv").read_text()
        (tmp_path / f"{name}.csv").write_text(text.replace(",", separator).replace(".", point))
    command("survey", "remove", NAME, "--yes")
    command(
        "survey", "add", NAME, "--tunnel", NAME, "--date", "2024-05-04", "--trajectory", tmp_path / "trajectory.csv", *kind,
        "--reference", tmp_path / "reference.csv",
    )  # fmt: skip
    assert stored() == expected
