"""Views of tunnel_api: keys, comments, editing, staleness, and that a condition reads its partition only."""

from __future__ import annotations

import datetime as dt
import time
from decimal import Decimal
from typing import Any

import numpy as np
import psycopg
import pytest
import shapely
from psycopg import sql
from support.example_change import add_change, add_change_run
from support.example_clearance import add_clearance_run
from support.example_deviation import add_surfaces
from support.example_sonar import save_example_registration
from support.example_structures import save_example_structures
from support.queue_rows import add_file, add_goal, add_job, add_worker
from support.system import missing

from tunneldb.classification.classes import PointClass

GEOMETRIES = {
    "axis": "LineStringZ",
    "axis_vertex": "PointZ",
    "segment": "LineStringZ",
    "section": "LineStringZ",
    "ground": "LineStringZ",
    "target_sphere": "PointZ",
}


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


def views(conn: psycopg.Connection) -> list[str]:
    rows = conn.execute("SELECT viewname FROM pg_views WHERE schemaname = 'tunnel_api' ORDER BY 1")
    return [name for (name,) in rows]


def one(conn: psycopg.Connection, query: str, *parameters: Any) -> Any:
    row = conn.execute(query, parameters).fetchone()  # type: ignore[arg-type]
    assert row is not None
    return row[0] if len(row) == 1 else row


STALE = "SELECT km, stage, reason FROM tunnel_api.stage_status WHERE stale ORDER BY km, step"


def stale(conn: psycopg.Connection) -> dict[str, str | None]:
    return dict(conn.execute("SELECT stage, reason FROM tunnel_api.stage_status WHERE stale ORDER BY step").fetchall())


@pytest.fixture
def points(conn: psycopg.Connection, example: str) -> None:
    """Points of two kilometres of two surveys, in partitions as the loader makes them."""
    other = one(
        conn,
        "INSERT INTO tunnel.survey (tunnel_id, name, date, intensity_kind, platform) "
        "SELECT id, 'other', '2025-01-01', 'none', 'static' FROM tunnel.tunnel RETURNING id",
    )
    for survey in (one(conn, "SELECT id FROM tunnel.survey WHERE name = %s", example), other):
        conn.execute(
            sql.SQL("CREATE TABLE tunnel.{} PARTITION OF tunnel.point FOR VALUES IN ({}) PARTITION BY LIST (km)").format(
                sql.Identifier(f"point_s{survey}"), sql.Literal(survey)
            )
        )
        for km in (-1, 12):
            conn.execute(
                sql.SQL("CREATE TABLE tunnel.{} PARTITION OF tunnel.{} FOR VALUES IN ({})").format(
                    sql.Identifier(f"point_s{survey}_km{km}"), sql.Identifier(f"point_s{survey}"), sql.Literal(km)
                )
            )
            conn.execute(
                "INSERT INTO tunnel.point SELECT %s, %s, %s * 1000 + i, 0, ST_SetSRID(ST_MakePoint(i, 0, 0), 25830), "
                "NULL, 1, 1, 0, 0 FROM generate_series(0, 999, 0.5) i",
                (survey, km, km),
            )


@pytest.fixture
def queue(conn: psycopg.Connection, example: str) -> None:
    """A batch under way."""
    for km in (12, 13):
        add_goal(conn, example, km)
        add_file(conn, example, f"km-{km}.laz", km)
    add_job(conn, example, 12, "axis", add_worker(conn, "calc-1", 4711))


@pytest.fixture
def stationing(conn: psycopg.Connection, example: str) -> None:
    """Two station equations."""
    conn.execute(
        "INSERT INTO tunnel.station_equation (tunnel_id, chainage, station)"
        " SELECT id, c, c FROM tunnel.tunnel, unnest('{0,1}'::int[]) c"
    )


