"""Positions of ladders, piers, niches, objects, boat and scanners in a synthetic canal tunnel."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from tunneldb.arrays import Float
from tunneldb.simulate.canal.cast import CYLINDER_COLUMNS, FRAME_COLUMNS, Scene
from tunneldb.simulate.canal.centreline import Centreline
from tunneldb.simulate.canal.parameters import CanalParameters
from tunneldb.simulate.canal.section import (
    BALL,
    BOAT,
    BOX,
    HULL,
    OBJECT,
    PIER,
    RECESS,
    SOLID_COLUMNS,
    Section,
    bed_heights,
    section,
)

STILE_GAP, DIAMETER = 0.32, 0.035  # m; Moisan et al. (2015)
RUNGS, GAP, GAP_SPREAD = 13, 0.279, 0.007  # of a wooden ladder of 3.6 m: its gaps differ by some millimetres
OVERHANG = 0.12  # m of the stiles beyond the first and the last rung


@dataclass(frozen=True)
class TrueLadder:
    """Ladder in the water.

    Attributes
    ----------
    name : str
    origin : (3,) float array
        Midpoint between the stiles at height zero along the ladder, tunnel's frame, m.
    axes : (3, 3) float array
        Unit vectors along the rungs, along the stiles upwards, and from the wall to the water, in rows.
    heights : (r,) float array
        Heights of the rungs' axes along the ladder, as measured before it was placed, m.
    hidden : tuple of int
        Indices in ``heights`` of rungs that no scan shows.
    """

    name: str
    origin: Float
    axes: Float
    heights: Float
    hidden: tuple[int, ...]
    stile_gap: float = STILE_GAP
    diameter: float = DIAMETER


class Tripod(NamedTuple):
    """Position of a sonar: (3,) in the local frame, m, and rotation (3, 3) of its upright axes to the local ones."""

    place: Float
    rotation: Float


@dataclass(frozen=True)
class Layout:
    """All objects in the canal, and the scanner positions; ``lasers`` (n, 3) in the local frame, m."""

    scene: Scene
    ladders: tuple[TrueLadder, ...]
    tripods: tuple[Tripod, ...]
    lasers: Float


def lay_out(parameters: CanalParameters, line: Centreline) -> Layout:
    """Place everything at random, reproducibly by seed."""
    rng = np.random.default_rng([parameters.seed, 1])
    cut = section(parameters)
    stations = _stations(parameters.sonar_stations, parameters.sonar_spacing)
    ladders: list[TrueLadder] = []
    cylinders: list[Float] = []
    frames: list[Float] = []
    for k, station in enumerate(_ladder_stations(parameters, stations, rng)):
        side = (-1.0) ** (k + int(parameters.seed) % 2)
        ladder, bars, frame = _ladder(parameters, line, k, station, side, sum(len(c) for c in cylinders), rng)
        ladders.append(ladder)
        cylinders.append(bars)
        frames.append(frame)
    feet = [float(line.stationed(line.to_local(one.origin))[0, 0]) for one in ladders]
    scene = Scene(
        cut,
        _solids(parameters, cut, [*stations], feet, rng),
        np.concatenate([*cylinders, np.empty((0, CYLINDER_COLUMNS))]),
        np.reshape(np.array(frames, float), (-1, FRAME_COLUMNS)),
    )
    tripods = tuple(_tripod(parameters, line, station, rng) for station in stations)
    along = _stations(parameters.laser_stations, parameters.laser_spacing)
    offsets = rng.uniform(-0.4, 0.4, len(along))
    lasers = (
        line.local(np.column_stack([along, offsets, rng.uniform(1.1, 1.4, len(along))])) if len(along) else np.empty((0, 3))
    )
    return Layout(scene, tuple(ladders), tripods, lasers)


def _stations(count: int, spacing: float) -> Float:
    return np.asarray((np.arange(count) - 0.5 * (count - 1)) * spacing)


def _ladder_stations(parameters: CanalParameters, stations: Float, rng: np.random.Generator) -> Float:
    """Return stations spread evenly over the sonars' stretch, from its middle, at least one sonar spacing apart."""
    step = max(parameters.sonar_spacing, 3.0)
    order = np.array([0.5 * (-1.0) ** k * (k + (k + 1) % 2) for k in range(parameters.ladders)])
    middle = float(stations.mean()) if len(stations) else 0.0
    reach = 0.5 * parameters.length - 1.0
    if parameters.ladders > 1 and len(stations):
        step = max(step, float(np.ptp(stations)) / parameters.ladders)
    return np.clip(middle + step * order + rng.uniform(-0.6, 0.6, parameters.ladders), -reach, reach)


