"""Level of a scan by the water, batter of piers, and the speed of sound; the canal is drawn here: x along, y across."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tunneldb.arrays import Float
from tunneldb.registration.underwater.adjustment import weights_of
from tunneldb.registration.underwater.first_pose import level
from tunneldb.registration.underwater.observations import Patches, Pose, profile_rows
from tunneldb.registration.underwater.sound_speed import sound_rows
from tunneldb.registration.underwater.walls import find_walls

WIDTH, RADIUS, HALF = 6.0, 0.4, 0.8  # m; of a pier's noses; half of its straight length
LEAN = 0.04  # batter that the walls have only below the water


def pier(step: float) -> tuple[Float, Float]:
    """Plan (n, 2) of a pier with round noses in the middle of the canal, and its normals."""
    turn = np.arange(-0.5 * np.pi, 0.5 * np.pi, step / RADIUS)
    arc = np.column_stack([np.cos(turn), np.sin(turn)])
    along = np.arange(-HALF, HALF, step)
    side = np.column_stack([along, np.full(len(along), RADIUS)])
    place = np.concatenate([RADIUS * arc + [HALF, 0.0], -RADIUS * arc - [HALF, 0.0], side, -side])
    up = np.tile([0.0, 1.0], (len(along), 1))
    return place, np.concatenate([arc, -arc, up, -up])


def laser(rng: np.random.Generator) -> Float:
    """Points of two upright walls and of the pier above the water."""
    x, z = (grid.ravel() for grid in np.meshgrid(np.arange(-15.0, 15.0, 0.04), np.arange(0.0, 1.2, 0.04)))
    walls = [np.column_stack([x, np.full(len(x), side * WIDTH / 2.0), z]) for side in (-1.0, 1.0)]
    outline = np.repeat(pier(0.02)[0], 30, axis=0)
    points = np.concatenate([*walls, np.column_stack([outline, rng.uniform(0.0, 1.2, len(outline))])])
    return points + rng.normal(0.0, 0.002, points.shape)


def test_noses_of_piers_do_not_lean_with_the_walls() -> None:
    rng = np.random.default_rng(11)
    walls = find_walls(laser(rng)).leaning(np.array([LEAN, LEAN]))
    place, normal = pier(0.05)
    nose = normal[:, 0] > 0.9
    columns = np.column_stack([place[nose], np.full(int(nose.sum()), -1.2)])
    facing = np.column_stack([normal[nose], np.zeros(int(nose.sum()))])
    pose = Pose(np.eye(3), np.array([5.0, 1.0, -1.0]), 1.0)
    patches = Patches(pose.to_file(columns), facing, np.full(len(facing), 20), np.full(len(facing), 0.01))
    rows = profile_rows(patches, pose, walls, 0, np.arange(2), 0.15)
    assert rows is not None
    assert np.abs(np.median(rows.residual)) < 0.01  # and not 0.04 × 1.2 m
    assert np.abs(rows.common).max() == 0.0
    bank = walls.foot[:, 1]
    assert walls.along[np.abs(bank) > 2.5].all()


def test_the_water_levels_a_scan_between_walls_of_rock() -> None:
    rng = np.random.default_rng(12)
    rotation = Rotation.from_euler("zyx", [0.3, 0.05, -0.04]).as_matrix()
    x = rng.uniform(-8.0, 8.0, 20000)
    z = rng.uniform(-1.5, 0.9, 20000)
    side = np.where(rng.random(20000) < 0.5, -1.0, 1.0)
    rock = np.column_stack([x, side * WIDTH / 2.0 + 0.06 * z + 0.05 * np.sin(2.0 * x), z])  # both walls lean the same way
    bed = np.column_stack([x, rng.uniform(-2.8, 2.8, 20000), -1.5 + 0.03 * x + 0.1 * np.sin(x)])
    reach, turn = rng.uniform(0.3, 1.6, 3000), rng.uniform(0.0, 2.0 * np.pi, 3000)
    water = np.column_stack([reach * np.cos(turn), reach * np.sin(turn), np.full(3000, 0.9)])
    points = np.concatenate([rock, bed, water])
    points += rng.normal(0.0, 0.01, points.shape)
    flat = level(points @ rotation, 1, (WIDTH, WIDTH))
    vertical = flat.rotation @ rotation.T @ [0.0, 0.0, 1.0]  # of the tunnel, in the level scan
    assert np.degrees(np.arccos(vertical[2])) < 0.1
    assert flat.top == pytest.approx(0.9, abs=0.005)
    assert np.abs(flat.slopes) == pytest.approx([0.06, 0.06], abs=0.02)  # of either sign, by half a turn
    assert np.prod(flat.slopes) > 0.0


def test_a_scan_of_another_day_does_not_share_the_speed_of_sound() -> None:
    def weight(scale: float) -> float:
        rows = sound_rows(Pose(np.eye(3), np.zeros(3), scale), -0.01, 0, np.array([9]))
        assert rows.residual[0] == pytest.approx(scale - 0.99)
        return float(weights_of(rows)[0])

    assert weight(0.9905) > 0.5 / 0.0006**2
    assert weight(1.0) < 0.01 / 0.0006**2
