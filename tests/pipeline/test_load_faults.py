"""Loading that fails: one clear line, and the database as it was."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import laspy
import numpy as np
import psycopg
import pytest
from click.testing import CliRunner
from support.loaded_survey import ORIGIN, SURVEY, add_survey, assert_nothing_loaded, files, load, rows, runs, tube, write

from tunneldb.cli.main import main
from tunneldb.errors import UserError
from tunneldb.pointcloud.selection import FilterSettings


@pytest.fixture
def survey(conn: psycopg.Connection) -> psycopg.Connection:
    add_survey(conn)
    return conn


class TestBadInput:
    """One clear line, and nothing written."""

    def refused(self, conn: psycopg.Connection, paths: Sequence[Path], match: str) -> None:
        with pytest.raises(UserError, match=match):
            load(conn, paths)
        assert_nothing_loaded(conn)

    def test_far_from_the_axis(self, survey: psycopg.Connection, tmp_path: Path) -> None:
        path = write(tmp_path / "a.laz", tube(980, 1020, 50, seed=1) + np.array([0, 700.0, 0]))
        self.refused(survey, [path], r"a\.laz: no points near the axis: the nearest is about (69|70).* m")
        assert runs(survey)[0][:2] == (None, "failed")
        assert "no points near the axis" in str(runs(survey)[0][2])

    def test_nothing_but_noise(self, survey: psycopg.Connection, tmp_path: Path) -> None:
        path = write(tmp_path / "a.laz", ORIGIN + np.array([[10.0, 0, 0], [20, 0, 0]]))
        self.refused(survey, [path], "all 2 points near the axis are noise")

    def test_gps_time_outside_the_trajectory(self, conn: psycopg.Connection, tmp_path: Path) -> None:
        add_survey(conn, platform="mobile")
        xyz = tube(980, 1020, 100, seed=1)
        path = write(tmp_path / "a.laz", xyz)
        las = laspy.read(path)
        las.gps_time[:7000] += 100.0
        las.gps_time[7000:10_000] = -12.5
        las.write(path)
        self.refused(
            conn, [path], r"gps_time of 10.000 points .* 12\.500 s before its start and up to .* s after its end.*--max-left"
        )
        load(conn, [write(path, xyz)])

    def test_a_file_of_which_nothing_is_left_is_refused_whatever_may_be_left_out(
        self, survey: psycopg.Connection, tmp_path: Path
    ) -> None:
        path = write(tmp_path / "a.laz", tube(980, 1020, 50, seed=1), scan_id=9)
        with pytest.raises(UserError, match="no station for scan_id 9"):
            load(survey, [path], FilterSettings(max_left_out=1.0))

    def test_a_few_points_of_unknown_scanner_or_without_a_number_are_left_out(
        self, conn: psycopg.Connection, tmp_path: Path
    ) -> None:
        add_survey(conn, platform="mobile")
        path = write(tmp_path / "a.laz", tube(980, 1020, 100, seed=1))
        las = laspy.read(path)
        las.gps_time[:7] += 100.0
        las.gps_time[7] = np.nan
        las.Amplitude[8:12] = np.nan
        las.write(path)
        (loaded,) = load(conn, [path])
        assert (loaded.unposed, loaded.invalid) == (7, 5)
        assert loaded.points == sum((loaded.noise, loaded.outside, loaded.invalid, loaded.unposed, loaded.thinned, loaded.kept))
        remarks = conn.execute("SELECT file, remark FROM tunnel_api.remark ORDER BY remark").fetchall()
        assert [name for name, _ in remarks] == ["a.laz", "a.laz"]
        assert remarks[0][1].startswith("5 points") and "no number" in remarks[0][1]  # noqa: PT018
        assert remarks[1][1].startswith("7 points") and "position is not known" in remarks[1][1]  # noqa: PT018

    def test_scan_without_a_station(self, survey: psycopg.Connection, tmp_path: Path) -> None:
        path = write(tmp_path / "a.laz", tube(980, 1020, 50, seed=1), scan_id=9)
        self.refused(survey, [path], r"no station for scan_id 9 \(")

    def test_all_files_are_looked_at_first(self, survey: psycopg.Connection, tmp_path: Path) -> None:
        good = write(tmp_path / "a.laz", tube(980, 990, 50, seed=1))
        las = laspy.read(good)
        las.remove_extra_dim("Amplitude")
        las.write(tmp_path / "b.laz")
        self.refused(survey, [good, tmp_path / "b.laz"], r"b\.laz: no dimension 'Amplitude'.*gps_time")
        self.refused(survey, [good, tmp_path / "c.laz"], r"c\.laz: no such file")
        assert runs(survey) == []

    def test_two_files_of_a_name(self, survey: psycopg.Connection, tmp_path: Path) -> None:
        (tmp_path / "b").mkdir()
        paths = [write(folder / "a.laz", tube(980, 990, 50, seed=1)) for folder in (tmp_path, tmp_path / "b")]
        self.refused(survey, paths, "have the same name")

    def test_truncated_after_good_ones(self, survey: psycopg.Connection, tmp_path: Path) -> None:
        good = write(tmp_path / "a.laz", tube(1005, 1020, 100, seed=1))
        bad = write(tmp_path / "b.las", tube(975, 990, 100, seed=2))
        data = bytearray(bad.read_bytes())
        data[-30 * 1000 : -30 * 1000 + 8] = b"\xff" * 8
        bad.write_bytes(data[:-5000])
        self.refused(survey, [good, bad], r"b\.las: truncated")

    def test_temporary_folder_full(self, survey: psycopg.Connection, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        path = write(tmp_path / "a.laz", tube(980, 1020, 100, seed=1))
        monkeypatch.setattr(tempfile, "TemporaryFile", lambda **_: Path("/dev/full").open("wb", buffering=0))  # noqa: SIM115
        with pytest.raises(UserError, match="no space left for temporary files"):
            load(survey, [path], memory=0)
        assert_nothing_loaded(survey)
        assert runs(survey)[0][:2] == (None, "failed")

    def test_another_process_at_work(self, survey: psycopg.Connection, dsn: str, tmp_path: Path) -> None:
        path = write(tmp_path / "a.laz", tube(1002, 1020, 100, seed=1))
        with psycopg.connect(dsn) as other:
            other.execute("SELECT pg_advisory_xact_lock(1, 1)")
            self.refused(survey, [path], "another process is at work on kilometre 1")
        load(survey, [path])


@pytest.mark.parametrize("loaded_before", [False, True])
def test_disk_full_during_copy(survey: psycopg.Connection, dsn: str, tmp_path: Path, loaded_before: bool) -> None:
    path = tmp_path / "a.laz"
    if loaded_before:
        load(survey, [write(path, tube(980, 1020, 150, seed=1))])
    before = rows(survey), files(survey)
    # A disk that fills up after 1000 rows of kilometre 1: the server reports it in the same words.
    survey.execute(
        """
        CREATE SEQUENCE room;
        CREATE FUNCTION fill() RETURNS trigger LANGUAGE plpgsql AS $$
        BEGIN
            IF nextval('room') > 1000 THEN
                RAISE 'could not extend file "base/1/2": No space left on device' USING ERRCODE = 'disk_full';
            END IF;
            RETURN NEW;
        END $$;
        CREATE FUNCTION watch() RETURNS event_trigger LANGUAGE plpgsql AS $$
        BEGIN
            IF to_regclass('tunnel.point_s1_km1_new') IS NOT NULL THEN
                CREATE TRIGGER fill BEFORE INSERT ON tunnel.point_s1_km1_new FOR EACH ROW EXECUTE FUNCTION fill();
            END IF;
        END $$;
        CREATE EVENT TRIGGER watch ON ddl_command_end WHEN TAG IN ('CREATE TABLE') EXECUTE FUNCTION watch();
        """
    )
    survey.commit()
    write(path, tube(980, 1020, 200, seed=2))
    result = CliRunner().invoke(main, ["--dsn", dsn, "load", SURVEY, str(path)])
    assert result.exit_code == 2
    assert result.stderr.splitlines() == [
        "tunneldb: the database's disk is full, the current work was rolled back:"
        ' could not extend file "base/1/2": No space left on device'
    ]
    assert (rows(survey), files(survey)) == before
    survey.execute("DROP EVENT TRIGGER watch")
    survey.commit()
    assert CliRunner().invoke(main, ["--dsn", dsn, "load", SURVEY, str(path)]).exit_code == 0


KILLED = """
import os, sys
from pathlib import Path
from tunneldb.database import connect
from tunneldb.pipeline.load import load_files
from tunneldb.pointcloud.selection import FilterSettings
from tunneldb.store import get_survey

