"""Findings that people make: drawn, redrawn, split, merged and deleted through the views, with the rights of an inspector."""

from __future__ import annotations

import os
import socket
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import psycopg
import pytest
import shapely
from psycopg.conninfo import make_conninfo
from shapely.geometry import LineString, Point, Polygon, box
from support.example_survey import NAME, example_surface

from tunneldb.anomalies.geometries import anomaly_geometries
from tunneldb.finding_kind import DRY, FindingKind
from tunneldb.geometry.surface import Surface

INSPECTOR = pytest.mark.parametrize("person", ["ines"], indirect=True)
FREE = box(12350.0, 0.5, 12352.0, 1.5)
"""A place of the unrolled plane where nothing was found."""


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


@pytest.fixture(scope="module")
def surface() -> Surface:
    return example_surface()[0]


def draw(conn: psycopg.Connection, shape: shapely.Geometry, kind: str = "leak", **others: Any) -> int:
    """Draw a finding on the unrolled image; its id."""
    columns = {"survey": NAME, "kind": kind, **others}
    query = (
        f"INSERT INTO tunnel_api.finding_unrolled ({', '.join(columns)}, geom) VALUES "
        f"({', '.join(['%s'] * len(columns))}, ST_GeomFromWKB(%s, 0)) RETURNING id"
    )
    return int(conn.execute(query.encode(), [*columns.values(), shapely.to_wkb(shape)]).fetchone()[0])


def row(conn: psycopg.Connection, key: int, columns: str) -> tuple[Any, ...]:
    found = conn.execute(f"SELECT {columns} FROM tunnel_api.finding WHERE id = {key}".encode()).fetchone()
    assert found is not None
    return found


def wet(conn: psycopg.Connection) -> tuple[int, float]:
    """How many leaks of the survey count, and their area: by the statistics, which the view and the counts must agree with."""
    patches, area = conn.execute(
        "SELECT patches, wet_area FROM tunnel_api.leak_statistics(%s, '-Infinity', 'Infinity')", [NAME]
    ).fetchone()
    for query in (
        "SELECT count(*), sum(area) FROM tunnel_api.leak WHERE counted",
        "SELECT count(*), sum(area) FROM tunnel_api.finding WHERE counted AND wet",
        "SELECT sum(counted), sum(area) FROM tunnel_api.finding_count WHERE wet",
        "SELECT sum(leaks), sum(wet_area) FROM tunnel_api.km_statistics",
        "SELECT sum(patches), tunnel_api.wet_area('demo-2024', -1e9, 1e9) FROM tunnel_api.km_waterproof",
    ):
        assert conn.execute(query.encode()).fetchone() == (patches, pytest.approx(area)), query
    return patches, area


@INSPECTOR
def test_of_what_is_drawn_on_the_unrolled_image_all_else_follows(person: psycopg.Connection, surface: Surface) -> None:
    before = wet(person)
    key = draw(person, FREE, severity=3, remark="under the lamp")
    truth = anomaly_geometries(FREE, surface)
    area, clock, map_wkb, surface_wkb = row(person, key, "area, clock, ST_AsBinary(map), ST_AsBinary(surface)")
    assert area == pytest.approx(truth.area, rel=1e-3)
    assert clock == pytest.approx(truth.clock, abs=0.05)
    assert shapely.hausdorff_distance(shapely.from_wkb(bytes(map_wkb)), truth.map) < 1e-3
    assert shapely.hausdorff_distance(shapely.from_wkb(bytes(surface_wkb)), truth.surface) < 1e-3
    columns = "origin, manual, review, reviewed_by, drawn_by, severity_label, measured, darkening_mean, counted"
    assert row(person, key, columns) == (
        "drawn", True, "confirmed", "ines", "ines", "serious", False, None, True,
    )  # fmt: skip
    assert row(person, key, "km, chainage_from, chainage_to, arc_from, arc_to, remark, label") == (
        12, 12350.0, 12352.0, 0.5, 1.5, "under the lamp", "12+351.000",
    )  # fmt: skip
    assert wet(person) == (before[0] + 1, pytest.approx(before[1] + area))


