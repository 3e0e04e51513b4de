"""`tunneldb batch --preview`, and which kilometres a file takes along when it fails."""

from __future__ import annotations

import re
import shutil
from collections import namedtuple
from pathlib import Path

import numpy as np
import psycopg
import pytest
from click.testing import CliRunner, Result
from psycopg import sql
from support.loaded_survey import ORIGIN, RADIUS, SURVEY, add_survey, write
from support.queue_rows import add_file, add_run

from tunneldb.cli.main import main
from tunneldb.queue.batch import plan, restrict_failed_file
from tunneldb.queue.preview import FRAGMENT_BYTES, KILOMETRE_BYTES, PIXEL_BYTES, ROW_BYTES, WAL_BYTES, preview
from tunneldb.store.survey import get_survey

COUNT = 2000


@pytest.fixture
def tunnel(conn: psycopg.Connection) -> str:
    """A straight tunnel from 970 m to 7 km."""
    add_survey(conn)
    conn.execute(
        "UPDATE tunnel.tunnel SET alignment = ST_SetSRID(ST_MakeLine(ST_StartPoint(alignment), "
        "ST_Translate(ST_StartPoint(alignment), 6030, 0)), 25830)"
    )
    conn.commit()
    return SURVEY


def scan(folder: Path, first: float, last: float) -> Path:
    """A file of the points from one chainage to another."""
    rng = np.random.default_rng(1)
    along = np.concatenate([[first, last], rng.uniform(first, last, COUNT - 2)])
    angle = rng.uniform(-np.pi, np.pi, COUNT)
    xyz = np.column_stack([along - 970.0, RADIUS * np.sin(angle), RADIUS * np.cos(angle)])
    return write(folder / f"from-{first:.0f}.laz", np.round(ORIGIN + xyz, 3))


def run(*arguments: object) -> Result:
    return CliRunner().invoke(main, ["batch", SURVEY, *map(str, arguments), "--preview"])


def test_files_kilometres_and_gaps(tunnel: str, tmp_path: Path) -> None:
    files = [scan(tmp_path, *ends) for ends in ((970, 2000), (2000, 3000), (4000, 5400), (5700, 6990))]
    notes = tmp_path / "notes.laz"
    notes.write_text("no scan")
    assert "is a folder; pass the files in it" in run(tmp_path).output
    result = run(*files, notes)
    assert result.exit_code == 0, result.output
    lines = [line.rstrip() for line in result.output.splitlines()]
    table = {line.split()[0]: line.split()[1:] for line in lines if ".laz" in line and "/" not in line}
    assert table["from-2000.laz"][:2] == ["2", "000"]
    assert [table[file.name][-1] for file in files] == ["1", "2", "4–5", "5–6"]
    assert "can't be read" in " ".join(table["notes.laz"])
    assert "kilometres covered: 1–2, 4–6" in lines
    assert "kilometres missing: 3" in lines
    gap = next(line for line in lines if line.startswith("no file from about"))
    low, high = (float(word) for word in gap.split() if word.isdigit())
    assert low == pytest.approx(5400, abs=40)
    assert high == pytest.approx(5700, abs=40)
    assert re.search(r"points to be read: 8 000, of these about [1-8] \d\d\d rows \(\d+ to 8 000\)", result.output)
    assert "does not begin with LASF" in result.output[result.output.index("problems") :]


def test_kilometres_asked_for_that_no_file_covers_are_missing(tunnel: str, tmp_path: Path) -> None:
    output = run(scan(tmp_path, 2000, 3000), "--km", "1-3").output
    assert "kilometres covered: 2\n" in output
    assert "kilometres missing: 1, 3\n" in output


def test_it_changes_nothing(conn: psycopg.Connection, tunnel: str, tmp_path: Path) -> None:
    assert run(scan(tmp_path, 2000, 3000)).exit_code == 0
    tables = ("incoming", "goal", "run", "worker", "scan_file", "file_km", "axis_vertex")
    counts = [
        conn.execute(sql.SQL("SELECT count(*) FROM {}").format(sql.Identifier("tunnel", name))).fetchone() for name in tables
    ]
    assert counts == [(0,)] * len(tables)
    assert conn.execute("SELECT count(*) FROM tunnel_queue.procrastinate_jobs").fetchone() == (0,)


def test_what_cannot_be_begun_is_exit_code_2(tunnel: str, tmp_path: Path) -> None:
    result = run(tmp_path / "gone.laz")
    assert result.exit_code == 2
    assert result.stderr.count("\n") == 1


