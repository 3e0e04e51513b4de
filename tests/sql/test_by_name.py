"""Functions take the name of a survey or a tunnel as they take its key."""

from __future__ import annotations

from typing import Any

import psycopg
import pytest
from psycopg import sql

SPACE = "ST_GeomFromText('LINESTRING(12344 1, 12346 2)')"

CALLS = {
    "roll": ("12345.0, 2.0, 0.1", SPACE),
    "map_strip": (SPACE,),
    "unroll": ("tunnel_api.roll('demo-2024', 12345.0, 2.0, 0.1)",),
    "unroll_shape": (f"tunnel_api.roll('demo-2024', {SPACE})",),
    "section_at": ("12345.0",),
    "survey_ends": ("",),
    "axis_deviation": ("",),
    "coverage_gaps": ("", "12300, 12400"),
    "coverage_statement": ("", "12300, 12400"),
    "remarks": ("", "12300, 12400"),
    "nearest_leaks": ("tunnel_api.roll('demo-2024', 12410.0, 0.0, 0.3), 3",),
}
"""Arguments after the survey's, of functions that need no images."""

STATIONS = {"station": ("12345.0",), "station_label": ("12345.0",), "station_pieces": ("",), "station_chainages": ("'12+345'",)}


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


def test_a_name_gives_what_its_key_gives(conn: psycopg.Connection[Any], example: str) -> None:
    key = conn.execute("SELECT id, tunnel_id FROM tunnel.survey WHERE name = %s", (example,)).fetchone()
    assert key is not None
    for calls, name, number in ((CALLS, example, key[0]), (STATIONS, "demo", key[1])):
        for function, every in calls.items():
            for arguments in every:
                rows = [
                    conn.execute(
                        sql.SQL("SELECT f::text FROM {}({}) f").format(
                            sql.Identifier("tunnel_api", function),
                            sql.SQL(", ").join([sql.Literal(first), sql.SQL(arguments)] if arguments else [sql.Literal(first)]),
                        )
                    ).fetchall()
                    for first in (name, number)
                ]
                assert rows[0] == rows[1], function
                assert rows[0] or function in ("remarks", "coverage_gaps"), function


def test_a_name_that_is_none_is_refused(conn: psycopg.Connection[Any], example: str) -> None:
    for function, every in CALLS.items():
        arguments = f"'none', {every[0]}" if every[0] else "'none'"
        with pytest.raises(psycopg.errors.RaiseException, match="there is no survey none"), conn.transaction():
            conn.execute(f"SELECT tunnel_api.{function}({arguments})".encode())


def test_a_wrong_name_gives_no_empty_answer(conn: psycopg.Connection[Any], example: str) -> None:
    for call in (
        "wet_area('none', 12300, 12400)",
        "depth('none', 12300, 0)",
        "bed_volume('none', 12300, 12400, 0)",
        "ring_series('none', 12300)",
        "leak_area_series('none')",
    ):
        with pytest.raises(psycopg.errors.RaiseException, match=r"there is no (survey|tunnel) none"), conn.transaction():
            conn.execute(f"SELECT * FROM tunnel_api.{call}".encode())


@pytest.mark.parametrize(
    "point", ["ST_MakePoint(272039.859, 4765020.741)", "ST_SetSRID(ST_MakePoint(272039.859, 4765020.741), 25830)"]
)
def test_a_point_without_height_is_refused(conn: psycopg.Connection[Any], example: str, point: str) -> None:
    for function in ("nearest_leaks", "unroll"):
        with (
            pytest.raises(psycopg.errors.InvalidParameterValue, match="the point has no height: it must be 3D"),
            conn.transaction(),
        ):
            conn.execute(f"SELECT * FROM tunnel_api.{function}('{example}', {point})".encode())


def test_points_state_the_name_of_their_survey(conn: psycopg.Connection[Any], example: str) -> None:
    plan = conn.execute("EXPLAIN SELECT count(*) FROM tunnel_api.point WHERE survey_id = 1 AND km = 12").fetchall()
    assert not [line for (line,) in plan if "survey s" in line], "the name costs nothing where it is not asked for"
    assert conn.execute("SELECT survey FROM tunnel_api.point LIMIT 0").description is not None
