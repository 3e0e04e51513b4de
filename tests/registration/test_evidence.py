"""Evidence for a pose from walls, water and features of the plan. The canal is drawn here: x along, y across, water at z 0."""

from __future__ import annotations

import numpy as np
import pytest

from tunneldb.arrays import Float
from tunneldb.registration.underwater.adjustment import weights_of
from tunneldb.registration.underwater.choice import Cells, explained, margin
from tunneldb.registration.underwater.observations import Patches, Pose, profile_rows, wall_rows, waterline_rows
from tunneldb.registration.underwater.walls import Walls, find_walls
from tunneldb.registration.underwater.water_surface import Level, surface_noise

WIDTH = 6.0
NORTH = np.eye(3)


def laser(rng: np.random.Generator, dents: float = 0.0, pier: bool = False) -> Float:
    """Points of two walls of 30 m from the water up, and of a pier of 1 m × 0.4 m in the middle of the canal."""
    x, z = (grid.ravel() for grid in np.meshgrid(np.arange(-15.0, 15.0, 0.03), np.arange(0.0, 1.2, 0.03)))
    sides = []
    for side in (-1.0, 1.0):
        dent = np.interp(x, np.arange(-15.0, 15.5, 0.7), rng.normal(0.0, dents, 44))
        sides.append(np.column_stack([x, side * WIDTH / 2.0 + dent, z]))
    if pier:
        along, across = np.arange(-0.5, 0.5, 0.02), np.arange(-0.2, 0.2, 0.02)
        outline = [np.column_stack([along, np.full(len(along), y)]) for y in (-0.2, 0.2)]
        outline += [np.column_stack([np.full(len(across), x_end), across]) for x_end in (-0.5, 0.5)]
        plan = np.repeat(np.concatenate(outline), 40, axis=0)
        sides.append(np.column_stack([plan, rng.uniform(0.0, 1.2, len(plan))]))
    points = np.concatenate(sides)
    return points + rng.normal(0.0, 0.002, points.shape)


def below(walls_at: Float, rng: np.random.Generator) -> Float:
    """Points of upright walls with this plan (n, 2), at depths from 0.2 to 1.8 m."""
    return np.column_stack([walls_at, rng.uniform(-1.8, -0.2, len(walls_at))]) + rng.normal(0.0, 0.01, (len(walls_at), 3))


def pose_at(x: float, y: float = 1.5) -> Pose:
    return Pose(NORTH, np.array([x, y, 0.0]), 1.0)


def test_an_upright_surface_in_open_water_is_evidence_against_a_pose() -> None:
    rng = np.random.default_rng(4)
    walls = find_walls(laser(rng, pier=True))
    x = rng.uniform(-5.0, 5.0, 3000)
    banks = below(np.column_stack([x, np.where(rng.random(3000) < 0.5, -3.0, 3.0)]), rng)
    nose = below(np.column_stack([np.full(600, 0.5), rng.uniform(-0.2, 0.2, 600)]), rng)
    true = pose_at(3.0)
    points = true.to_file(np.concatenate([banks, nose]))
    upright = np.ones(len(points), np.bool_)
    right, wrong = (explained(points, upright, pose, walls, ()) for pose in (true, pose_at(6.0)))
    assert np.nanmean(right.ratio[3000:]) > 3.0
    assert np.nanmean(wrong.ratio[3000:]) < 0.1
    assert margin(Cells.of(points), right, wrong) > 1.5
    unknown = explained(points, ~upright, pose_at(6.0), walls, ())
    assert np.isnan(unknown.ratio[3000:]).all()  # as points of the bed, which the laser does not show


def patches(place: Float, normal: Float) -> Patches:
    return Patches(place, normal, np.full(len(place), 20), np.full(len(place), 0.01))


def wall_patches(pose: Pose) -> Patches:
    x = np.tile(np.arange(-6.0, 6.0, 0.3), 2)
    side = np.repeat([-1.0, 1.0], len(x) // 2)
    place = np.column_stack([x, side * WIDTH / 2.0, np.full(len(x), -1.0)])
    return patches(pose.to_file(place), np.column_stack([np.zeros(len(x)), -side, np.zeros(len(x))]))


def test_dents_of_a_straight_wall_tell_nothing_along_it() -> None:
    rng = np.random.default_rng(5)
    pose = pose_at(0.0, 0.0)
    walls: Walls = find_walls(laser(rng, dents=0.01))
    rows = wall_rows(wall_patches(pose), pose, walls, np.zeros(2), 0, np.arange(4), 0.1)
    weight = np.concatenate([weights_of(one) for one in rows])
    along = np.concatenate([one.poses[:, 3] for one in rows])
    across = np.concatenate([one.poses[:, 4] for one in rows])
    assert np.abs(walls.normal[:, 0]).max() > 0.02  # pieces follow the dents
    assert np.sqrt((weight * along**2).sum()) < 0.003 * np.sqrt((weight * across**2).sum())


def test_a_feature_of_the_plan_weighs_as_one_observation() -> None:
    rng = np.random.default_rng(6)
    walls = find_walls(laser(rng, pier=True))
    pose = pose_at(3.0)
    y = np.repeat(np.linspace(-0.15, 0.15, 7), 30)
    nose = np.column_stack([np.full(len(y), 0.5), y, rng.uniform(-1.5, -0.2, len(y))])
    rows = profile_rows(patches(pose.to_file(nose), np.tile([1.0, 0.0, 0.0], (len(y), 1))), pose, walls, 0, np.arange(2), 0.1)
    assert rows is not None
    sigma = 1.0 / np.sqrt((weights_of(rows) * rows.poses[:, 3] ** 2).sum())
    assert 0.015 < sigma < 0.04  # at most four squares of a metre meet in it, 3 cm each


def test_flat_water_gives_the_tilt() -> None:
    rng = np.random.default_rng(7)
    place = rng.uniform(-1.0, 1.0, (60, 2))
    surface = np.column_stack([place, 0.01 * place[:, 0] + rng.normal(0.0, 0.002, 60)])
    noise = surface_noise(surface)
    assert noise == pytest.approx(0.002, abs=0.0005)
    tilt = np.zeros(3)  # roll, pitch, height
    for _ in range(8):
        level = surface + np.column_stack([np.zeros((60, 2)), place[:, 1] * tilt[0] - place[:, 0] * tilt[1] + tilt[2]])
        rows = waterline_rows(Level(level, noise), pose_at(0.0, 0.0), 0.0, 0, 0, firm=False)
        assert rows is not None
        design = rows.poses[:, [0, 1, 5]]
        weighted = design * weights_of(rows)[:, None]
        tilt -= np.linalg.solve(weighted.T @ design, weighted.T @ rows.residual)
    assert tilt[1] == pytest.approx(0.01, abs=0.001)
    assert tilt[0] == pytest.approx(0.0, abs=0.001)
    assert surface_noise(surface + np.column_stack([np.zeros((60, 2)), rng.normal(0.0, 0.03, 60)])) > 0.015