@INSPECTOR
@pytest.mark.parametrize("shape", [FREE, LineString([(12350.0, -1.0), (12352.0, 2.0)]), Point(12351.0, 1.0)], ids=str)
def test_drawn_in_one_place_it_lies_at_the_same_in_the_others(person: psycopg.Connection, shape: shapely.Geometry) -> None:
    kind = {"Polygon": "spall", "LineString": "crack", "Point": "missing_bolt"}[shape.geom_type]
    first = draw(person, shape, kind)
    for view in ("map", "3d"):
        (key,) = person.execute(
            f"INSERT INTO tunnel_api.finding_{view} (survey, kind, geom) SELECT survey, kind, geom "
            f"FROM tunnel_api.finding_{view} WHERE id = {first} RETURNING id".encode()
        ).fetchone()
        wkb, clock, length = row(person, key, "ST_AsBinary(unrolled), clock, length")
        again = shapely.from_wkb(bytes(wkb))
        assert again.geom_type == shape.geom_type
        assert shapely.hausdorff_distance(again, shape) < 1e-3
        assert (clock, length) == pytest.approx(row(person, first, "clock, length"), rel=1e-3)


@INSPECTOR
def test_what_is_redrawn_keeps_number_and_review_and_loses_what_was_measured(person: psycopg.Connection) -> None:
    (key,) = person.execute("SELECT min(id) FROM tunnel_api.leak WHERE review = 'confirmed'").fetchone()
    was = row(person, key, "area, review, reviewed_by, remark, kind_detected")
    person.execute(
        "UPDATE tunnel_api.finding_unrolled SET geom = ST_Scale(geom, 'POINT(1 1.1)'::geometry, ST_Centroid(geom))"
        " WHERE id = %s",
        [key],
    )
    now = row(person, key, "area, review, reviewed_by, remark, kind_detected")
    assert now == (pytest.approx(1.1 * was[0], rel=0.01), *was[1:])
    columns = "origin, manual, measured, darkening_mean, darkening_max, image_share, contrast, confidence, drawn_by"
    assert row(person, key, columns) == (
        "redrawn", False, False, None, None, None, None, None, "ines",
    )  # fmt: skip
    wet(person)
    entry = person.execute("SELECT view, action, before, after FROM tunnel_api.audit WHERE row_id = %s ORDER BY id DESC", [key])
    view, action, before, after = entry.fetchone()
    assert (view, action, set(before), set(after)) == ("finding", "update", {"geom", "origin"}, {"geom", "origin"})
    person.execute("UPDATE tunnel_api.finding_unrolled SET geom = %s::geometry WHERE id = %s", [before["geom"], key])
    assert row(person, key, "area")[0] == pytest.approx(was[0], rel=1e-3)


@INSPECTOR
def test_the_larger_part_keeps_the_number_and_the_oldest_keeps_it_again(person: psycopg.Connection) -> None:
    before = wet(person)
    key = draw(person, FREE, severity=2)
    (ids,) = person.execute("SELECT tunnel_api.finding_split(%s, 'LINESTRING(12350.5 0, 12350.5 2)')", [key]).fetchone()
    assert ids[0] == key
    assert row(person, key, "chainage_from, chainage_to, origin") == (12350.5, 12352.0, "split")
    assert row(person, ids[1], "chainage_from, chainage_to, origin, parent_id, severity, review, manual") == (
        12350.0, 12350.5, "split", key, 2, "confirmed", True,
    )  # fmt: skip
    (area,) = row(person, key, "area")
    assert wet(person) == (before[0] + 2, pytest.approx(before[1] + area * 4 / 3, rel=1e-3))
    assert person.execute("SELECT tunnel_api.finding_merge(%s)", [ids[::-1]]).fetchone() == (key,)
    assert row(person, key, "origin, merged, chainage_from, state") == ("merged", [ids[1]], 12350.0, "confirmed")
    assert row(person, ids[1], "merged_into, state, counted") == (key, "merged", False)
    assert wet(person) == (before[0] + 1, pytest.approx(before[1] + area * 4 / 3, rel=1e-3))
    for statement, said in (
        (f"DELETE FROM tunnel_api.finding_map WHERE id = {key}", "stands for others"),
        (f"UPDATE tunnel_api.finding_map SET review = 'open' WHERE id = {ids[1]}", f"is merged into {key}"),
        (f"SELECT tunnel_api.finding_split({key}, 'LINESTRING(0 0, 1 1)')", "does not split|beyond the lining"),
        (f"SELECT tunnel_api.finding_split({key}, 'LINESTRING(12340 0, 12341 0)')", "does not split"),
        (f"SELECT tunnel_api.finding_merge(ARRAY[{key}, {ids[1]}])", "is merged into"),
        (
            f"SELECT tunnel_api.finding_merge(ARRAY[{key}, (SELECT max(id) + 1 FROM tunnel_api.finding)])",
            "not all there",
        ),
    ):
        with pytest.raises(psycopg.Error, match=said):
            person.execute(statement.encode())