def test_every_view_begins_with_a_stable_integer_key(
    conn: psycopg.Connection, example: str, points: None, queue: None, stationing: None
) -> None:
    conn.execute("UPDATE tunnel.scan_file SET unposed = 3")  # a remark
    conn.execute('UPDATE tunnel.finding SET evidence = \'{"faint": 2.3, "thin": -1.1}\'')
    conn.execute(
        "SELECT tunnel_internal.learned_apply(id, '1', 'recalibrated', '{}', '{}', '{}', 0.7, 0.6, NULL) FROM tunnel.tunnel"
    )
    conn.execute("INSERT INTO tunnel.photo (finding_id, path) SELECT min(id), 'p.jpg' FROM tunnel.finding")
    save_example_structures(conn, "demo-2024")
    save_example_registration(conn, "demo-2024")
    add_clearance_run(conn, "demo-2024")
    add_change(conn, "demo-2024")
    add_change_run(conn, "demo-2024")
    add_surfaces(conn, one(conn, "SELECT id FROM tunnel.survey WHERE name = %s", example))
    conn.execute("INSERT INTO tunnel.dark_band SELECT id, 12, 0, 12350, 12400, -7, -6.6, 3, 20 FROM tunnel.survey")
    conn.execute("INSERT INTO tunnel.segmentation_network (id, version, checksum, model) VALUES (7, 'toy', 'abc', '\\x00')")
    conn.execute("INSERT INTO tunnel.station SELECT survey_id, n, geom FROM tunnel.axis_vertex")
    conn.execute("INSERT INTO tunnel.pose SELECT survey_id, n, geom FROM tunnel.axis_vertex")
    conn.execute(  # the earlier survey saw kilometre 12, too
        "INSERT INTO tunnel.image (survey_id, km, kind, block, tiff) SELECT s.id, i.km, i.kind, i.block, i.tiff"
        " FROM tunnel.image i, tunnel.survey s WHERE i.kind = 'offset' AND s.name = 'demo-2023'"
    )
    conn.execute(
        "INSERT INTO tunnel.imported_image (survey_id, name, kind, colour, unit, value_from, value_to, step, pixel, placement,"
        " frames, chainage_from, chainage_to, arc_from, arc_to, source, warnings)"
        " SELECT id, 'thermal', 'thermal', false, '°C', 8, 20, 0.001, 0.02, 'coordinates', 1, 12310, 12390, -8, 8, 'a.tif',"
        " '{}' FROM tunnel.survey WHERE name = 'demo-2024'"
    )
    conn.execute("SELECT tunnel_api.crack_search_add('demo-2024', ST_MakeEnvelope(12310, -2, 12320, 2), 'photos')")
    conn.execute(
        "INSERT INTO tunnel.finding_image (finding_id, imported_image_id, outline_key, mean, surroundings, spread, share)"
        " SELECT f.id, i.id, tunnel_internal.outline_key(f.unrolled), 10.2, 11, 0.2, 1"
        " FROM tunnel.finding f, tunnel.imported_image i"
    )
    for view in views(conn):
        with conn.cursor() as cursor:
            cursor.execute(sql.SQL("SELECT * FROM tunnel_api.{}").format(sql.Identifier(view)))
            assert cursor.description is not None
            assert cursor.description[0].name == "id", view
            assert cursor.description[0].type_display in ("int4", "int8"), view
            rows = cursor.fetchall()
        assert rows, f"the example has no row for {view}"
        keys = [row[0] for row in rows]
        # a point's key is for use within a survey
        scope = [(row[1] if view == "point" else 0, row[0]) for row in rows]
        assert None not in keys, view
        assert len(set(scope)) == len(keys), view


def test_every_view_and_function_is_commented(conn: psycopg.Connection) -> None:
    assert (
        conn.execute(
            "SELECT relname FROM pg_class WHERE relnamespace = ANY (ARRAY['tunnel_api', 'tunnel_internal']::regnamespace[]) "
            "AND relkind = 'v' AND obj_description(oid, 'pg_class') IS NULL "
            "UNION ALL SELECT oid::regprocedure::text FROM pg_proc "
            "WHERE pronamespace = ANY (ARRAY['tunnel_api', 'tunnel_internal']::regnamespace[]) "
            "AND obj_description(oid, 'pg_proc') IS NULL"
        ).fetchall()
        == []
    )


def test_geometries_carry_type_z_and_srid(conn: psycopg.Connection, example: str) -> None:
    for view, kind in GEOMETRIES.items():
        query = sql.SQL(
            "SELECT DISTINCT GeometryType(geom) || repeat('Z', ST_CoordDim(geom) - 2), ST_SRID(geom) FROM tunnel_api.{}"
        )
        assert conn.execute(query.format(sql.Identifier(view))).fetchall() == [(kind.upper().replace("Z", "") + "Z", 25830)]
    assert one(conn, "SELECT DISTINCT ST_SRID(unrolled), ST_SRID(map), ST_SRID(surface), ST_CoordDim(surface) "
                     "FROM tunnel_api.leak") == (0, 25830, 25830, 3)  # fmt: skip


