"""Positions of the members of a synthetic plant: wall and floor, columns, beams, pipes, trays, gratings, front objects."""

from __future__ import annotations

import numpy as np

from tunneldb.arrays import Float
from tunneldb.simulate.structure.members import (
    box_section,
    bundle,
    grating,
    i_section,
    l_section,
    pipe,
    plate,
    profile,
    tray,
    u_section,
)
from tunneldb.simulate.structure.parameters import StructureParameters
from tunneldb.simulate.structure.shapes import RECTANGLE, Structure, surface

X, Y, Z = np.eye(3)
STEELS = ("painted steel", "grey paint", "white paint", "bare steel", "rusty steel", "galvanised")
STATION_HEIGHT = 1.6
WALL, PIPES, BEAMS = 2.2, 1.1, 0.35  # depths behind the columns, m
HEIGHT = 4.0
NORTH = np.array([X, Z, -Y])  # axes of surfaces that face the stations


def build(parameters: StructureParameters, rng: np.random.Generator) -> Structure:
    """Make the structure of a seed."""
    structure = Structure()
    front, half = parameters.distance, 0.5 * parameters.width
    _wall_and_floor(structure, front, half, rng)
    _columns(structure, front, half, rng)
    _beams(structure, front, half, rng)
    _pipes(structure, front, half, rng)
    tray(structure, np.array([-half, front + 0.7, 3.55]), X, Y, 2.0 * half, rng)
    bundle(structure, np.array([-half, front + WALL - 0.05, 3.7]), X, 2.0 * half, rng)
    grating(structure, np.array([half + 0.1, front + 0.2, 0.1]), X, Z, 1.0, 1.4, float(rng.uniform(0.03, 0.05)))
    _fronts(structure, parameters, front, half, rng)
    return structure


def stations(parameters: StructureParameters, rng: np.random.Generator) -> Float:
    """Return scanner positions (n, 3), on an arc in front of the structure."""
    count = parameters.stations
    spread = np.radians(60.0) * (np.arange(count) - 0.5 * (count - 1)) / max(count - 1, 1)
    angle = spread + np.radians(rng.uniform(-12.0, 12.0, count))
    reach = parameters.distance + 0.5 * WALL
    height = STATION_HEIGHT + rng.uniform(-0.1, 0.3, count)
    return np.column_stack([reach * np.sin(angle), reach * (1.0 - np.cos(angle)), height])


def _wall_and_floor(structure: Structure, front: float, half: float, rng: np.random.Generator) -> None:
    """Add two materials in one plane at the back, the floor, and plates on the wall."""
    wide = half + 0.6
    cut = float(rng.uniform(-0.4, 0.4)) * half
    member = structure.member("wall")
    for low, high, material in ((-wide, cut, "concrete"), (cut, wide, str(rng.choice(["brick", "white paint"])))):
        origin = np.array([0.5 * (low + high), front + WALL, 0.5 * HEIGHT])
        structure.face(member, "plane", material, [surface(RECTANGLE, origin, NORTH, 0.5 * (high - low), 0.5 * HEIGHT)])
    depth = WALL + 1.5
    plate(structure, "floor", "concrete", np.array([0.0, front - 1.5 + 0.5 * depth, 0.0]), np.array([X, Y, Z]), 2 * wide, depth)
    for place in rng.uniform(-half, half - 0.6, 2):
        a, b = rng.uniform(0.3, 0.6, 2)
        middle = np.array([place + 0.3, front + WALL - 0.012, rng.uniform(0.5, 3.2)])
        plate(structure, "plate", str(rng.choice(STEELS)), middle, NORTH, float(a), float(b))