@INSPECTOR
def test_only_what_was_drawn_is_deleted(person: psycopg.Connection) -> None:
    before = wet(person)
    key = draw(person, FREE)
    person.execute("DELETE FROM tunnel_api.finding_unrolled WHERE id = %s", [key])
    assert wet(person) == before
    gone = person.execute("SELECT action, before FROM tunnel_api.audit WHERE row_id = %s ORDER BY id DESC", [key]).fetchone()
    assert (gone[0], gone[1]["kind"]) == ("delete", "leak")
    again = person.execute(
        "INSERT INTO tunnel_api.finding_unrolled (survey, kind, geom) VALUES (%s, %s, %s) RETURNING id",
        [NAME, gone[1]["kind"], gone[1]["geom"]],
    ).fetchone()
    assert row(person, again[0], "unrolled") == (person.execute("SELECT %s::geometry", [gone[1]["geom"]]).fetchone()[0],)
    with pytest.raises(psycopg.errors.FeatureNotSupported, match="finding 1 was detected: reject it instead"):
        person.execute("DELETE FROM tunnel_api.finding_unrolled WHERE id = 1")


@INSPECTOR
@pytest.mark.parametrize(
    ("shape", "others", "said"),
    [
        (box(12350.0, 0.0, 12351.0, 30.0), {}, "the drawing reaches beyond the lining: it lies between chainage 12350.00 and"),
        (box(12499.0, 0.0, 12505.0, 1.0), {}, "beyond the lining"),
        (Polygon([(12350, 0), (12351, 1), (12351, 0), (12350, 1)]), {}, "the drawing is not valid: Self-intersection"),
        (Point(12350, 0), {}, "leak is drawn as polygon, not as point"),
        (LineString([(12350, 0), (12351, 0)]), {"kind": "spall"}, "spall is drawn as polygon or point, not as line"),
        (FREE, {"kind": "ghost"}, "the kind of a finding can be leak, drip, crack, .*, not ghost"),
        (FREE, {"severity": 5}, "the severity of a finding is 1 to 4, not 5"),
        (FREE, {"review": "maybe"}, "can be open, confirmed or rejected, not maybe"),
        (FREE, {"survey": "nowhere"}, "there is none named nowhere"),
        (Polygon(), {}, "a finding needs a place"),
        (LineString([(12350, 0), (12351, 0)]), {"kind": "crack", "width_mm": -0.1}, "a crack is 0.01 to 100 mm wide"),
        (LineString([(12350, 0), (12351, 0)]), {"kind": "crack", "width_mm": 0.0003}, "not 0.0003 mm: widths are in mill"),
        (LineString([(12350, 0), (12351, 0)]), {"kind": "crack", "width_mm": 300}, "a crack is 0.01 to 100 mm wide"),
    ],
)
def test_what_cannot_be_drawn_is_refused_in_one_line(
    person: psycopg.Connection, shape: shapely.Geometry, others: dict[str, Any], said: str
) -> None:
    with pytest.raises(psycopg.Error, match=said) as error:
        draw(person, shape, **{"kind": "leak", **others})
    assert "\n" not in str(error.value.diag.message_primary)


@INSPECTOR
def test_a_line_has_length_and_width_and_a_point_neither(person: psycopg.Connection) -> None:
    line = LineString([(12350.0, 1.0), (12353.0, 1.0)])
    key = draw(person, line, "crack", width_mm=0.3)
    length, area, kind = row(person, key, "length, area, GeometryType(unrolled)")
    assert (length, area, kind) == (pytest.approx(3.0, rel=0.05), pytest.approx(0.0003 * length), "LINESTRING")
    person.execute("UPDATE tunnel_api.finding_map SET width_mm = 4 WHERE id = %s", [key])
    assert row(person, key, "area, origin")[:2] == (pytest.approx(0.004 * length), "drawn")
    point = draw(person, Point(12351.0, 2.0), "drip", severity=1)
    assert row(person, point, "area, length, wet, GeometryType(unrolled)") == (0.0, None, True, "POINT")
    wet(person)


