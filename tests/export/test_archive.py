"""A survey goes out into a file and comes back the same, or not at all."""

from __future__ import annotations

import json
import re
import zipfile
from collections.abc import Callable
from pathlib import Path

import psycopg
import pytest
from psycopg import sql
from psycopg.conninfo import make_conninfo
from support.example_survey import KM, NAME

from tunneldb.database import connect, install, open_connection
from tunneldb.errors import BusyError, UserError
from tunneldb.export.archive import load
from tunneldb.export.archive.load import load_survey
from tunneldb.export.archive.save import save_survey
from tunneldb.stages.ledger import lock
from tunneldb.stages.on_demand import refuse_wrong_pair
from tunneldb.stages.registry import REGISTRY
from tunneldb.store.archive.tables import EXCLUDED, archive_tables, stored_tables
from tunneldb.store.catalog import remove_survey
from tunneldb.store.survey import get_survey

NO_ROWS = {("run", "job_id"), ("point", "scan_id"), ("station", "scan_id"), ("target_sphere", "scan_id")}
"""Columns named as a number of a row that hold none of schema tunnel: the queue's jobs, scans as files count them."""

NUMBERS = re.compile(r"id|.*_id|.*_ids|row_id|number|undoes|part_of|merged|merged_into|same_as|largest_leak|imported_.*")
RENUMBERED = {"survey", "name", "old_survey", "parameters"}

PHOTO = b"\xff\xd8\xff of a crown"

STORED = "SELECT tunnel_api.finding_photo_content(id) FROM tunnel_api.finding_photo WHERE survey = %s ORDER BY id"

Rows = dict[str, list[tuple[object, ...]]]


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


def silent(text: str, total: float | None) -> Callable[[float], None]:
    return lambda count: None


def edit(conn: psycopg.Connection) -> None:
    """Review, redraw, split, merge, delete and photograph findings, and move a vertex of the axis, as people do."""
    leaks = [row[0] for row in conn.execute("SELECT id FROM tunnel_api.leak WHERE survey = %s ORDER BY id", [NAME])]
    conn.execute("UPDATE tunnel_api.leak SET review = 'confirmed', remark = 'drips' WHERE id = %s", [leaks[0]])
    conn.execute("UPDATE tunnel_api.finding_unrolled SET geom = ST_Buffer(geom, 0.1) WHERE id = %s", [leaks[1]])
    cut = "(SELECT ST_SetSRID(ST_MakeLine(ST_MakePoint(ST_XMin(g) - 1, y), ST_MakePoint(ST_XMax(g) + 1, y)), 0)"
    cut += " FROM (SELECT unrolled AS g, ST_Y(ST_Centroid(unrolled)) AS y FROM tunnel.finding WHERE id = %(id)s) q)"
    parts = conn.execute(f"SELECT tunnel_api.finding_split(%(id)s, {cut})".encode(), {"id": leaks[2]}).fetchone()
    assert parts is not None
    conn.execute("SELECT tunnel_api.finding_merge(%s)", parts)
    conn.execute("INSERT INTO tunnel_api.finding_photo (finding_id, path, caption) VALUES (%s, 'a.jpg', 'crown')", [leaks[4]])
    conn.execute("SELECT tunnel_api.finding_photo_add(%s, %b, 'crown')", [leaks[4], PHOTO])
    conn.execute(
        "INSERT INTO tunnel_api.finding_unrolled (survey, kind, geom)"
        " VALUES (%s, 'leak', ST_MakeEnvelope(12350, 1, 12351, 2, 0))",
        [NAME],
    )
    drawn = conn.execute("SELECT max(id) FROM tunnel.finding WHERE origin = 'drawn'").fetchone()
    assert drawn is not None
    conn.execute("DELETE FROM tunnel_api.finding_unrolled WHERE id = %s", [drawn[0]])
    conn.execute(
        "UPDATE tunnel_api.axis_vertex SET geom = ST_Translate(geom, 0, 0.05, 0) WHERE id ="
        " (SELECT max(id) - 3 FROM tunnel_api.axis_vertex)"
    )
    conn.commit()


