"""Refused statements say what to write: each test provokes the message, writes that, and succeeds."""

from __future__ import annotations

import re
from typing import Any

import psycopg
import pytest

POINT = "SELECT ST_X(geom) AS x, ST_Y(geom) AS y, ST_Z(geom) AS z FROM tunnel_api.axis_vertex WHERE n = 1240"
MAP = "SELECT ST_Buffer(ST_SetSRID(ST_MakePoint(x, y), 25830), 0.5, 1) AS geom FROM p"
INSERT = "INSERT INTO tunnel_api.finding{} (survey, kind, geom) SELECT 'demo-2024', 'leak', {} FROM q"
PARTS = "SELECT tunnel_api.unroll_shape('demo-2024', {}) FROM s"
TWO = "WITH s AS (SELECT ST_Collect(array_agg(geom ORDER BY n)) AS geom FROM tunnel_api.axis_vertex WHERE n IN (1240, 1243))"
CRACK = (
    "INSERT INTO tunnel_api.finding_unrolled (survey, kind, width_mm, geom)"
    " VALUES ('demo-2024', 'crack', {}, 'LINESTRING(12350 1, 12353 1)')"
)
REGION = (
    "INSERT INTO tunnel_api.region (survey, kind, geom{}) VALUES ('demo-2024', 'dry', ST_MakeEnvelope(12410, -5, 12460, 5){})"
)
DRAWN = "INSERT INTO tunnel_api.finding_unrolled (survey, kind, geom) VALUES ('demo-2024', '{}', '{}')"
WITH = f"WITH p AS ({POINT}), q AS ({MAP}) "