@INSPECTOR
def test_drawn_over_what_was_detected_it_counts_once(person: psycopg.Connection) -> None:
    before = wet(person)
    (key, wkb, area) = person.execute(
        "SELECT id, ST_AsBinary(unrolled), area FROM tunnel_api.leak WHERE review = 'open' ORDER BY id LIMIT 1"
    ).fetchone()
    outline = shapely.from_wkb(bytes(wkb))
    drawn = draw(person, outline.buffer(0.2))
    assert row(person, key, "same_as, state, counted") == (drawn, "same", False)
    assert row(person, drawn, "also_detected, detected_as, counted") == (True, [key], True)
    assert wet(person)[0] == before[0]
    person.execute("UPDATE tunnel_api.finding_map SET review = 'rejected' WHERE id = %s", [drawn])
    assert wet(person) == (before[0] - 1, pytest.approx(before[1] - area))
    person.execute("DELETE FROM tunnel_api.finding_3d WHERE id = %s", [drawn])
    assert wet(person) == (before[0], pytest.approx(before[1]))
    inner = draw(person, outline.buffer(-0.3))  # a small part of it
    assert row(person, inner, "same_as, counted") == (key, False)
    assert wet(person) == (before[0], pytest.approx(before[1]))
    person.execute("UPDATE tunnel_api.leak SET review = 'rejected' WHERE id = %s", [key])
    assert row(person, inner, "same_as, counted") == (None, True)
    assert wet(person)[0] == before[0]


@INSPECTOR
def test_a_dry_region_marks_leaks_and_gives_them_back(person: psycopg.Connection, conn: psycopg.Connection) -> None:
    before = wet(person)
    key, wkb, area = person.execute(
        "SELECT id, ST_AsBinary(unrolled), area FROM tunnel_api.leak WHERE review = 'open' ORDER BY id LIMIT 1"
    ).fetchone()
    conn.rollback()
    outline = shapely.box(*shapely.from_wkb(bytes(wkb)).bounds).buffer(0.1, join_style="mitre")
    insert = (
        "INSERT INTO tunnel_api.region (survey, kind, geom, reason) VALUES (%s, 'dry', ST_GeomFromWKB(%s, 0), %s) RETURNING id"
    )
    with pytest.raises(psycopg.errors.CheckViolation, match=r"is larger than 50 m²: its reason must say why"):
        person.execute(insert, [NAME, shapely.to_wkb(outline.buffer(5.0)), " "])
    (region,) = person.execute(insert, [NAME, shapely.to_wkb(outline), None]).fetchone()
    assert row(person, key, "state, dry_region_id, counted") == ("dry", region, False)
    assert wet(person) == (before[0] - 1, pytest.approx(before[1] - area))
    said = person.execute(
        "SELECT leaks, leaks_area, leak_ids, drawn_by, chainage_from FROM tunnel_api.dry_region WHERE id = %s", [region]
    )
    assert said.fetchone() == (1, pytest.approx(area), [key], "ines", pytest.approx(outline.bounds[0]))
    person.execute("DELETE FROM tunnel_api.region WHERE id = %s", [region])
    assert wet(person) == (before[0], pytest.approx(before[1]))


@INSPECTOR
def test_only_what_is_a_leak_is_in_a_dry_region_whichever_view_says_so(person: psycopg.Connection) -> None:
    """And the parts of a leak in it are in it, too."""
    key, wkb = person.execute(
        "SELECT id, ST_AsBinary(unrolled) FROM tunnel_api.leak WHERE review = 'open' AND kind = 'leak' ORDER BY id LIMIT 1"
    ).fetchone()
    outline = shapely.from_wkb(bytes(wkb))
    (region,) = person.execute(
        "INSERT INTO tunnel_api.region (survey, kind, geom) VALUES (%s, 'dry', ST_GeomFromWKB(%s, 0)) RETURNING id",
        [NAME, shapely.to_wkb(outline.envelope.buffer(0.1, join_style="mitre"))],
    ).fetchone()
    state = "state, dry_region_id"
    for view in ("finding_unrolled", "finding"):
        person.execute("UPDATE tunnel_api.finding_unrolled SET kind = 'dark' WHERE id = %s", [key])
        assert row(person, key, state) == ("open", None)
        person.execute(f"UPDATE tunnel_api.{view} SET kind = 'leak' WHERE id = %s".encode(), [key])
        assert row(person, key, state) == ("dry", region)
    west, south, east, north = outline.bounds
    blade = LineString([((west + east) / 2, south - 1), ((west + east) / 2, north + 1)])
    (parts,) = person.execute(
        "SELECT tunnel_api.finding_split(%s, ST_GeomFromWKB(%s, 0))", [key, shapely.to_wkb(blade)]
    ).fetchone()
    assert [row(person, part, state) for part in parts] == [("dry", region)] * len(parts)


