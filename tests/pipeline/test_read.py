"""Reading files and loading kilometres apart, as the jobs of a queue do."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
import psycopg
import pytest
from click.testing import CliRunner
from support.loaded_survey import ORIGIN, START, SURVEY, add_survey, files, load, rows, tube, write

from tunneldb.cli.main import main
from tunneldb.database import open_connection
from tunneldb.errors import UserError
from tunneldb.pipeline.load import load_kilometre, parameters_of, settings_of
from tunneldb.pipeline.read import read_file
from tunneldb.pointcloud.selection import MARGIN, FilterSettings
from tunneldb.pointcloud.spool import ROW, Rows, Spool
from tunneldb.store.partition import read_fragment, write_fragments
from tunneldb.store.survey import get_survey

SETTINGS = FilterSettings()


@pytest.fixture
def survey(conn: psycopg.Connection) -> psycopg.Connection:
    add_survey(conn)
    return conn


@pytest.fixture
def other(survey: psycopg.Connection, dsn: str) -> Iterator[psycopg.Connection]:
    """A second session."""
    with open_connection(dsn) as connection:
        connection.execute("SET lock_timeout = '2s'")
        connection.commit()
        yield connection


def read(conn: psycopg.Connection, path: Path, settings: FilterSettings = SETTINGS) -> dict[str, object]:
    return read_file(conn, get_survey(conn, SURVEY), path, settings)


def load_km(conn: psycopg.Connection, km: int, settings: FilterSettings = SETTINGS) -> dict[str, object]:
    return load_kilometre(conn, get_survey(conn, SURVEY), km, settings)


def waiting(conn: psycopg.Connection) -> list[tuple[str, int]]:
    found = conn.execute(
        "SELECT f.name, k.km FROM tunnel.file_km k JOIN tunnel.scan_file f ON f.id = k.file_id"
        " WHERE k.loaded_at IS NULL ORDER BY 1, 2"
    ).fetchall()
    conn.commit()
    return found


def fragments(conn: psycopg.Connection) -> list[str]:
    found = conn.execute("SELECT relname FROM pg_class WHERE relname ~ '^fragment_' ORDER BY 1").fetchall()
    conn.commit()
    return [row[0] for row in found]


def empty(conn: psycopg.Connection) -> None:
    conn.execute("DELETE FROM tunnel.tunnel")
    add_survey(conn)


def test_what_was_read_waits_until_it_is_loaded(survey: psycopg.Connection, tmp_path: Path) -> None:
    path = write(tmp_path / "a.laz", tube(980, 1020, 200, seed=1))
    counts = read(survey, path)
    survey.commit()
    assert (counts["file"], counts["state"], counts["kilometres"]) == ("a.laz", "loaded", [0, 1])
    assert counts["note"] == "states no coordinate system; using the tunnel's, EPSG:25830"
    assert waiting(survey) == [("a.laz", 0), ("a.laz", 1)]
    (number,) = survey.execute("SELECT id FROM tunnel.scan_file").fetchone()
    assert [name.split("_f")[1] for name in fragments(survey)] == [f"{number}_km0", f"{number}_km1"]
    assert rows(survey) == set()
    assert files(survey)["a.laz"][-1] == 0

    assert read(survey, path)["state"] == "unchanged"
    assert waiting(survey) == [("a.laz", 0), ("a.laz", 1)]

    (held,) = survey.execute("SELECT rows FROM tunnel.file_km WHERE km = 1").fetchone()
    assert load_km(survey, 1) == {"files": 1, "kept": held}
    survey.commit()
    assert waiting(survey) == [("a.laz", 0)]
    assert [name.split("_f")[1] for name in fragments(survey)] == [f"{number}_km0"]
    assert {row[0] for row in rows(survey)} == {1}
    assert files(survey)["a.laz"][-1] == len(rows(survey)) == held
    assert load_km(survey, 1) == {"files": 0, "kept": held}  # nothing waits: nothing is done
    survey.commit()
    load_km(survey, 0)
    survey.commit()
    assert fragments(survey) == waiting(survey) == []
    points, *parts = files(survey)["a.laz"]
    assert points == sum(parts)
    apart = rows(survey), files(survey)
    empty(survey)
    load(survey, [path])
    assert (rows(survey), files(survey)) == apart


def test_a_rollback_leaves_nothing(survey: psycopg.Connection, tmp_path: Path) -> None:
    read(survey, write(tmp_path / "a.laz", tube(980, 1020, 200, seed=1)))
    survey.rollback()
    assert fragments(survey) == waiting(survey) == []
    assert files(survey) == {}


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_any_split_and_any_order_gives_the_same_rows(survey: psycopg.Connection, tmp_path: Path, seed: int) -> None:
    """The points of a file, dealt out to other files, read and loaded in whatever order."""
    rng = np.random.default_rng(seed)
    xyz = tube(975, 1025, 300, seed=seed)
    every = FilterSettings(noise_points=1)  # what is noise in a file depends on which points are in it
    load(survey, [write(tmp_path / "a.laz", xyz)], every)
    expected = {row[:8] + row[9:] for row in rows(survey)}
    assert len(expected) > 20_000
    for count in (2, 5):
        empty(survey)
        # Some parts are the whole tunnel at lower density, some are stretches of it.
        dealt = rng.integers(0, count, len(xyz)) if count == 2 else ((xyz[:, 0] - xyz[:, 0].min()) // 10.1).astype(int)
        paths = [write(tmp_path / f"{seed}-{count}-{n}.laz", xyz[dealt == n]) for n in range(count)]
        todo = [("read", path) for path in paths] + [("load", km) for km in (0, 1)] * 3
        for what, thing in (todo[k] for k in rng.permutation(len(todo))):
            read(survey, thing, every) if what == "read" else load_km(survey, thing, every)
            survey.commit()
        for km in rng.permutation(2).tolist():
            load_km(survey, km, every)
            survey.commit()
        found = {row[:8] + row[9:] for row in rows(survey)}
        assert found == expected
        assert all(points == sum(rest) for points, *rest in files(survey).values())


@pytest.mark.parametrize("loaded", [True, False])
def test_a_file_read_anew_leaves_every_kilometre_that_it_touched(
    survey: psycopg.Connection, tmp_path: Path, loaded: bool
) -> None:
    path, neighbour = tmp_path / "a.laz", write(tmp_path / "b.laz", tube(985, 1005, 200, seed=2))
    for one in (write(path, tube(975, 1010, 200, seed=1)), neighbour):
        read(survey, one)
    if loaded:
        load_km(survey, 0)
        load_km(survey, 1)
    survey.commit()
    write(path, tube(1019, 1032, 200, seed=3))
    counts = read(survey, path)
    survey.commit()
    assert (counts["state"], counts["kilometres"]) == ("replaced", [0, 1])
    for km in (1, 0):
        load_km(survey, km)
        survey.commit()
    assert waiting(survey) == fragments(survey) == []
    found = rows(survey), files(survey)
    ranges = survey.execute("SELECT f.name, k.km FROM tunnel.file_km k JOIN tunnel.scan_file f ON f.id = file_id ORDER BY 1, 2")
    assert ranges.fetchall() == [("a.laz", 1), ("b.laz", 0), ("b.laz", 1)]
    empty(survey)
    load(survey, [path, neighbour])
    assert (rows(survey), files(survey)) == found


def test_ranges_hold_the_points_of_a_kilometre_and_its_margin(survey: psycopg.Connection, tmp_path: Path) -> None:
    xyz = tube(971, 1025, 400, seed=1)
    xyz = xyz[np.argsort(xyz[:, 0])]  # as a profiler scans
    far = np.tile(ORIGIN + np.array([10.0, 100.0, 0.0]), (70_000, 1))
    path = write(tmp_path / "a.laz", np.concatenate([far, xyz]))
    read(survey, path)
    found = survey.execute("SELECT km, points FROM tunnel.file_km ORDER BY km").fetchall()
    chainage = np.concatenate([np.full(len(far), np.nan), xyz[:, 0] - ORIGIN[0] + START])
    assert [km for km, _ in found] == [0, 1]
    for km, ranges in found:
        inside = np.zeros(len(chainage), bool)
        for part in ranges:
            inside[part.lower : part.upper] = True
            assert part.lower % 50_000 == 0
            assert part.upper % 50_000 == 0 or part.upper == len(chainage)
        wanted = (chainage >= km * 1000 - MARGIN) & (chainage < (km + 1) * 1000 + MARGIN)
        assert inside[wanted].all()
        assert len(ranges) == 1
        blocks = np.flatnonzero(wanted) // 50_000
        assert inside.sum() <= 50_000 * len(np.unique(blocks))


def test_a_kilometre_touched_by_its_margin_alone_waits_for_nothing(survey: psycopg.Connection, tmp_path: Path) -> None:
    counts = read(survey, write(tmp_path / "a.laz", tube(1002, 1020, 200, seed=1)))
    assert counts["kilometres"] == [1]
    assert survey.execute("SELECT km, rows = 0, loaded_at IS NULL FROM tunnel.file_km ORDER BY km").fetchall() == [
        (0, True, False),
        (1, False, True),
    ]


def test_two_files_are_read_and_two_kilometres_loaded_at_once(
    survey: psycopg.Connection, other: psycopg.Connection, tmp_path: Path
) -> None:
    paths = [write(tmp_path / f"{n}.laz", tube(980, 1020, 200, seed=n)) for n in (1, 2)]
    read(survey, paths[0])
    read(other, paths[1])
    other.commit()
    survey.commit()
    load_km(survey, 0)
    with pytest.raises(UserError, match="another process is at work on kilometre 0"):
        load_km(other, 0)
    other.rollback()
    other.execute("SET lock_timeout = '2s'")
    other.commit()
    survey.commit()


def test_two_read_one_file(survey: psycopg.Connection, other: psycopg.Connection, tmp_path: Path) -> None:
    path = write(tmp_path / "a.laz", tube(1002, 1020, 100, seed=1))
    read(survey, path)
    with pytest.raises(UserError, match=r"another process is reading a\.laz"):
        read(other, path)


def test_fragments_give_back_what_was_written(survey: psycopg.Connection) -> None:
    found = get_survey(survey, SURVEY)
    rng = np.random.default_rng(1)
    rows_in: Rows = np.empty(300_000, ROW)
    for name in ROW.names:
        rows_in[name] = rng.integers(0, 200, len(rows_in)) + (rng.random(len(rows_in)) if ROW[name].kind == "f" else 0)
    rows_in["chainage"] = 990.0 + rng.random(len(rows_in)) * 20
    with Spool(1 << 20) as spool:  # the most of it lies on disk
        for part in np.array_split(rows_in, 7):
            spool.add(part)
        held = write_fragments(survey, found, 7, spool)
    assert held == {0: (rows_in["chainage"] < 1000).sum(), 1: (rows_in["chainage"] >= 1000).sum()}
    blocks = [block for km in held for block in read_fragment(survey, found, 7, km, 3)]
    assert max(block.nbytes for block in blocks) <= 8 << 20
    out = np.concatenate(blocks)
    assert set(out["tag"].tolist()) == {3}
    bins = [np.floor(block["chainage"] * 8) for block in blocks]
    assert all(before.max() < after.min() for before, after in pairwise(bins))
    names = [name for name in ROW.names if name != "tag"]
    np.testing.assert_array_equal(np.sort(out[names], order=names), np.sort(rows_in[names], order=names))
    (storage,) = survey.execute(
        "SELECT attstorage FROM pg_attribute WHERE attrelid = 'tunnel.fragment_s1_f7_km0'::regclass AND attname = 'rows'"
    ).fetchone()
    assert storage in ("e", b"e")


def test_settings_are_told_by_parameters() -> None:
    for settings in (FilterSettings(), FilterSettings(None, 3, 0.1, 12.0), FilterSettings(250.5)):
        assert settings_of(parameters_of(settings)) == settings
    assert settings_of({"load.density": "all"}).density is None
    assert settings_of({"axis.half_width": 1.0}) == FilterSettings()


def test_a_batch_says_what_it_took_for_granted_as_load_does(survey: psycopg.Connection, dsn: str, tmp_path: Path) -> None:
    paths = [write(tmp_path / f"{n}.laz", tube(*span, 100, seed=n)) for n, span in enumerate(((975, 990), (992, 997)))]
    told = "0.laz, 1.laz: states no coordinate system; using the tunnel's, EPSG:25830\n"
    arguments = ["--dsn", dsn, "batch", SURVEY, *map(str, paths), "--to", "load", "--workers", "1"]
    first = CliRunner().invoke(main, arguments)
    assert first.exit_code == 0, first.output
    assert told in first.stderr
    assert "states no" not in CliRunner().invoke(main, arguments).stderr  # nothing was read
    survey.execute("DELETE FROM tunnel.tunnel")
    add_survey(survey)
    assert told in CliRunner().invoke(main, ["--dsn", dsn, "load", SURVEY, *map(str, paths)]).stderr