def test_space_is_computed_from_rows_surface_and_kilometres(conn: psycopg.Connection, tunnel: str, tmp_path: Path) -> None:
    survey = get_survey(conn, tunnel)
    asked = plan(conn, survey, [scan(tmp_path, 2000, 3000)], parameters={"image.pixel": 0.1})
    seen = preview(conn, survey, asked, None, embedded=True, workers=1)
    low, high = seen.stretches["from-2000.laz"]
    assert high - low == pytest.approx(980, abs=10)  # without the tails
    assert seen.rows.low < seen.rows.likely < seen.rows.high  # so few points are noise, perhaps
    assert seen.rows.high == pytest.approx(COUNT, rel=0.01)
    rows, share = seen.rows.likely, 1 / len(asked.kilometres)
    assert seen.disk.points == ROW_BYTES * rows
    assert seen.disk.passing == pytest.approx((FRAGMENT_BYTES + ROW_BYTES * share) * rows)
    assert seen.disk.images == pytest.approx(PIXEL_BYTES * 2 * np.pi * RADIUS * 1000 * 100, rel=0.1)
    assert seen.disk.others == pytest.approx(KILOMETRE_BYTES * (high - low) / 1000)
    assert seen.disk.wal == WAL_BYTES[1] * rows  # far from max_wal_size
    assert seen.need.low < seen.disk.total < seen.need.high
    assert 0 <= seen.temporary.low < seen.temporary.high < 200 * COUNT
    assert seen.free is not None
    assert seen.folder is not None
    assert seen.folder.is_dir()
    assert preview(conn, survey, asked, None, embedded=False, workers=1).free is None


def test_a_disk_that_is_too_small_is_said(tunnel: str, dsn: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    usage = namedtuple("usage", "total used free")
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: usage(10**12, 10**12 - 10**6, 10**6))
    path = scan(tmp_path, 2000, 3000)
    assert "can't be seen" in run(path).output  # with a DSN, whatever lies here does not count
    monkeypatch.setattr("tunneldb.cli.batch.connect", lambda _: psycopg.connect(dsn))
    result = CliRunner(env={"TUNNELDB_DSN": ""}).invoke(main, ["batch", SURVEY, str(path), "--preview"])
    assert result.exit_code == 1, result.output
    assert "TOO LITTLE" in result.output


def test_time_comes_from_the_ledger_and_is_unknown_without(conn: psycopg.Connection, tunnel: str, tmp_path: Path) -> None:
    path = scan(tmp_path, 2000, 3000)
    assert "time: unknown until a kilometre was done" in run(path).output
    survey = get_survey(conn, tunnel)
    for stage, seconds in {"load": 20, "axis": 10, "segments": 10, "sections": 20, "ground": 20, "detect": 40}.items():
        add_run(conn, tunnel, 1, stage, seconds)
    add_run(conn, tunnel, None, "read", 10, points=4000)
    conn.execute("UPDATE tunnel.run SET job_id = 1")
    asked = plan(conn, survey, [path])
    seen = preview(conn, survey, asked, None, embedded=False, workers=2)
    assert seen.seconds == pytest.approx((COUNT * 10 / 4000 + 120 * len(asked.kilometres)) / 2)
    asked = plan(conn, survey, [path], stage="axis")
    seen = preview(conn, survey, asked, None, embedded=False, workers=1)
    assert seen.seconds == pytest.approx(COUNT * 10 / 4000 + 30 * len(asked.kilometres))


def test_a_damaged_file_is_of_the_kilometres_of_its_box(conn: psycopg.Connection, tunnel: str, tmp_path: Path) -> None:
    path = scan(tmp_path, 2000, 3000)
    path.write_bytes(path.read_bytes()[:-200])
    (found,) = plan(conn, get_survey(conn, tunnel), [path]).files
    assert found.error is not None
    assert found.awaited == (2,)


def test_a_file_that_fails_later_fails_only_the_kilometres_that_hold_its_points(
    conn: psycopg.Connection, tunnel: str, tmp_path: Path
) -> None:
    survey = get_survey(conn, tunnel)
    path = scan(tmp_path, 2000, 3000)
    (whole,) = plan(conn, survey, [path]).files
    assert whole.awaited == (1, 2, 3)  # its margin touches them, so they wait for it
    add_file(conn, tunnel, path.name, 2, "damaged in the middle")
    conn.execute("UPDATE tunnel.incoming SET km_from = 1, km_to = 3, path = %s", [str(path)])
    restrict_failed_file(conn, survey, path.name)
    assert conn.execute("SELECT km_from, km_to FROM tunnel.incoming").fetchone() == (2, 2)
