"""A scan that ends between two vertices of the axis: lining beyond it is none that the survey should have seen."""

from __future__ import annotations

from typing import Any

import numpy as np
import psycopg
import pytest
from psycopg import sql
from psycopg.rows import dict_row

from tests.sql.test_statistics import GIRTH, STEP, add_coverage, add_survey
from tunneldb.report.data import find_stretch
from tunneldb.store.survey import get_survey

FROM, TO = 207.5, 483.2
"""The scan, on the given axis; segments of 10 m reach from 200 to 490 m."""


def ask(conn: psycopg.Connection, query: str, *values: object) -> list[dict[str, Any]]:
    with conn.cursor(row_factory=dict_row) as cursor:
        return cursor.execute(query, values).fetchall()  # type: ignore[arg-type]


def add_file(conn: psycopg.Connection, survey: int, name: str, low: float | None, high: float | None) -> None:
    conn.execute(
        "INSERT INTO tunnel.scan_file (survey_id, name, path, checksum, bytes, points, noise, outside, thinned, kept, "
        "chainage_from, chainage_to) VALUES (%s, %s, %s, repeat('0', 64), 1, 1, 0, 0, 0, 1, %s, %s)",
        (survey, name, f"/{name}", low, high),
    )


@pytest.fixture
def scanned(conn: psycopg.Connection) -> int:
    """A survey in two files, of which detection saw nine tenths of the lining, and nothing of what lies beyond."""
    survey = add_survey(conn, 200, 490)
    add_file(conn, survey, "b.laz", 330.0, TO)
    add_file(conn, survey, "a.laz", FROM, 340.0)
    add_file(conn, survey, "empty.laz", None, None)
    at = STEP * (np.arange(10_000) + 0.5)
    lining = np.where((at > 200) & (at < 490), STEP * GIRTH, 0)
    seen = np.where((at > FROM) & (at < TO), 0.9 * lining, 0)
    add_coverage(conn, survey, 0, lining, seen, 0 * seen)
    return survey


def test_what_is_stated_ends_with_the_points(conn: psycopg.Connection, scanned: int) -> None:
    whole = ("s", "-Infinity", "Infinity")
    rows = [
        *ask(conn, "SELECT * FROM tunnel_api.leak_statistics(%s, %s, %s)", *whole),
        *ask(conn, "SELECT * FROM tunnel_api.km_waterproof"),
        *ask(conn, "SELECT * FROM tunnel_api.km_statistics"),
    ]
    for row in rows:
        assert (row["chainage_from"], row["chainage_to"]) == (pytest.approx(FROM), pytest.approx(TO))
    rows += ask(conn, "SELECT * FROM tunnel_api.coverage(%s, %s, %s)", *whole)
    for row in rows:
        assert row["lining_area"] == pytest.approx(GIRTH * (TO - FROM), rel=1e-6)
        assert row["seen_share"] == pytest.approx(0.9, rel=1e-6)
    conn.commit()
    assert find_stretch(conn, get_survey(conn, "s"), -np.inf, np.inf) == (pytest.approx(FROM), pytest.approx(TO))


def test_ends_lie_on_the_axis_that_was_found(conn: psycopg.Connection, scanned: int) -> None:
    """Three quarters of the first segment, and a third of the last, whatever their lengths."""
    conn.execute("UPDATE tunnel.segment SET chainage_to = 210.4 WHERE n = 20")
    conn.execute("UPDATE tunnel.segment SET chainage_from = 480.4, chainage_to = 490.6 WHERE n = 48")
    (row,) = ask(conn, "SELECT * FROM tunnel_api.survey_ends(%s)", scanned)
    assert row["chainage_from"] == pytest.approx(200 + 0.75 * 10.4)
    assert row["chainage_to"] == pytest.approx(480.4 + 0.32 * 10.2)


