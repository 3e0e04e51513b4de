"""A second tube beside the tunnel in the same files: left out, counted, told; nothing else is taken for one."""

from __future__ import annotations

import json
from pathlib import Path

import laspy
import numpy as np
import psycopg
import pytest
from support.loaded_survey import LENGTH, ORIGIN, RADIUS, START

from tests.pipeline.test_detect import NAME, command, outlines, parameters, prepare
from tunneldb.geometry.alignment import Alignment
from tunneldb.pointcloud.second_tube import find_second_tubes
from tunneldb.pointcloud.spool import ROW, Rows
from tunneldb.simulate import Simulation, write

APART = 15.0


def placed(xyz: np.ndarray) -> Rows:
    """Rows of points given by chainage, to the right and up."""
    rows = np.zeros(len(xyz), ROW)
    rows["chainage"] = xyz[:, 0]
    rows["x"], rows["y"], rows["z"] = (ORIGIN + np.column_stack([xyz[:, 0] - START, -xyz[:, 1], xyz[:, 2]])).T
    return rows


def pipe(low: float, high: float, right: float, radius: float, density: float = 100.0) -> np.ndarray:
    rng = np.random.default_rng(int(abs(right) * 10 + radius))
    angle, along = rng.uniform(0, 2 * np.pi, (2, int(density * 2 * np.pi * radius * (high - low))))
    return np.column_stack([low + (high - low) * along / (2 * np.pi), right + radius * np.sin(angle), radius * np.cos(angle)])


def sheet(low: float, high: float, left: float, right: float, height: float) -> np.ndarray:
    rng = np.random.default_rng(1)
    count = int(100 * (high - low) * (right - left))
    return np.column_stack([rng.uniform(low, high, count), rng.uniform(left, right, count), np.full(count, height)])


def passage(right: float) -> np.ndarray:
    return np.concatenate([sheet(985, 988, RADIUS, right, height) for height in (-1.5, 1.0)])


OWN = pipe(970, 1000, 0, RADIUS)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_other_tube_is_told_apart_through_a_passage(side: float) -> None:
    axis = Alignment.from_polyline(ORIGIN + np.array([[0.0, 0, 0], [LENGTH, 0, 0]]), START)
    other = pipe(970, 1000, side * APART, 3.0)
    way = passage(APART - 3.0) * [1, side, 1]
    tubes = find_second_tubes([placed(OWN), placed(np.concatenate([way, other]))], axis, 0)
    assert tubes.any
    assert tubes.own(placed(OWN), axis).all()
    assert not tubes.own(placed(other), axis).any()
    assert f"to the {'right' if side > 0 else 'left'} between 0+970 and 1+000" in tubes.note(7)


@pytest.mark.parametrize(
    "beside",
    [
        passage(20.0),
        np.concatenate([sheet(980, 982, 2, 4.5, height) for height in (-1.5, 1.0)]),  # a niche
        np.concatenate([sheet(970, 1000, 2, 20, -1.5), sheet(970, 1000, 6, 6.1, 3)]),  # ground, and a rail beside it
        sheet(970, 1000, 8, 20, 5),  # ground behind a fence, as beside an open cut
        pipe(970, 1000, 0.5, 1.2),  # a train
        pipe(970, 978, 12, 3.0),  # shorter than a tube
    ],
)
def test_nothing_else_is_a_tube(beside: np.ndarray) -> None:
    axis = Alignment.from_polyline(ORIGIN + np.array([[0.0, 0, 0], [LENGTH, 0, 0]]), START)
    assert not find_second_tubes([placed(np.concatenate([OWN, beside]))], axis, 0).any


def test_results_are_those_of_the_tunnel(conn: psycopg.Connection, tmp_path: Path) -> None:
    """The same tunnel again, 15 m to the side and scanned thrice as dense, neither turns the sections nor adds leaks."""
    simulation = Simulation(
        parameters("profiler", 1, length=16.0, leaks=4, profile_spacing=0.04, profile_points=600, radius=0.0, niches=False)
    )
    write(simulation, tmp_path)
    (path,) = tmp_path.glob("*.laz")
    las = laspy.read(path)
    across = np.array([-np.cos(np.radians(60)), np.sin(np.radians(60))]) * -APART  # the simulated tunnel's azimuth is 60°
    twice = laspy.LasData(las.header)
    twice.points = laspy.ScaleAwarePointRecord(
        np.concatenate([las.points.array] * 4), las.point_format, las.header.scales, las.header.offsets
    )
    copies = np.repeat([0.0, 1.0, 1.0, 1.0], len(las))
    jitter = np.random.default_rng(0).normal(0, 0.01, len(copies)) * copies
    twice.x, twice.y = np.tile(las.x, 4) + copies * across[0] + jitter, np.tile(las.y, 4) + copies * across[1]
    twice.write(path)
    prepare(tmp_path, "profiler")
    command("run", NAME)

    radii = np.array([row[0] for row in conn.execute("SELECT radius FROM tunnel.section").fetchall()])
    assert radii.max() < 4.5  # where the wall meets the floor
    assert len(outlines(conn)) == len(simulation.leaks)
    points, outside, kept = conn.execute("SELECT points, outside, kept FROM tunnel.scan_file").fetchone()
    assert kept == conn.execute("SELECT count(*) FROM tunnel.point").fetchone()[0]
    assert kept < outside < points - kept  # of what thinning leaves of a file, the other tube's share is greater
    remarks = json.loads(command("status", NAME, "--json").output)["remarks"]
    (told,) = (said["remark"] for said in remarks if said["stage"] == "load")
    left_out = int(told.split(" points of a second tube left out, to the right between 12+310 and ")[0].replace(" ", ""))
    assert 0.98 * outside < left_out <= outside  # strays are outside, too
