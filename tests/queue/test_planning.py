"""Files whose header contradicts their points: the points decide which kilometres a batch processes."""

from __future__ import annotations

import math
import struct
from pathlib import Path

import numpy as np
import psycopg
import pytest
from support.loaded_survey import ORIGIN, RADIUS, SETTINGS, SURVEY, add_survey, load, tube, write

from tunneldb.errors import UserError
from tunneldb.pipeline.read import read_file
from tunneldb.pointcloud.file_sample import read_runs
from tunneldb.pointcloud.header_box import describe_box_difference
from tunneldb.pointcloud.reader import ScanHeader, read_header
from tunneldb.queue.batch import only_loaded, plan, register
from tunneldb.queue.watching import server_time
from tunneldb.stages.ledger import Job, stage_run
from tunneldb.store.remarks import read_remarks
from tunneldb.store.survey import get_survey

BOTH = (970.0, 1030.0)
"""Chainages of points in kilometres 0 and 1."""

LOW, HIGH = ORIGIN + np.array([0.0, -RADIUS, -RADIUS]), ORIGIN + np.array([60.0, RADIUS, RADIUS])
NAN, INF = np.full(3, math.nan), np.full(3, math.inf)

BOXES = {
    "of the first points": (LOW, HIGH - np.array([50.0, 0.0, 0.0])),
    "zero": (np.zeros(3), np.zeros(3)),
    "NaN": (NAN, NAN),
    "inverted": (HIGH, LOW),
    "infinite": (-INF, INF),
    "of no points": (np.full(3, 1.7e308), np.full(3, -1.7e308)),
    "of another tunnel": (LOW + 50_000.0, HIGH + 50_000.0),
    "of the other kilometre": (LOW + np.array([57.0, 0.0, 0.0]), HIGH),
    "of a country": (np.zeros(3), np.full(3, 9e6)),
    "x and y exchanged": (LOW[[1, 0, 2]], HIGH[[1, 0, 2]]),
}


@pytest.fixture
def survey(conn: psycopg.Connection) -> psycopg.Connection:
    add_survey(conn)
    return conn


def scan(path: Path, ends: tuple[float, float] = BOTH, box: tuple[np.ndarray, np.ndarray] | None = None) -> Path:
    """Write a file of points between two chainages, with another box in its header."""
    write(path, tube(*ends, 150.0, 1))
    if box is not None:
        content = bytearray(path.read_bytes())
        low, high = box
        struct.pack_into("<6d", content, 179, *np.column_stack([high, low]).ravel())
        path.write_bytes(content)
    return path


def goals(conn: psycopg.Connection) -> dict[int, str]:
    return dict(conn.execute("SELECT km, stage FROM tunnel.goal ORDER BY km").fetchall())


def read_files(conn: psycopg.Connection) -> set[tuple[object, object]]:
    """Do the jobs that read files, as a worker does; return the jobs of kilometres that wait then."""
    survey = get_survey(conn, SURVEY)
    (worker,) = conn.execute(
        "INSERT INTO tunnel_queue.procrastinate_workers (last_heartbeat) VALUES (clock_timestamp()) RETURNING id"
    ).fetchone()
    jobs = conn.execute(
        "UPDATE tunnel_queue.procrastinate_jobs SET status = 'doing', worker_id = %s WHERE task_name = 'read'"
        " RETURNING id, attempts, args ->> 'file'",
        [worker],
    ).fetchall()
    conn.commit()
    for job, attempts, name in jobs:
        (path,) = conn.execute("SELECT path FROM tunnel.incoming WHERE name = %s", [name]).fetchone()
        conn.rollback()
        with stage_run(conn, survey.id, None, "read", {"file": name}, Job(job, worker, attempts)) as run:
            run.counts.update(read_file(conn, survey, Path(path), SETTINGS))
    waiting = conn.execute("SELECT args -> 'km', args ->> 'stage' FROM tunnel_queue.procrastinate_jobs WHERE status = 'todo'")
    return set(waiting.fetchall())


def test_a_right_box_needs_no_remark(survey: psycopg.Connection, tmp_path: Path) -> None:
    asked = plan(survey, get_survey(survey, SURVEY), [scan(tmp_path / "right.laz")], stage="sections")
    register(survey, get_survey(survey, SURVEY), asked)
    assert read_files(survey) == {(0, "load"), (1, "load")}
    assert goals(survey) == {0: "sections", 1: "sections"}
    assert read_remarks(survey, get_survey(survey, SURVEY)) == []


@pytest.mark.parametrize("box", BOXES.values(), ids=BOXES.keys())
def test_both_kilometres_are_run_whatever_the_box_is(
    survey: psycopg.Connection, tmp_path: Path, box: tuple[np.ndarray, np.ndarray]
) -> None:
    of = get_survey(survey, SURVEY)
    asked = plan(survey, of, [scan(tmp_path / "wrong.laz", box=box)], stage="sections", parameters={"section.angle_step": 10})
    assert [file.error for file in asked.files] == [None]
    register(survey, of, asked)
    assert read_files(survey) == {(0, "load"), (1, "load")}
    assert goals(survey) == {0: "sections", 1: "sections"}
    values = survey.execute("SELECT DISTINCT parameters -> 'section.angle_step' FROM tunnel.goal").fetchall()
    assert values == [(10,)]
    assert survey.execute("SELECT count(*) FROM tunnel.incoming").fetchone() == (0,)
    (remark,) = read_remarks(survey, of)
    assert remark.file == "wrong.laz"
    assert "its header states the box" in remark.remark
    assert f"x {ORIGIN[0]:.1f} to {ORIGIN[0] + 60:.1f}" in remark.remark
    (note,) = survey.execute("SELECT counts ->> 'note' FROM tunnel.run WHERE stage = 'read'").fetchone()
    assert remark.remark in note  # which the batch prints


