"""Distances along a line and to its right, and lines found from bare clouds, against closed formulas."""

from __future__ import annotations

import numpy as np
import pytest

from tunneldb.geometry.centreline import centreline_through
from tunneldb.geometry.plan_line import PlanLine
from tunneldb.simulate import Parameters, simulate

CORNER = (500_000.0, 4_700_000.0)


def _arc(radius: float, spacing: float, length: float) -> np.ndarray:
    """Vertices on a circle that bends to the right, from CORNER northward."""
    angle = np.arange(0.0, length + spacing / 2, spacing) / radius
    return np.column_stack([CORNER[0] + radius * (1 - np.cos(angle)), CORNER[1] + radius * np.sin(angle)])


def test_straight_line_gives_distance_and_right_hand_offset():
    line = PlanLine.of([[0, 0, 5], [0, 10, 6], [0, 25, 7]], [100, 110, 125])
    along, across = line.place(np.array([[2.0, 3.0, 0.0], [-1.0, 20.0, 9.0], [0.5, -4.0, 0.0], [0.5, 30.0, 0.0]]))
    np.testing.assert_allclose(along, [103.0, 120.0, 96.0, 130.0], atol=1e-12)
    np.testing.assert_allclose(across, [2.0, -1.0, 0.5, 0.5], atol=1e-12)


def test_chainage_of_vertices_is_kept_though_it_is_not_their_distance():
    line = PlanLine.of([[0, 0], [0, 10], [0, 20]], [0.0, 10.5, 20.0])
    along, _ = line.place(np.array([[3.0, 5.0], [3.0, 10.0], [3.0, 15.0]]))
    np.testing.assert_allclose(along, [5.25, 10.5, 15.25])


def test_on_a_circle_along_is_the_angle_and_across_the_distance_from_its_centre():
    radius = 300.0
    vertices = _arc(radius, 2.0, 200.0)
    line = PlanLine.of(vertices, 2.0 * np.arange(len(vertices)))
    rng = np.random.default_rng(1)
    angle, right = rng.uniform(0.01, 0.65, 5000), rng.uniform(-8, 8, 5000)
    from_centre = radius - right
    points = np.column_stack([CORNER[0] + radius - from_centre * np.cos(angle), CORNER[1] + from_centre * np.sin(angle)])
    along, across = line.place(points)
    # The chord of 2 m lies up to 1.7 mm inside the circle.
    assert np.abs(across - right).max() < 2e-3
    assert np.abs(along - radius * angle).max() < 2e-3


def test_place_and_point_are_inverse_and_continuous_at_bends():
    vertices = np.array([[0, 0], [10, 0], [18, 6], [20, 15], [20, 30]]) + np.array(CORNER)
    step = np.hypot(*np.diff(vertices, axis=0).T)
    line = PlanLine.of(vertices, np.concatenate([[7.0], 7.0 + np.cumsum(step)]))
    rng = np.random.default_rng(2)
    a, x = rng.uniform(2.0, 55.0, 4000), rng.uniform(-3, 3, 4000)
    along, across = line.place(line.point(a, x))
    np.testing.assert_allclose(along, a, atol=1e-7)
    np.testing.assert_allclose(across, x, atol=1e-7)
    for vertex in line.distance[1:-1]:
        before, after = line.point([vertex - 1e-6] * 7, np.arange(-3, 4)), line.point([vertex + 1e-6] * 7, np.arange(-3, 4))
        assert np.abs(before - after).max() < 1e-5


@pytest.mark.parametrize(
    ("vertices", "along"),
    [([[0, 0]], [0]), ([[0, 0], [0, 0]], [0, 1]), ([[0, 0], [1, 0]], [1, 1]), ([[0, 0], [np.nan, 0]], [0, 1])],
)
def test_line_refuses_what_is_none(vertices, along):
    with pytest.raises(ValueError, match="line"):
        PlanLine.of(vertices, along)


@pytest.mark.parametrize("azimuth", [0.0, 35.0, 90.0, 170.0, 290.0])
@pytest.mark.parametrize("length", [10.0, 30.0])
def test_short_piece_shows_its_direction_though_it_may_be_wider_than_long(azimuth, length):
    parameters = Parameters(length=length, radius=0, azimuth=azimuth, density=60, scanner="profiler", leaks=1, niches=False)
    cloud = simulate(parameters)
    # Of the shorter one, 2 m that are four times as wide.
    piece = np.abs(cloud.chainage - 5.0) < 1.0 if length == 10.0 else np.full(len(cloud), True)
    line = centreline_through(cloud.xyz[piece])
    direction = np.diff(line.vertices, axis=0)
    true = np.array([np.sin(np.radians(azimuth)), np.cos(np.radians(azimuth))])
    sine = (direction[:, 0] * true[1] - direction[:, 1] * true[0]) / np.hypot(*direction.T)
    assert np.abs(np.degrees(np.arcsin(sine))).max() < 3.0


def test_long_bend_is_followed():
    parameters = Parameters(length=220, radius=-70, straight=20, density=40, scanner="profiler", scanner_offset=0.0, leaks=1)
    cloud = simulate(parameters)
    line = centreline_through(cloud.xyz)
    assert line.distance[-1] == pytest.approx(220.0, abs=4.0)
    along, across = line.place(parameters.tunnel().line.position(np.linspace(5, 215, 100)))
    assert np.abs(across).max() < 0.8
    rate = np.gradient(along, np.linspace(5, 215, 100))
    assert np.abs(np.abs(rate) - 1.0).max() < 0.05


def test_single_point_gets_a_line_and_no_points_an_error():
    line = centreline_through(np.array([[5.0, 6.0, 7.0]] * 3))
    along, across = line.place(np.array([[5.0, 6.0, 7.0]]))
    assert np.isfinite(along).all()
    assert abs(across[0]) < 1.0
    with pytest.raises(ValueError, match="no points"):
        centreline_through(np.full((4, 3), np.nan))


def test_a_point_far_away_does_not_lead_the_line_astray():
    rng = np.random.default_rng(10)
    angle = rng.uniform(0, 2 * np.pi, 20_000)
    tube = np.column_stack([rng.uniform(0, 12, 20_000), 4 * np.sin(angle), 4 * np.cos(angle)])
    line = centreline_through(np.vstack([tube, [[9e5, -4e5, 3e3]]]))
    _, across = line.place(tube)
    assert np.abs(across).max() < 4.2
    assert line.distance[-1] == pytest.approx(12.0, abs=0.5)


def test_points_that_lie_far_apart_are_no_tunnel() -> None:
    far = np.array([[0.0, 0, 0], [1e6, 0, 0], [0, 1e6, 0], [1e6, 1e6, 0]])
    with pytest.raises(ValueError, match="not a piece of a tunnel"):
        centreline_through(np.repeat(far, 2, axis=0))
