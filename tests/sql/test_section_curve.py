"""Curves of sections through angular classes, against the outlines that the classes were made of."""

from __future__ import annotations

import numpy as np
import psycopg
import pytest
import shapely
from numpy.typing import NDArray

STEP = 5.0
WIDTH, HEIGHT, ABOVE = 8.0, 6.0, 2.6  # of a box, m; its top lies so far above the axis


def outline(*, haunch: float = 0.0, width: float = WIDTH) -> shapely.LinearRing:
    """A box about the axis, of which the upper corners may be cut off."""
    w, top, bottom = width / 2, ABOVE, ABOVE - HEIGHT
    return shapely.LinearRing(
        [(-w, bottom), (-w, top - haunch), (-w + haunch, top), (w - haunch, top), (w, top - haunch), (w, bottom)]
    )


def seen(ring: shapely.LinearRing, hung: shapely.Polygon | None = None) -> NDArray[np.float64]:
    """Points (n, 2) that are seen from the axis, of what hangs before the wall where it hides that."""
    points = []
    for angle in np.radians(np.arange(-180.0, 180.0, 0.25) + 0.1):
        ray = shapely.LineString([(0, 0), (20 * np.sin(angle), 20 * np.cos(angle))])
        hits = [ring.intersection(ray)] + ([hung.exterior.intersection(ray)] if hung is not None else [])
        places = np.concatenate([shapely.get_coordinates(hit) for hit in hits])
        points.append(places[np.argmin(np.hypot(*places.T))])
    return np.array(points)


def classes(points: NDArray[np.float64]) -> list[list[float]]:
    """Radius, slope, sigma and spread of the line through the points of each class, in its own frame."""
    angle = np.degrees(np.arctan2(points[:, 0], points[:, 1])) + 180
    rows = []
    for k in range(round(360 / STEP)):
        own, middle = points[angle // STEP == k], np.radians((k + 0.5) * STEP - 180)
        x = own @ [np.cos(middle), -np.sin(middle)]
        y = own @ [np.sin(middle), np.cos(middle)]
        slope, radius = np.polyfit(x, y, 1)
        rows.append([radius, slope, float(np.std(y - radius - slope * x)), float(np.var(x))])
    return [list(column) for column in np.array(rows).T]


def curve(conn: psycopg.Connection, points: NDArray[np.float64]) -> tuple[NDArray[np.float64], list[str]]:
    """Arc of each degree from -180 to 180, and what became of the classes."""
    row = conn.execute(
        "SELECT node_arc, class_state"
        " FROM tunnel_internal.section_curve(%s, %s::float8[], %s::float8[], %s::float8[], %s::float8[])",
        (STEP, *classes(points)),
    ).fetchone()
    assert row is not None
    return np.array(row[0]), row[1]


def true_arc(ring: shapely.LinearRing, degrees: float) -> float:
    """Length of the outline from the upward direction to another one."""
    up, there = (
        ring.project(ring.intersection(shapely.LineString([(0, 0), (20 * np.sin(a), 20 * np.cos(a))])))
        for a in (0.0, np.radians(degrees))
    )
    return float(there - up)


@pytest.mark.parametrize("apart", [0.35, 0.5, 0.65, 0.8])
@pytest.mark.parametrize("side", [-1, 1])
def test_a_pipe_beside_a_corner_does_not_cut_it_off(conn: psycopg.Connection, apart: float, side: int) -> None:
    ring = outline()
    pipe = shapely.Point(side * (WIDTH / 2 - apart), ABOVE - 0.18).buffer(0.08)
    arc, state = curve(conn, seen(ring, pipe))
    for degrees in (-80, -70, 70, 80):
        assert arc[degrees + 180] == pytest.approx(true_arc(ring, degrees), abs=0.02)
    assert "rejected" in state


@pytest.mark.parametrize("haunch", [0.3, 0.4, 0.5, 0.8])
def test_a_haunch_is_no_corner_with_something_before_it(conn: psycopg.Connection, haunch: float) -> None:
    ring = outline(haunch=haunch)
    arc, _ = curve(conn, seen(ring))
    for degrees in (-80, -70, 70, 80):
        assert arc[degrees + 180] == pytest.approx(true_arc(ring, degrees), abs=0.05)


@pytest.mark.parametrize("haunch", [0.5, 0.6, 0.7])
@pytest.mark.parametrize("cable", [1.7, 1.8, 1.9, 2.0])
def test_a_haunch_with_a_cable_below_it_is_no_box_in_a_corner(conn: psycopg.Connection, haunch: float, cable: float) -> None:
    ring = outline(haunch=haunch, width=4.8)
    arc, _ = curve(conn, seen(ring, shapely.Point(2.3, cable).buffer(0.04)))
    assert arc[90 + 180] == pytest.approx(true_arc(ring, 90), abs=0.05)


@pytest.mark.parametrize("shadow", [1, 2, 3])
@pytest.mark.parametrize("side", [-1, 1])
def test_a_duct_in_its_own_shadow_is_not_the_wall(conn: psycopg.Connection, side: int, shadow: int) -> None:
    """On both sides of what stands 0.3 m before the wall no point shows it for some classes."""
    duct = 36 + side * 18 - (side < 0)
    columns: list[list[float | None]] = [list(column) for column in classes(seen(outline()))]
    for k in range(duct - shadow, duct + shadow + 1):
        columns[0][k] = columns[0][k] - 0.3 if k == duct else None
    row = conn.execute(
        "SELECT class_state FROM tunnel_internal.section_curve(%s, %s::float8[], %s::float8[], %s::float8[], %s::float8[])",
        (STEP, *columns),
    ).fetchone()
    assert row is not None
    assert row[0][duct] == "rejected"