def test_a_box_of_a_kilometre_without_points_requests_none(survey: psycopg.Connection, tmp_path: Path) -> None:
    of = get_survey(survey, SURVEY)
    asked = plan(survey, of, [scan(tmp_path / "short.laz", (970.0, 990.0), (LOW, HIGH))])
    assert asked.kilometres == (0, 1)  # until it is read
    register(survey, of, asked)
    read_files(survey)
    assert goals(survey) == {0: "detect"}


def test_a_restricted_batch_reads_a_file_whose_points_are_there_and_names_those_that_it_leaves_out(
    survey: psycopg.Connection, tmp_path: Path
) -> None:
    of = get_survey(survey, SURVEY)
    hidden = scan(tmp_path / "hidden.laz", box=BOXES["of the first points"])
    start = scan(tmp_path / "start.laz", (970.0, 980.0), (LOW, HIGH - np.array([50.0, 0.0, 0.0])))
    asked = plan(survey, of, [hidden, start], kilometres=range(1, 2), reading={"load.max_distance": 5.0})
    assert [file.name for file in asked.files] == ["hidden.laz"]
    assert asked.skipped == ("start.laz",)
    since = server_time(survey)
    register(survey, of, asked)
    assert read_files(survey) == {(0, "load"), (1, "load")}
    assert goals(survey) == {0: "load", 1: "detect"}
    survey.execute("UPDATE tunnel.file_km SET loaded_at = clock_timestamp()")
    assert only_loaded(survey, of, asked, since) == [0]


def test_a_file_that_was_loaded_before_is_of_the_kilometres_with_its_points(survey: psycopg.Connection, tmp_path: Path) -> None:
    path = scan(tmp_path / "wrong.laz", box=BOXES["of the first points"])
    load(survey, [path])
    asked = plan(survey, get_survey(survey, SURVEY), [path])
    assert [file.already_read for file in asked.files] == [True]
    assert asked.kilometres == (0, 1)


def test_a_file_off_the_axis_by_header_and_points_is_refused_at_once(survey: psycopg.Connection, tmp_path: Path) -> None:
    path = write(tmp_path / "other.laz", tube(*BOTH, 150.0, 1) + 50_000.0)
    asked = plan(survey, get_survey(survey, SURVEY), [path])
    assert "off the given axis" in str(asked.files[0].error)
    assert asked.kilometres == ()


def test_a_sample_reaches_from_the_beginning_of_a_file_to_its_end(tmp_path: Path) -> None:
    path = write(tmp_path / "long.laz", np.sort(tube(970.0, 1100.0, 150.0, 1), axis=0))
    count = read_header(path).points
    runs = list(read_runs(path, count, 50, 100))
    assert [len(run) for run in runs] == [100] * -(-count // 50_000)
    assert runs[-1][0, 0] > ORIGIN[0] + 80.0


@pytest.mark.parametrize(("low", "high", "tight", "differs"), [
    ((0, 0, 0), (10, 4, 3), True, ""),
    ((-0.9, 0, 0), (10.9, 4, 3), True, ""),
    ((0, 0, 0), (10, 2, 3), True, "y 0.0 to 2.0"),
    ((0, 0, 0), (99, 4, 3), True, "x 0.0 to 99.0"),
    ((-5, -5, 0), (15, 9, 3), False, ""),  # of a scan that is turned
    ((0, 0, 0), (99, 4, 3), False, "x 0.0 to 99.0"),
    ((1, 0, 0), (-1, 4, math.nan), True, "x 1.0 to -1.0, z 0.0 to nan"),
])  # fmt: skip
def test_boxes_are_compared_up_to_a_metre(low: tuple, high: tuple, tight: bool, differs: str) -> None:
    header = ScanHeader(Path("a"), 1, (), None, np.array(low, float), np.array(high, float), tight=tight)
    note = describe_box_difference(header, np.array([0.0, 0, 0, 10, 4, 3]))
    assert (differs == "") == (note is None)
    assert note is None or f"states the box {differs}, but" in note


@pytest.mark.parametrize(
    ("name", "count", "stated"),
    [("a.las", 0, 0), ("a.las", 3000, 3000), ("a.laz", 30_000, 30_000), ("a.laz", 113_000, 113_000)],
)
def test_a_file_with_more_points_than_its_header_states_is_refused(tmp_path: Path, name: str, count: int, stated: int) -> None:
    path = write(tmp_path / name, tube(*BOTH, 150.0, 1))
    there = read_header(path).points
    content = bytearray(path.read_bytes())
    struct.pack_into("<Q", content, 247, count)
    path.write_bytes(content)
    with pytest.raises(UserError, match=f"its header states {stated} points, but it") as refused:
        read_header(path)
    assert name.endswith("z") or f"contains {there}" in str(refused.value)


def test_a_ply_with_more_vertices_than_its_header_states_is_refused(tmp_path: Path) -> None:
    path, head = tmp_path / "a.ply", "ply\nformat binary_little_endian 1.0\nelement vertex 2\n"
    head += "".join(f"property double {name}\n" for name in "xyz") + "end_header\n"
    path.write_bytes(head.encode() + np.zeros((3, 3)).tobytes())
    with pytest.raises(UserError, match="its header states 2 vertices, but it contains 3"):
        read_header(path)
    path.write_bytes(head.encode() + np.zeros((2, 3)).tobytes())
    assert read_header(path).points == 2