def begin(text, total):
    return lambda done: os.kill(os.getpid(), 9) if text == sys.argv[2] else None

with connect(sys.argv[1]) as conn:
    survey = get_survey(conn, "s")
    conn.rollback()
    list(load_files(conn, survey, [Path(sys.argv[3])], FilterSettings(), begin))
"""


@pytest.mark.parametrize("moment", ["a.laz", "kilometre 0", "kilometre 1"])
def test_killed_at_any_moment_leaves_the_old_state(survey: psycopg.Connection, dsn: str, tmp_path: Path, moment: str) -> None:
    path = write(tmp_path / "a.laz", tube(980, 1020, 150, seed=1))

    def kill() -> None:
        done = subprocess.run([sys.executable, "-c", KILLED, dsn, moment, str(path)], check=False)
        assert done.returncode == -9
        # The server notices when it next speaks to the client that is gone.
        survey.execute(
            "SELECT pg_terminate_backend(pid, 10000) FROM pg_stat_activity WHERE pid <> pg_backend_pid() "
            "AND datname = current_database()"
        )
        survey.commit()

    kill()
    assert_nothing_loaded(survey)
    load(survey, [path])
    before = rows(survey), files(survey)
    write(path, tube(980, 1020, 100, seed=2))
    kill()
    assert (rows(survey), files(survey)) == before