def test_files_beyond_the_axis_do_not_widen_it(conn: psycopg.Connection, scanned: int) -> None:
    add_file(conn, scanned, "far.laz", 120.0, 900.0)
    (row,) = ask(conn, "SELECT * FROM tunnel_api.survey_ends(%s)", scanned)
    assert (row["chainage_from"], row["chainage_to"]) == (200, 490)


def test_rings_at_the_ends_state_the_part_that_was_scanned(conn: psycopg.Connection, scanned: int) -> None:
    rings = ask(conn, "SELECT * FROM tunnel_api.ring_statistics('s', 2, 200)")
    assert [(rings[n]["number"], rings[n]["chainage_from"], rings[n]["chainage_to"]) for n in (0, -1)] == [
        (4, 206, 208), (142, 482, 484),
    ]  # fmt: skip
    assert [ring["seen_share"] for ring in rings] == pytest.approx([0.9] * 139, rel=1e-5)
    assert sum(ring["lining_area"] for ring in rings) == pytest.approx(GIRTH * (TO - FROM), rel=1e-6)
    (one,) = ask(conn, "SELECT * FROM tunnel_api.ring_statistics('s', 1000, 0)")
    assert (one["chainage_from"], one["chainage_to"], one["lining_area"]) == (0, 1000, pytest.approx(GIRTH * (TO - FROM)))


def add_sections(conn: psycopg.Connection, survey: int) -> None:
    conn.execute(
        "INSERT INTO tunnel.section (survey_id, km, segment, half, chainage, half_width, angle_step, radius, arc, geom, points,"
        " interpolated) SELECT %s, 0, n, 25, 10 * n + 2.5, 0.1, 5, array_fill(3.0::float8, ARRAY[361]),"
        " (SELECT array_agg((i - 180) * 0.05 ORDER BY i) FROM generate_series(0, 360) i),"
        " 'SRID=25830;LINESTRING Z (0 0 0, 1 0 0)', 1, 0 FROM generate_series(20, 48) n",
        [survey],
    )


def test_sheets_are_those_of_the_scan(conn: psycopg.Connection, scanned: int) -> None:
    add_sections(conn, scanned)
    sheets = ask(conn, "SELECT * FROM tunnel_api.sheet ORDER BY number")
    assert [sheet["number"] for sheet in sheets] == [4, 5, 6, 7, 8, 9]
    assert [sheet["seen_share"] for sheet in sheets] == pytest.approx([0.9] * 6, rel=0.01)
    conn.execute("UPDATE tunnel.scan_file SET chainage_to = 450.5 WHERE name = 'b.laz'")
    assert len(ask(conn, "SELECT FROM tunnel_api.sheet")) == 5


def darken(conn: psycopg.Connection, survey: int) -> None:
    """Leave unseen 8 m over the edge of two sheets, 20 m within one, and 3 m; notes say more of the kilometre and a file."""
    at = STEP * (np.arange(10_000) + 0.5)
    lining = np.where((at > 200) & (at < 490), STEP * GIRTH, 0)
    dark = ((at > 246) & (at < 254)) | ((at > 310) & (at < 330)) | ((at > 420) & (at < 423))
    seen = np.where((at > FROM) & (at < TO) & ~dark, 0.9 * lining, 0)
    conn.execute("DELETE FROM tunnel.coverage WHERE survey_id = %s", [survey])
    add_coverage(conn, survey, 0, lining, seen, 0 * seen)
    conn.execute("UPDATE tunnel.scan_file SET points = 100, noise = 30 WHERE name = 'b.laz'")
    conn.execute(
        "INSERT INTO tunnel.run (survey_id, km, stage, outcome, finished_at, counts)"
        " SELECT %s, 0, name, 'done', clock_timestamp(), jsonb_build_object('note', name || ' says') FROM tunnel.stage"
        " WHERE name <> 'axis' AND NOT on_demand ORDER BY step",
        [survey],
    )


