"""Loading scan files into a real database."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import laspy
import numpy as np
import psycopg
import pytest
from click.testing import CliRunner
from support.loaded_survey import LENGTH, ORIGIN, RADIUS, START, SURVEY, add_survey, files, load, rows, runs, tube, write
from support.real_scans import real_scan

from tunneldb.cli.main import main
from tunneldb.errors import UserError
from tunneldb.pipeline.remove import remove_files
from tunneldb.pointcloud.selection import FilterSettings
from tunneldb.store import scan_files
from tunneldb.store.survey import get_survey


@pytest.fixture
def survey(conn: psycopg.Connection) -> psycopg.Connection:
    add_survey(conn)
    return conn


def test_a_file_becomes_rows(survey: psycopg.Connection, tmp_path: Path) -> None:
    xyz = tube(980, 1020, 400, seed=1)
    far = ORIGIN + np.array([[20.0, 30.0, 0.0], [-5.0, 0.0, 0.0], [LENGTH + 1, 0.0, 0.0]])
    path = write(tmp_path / "a.laz", np.concatenate([xyz, far]))
    (loaded,) = load(survey, [path])

    found = rows(survey)
    assert (loaded.name, loaded.state, loaded.outside) == ("a.laz", "loaded", 3)
    assert loaded.points == len(xyz) + 3 == loaded.noise + loaded.outside + loaded.thinned + loaded.kept
    assert 15 <= loaded.noise <= 25
    assert loaded.kept == len(found) == files(survey)["a.laz"][-1]
    area = 2 * np.pi * RADIUS * 40
    assert 70 < loaded.kept / area < 105  # of 100, for some voxels have no point in them
    measured = set(map(tuple, xyz.tolist()))
    for km, chainage, time, x, y, z, segment, scan_id, name, intensity, _ in found:
        assert (x, y, z) in measured
        assert km == int(chainage // 1000)
        assert chainage == pytest.approx(x - ORIGIN[0] + START, abs=1e-6)
        assert time == pytest.approx(x - ORIGIN[0], abs=1e-6)
        assert intensity == pytest.approx(y - ORIGIN[1], abs=1e-4)
        assert (segment, scan_id, name) == (None, 1, "a.laz")

    row = survey.execute(
        "SELECT checksum, bytes, chainage_from, chainage_to, extent, srid, path FROM tunnel.scan_file"
    ).fetchone()
    assert row[0] == subprocess.run(["sha256sum", path], capture_output=True, text=True, check=True).stdout[:64]
    assert row[1] == path.stat().st_size
    np.testing.assert_allclose(row[2:4], [980, 1020], atol=0.2)
    np.testing.assert_allclose(row[4], (ORIGIN + np.array([[10, -2, -2], [50, 2, 2]])).ravel(), atol=0.2)
    assert row[5:] == (None, str(path))
    assert runs(survey) == [(None, "done", None), (0, "done", None), (1, "done", None)]


def test_rows_lie_in_the_order_of_chainage(survey: psycopg.Connection, tmp_path: Path) -> None:
    xyz = tube(980, 1020, 200, seed=1)
    load(survey, [write(tmp_path / "a.laz", np.random.default_rng(0).permutation(xyz))])
    names = [row[0] for row in survey.execute("SELECT relname FROM pg_class WHERE relname ~ '^point_s1_km[0-9]+$' ORDER BY 1")]
    assert names == ["point_s1_km0", "point_s1_km1"]
    for name in names:
        chainage = [row[0] for row in survey.execute(f"SELECT chainage FROM tunnel.{name} ORDER BY ctid")]
        assert chainage == sorted(chainage)
        methods = survey.execute(
            "SELECT amname FROM pg_index i JOIN pg_class c ON c.oid = i.indexrelid JOIN pg_am a ON a.oid = c.relam "
            "WHERE i.indrelid = %s::regclass",
            [f"tunnel.{name}"],
        ).fetchall()
        assert methods == [("brin",)]


def test_loading_twice_changes_nothing(survey: psycopg.Connection, tmp_path: Path) -> None:
    path = write(tmp_path / "a.laz", tube(980, 1020, 200, seed=1))
    (first,) = load(survey, [path])
    before = survey.execute("SELECT * FROM tunnel.scan_file").fetchall(), rows(survey), runs(survey)
    (second,) = load(survey, [path])
    assert second == replace(first, state="unchanged", seconds=0.0)
    assert (survey.execute("SELECT * FROM tunnel.scan_file").fetchall(), rows(survey), runs(survey)) == before


def test_the_same_content_under_another_name_is_left_out(survey: psycopg.Connection, tmp_path: Path) -> None:
    path = write(tmp_path / "a.laz", tube(980, 1020, 200, seed=1))
    copy, other = tmp_path / "copy.laz", write(tmp_path / "other.laz", tube(980, 1020, 200, seed=2))
    copy.write_bytes(path.read_bytes())
    said, first = load(survey, [path, copy])
    assert (said.name, said.state, said.kept) == ("copy.laz", "a copy", 0)
    assert said.note == "has the same content as a.laz: left out, because all its points would count twice"
    assert first.kept > 0
    before = rows(survey)
    (said,) = load(survey, [copy])
    assert said.note is not None
    assert said.note.startswith("has the same content as a.laz, which is in the survey: left out")
    assert rows(survey) == before
    load(survey, [copy, other])
    assert survey.execute("SELECT name FROM tunnel.scan_file ORDER BY 1").fetchall() == [("a.laz",), ("other.laz",)]


def test_a_copy_that_was_loaded_is_told(survey: psycopg.Connection, tmp_path: Path) -> None:
    load(survey, [write(tmp_path / name, tube(980, 1020, 200, seed=seed)) for seed, name in enumerate(("a.laz", "copy.laz"))])
    assert survey.execute("SELECT count(*) FROM tunnel_api.remark").fetchone() == (0,)
    survey.execute("UPDATE tunnel.scan_file SET checksum = (SELECT checksum FROM tunnel.scan_file WHERE name = 'a.laz')")
    ((name, remark),) = survey.execute("SELECT file, remark FROM tunnel_api.remark").fetchall()
    assert name == "copy.laz"
    assert remark.startswith("has the same content as a.laz: ")
    assert remark.endswith("remove-file s copy.laz")


def test_a_file_that_is_removed_while_it_is_compared_is_loaded(
    survey: psycopg.Connection, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write(tmp_path / "a.laz", tube(980, 1020, 200, seed=1))
    load(survey, [path])
    before = rows(survey)
    checksum = scan_files.checksum

    def then_removed(given: Path) -> str:
        monkeypatch.setattr(scan_files, "checksum", checksum)
        remove_files(survey, get_survey(survey, SURVEY), [path.name])
        return checksum(given)

    monkeypatch.setattr(scan_files, "checksum", then_removed)
    (loaded,) = load(survey, [path])
    assert loaded.state == "loaded"
    assert rows(survey) == before


def test_a_file_that_was_moved_is_known_and_found(survey: psycopg.Connection, tmp_path: Path) -> None:
    path = write(tmp_path / "a.laz", tube(980, 1020, 200, seed=1))
    load(survey, [path])
    before = rows(survey)
    (tmp_path / "archive").mkdir()
    path = path.rename(tmp_path / "archive" / "a.laz")
    assert [loaded.state for loaded in load(survey, [path]) + load(survey, [path])] == ["moved", "unchanged"]
    assert survey.execute("SELECT path FROM tunnel.scan_file").fetchall() == [(str(path),)]
    assert rows(survey) == before


def test_the_order_of_files_does_not_matter(
    survey: psycopg.Connection, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shared = tube(995, 1005, 50, seed=3)  # the very same points in two files
    paths = [
        write(tmp_path / "a.laz", np.concatenate([tube(975, 1005, 200, seed=1), shared])),
        write(tmp_path / "b.laz", np.concatenate([tube(990, 1025, 200, seed=2), shared])),
        write(tmp_path / "c.laz", tube(985, 1015, 100, seed=4)),
    ]
    found = []
    for order in ([0], [1], [2]), ([2], [0], [1]), ([2, 1, 0],):
        for batch in order:
            load(survey, [paths[k] for k in batch])
        counts = files(survey)
        kept = survey.execute(
            "SELECT f.name, count(*) FROM tunnel.point p JOIN tunnel.scan_file f ON f.id = file_id GROUP BY 1"
        )
        assert {name: count[-1] for name, count in counts.items()} == dict(kept.fetchall())
        assert all(points == sum(rest) for points, *rest in counts.values())
        found.append((rows(survey), counts))
        survey.execute("DELETE FROM tunnel.tunnel")
        add_survey(survey)
    assert found[0] == found[1] == found[2]
    assert len(found[0][0]) > 0


def test_the_order_of_points_and_the_disk_do_not_matter(survey: psycopg.Connection, tmp_path: Path) -> None:
    xyz = tube(975, 1025, 300, seed=1)
    expected = None
    for order, memory in ((1, 1 << 28), (2, 1 << 28), (1, 0), (2, 2_000_000)):
        path = write(tmp_path / "a.laz", np.random.default_rng(order).permutation(xyz))
        load(survey, [path], memory=memory)
        expected = expected or rows(survey)
        assert rows(survey) == expected
        survey.execute("DELETE FROM tunnel.tunnel")
        add_survey(survey)


def test_density_all_keeps_every_good_point(survey: psycopg.Connection, tmp_path: Path) -> None:
    paths = [write(tmp_path / f"{n}.laz", tube(980, 1020, 200, seed=n)) for n in (1, 2)]
    for path in paths:
        (loaded,) = load(survey, [path], FilterSettings(density=None))
        assert loaded.thinned == 0
        assert loaded.kept == loaded.points - loaded.noise
    (count,) = survey.execute("SELECT count(*) FROM tunnel.point").fetchone()
    assert count == sum(counts[-1] for counts in files(survey).values())


def test_a_survey_has_one_density(survey: psycopg.Connection, tmp_path: Path) -> None:
    path = write(tmp_path / "a.laz", tube(980, 1020, 200, seed=1))
    load(survey, [path])
    with pytest.raises(UserError, match="loaded with density 100: load with --density 100"):
        load(survey, [path], FilterSettings(density=400.0))


def test_a_file_of_other_content_replaces_the_old_one(survey: psycopg.Connection, tmp_path: Path) -> None:
    """As if the old one had never been loaded: points of its neighbour that it had displaced come back."""
    path, other = tmp_path / "a.laz", write(tmp_path / "b.laz", tube(990, 1010, 200, seed=2))
    write(path, tube(975, 1000, 300, seed=1))
    load(survey, [path, other])
    write(path, tube(1005, 1025, 100, seed=3))
    states = [loaded.state for loaded in load(survey, [path])]
    assert states == ["replaced", "reread"]
    replaced = rows(survey), files(survey)
    survey.execute("DELETE FROM tunnel.tunnel")
    add_survey(survey)
    load(survey, [path, other])
    assert (rows(survey), files(survey)) == replaced


def test_replacing_needs_the_overlapping_file(survey: psycopg.Connection, tmp_path: Path) -> None:
    path, other = tmp_path / "a.laz", write(tmp_path / "b.laz", tube(990, 1010, 200, seed=2))
    load(survey, [write(path, tube(975, 1000, 300, seed=1)), other])
    before = rows(survey), files(survey)
    write(path, tube(975, 1000, 300, seed=3))
    (tmp_path / "elsewhere").mkdir()
    moved = other.rename(tmp_path / "elsewhere" / "b.laz")
    with pytest.raises(UserError, match=r"overlaps b\.laz, which has to be read again and is not at"):
        load(survey, [path])
    assert (rows(survey), files(survey)) == before
    assert [(loaded.name, loaded.state) for loaded in load(survey, [path, moved])] == [
        ("b.laz", "moved"),
        ("a.laz", "replaced"),
        ("b.laz", "reread"),
    ]


def test_a_kilometre_that_a_new_content_leaves_is_empty(survey: psycopg.Connection, tmp_path: Path) -> None:
    path = write(tmp_path / "a.laz", tube(980, 1020, 200, seed=1))
    load(survey, [path])
    load(survey, [write(path, tube(1002, 1020, 200, seed=1))])
    assert {row[0] for row in rows(survey)} == {1}
    assert runs(survey)[-2:] == [(0, "done", None), (1, "done", None)]


def test_merging_restores_the_given_axis_chainage(survey: psycopg.Connection, tmp_path: Path) -> None:
    """The stage `segments` numbers the segments and sets the chainage by the axis found; a merge starts anew."""
    paths = [write(tmp_path / f"{n}.laz", tube(1002, 1020, 200, seed=n)) for n in (1, 2)]
    load(survey, paths)
    expected = rows(survey)
    survey.execute("DELETE FROM tunnel.tunnel")
    add_survey(survey)
    load(survey, paths[:1])
    survey.execute("UPDATE tunnel.point SET chainage = chainage + 0.3 * sin(chainage), segment = 7")
    survey.commit()
    load(survey, paths[1:])
    assert rows(survey) == expected


def test_files_of_a_kilometre_are_loaded_together(survey: psycopg.Connection, tmp_path: Path) -> None:
    spans = [(971, 980), (980, 995), (1005, 1010), (1010, 1020)]
    paths = [write(tmp_path / f"{n}.laz", tube(*span, 200, seed=n)) for n, span in enumerate(spans)]
    load(survey, paths, FilterSettings(max_distance=3.0))
    batches = survey.execute("SELECT parameters -> 'files' FROM tunnel.run WHERE km IS NULL ORDER BY id").fetchall()
    assert batches == [(["0.laz", "1.laz"],), (["2.laz", "3.laz"],)]


def test_without_intensity_it_is_nought(conn: psycopg.Connection, tmp_path: Path) -> None:
    add_survey(conn, kind="none")
    load(conn, [write(tmp_path / "a.laz", tube(1002, 1010, 200, seed=1))])
    assert {row[-2] for row in rows(conn)} == {0.0}


def test_a_table_of_points_is_the_same_survey(survey: psycopg.Connection, tmp_path: Path) -> None:
    xyz = tube(975, 985, 100, seed=1)
    load(survey, [write(tmp_path / "a.laz", xyz)])
    as_laz = {row[:8] + row[9:] for row in rows(survey)}
    las = laspy.read(tmp_path / "a.laz")
    survey.execute("DELETE FROM tunnel.scan_file")
    survey.commit()
    columns = np.column_stack([las.xyz, las.gps_time, las.point_source_id, las.Amplitude, las.classification])
    np.savetxt(tmp_path / "a.txt", columns, "%.17g", delimiter=",")
    (tmp_path / "a.txt.columns").write_text("x,y,z,gps_time,scan_id,Amplitude,classification")
    (loaded,) = load(survey, [tmp_path / "a.txt"])
    assert loaded.state == "loaded"
    assert {row[:8] + row[9:] for row in rows(survey)} == as_laz
    assert load(survey, [tmp_path / "a.txt"])[0].state == "unchanged"
    # other names make another file of it
    (tmp_path / "a.txt.columns").write_text("x,y,z,gps_time,scan_id,-,Amplitude")
    assert load(survey, [tmp_path / "a.txt"])[0].state == "replaced"


def test_what_lies_outside_of_its_system_is_told_in_every_result(survey: psycopg.Connection, tmp_path: Path) -> None:
    def told() -> list[str]:
        found = survey.execute("SELECT remark FROM tunnel_api.remark WHERE stage = 'load' ORDER BY km").fetchall()
        survey.commit()
        return [remark for (remark,) in found if "outside the area" in remark]

    path = write(tmp_path / "a.laz", tube(980, 1020, 100, seed=1))
    load(survey, [path])
    assert told() == []
    survey.execute("UPDATE tunnel.tunnel SET srid = 3794, alignment = ST_SetSRID(alignment, 3794)")
    survey.commit()
    (loaded,) = load(survey, [write(path, tube(980, 1020, 100, seed=2))])
    assert "outside the area" in str(loaded.note)
    assert len(told()) == 2  # kilometres 0 and 1
    assert "Slovenia" in told()[0]


@pytest.fixture
def cli(survey: psycopg.Connection, dsn: str) -> Callable[..., tuple[int, str, str]]:
    def run(*arguments: object) -> tuple[int, str, str]:
        result = CliRunner().invoke(main, ["--dsn", dsn, "load", *map(str, arguments)])
        return result.exit_code, result.stdout, result.stderr

    return run


def test_command(cli: Callable[..., tuple[int, str, str]], tmp_path: Path) -> None:
    path = write(tmp_path / "a.laz", tube(980, 1020, 100, seed=1))
    code, out, err = cli(SURVEY, path)
    assert (code, err) == (0, "a.laz: states no coordinate system; using the tunnel's, EPSG:25830\n")
    assert "points/s" in out
    assert "a.laz  loaded" in out
    assert "a.laz  unchanged" in cli(SURVEY, path)[1]
    for arguments, match in (
        ((SURVEY, tmp_path / "none.laz"), "none.laz: no such file"),
        ((SURVEY, path, "--density", "0.5"), "--density takes points per m²"),
        (("other", path), "no survey 'other'"),
    ):
        code, out, err = cli(*arguments)
        assert (code, out) == (2, "")
        assert err.startswith("tunneldb: ")
        assert match in err
        assert err.count("\n") == 1


def test_what_was_loaded_before_a_failure_is_told(cli: Callable[..., tuple[int, str, str]], tmp_path: Path) -> None:
    good = write(tmp_path / "a.laz", tube(971, 985, 100, seed=1))
    bad = write(tmp_path / "b.laz", tube(1010, 1020, 100, seed=2), scan_id=9)
    code, out, err = cli(SURVEY, good, bad, "--max-distance", "3")
    assert code == 2
    assert "a.laz  loaded" in out
    assert "b.laz" not in out
    assert "b.laz: no station for scan_id 9" in err


def test_a_file_that_a_batch_could_not_read_is_off_its_list_once_it_is_loaded(
    conn: psycopg.Connection, cli: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    path = write(tmp_path / "a.laz", tube(980, 1020, 100, seed=1))
    failed = (
        "INSERT INTO tunnel.incoming (survey_id, name, path, bytes, points, parameters, failed_at, message)"
        " SELECT s.id, f.name, '/there/' || f.name, 1, 0, '{}', now(), 'truncated'"
        " FROM tunnel.survey s, unnest(ARRAY['a.laz', 'b.laz']) AS f (name)"
    )
    conn.execute(failed)
    conn.commit()
    assert cli(SURVEY, path)[0] == 0
    assert conn.execute("SELECT name FROM tunnel.incoming").fetchall() == [("b.laz",)]


def test_a_real_tunnel(conn: psycopg.Connection, dsn: str) -> None:
    run = CliRunner().invoke
    axis, trajectory = str(real_scan("ringo.axis.csv")), str(real_scan("ringo.trajectory.csv"))
    arguments = (
        ["tunnel", "add", "ringo", "--srid", "3794", "--axis", axis, "--start-chainage", "511746.75"],
        [
            "survey",
            "add",
            "s",
            "--tunnel",
            "ringo",
            "--date",
            "2024-05-04",
            "--intensity-kind",
            "none",
            "--trajectory",
            trajectory,
        ],
        ["load", "s", str(real_scan("ringo.laz"))],
    )
    for words in arguments:
        result = run(main, ["--dsn", dsn, *words])
        assert result.exit_code == 0, result.output
    points, noise, outside, thinned, kept = files(conn)["ringo.laz"]
    assert points == 1_139_889 == noise + outside + thinned + kept
    # Strays and the sparse wire go; the profiles, half a metre apart, stay, a point every voxel edge.
    assert noise < 0.001 * points
    assert 75_000 < kept < 95_000
    assert {row[0] for row in rows(conn)} == {511}