def test_condition_on_survey_and_km_reads_one_partition(conn: psycopg.Connection, points: None) -> None:
    survey = one(conn, "SELECT id FROM tunnel.survey WHERE name = 'other'")
    plan = conn.execute(
        "EXPLAIN SELECT count(*) FROM tunnel_api.point WHERE survey_id = %s AND km = 12 AND chainage < 12010", (survey,)
    ).fetchall()
    text = "\n".join(line for (line,) in plan)
    assert f"point_s{survey}_km12" in text
    assert text.count("Scan on point_s") == 1


def test_axis_line_passes_its_vertices_in_order(conn: psycopg.Connection, example: str) -> None:
    wkb, low, high, label, vertices, interpolated = one(
        conn,
        "SELECT ST_AsBinary(geom), chainage_from, chainage_to, label_to, vertices, interpolated FROM tunnel_api.axis",
    )
    line = shapely.from_wkb(bytes(wkb))
    assert (low, high, label, vertices, interpolated) == (12300, 12500, "12+500.000", 21, 2)
    # R = 300 m, 200 m of arc: chords of 10 m fall short of it by 1/24 of the square of the angle
    assert line.length == pytest.approx(200 * (1 - (10 / 300) ** 2 / 24), abs=1e-3)
    assert np.all(np.diff(shapely.get_coordinates(line)[:, 1]) > 0)


def test_section_is_unrolled_at_its_chainage_over_its_whole_girth(conn: psycopg.Connection, example: str) -> None:
    chainage, low, high, wkb = one(
        conn,
        "SELECT chainage, arc_from, arc_to, ST_AsBinary(geom) FROM tunnel_api.section_unrolled ORDER BY id LIMIT 1",
    )
    # arc of the 4 m circle down to the floor 2.5 m below the axis, and half of the floor
    half_angle = np.pi - np.arccos(2.5 / 4)
    girth = 4 * half_angle + np.sqrt(4**2 - 2.5**2)
    assert (-low, high) == pytest.approx((girth, girth), abs=0.03)
    assert shapely.get_coordinates(shapely.from_wkb(bytes(wkb))).tolist() == [[chainage, low], [chainage, high]]


def test_walls_lie_on_both_sides_in_plan_where_the_lining_is_widest(conn: psycopg.Connection, example: str) -> None:
    query = (
        "SELECT side, o.chainage_from, o.chainage_to, nearest, farthest, ST_AsBinary(o.geom), ST_AsBinary(ST_Force2D(a.geom))"
    )
    rows = conn.execute(f"{query} FROM tunnel_api.outline o JOIN tunnel_api.axis a USING (survey) ORDER BY side").fetchall()  # type: ignore[arg-type]
    assert [row[0] for row in rows] == ["left", "right"]
    for side, low, high, nearest, farthest, wall, axis in rows:
        assert (low, high) == pytest.approx((12300, 12500), abs=0.5)
        # the lining is a circle of 4 m about the axis
        assert (nearest, farthest) == pytest.approx((4, 4), abs=0.03)
        line = shapely.from_wkb(bytes(axis))
        away = [shapely.distance(line, shapely.Point(at)) for at in shapely.get_coordinates(shapely.from_wkb(bytes(wall)))]
        assert away == pytest.approx([4.0] * len(away), abs=0.1)
        assert line.parallel_offset(4, side).hausdorff_distance(shapely.from_wkb(bytes(wall))) < 0.7


def test_walls_break_where_a_segment_has_no_sections(conn: psycopg.Connection, example: str) -> None:
    pieces = "SELECT chainage_from, chainage_to FROM tunnel_api.outline WHERE side = %s ORDER BY chainage_from"
    ((first, last),) = conn.execute(pieces, ("left",)).fetchall()
    n, low, high = one(conn, "SELECT n, chainage_from, chainage_to FROM tunnel.segment ORDER BY n LIMIT 1 OFFSET 4")
    conn.execute("DELETE FROM tunnel.section WHERE segment = %s", (n,))
    for side in ("left", "right"):
        assert conn.execute(pieces, (side,)).fetchall() == [(first, low), (high, last)]


