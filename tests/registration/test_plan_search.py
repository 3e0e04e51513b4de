"""Place and heading of a sonar scan from the plan of the walls; the plan is drawn here, independently."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tunneldb.arrays import Float
from tunneldb.registration.underwater.first_pose import LevelScan
from tunneldb.registration.underwater.plan_search import find_columns, find_plan_poses, plan_cells
from tunneldb.registration.underwater.profile import find_profile
from tunneldb.registration.underwater.results import Near, SonarCloud

WIDTH, DEPTH = 6.0, 2.0
PIERS = ((-9.0, 1), (-2.0, -1), (4.0, 1), (7.5, -1))  # place along, side; 0.6 m long, 0.4 m deep
PLACE = np.array([1.3, -0.4])


def plan(piers: tuple[tuple[float, int], ...]) -> Float:
    """Points of the walls, 1 cm apart; x along, y across, tunnel's frame."""
    x = np.arange(-15.0, 15.0, 0.01)
    out = []
    for side in (-1, 1):
        y = np.full(len(x), side * WIDTH / 2.0)
        for at, where in piers:
            front = (np.abs(x - at) < 0.3) & (where == side)
            y[front] = side * (WIDTH / 2.0 - 0.4)
            if where == side:
                flank = np.arange(0.0, 0.4, 0.01)
                out += [np.column_stack([np.full(40, at + end), side * (WIDTH / 2.0 - flank)]) for end in (-0.3, 0.3)]
        out.append(np.column_stack([x, y]))
    return np.concatenate(out)


def laser(piers: tuple[tuple[float, int], ...], rng: np.random.Generator) -> Float:
    place = np.repeat(plan(piers), 10, axis=0)
    return np.column_stack([place + rng.normal(0.0, 0.002, place.shape), rng.uniform(0.0, 1.0, len(place))])


def sonar(piers: tuple[tuple[float, int], ...], rng: np.random.Generator, turn: float) -> tuple[LevelScan, Float]:
    """A level scan 1 m below the water, and its points, in the scanner's frame."""
    place = np.repeat(plan(piers), 8, axis=0)
    place = place[np.linalg.norm(place - PLACE, axis=1) < 9.0] + rng.normal(0.0, 0.01, (1, 2))
    c, s = np.cos(turn), np.sin(turn)
    own = (place - PLACE) @ np.array([[c, -s], [s, c]]) + rng.normal(0.0, 0.015, place.shape)
    points = np.column_stack([own, rng.uniform(-1.0, 1.0, len(own))])
    nothing = np.zeros((0, 3))
    return LevelScan(np.eye(3), (-3.0, 3.0), (0.0, 0.0), points, -1.0, nothing, nothing, 1.0), points


def cloud(near: Near | None = None) -> SonarCloud:
    return SonarCloud(Path("s.xyz"), np.zeros((0, 3)), 1, near)


def off(heading: float, true: float) -> float:
    return float(abs(np.angle(np.exp(1j * (heading - true)))))


@pytest.mark.parametrize("turn", [0.1, -0.12, np.pi - 0.1])
def test_piers_give_place_and_heading(turn: float) -> None:
    rng = np.random.default_rng(3)
    flat, points = sonar(PIERS, rng, turn)
    cells = plan_cells(flat, find_columns(flat, points))
    found = find_plan_poses(cloud(), cells, find_profile(laser(PIERS, rng)))
    assert np.linalg.norm(found[0].place - PLACE) < 0.05
    assert off(found[0].heading, turn) < np.radians(0.5)
    assert found[0].scale == pytest.approx(1.0, abs=0.004)


def test_a_wrong_speed_of_sound_is_seen_in_plan() -> None:
    rng = np.random.default_rng(3)
    flat, points = sonar(PIERS, rng, 0.05)
    short = 1.0 / 1.018
    flat = replace(flat, points=flat.points * short, walls=(-3.0 * short, 3.0 * short))
    cells = plan_cells(flat, find_columns(flat, points * short))
    found = find_plan_poses(cloud(), cells, find_profile(laser(PIERS, rng)))
    assert np.linalg.norm(found[0].place - PLACE) < 0.05
    assert found[0].scale == pytest.approx(1.018, abs=0.004)


def test_without_piers_many_places_fit_as_well() -> None:
    rng = np.random.default_rng(4)
    flat, points = sonar((), rng, 0.05)
    found = find_plan_poses(cloud(), plan_cells(flat, find_columns(flat, points)), find_profile(laser((), rng)))
    alike = [one for one in found if one.score > 0.97 * found[0].score]
    assert np.ptp([one.place[0] for one in alike]) > 3.0
    assert {bool(off(one.heading, 0.05) < 0.5) for one in alike} == {True, False}
    assert np.ptp([one.place[1] for one in alike if off(one.heading, 0.05) < 0.5]) < 0.1


def test_a_rough_place_limits_the_search() -> None:
    rng = np.random.default_rng(5)
    flat, points = sonar((), rng, 0.05)
    near = Near(PLACE + np.array([0.5, 0.0]), 1.0)
    found = find_plan_poses(cloud(near), plan_cells(flat, find_columns(flat, points)), find_profile(laser((), rng)))
    assert found
    assert all(near.holds(one.place) for one in found)


def test_columns_are_of_walls_and_face_the_scanner() -> None:
    rng = np.random.default_rng(6)
    flat, points = sonar(PIERS, rng, 0.0)
    bed = np.column_stack([rng.uniform(-8.0, 8.0, 4000), rng.uniform(-2.9, 2.9, 4000), np.full(4000, -1.0)])
    columns = find_columns(flat, np.concatenate([points, bed]))
    walls = plan(PIERS) - PLACE
    away = np.min(np.linalg.norm(columns.centre[::7, None, :2] - walls[None], axis=2), axis=1)
    assert np.percentile(away, 95) < 0.06
    assert ((columns.normal * columns.centre).sum(axis=1) < 0.0).all()
    assert np.allclose(columns.normal[:, 2], 0.0)
    flanks = np.abs(columns.normal[:, 0]) > 0.9
    assert 5 < flanks.sum() < 0.3 * len(flanks)


def test_the_plan_of_a_wall_that_changes_with_height_is_less_certain_below() -> None:
    rng = np.random.default_rng(7)
    smooth = find_profile(laser(PIERS, rng))
    points = laser((), rng)
    bulge = 0.15 * np.sin(points[:, 0] / 0.4 + 3.0 * np.floor(points[:, 2] / 0.4)) * np.sign(points[:, 1])
    rock = find_profile(points + np.column_stack([np.zeros(len(points)), bulge, np.zeros(len(points))]))
    assert smooth.growth < 0.01
    assert rock.growth > 0.05
    assert rock.sigma(np.array([-2.0]))[0] == pytest.approx(rock.growth * np.sqrt(2.0))


def test_few_laser_points_still_give_a_plan() -> None:
    rng = np.random.default_rng(8)
    points = laser(PIERS, rng)
    some = points[rng.random(len(points)) < 0.1]
    found = find_profile(some)
    assert len(found.place) > 150
    walls = plan(PIERS)
    away = np.min(np.linalg.norm(found.place[:, None] - walls[None, ::2], axis=2), axis=1)
    assert np.percentile(away, 90) < 0.1
