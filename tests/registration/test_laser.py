"""Walls and ladders above the water in laser points. The points are made here: x along, y across, water at z 0."""

from __future__ import annotations

import numpy as np
import pytest

from tunneldb.arrays import Float
from tunneldb.registration.underwater.laser_ladders import find_laser_ladders
from tunneldb.registration.underwater.results import Ladder
from tunneldb.registration.underwater.walls import find_walls, lower_edge

WALL = 3.0
RUNGS = np.array([0.0, 0.29, 0.57, 0.87, 1.15, 1.43, 1.71, 2.0, 2.29])
GAP, RUNG, STILE = 0.36, 0.034, 0.062
OUT = WALL - 0.3


def walls(rng: np.random.Generator, mirrored: float = 0.0) -> Float:
    """Points of two walls of 20 m from the water up, and of a share of them below it, as a mirror shows them."""
    x, z = rng.uniform(-10.0, 10.0, 36_000), rng.uniform(0.0, 1.6, 36_000)
    below = (z < 0.4) & (rng.random(len(z)) < mirrored)
    x, z = np.concatenate([x, x[below]]), np.concatenate([z, -z[below]])
    sides = [np.column_stack([x, np.full(len(x), side * WALL), z]) for side in (-1.0, 1.0)]
    points = np.concatenate(sides)
    return points + rng.normal(0.0, 0.002, points.shape)


def bar(begin: Float, end: Float, radius: float, rng: np.random.Generator, count: int) -> Float:
    """Points on the side of a cylinder that faces the middle of the canal."""
    axis = (end - begin) / np.linalg.norm(end - begin)
    towards = np.array([0.0, -1.0, 0.0])
    side = np.cross(axis, towards)
    turn = rng.uniform(-1.3, 1.3, count)[:, None]
    return begin + rng.random(count)[:, None] * (end - begin) + radius * (np.cos(turn) * towards + np.sin(turn) * side)


def ladder_points(rng: np.random.Generator, zero: float) -> Float:
    """Points of a ladder with stiles thicker than its rungs; its lowest rung is at height ``zero``."""
    low, high = zero - 0.1, zero + RUNGS[-1] + 0.1
    parts = [bar(np.array([x, OUT, low]), np.array([x, OUT, high]), STILE / 2.0, rng, 4000) for x in (-GAP / 2.0, GAP / 2.0)]
    for height in RUNGS:
        ends = [np.array([x, OUT, zero + height]) for x in (-GAP / 2.0, GAP / 2.0)]
        parts.append(bar(*ends, RUNG / 2.0, rng, 500))
    points = np.concatenate(parts)
    points = points[points[:, 2] > 0.01]
    return points + rng.normal(0.0, 0.002, points.shape)


def test_a_ladder_with_thick_stiles_is_found_where_it_stands() -> None:
    rng = np.random.default_rng(1)
    zero = -1.06
    around = walls(rng)
    ladder = Ladder("1", tuple(range(1, len(RUNGS) + 1)), RUNGS, GAP, RUNG)
    (found,) = find_laser_ladders(np.concatenate([around, ladder_points(rng, zero)]), find_walls(around), [ladder])
    placed = found.placed
    assert placed.origin == pytest.approx([0.0, OUT, zero], abs=0.003)
    assert placed.stile == pytest.approx(STILE, abs=0.004)
    assert placed.gap == pytest.approx(GAP, abs=0.003)


@pytest.mark.parametrize("mirrored", [0.0, 0.4, 0.8])
@pytest.mark.parametrize("level", [0.0, 0.24])
def test_the_lower_edge_of_the_walls_is_the_water_though_it_mirrors_them(mirrored: float, level: float) -> None:
    """At grazing rays the water mirrors most of the walls' points; the level that was given may be wrong."""
    points = walls(np.random.default_rng(2), mirrored) + np.array([0.0, 0.0, level])
    points = points[points[:, 2] > -0.3]
    assert lower_edge(points, find_walls(points[points[:, 2] > max(level, 0.0)])) == pytest.approx(level, abs=0.041)