def test_leak_lies_in_the_segment_that_holds_its_middle(conn: psycopg.Connection, example: str) -> None:
    rows = conn.execute("SELECT segment, chainage_from, chainage_to, label FROM tunnel_api.leak").fetchall()
    for segment, low, high, label in rows:
        middle = (low + high) / 2
        assert segment == middle // 10
        assert label == f"12+{middle - 12000:07.3f}"


def test_moving_a_vertex_marks_it_and_what_rests_on_it(conn: psycopg.Connection, example: str) -> None:
    assert stale(conn) == {}
    conn.execute("UPDATE tunnel_api.axis_vertex SET geom = ST_Translate(geom, 0.1, 0, 0.05) WHERE n = 1240")
    source, by, recent, z = one(
        conn,
        "SELECT source, edited_by, edited_at > now() - interval '1 minute', ST_Z(geom) FROM tunnel.axis_vertex WHERE n = 1240",
    )
    assert (source, by, recent) == ("edited", one(conn, "SELECT session_user::text"), True)
    assert z == pytest.approx(602.05)
    assert stale(conn) == {
        "segments": "axis edited since",
        **dict.fromkeys(("sections", "ground", "detect"), "segments is stale"),
    }
    segments = conn.execute("SELECT n FROM tunnel_api.segment WHERE stale ORDER BY n").fetchall()
    # the two that end there, and their neighbours, whose end planes turn with it
    assert [n for (n,) in segments] == [1238, 1239, 1240, 1241]


def test_a_vertex_moved_back_leaves_nothing_stale(conn: psycopg.Connection, example: str) -> None:
    conn.execute("UPDATE tunnel_api.axis_vertex SET geom = ST_Translate(geom, 0.1, 0, 0.05) WHERE n = 1240")
    conn.execute("UPDATE tunnel_api.axis_vertex SET geom = ST_Translate(geom, -0.1, 0, -0.05) WHERE n = 1240")
    assert stale(conn) == {}
    assert one(conn, "SELECT count(*) FROM tunnel_api.segment WHERE stale") == 0


def test_an_edit_that_commits_while_a_run_goes_on_is_not_lost(conn: psycopg.Connection, example: str) -> None:
    # what the run has read are the vertices of before, though it ends after the edit's time
    conn.execute("UPDATE tunnel_api.axis_vertex SET geom = ST_Translate(geom, 0.1, 0, 0.05) WHERE n = 1240")
    conn.execute("UPDATE tunnel.run SET started_at = clock_timestamp(), finished_at = clock_timestamp() WHERE stage <> 'load'")
    assert stale(conn)["segments"] == "axis edited since"


def test_writing_the_same_place_is_no_edit(conn: psycopg.Connection, example: str) -> None:
    conn.execute("UPDATE tunnel_api.axis_vertex SET geom = geom")
    assert one(conn, "SELECT count(*) FROM tunnel.axis_vertex WHERE source = 'edited'") == 0


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ("geom = NULL", "without a position"),
        ("geom = ST_SetSRID(geom, 3794)", "SRID 25830, its new position in SRID 3794"),
        ("geom = ST_Force2D(geom)", "three finite coordinates"),
        ("geom = ST_SetSRID(ST_MakePoint('NaN', 0, 0), 25830)", "three finite coordinates"),
        ("n = n + 1", "only the position"),
        ("source = 'measured'", "only the position"),
    ],
)
def test_bad_edit_of_a_vertex_is_refused(conn: psycopg.Connection, example: str, change: str, complaint: str) -> None:
    with pytest.raises(psycopg.Error, match=complaint):
        conn.execute(f"UPDATE tunnel_api.axis_vertex SET {change} WHERE n = 1241")  # type: ignore[arg-type]


LEAK_VIEWS = ["leak", "leak_unrolled", "leak_map", "leak_3d"]
FINDING_VIEWS = ["finding", "finding_unrolled", "finding_map", "finding_3d"]


