"""Shapes of free-standing objects in a tunnel, built of balls, rods and bricks.

Each takes a :class:`Place`, its position on the ground.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Float
from tunneldb.simulate.objects.fixtures import APPENDAGE, OBJECT, SPHERE
from tunneldb.simulate.objects.primitives import Primitive, ball, brick, rod

UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Place:
    """Position on the ground: coordinates (3,), unit vectors along, right and up of the floor there (3, 3)."""

    spot: Float
    axes: Float

    def turned(self, angle: float) -> Float:
        """Return the floor's axes, turned by ``angle`` (rad) about its normal."""
        c, s = math.cos(angle), math.sin(angle)
        t, u, w = self.axes
        return np.array([c * t + s * u, c * u - s * t, w])


def _horizontal(angle: float) -> Float:
    return np.array([math.cos(angle), math.sin(angle), 0.0])


def person(place: Place, rng: np.random.Generator) -> Primitive:
    """Return a person standing upright, 1.6 to 1.9 m tall: legs, trunk, arms, head."""
    size = rng.uniform(1.6, 1.9) / 1.75
    ahead = _horizontal(rng.uniform(0.0, 2.0 * math.pi))
    side = np.cross(UP, ahead)
    stride = rng.uniform(0.0, 0.2)

    def at(across: float, up: float, forward: float = 0.0) -> Float:
        return np.asarray(place.spot + size * (across * side + up * UP + forward * ahead))

    parts = [
        rod(at(0.11, -0.05, stride), at(0.09, 0.85), 0.07 * size),
        rod(at(-0.11, -0.05, -stride), at(-0.09, 0.85), 0.07 * size),
        rod(at(0.0, 0.95), at(0.0, 1.28), 0.16 * size),
        rod(at(0.17, 1.36), at(-0.17, 1.36), 0.08 * size),
        rod(at(0.22, 1.36), at(0.27, 0.85, rng.uniform(0.0, 0.3)), 0.045 * size),
        rod(at(-0.22, 1.36), at(-0.27, 0.85, rng.uniform(0.0, 0.3)), 0.045 * size),
        ball(at(0.0, 1.62), 0.12 * size),
    ]
    return Primitive("person", OBJECT, float(rng.uniform(-1.0, 4.0)), np.array(parts))


def case(place: Place, rng: np.random.Generator) -> Primitive:
    """Return a closed box on the ground, 0.3 to 0.9 m."""
    size = rng.uniform((0.4, 0.3, 0.25), (0.9, 0.6, 0.7))
    middle = place.spot + (0.5 * size[2] - 0.01) * place.axes[2]
    return Primitive("case", OBJECT, 4.0, np.array([brick(middle, size.tolist(), place.turned(rng.uniform(0.0, math.pi)))]))


def trolley(place: Place, rng: np.random.Generator) -> Primitive:
    """Return a flat car along the tunnel: deck on four legs, a handle, a load."""
    t, u, w = axes = place.turned(rng.normal(0.0, 0.05))
    deck = rng.uniform(0.35, 0.6)
    parts = [brick(place.spot + deck * w, (1.2, 0.7, 0.06), axes)]
    for i, j in itertools.product((-0.5, 0.5), (-0.28, 0.28)):
        foot = place.spot + i * t + j * u
        parts.append(rod(foot - 0.02 * w, foot + deck * w, 0.04))
    for j in (-0.3, 0.3):
        low = place.spot + 0.58 * t + j * u + deck * w
        parts.append(rod(low, low + 0.12 * t + 0.6 * w, 0.02))
    grip = place.spot + 0.7 * t + (deck + 0.6) * w
    parts.append(rod(grip - 0.3 * u, grip + 0.3 * u, 0.02))
    load = rng.uniform(0.15, 0.45)
    parts.append(brick(place.spot - 0.15 * t + (deck + 0.03 + 0.5 * load) * w, (0.6, 0.5, load), axes))
    return Primitive("trolley", OBJECT, 3.0, np.array(parts))


def _legs(place: Place, top: Float, spread: float, turn: float) -> list[Float]:
    """Return three legs from the ground to ``top``, as rods."""
    feet = [
        place.spot + spread * (math.cos(a) * place.axes[0] + math.sin(a) * place.axes[1]) for a in turn + np.arange(3) * 2.0944
    ]
    return [rod(foot - 0.02 * place.axes[2], top, 0.018) for foot in feet]


def tripod(place: Place, rng: np.random.Generator) -> Primitive:
    """Return a tripod with an instrument on it, 1.4 to 1.8 m high."""
    head = place.spot + rng.uniform(1.1, 1.4) * UP
    turn = rng.uniform(0.0, 2.0 * math.pi)
    axes = np.array([_horizontal(turn), _horizontal(turn + 0.5 * math.pi), UP])
    parts = [*_legs(place, head, 0.45, turn), brick(head + 0.17 * UP, (0.18, 0.2, 0.34), axes)]
    return Primitive("tripod", OBJECT, 3.0, np.array(parts))


def bollard(place: Place, rng: np.random.Generator) -> Primitive:
    """Return a round-topped post, 0.7 to 1.1 m high, 8 to 16 cm thick."""
    radius = rng.uniform(0.04, 0.08)
    top = place.spot + (rng.uniform(0.7, 1.1) - radius) * UP
    return Primitive("bollard", OBJECT, -1.0, np.array([rod(place.spot - 0.1 * UP, top, radius)]))


def globe_on_post(place: Place, radius: float, rng: np.random.Generator) -> Primitive:
    """Return a lamp: a globe on a post 1.5 to 2.2 m high."""
    top = place.spot + rng.uniform(1.5, 2.2) * UP
    return Primitive("globe", OBJECT, -2.0, np.array([rod(place.spot - 0.1 * UP, top, 0.025), ball(top + radius * UP, radius)]))


def globe_on_wall(wall: Float, normal: Float, radius: float) -> Primitive:
    """Return a lamp: a globe on a stem on the lining."""
    stem = wall + 0.1 * normal
    return Primitive("globe", APPENDAGE, -2.0, np.array([rod(wall, stem, 0.02), ball(stem + radius * normal, radius)]))


def sphere(centre: Float, radius: float) -> Primitive:
    """Return a white target sphere."""
    return Primitive("sphere", SPHERE, -3.0, np.array([ball(centre, radius)]))


def sphere_tripod(place: Place, centre: Float, radius: float, rng: np.random.Generator) -> Primitive:
    """Return the support of a target sphere on the ground: three legs to a pin under it."""
    low = centre - radius * UP
    head = low - 0.05 * UP
    parts = [*_legs(place, head, 0.4, rng.uniform(0.0, 2.0 * math.pi)), rod(head, low, 0.008)]
    return Primitive("tripod", OBJECT, 4.0, np.array(parts))


def sphere_bracket(wall: Float, centre: Float, radius: float) -> Primitive:
    """Return the support of a target sphere on the wall: an arm from the lining to its back."""
    arm = centre - wall
    length = float(np.linalg.norm(arm))
    return Primitive("bracket", APPENDAGE, 4.0, np.array([rod(wall, wall + arm * (1.0 - radius / length), 0.01)]))


STANDING: dict[str, Callable[[Place, np.random.Generator], Primitive]] = {
    "case": case,
    "trolley": trolley,
    "tripod": tripod,
}
