"""Scanner positions that do not fit the points: each is one line, and what it says to type works."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import laspy
import numpy as np
import psycopg
import pytest
from click.testing import CliRunner
from support.command import errors_of
from support.loaded_survey import LENGTH, ORIGIN, START, tube, write

from tunneldb.cli.main import main
from tunneldb.pointcloud.clock_offsets import WEEK

GPS = 1_400_000_000.0  # s
ALONG = np.array([1.0, 0.0, 0.0])
STOOD = 60.0  # s before and after


def typed(message: str) -> None:
    """Do what a message says first."""
    errors_of(*shlex.split(re.findall(r": tunneldb ([^;]+)", message.strip())[0]))


def table(path: Path, header: str, rows: np.ndarray) -> Path:
    np.savetxt(path, rows, "%.6f", ",", header=header, comments="")
    return path


def trajectory(path: Path, seconds: float = 0.0, scale: float = 1.0, aside: float = 0.0) -> Path:
    """A trolley at 1 m/s through the tunnel, that stood before and after."""
    time = np.arange(-STOOD, LENGTH + STOOD, 0.1)
    along = np.clip(time, 0.0, LENGTH)
    xyz = ORIGIN + np.column_stack([along, 0.0 * along + aside, 0.0 * along])
    return table(path, "time,x,y,z", np.column_stack([(GPS + time + seconds) * scale, xyz]))


@pytest.fixture
def folder(conn: psycopg.Connection, tmp_path: Path) -> Path:
    """A tunnel, and a scan of it from a trolley."""
    axis = table(tmp_path / "axis.csv", "x,y,z", np.array([ORIGIN, ORIGIN + LENGTH * ALONG]))
    errors_of("tunnel", "add", "t", "--srid", 25830, "--axis", axis, "--start-chainage", START)
    path = write(tmp_path / "a.laz", tube(START, START + LENGTH, 20, seed=1))
    las = laspy.read(path)
    las.gps_time = np.asarray(las.gps_time) + GPS
    las.write(path)
    return tmp_path


def add(kind: str, path: Path, *more: object, code: int = 0) -> str:
    return errors_of(
        "survey", "add", "s", "--tunnel", "t", "--date", "2024-05-04", kind, path, "--intensity-kind", "none", *more, code=code
    )


@pytest.mark.parametrize(
    ("seconds", "cause", "option"),
    [
        (-18.0, "in UTC, the file in GPS time", "18"),
        (37.0, "in TAI, the file in UTC", "-37"),
        (-3600.0, "a time zone", "3600"),
        (-2314 * WEEK, "in seconds of the GPS week, the file in GPS time", "1399507200"),
    ],
)
def test_the_advised_time_offset_works(folder: Path, conn: psycopg.Connection, seconds: float, cause: str, option: str) -> None:
    add("--trajectory", trajectory(folder / "t.csv", seconds))
    said = errors_of("load", "s", folder / "a.laz", code=2)
    assert cause in said
    assert re.search(rf": tunneldb survey set s --time-offset {option}(; or load it as it is: .*)?$", said)
    typed(said)
    errors_of("load", "s", folder / "a.laz")
    assert conn.execute("SELECT time_offset FROM tunnel_api.survey").fetchone() == (float(option),)
    remark = f"{float(option):+.12g} s added to the times of the trajectory (--time-offset)"
    assert [row[0] for row in conn.execute("SELECT remark FROM tunnel_api.remark WHERE stage = 'survey'")] == [remark]
    assert conn.execute("SELECT pose_note FROM tunnel.scan_file").fetchone() == (None,)
    conn.rollback()


def test_a_time_offset_that_is_wrong_is_corrected_and_removed(folder: Path, conn: psycopg.Connection) -> None:
    add("--trajectory", trajectory(folder / "t.csv"), "--time-offset", 37)
    typed(errors_of("load", "s", folder / "a.laz", code=2))
    assert conn.execute("SELECT time_offset, positions_note FROM tunnel.survey").fetchone() == (0.0, None)
    conn.rollback()
    errors_of("load", "s", folder / "a.laz")


def test_times_in_milliseconds_are_divided_as_it_says(folder: Path) -> None:
    add("--trajectory", trajectory(folder / "t.csv", -GPS + 5000.0, 1000.0))
    las = laspy.read(folder / "a.laz")
    las.gps_time = np.asarray(las.gps_time) - GPS + 5000.0
    las.write(folder / "a.laz")
    said = errors_of("load", "s", folder / "a.laz", code=2)
    factor = re.search(r"in milliseconds: divide them by (\d+)$", said.strip())
    assert factor is not None
    errors_of("survey", "set", "s", "--trajectory", trajectory(folder / "t.csv", -GPS + 5000.0, 1000.0 / int(factor[1])))
    errors_of("load", "s", folder / "a.laz")


def test_a_parallel_tunnel_is_refused(folder: Path) -> None:
    add("--trajectory", trajectory(folder / "t.csv", aside=15.0))
    assert "13 m outside the section that the points show" in errors_of("load", "s", folder / "a.laz", code=2)


@pytest.mark.parametrize("order", ["measured", "sorted"])
def test_the_end_of_the_week_is_taken(folder: Path, conn: psycopg.Connection, order: str) -> None:
    shift = WEEK - GPS - 30.0
    path = trajectory(folder / "t.csv", shift)
    rows = np.loadtxt(path, delimiter=",", skiprows=1)
    rows[:, 0] %= WEEK
    table(path, "time,x,y,z", rows if order == "measured" else rows[np.argsort(rows[:, 0])])
    las = laspy.read(folder / "a.laz")
    las.gps_time = (np.asarray(las.gps_time) + shift) % WEEK
    las.write(folder / "a.laz")
    assert "the GPS week ends during the trajectory" in add("--trajectory", path)
    errors_of("load", "s", folder / "a.laz")
    assert conn.execute("SELECT unposed, pose_note FROM tunnel.scan_file").fetchone() == (0, None)
    conn.rollback()
    said = errors_of("survey", "set", "s", "--time-offset", 18, code=2)
    assert "the positions do not fit the loaded points: " in said
    assert said.endswith("; or set them as they are: add --accept-poses\n")
    errors_of("survey", "set", "s", "--time-offset", 18, "--accept-poses")
    assert "set as they are (--accept-poses)" in str(conn.execute("SELECT positions_note FROM tunnel.survey").fetchone())
    conn.rollback()
    errors_of("survey", "set", "s", "--time-offset", 0)
    assert "as they are" not in str(conn.execute("SELECT positions_note FROM tunnel.survey").fetchone())
    conn.rollback()
    assert "--time-offset" not in str(conn.execute("SELECT positions_note FROM tunnel.survey").fetchone())
    conn.rollback()
    las.gps_time = (np.asarray(las.gps_time) - 30.0) % WEEK + 30.0  # a scan whose seconds go on after the week's end
    las.write(folder / "a.laz")
    errors_of("load", "s", folder / "a.laz")


def test_what_is_no_trajectory_has_no_time_offset(folder: Path) -> None:
    stations = table(folder / "s.csv", "scan_id,x,y,z", np.array([[1, *ORIGIN]]))
    assert "--time-offset is about a trajectory" in add("--stations", stations, "--time-offset", 18, code=2)
    add("--stations", stations)
    assert "survey s has none" in errors_of("survey", "set", "s", "--time-offset", 18, code=2)


def two_scans(folder: Path) -> tuple[Path, np.ndarray]:
    """A file of two scans, and their stations."""
    places = np.array([[1, *(ORIGIN + 15.0 * ALONG)], [2, *(ORIGIN + 45.0 * ALONG)]])
    parts = [tube(START + low, START + low + 20.0, 20, seed=1) for low in (5.0, 35.0)]
    path = write(folder / "b.laz", np.concatenate(parts))
    las = laspy.read(path)
    las.point_source_id = np.repeat([1, 2], [len(part) for part in parts])
    las.write(path)
    return path, places


def remark(conn: psycopg.Connection, stage: str = "load") -> str:
    (row,) = conn.execute("SELECT remark FROM tunnel_api.remark WHERE stage = %s", [stage]).fetchall()
    conn.rollback()
    return row[0]


def test_exchanged_stations_are_named_and_accepted_or_corrected(folder: Path, conn: psycopg.Connection) -> None:
    path, places = two_scans(folder)
    exchanged = places.copy()
    exchanged[:, 0] = [2, 1]
    add("--stations", table(folder / "s.csv", "scan_id,x,y,z", exchanged))
    said = errors_of("load", "s", path, code=2)
    assert "scan 1: 30 m before its station, at that of scan 2; scan 2: 30 m after its station, at that of scan 1" in said
    assert "then: tunneldb survey set s --stations FILE; " in said
    errors_of(*shlex.split(said.strip().rpartition("; or load it as it is: tunneldb ")[2]))
    errors_of("load", "s", path)
    assert remark(conn).endswith("loaded as it is (--accept-poses)")
    errors_of("survey", "set", "s", "--stations", table(folder / "s.csv", "scan_id,x,y,z", places))
    assert conn.execute("SELECT poses_accepted FROM tunnel_api.survey").fetchone() == (False,)
    assert conn.execute("SELECT pose_note FROM tunnel.scan_file").fetchone() == (None,)
    conn.rollback()


def test_stations_that_loaded_points_contradict_are_refused(folder: Path, conn: psycopg.Connection) -> None:
    path, places = two_scans(folder)
    add("--stations", table(folder / "s.csv", "scan_id,x,y,z", places))
    errors_of("load", "s", path)
    places[:, 1:] = places[0, 1:]
    wrong = table(folder / "wrong.csv", "scan_id,x,y,z", places)
    said = errors_of("survey", "set", "s", "--stations", wrong, code=2)
    assert "the positions do not fit the loaded points: scans were measured from other places" in said
    assert "; or set them as they are: add --accept-poses" in said
    assert "all 2 stations are at one place" in errors_of("survey", "set", "s", "--stations", wrong, "--accept-poses")
    assert remark(conn, "survey").endswith("set as they are (--accept-poses)")


def test_scans_that_were_merged_under_one_number_are_named(folder: Path) -> None:
    path, places = two_scans(folder)
    las = laspy.read(path)
    numbers = np.array(las.point_source_id)
    las.point_source_id = np.ones(len(las))
    las.write(path)
    add("--stations", table(folder / "s.csv", "scan_id,x,y,z", places[:1]))
    assert "scan 1: 2 places, 30 m apart" in errors_of("load", "s", path, code=2)
    result = CliRunner().invoke(main, ["inspect", str(path)])
    assert "if the scanner stood on tripods: points of one scan number were measured from several places" in result.stdout
    las.point_source_id = numbers
    las.write(path)
    errors_of("survey", "set", "s", "--stations", table(folder / "s.csv", "scan_id,x,y,z", places))
    errors_of("load", "s", path)


def test_inspect_finds_the_time_offset_before(folder: Path) -> None:
    trajectory(folder / "a.trajectory.csv", -18.0)
    result = CliRunner().invoke(main, ["inspect", str(folder / "a.laz")])
    assert result.exit_code == 0, result.output
    doubts, _, commands = result.stdout.partition("Next:")
    assert "the trajectory seems to be in UTC, the file in GPS time" in doubts
    assert re.search(r"survey add .* --trajectory .*a\.trajectory\.csv --time-offset 18 ", commands)
