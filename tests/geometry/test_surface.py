"""Unrolling against closed formulas: a circular tunnel on a circular, sloped axis."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tunneldb.errors import UserError
from tunneldb.geometry.alignment import Alignment
from tunneldb.geometry.frame import frames_at, plan_lengths, segment_rows, tangents
from tunneldb.geometry.surface import Surface

ORIGIN = np.array([512_000.0, 4_104_000.0, 414.0])
TUNNEL_RADIUS = 4.0


class Helix:
    """A circular arc in plan with a constant slope, turning right."""

    def __init__(self, radius: float, slope: float) -> None:
        self.radius, self.slope = radius, slope

    def position(self, s: np.ndarray) -> np.ndarray:
        angle = s / self.radius
        return ORIGIN + np.column_stack([self.radius * (1 - np.cos(angle)), self.radius * np.sin(angle), self.slope * s])

    def frame(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        angle = s / self.radius
        tangent = np.column_stack([np.sin(angle), np.cos(angle), np.full_like(s, self.slope)])
        tangent /= np.hypot(1.0, self.slope)
        right = np.column_stack([np.cos(angle), -np.sin(angle), np.zeros_like(s)])
        return tangent, right, np.cross(right, tangent)

    def point(self, s: np.ndarray, arc: np.ndarray, offset: np.ndarray) -> np.ndarray:
        _, right, up = self.frame(s)
        r = TUNNEL_RADIUS - offset
        angle = arc / TUNNEL_RADIUS
        return self.position(s) + (r * np.sin(angle))[:, None] * right + (r * np.cos(angle))[:, None] * up


def circular_surface(helix: Helix, length: float) -> Surface:
    vertices = helix.position(np.arange(0.0, length + 1, 10.0))
    tangent = tangents(vertices)
    ends = np.concatenate([[0.0], np.cumsum(plan_lengths(vertices, tangent))])
    chainages = np.arange(2.5, length, 5.0)
    arc = TUNNEL_RADIUS * np.radians(np.arange(-180.0, 181.0))
    return Surface(
        number=np.arange(len(vertices) - 1),
        segments=segment_rows(vertices, tangent),
        ends=np.column_stack([ends[:-1], ends[1:]]),
        chainages=chainages,
        radius=np.full((len(chainages), 361), TUNNEL_RADIUS),
        arcs=np.tile(arc, (len(chainages), 1)),
        reach=10.0,
    )


@pytest.mark.parametrize(("radius", "slope"), [(300.0, 0.04), (300.0, -0.04), (-300.0, 0.0), (4000.0, 0.017)])
def test_unroll_of_a_circular_tunnel(radius: float, slope: float) -> None:
    helix = Helix(radius, slope)
    surface = circular_surface(helix, 200.0)
    rng = np.random.default_rng(1)
    s, arc = rng.uniform(1.0, 199.0, 5000), rng.uniform(-12.5, 12.5, 5000)
    offset = rng.normal(0.0, 0.1, 5000)
    unrolled = surface.unroll(helix.point(s, arc, offset))
    # the ruled planes differ from the true angle by a fifth of a millimetre, the nodes' chords by as much from the circle
    np.testing.assert_allclose(unrolled.chainage, s, atol=5e-4)
    np.testing.assert_allclose(unrolled.arc, arc, atol=5e-4)
    np.testing.assert_allclose(unrolled.offset, offset, atol=5e-4)


def test_normal_points_to_the_axis() -> None:
    helix = Helix(300.0, 0.04)
    surface = circular_surface(helix, 100.0)
    s, arc = np.linspace(5.0, 95.0, 50), np.linspace(-12.0, 12.0, 50)
    normal = surface.unroll(helix.point(s, arc, np.zeros(50))).normal
    inward = helix.position(s) - helix.point(s, arc, np.zeros(50))
    np.testing.assert_allclose(normal, inward / TUNNEL_RADIUS, atol=2e-3)


@settings(max_examples=50, deadline=None)
@given(
    radius=st.sampled_from([300.0, -300.0, 800.0, 4000.0]),
    slope=st.floats(-0.04, 0.04),
    seed=st.integers(0, 2**32 - 1),
)
def test_there_and_back(radius: float, slope: float, seed: int) -> None:
    """Sections of any smooth shape that changes along the tunnel: roll is the inverse of unroll to 10 nm."""
    surface = circular_surface(Helix(radius, slope), 60.0)
    rng = np.random.default_rng(seed)
    angle = np.radians(np.arange(-180.0, 181.0))
    shape = np.zeros((len(surface.chainages), 361))
    for order in range(1, 4):
        a, b = rng.normal(0.0, 0.15 / order, (2, len(surface.chainages), 1))
        shape += a * np.cos(order * angle) + b * np.sin(order * angle)
    radii = TUNNEL_RADIUS + shape
    step = np.hypot(*np.diff(np.stack([radii * np.sin(angle), radii * np.cos(angle)]), axis=2))
    arcs = np.concatenate([np.zeros((len(step), 1)), np.cumsum(step, axis=1)], axis=1)
    arcs -= arcs[:, 180:181]
    varied = Surface(surface.number, surface.segments, surface.ends, surface.chainages, radii, arcs, 10.0)
    chainage = rng.uniform(0.5, 59.5, 200)
    arc = rng.uniform(-0.95, 0.95, 200) * TUNNEL_RADIUS * np.pi * 0.9
    offset = rng.uniform(-0.5, 0.5, 200)
    points = varied.to_space(chainage, arc, offset)
    assert not np.isnan(points).any()
    back = varied.unroll(points)
    np.testing.assert_allclose(back.chainage, chainage, atol=1e-8)
    np.testing.assert_allclose(back.arc, arc, atol=1e-8)
    np.testing.assert_allclose(back.offset, offset, atol=1e-8)


def test_surface_is_continuous_across_planes() -> None:
    surface = circular_surface(Helix(300.0, 0.04), 100.0)
    planes = surface.ends[1:, 0]
    for arc in (-10.0, 0.0, 7.0):
        before = surface.to_space(planes - 1e-6, np.full(len(planes), arc), np.zeros(len(planes)))
        after = surface.to_space(planes + 1e-6, np.full(len(planes), arc), np.zeros(len(planes)))
        assert np.linalg.norm(after - before, axis=1).max() < 1e-5


def test_a_place_about_the_given_axis_is_found_again_in_space() -> None:
    turn = np.linspace(0.0, 1.0, 12)
    axis = Alignment.from_polyline(
        np.column_stack([300 * np.sin(turn), 300 * (1 - np.cos(turn)), 15 * turn]) + 1000.0, 40.0, 5.0
    )
    places = np.column_stack([np.linspace(45.0, 330.0, 60), np.linspace(-4.0, 4.0, 60), np.linspace(3.0, -2.0, 60)])
    np.testing.assert_allclose(axis.across(axis.in_space(places)), places, atol=1e-6)


def test_off_the_tunnel() -> None:
    helix = Helix(300.0, 0.0)
    surface = circular_surface(helix, 100.0)
    far = np.vstack(
        [
            helix.position(np.array([-20.0])),  # before the first plane
            helix.position(np.array([130.0])),  # after the last one
            helix.position(np.array([50.0])) + np.array([0.0, 0.0, 30.0]),  # above it
            ORIGIN + 1e6,
        ]
    )
    unrolled = surface.unroll(far)
    assert np.isnan(unrolled.chainage).all()
    assert np.isnan(unrolled.offset).all()
    assert np.isnan(surface.to_space(np.array([50.0, 500.0]), np.array([20.0, 0.0]), np.zeros(2))).all()


def test_unroll_does_not_depend_on_order() -> None:
    helix = Helix(300.0, 0.02)
    surface = circular_surface(helix, 200.0)
    rng = np.random.default_rng(3)
    points = helix.point(rng.uniform(-5, 205, 20_000), rng.uniform(-12, 12, 20_000), rng.normal(0, 1, 20_000))
    order = rng.permutation(len(points))
    straight, mixed = surface.unroll(points), surface.unroll(points[order])
    np.testing.assert_array_equal(straight.chainage[order], mixed.chainage)
    np.testing.assert_array_equal(straight.arc[order], mixed.arc)


def test_gap_between_sections_is_off_the_tunnel() -> None:
    surface = circular_surface(Helix(4000.0, 0.0), 100.0)
    keep = (surface.chainages < 30.0) | (surface.chainages > 60.0)
    holed = Surface(
        surface.number, surface.segments, surface.ends, surface.chainages[keep], surface.radius[keep], surface.arcs[keep], 10.0
    )
    chainage = np.array([10.0, 32.0, 45.0, 58.0, 80.0])
    held = ~np.isnan(holed.to_space(chainage, np.zeros(5), np.zeros(5))[:, 0])
    np.testing.assert_array_equal(held, [True, True, False, True, True])


def test_frame_is_orthonormal_and_on_its_plane() -> None:
    vertices = Helix(300.0, 0.04).position(np.arange(0.0, 31.0, 10.0))
    segments = segment_rows(vertices, tangents(vertices))
    frames = frames_at(segments, np.ones(3, int), np.array([0.0, 0.3, 1.0]))
    for frame in frames:
        np.testing.assert_allclose(frame[1:] @ frame[1:].T, np.eye(3), atol=1e-12)
        assert frame[2, 2] == 0.0
        assert frame[3, 2] > 0.99
    np.testing.assert_allclose(frames[0, 0], vertices[1], atol=1e-9)


class TestAlignment:
    def test_chainage_is_plan_length(self) -> None:
        """1.7 % of slope makes 0.14 m in a kilometre: chainage must not have it."""
        xyz = ORIGIN + np.column_stack([np.zeros(51), np.linspace(0, 1000, 51), np.linspace(0, 17, 51)])
        alignment = Alignment.from_polyline(xyz, 500.0)
        np.testing.assert_allclose(alignment.chainage(xyz[1:-1]), 500.0 + np.linspace(0, 1000, 51)[1:-1], atol=1e-6)

    @pytest.mark.parametrize("radius", [300.0, 1000.0])
    def test_stations_lie_on_the_arc(self, radius: float) -> None:
        helix = Helix(radius, 0.03)
        alignment = Alignment.from_polyline(helix.position(np.arange(0.0, 201.0, 20.0)), 0.0)
        np.testing.assert_allclose(alignment.vertices, helix.position(alignment.number * 10.0), atol=1e-3)

    def test_chainage_off_the_axis(self) -> None:
        helix = Helix(300.0, 0.0)
        alignment = Alignment.from_polyline(helix.position(np.arange(0.0, 201.0, 20.0)), 1000.0)
        rng = np.random.default_rng(0)
        s, arc = rng.uniform(1, 199, 1000), rng.uniform(-12, 12, 1000)
        points = helix.point(s, arc, np.zeros(1000))
        np.testing.assert_allclose(alignment.chainage(points), 1000.0 + s, atol=2e-3)
        np.testing.assert_allclose(alignment.distance(points), TUNNEL_RADIUS, atol=1e-3)

    def test_beyond_the_ends(self) -> None:
        xyz = ORIGIN + np.column_stack([np.zeros(3), [3.0, 20.0, 47.0], np.zeros(3)])
        alignment = Alignment.from_polyline(xyz, 3.0)
        points = ORIGIN + np.array([[0.0, 2.9, 0.0], [0.0, 3.1, 0.0], [0.0, 46.9, 0.0], [0.0, 47.1, 0.0]])
        np.testing.assert_array_equal(np.isnan(alignment.chainage(points)), [True, False, False, True])

    def test_two_points_make_a_straight_line(self) -> None:
        alignment = Alignment.from_polyline(ORIGIN + np.array([[0.0, 0, 0], [30.0, 40.0, 0.5]]), 0.0)
        np.testing.assert_allclose(alignment.end, 50.0)

    @pytest.mark.parametrize(
        ("xyz", "spacing", "says"),
        [
            ([[0.0, 0, 0]], 10.0, "at least 2 points"),
            ([[0.0, 0, 0], [0, 0, 5]], 10.0, "point 2 has the same plan position"),
            ([[0.0, 0, 0], [0, 50, 5]], 7.0, "divide 1000 m"),
        ],
    )
    def test_bad_axes(self, xyz: list[list[float]], spacing: float, says: str) -> None:
        with pytest.raises(UserError, match=says):
            Alignment.from_polyline(np.array(xyz), 0.0, spacing)


def test_tangents_are_exact_on_a_circle() -> None:
    helix = Helix(300.0, 0.0)
    s = np.arange(0.0, 101.0, 10.0)
    np.testing.assert_allclose(tangents(helix.position(s)), helix.frame(s)[0], atol=2e-5)
    np.testing.assert_allclose(tangents(helix.position(s[:2])), np.tile(helix.frame(np.array([5.0]))[0], (2, 1)), atol=1e-9)
    np.testing.assert_allclose(plan_lengths(helix.position(s), tangents(helix.position(s))), 10.0, atol=1e-5)


@given(low=st.floats(-3.9, 3.9))
@settings(max_examples=20, deadline=None)
def test_the_waterline_is_where_a_circle_meets_the_water(low: float) -> None:
    """Water a metres above the axis of a level straight tunnel meets a circle at the angle with cosine a / radius."""
    surface = circular_surface(Helix(1e7, 0.0), 60.0)
    left, right = surface.waterline(np.array([12.0, 31.7, 200.0]), ORIGIN[2] + low)
    arc = TUNNEL_RADIUS * np.arccos(low / TUNNEL_RADIUS)
    assert right[:2] == pytest.approx([arc, arc], abs=2e-3)
    assert left[:2] == pytest.approx([-arc, -arc], abs=2e-3)
    assert np.isnan([left[2], right[2]]).all()


def test_a_tunnel_above_the_water_has_no_waterline() -> None:
    surface = circular_surface(Helix(1e7, 0.0), 60.0)
    left, right = surface.waterline(np.array([12.0]), ORIGIN[2] - 4.1)
    assert np.isnan(left).all()
    assert np.isnan(right).all()