def add_points(conn: psycopg.Connection) -> None:
    """Load a few points of the example's file into its kilometre."""
    name = conn.execute(
        "SELECT s.id, format('point_s%%s_km%%s_new', s.id, %s::int) FROM tunnel.survey s WHERE s.name = %s", [KM, NAME]
    ).fetchone()
    assert name is not None
    new = sql.Identifier("tunnel", name[1])
    conn.execute("SELECT tunnel_internal.partition_new(%s, %s)", [name[0], KM])
    conn.execute(
        sql.SQL(
            "INSERT INTO {} SELECT f.survey_id, %s, 12300 + n / 7.0, n / 3.0,"
            " ST_SetSRID(ST_MakePoint(n, n / 3.0, n / 9.0), 25830),"
            " nullif(n, 3), 1, f.id, n / 11.0, 2, nullif(n, 5) FROM tunnel.scan_file f CROSS JOIN generate_series(1, 50) n"
            " WHERE f.survey_id = %s"
        ).format(new),
        [KM, name[0]],
    )
    conn.execute("SELECT tunnel_internal.partition_swap(%s, %s)", [name[0], KM])
    conn.commit()


def views(conn: psycopg.Connection, survey: str, *, exact: bool) -> Rows:
    """Rows of all views about a survey, without what tells that they were imported; if not exact, also without numbers.

    Numbers with a fraction are given to twelve digits: sums are added up in another order.
    """
    listed = conn.execute(
        "SELECT c.relname, array_agg(a.attname::text ORDER BY a.attnum), array_agg(a.atttypid::regtype::text ORDER BY a.attnum)"
        " FROM pg_class c JOIN pg_attribute a ON a.attrelid = c.oid AND a.attnum > 0"
        " WHERE c.relnamespace = 'tunnel_api'::regnamespace AND c.relkind = 'v' GROUP BY c.relname"
    ).fetchall()
    found: Rows = {}
    for view, columns, types in listed:
        # bytes on the disk are no rows; schemes of ratings are the owner's, not the survey's
        if "survey" not in columns or view in ("change", "survey_size") or view.startswith("rating_"):
            continue
        kept = [
            sql.SQL("round({}::numeric, 9)").format(sql.Identifier(c)) if t == "double precision" and view != "point"
            else sql.SQL("{}::text").format(sql.Identifier(c))
            for c, t in zip(columns, types, strict=True)
            if not c.startswith("imported") and (exact or not (NUMBERS.fullmatch(c) or c in RENUMBERED))
            and not (view == "audit" and not exact and c in ("before", "after", "kept"))
        ]  # fmt: skip
        beside = sql.SQL(" AND stage <> 'import'") if view == "run" else sql.SQL("")
        query = sql.SQL("SELECT {} FROM {} WHERE survey = {}{}").format(
            sql.SQL(", ").join(kept), sql.Identifier("tunnel_api", view), sql.Literal(survey), beside
        )
        found[view] = sorted(conn.execute(query).fetchall(), key=repr)
    conn.rollback()
    return found


def different(before: Rows, after: Rows) -> dict[str, tuple[list[object], list[object]]]:
    return {
        view: (sorted({*rows} - {*after[view]}, key=repr), sorted({*after[view]} - {*rows}, key=repr))
        for view, rows in before.items()
        if rows != after[view]
    }


def save(conn: psycopg.Connection, path: Path) -> Path:
    save_survey(conn, get_survey(conn, NAME), path, silent)
    return path


def test_every_table_is_archived_or_said_not_to_be(conn: psycopg.Connection) -> None:
    tables = archive_tables(conn)
    assert stored_tables(conn) == {table.name for table in tables} | set(EXCLUDED)
    unknown = {
        (table.name, column)
        for table in tables
        for column in table.names
        if re.fullmatch(r".*_ids?", column) and column not in table.refers
    }
    assert unknown == NO_ROWS


def test_back_in_its_database_a_survey_is_what_it_was_with_its_numbers(
    example: str, conn: psycopg.Connection, tmp_path: Path
) -> None:
    edit(conn)
    add_points(conn)
    before = views(conn, NAME, exact=True)
    points = "SELECT p::text FROM tunnel.point p ORDER BY p.chainage"
    former = conn.execute(points).fetchall()
    conn.rollback()
    assert sum(map(bool, before.values())) > 50
    assert len(former) == 50
    path = save(conn, tmp_path / "demo.tdb")
    remove_survey(conn, NAME)
    conn.commit()
    loaded = load_survey(conn, path, None, silent)
    assert loaded.kept
    assert not loaded.left_out
    assert different(before, views(conn, NAME, exact=True)) == {}
    assert conn.execute(points).fetchall() == former
    assert conn.execute(STORED, [NAME]).fetchall() == [(None,), (PHOTO,)]


