"""Sonar scans beside each other: what a slanting beam hears, normals that do not lean, whether two beds are one."""

from __future__ import annotations

import numpy as np
import pytest

from tunneldb.arrays import Float
from tunneldb.registration.underwater.adjustment import Scan, fit
from tunneldb.registration.underwater.chain import MIN_LOG_RATIO, bed_likelihood
from tunneldb.registration.underwater.observations import (
    BEAM_SPREAD,
    Patches,
    Pose,
    find_patches,
    find_smooth_patches,
    nearer_by_slant,
)
from tunneldb.registration.underwater.walls import find_walls
from tunneldb.registration.underwater.water_surface import Level

DEPTH = 2.0  # m of the bed below the water
SCANNER = 1.2  # m of the scanner below it


def bed(x: Float, y: Float, phase: float = 0.0) -> Float:
    """Height of a bed with crests of some centimetres, 1.5 to 4 m long."""
    waves = [(0.03, 2.1, 0.4), (0.025, -1.6, 2.7), (0.02, 3.9, -1.1), (0.015, -2.8, -3.3)]
    return -DEPTH + sum(a * np.sin(u * x + v * y + k * 1.7 + phase * (k + 1)) for k, (a, u, v) in enumerate(waves))


def patches_of(x: float, rng: np.random.Generator, phase: float = 0.0) -> tuple[Patches, Pose]:
    """Patches of the bed about a scanner at x, with 5 mm of noise."""
    place = rng.uniform([-6.0, -3.0], [6.0, 3.0], (1200, 2)) + np.array([x, 0.0])
    step = 0.01
    height = bed(place[:, 0], place[:, 1], phase)
    slope = [(bed(place[:, 0] + dx, place[:, 1] + dy, phase) - height) / step for dx, dy in ((step, 0.0), (0.0, step))]
    normal = np.column_stack([-slope[0], -slope[1], np.ones(len(place))])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    pose = Pose(np.eye(3), np.array([x, 0.0, -SCANNER]), 1.0)
    centre = np.column_stack([place, height + rng.normal(0.0, 0.005, len(place))])
    return Patches(pose.to_file(centre), normal, np.full(len(place), 20), np.full(len(place), 0.015)), pose


def moved(pose: Pose, along: float) -> Pose:
    return Pose(pose.rotation, pose.translation + np.array([along, 0.0, 0.0]), pose.scale)


@pytest.mark.parametrize("elevation", [10.0, 25.0, 60.0, 90.0])
def test_a_slanting_beam_comes_nearer_by_what_its_power_is_off_its_middle(elevation: float) -> None:
    rise = np.radians(elevation)
    off = np.linspace(-5.0, 5.0, 20001) * BEAM_SPREAD
    power = np.exp(-0.5 * (off / BEAM_SPREAD) ** 2) * np.maximum(np.sin(rise + off), 0.0)  # Lambert, off steeper
    middle = float((off * power).sum() / power.sum())
    reach = 4.0
    point = np.array([[reach * np.cos(rise), 0.0, -reach * np.sin(rise)]])
    mine = nearer_by_slant(point, np.zeros(3), np.array([[0.0, 0.0, 1.0]]))[0]
    assert mine == pytest.approx(middle * reach * np.cos(rise), rel=0.02, abs=1e-9)


def test_normals_through_patches_do_not_lean_towards_the_scanner() -> None:
    rng = np.random.default_rng(3)
    place = rng.uniform(-7.0, 7.0, (60000, 2))
    points = np.column_stack([place, np.full(len(place), -1.5)])
    reach = np.linalg.norm(points, axis=1)
    points = points[(reach > 3.0) & (reach < 7.0)]
    # an echo from anywhere in its beam is put into the beam's middle: an arc about the scanner
    axis = np.cross(points, [0.0, 0.0, 1.0])
    axis /= np.linalg.norm(axis, axis=1)[:, None]
    turn = rng.uniform(-0.5, 0.5, len(points)) * np.radians(1.0)
    points = points * np.cos(turn)[:, None] + np.cross(axis, points) * np.sin(turn)[:, None]

    def lean(found: Patches) -> float:
        way = -found.centre[:, :2] / np.linalg.norm(found.centre[:, :2], axis=1)[:, None]
        return float((found.normal[:, :2] * way).sum(axis=1).mean())

    assert lean(find_patches(points)) > 0.015
    assert abs(lean(find_smooth_patches(points))) < 0.003


def test_beds_are_told_to_be_one_where_they_are_and_nowhere_else() -> None:
    rng = np.random.default_rng(5)
    one, first = patches_of(0.0, rng)
    other, second = patches_of(5.0, rng)
    another, _ = patches_of(5.0, rng, phase=2.0)
    rough = 0.03
    assert bed_likelihood((one, other), (first, second), rough) > MIN_LOG_RATIO
    assert bed_likelihood((one, another), (first, second), rough) < 0.0
    for along in (-0.6, 0.6):
        assert bed_likelihood((one, other), (first, moved(second, along)), rough) < 0.0


def test_a_flat_bed_says_nothing_of_the_place() -> None:
    rng = np.random.default_rng(7)
    one, first = patches_of(0.0, rng)
    flat = Patches(np.column_stack([one.centre[:, :2], np.full(len(one.centre), SCANNER - DEPTH)]),
                   np.tile([0.0, 0.0, 1.0], (len(one.centre), 1)), one.count, one.spread)  # fmt: skip
    assert abs(bed_likelihood((flat, flat), (first, moved(first, 2.0)), 0.0)) < 1e-9


def test_a_scan_is_fitted_beside_one_that_stays() -> None:
    rng = np.random.default_rng(11)
    one, first = patches_of(0.0, rng)
    other, second = patches_of(5.0, rng)
    steps = np.mgrid[-15.0:20.0:0.05, -0.6:1.5:0.05].reshape(2, -1).T
    sides = [np.column_stack([steps[:, 0], np.full(len(steps), side), steps[:, 1]]) for side in (-3.0, 3.0)]
    walls = find_walls(np.concatenate(sides) + rng.normal(0.0, 0.002, (2 * len(steps), 3)))
    level = Level(np.zeros((0, 3)), 0.005)
    scans = [Scan(one, one, one, level, first, {}), Scan(other, other, other, level, moved(second, 0.15), {})]
    fitted = fit(scans, walls, (), [(0, 1)], (0.3, 0.2, 0.1, 0.1, 0.1, 0.1), fixed=1)
    np.testing.assert_array_equal(fitted.poses[0].translation, first.translation)
    assert abs(fitted.poses[1].translation[2] - second.translation[2]) < 0.01
    assert abs(fitted.poses[1].translation[0] - second.translation[0]) < 0.015