@INSPECTOR
def test_a_detected_leak_is_not_redrawn_as_a_line(person: psycopg.Connection) -> None:
    (key,) = person.execute("SELECT min(id) FROM tunnel_api.leak WHERE review = 'open'").fetchone()
    with pytest.raises(psycopg.errors.CheckViolation, match="drawn as polygon, not as line"):
        person.execute("UPDATE tunnel_api.finding_unrolled SET geom = 'LINESTRING(12350 1, 12352 1)' WHERE id = %s", [key])


@INSPECTOR
def test_what_is_merged_keeps_the_greatest_severity_and_all_remarks(person: psycopg.Connection) -> None:
    first = draw(person, FREE, "spall", severity=1, remark="old")
    second = draw(person, shapely.affinity.translate(FREE, 1.5), "spall", severity=4, remark="grave")
    person.execute("SELECT tunnel_api.finding_merge(%s)", [[first, second]])
    assert row(person, first, "severity, remark") == (4, "grave; old")
    person.execute("SELECT tunnel_api.finding_undo(%s)", [first])
    assert row(person, first, "severity, remark") == (1, "old")


def test_a_finding_of_a_survey_that_was_removed_is_not_brought_back_in_another(people: None, dsn: str, example: str) -> None:
    with psycopg.connect(make_conninfo(dsn, user="ines")) as ines:
        key = draw(ines, FREE)
        ines.execute("DELETE FROM tunnel_api.finding_unrolled WHERE id = %s", [key])
    with psycopg.connect(dsn) as owner:  # as if it had been added now
        owner.execute("UPDATE tunnel.survey SET created_at = clock_timestamp() WHERE name = %s", [NAME])
        with pytest.raises(psycopg.Error, match=f"there is no change of a finding {key} to be taken back"):
            owner.execute("SELECT tunnel_api.finding_undo(%s)", [key])


def test_a_large_dry_region_waits_for_an_operator(people: None, dsn: str, example: str) -> None:
    with psycopg.connect(make_conninfo(dsn, user="ines")) as ines, psycopg.connect(make_conninfo(dsn, user="otto")) as otto:
        before = wet(ines)
        (region,) = ines.execute(
            "INSERT INTO tunnel_api.region (survey, kind, geom, reason)"
            " VALUES (%s, 'dry', ST_MakeEnvelope(12310, -8, 12460, 8), 'new') RETURNING id", [NAME],
        ).fetchone()  # fmt: skip
        ines.commit()
        assert wet(ines) == before
        stated = "SELECT pending_approval, approved_by, leaks FROM tunnel_api.dry_region WHERE id = %s"
        assert ines.execute(stated, [region]).fetchone() == (True, None, 0)
        ines.commit()
        with pytest.raises(psycopg.errors.InsufficientPrivilege):
            ines.execute("SELECT tunnel_api.dry_region_approve(%s)", [region])
        ines.rollback()
        (taken,) = otto.execute("SELECT tunnel_api.dry_region_approve(%s)", [region]).fetchone()
        assert taken > 0
        assert wet(otto)[0] == before[0] - taken
        assert otto.execute(stated, [region]).fetchone() == (False, "otto", taken)
        with pytest.raises(psycopg.Error, match="does not wait: it is in force"):
            otto.execute("SELECT tunnel_api.dry_region_approve(%s)", [region])
        otto.rollback()
        otto.execute("SELECT tunnel_api.dry_region_approve(%s)", [region])
        otto.commit()
        # drawn anew, or for another reason, it needs the word anew
        for change in ("reason = 'rebuilt'", "geom = ST_Translate(geom, 1, 0)"):
            ines.execute(f"UPDATE tunnel_api.region SET {change} WHERE id = %s".encode(), [region])
            assert (wet(ines)[0], ines.execute(stated, [region]).fetchone()) == (before[0], (True, None, 0))
            ines.rollback()
            assert ines.execute(stated, [region]).fetchone() == (False, "otto", taken)
        said = ines.execute("SELECT after FROM tunnel_api.audit WHERE view = 'region' AND who = 'otto'").fetchone()
        assert said[0]["approved_by"] == "otto"


def test_a_client_that_is_killed_leaves_nothing_half_written(people: None, dsn: str, example: str) -> None:
    """As QGIS is, in the middle of a save of several edits; nobody waits for what it held."""
    with psycopg.connect(make_conninfo(dsn, user="otto")) as other:
        whole = (
            "SELECT count(*), round(sum(area)::numeric, 6) FROM tunnel_api.finding"
            " UNION ALL SELECT count(*), 0 FROM tunnel_api.audit"
        )
        before = other.execute(whole).fetchall()
        other.rollback()
        client = psycopg.connect(make_conninfo(dsn, user="ines"))
        key = draw(client, FREE, "spall")
        client.execute("SELECT tunnel_api.finding_split(%s, 'LINESTRING(12350.5 0, 12350.5 2)')", [key])
        client.execute("UPDATE tunnel_api.finding_map SET remark = 'mine' WHERE id = 1")
        with socket.socket(fileno=os.dup(client.fileno())) as wire:
            wire.shutdown(socket.SHUT_RDWR)  # no farewell, as of one that is killed
        other.execute("SET lock_timeout = '5s'")
        other.execute("UPDATE tunnel_api.finding_map SET remark = remark WHERE id = 1")
        assert other.execute(whole).fetchall() == before


