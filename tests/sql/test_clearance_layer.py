"""Clearance as QGIS draws it: margins beside the given axis and beside the unrolled lining."""

from __future__ import annotations

import psycopg
import pytest
from support.example_clearance import TIGHT


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


def test_margins_lie_along_the_track(conn: psycopg.Connection, example: str) -> None:
    conn.execute("UPDATE tunnel.clearance_section SET track_right = CASE WHEN chainage_from < %s THEN 0 ELSE 1.5 END", [TIGHT])
    rows = conn.execute(
        "SELECT m.chainage_from, ST_Length(m.geom), ST_Distance(l.line, ST_Centroid(m.geom)),"
        " ST_Distance(ST_OffsetCurve(l.line, -1.5), ST_Centroid(m.geom)), ST_SRID(m.geom)"
        " FROM tunnel_api.clearance_map m, (SELECT ST_Force2D(alignment) AS line FROM tunnel.tunnel) l"
    ).fetchall()
    assert len(rows) == 200
    for begin, length, from_axis, from_right, srid in rows:
        assert length == pytest.approx(1.0, abs=2e-3), begin  # the axis climbs by 2 %
        # Off the arc of 300 m radius by the sagitta of 10 m at most, half of it.
        assert (from_axis if begin < TIGHT else from_right) < 0.05, begin
        assert srid == 25830
    assert all(abs(row[2] - 1.5) < 0.05 for row in rows if row[0] >= TIGHT)


def test_each_track_has_a_row_below_the_lining(conn: psycopg.Connection, example: str) -> None:
    conn.execute(
        "INSERT INTO tunnel.clearance_section (survey_id, km, gauge, track, chainage_from, chainage_to, track_right, track_up,"
        " cant, curvature, widened_left, widened_right, roll, margins, seen_share, points, inside, stray, passing, ground,"
        " outline) SELECT survey_id, km, gauge, 'left', chainage_from, chainage_to, 0, 0, 0, 0, 0, 0, 0, '{NaN}', 0, 0, 0, 0,"
        " 0, 0, outline FROM tunnel.clearance_section"
    )
    rows = conn.execute(
        "SELECT track, count(*), min(ST_XMin(geom)), max(ST_XMax(geom)), min(ST_YMin(geom)), max(ST_YMax(geom)), count(margin)"
        " FROM tunnel_api.clearance_unrolled GROUP BY track ORDER BY track"
    ).fetchall()
    (left_end,) = conn.execute("SELECT min(arc[1]) FROM tunnel.section").fetchone()  # type: ignore[misc]
    (left, *_), (single, *_) = rows
    assert (left, single) == ("left", "single")
    assert [row[1:4] for row in rows] == [(200, 12300.0, 12500.0)] * 2
    assert [row[6] for row in rows] == [0, 200]
    for number, row in enumerate(rows, start=1):
        assert row[4:6] == pytest.approx((left_end - 1.5 * number, left_end - 1.5 * number + 1.0), abs=0.05)
