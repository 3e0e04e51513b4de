"""Target spheres in scans of things of known shape: found where they are, and nothing else taken for one."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from support.target_spheres import Ball, Rod, Thing, Wall, scan

from tunneldb.classification.targets.curvature import CurvedCells
from tunneldb.classification.targets.detection import Refusal, Sphere, confirmed, find_spheres, join
from tunneldb.classification.targets.fit import coverage, distance_error, fit_ratio, fit_sphere
from tunneldb.geometry.normals import eigenvalues, normal

pytestmark = pytest.mark.slow

R = 0.0725
TOLERANCE = 0.005
AT = (272_005.0, 4_765_000.0, 641.0)  # as large as coordinates are
X, Y, Z = AT
WALL = Wall((X + 1.4, Y, Z), (-1.0, 0.2, 0.0))
FLOOR = Wall((X, Y, Z - 1.5), (0.0, 0.0, 1.0))


def look(
    things: list[Thing],
    seed: int,
    observer: tuple[float, float, float] = (-5.0, 0.0, 0.0),
    known: bool = True,
    step: float = 0.0018,
) -> tuple[list[Sphere], list[Refusal]]:
    """What is found of things around `AT` that are scanned from a place, relative to it."""
    station = np.add(AT, observer)
    opening = 0.9 / float(np.linalg.norm(observer))
    points, _ = scan(things, station, step, seed, towards=AT, opening=opening)
    observers = np.broadcast_to(station if known else np.full(3, np.nan), points.shape)
    return find_spheres(points, observers, R, TOLERANCE)


FOUND = {
    "free": [Ball(AT, R), WALL, FLOOR],
    "touching the wall": [Ball(AT, R), Wall((X + R, Y, Z), (-1.0, 0.0, 0.0))],
    "on a post": [Ball(AT, R), Rod((X, Y, Z - 1.5), (X, Y, Z - 0.06), 0.02), WALL],
    "on a thick post": [Ball(AT, R), Rod((X, Y, Z - 1.5), (X, Y, Z - 0.06), 0.04), WALL],
    "behind a cable": [Ball(AT, R), Rod((X - 0.2, Y - 0.14, Z - 1), (X - 0.2, Y + 0.06, Z + 1), 0.03), WALL],
    "on the floor": [Ball(AT, R), Wall((X, Y, Z - R), (0.0, 0.0, 1.0)), WALL],
}


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("name", FOUND)
def test_a_sphere_is_found_where_it_is(name: str, seed: int) -> None:
    found, _ = look(FOUND[name], seed, (-5.0, -1.0, 0.6))
    assert len(found) == 1
    error = distance_error(found[0].centre, np.array(AT))
    assert error < 0.002
    assert error < 3.5 * found[0].sigma
    assert abs(found[0].radius - R) < TOLERANCE
    assert found[0].points >= 60


def test_a_sphere_is_found_without_knowing_where_the_scanner_stood() -> None:
    found, _ = look(FOUND["free"], 4, known=False)
    assert len(found) == 1
    assert distance_error(found[0].centre, np.array(AT)) < 0.002


OTHERS = {
    "lamp of 50 mm": [Ball(AT, 0.05), WALL],
    "lamp of 60 mm": [Ball(AT, 0.06), WALL],
    "ball 8 mm smaller": [Ball(AT, R - 0.008), WALL],
    "ball 8 mm larger": [Ball(AT, R + 0.008), WALL],
    "lamp of 100 mm": [Ball(AT, 0.1), WALL],
    "bollard": [Rod((X, Y, Z - 1.5), (X, Y, Z), R), WALL, FLOOR],
    "bollard with a round top": [Rod((X, Y, Z - 1.5), (X, Y, Z), R), Ball(AT, R), WALL],
    "pipe along the wall": [Rod((X, Y - 3, Z), (X, Y + 3, Z), R), WALL],
    "head": [Ball(AT, R, (0.9, 1.05, 1.3)), Rod((X, Y, Z - 0.6), (X, Y, Z - 0.08), 0.06), WALL],
    "helmet": [Ball(AT, 0.12, (1.1, 0.9, 0.8)), Rod((X, Y, Z - 0.8), (X, Y, Z), 0.09), WALL],
    "corner": [WALL, FLOOR, Wall((X, Y + 0.3, Z), (0.0, -1.0, 0.0))],
    "cables": [Rod((X, Y - 3, Z + 0.1 * k), (X, Y + 3, Z + 0.1 * k), 0.02 + 0.01 * k) for k in range(4)] + [WALL],
}


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("observer", [(-5.0, 0.0, 0.0), (-3.0, -2.0, 1.0)], ids=["level", "above"])
@pytest.mark.parametrize("name", OTHERS)
def test_nothing_else_is_taken_for_one(name: str, observer: tuple[float, float, float], seed: int) -> None:
    found, _ = look(OTHERS[name], seed, observer)
    assert not found


@pytest.mark.parametrize(("name", "true"), [("lamp of 60 mm", 60.0), ("ball 8 mm smaller", 64.5), ("ball 8 mm larger", 80.5)])
def test_balls_of_another_radius_are_refused_with_it(name: str, true: float) -> None:
    _, refused = look(OTHERS[name], 4)
    (reason,) = [refusal.reason for refusal in refused if distance_error(refusal.centre, np.array(AT)) < 0.01]
    said = re.search(r"radius ([0-9.]+) ± ([0-9.]+) mm", reason)
    assert said
    assert float(said[1]) == pytest.approx(true, abs=max(4 * float(said[2]), 1.5))


def test_spheres_of_another_radius_are_found_by_that() -> None:
    station = np.add(AT, (-4.0, 0.0, 0.0))
    points, _ = scan([Ball(AT, 0.1), WALL], station, 0.002, 5, towards=AT)
    found, _ = find_spheres(points, np.broadcast_to(station, points.shape), 0.1, TOLERANCE)
    assert len(found) == 1
    assert distance_error(found[0].centre, np.array(AT)) < 0.002


def test_two_spheres_that_touch_are_two() -> None:
    centres = [(X, Y - R, Z), (X, Y + R, Z)]
    found, _ = look([Ball(centre, R) for centre in centres] + [WALL], 6)
    assert len(found) == 2
    for centre in centres:
        assert min(distance_error(sphere.centre, np.array(centre)) for sphere in found) < 0.002


def test_the_order_of_the_points_hardly_matters() -> None:
    station = np.add(AT, (-5.0, 0.0, 0.0))
    points, _ = scan(FOUND["free"], station, 0.0018, 7, towards=AT)
    observers = np.broadcast_to(station, points.shape)
    one, _ = find_spheres(points, observers, R, TOLERANCE)
    other, _ = find_spheres(np.random.default_rng(1).permutation(points), observers, R, TOLERANCE)
    assert len(one) == len(other) == 1
    assert distance_error(one[0].centre, other[0].centre) < 1e-5
    again, _ = find_spheres(points, observers, R, TOLERANCE)
    assert np.array_equal(one[0].centre, again[0].centre)


@pytest.mark.parametrize("count", [0, 1, 5, 100])
def test_few_points_hold_no_sphere(count: int) -> None:
    points = np.tile(np.array(AT), (count, 1))
    assert find_spheres(points, np.full(points.shape, np.nan), R, TOLERANCE) == ([], [])


def test_sigma_is_as_large_as_the_errors() -> None:
    """Over 40 seeds, errors in units of their own standard deviation; and with a free radius it is farther off."""
    scaled, fixed, free = [], [], []
    station = np.add(AT, (-5.0, 0.0, 0.0))
    for seed in range(40):
        points, number = scan([Ball(AT, R), WALL], station, 0.0022, seed, towards=AT, opening=0.02)
        observers = np.broadcast_to(station, points.shape)
        fit = fit_sphere(points, observers, np.add(AT, 0.004), R, 3 * TOLERANCE)
        assert fit is not None
        assert np.mean(number[fit.used] == 0) > 0.98
        fixed.append(distance_error(fit.centre, np.array(AT)))
        scaled.append(fixed[-1] / fit.sigma)
        free.append(distance_error(fit.free_centre, np.array(AT)))
    assert 0.8 < math.sqrt(np.mean(np.square(scaled))) < 1.3
    assert np.median(free) > 1.5 * np.median(fixed)


def test_coverage_of_caps() -> None:
    """The cap within an angle of the direction to the scanner is (1 - cos) / 2 of the surface; cells are 1/8 high."""
    rng = np.random.default_rng(1)
    out = rng.standard_normal((200_000, 3))
    out /= np.linalg.norm(out, axis=1)[:, None]
    towards = np.array([0.6, -0.48, 0.64])
    centre = np.array(AT)
    for share in (0.125, 0.25, 0.5, 1.0):
        cap = out[out @ towards > 1.0 - 2.0 * share + 1e-9]
        assert coverage(centre + R * cap, centre, 3.0 * towards) == pytest.approx(share)
    side = np.cross(towards, [0.0, 0.0, 1.0])
    quarter = out[(out @ towards > 0) & (out @ side > 0)]
    assert coverage(centre + R * quarter, centre, towards) == pytest.approx(0.25, abs=0.09)


def test_fit_ratio_is_a_share_of_volume() -> None:
    rng = np.random.default_rng(2)
    box = rng.uniform(-1.0, 1.0, (400_000, 3))
    true = np.linalg.norm(box, axis=1) <= 0.7
    for distance, radius in ((0.1, 0.7), (0.3, 0.6), (0.05, 0.5), (0.0, 0.7), (0.0, 0.9), (1.5, 0.7)):
        common = true & (np.linalg.norm(box - [distance, 0.0, 0.0], axis=1) <= radius)
        assert fit_ratio(distance, radius, 0.7) == pytest.approx(common.sum() / true.sum(), abs=0.006)
    # The third sphere of Table 4 of the paper.
    assert fit_ratio(0.00387, 0.06954, 0.0708) == pytest.approx(0.9293, abs=0.01)


def test_curved_keeps_spheres_whole_and_walls_out() -> None:
    rng = np.random.default_rng(3)
    wall = np.column_stack([rng.uniform(0, 8, 60_000), rng.normal(0, 0.003, 60_000), rng.uniform(0, 4, 60_000)])
    turn = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    places = [(1.0 + 1.3 * k + rng.uniform(0, 0.3), R if k % 2 else 0.5, rng.uniform(0.5, 3.5)) for k in range(5)]
    balls = []
    for place in places:
        out = rng.standard_normal((150, 3))
        out[:, 1] = -np.abs(out[:, 1])
        balls.append(np.array(place) + R * out / np.linalg.norm(out, axis=1)[:, None] * [1, -1, 1])
    curved = CurvedCells(R, 30)
    parts = [np.array(AT) + part @ turn.T for part in (wall, *balls)]
    for part in parts:
        for chunk in np.array_split(part, 3):
            curved.add(chunk)
    curved.close()
    for part in parts[1:]:
        assert curved.holds(part).all()
    assert curved.holds(parts[0]).mean() < 0.12
    assert not curved.holds(np.array([[0.0, 0.0, 0.0]])).any()


def test_moments_agree_with_lapack() -> None:
    rng = np.random.default_rng(4)
    for _ in range(200):
        points = rng.standard_normal((20, 3)) * rng.uniform(0.001, 1.0, 3)
        matrix = np.cov(points.T)
        xx, yy, zz, xy, xz, yz = matrix[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        values, vectors = np.linalg.eigh(matrix)
        found = eigenvalues.py_func(xx, yy, zz, xy, xz, yz)
        assert found == pytest.approx(values, rel=1e-6, abs=1e-12 * values[2])
        if values[1] > 1.5 * values[0]:
            assert abs(np.dot(normal.py_func(xx, yy, zz, xy, xz, yz, found[0]), vectors[:, 0])) == pytest.approx(1.0, abs=1e-6)


def test_rows_of_several_scans_are_joined() -> None:
    centres = np.array([[0, 0, 0], [1, 0, 0], [0.01, 0, 0], [1.0, 0.02, 0], [1.05, 0.02, 0], [5, 0, 0]], float)
    group = join(centres, np.array([1, 1, 2, 2, 3, 3]), R)
    assert group.tolist() == [0, 1, 0, 1, 1, 2]
    # Of one scan, two are never the same sphere: the nearer one of another scan is.
    group = join(np.array([[0, 0, 0], [0.06, 0, 0], [0.01, 0, 0]], float), np.array([1, 1, 2]), R)
    assert group.tolist() == [0, 1, 0]
    assert join(np.zeros((0, 3)), np.zeros(0, int), R).tolist() == []


def test_few_points_need_another_scan() -> None:
    assert confirmed(np.array([0, 1, 0, 2]), np.array([False, False, True, True])).tolist() == [True, False, True, True]
    station = np.add(AT, (-5.0, 0.0, 0.0))
    for step, firm in ((0.0042, False), (0.0018, True)):
        points, number = scan([Ball(AT, R), WALL], station, step, 1, towards=AT, opening=0.1)
        assert ((number == 0).sum() >= 50) == firm
        found, _ = find_spheres(points, np.broadcast_to(station, points.shape), R, TOLERANCE)
        assert [sphere.firm for sphere in found] == [firm]
