"""Where the scanner was, on the example's arc of 300 m: chainage, times, speed, gaps, and who may see it."""

from __future__ import annotations

from typing import Any

import numpy as np
import psycopg
import pytest
from support.example_survey import SRID, example_surface

from tunneldb.store.scanner import Positions, save_positions

RATE, SPEED = 10, 2.0  # poses a second; m/s
GAP = (30.0, 35.0)  # s
BEGIN = 999_980.0  # s: 40 s before a whole minute


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


def places(chainage: np.ndarray) -> np.ndarray:
    """Along the chords of the axis, 1 m above it."""
    _, vertices = example_surface()
    at = 12300 + 10.0 * np.arange(len(vertices))
    return np.column_stack([np.interp(chainage, at, vertices[:, i]) + (i == 2) for i in range(3)])


@pytest.fixture
def survey_id(conn: psycopg.Connection[Any], example: str) -> int:
    row = conn.execute("SELECT id FROM tunnel.survey WHERE name = %s", [example]).fetchone()
    assert row is not None
    return int(row[0])


def test_stations_have_their_chainage(conn: psycopg.Connection[Any], survey_id: int) -> None:
    chainage = np.array([12310.0, 12403.0, 12488.0])
    with conn.cursor() as cursor:
        cursor.executemany(
            "INSERT INTO tunnel.station VALUES (%s, %s, ST_SetSRID(ST_MakePoint(%s, %s, %s), %s))",
            [(survey_id, n, *xyz, SRID) for n, xyz in enumerate(places(chainage).tolist())],
        )
    found = "SELECT scan_id, chainage, label, date::text, ST_SRID(geom) FROM tunnel_api.scan_station ORDER BY scan_id"
    for sections in (True, False):  # by the lining, and by the axis as given
        if not sections:
            conn.execute("DELETE FROM tunnel.section")
        conn.execute("SET LOCAL ROLE tunnel_viewer")
        rows = conn.execute(found).fetchall()
        assert [row[1] for row in rows] == pytest.approx(chainage, abs=0.03)
        assert [float(row[2].replace("+", "")) for row in rows] == pytest.approx(chainage, abs=0.03)
        assert {row[3:] for row in rows} == {("2024-05-04", SRID)}
        conn.execute("RESET ROLE")


def test_a_trajectory_is_a_line_a_minute_without_its_gaps(conn: psycopg.Connection[Any], survey_id: int) -> None:
    time = np.arange(0, 80 * RATE + 1) / RATE
    time = time[(time <= GAP[0]) | (time >= GAP[1])]
    xyz = places(12490.0 - SPEED * time)
    save_positions(conn, survey_id, Positions(True, BEGIN + time, xyz), SRID)
    conn.execute("SET LOCAL ROLE tunnel_viewer")
    rows = conn.execute(
        "SELECT time_from, time_to, chainage_from, chainage_to, upwards, poses, speed, ST_NPoints(geom), label_from"
        "  FROM tunnel_api.trajectory ORDER BY time_from"
    ).fetchall()
    times = [(row[0] - BEGIN, row[1] - BEGIN) for row in rows]
    assert times == [(0, GAP[0]), (GAP[1], 40), (40, 80)]
    for (begin, end), (_, _, low, high, upwards, poses, speed, vertices, label) in zip(times, rows, strict=True):
        assert (low, high) == pytest.approx((12490 - SPEED * end, 12490 - SPEED * begin), abs=0.02)
        assert upwards is False
        assert speed == pytest.approx(SPEED, rel=1e-3)
        assert vertices == end - begin + 1
        assert label.startswith("12+")
        assert abs(poses - RATE * (end - begin)) <= 1
    assert sum(row[5] for row in rows) == len(time)


def test_beyond_the_axis_there_is_no_chainage(conn: psycopg.Connection[Any], survey_id: int) -> None:
    conn.execute(
        "INSERT INTO tunnel.station SELECT %s, 1, ST_Translate(ST_StartPoint(alignment), 0, -50) FROM tunnel.tunnel",
        [survey_id],
    )
    assert conn.execute("SELECT chainage, label FROM tunnel_api.scan_station").fetchall() == [(None, None)]