def test_two_inspectors_at_once_in_one_kilometre(people: None, dsn: str, example: str) -> None:
    """Each draws, splits and takes back where the other does; sums are those of both."""

    def work(user: str, start: float) -> None:
        with psycopg.connect(make_conninfo(dsn, user=user)) as own:
            for n in range(4):
                key = draw(own, box(start + 2 * n, 0.5, start + 2 * n + 1, 1.5), "leak", remark=user)
                own.commit()
                cut = start + 2 * n + 0.3
                own.execute("SELECT tunnel_api.finding_split(%s, %s::geometry)", [key, f"LINESTRING({cut} 0, {cut} 2)"])
                own.commit()
                if n % 2:
                    undo(own, key)
                    own.commit()

    with psycopg.connect(dsn) as conn, ThreadPoolExecutor(2) as pool:
        before = wet(conn)
        conn.rollback()
        list(pool.map(work, ("ines", "otto"), (12350.0, 12351.0)))
        assert wet(conn)[0] == before[0] + 2 * (4 + 2)
        assert wet(conn)[1] == pytest.approx(before[1] + 8.0, rel=0.02)


@INSPECTOR
def test_in_a_layer_of_leaks_findings_are_drawn(person: psycopg.Connection) -> None:
    before = wet(person)
    wkb = shapely.to_wkb(FREE)
    (key,) = person.execute(
        "INSERT INTO tunnel_api.leak_unrolled (survey, geom) VALUES (%s, ST_GeomFromWKB(%s, 0)) RETURNING id", [NAME, wkb]
    ).fetchone()
    assert row(person, key, "kind, origin, review, drawn_by") == ("leak", "drawn", "confirmed", "ines")
    person.execute("UPDATE tunnel_api.leak_map SET geom = ST_Buffer(geom, 0.1), remark = 'larger' WHERE id = %s", [key])
    (area, remark) = row(person, key, "area, remark")
    assert (area > 2.5, remark) == (True, "larger")
    person.execute("DELETE FROM tunnel_api.leak_unrolled WHERE id = %s", [key])
    assert wet(person) == (before[0], pytest.approx(before[1]))
    with pytest.raises(psycopg.Error, match="was detected: reject it instead"):
        person.execute("DELETE FROM tunnel_api.leak_map WHERE id = 1")


@INSPECTOR
def test_photos_are_paths_with_captions_and_in_the_audit(person: psycopg.Connection) -> None:
    key = draw(person, FREE)
    (photo,) = person.execute(
        "INSERT INTO tunnel_api.finding_photo (finding_id, path, caption) VALUES (%s, 'photos/1.jpg', 'wet') RETURNING id",
        [key],
    ).fetchone()
    person.execute("UPDATE tunnel_api.finding_photo SET caption = 'very wet' WHERE id = %s", [photo])
    assert row(person, key, "photos") == (1,)
    with pytest.raises(psycopg.Error, match="needs a path or URL"):
        person.execute("INSERT INTO tunnel_api.finding_photo (finding_id, path) VALUES (%s, '')", [key])
    person.execute("DELETE FROM tunnel_api.finding_photo WHERE id = %s", [photo])
    actions = person.execute("SELECT action FROM tunnel_api.audit WHERE view = 'photo' ORDER BY id").fetchall()
    assert actions == [("insert",), ("update",), ("delete",)]


@pytest.mark.parametrize("person", ["otto"], indirect=True)
def test_operators_extend_the_catalogue_and_wet_follows(person: psycopg.Connection) -> None:
    before = wet(person)
    person.execute(
        "INSERT INTO tunnel_api.finding_kind (code, label, geometries, wet, position) "
        "VALUES ('seepage', 'Sickerstelle', '{polygon}', true, 5)"
    )
    key = draw(person, FREE, "seepage")
    assert wet(person)[0] == before[0] + 1
    person.execute("UPDATE tunnel_api.finding_kind SET wet = false WHERE code = 'seepage'")
    assert wet(person)[0] == before[0]
    assert row(person, key, "kind_label, wet") == ("Sickerstelle", False)
    with pytest.raises(psycopg.errors.ForeignKeyViolation):
        person.execute("DELETE FROM tunnel_api.finding_kind WHERE code = 'seepage'")