def _ladder(
    parameters: CanalParameters, line: Centreline, k: int, station: float, side: float, first: int, rng: np.random.Generator
) -> tuple[TrueLadder, Float, Float]:
    """Return a ladder, its bars as cylinders, and the frame around it, in the local frame."""
    p = parameters
    heights = np.concatenate([[0.0], np.cumsum(rng.normal(GAP, GAP_SPREAD, RUNGS - 1))])
    along, left, up = line.axes(station)
    wall = side * left  # from the middle to the wall
    lean = math.radians(rng.uniform(*p.ladder_lean))
    sideways = math.radians(rng.uniform(*p.ladder_sideways)) * rng.choice([-1.0, 1.0])
    rise = up + math.tan(lean) * wall + math.tan(sideways) * along
    rise /= np.linalg.norm(rise)
    out = -wall + (wall @ rise) * rise
    out /= np.linalg.norm(out)
    across = np.cross(rise, out)
    submerged = rng.uniform(*p.ladder_submerged)
    # its upper end is in front of the wall, or rests on it
    top = (heights[-1] + OVERHANG - submerged) * (math.tan(lean) - math.tan(math.radians(p.batter)))
    standoff = max(rng.uniform(*p.ladder_standoff), top + DIAMETER)
    water = line.local(np.array([station, side * (0.5 * p.width - standoff), 0.0]))[0]
    origin = water - submerged * rise
    hidden = tuple(sorted(rng.choice(RUNGS, min(p.hidden_rungs, RUNGS - 4), replace=False).tolist()))
    low, high = -OVERHANG, heights[-1] + OVERHANG
    rows = [
        [*(origin + x * across + low * rise), *rise, high - low, 0.5 * DIAMETER, 100.0 * k]
        for x in (-0.5 * STILE_GAP, 0.5 * STILE_GAP)
    ]
    for number, height in enumerate(heights):
        if number not in hidden:
            start = origin - 0.5 * STILE_GAP * across + height * rise
            rows.append([*start, *across, STILE_GAP, 0.5 * DIAMETER, 100.0 * k + number + 1])
    middle = origin + 0.5 * (low + high) * rise
    margin = DIAMETER
    frame = [
        *middle,
        *across,
        *rise,
        *out,
        0.5 * STILE_GAP + margin,
        0.5 * (high - low) + margin,
        margin,
        first,
        first + len(rows),
    ]
    turn = line.rotation()
    truth = TrueLadder(f"L{k + 1}", line.to_tunnel(origin), np.array([across, rise, out]) @ turn.T, heights, hidden)
    return truth, np.array(rows), np.array(frame)


def _solids(
    parameters: CanalParameters, cut: Section, stations: list[float], ladders: list[float], rng: np.random.Generator
) -> Float:
    """Return piers and niches along both walls away from ladders, objects on the bed, and a boat at a wall."""
    p, half = parameters, 0.5 * parameters.width
    reach = 0.5 * p.length - 1.5
    rows = []
    for kind, count in ((BOX, p.piers), (RECESS, p.niches)):
        for k in range(count):
            s = -reach + 2.0 * reach * (k + rng.uniform(0.2, 0.8)) / count
            side = rng.choice([-1.0, 1.0])
            if any(abs(s - at) < 1.5 for at in ladders):
                continue
            if kind == BOX:
                rows.append(
                    [
                        BOX,
                        PIER,
                        s,
                        side * half,
                        -0.5 * p.depth + 0.5,
                        rng.uniform(0.2, 0.5),
                        rng.uniform(0.1, 0.3),
                        0.5 * p.depth + 1.5,
                        1.0,
                        0.0,
                    ]
                )
            else:
                size = rng.uniform(0.3, 0.5), rng.uniform(0.2, 0.4), rng.uniform(0.4, 0.9)
                rows.append([RECESS, PIER, s, side * (half + 0.1), rng.uniform(-1.0, 0.2), *size, 1.0, 0.0])
    for _ in range(p.objects):
        s, o = rng.uniform(-reach, reach), rng.uniform(-half + 0.5, half - 0.5)
        if any(math.hypot(s - at, o) < 1.5 for at in stations):
            continue  # a tripod stands there
        bed = float(bed_heights(cut, np.array([s]), np.array([o]))[0])
        turn = rng.uniform(0.0, math.pi)
        sizes = rng.uniform(0.1, 0.35, 3)
        kind = BALL if rng.random() < 0.4 else BOX
        rows.append([kind, OBJECT, s, o, bed + 0.4 * sizes[2 if kind == BOX else 0], *sizes, math.cos(turn), math.sin(turn)])
    if p.boat:
        side = rng.choice([-1.0, 1.0])
        rows.append([HULL, BOAT, rng.uniform(-0.3, 0.3) * reach, side * (half - 0.9), 0.1, 2.5, 0.6, 0.5, 1.0, 0.0])
    return np.reshape(np.array(rows, float), (-1, SOLID_COLUMNS))


def _tripod(parameters: CanalParameters, line: Centreline, station: float, rng: np.random.Generator) -> Tripod:
    p = parameters
    offset = rng.uniform(*p.sonar_offset) * rng.choice([-1.0, 1.0])
    place = line.local(np.array([station + rng.uniform(-0.3, 0.3), offset, -rng.uniform(*p.sonar_depth)]))[0]
    tilt = rng.normal(0.0, p.sonar_tripod_tilt, 2)
    turn = Rotation.from_euler("ZYX", [rng.uniform(0.0, 360.0), *tilt], degrees=True)
    return Tripod(place, turn.as_matrix())