def test_under_another_name_it_is_the_same_up_to_numbers_and_steps_can_be_taken_back(
    example: str, conn: psycopg.Connection, tmp_path: Path
) -> None:
    edit(conn)
    add_points(conn)
    before = views(conn, NAME, exact=False)
    loaded = load_survey(conn, save(conn, tmp_path / "demo.tdb"), "other", silent)
    assert not loaded.kept
    assert different(before, views(conn, "other", exact=False)) == {}
    assert conn.execute(STORED, ["other"]).fetchall() == [(None,), (PHOTO,)]
    merged = conn.execute(
        "SELECT e.row_id FROM tunnel_api.audit e WHERE e.survey = 'other' AND e.after ? 'merged' AND e.imported_by IS NOT NULL"
    ).fetchone()
    assert merged is not None
    assert conn.execute("SELECT tunnel_api.finding_undo(%s)", [merged[0]]).fetchone() == ("merged",)
    untouched = conn.execute(
        "SELECT count(*) FROM tunnel.finding a JOIN tunnel.survey s ON s.id = a.survey_id"
        " WHERE s.name = %s AND a.merged_into IS NOT NULL",
        [NAME],
    ).fetchone()
    strays = conn.execute(
        "SELECT count(*) FROM tunnel.point p JOIN tunnel.scan_file f ON f.id = p.file_id WHERE f.survey_id <> p.survey_id"
    ).fetchone()
    assert strays == (0,)
    assert untouched == (1,)
    listed = "SELECT DISTINCT survey FROM tunnel_api.leak_area_series((SELECT tunnel FROM tunnel_api.survey LIMIT 1))"
    assert conn.execute(listed).fetchall() == [(NAME,)]  # one scan, one date
    with pytest.raises(UserError, match="are the same scan"):
        refuse_wrong_pair(conn, get_survey(conn, NAME), get_survey(conn, "other"), "compare")
    conn.rollback()
    remove_survey(conn, NAME)
    assert conn.execute(listed).fetchall() == [("other",)]


def test_in_a_database_of_others_its_tunnel_is_added(
    example: str, conn: psycopg.Connection, empty_dsn: str, tmp_path: Path
) -> None:
    edit(conn)
    before = views(conn, NAME, exact=False)
    path = save(conn, tmp_path / "demo.tdb")
    with open_connection(empty_dsn) as fresh:
        install(fresh, REGISTRY)
    with connect(empty_dsn) as other:
        loaded = load_survey(other, path, None, silent)
        assert loaded.new_tunnel
        assert (25830,) in other.execute("SELECT srid FROM tunnel_api.layer_schemas()").fetchall()
        assert different(before, views(other, NAME, exact=False)) == {}


def test_a_tunnel_with_another_axis_and_a_name_that_is_taken_are_refused(
    example: str, conn: psycopg.Connection, tmp_path: Path
) -> None:
    path = save(conn, tmp_path / "demo.tdb")
    with pytest.raises(UserError, match="there is a survey 'demo-2024' already"):
        load_survey(conn, path, None, silent)
    conn.execute("UPDATE tunnel.tunnel SET start_chainage = start_chainage + 1")
    conn.commit()
    with pytest.raises(UserError, match="another axis"):
        load_survey(conn, path, "other", silent)


