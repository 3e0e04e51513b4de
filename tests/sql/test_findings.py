"""Findings that people make: drawn, redrawn, split, merged and deleted through the views, with the rights of an inspector."""

from __future__ import annotations

from typing import Any

import psycopg
import pytest
import shapely
from shapely.geometry import LineString, Point, box
from support.example_survey import NAME, example_surface

from tunneldb.anomalies.geometries import anomaly_geometries
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
    found = conn.execute(f"SELECT {columns} FROM tunnel_api.lining_finding WHERE id = {key}".encode()).fetchone()
    assert found is not None
    return found


def wet(conn: psycopg.Connection) -> tuple[int, float]:
    """How many leaks of the survey count, and their area: by the statistics, which the view and the counts must agree with."""
    patches, area = conn.execute(
        "SELECT patches, wet_area FROM tunnel_api.leak_statistics(%s, '-Infinity', 'Infinity')", [NAME]
    ).fetchone()
    for query in (
        "SELECT count(*), sum(area) FROM tunnel_api.leak WHERE counted",
        "SELECT count(*), sum(area) FROM tunnel_api.lining_finding WHERE counted AND wet",
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
    assert row(person, key, "origin, by_hand, review, reviewed_by, drawn_by, severity_label, measured, drop_mean, counted, found") == (
        "drawn", True, "confirmed", "ines", "ines", "serious", False, None, True, None,
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
            f"INSERT INTO tunnel_api.finding_{view} (survey, kind, geom) SELECT survey, kind, geom FROM tunnel_api.finding_{view} "
            f"WHERE id = {first} RETURNING id".encode()
        ).fetchone()
        wkb, clock, length = row(person, key, "ST_AsBinary(unrolled), clock, length")
        again = shapely.from_wkb(bytes(wkb))
        assert again.geom_type == shape.geom_type
        assert shapely.hausdorff_distance(again, shape) < 1e-3
        assert (clock, length) == pytest.approx(row(person, first, "clock, length"), rel=1e-3)