def _columns(structure: Structure, front: float, half: float, rng: np.random.Generator) -> None:
    """Add upright I-, U-, L-profiles and boxes, in turn from a random one on, turned about their axes."""
    first = int(rng.integers(4))
    for k, x in enumerate(np.arange(-half + 0.3, half - 0.2, 1.5)):
        size, thick = float(rng.uniform(0.16, 0.30)), float(rng.uniform(0.008, 0.016))
        kind, section = (
            ("I profile", i_section(size, size, thick, 1.5 * thick)),
            ("U profile", u_section(size, 0.5 * size, thick)),
            ("L profile", l_section(size, size, thick)),
            ("box", box_section(0.7 * size, 0.7 * size)),
        )[(first + k) % 4]
        turn = float(rng.choice([0.0, 0.5, 1.0, 1.5])) * np.pi + float(rng.uniform(-0.4, 0.4))
        one = np.array([np.cos(turn), np.sin(turn), 0.0])
        axes = np.array([one, np.cross(Z, one), Z])
        profile(structure, kind, str(rng.choice(STEELS)), section, np.array([x, front, 0.0]), axes, HEIGHT - 0.3)


def _beams(structure: Structure, front: float, half: float, rng: np.random.Generator) -> None:
    """Add two beams behind the columns, which divide them."""
    for z in (0.6, 3.1):
        size, thick = float(rng.uniform(0.18, 0.28)), float(rng.uniform(0.008, 0.014))
        kind, section = (
            ("I profile", i_section(size, 0.6 * size, thick, 1.4 * thick)),
            ("U profile", u_section(size, 0.4 * size, thick)),
            ("box", box_section(size, 0.6 * size)),
        )[int(rng.integers(3))]
        start = np.array([-half, front + BEAMS, z + float(rng.uniform(-0.1, 0.1))])
        # p points away from or towards the stations, q up
        away = -Y if rng.random() < 0.7 else Y
        upward = np.cross(X, away)
        profile(structure, kind, str(rng.choice(STEELS)), section, start, np.array([away, upward, X]), 2.0 * half)


def _pipes(structure: Structure, front: float, half: float, rng: np.random.Generator) -> None:
    """Add pipes above each other from the floor up, of 2 to 30 cm radius, with flanges, and elbows at the end of some."""
    z = 0.35
    radii = rng.permutation(np.concatenate([np.exp(rng.uniform(np.log(0.02), np.log(0.30), 4)), [0.05, 0.12]]))
    for k, radius in enumerate(radii.tolist()):
        z += radius
        if z + radius > 3.4:
            break
        start = np.array([-half + 0.2 * k, front + PIPES, z])
        turns = (None, Y, -Z if z > 5.0 * radius + 0.4 else None)
        turn = turns[int(rng.integers(3))]
        if turn is Y and 3.5 * radius + 0.1 > WALL - PIPES:
            turn = None
        after = 0.0 if turn is None else (0.3 if turn is Y else z - 3.0 * radius - 0.05)
        after = min(after, WALL - PIPES - 3.0 * radius - 0.02) if turn is Y else after
        length = 2.0 * half - 0.2 * k - 0.4 - (4.2 * radius + 0.15 * k if turn is not None else 0.0)
        flanges = [float(v) for v in rng.uniform(0.2, 0.8, int(rng.integers(3))) * length]
        pipe(structure, str(rng.choice(STEELS)), radius, start, X, length, turn, after, flanges)
        z += radius + 0.08 + 0.35 * radius


def _fronts(structure: Structure, parameters: StructureParameters, front: float, half: float, rng: np.random.Generator) -> None:
    """Add posts and pipes in front that hide strips of the structure."""
    for k in range(parameters.fronts):
        x, y = float(rng.uniform(-0.9, 0.9)) * half, front - 0.7 - 0.2 * k
        material = str(rng.choice(STEELS))
        if k % 2:
            size = float(rng.uniform(0.06, 0.12))
            profile(structure, "box", material, box_section(size, size), np.array([x, y, 0.0]), np.array([X, Y, Z]), 2.6)
        else:
            pipe(structure, material, float(rng.uniform(0.03, 0.10)), np.array([x, y, 0.0]), Z, 2.8, None, 0.0, [])
