"""What people mix up in files beside a scan: each is one line that says what it seems to be."""

from __future__ import annotations

from pathlib import Path

import laspy
import numpy as np
import psycopg
import pytest
from support.command import errors_of
from support.loaded_survey import LENGTH, ORIGIN, START, tube, write

ALONG = np.array([1.0, 0.0, 0.0])
AXIS = np.array([ORIGIN, ORIGIN + LENGTH * ALONG])
POSES = np.column_stack([np.arange(LENGTH + 1), np.linspace(*AXIS, int(LENGTH) + 1)])
STATIONS = np.array([[1, *(ORIGIN + 10.0 * ALONG)], [2, *(ORIGIN + 50.0 * ALONG)]])
EPOCH = 1_400_000_000.0  # GPS time, s


def table(path: Path, header: str, rows: np.ndarray) -> Path:
    np.savetxt(path, rows, "%.4f" if "time" in header else "%.10g", ",", header=header, comments="")
    return path


@pytest.fixture
def tunnel(conn: psycopg.Connection, tmp_path: Path) -> Path:
    axis = table(tmp_path / "axis.csv", "x,y,z", AXIS)
    errors_of("tunnel", "add", "t", "--srid", 25830, "--axis", axis, "--start-chainage", START)
    return tmp_path


def add(folder: Path, kind: str, rows: np.ndarray, code: int = 0) -> str:
    header = "time,x,y,z" if kind == "--trajectory" else "scan_id,x,y,z"
    path = table(folder / "poses.csv", header, rows)
    return errors_of(
        "survey", "add", "s", "--tunnel", "t", "--date", "2024-05-04", kind, path, "--intensity-kind", "none", code=code
    )


def scan(path: Path, time: float = 0.0, scan_id: int = 1) -> Path:
    las = laspy.read(write(path, tube(975, 985, 100, seed=1), scan_id=scan_id))
    las.gps_time = np.asarray(las.gps_time) + time
    las.write(path)
    return path


@pytest.mark.parametrize(
    ("trajectory", "file", "says"),
    [
        (200_000.0, EPOCH, "the trajectory seems to be in seconds of the GPS week, the file in time since an epoch"),
        (EPOCH, 200_000.0, "the trajectory seems to be in time since an epoch, the file in seconds of the GPS week"),
        (EPOCH, EPOCH - 1e9, "the trajectory seems to be in GPS time, the file in adjusted GPS time"),
        (EPOCH + 315_964_782, EPOCH, "the trajectory seems to be in Unix time, the file in GPS time"),
        (EPOCH, EPOCH + 3600, "whole hours: a time zone; with +3600 s on the trajectory's times they fit"),
    ],
)
def test_clocks(tunnel: Path, trajectory: float, file: float, says: str) -> None:
    add(tunnel, "--trajectory", POSES + np.array([trajectory, 0, 0, 0]))
    assert says in errors_of("load", "s", scan(tunnel / "a.laz", file), code=2)


@pytest.mark.parametrize("kind", ["--trajectory", "--stations"])
@pytest.mark.parametrize(
    ("matrix", "says"),
    [
        (np.eye(3)[[1, 0, 2]], "they would fit with x and y swapped"),
        (np.eye(3) * 1000.0, "they would fit as millimetres"),
        (np.eye(3) / 0.3048, "they would fit as feet"),
        (np.eye(3) / 1000.0, "they would fit if the axis is in millimetres"),
        (np.eye(3) * 0.3048, "they would fit if the axis is in feet"),
        (np.eye(3) * 0.9, "give the positions in this tunnel, in its coordinate system"),
    ],
    ids=["swapped", "millimetres", "feet", "axis in millimetres", "axis in feet", "elsewhere"],
)
def test_positions(tunnel: Path, kind: str, matrix: np.ndarray, says: str) -> None:
    rows = (POSES if kind == "--trajectory" else STATIONS).copy()
    rows[:, 1:] = rows[:, 1:] @ matrix.T
    assert says in add(tunnel, kind, rows, code=2)


@pytest.mark.parametrize(
    ("matrix", "says"),
    [(np.eye(3)[[1, 0, 2]], "they would fit with x and y swapped"), (np.eye(3) * 1000.0, "they would fit as millimetres")],
    ids=["swapped", "millimetres"],
)
def test_points(tunnel: Path, matrix: np.ndarray, says: str) -> None:
    add(tunnel, "--stations", STATIONS)
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales, header.offsets = [0.5] * 3, ORIGIN @ matrix.T
    las = laspy.LasData(header)
    las.x, las.y, las.z = (tube(975, 985, 100, seed=1) @ matrix.T).T
    las.write(tunnel / "a.laz")
    assert says in errors_of("load", "s", tunnel / "a.laz", code=2)


def test_scan_numbers(tunnel: Path) -> None:
    twice = np.concatenate([STATIONS, STATIONS[:1] + np.array([0, 20.0, 0, 0])])
    assert "line 4: scan_id 1 is repeated" in add(tunnel, "--stations", twice, code=2)
    unnamed = table(tunnel / "names.csv", "name,x,y,z", STATIONS)
    said = errors_of(
        "survey", "add", "s", "--tunnel", "t", "--date", "2024-05-04", "--stations", unnamed, "--intensity-kind", "none", code=2
    )
    assert "names.csv has no column scan_id: the header is 'name,x,y,z'; scan_id is the number" in said
    add(tunnel, "--stations", STATIONS)
    assert "no station for scan_id 7" in errors_of("load", "s", scan(tunnel / "a.laz", scan_id=7), code=2)