def test_a_name_that_another_took_meanwhile_is_no_damage(
    example: str, conn: psycopg.Connection, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = save(conn, tmp_path / "demo.tdb")
    monkeypatch.setattr(load, "require_new_survey", lambda conn, name: None)  # when it was looked for, it was not there
    with pytest.raises(UserError, match="there is a survey 'demo-2024' already"):
        load_survey(conn, path, None, silent)


def test_what_is_cut_off_leaves_nothing(example: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    add_points(conn)
    path = save(conn, tmp_path / "demo.tdb")
    state = (
        "SELECT (SELECT count(*) FROM pg_class WHERE relnamespace = 'tunnel'::regnamespace), (SELECT count(*) FROM tunnel.run)"
    )
    before = conn.execute(state).fetchone()

    def cut(text: str, total: float | None) -> Callable[[float], None]:
        if not text.startswith("point/"):
            return lambda count: None

        def stop(count: float) -> None:
            raise KeyboardInterrupt

        return stop

    with pytest.raises(KeyboardInterrupt):
        load_survey(conn, path, "other", cut)
    assert conn.execute(state).fetchone() == before
    conn.rollback()
    assert load_survey(conn, path, "other", silent).survey == "other"


def test_a_survey_at_work_is_not_archived(example: str, conn: psycopg.Connection, dsn: str, tmp_path: Path) -> None:
    survey = get_survey(conn, NAME)
    with connect(dsn) as worker:
        lock(worker, survey.id, KM)
        with pytest.raises(BusyError):
            save_survey(conn, survey, tmp_path / "demo.tdb", silent)
    assert list(tmp_path.iterdir()) == []


def rewritten(path: Path, change: Callable[[str, bytes], tuple[str, bytes] | None], extra: str | None = None) -> Path:
    """The same archive with members changed, and perhaps one more."""
    new = path.with_name("changed.tdb")
    with zipfile.ZipFile(path) as held, zipfile.ZipFile(new, "w") as out:
        for info in held.infolist():
            kept = change(info.filename, held.read(info))
            if kept is not None:
                out.writestr(*kept)
        if extra is not None:
            out.writestr(extra, b"x")
    return new


def said(key: str, value: object) -> Callable[[str, bytes], tuple[str, bytes] | None]:
    def change(name: str, data: bytes) -> tuple[str, bytes]:
        return name, json.dumps({**json.loads(data), key: value}).encode() if name == "manifest.json" else data

    return change


def test_damaged_and_hostile_files_are_refused_in_one_line(example: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    path = save(conn, tmp_path / "demo.tdb")
    held = path.read_bytes()
    cut, none = tmp_path / "cut.tdb", tmp_path / "none.tdb"
    cut.write_bytes(held[: len(held) // 2])
    none.write_bytes(b"not an archive")
    before = conn.execute("SELECT count(*) FROM pg_class").fetchone()
    conn.rollback()

    def refused(file: Path, why: str) -> None:
        with pytest.raises(UserError, match=why) as told:
            load_survey(conn, file, "other", silent)
        assert "\n" not in str(told.value)

    with zipfile.ZipFile(path) as archive:  # the manifest is the one member that the archive itself packs
        manifest = archive.getinfo("manifest.json")
    spoilt = bytearray(held)
    middle = manifest.header_offset + 30 + len("manifest.json") + manifest.compress_size // 2
    spoilt[middle : middle + 40] = bytes(255 - byte for byte in held[middle : middle + 40])
    (tmp_path / "spoilt.tdb").write_bytes(spoilt)
    refused(tmp_path / "spoilt.tdb", "manifest cannot be read")
    refused(cut, "is no archive")
    refused(none, "is no archive")
    refused(tmp_path / "missing.tdb", "there is no such file")
    other = zipfile.ZipFile(path).read("rows/segment.zst")
    refused(rewritten(path, lambda n, d: (n, other if n == "rows/section.zst" else d)), "section.zst|unpack")
    refused(rewritten(path, lambda n, d: None if n == "rows/run.zst" else (n, d)), "rows/run.zst")
    refused(rewritten(path, lambda n, d: (n, d), "../../etc/cron.d/x"), "not in both")
    refused(rewritten(path, said("schema", "0000")), "has schema 0000")
    refused(rewritten(path, said("format", 9)), "version 9 of the format")
    refused(rewritten(path, said("survey_id", -1)), "whole number")
    refused(rewritten(path, said("survey_id", 4711)), "does not have exactly one survey")
    refused(rewritten(path, said("members", [1])), "manifest cannot be read")
    huge = json.loads(zipfile.ZipFile(path).read("manifest.json"))["members"]
    huge["rows/run.zst"]["bytes"] = 1 << 50
    refused(rewritten(path, said("members", huge)), "which no rows do")
    assert conn.execute("SELECT count(*) FROM pg_class").fetchone() == before


@pytest.mark.parametrize("person", ["vera", "ines"], indirect=True)
def test_viewers_and_inspectors_import_nothing(person: psycopg.Connection) -> None:
    for call in (b"SELECT tunnel_internal.audit_reserve(1)", b"SELECT tunnel_internal.audit_import(1, '[]')"):
        with pytest.raises(psycopg.errors.InsufficientPrivilege):
            person.execute(call)


def test_an_operator_archives_and_restores(
    example: str, people: None, conn: psycopg.Connection, dsn: str, tmp_path: Path
) -> None:
    edit(conn)
    with connect(make_conninfo(dsn, user="otto")) as otto:
        load_survey(otto, save(otto, tmp_path / "demo.tdb"), "other", silent)
    who = conn.execute("SELECT DISTINCT imported_by FROM tunnel_api.audit WHERE survey = 'other'").fetchall()
    assert who == [("otto",)]