@pytest.mark.parametrize("view", LEAK_VIEWS + FINDING_VIEWS)
def test_review_is_stamped(conn: psycopg.Connection, example: str, view: str) -> None:
    key = one(conn, "SELECT min(id) FROM tunnel.finding")
    target = sql.Identifier(view)
    conn.execute(sql.SQL("UPDATE tunnel_api.{} SET review = 'confirmed', remark = 'drips' WHERE id = {}").format(target, key))
    review, remark, by, recent = one(
        conn,
        "SELECT review, remark, reviewed_by, reviewed_at > now() - interval '1 minute' FROM tunnel.finding WHERE id = %s",
        key,
    )
    assert (review, remark, by, recent) == ("confirmed", "drips", one(conn, "SELECT session_user::text"), True)
    assert one(conn, "SELECT count(*) FROM tunnel.finding WHERE reviewed_by IS NOT NULL") == 1
    for change in (
        "review = 'maybe'", "review = NULL", "area = 0", "reviewed_by = 'another'",
        "kind = 'crack'" if view in LEAK_VIEWS else "kind = 'mould'", "kind = NULL",
        "kind_detected = 'dark'", "confidence = 1", "reasons = NULL",
    ):  # fmt: skip
        complaint = r"open, confirmed or rejected|leak, joint or dark|kind of a finding can be leak|only the (review|kind)"
        with pytest.raises(psycopg.Error, match=complaint), conn.transaction():
            conn.execute(sql.SQL("UPDATE tunnel_api.{} SET " + change).format(target))  # type: ignore[arg-type]


@pytest.mark.parametrize("view", FINDING_VIEWS)
def test_kind_is_judged_stamped_and_taken_back(conn: psycopg.Connection, example: str, view: str) -> None:
    key = one(conn, "SELECT id FROM tunnel.finding WHERE kind = 'joint'")
    change = sql.SQL("UPDATE tunnel_api.{} SET kind = %s WHERE id = %s").format(sql.Identifier(view))
    counts = "SELECT count(*) FROM tunnel_api.leak"
    before = one(conn, counts)
    conn.execute(change, ("leak", key))
    judged = one(conn, "SELECT kind, kind_override, reviewed_by = session_user, review FROM tunnel.finding WHERE id = %s", key)
    assert judged == ("joint", "leak", True, "open")
    assert one(conn, counts) == before + 1
    assert one(conn, "SELECT kind, kind_detected FROM tunnel_api.finding WHERE id = %s", key) == ("leak", "joint")
    conn.execute("UPDATE tunnel_api.leak SET remark = 'drips' WHERE id = %s", (key,))
    assert one(conn, "SELECT kind_override, remark FROM tunnel.finding WHERE id = %s", key) == ("leak", "drips")
    conn.execute(change, ("joint", key))
    assert one(conn, "SELECT kind_override FROM tunnel.finding WHERE id = %s", key) is None
    assert one(conn, counts) == before
    assert one(conn, "SELECT count(*) FROM tunnel.finding WHERE reviewed_by IS NOT NULL") == 1


def test_views_of_leaks_hold_leaks_and_those_of_findings_all(conn: psycopg.Connection, example: str) -> None:
    for views_of, kinds in ((LEAK_VIEWS, {"leak": 7}), (FINDING_VIEWS, {"leak": 7, "joint": 1, "dark": 1})):
        for view in views_of:
            rows = conn.execute(
                sql.SQL("SELECT kind, count(*)::int FROM tunnel_api.{} GROUP BY 1").format(sql.Identifier(view))
            ).fetchall()
            assert dict(rows) == kinds, view
    assert one(conn, "SELECT kind_detected, reasons, label FROM tunnel_api.finding WHERE kind = 'joint'") == (
        "joint", ["thin"], "12+415.050",
    )  # fmt: skip


def test_curve_found_on_the_lining_is_told_of(conn: psycopg.Connection, example: str) -> None:
    assert one(conn, "SELECT reference FROM tunnel_api.survey") == "auto"
    assert conn.execute("SELECT range_m, intensity_db, sigma_db FROM tunnel_api.range_curve ORDER BY id").fetchall() == [
        (2, -1, 0.2), (4, -3, 0.1), (8, -8, 0.1), (16, -14, 0.3),
    ]  # fmt: skip
    told = "SELECT reference, range_from, range_to, range_sigma FROM tunnel_api.radiometry"
    assert one(conn, told) == ("auto", 2, 16, 0.3)
    conn.execute("DELETE FROM tunnel.range_curve")
    assert one(conn, told) == ("auto", None, None, None)