def test_of_stretches_together_is_said_what_is_said_of_each(conn: psycopg.Connection, scanned: int) -> None:
    darken(conn, scanned)
    starts = [*np.arange(150.0, 550.0, 50.0), 200.0, 250.0, -np.inf, 247.0, 300.0]
    ends = [*np.arange(200.0, 600.0, 50.0), 300.0, 252.0, np.inf, 253.0, 300.0]
    said = {}
    for schema, name in (("tunnel_api", "coverage_statement"), ("tunnel_internal", "remark_statement")):
        each = sql.SQL("SELECT {}(%s, %s, %s)").format(sql.Identifier(schema, name))
        together = sql.SQL("SELECT * FROM {}(%s, %s, %s)").format(sql.Identifier("tunnel_internal", f"{name}s"))
        found = dict(conn.execute(together, [scanned, starts, ends]).fetchall())
        said[name] = [found.get(n) for n in range(1, len(starts) + 1)]
        singly = [conn.execute(each, [scanned, *stretch]).fetchone() for stretch in zip(starts, ends, strict=True)]
        assert [(one,) for one in said[name]] == singly
        assert len({one or "" for one in said[name]}) > 3
    stretch_of = dict(zip(zip(starts, ends, strict=True), said["coverage_statement"], strict=True))
    assert "unseen" not in str(stretch_of[200.0, 250.0]), "4 m on each of the sheets"
    assert "unseen 0+246–0+254" in str(stretch_of[200.0, 300.0])
    assert "unseen 0+310–0+330" in str(stretch_of[300.0, 350.0])
    assert "b.laz: " in str(said["remark_statement"][4])


def test_what_is_to_be_said_of_sheets_is_asked_once_a_survey(conn: psycopg.Connection, scanned: int) -> None:
    add_sections(conn, scanned)
    darken(conn, scanned)
    conn.execute("SET LOCAL track_functions = 'all'")
    query = "SELECT chainage_from, chainage_to, gaps, remarks FROM tunnel_api.sheet WHERE survey = 's' ORDER BY number"
    sheets = ask(conn, query)
    (asked,) = ask(
        conn,
        "SELECT coalesce(sum(calls) FILTER (WHERE funcname LIKE 'coverage_gaps%%'), 0) AS gaps,"
        " coalesce(sum(calls) FILTER (WHERE funcname LIKE 'remarks%%'), 0) AS remarks FROM pg_stat_xact_user_functions",
    )
    assert asked == {"gaps": 1, "remarks": 1}
    for sheet in sheets:
        low, high = max(sheet["chainage_from"], FROM), min(sheet["chainage_to"], TO)
        (each,) = ask(
            conn,
            "SELECT tunnel_api.coverage_statement(%s, %s, %s) AS gaps, tunnel_internal.remark_statement(%s, %s, %s) AS remarks",
            *(scanned, low, high) * 2,
        )
        assert (sheet["gaps"], sheet["remarks"]) == (each["gaps"], each["remarks"])
    assert len({sheet["gaps"] for sheet in sheets}) > 2


@pytest.mark.parametrize("condition", ["survey = 's'", "survey_id = (SELECT id FROM tunnel.survey WHERE name = 's')"])
def test_gaps_of_one_survey_ask_of_no_other(conn: psycopg.Connection, scanned: int, condition: str) -> None:
    darken(conn, scanned)
    conn.execute(
        "INSERT INTO tunnel.survey (tunnel_id, name, date, intensity_kind, platform)"
        " SELECT tunnel_id, 'other' || n, date, 'none', 'static' FROM tunnel.survey, generate_series(1, 3) n WHERE id = %s",
        [scanned],
    )
    conn.execute("SET LOCAL track_functions = 'all'")
    assert ask(conn, f"SELECT * FROM tunnel_api.coverage_gap WHERE {condition}")
    (asked,) = ask(conn, "SELECT sum(calls) AS calls FROM pg_stat_xact_user_functions WHERE funcname LIKE 'coverage_gaps%%'")
    assert asked["calls"] == 1
