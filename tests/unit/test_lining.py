"""Floor, niches and edges on straight tunnels whose sections are drawn by hand."""

from dataclasses import replace

import numpy as np
import pytest
from shapely.geometry import box as rectangle

from tunneldb.geometry.frame import segment_rows, tangents
from tunneldb.geometry.surface import Surface
from tunneldb.ground.arcs import foot_arcs
from tunneldb.ground.line import Line
from tunneldb.ground.model import COLUMN, Ground
from tunneldb.intensity.edge import Edges
from tunneldb.leak.geometries import shapes
from tunneldb.leak.lining import FLOOR_EDGE, Astray, Floor

LENGTH = 60.0


def straight(radius: np.ndarray) -> Surface:
    """A level tunnel along x (right is −y) with sections every 5 m; radius (k, 361) or (361,)."""
    chainage = np.arange(0.0, LENGTH + 1, 10.0)
    vertices = np.column_stack([chainage, np.zeros(len(chainage)), np.full(len(chainage), 100.0)])
    at = np.arange(2.5, LENGTH, 5.0)
    radius = np.broadcast_to(radius, (len(at), 361)).copy()
    angle = np.radians(np.arange(361) - 180.0)
    u, w = radius * np.sin(angle), radius * np.cos(angle)
    length = np.concatenate([np.zeros((len(at), 1)), np.cumsum(np.hypot(np.diff(u), np.diff(w)), axis=1)], axis=1)
    rows = segment_rows(vertices, tangents(vertices))
    return Surface(
        np.arange(len(rows)),
        rows,
        np.column_stack([chainage[:-1], chainage[1:]]),
        at,
        radius,
        length - length[:, 180:181],
        10.0,
    )


def box(half_width: float, up: float, down: float) -> np.ndarray:
    """Radius of a rectangle about the axis at each degree."""
    angle = np.radians(np.arange(361) - 180.0)
    with np.errstate(divide="ignore"):
        side = half_width / np.abs(np.sin(angle))
        level = np.where(np.cos(angle) > 0, up, down) / np.abs(np.cos(angle))
    return np.minimum(side, level)


BOX = straight(box(3.0, 2.5, 2.5))
ROUND = straight(np.full(361, 4.0))


def flat(half_width: float, level: float, **others: object) -> Ground:
    """Level ground from wall to wall, 5 to 55 m along."""
    columns = np.arange(-round(half_width / COLUMN), round(half_width / COLUMN) + 1)
    rows = np.arange(5, 56)
    return replace(
        Ground(
            5, int(columns[0]), np.full((len(rows), len(columns)), level), np.full(len(rows), 0.03),
            np.tile([-half_width, half_width], (len(rows), 1)), np.zeros((len(rows), 2)),
        ),
        **others,
    )  # fmt: skip


LINE = Line.of([[0.0, 0.0], [LENGTH, 0.0]], [0.0, LENGTH])


def test_the_ground_of_a_box_begins_at_its_corner():
    # crown to corner 3 m, wall 5 m; the sections, one node a degree, cut the corners a little
    arcs = foot_arcs(flat(3.0, 97.5), LINE, BOX)
    np.testing.assert_allclose(arcs, np.tile([-8.0, 8.0], (51, 1)), atol=0.04)


def test_ground_half_way_up_the_wall_begins_there():
    np.testing.assert_allclose(foot_arcs(flat(3.0, 99.0), LINE, BOX), np.tile([-6.5, 6.5], (51, 1)), atol=0.02)
    half = np.sqrt(4.0**2 - 2.0**2)
    arc = 4.0 * np.arccos(-0.5)
    np.testing.assert_allclose(foot_arcs(flat(half, 98.0), LINE, ROUND), np.tile([-arc, arc], (51, 1)), atol=0.02)


def test_a_wall_that_is_missing_is_thought_on():
    foot = np.tile([-3.0, 3.0], (51, 1))
    foot[20:25, 1] = np.nan
    np.testing.assert_allclose(foot_arcs(flat(3.0, 99.0, foot=foot), LINE, BOX), np.tile([-6.5, 6.5], (51, 1)), atol=0.02)
    foot[:, 0] = np.nan  # no wall anywhere on the left: from where the ground is last seen
    np.testing.assert_allclose(foot_arcs(flat(3.0, 99.0, foot=foot), LINE, BOX)[:, 0], -6.5, atol=0.11)