def test_region_is_drawn_changed_and_deleted(conn: psycopg.Connection, example: str) -> None:
    key = one(
        conn,
        "INSERT INTO tunnel_api.region (survey, kind, geom) "
        "VALUES (%s, 'homogeneous', ST_MakeEnvelope(12400, 0, 12410, 2, 0)) RETURNING id",
        example,
    )
    assert one(conn, "SELECT survey, drawn_by = session_user FROM tunnel_api.region WHERE id = %s", key) == (example, True)
    conn.execute("UPDATE tunnel_api.region SET kind = 'dry' WHERE id = %s", (key,))
    assert one(conn, "SELECT kind FROM tunnel.region WHERE id = %s", key) == "dry"
    conn.execute("DELETE FROM tunnel_api.region WHERE id = %s", (key,))
    assert one(conn, "SELECT count(*) FROM tunnel.region WHERE id = %s", key) == 0


@pytest.mark.parametrize(
    ("survey", "polygon", "complaint"),
    [
        ("demo-2024", "POLYGON((0 0, 2 2, 2 0, 0 2, 0 0))", "Self-intersection"),
        ("nowhere", "POLYGON((0 0, 2 2, 2 0, 0 0))", "none named nowhere"),
    ],
)
def test_bad_region_is_refused(conn: psycopg.Connection, example: str, survey: str, polygon: str, complaint: str) -> None:
    with pytest.raises(psycopg.Error, match=complaint):
        conn.execute("INSERT INTO tunnel_api.region (survey, kind, geom) VALUES (%s, 'dry', %s::geometry)", (survey, polygon))


def run(conn: psycopg.Connection, stage: str, hour: int, outcome: str = "done", km: int | None = 12) -> None:
    conn.execute(
        "INSERT INTO tunnel.run (survey_id, km, stage, started_at, finished_at, outcome) "
        "SELECT id, %s, %s, make_timestamptz(2024, 5, 6, %s, 0, 0, 'UTC'), make_timestamptz(2024, 5, 6, %s, 30, 0, 'UTC'), %s "
        "FROM tunnel.survey WHERE name = 'demo-2024'",
        (km, stage, hour, hour, outcome),
    )


def test_later_stages_are_stale_until_run_again(conn: psycopg.Connection, example: str) -> None:
    run(conn, "segments", 1)
    assert stale(conn) == dict.fromkeys(("sections", "ground", "detect"), "segments ran since")
    # a stage run out of order rests on what is stale
    run(conn, "detect", 2)
    assert stale(conn) == {
        "sections": "segments ran since", "ground": "segments ran since", "detect": "sections is stale",
    }  # fmt: skip
    run(conn, "sections", 3)
    assert stale(conn) == {"ground": "segments ran since", "detect": "sections ran since"}
    run(conn, "ground", 4)
    run(conn, "detect", 5)
    run(conn, "ground", 6)
    assert stale(conn) == {"detect": "ground ran since"}
    run(conn, "detect", 7)
    assert stale(conn) == {}


def test_leaks_of_a_database_from_before_there_was_a_ground_are_stale(conn: psycopg.Connection, example: str) -> None:
    conn.execute("DELETE FROM tunnel.run WHERE stage = 'ground'")
    assert stale(conn) == {"detect": "ground never ran"}
    run(conn, "ground", 1)
    assert stale(conn) == {"detect": "ground ran since"}
    run(conn, "detect", 2)
    assert stale(conn) == {}


def test_failed_run_changes_nothing_but_shows(conn: psycopg.Connection, example: str) -> None:
    run(conn, "axis", 1, "failed")
    assert stale(conn) == {}
    outcome, done = one(conn, "SELECT outcome, done_at FROM tunnel_api.stage_status WHERE stage = 'axis'")
    assert outcome == "failed"
    assert done == dt.datetime(2024, 5, 5, 9, 30, tzinfo=dt.UTC)


