"""`tunneldb survey remove-file`: what is left is as if the file had never been loaded."""

from __future__ import annotations

from pathlib import Path

import psycopg
import pytest
from click.testing import CliRunner
from support.command import command
from support.loaded_survey import SURVEY, add_survey, files, load, rows, tube, write

import tunneldb.pipeline.remove as remove
from tunneldb.cli.main import main
from tunneldb.pipeline.remove import remove_files
from tunneldb.pointcloud.selection import FilterSettings
from tunneldb.store.survey import get_survey


@pytest.fixture
def survey(conn: psycopg.Connection) -> psycopg.Connection:
    add_survey(conn)
    return conn


@pytest.fixture
def scans(tmp_path: Path) -> list[Path]:
    """Three files: a and b overlap in kilometre 0, b alone reaches into kilometre 1, c lies apart."""
    spans = (("a", 978.0, 992.0), ("b", 985.0, 1010.0), ("c", 971.0, 976.0))
    return [write(tmp_path / f"{name}.laz", tube(*span, 200, seed=k)) for k, (name, *span) in enumerate(spans)]


def tables(conn: psycopg.Connection) -> list[str]:
    found = conn.execute("SELECT relname FROM pg_class WHERE relname ~ '_km-?[0-9]+|_new$' AND relkind = 'r' ORDER BY 1")
    names = [row[0].split("_", 2)[-1] for row in found.fetchall()]
    conn.rollback()
    return names


def alone(conn: psycopg.Connection, paths: list[Path], settings: FilterSettings = FilterSettings()) -> tuple[object, ...]:  # noqa: B008
    conn.execute("DELETE FROM tunnel.tunnel")
    add_survey(conn)
    load(conn, paths, settings)
    return rows(conn), files(conn), tables(conn)


def results(conn: psycopg.Connection, km: int) -> None:
    """As if all stages had run in a kilometre, with a vertex and a reviewed leak."""
    (key,) = conn.execute("SELECT id FROM tunnel.survey").fetchone()  # type: ignore[misc]
    for stage in ("axis", "segments", "sections", "ground", "detect"):
        conn.execute(
            "INSERT INTO tunnel.run (survey_id, km, stage, started_at, finished_at, outcome)"
            " VALUES (%s, %s, %s, clock_timestamp(), clock_timestamp(), 'done')",
            [key, km, stage],
        )
    conn.execute(
        """
        INSERT INTO tunnel.finding (survey_id, km, kind, reasons, confidence, contrast, chainage_from, chainage_to, arc_from,
                                    arc_to, clock, area, darkening_mean, darkening_max, image_share, unrolled, map, surface,
                                    review)
        SELECT %(key)s, %(km)s, 'leak', '{}', 0.9, 3, m, m + 1, 0, 1, 12, 1, 3, 4, 1, ST_MakeEnvelope(m, 0, m + 1, 1, 0),
               ST_MakeEnvelope(0, 0, 1, 1, 25830), ST_GeomFromText('POLYGONZ((0 0 0, 1 0 0, 1 1 0, 0 0 0))', 25830), 'confirmed'
          FROM (SELECT %(km)s * 1000 + 2 AS m) p
        """,
        {"key": key, "km": km},
    )
    conn.commit()


@pytest.mark.parametrize("cut", [None, "read", "km 0", "km 1"])
def test_what_is_left_is_as_if_it_had_never_been_loaded(
    survey: psycopg.Connection, scans: list[Path], monkeypatch: pytest.MonkeyPatch, cut: str | None
) -> None:
    """Also when it is killed after any of its transactions and repeated."""
    load(survey, scans)
    found = get_survey(survey, SURVEY)
    survey.rollback()
    if cut is not None:
        real, seen = remove.load_kilometre, []

        def dies(conn: psycopg.Connection, survey_: object, km: int, settings: FilterSettings) -> object:
            if cut == "read" or f"km {km - 1}" == cut:
                raise KeyboardInterrupt
            seen.append(km)
            return real(conn, found, km, settings)

        monkeypatch.setattr(remove, "load_kilometre", dies)
        if cut == "km 1":  # before the last transaction
            monkeypatch.setattr(remove, "_reload", _then_dies(remove._reload))
        with pytest.raises(KeyboardInterrupt):
            remove_files(survey, found, ["b.laz"])
        monkeypatch.undo()
    removed = remove_files(survey, found, ["b.laz"])
    if cut is None:
        assert (removed.reread, removed.kilometres, removed.emptied) == (["a.laz"], [0, 1], [1])
    there = rows(survey), files(survey), tables(survey)
    assert len(there[0]) > 1000  # type: ignore[arg-type]
    assert there == alone(survey, [scans[0], scans[2]])


def _then_dies(function: object) -> object:
    def both(*arguments: object) -> None:
        function(*arguments)  # type: ignore[operator]
        raise KeyboardInterrupt

    return both