CASES = [
    ("SELECT tunnel_api.chainage_parse('12+345,6')", r"write (12\+345.678) or", r"SELECT tunnel_api.chainage_parse('\1')"),
    ("SELECT * FROM tunnel_api.waterproof_class('demo-2024', 12400, 12300)", "give the smaller one first",
     "SELECT * FROM tunnel_api.waterproof_class('demo-2024', 12300, 12400)"),
    ("SELECT * FROM tunnel_api.section_dimensions('demo-2024', 0)", "greater than (0)",
     r"SELECT * FROM tunnel_api.section_dimensions('demo-2024', \1.5)"),
    ("SELECT tunnel_api.survey_id('none')", "(SELECT name FROM tunnel_api.survey)", r"\1"),
    (f"WITH p AS ({POINT}) SELECT tunnel_api.unroll('demo-2024', ST_MakePoint(x, y)) FROM p",
     r"(public.ST_SetSRID\(public.ST_MakePoint\(x, y, z\), )srid\)",
     rf"WITH p AS ({POINT}) SELECT tunnel_api.unroll('demo-2024', \g<1>25830)) FROM p"),
    (f"WITH p AS ({POINT}) SELECT tunnel_api.unroll('demo-2024', ST_Transform(ST_SetSRID(ST_MakePoint(x, y, z), 25830), 25829))"
     " FROM p", r"use ST_Transform\(point, (25830)\)",
     rf"WITH p AS ({POINT}), q AS (SELECT ST_Transform(ST_SetSRID(ST_MakePoint(x, y, z), 25830), 25829) AS point FROM p)"
     r" SELECT tunnel_api.unroll('demo-2024', ST_Transform(point, \1)) FROM q"),
    (f"{TWO} {PARTS.format('geom')}", "Use (ST_Dump) for the parts",
     rf"{TWO}, d AS (SELECT (\1(geom)).geom FROM s) {PARTS.format('geom').replace(' s', ' d')}"),
    (WITH + INSERT.format("_map", "ST_Transform(geom, 25829)"), r"Transform it first .(ST_Transform)",
     WITH + INSERT.format("_map", r"\1(ST_Transform(geom, 25829), 25830)")),
    (WITH + INSERT.format("_3d", "geom"), "or in finding(_map) or", WITH + INSERT.format(r"\1", "geom")),
    (CRACK.format("0.0003"), r"is (\S+) to \S+ mm wide", CRACK.format(r"\1")),
    (CRACK.format("300"), r"is \S+ to (\S+) mm wide", CRACK.format(r"\1")),
    ("UPDATE tunnel_api.finding_unrolled SET severity = 5 WHERE id = 1", "is 1 to (4), not 5",
     r"UPDATE tunnel_api.finding_unrolled SET severity = \1 WHERE id = 1"),
    ("UPDATE tunnel_api.leak SET review = 'maybe' WHERE id = 1", "can be open, (confirmed) or",
     r"UPDATE tunnel_api.leak SET review = '\1' WHERE id = 1"),
    ("UPDATE tunnel_api.leak SET kind = 'crack' WHERE id = 1", r"can be .* or (\w+), not crack",
     r"UPDATE tunnel_api.leak SET kind = '\1' WHERE id = 1"),
    ("DELETE FROM tunnel_api.finding_unrolled WHERE id = 1", "(reject) it instead",
     r"UPDATE tunnel_api.finding_unrolled SET review = '\1ed' WHERE id = 1"),
    (REGION.format("", ""), "its (reason) must say why", REGION.format(r", \1", ", 'soot'")),
    ("INSERT INTO tunnel_api.finding_photo (finding_id) VALUES (1)", "needs a (path) or URL",
     r"INSERT INTO tunnel_api.finding_photo (finding_id, \1) VALUES (1, 'a.jpg')"),
    ("UPDATE tunnel_api.axis_vertex SET geom = ST_Transform(geom, 25829) WHERE n = 1240", r"Transform .* first .(ST_Transform)",
     r"UPDATE tunnel_api.axis_vertex SET geom = \1(ST_Transform(geom, 25829), 25830) WHERE n = 1240"),
    (DRAWN.format("spalling", "LINESTRING(12350 1, 12351 2)"),
     r"can be .*, (spall), ",
     DRAWN.format(r"\1", "POLYGON((12350 1, 12351 1, 12351 2, 12350 1))")),
    ("INSERT INTO tunnel_api.finding_unrolled (survey, kind) VALUES ('demo-2024', 'spall')", "needs a place: .* or a (point)",
     DRAWN.format("missing_bolt", r"\1(12350 1)")),
    ("UPDATE tunnel_api.finding_unrolled SET area = 5 WHERE id = 1", r"only the kind, the (severity), the width",
     r"UPDATE tunnel_api.finding_unrolled SET \1 = 3 WHERE id = 1"),
    ("UPDATE tunnel_api.leak SET area = 5 WHERE id = 1", r"only the review, the (remark) and the kind can be edited",
     r"UPDATE tunnel_api.leak SET \1 = 'drips' WHERE id = 1"),
    ("UPDATE tunnel_api.axis_vertex SET n = 1 WHERE n = 1240", r"only the position \((geom)\) can be edited",
     r"UPDATE tunnel_api.axis_vertex SET \1 = ST_Translate(geom, 0.01, 0, 0) WHERE n = 1240"),
    (REGION.format("", "").replace("'dry'", "'wet'"), r"can be dry or (homogeneous), not wet",
     REGION.format("", "").replace("'dry'", r"'\1'")),
    ("SELECT tunnel_api.finding_split(1, 'LINESTRING(12317.9 1, 12318.1 1)')", "cross it from side to side",
     "SELECT tunnel_api.finding_split(1, 'LINESTRING(12310 1, 12326 1)')"),
]  # fmt: skip
"""Refused statement, advice in its message or hint, and the statement that follows it."""


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


@pytest.mark.parametrize(("wrong", "advice", "right"), CASES, ids=[advice for _, advice, _ in CASES])
def test_a_statement(conn: psycopg.Connection[Any], wrong: str, advice: str, right: str) -> None:
    with pytest.raises(psycopg.Error) as refused, conn.transaction():
        conn.execute(wrong.encode())
    said = f"{refused.value.diag.message_primary}\n{refused.value.diag.message_hint}"
    found = re.search(advice, said)
    assert found, said
    assert conn.execute(found.expand(right).encode()).rowcount > 0