def test_another_load_makes_all_of_its_kilometre_stale_and_the_neighbours_axes(conn: psycopg.Connection, example: str) -> None:
    for km in (11, 13, 14):
        run(conn, "axis", 0, km=km)
    run(conn, "segments", 1, km=13)
    run(conn, "load", 2)
    run(conn, "load", 2, km=None)
    reasons = {(km, stage): reason for km, stage, reason in conn.execute(STALE).fetchall()}
    assert reasons == {
        (11, "axis"): "load of kilometre 12 ran since",
        (12, "axis"): "load ran since",
        (12, "segments"): "load ran since",
        (12, "sections"): "load ran since",
        (12, "ground"): "load ran since",
        (12, "detect"): "load ran since",
        (13, "axis"): "load of kilometre 12 ran since",
        (13, "segments"): "axis is stale",
    }


def test_what_a_neighbour_does_anew_reaches_the_next_stage_only(conn: psycopg.Connection, example: str) -> None:
    for hour, stage in enumerate(("load", "axis", "segments", "sections", "ground", "detect")):
        run(conn, stage, hour, km=12)
        run(conn, stage, hour, km=13)
    assert conn.execute(STALE).fetchall() == []
    run(conn, "segments", 10, km=13)
    assert conn.execute(STALE).fetchall() == [
        (12, "sections", "segments of kilometre 13 ran since"),
        (12, "ground", "sections is stale"),
        (12, "detect", "sections is stale"),
        (13, "sections", "segments ran since"),
        (13, "ground", "segments ran since"),
        (13, "detect", "segments ran since"),
    ]
    run(conn, "sections", 11, km=13)
    run(conn, "ground", 12, km=13)
    run(conn, "detect", 13, km=13)
    assert conn.execute(STALE).fetchall() == [
        (12, "sections", "segments of kilometre 13 ran since"),
        (12, "ground", "sections of kilometre 13 ran since"),
        (12, "detect", "ground of kilometre 13 ran since"),
        (13, "ground", "sections of kilometre 12 is stale"),
        (13, "detect", "ground is stale"),
    ]


def test_load_is_stale_while_a_file_that_was_read_waits(conn: psycopg.Connection, example: str) -> None:
    conn.execute(
        "INSERT INTO tunnel.file_km (file_id, km, rows, points) SELECT id, 12, 7, '{[0,7)}' FROM tunnel.scan_file LIMIT 1"
    )
    assert conn.execute(STALE).fetchall()[:2] == [(12, "load", "demo.laz read since"), (12, "axis", "load is stale")]
    conn.execute("UPDATE tunnel.file_km SET loaded_at = clock_timestamp()")
    assert conn.execute(STALE).fetchall() == []


def test_run_whose_session_is_gone_is_interrupted(conn: psycopg.Connection, dsn: str, example: str) -> None:
    begin = (
        "INSERT INTO tunnel.run (survey_id, km, stage, backend_pid, backend_start, outcome) "
        "SELECT v.id, 12, %s, a.pid, a.backend_start, 'running' FROM tunnel.survey v, pg_stat_activity a "
        "WHERE a.pid = pg_backend_pid()"
    )
    with psycopg.connect(dsn) as other:
        other.execute(begin, ("sections",))
        other.commit()
        conn.execute(begin, ("detect",))
        conn.commit()
        states = "SELECT stage, outcome FROM tunnel_api.stage_status WHERE stage IN ('sections', 'detect') ORDER BY step"
        assert conn.execute(states).fetchall() == [("sections", "running"), ("detect", "running")]
        conn.rollback()
        pid = other.info.backend_pid
    # the server ends a session some time after its client has left
    while conn.execute("SELECT 1 FROM pg_stat_activity WHERE pid = %s", [pid]).fetchone():
        conn.rollback()
        time.sleep(0.01)
    assert conn.execute(states).fetchall() == [("sections", "interrupted"), ("detect", "running")]
    assert one(conn, "SELECT count(*) FROM tunnel_api.run WHERE outcome = 'interrupted'") == 1


def test_loaded_kilometre_that_was_never_processed_is_listed(conn: psycopg.Connection, example: str) -> None:
    conn.execute("DELETE FROM tunnel.run WHERE stage <> 'load'")
    outcomes = conn.execute("SELECT stage, outcome FROM tunnel_api.stage_status ORDER BY step").fetchall()
    assert outcomes == [
        ("load", "done"),
        ("axis", "never"),
        ("segments", "never"),
        ("sections", "never"),
        ("ground", "never"),
        ("detect", "never"),
    ]


