"""Of a long trajectory a kilometre reads what it needs, and has the same positions by it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import laspy
import numpy as np
import psycopg
import pytest
from support.loaded_survey import LENGTH, ORIGIN, SURVEY, add_survey, load, tube, write

from tunneldb.pointcloud.reader import Points, read_chunks
from tunneldb.store.poses import load_pose_coverage, load_poses
from tunneldb.store.scanner import Positions, save_positions
from tunneldb.store.sources import sources
from tunneldb.store.survey import get_survey

RATE = 20.0  # poses a second
RUN, HOUR = LENGTH, 3600.0  # s: the tunnel is driven through at 1 m/s, and back an hour later
GAPS = ((12.0, 13.6), (HOUR + 40.0, HOUR + 41.7))  # s


def there_and_back(runs: int) -> tuple[np.ndarray, np.ndarray]:
    """A trajectory that wanders, with gaps, of so many hours before and after the first two runs."""
    time = np.concatenate([HOUR * k + np.arange(0.013, RUN, 1.0 / RATE) for k in range(-runs, runs + 2)])
    for begin, end in GAPS:
        time = time[(time <= begin) | (time >= end)]
    along = np.abs(time % (2 * HOUR) - np.where(time % (2 * HOUR) >= HOUR, HOUR + RUN, 0.0))
    return time, ORIGIN + np.column_stack([along, 0.1 * np.sin(time), 0.1 * np.cos(0.7 * time)])


def save_trajectory(conn: psycopg.Connection, runs: int) -> None:
    conn.execute("DELETE FROM tunnel.pose")
    survey = get_survey(conn, SURVEY)
    time, xyz = there_and_back(runs)
    save_positions(conn, survey.id, Positions(True, time, xyz), survey.srid)
    conn.commit()


def chunks_of(conn: psycopg.Connection, km: int) -> Iterator[Points]:
    """What detection reads of a kilometre."""
    (file,) = sources(conn, get_survey(conn, SURVEY), km)
    return read_chunks(file.path, file.dimension, 1_000_000, file.ranges)


@pytest.fixture
def scanned(conn: psycopg.Connection, tmp_path: Path) -> psycopg.Connection:
    """A file of both runs, profile by profile, loaded; of a few points the time is lost or spoilt."""
    add_survey(conn, platform="mobile")
    save_trajectory(conn, 0)
    xyz = tube(975, 1025, 200, seed=1)
    there = xyz[np.argsort(xyz[:, 0])]
    path = write(tmp_path / "a.laz", np.concatenate([there, there[::-1]]))
    las = laspy.read(path)
    time = np.array(las.gps_time)
    time[len(xyz) :] = HOUR + RUN - time[len(xyz) :]
    time[[7, 90_000]] = np.nan, np.inf
    las.gps_time = time
    las.write(path)
    (loaded,) = load(conn, [path])
    assert loaded.invalid == 2
    assert loaded.unposed > 1000  # in the gaps
    return conn


def test_positions_are_those_by_the_whole_trajectory(scanned: psycopg.Connection) -> None:
    save_trajectory(scanned, 100)
    survey = get_survey(scanned, SURVEY)
    whole = load_poses(scanned, survey)
    assert len(whole.time) > 200 * RUN * RATE
    for km in (0, 1):
        part = load_poses(scanned, survey, km)
        assert len(part.time) < 2 * RUN * RATE
        assert part.longest == whole.longest
        lost = 0
        for points in chunks_of(scanned, km):
            expected = whole.positions(points)
            np.testing.assert_array_equal(part.positions(points), expected)
            lost += np.isnan(expected[:, 0]).sum()
        assert lost > 1000


def test_where_the_times_of_a_kilometre_are_not_known_all_poses_are_read(scanned: psycopg.Connection) -> None:
    save_trajectory(scanned, 3)
    survey = get_survey(scanned, SURVEY)
    whole, part = (len(load_poses(scanned, survey, *of).time) for of in ((), (0,)))
    assert part < whole
    # A file that was read before times were kept; one that was replaced, of which the rows are still the former's.
    for change in ("seconds = NULL", "loaded_at = NULL"):
        scanned.execute(f"UPDATE tunnel.file_km SET {change} WHERE km = 0")
        assert len(load_poses(scanned, survey, 0).time) == whole
        assert len(load_poses(scanned, survey, 1).time) < whole
        scanned.rollback()


def test_what_is_covered_is_known_without_the_poses(scanned: psycopg.Connection) -> None:
    save_trajectory(scanned, 3)
    survey = get_survey(scanned, SURVEY)
    found, expected = load_pose_coverage(scanned, survey), load_poses(scanned, survey).coverage
    assert found.ends == expected.ends
    assert len(found.gaps) == 7 + len(GAPS)
    np.testing.assert_array_equal(found.gaps, expected.gaps)


def test_a_replaced_trajectory_leaves_nothing_of_the_former(scanned: psycopg.Connection) -> None:
    scanned.execute("DELETE FROM tunnel.pose")
    survey = get_survey(scanned, SURVEY)
    save_positions(scanned, survey.id, Positions(False, np.arange(2, dtype=np.int32), ORIGIN + np.eye(2, 3)), survey.srid)
    row = scanned.execute("SELECT longest_interval, trajectory_gaps FROM tunnel.survey").fetchone()
    assert row == (None, None)