@pytest.mark.parametrize(("rows", "floor_there"), [(10, True), (30, False)])
def test_without_ground_nothing_is_floor_unless_it_is_hidden_for_a_few_metres_only(rows, floor_there):
    assert foot_arcs(None, LINE, BOX).shape == (0, 2)
    height = np.full((51, 61), 97.5)
    height[10 : 10 + rows] = np.nan
    arcs = foot_arcs(flat(3.0, 97.5, height=height), LINE, BOX)
    assert np.isnan(arcs[10 : 10 + rows]).all()
    floor = Floor.of(5, *arcs.T)
    arc = np.array([-9.0, 0.0, 9.0])
    assert floor.covers(np.full(3, 50.0), arc).tolist() == [True, False, True]
    assert floor.covers(np.full(3, 20.0), arc).tolist() == [floor_there, False, floor_there]
    assert floor.covers(np.full(3, np.nan), np.full(3, np.nan)).tolist() == [False, False, False]


def test_the_wall_above_its_foot_is_lining():
    floor = Floor.of(5, *foot_arcs(flat(3.0, 99.0), LINE, BOX).T)
    arcs = np.array([6.5 - FLOOR_EDGE - 0.02, 6.5 - FLOOR_EDGE + 0.02])
    assert floor.covers(np.full(2, 30.0), arcs).tolist() == [False, True]
    assert floor.covers(np.full(2, 30.0), -arcs).tolist() == [False, True]
    assert floor.covers(np.full(2, 30.0), arcs - 0.1, above=0.1).tolist() == [False, True]


@pytest.mark.parametrize("inset", [0.005, 0.03, 0.1, 0.25])
def test_along_an_edge_a_point_takes_the_normal_of_its_own_face(inset):
    edges = Edges.of(BOX, 0.0, LENGTH)
    wall = np.array([[30.2, -3.0, 102.5 - inset]])
    ceiling = np.array([[30.2, -3.0 + inset, 102.5]])
    for points, normal in ((wall, [0, 1, 0]), (ceiling, [0, 0, -1])):
        found = edges.normals_of(points, BOX.unroll(points))[0]
        assert found @ np.array(normal) > np.cos(np.radians(3))


def test_a_round_tunnel_has_no_edges():
    edges = Edges.of(ROUND, 0.0, LENGTH)
    assert not edges.sharp[1:-1].any()


@pytest.mark.parametrize("apart", [0.8, -0.15])
def test_a_section_measured_in_a_niche_or_on_a_box_is_no_lining(apart):
    radius = np.tile(box(3.0, 2.5, 2.5), (12, 1))
    radius[5, 250:300] += apart
    surface = straight(radius)
    astray = Astray.of(surface)
    at = np.array([20.0, float(surface.chainages[5]), 40.0])
    middle = np.interp(275, np.arange(361), surface.arcs[5])
    covered = astray.covers(at, np.array([middle, -middle, 0.0]))
    assert covered.tolist() == [[False, True, False], [False, False, False], [False, False, False]]


def test_rock_that_differs_from_section_to_section_is_lining():
    rng = np.random.default_rng(1)
    radius = 4.0 + np.repeat(rng.normal(0, 0.1, (12, 73)), 5, axis=1)[:, :361]
    assert (Astray.of(straight(radius)).apart > 0).mean() < 0.03


def test_a_wider_stretch_is_no_niche():
    radius = np.tile(box(3.0, 2.5, 2.5), (12, 1))
    radius[6:] += 0.5
    assert not Astray.of(straight(radius)).apart.any()
    radius = np.tile(box(3.0, 2.5, 2.5), (12, 1))
    radius[6] += 0.5
    assert not Astray.of(straight(radius)).apart.any()


@pytest.mark.parametrize(
    ("degrees", "hours"), [(0.0, 12.0), (15.0, 0.5), (90.0, 3.0), (135.0, 4.5), (-90.0, 9.0), (-30.0, 11.0)]
)
def test_clock_area_and_coordinates_of_a_patch(degrees, hours):
    arc = 4.0 * np.radians(degrees)

    shaped = shapes(rectangle(30.0, arc - 0.5, 32.0, arc + 0.5), ROUND)
    assert min(abs(shaped.clock - hours), 12 - abs(shaped.clock - hours)) < 0.01
    assert 0 < shaped.clock <= 12
    assert shaped.area == pytest.approx(2.0, rel=1e-3)
    # The strip lies right of the axis, towards −y, for positive arcs.
    assert shaped.strip.bounds == pytest.approx((30.0, -arc - 0.5, 32.0, -arc + 0.5), abs=1e-6)
    points = np.array(shaped.surface.exterior.coords)
    np.testing.assert_allclose(np.hypot(points[:, 1], points[:, 2] - 100.0), 4.0, atol=1e-3)
    assert np.hypot(*np.diff(points[:, :2], axis=0).T).max() < 0.11
