"""Fits of rings against closed formulas, their standard errors against chance, and what is wrong of the points."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tunneldb.arrays import Float
from tunneldb.shape import fit_harmonics, fit_ring, fit_rings
from tunneldb.shape.circle import taubin
from tunneldb.shape.ellipse import distances
from tunneldb.shape.rings import Ring, RingPoints, RingRefusedError

EIGHT = np.arange(8) * 45.0


def ring(
    clock: Float = EIGHT,
    radius: float = 2.9,
    flattening: float = 0.0,
    largest: float = 0.0,
    centre: tuple[float, float] = (0, 0),
) -> Float:
    """Points (n, 2) of an ellipse at clock positions, the largest diameter at the clock position ``largest``, °."""
    at, turned = np.radians(clock), np.radians(clock - largest)
    out = 1.0 / np.hypot(np.cos(turned) / (radius + flattening), np.sin(turned) / (radius - flattening))
    return np.column_stack([out * np.sin(at), out * np.cos(at)]) + centre


def in_space(xy: Float, azimuth: float, grade: float, at: Float) -> tuple[Float, Float]:
    """Points in the plane across a direction, and that direction."""
    ahead = np.array([np.sin(azimuth) * np.cos(grade), np.cos(azimuth) * np.cos(grade), np.sin(grade)])
    right = np.array([np.cos(azimuth), -np.sin(azimuth), 0.0])
    return at + xy @ np.vstack([right, np.cross(right, ahead)]), ahead


def test_an_exact_ellipse_in_a_tilted_plane_is_found() -> None:
    at = np.array([271540.0, 2104023.0, -16.9])
    points, ahead = in_space(ring(flattening=0.02, largest=70.0), 2.1, 0.05, at)
    found = fit_ring(points, ahead)
    ellipse = found.adjustment.ellipse
    assert found.centre == pytest.approx(at, abs=1e-7)
    assert ellipse.axes == pytest.approx((2.92, 2.88), abs=1e-8)
    assert ellipse.direction == pytest.approx(70.0, abs=1e-5)
    assert found.plane.normal == pytest.approx(ahead, abs=1e-8)
    assert (found.outward.size, found.inward.size) == pytest.approx((0.0169, 0.0169), abs=3e-3)
    assert found.gap == pytest.approx(45.0, abs=0.3)


@pytest.mark.parametrize("clock", [EIGHT, np.linspace(-75.0, 75.0, 9), np.linspace(-150.0, 150.0, 400)])
def test_the_best_circle_of_exact_points_is_theirs(clock: Float) -> None:
    at = np.array([271540.0, 2104023.0, -16.9])
    points, ahead = in_space(ring(clock), 2.1, 0.05, at)
    found = fit_ring(points, ahead)
    assert found.circle_centre == pytest.approx(at, abs=1e-6)
    assert found.circle[2] == pytest.approx(2.9, abs=1e-6)


def test_the_best_circle_of_an_even_oval_has_its_centre_and_the_mean_distance_of_its_points() -> None:
    points = ring(flattening=0.05, largest=20.0, centre=(3.0, -1.0))
    found = fit_ring(points)
    assert found.circle == pytest.approx((3.0, -1.0, np.hypot(*(points - [3.0, -1.0]).T).mean()), abs=1e-7)


@pytest.mark.parametrize("clock", [EIGHT, np.linspace(-80.0, 80.0, 12), np.linspace(-135.0, 135.0, 500)])
def test_the_best_circle_satisfies_the_normal_equations_of_all_points(clock: Float) -> None:
    """Residuals, and residuals times direction, have a mean of zero; points with gross errors are included."""
    points = ring(clock) + np.random.default_rng(3).normal(0.0, 0.004, (len(clock), 2))
    points[len(points) // 3] *= 1.05
    found = fit_ring(points, sigma=0.004)
    away = points - found.circle[:2]
    size = np.hypot(*away.T)
    off = size - found.circle[2]
    assert not found.used.all()
    assert np.array([off.mean(), *(off[:, None] * away / size[:, None]).mean(axis=0)]) == pytest.approx(np.zeros(3), abs=1e-7)


def test_distances_from_an_ellipse_are_those_of_its_normals() -> None:
    a, b, angle = 3.2, 2.7, 0.4
    s = np.linspace(0.0, 2.0 * np.pi, 50)
    normal = np.column_stack([b * np.cos(s), a * np.sin(s)]) / np.hypot(b * np.cos(s), a * np.sin(s))[:, None]
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    points = (np.column_stack([a * np.cos(s), b * np.sin(s)]) + 0.1 * normal) @ turn
    e = (a - b) / 2.0
    parameters = np.array([0.0, 0.0, (a + b) / 2.0, e * np.cos(2 * angle), e * np.sin(2 * angle)])
    off, slopes = distances(parameters, points)
    assert off == pytest.approx(0.1, abs=1e-10)
    for k, step in enumerate(1e-6 * np.eye(5)):
        by_difference = (distances(parameters + step, points)[0] - distances(parameters - step, points)[0]) / 2e-6
        assert slopes[:, k] == pytest.approx(by_difference, abs=1e-6)


def test_taubins_circle_is_exact_on_a_quarter_of_one() -> None:
    assert taubin(ring(np.linspace(0.0, 90.0, 7), centre=(5.0, -3.0))) == pytest.approx([5.0, -3.0, 2.9], abs=1e-9)
    assert taubin(np.column_stack([np.arange(5.0), 2.0 * np.arange(5.0)])) is None


def test_known_harmonics_come_back_over_a_gap() -> None:
    clock = np.sort(np.random.default_rng(1).uniform(-130.0, 130.0, 300)) % 360.0
    radius = 2.9 + 0.004 * np.cos(np.radians(2 * (clock - 30.0))) + 0.002 * np.cos(np.radians(3 * (clock - 100.0)))
    found = fit_harmonics(clock, radius, 3, 0.003)
    assert found.amplitude(2)[::2] == pytest.approx((0.004, 30.0), abs=1e-8)
    assert found.amplitude(3)[::2] == pytest.approx((0.002, 100.0), abs=1e-6)
    assert np.isnan(found.amplitude(4)[0])


def test_a_chord_is_the_distance_of_its_ends() -> None:
    found = fit_ring(ring(np.arange(0.0, 360.0, 3.0), flattening=0.01, largest=90.0), orders=6)
    assert found.harmonics.chord(270.0, 90.0)[0] == pytest.approx(5.82, abs=1e-5)
    assert found.harmonics.chord(0.0, 180.0)[0] == pytest.approx(5.78, abs=1e-5)
    assert np.isnan(fit_ring(ring(np.arange(-120.0, 121.0, 3.0))).harmonics.chord(0.0, 180.0)[0])


@settings(max_examples=30, deadline=None)
@given(
    angle=st.floats(0.0, 360.0),
    scale=st.floats(0.5, 3.0),
    shift=st.tuples(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3)),
    seed=st.integers(0, 1000),
)
def test_rings_turn_shift_and_grow_with_their_points(angle: float, scale: float, shift: tuple[float, float], seed: int) -> None:
    random = np.random.default_rng(seed)
    points = ring(flattening=0.02, largest=20.0) + random.normal(0.0, 0.002, (8, 2))
    a = np.radians(angle)
    turn = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])  # clockwise, as clock positions grow
    one, other = fit_ring(points).adjustment.ellipse, fit_ring(scale * points @ turn + shift).adjustment.ellipse
    assert other.radius == pytest.approx(scale * one.radius, abs=1e-7)
    assert other.flattening == pytest.approx(scale * one.flattening, abs=1e-7)
    assert other.centre == pytest.approx(scale * one.centre @ turn + shift, abs=1e-6)
    off = (other.direction - one.direction - angle) % 180.0
    assert min(off, 180.0 - off) < 1e-3
    assert other.flattening_se == pytest.approx(scale * one.flattening_se, rel=1e-4)


def test_standard_errors_are_those_of_chance() -> None:
    random, sigma = np.random.default_rng(5), 0.003
    clock = np.array([0.0, 40.0, 95.0, 130.0, 230.0, 265.0, 310.0, 340.0])
    exact = ring(clock, flattening=0.02, largest=40.0)
    found = [fit_ring(exact + random.normal(0.0, sigma, exact.shape), sigma=sigma) for _ in range(400)]
    ellipses = [one.adjustment.ellipse for one in found if one.used.all()]
    assert len(ellipses) >= 398
    values = np.array([[*e.parameters[:3], e.flattening, e.direction] for e in ellipses])
    stated = [[*np.sqrt(np.diag(e.covariance))[:3], e.flattening_se, e.direction_se] for e in ellipses]
    assert values.std(axis=0) == pytest.approx(np.mean(stated, axis=0), rel=0.12)
    chords = np.array([one.harmonics.chord(95.0, 265.0) for one in found])
    assert chords[:, 0].std() == pytest.approx(chords[:, 1].mean(), rel=0.12)


def test_one_wrong_point_of_eight_is_left_out() -> None:
    random = np.random.default_rng(2)
    good = [ring(flattening=0.003) + random.normal(0.0, 0.002, (8, 2)) for _ in range(30)]
    bad = good[7].copy()
    bad[4] *= (2.9 - 0.03) / 2.9
    found, sigma = fit_rings([RingPoints(points) for points in [*good[:7], bad, *good[8:]]])
    assert sigma == pytest.approx(0.002, rel=0.25)
    assert [int((~one.used).sum()) for one in found if isinstance(one, Ring)] == [0] * 7 + [1] + [0] * 22
    assert isinstance(found[7], Ring)
    assert not found[7].used[4]
    assert found[7].adjustment.ellipse.radius == pytest.approx(2.9, abs=0.004)


def test_a_prism_that_stands_aside_does_not_turn_the_plane() -> None:
    points, ahead = in_space(ring(), 0.3, 0.0, np.zeros(3))
    points += 0.002 * np.random.default_rng(0).normal(size=(8, 1)) * ahead
    aside = points.copy()
    aside[4] += 0.2 * ahead
    assert fit_ring(aside, ahead).centre == pytest.approx(fit_ring(points, ahead).centre, abs=0.002)
    assert fit_ring(aside, ahead).used.all()


def test_prisms_before_the_lining_are_set_back() -> None:
    offset = np.where(np.arange(8) % 2 == 0, 0.05, 0.03)
    points = ring(flattening=0.01) * ((1.0 - offset / np.linalg.norm(ring(flattening=0.01), axis=1))[:, None])
    assert fit_ring(points, offset=offset).adjustment.ellipse.axes == pytest.approx((2.91, 2.89), abs=1e-6)


@pytest.mark.parametrize(
    ("clock", "said"),
    [
        (EIGHT[:4], "4 points"),
        (np.linspace(0.0, 60.0, 8), "too little to determine it"),
    ],
)
def test_what_makes_no_ring_is_refused(clock: Float, said: str) -> None:
    with pytest.raises(RingRefusedError, match=said):
        fit_ring(ring(clock))


def test_half_a_ring_is_a_circle_and_no_ellipse() -> None:
    found = fit_ring(ring(np.linspace(-80.0, 80.0, 8)))
    assert not found.is_ellipse
    assert found.adjustment.ellipse.radius == pytest.approx(2.9, abs=1e-9)


@pytest.mark.parametrize(("flattening", "third"), [(0.0, 0.0), (0.003, 0.0), (0.02, 0.002)])
def test_scans_without_the_floor_and_with_cables(flattening: float, third: float) -> None:
    errors = []
    for seed in range(4):
        random = np.random.default_rng(seed)
        clock = random.uniform(-135.0, 135.0, 3000)
        points = ring(clock, flattening=flattening, largest=random.uniform(0.0, 180.0))
        size = np.linalg.norm(points, axis=1)
        off = random.normal(0.0, 0.003, len(points)) + third * np.cos(3.0 * np.radians(clock - 20.0))
        cables = np.argsort(np.abs(clock - random.uniform(60.0, 120.0)))[:150]
        off[cables] -= random.uniform(0.05, 0.2, len(cables))
        ellipse = fit_ring(points * ((size + off) / size)[:, None]).adjustment.ellipse
        errors.append([ellipse.radius - 2.9, 4.0 * (ellipse.flattening - flattening) / 5.8])
    radius, ovality = np.abs(errors).max(axis=0)
    assert radius < 0.0005
    assert ovality < 0.0005