def test_classes_are_those_of_the_program(conn: psycopg.Connection) -> None:
    rows = conn.execute("SELECT id, name FROM tunnel_api.class ORDER BY id").fetchall()
    assert rows == [(int(klass), klass.name.lower()) for klass in PointClass]


def test_points_have_the_class_that_was_found_beside_that_of_the_file(conn: psycopg.Connection, points: None) -> None:
    conn.execute("UPDATE tunnel.point SET class = 68 WHERE survey_id = 1 AND km = 12 AND chainage < 12010")
    rows = conn.execute(
        "SELECT k.name, p.classification, count(*) FROM tunnel_api.point p LEFT JOIN tunnel_api.class k ON k.id = p.class "
        "WHERE p.survey_id = 1 AND p.km = 12 GROUP BY 1, 2 ORDER BY 3"
    ).fetchall()
    assert rows == [("object", 0, 20), (None, 0, 1979)]


def test_cluster_says_what_it_is_and_where(conn: psycopg.Connection, example: str) -> None:
    assert conn.execute(
        "SELECT class_name, label, segment, round(area::numeric, 2), GeometryType(geom), ST_SRID(geom) FROM tunnel_api.cluster "
        "WHERE class = 68 ORDER BY chainage_from"
    ).fetchall() == [
        ("object", "12+352.000", 1235, Decimal("0.24"), "POLYGON", 25830),
        ("object", "12+388.000", 1238, Decimal("2.01"), "POLYGON", 25830),
    ]


def test_sphere_of_two_scans_has_one_number(conn: psycopg.Connection, example: str) -> None:
    rows = conn.execute(
        "SELECT number, label, segment, count(*), max(abs(x - ST_X(geom)) + abs(y - ST_Y(geom)) + abs(z - ST_Z(geom))) "
        "FROM tunnel_api.target_sphere GROUP BY 1, 2, 3 ORDER BY 1"
    ).fetchall()
    assert [row[:4] for row in rows] == [
        (1, "12+313.000", 1231, 2),
        (2, "12+344.000", 1234, 1),
        (3, "12+373.000", 1237, 2),
        (4, "12+406.000", 1240, 1),
        (5, "12+441.000", 1244, 2),
    ]
    assert max(row[4] for row in rows) == 0


def test_sphere_off_the_tunnel_has_no_chainage(conn: psycopg.Connection, example: str) -> None:
    conn.execute("UPDATE tunnel.target_sphere SET chainage = NULL WHERE number = 2")
    assert one(conn, "SELECT chainage, label, segment FROM tunnel_api.target_sphere WHERE number = 2") == (None, None, None)


def test_ground_lies_where_its_metre_is(conn: psycopg.Connection, example: str) -> None:
    """The middle of each line lies below the axis, at its own chainage."""
    assert one(
        conn,
        'SELECT count(*), bool_and(n.chainage = g.chainage AND abs(u.chainage - g.chainage) < 0.06 AND u."offset" < 0.001) '
        "FROM tunnel_api.ground g JOIN LATERAL (SELECT g.chainage) n ON true CROSS JOIN LATERAL tunnel_api.unroll(g.survey_id, "
        "ST_SetSRID(ST_PointN(g.geom, 32), 25830)) u WHERE g.chainage BETWEEN 12310 AND 12490",
    ) == (181, True)


def test_functions_pass_plpgsql_check(conn: psycopg.Connection) -> None:
    if not one(conn, "SELECT count(*) FROM pg_available_extensions WHERE name = 'plpgsql_check'"):
        missing("plpgsql_check")
    conn.execute("CREATE EXTENSION plpgsql_check")
    complaints = conn.execute(
        "SELECT c.* FROM pg_trigger t JOIN pg_class r ON r.oid = t.tgrelid AND r.relnamespace = 'tunnel_api'::regnamespace "
        "CROSS JOIN LATERAL plpgsql_check_function(t.tgfoid, t.tgrelid) c "
        "UNION ALL SELECT c.* FROM plpgsql_check_function("
        "'tunnel_api.ring_statistics(text, float8, float8, float8, float8)'::regprocedure) c"
    ).fetchall()
    assert complaints == []