def test_files_are_read_again_as_they_were(survey: psycopg.Connection, scans: list[Path]) -> None:
    every = FilterSettings(noise_points=1)
    load(survey, scans[:1], every)
    load(survey, scans[1:2])
    remove_files(survey, get_survey(survey, SURVEY), ["b.laz"])
    assert (rows(survey), files(survey), tables(survey)) == alone(survey, scans[:1], every)


def test_reviewed_leaks_do_not_go_without_a_word(survey: psycopg.Connection, scans: list[Path]) -> None:
    load(survey, scans)
    results(survey, 0)
    results(survey, 1)
    # one that was drawn, and one that was redrawn
    survey.execute(
        "INSERT INTO tunnel.finding (survey_id, km, kind, chainage_from, chainage_to, arc_from, arc_to, clock, area, unrolled,"
        " map, surface, review, origin, manual, drawn_by, drawn_at)"
        " SELECT survey_id, km, 'spall', chainage_from + 3, chainage_to + 3, arc_from, arc_to, clock, area,"
        " ST_Translate(unrolled, 3, 0), map, surface, 'confirmed', o, o = 'drawn', 'ines', now()"
        " FROM tunnel.finding, unnest('{drawn,redrawn}'::text[]) AS o WHERE km = 1"
    )
    survey.commit()
    before = rows(survey)
    asked = CliRunner().invoke(main, ["survey", "remove-file", SURVEY, "b.laz"], input="n\n")
    assert asked.exit_code == 1
    assert "Removed: 1 leak or dry dark area, 1 of them reviewed, and " in asked.output
    assert "Kept: 2 findings drawn by hand." in asked.output
    assert rows(survey) == before
    said = command("survey", "remove-file", SURVEY, scans[1], "--yes").stderr
    assert "read again: a.laz" in said
    assert "no points are left in kilometre 1" in said
    assert "1 of them reviewed; 2 findings drawn by hand are kept" in said
    assert survey.execute("SELECT km, origin FROM tunnel.finding ORDER BY id").fetchall() == [
        (0, "detected"), (1, "drawn"), (1, "redrawn"),
    ]  # fmt: skip
    assert survey.execute("SELECT count(*) FROM tunnel_api.finding WHERE counted").fetchone() == (3,)
    # what kilometre 0 has rests on points that it has not any more, and on those of its neighbour
    state = survey.execute("SELECT DISTINCT km, stage, reason FROM tunnel_api.stage_status WHERE stale").fetchall()
    assert (0, "axis", "load ran since") in state
    assert {km for km, *_ in state} == {0}
    assert survey.execute("SELECT DISTINCT km FROM tunnel_api.stage_status").fetchall() == [(0,)]
    (remark,) = survey.execute("SELECT remark FROM tunnel_api.remark WHERE km = 1").fetchone()  # type: ignore[misc]
    assert remark.startswith(
        "no points since b.laz was removed; 2 findings drawn by hand are kept; 1 leak or dry dark area, 1 of them"
    )
    survey.rollback()
    shown = command("status", SURVEY).output
    assert "b.laz" in shown
    listed = command("survey", "list").output.splitlines()[-1].split()
    assert listed[5] == "2"


def test_an_overlapping_file_that_is_gone_is_told(survey: psycopg.Connection, scans: list[Path]) -> None:
    load(survey, scans)
    before = rows(survey), files(survey)
    moved = scans[0].rename(scans[0].with_name("elsewhere"))
    error = command("survey", "remove-file", SURVEY, "b.laz", code=2).stderr
    assert error.count("\n") == 1
    assert "b.laz overlaps a.laz, which has to be read again" in error
    assert (rows(survey), files(survey)) == before
    moved.rename(scans[0])
    command("survey", "remove-file", SURVEY, "b.laz")
    assert set(files(survey)) == {"a.laz", "c.laz"}


def test_unknown_names_and_failed_files(survey: psycopg.Connection, scans: list[Path], tmp_path: Path) -> None:
    load(survey, scans[:1])
    bad = tmp_path / "bad.laz"
    bad.write_bytes(b"no LAS")
    command("batch", SURVEY, bad, "--to", "load", code=1)
    error = command("survey", "remove-file", SURVEY, "a.laz", "x.laz", code=2).stderr
    assert error.strip() == f"tunneldb: survey {SURVEY} has no file x.laz; nothing was removed. Its files: a.laz, bad.laz"
    assert set(files(survey)) == {"a.laz"}
    assert "bad.laz" in command("status", SURVEY).output
    command("survey", "remove-file", SURVEY, "bad.laz")
    assert survey.execute("SELECT count(*) FROM tunnel.incoming").fetchone() == (0,)
    survey.rollback()
    assert "bad.laz" not in command("status", SURVEY).output
    command("batch", SURVEY, "--to", "load")
    command("survey", "remove-file", SURVEY, "a.laz")
    assert (rows(survey), files(survey), tables(survey)) == (set(), {}, [])