def undo(conn: psycopg.Connection, key: int) -> str:
    return str(conn.execute("SELECT tunnel_api.finding_undo(%s)", [key]).fetchone()[0])


def everything(conn: psycopg.Connection) -> list[tuple[Any, ...]]:
    """All findings and photos, with all that is known of them but when."""
    return conn.execute(
        "SELECT to_jsonb(a) - ARRAY['drawn_at', 'reviewed_at', 'created_at', 'detected_at', 'map', 'surface', 'area', 'clock',"
        " 'easting', 'northing', 'height']"
        " || jsonb_build_object('area', round(a.area::numeric, 5), 'clock', round(a.clock::numeric, 4),"
        " 'unrolled', ST_AsText(a.unrolled, 6)),"
        " (SELECT jsonb_agg(to_jsonb(p) - 'added_at') FROM tunnel_api.finding_photo p WHERE p.finding_id = a.id)"
        " FROM tunnel_api.finding a ORDER BY id"
    ).fetchall()


@INSPECTOR
def test_each_step_is_taken_back_to_what_was_before(person: psycopg.Connection) -> None:
    (found,) = person.execute("SELECT min(id) FROM tunnel_api.leak WHERE review = 'confirmed'").fetchone()
    drawn = draw(person, FREE, "spall", remark="new")
    person.execute("INSERT INTO tunnel_api.finding_photo (finding_id, path) VALUES (%s, 'a.jpg')", [drawn])
    crack = draw(person, LineString([(12360.0, 1.0), (12363.0, 1.5)]), "crack", width_mm=2)
    steps = (
        (drawn, "redrawn", f"UPDATE tunnel_api.finding_map SET geom = ST_Buffer(geom, -0.1) WHERE id = {drawn}"),
        (drawn, "reviewed", f"UPDATE tunnel_api.finding_3d SET remark = NULL, severity = 4, kind = 'other' WHERE id = {drawn}"),
        (drawn, "deleted", f"DELETE FROM tunnel_api.finding_unrolled WHERE id = {drawn}"),
        (drawn, "split", f"SELECT tunnel_api.finding_split({drawn}, 'LINESTRING(12350.5 0, 12350.5 2)')"),
        (crack, "reviewed", f"UPDATE tunnel_api.finding_unrolled SET width_mm = 10 WHERE id = {crack}"),
        (crack, "split", f"SELECT tunnel_api.finding_split({crack}, 'LINESTRING(12361.7 0, 12361.7 2)')"),
        (found, "reviewed", f"UPDATE tunnel_api.leak SET review = 'rejected', remark = NULL, kind = 'dark' WHERE id = {found}"),
        (found, "redrawn", f"UPDATE tunnel_api.finding_unrolled SET geom = ST_Buffer(geom, 0.2) WHERE id = {found}"),
        (found, "split", f"""SELECT tunnel_api.finding_split(id, ST_MakeLine(ST_MakePoint(chainage_from + 0.5, -9),
            ST_MakePoint(chainage_from + 0.5, 9))) FROM tunnel_api.finding WHERE id = {found}"""),
    )  # fmt: skip
    for key, said, statement in steps:
        before, sums = everything(person), wet(person)
        person.execute(statement.encode())
        assert everything(person) != before
        assert undo(person, key) == said, statement
        now = everything(person)
        assert now == before, statement
        assert wet(person) == (sums[0], pytest.approx(sums[1]))
    entries = person.execute(
        "SELECT undoes IS NULL, count(*) FROM tunnel_api.audit WHERE part_of IS NULL GROUP BY 1"
    ).fetchall()
    assert dict(entries)[False] == len(steps), "each is in the audit"


@INSPECTOR
def test_a_merge_is_taken_back_whole(person: psycopg.Connection) -> None:
    first, second, third = (draw(person, box(12350.0 + x, 0.5, 12350.0 + x + 1.0, 1.5), "spall") for x in (0.0, 1.2, 2.4))
    states = [everything(person)]
    for ids in ([second, third], [first, second]):
        person.execute("SELECT tunnel_api.finding_merge(%s)", [ids])
        states.append(everything(person))
    assert row(person, third, "merged_into") == (first,)
    with pytest.raises(
        psycopg.Error, match=f"finding {second} is not taken back: it was merged into finding {first}: take that back"
    ):
        undo(person, second)
    assert (undo(person, first), everything(person)) == ("merged", states[1])
    assert (undo(person, second), everything(person)) == ("merged", states[0])
    # one that holds the other all
    inner = draw(person, box(12350.2, 0.7, 12350.4, 0.9), "spall")
    before = everything(person)
    person.execute("SELECT tunnel_api.finding_merge(%s)", [[first, inner]])
    assert (undo(person, first), everything(person)) == ("merged", before)
    assert (undo(person, inner), undo(person, first)) == ("drawn", "drawn")


