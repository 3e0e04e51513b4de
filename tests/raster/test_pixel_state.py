"""Floor, niches and edges on straight tunnels whose sections are drawn by hand."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage
from shapely.geometry import box as rectangle
from support.straight_tunnel import LENGTH, straight

from tunneldb.anomalies.geometries import anomaly_geometries
from tunneldb.classification.ground.model import COLUMN, Ground
from tunneldb.classification.ground.wall_arcs import foot_arcs
from tunneldb.geometry.plan_line import PlanLine
from tunneldb.geometry.section_outliers import MAX_GIRTH_SHARE, SectionOutliers
from tunneldb.radiometry.edge_normals import Edges
from tunneldb.raster import appendages as appendage
from tunneldb.raster import ring_steps as step
from tunneldb.raster.accumulator import Accumulator
from tunneldb.raster.floor import FLOOR_EDGE, Floor
from tunneldb.raster.grid import Grid
from tunneldb.raster.pixel_state import pixel_states, reach
from tunneldb.raster.projection import Pixels
from tunneldb.raster.state import PixelState


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


LINE = PlanLine.of([[0.0, 0.0], [LENGTH, 0.0]], [0.0, LENGTH])


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
def test_a_section_measured_in_a_niche_or_on_a_box_leaves_the_wall(apart):
    radius = np.tile(box(3.0, 2.5, 2.5), (12, 1))
    radius[5, 250:300] += apart
    surface = straight(radius)
    outliers = SectionOutliers.of(surface, MAX_GIRTH_SHARE)
    at = np.array([20.0, float(surface.chainages[5]), 40.0])
    middle = np.interp(275, np.arange(361), surface.arcs[5])
    edge = np.interp(250, np.arange(361), surface.arcs[5])
    level, bent = outliers.offset_and_bends(at, np.array([middle, -middle, 0.0, edge]))
    np.testing.assert_allclose(level[:3], [[0, apart, 0], [0, 0, 0], [0, 0, 0]], atol=1e-6)
    assert bent.tolist() == [[False] * 3, [False] * 3, [False] * 3, [False, True, False]]
    assert outliers.offset_and_bends(at[[0, 2]], np.array([middle])) is None


def wall(rng, surface, depth):
    """Points on the right wall of a box with a niche from 26 to 29 m, unrolled."""
    x, z = rng.uniform(15.0, 45.0, 500_000), rng.uniform(-2.0, 2.0, 500_000)
    niche = (x > 26.0) & (x < 29.0) & (z > -1.65) & (z < 1.0)
    y = 3.0 + np.where(niche, depth, 0.0) + rng.normal(0.0, 0.002, len(x))
    return x, z, niche, surface.unroll(np.column_stack([x, -y, 100.0 + z]))


@pytest.mark.parametrize("measured", [True, False])
def test_the_back_of_a_niche_is_lining_though_a_section_was_measured_in_it(measured):
    radius = np.tile(box(3.0, 2.5, 2.5), (12, 1))
    if measured:
        radius[5, 250:300] += 0.5
    surface = straight(radius)
    x, z, niche, unrolled = wall(np.random.default_rng(1), surface, 0.5)
    grid = Grid.covering(0, 0.05, float(surface.arcs.min()), float(surface.arcs.max()))
    floor = Floor.of(0, np.full(61, -9.0), np.full(61, 9.0))
    with Accumulator(grid) as image:
        row, column = grid.place(unrolled.chainage, unrolled.arc)
        offset, nothing = unrolled.offset.astype(np.float32), np.zeros(len(x), np.float32)
        image.add(Pixels(row, column, np.ones(len(x), np.int32), offset, nothing, nothing), len(x))
        columns = slice(400, 800)
        window = image.window(columns.start - reach(0.05), columns.stop + reach(0.05))
        state = pixel_states(window, columns, grid, floor, SectionOutliers.of(surface, MAX_GIRTH_SHARE), 0.03)
    inside = (column >= 400) & (column < 800)
    seen = np.zeros(len(x), np.uint8)
    seen[inside] = state[row[inside], column[inside] - 400]
    within = (np.minimum(x - 26.0, 29.0 - x) > 0.3) & (z > -1.3) & (z < 0.7)
    around = (np.maximum(26.0 - x, x - 29.0) > 0.3) | (z < -1.8) | (z > 1.3)
    edge = niche & (np.minimum(x - 26.0, 29.0 - x) < 0.02)
    assert (seen[within] == PixelState.RECESS).all()
    # Where the surface bends from the wall into the niche and back, over some degrees, there is none.
    share = 0.8 if measured else 1.0
    assert (seen[around & inside] == PixelState.LINING).mean() >= share
    assert (seen[around & inside & (np.abs(z) < 0.5)] == PixelState.LINING).all()
    assert (seen[edge] == PixelState.OFF).mean() > 0.98


def test_beyond_the_ends_of_the_section_nothing_is_left_to_be_seen():
    grid = Grid.covering(0, 0.05, -15.0, 15.0)
    floor = Floor.of(0, np.full(61, np.nan), np.full(61, np.nan))
    with Accumulator(grid) as image:
        state = pixel_states(
            image.window(0, 1400), slice(200, 1400), grid, floor, SectionOutliers.of(ROUND, MAX_GIRTH_SHARE), 0.03
        )
    arc, chainage = grid.arcs(), grid.chainages(slice(200, 1400))
    beyond = np.abs(arc) > 4.0 * np.pi + 0.05
    assert (state[beyond] == PixelState.OFF).all()
    assert (state[np.abs(arc) < 4.0 * np.pi - 0.05][:, chainage < LENGTH] == PixelState.EMPTY).all()
    assert (state[:, chainage > LENGTH + 5.0] == PixelState.OFF).all()


def test_below_the_water_lining_is_submerged_not_unseen():
    grid = Grid.covering(0, 0.05, -15.0, 15.0)
    none = np.full(61, np.nan)
    floor = Floor.of(0, none, np.full(61, 7.0), (np.full(61, -6.0), np.full(61, 8.0)))
    with Accumulator(grid) as image:
        state = pixel_states(
            image.window(0, 1400), slice(200, 1400), grid, floor, SectionOutliers.of(ROUND, MAX_GIRTH_SHARE), 0.03
        )
    arc, chainage = grid.arcs(), grid.chainages(slice(200, 1400)) < LENGTH
    assert (state[arc < -6.05] == PixelState.SUBMERGED).all()
    assert (state[arc > 8.05] == PixelState.SUBMERGED).all()
    assert (state[(arc > 7.05) & (arc < 7.95)] == PixelState.FLOOR).all()
    assert (state[(arc > -5.95) & (arc < 6.95)][:, chainage] == PixelState.EMPTY).all()


def ring(rng, pixel, filled=0.9):
    """Offset image of a lining 0.1 m wider from column 400 on, its sections 2.5 m before and behind; a tray and a box."""
    rows, columns = round(20.0 / pixel), 800
    place = (np.arange(columns) + 0.5 - 400) * pixel
    # From one section to the other the surface passes over evenly.
    course = np.interp(place, [-2.5, 2.5], [0.0, -0.1]) + np.where(place > 0, 0.1, 0.0)
    offset = -course + rng.normal(0.0, 0.004, (rows, columns)) + 0.01 * np.sin(np.arange(rows) * pixel)[:, None]
    things = np.zeros((rows, columns), bool)
    things[100:115] = things[300:340, 380:410] = things[500:502] = True
    offset[things] += 0.08
    offset[rng.random(offset.shape) > filled] = np.nan
    return offset.astype(np.float32), things


@pytest.mark.parametrize("filled", [0.95, 0.3])
def test_a_step_all_round_the_section_is_lining_and_what_hangs_there_is_not(filled):
    offset, things = ring(np.random.default_rng(2), 0.02, filled)
    arc, bounds = np.linspace(10.0, -10.0, len(offset)), np.full(800, 20.0)
    jumps = step.steps(offset, 0.02, 0, arc, -bounds, bounds)
    assert jumps[400] - jumps[399] == pytest.approx(-0.1, abs=0.005)
    flat = offset - jumps
    distance = appendage.distance_from_plane(flat, 0.02)
    off = appendage.off_plane(distance, appendage.recessed(flat, distance, 0.02), 0.02)
    held = ~np.isnan(offset)
    assert off[things & held].all()
    near = ndimage.binary_dilation(things, iterations=4)
    assert off[held & ~near].mean() < 1e-4
    # Without it there is no lining beside the joint.
    distance = appendage.distance_from_plane(offset, 0.02)
    assert appendage.off_plane(distance, np.zeros_like(things), 0.02)[held & ~near].mean() > 0.01


def test_steps_are_the_same_whichever_part_they_are_seen_in():
    offset, _ = ring(np.random.default_rng(3), 0.02)
    arc, bounds, far = np.linspace(10.0, -10.0, len(offset)), np.full(800, 20.0), step.reach(0.02)
    whole = step.steps(offset, 0.02, -7, arc, -bounds, bounds)
    for first, stop in ((0, 500), (317, 700), (360, 600)):
        part = step.steps(offset[:, first:stop], 0.02, -7, arc, -bounds[first:stop], bounds[first:stop])
        np.testing.assert_array_equal(part[far:-far], whole[first:stop][far:-far])


def test_what_does_not_go_all_round_is_no_step():
    rng = np.random.default_rng(4)
    offset = rng.normal(0.0, 0.004, (1000, 400)).astype(np.float32)
    offset[:450, 200:] += 0.08  # panels on a bit less than half of the wall
    arc, bounds = np.linspace(10.0, -10.0, 1000), np.full(400, 20.0)
    assert not step.steps(offset, 0.02, 0, arc, -bounds, bounds).any()
    # The same on all of the wall above the floor.
    assert step.steps(offset, 0.02, 0, arc, np.full(400, 1.0), bounds).any()


def test_rock_that_differs_from_section_to_section_is_lining():
    rng = np.random.default_rng(1)
    radius = 4.0 + np.repeat(rng.normal(0, 0.1, (12, 73)), 5, axis=1)[:, :361]
    assert (SectionOutliers.of(straight(radius), MAX_GIRTH_SHARE).deviation != 0).mean() < 0.03


def test_a_wider_stretch_is_no_niche():
    radius = np.tile(box(3.0, 2.5, 2.5), (12, 1))
    radius[6:] += 0.5
    assert not SectionOutliers.of(straight(radius), MAX_GIRTH_SHARE).deviation.any()
    radius = np.tile(box(3.0, 2.5, 2.5), (12, 1))
    radius[6] += 0.5
    assert not SectionOutliers.of(straight(radius), MAX_GIRTH_SHARE).deviation.any()


@pytest.mark.parametrize(
    ("degrees", "hours"), [(0.0, 12.0), (15.0, 0.5), (90.0, 3.0), (135.0, 4.5), (-90.0, 9.0), (-30.0, 11.0)]
)
def test_clock_area_and_coordinates_of_a_patch(degrees, hours):
    arc = 4.0 * np.radians(degrees)

    shaped = anomaly_geometries(rectangle(30.0, arc - 0.5, 32.0, arc + 0.5), ROUND)
    assert min(abs(shaped.clock - hours), 12 - abs(shaped.clock - hours)) < 0.01
    assert 0 < shaped.clock <= 12
    assert shaped.area == pytest.approx(2.0, rel=1e-3)
    # The strip lies right of the axis, towards −y, for positive arcs.
    assert shaped.map.bounds == pytest.approx((30.0, -arc - 0.5, 32.0, -arc + 0.5), abs=1e-6)
    points = np.array(shaped.surface.exterior.coords)
    np.testing.assert_allclose(np.hypot(points[:, 1], points[:, 2] - 100.0), 4.0, atol=1e-3)
    assert np.hypot(*np.diff(points[:, :2], axis=0).T).max() < 0.11


def test_floor_begins_no_farther_down_the_wall_than_beside() -> None:
    left, right = np.full(9, -9.36), np.full(9, 9.36)
    left[4], right[4] = -9.54, 9.54
    floor = Floor.of(100, left, right)
    assert np.abs(floor.left).max() <= 9.36 + 1e-9
    assert np.abs(floor.right).max() <= 9.36 + 1e-9
    assert floor.right[0] == pytest.approx(9.34)