def test_what_rests_on_a_step_or_is_another_s_is_not_taken_back(people: None, dsn: str, example: str) -> None:
    with psycopg.connect(make_conninfo(dsn, user="ines")) as ines, psycopg.connect(make_conninfo(dsn, user="otto")) as otto:
        key = draw(ines, FREE, "spall")
        (ids,) = ines.execute("SELECT tunnel_api.finding_split(%s, 'LINESTRING(12350.5 0, 12350.5 2)')", [key]).fetchone()
        ines.execute("UPDATE tunnel_api.finding_unrolled SET severity = 2 WHERE id = %s", [ids[1]])
        photo = "INSERT INTO tunnel_api.finding_photo (finding_id, path) VALUES (%s, 'a.jpg')"
        ines.commit()
        for step, key_, said in (
            ("", key, f"finding {ids[1]}, a part of it, was changed since: take that back first"),
            (f"SELECT tunnel_api.finding_undo({ids[1]})", ids[1], f"it was split off finding {key}: take that back"),
            (photo % ids[1], key, f"finding {ids[1]}, a part of it, has photos"),
            ("", 10**9, "there is no change of a finding 1000000000"),
        ):
            if step:
                ines.execute(step.encode())
                ines.commit()
            with pytest.raises(psycopg.Error, match=said):
                undo(ines, key_)
            ines.rollback()
        otto.execute("UPDATE tunnel_api.finding_unrolled SET remark = 'mine' WHERE id = %s", [key])
        otto.commit()
        with pytest.raises(psycopg.Error, match="its last change is of otto: only who made it, or an operator"):
            undo(ines, key)
        ines.rollback()
        assert undo(otto, key) == "reviewed"


def test_two_inspectors_at_once_on_one_finding(people: None, dsn: str, example: str) -> None:
    with (
        psycopg.connect(make_conninfo(dsn, user="ines")) as first,
        psycopg.connect(make_conninfo(dsn, user="otto")) as second,
    ):
        key = draw(first, FREE, remark="new")
        draw(second, box(12380.0, 0.0, 12381.0, 1.0))  # neither waits
        first.commit()
        second.commit()
        first.execute("UPDATE tunnel_api.finding_unrolled SET severity = 3 WHERE id = %s", [key])
        second.execute("SET lock_timeout = '100ms'")
        second.commit()
        with pytest.raises(psycopg.errors.LockNotAvailable):
            second.execute("UPDATE tunnel_api.finding_unrolled SET remark = 'mine' WHERE id = %s", [key])
        second.rollback()
        first.commit()
        second.execute("UPDATE tunnel_api.finding_unrolled SET remark = 'mine' WHERE id = %s", [key])
        second.commit()
        assert row(first, key, "severity, remark") == (3, "mine")


@INSPECTOR
def test_conditions_by_fhwa_are_sums_of_what_is_counted(person: psycopg.Connection) -> None:
    draw(person, LineString([(12350.0, 1.0), (12353.0, 1.0)]), "crack", width_mm=2, severity=4)
    draw(person, Point(12360.0, 1.0), "missing_bolt")
    states = {r[0]: r[1:] for r in person.execute("SELECT element, unit, cs1, cs2, cs3, cs4 FROM tunnel_api.snti_condition")}
    assert states["cracks"] == ("m", 0, 0, 0, pytest.approx(3.0, rel=0.05))
    assert states["bolts"] == ("each", 0, 1, 0, 0)
    inspected = person.execute("SELECT sum(seen_area) FROM tunnel_api.km_statistics").fetchone()[0]
    assert sum(states["liner"][1:]) == pytest.approx(inspected), "nothing is said about the rest"


def test_the_program_knows_the_kinds_of_the_catalogue(conn: psycopg.Connection) -> None:
    assert [code for (code,) in conn.execute("SELECT code FROM tunnel_api.finding_kind ORDER BY position")] == list(FindingKind)
    wet = {code for (code,) in conn.execute("SELECT code FROM tunnel_api.finding_kind WHERE wet")}
    assert not wet & set(DRY)
