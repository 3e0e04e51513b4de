"""Positions of free-standing objects: people, equipment, lamps and target spheres, apart from each other and the scanner.

Each kind has its own random numbers, and spheres are placed first, so that more people move no sphere.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from tunneldb.arrays import Float
from tunneldb.errors import UserError
from tunneldb.simulate.floor_profile import rise
from tunneldb.simulate.objects import equipment
from tunneldb.simulate.objects.equipment import STANDING, UP, Place
from tunneldb.simulate.objects.fixtures import APPENDAGE, Appendage, Niche
from tunneldb.simulate.objects.primitives import Primitive, TargetSphere, rod
from tunneldb.simulate.parameters import Parameters
from tunneldb.simulate.scanner import Scanner
from tunneldb.simulate.tunnel.tunnel import Tunnel

# Radius of the floor that an object occupies, m.
FLOOR_RADIUS = {"person": 0.40, "case": 0.55, "trolley": 0.80, "tripod": 0.50, "bollard": 0.15, "globe": 0.25, "sphere": 0.45}
# Least distance from the scanner's path or a station, m.
MIN_SCANNER_DISTANCE = 0.9
# Least distance from the tunnel's ends, m.
MIN_END_DISTANCE = 2.0
TRIES = 400
# Least relative difference of radius between lamps and target spheres.
MIN_RADIUS_DIFFERENCE = 0.2


@dataclass
class _Floor:
    """Floor with its occupied places: rows of chainage, across, radius."""

    parameters: Parameters
    tunnel: Tunnel
    scanner: Scanner
    taken: Float

    def place(self, chainage: float, across: float) -> Place:
        """Return a position on the ground."""
        frame = self.tunnel.line.frame(np.array([chainage]))
        height = self.tunnel.section.floor + float(rise(self.parameters, self.tunnel.section, np.array([across]))[0])
        spot = frame.position[0] + across * frame.u[0] + height * frame.w[0]
        return Place(spot, np.array([frame.t[0], frame.u[0], frame.w[0]]))

    def take(self, chainage: float, across: float, room: float) -> None:
        """Reserve a place."""
        self.taken = np.vstack([self.taken, [chainage, across, room]])

    def is_free(self, chainage: float, across: float, room: float) -> bool:
        """Return True if an object of that size can stand there: level, away from others and from the scanner."""
        p = self.parameters
        level = rise(p, self.tunnel.section, np.linspace(across - room, across + room, 9))
        if np.ptp(level) > 2.0 * room * p.camber / 100.0 + 1e-9:
            return False
        if p.scanner == "profiler":
            if abs(across - p.scanner_offset) < MIN_SCANNER_DISTANCE + room:
                return False
        else:
            gap = np.hypot(self.scanner.station_chainage - chainage, self.scanner.station_offset - across)
            if gap.min() < MIN_SCANNER_DISTANCE + room:
                return False
        gap = np.hypot(self.taken[:, 0] - chainage, self.taken[:, 1] - across)
        return bool(np.all(gap > self.taken[:, 2] + room))

    def find(self, kind: str, rng: np.random.Generator) -> tuple[float, float]:
        """Find and reserve a free place; return its chainage and across."""
        line, room = self.tunnel.line, FLOOR_RADIUS[kind]
        half = self.tunnel.section.half_width - room
        for _ in range(TRIES if half > 0.0 else 0):
            s, u = (
                float(rng.uniform(line.start + MIN_END_DISTANCE, line.end - MIN_END_DISTANCE)),
                float(rng.uniform(-half, half)),
            )
            if self.is_free(s, u, room):
                self.take(s, u, room)
                return s, u
        raise UserError(f"no room on the floor for another {kind}; use fewer objects or a longer tunnel")


def _wall_spot(
    floor: _Floor, furniture: list[Appendage], niches: list[Niche], reach: float, rng: np.random.Generator
) -> tuple[float, float]:
    """Return chainage and arc of a free piece of wall 1.2 to 2.4 m above the floor, without objects on it or in front."""
    tunnel = floor.tunnel
    line, section = tunnel.line, tunnel.section
    arcs = np.linspace(0.0, section.floor_arc, 2001)
    points = section.point(arcs)[0]
    for _ in range(TRIES):
        s = float(rng.uniform(line.start + MIN_END_DISTANCE, line.end - MIN_END_DISTANCE))
        k = int(np.argmin(np.abs(points[:, 1] - section.floor - rng.uniform(1.2, 2.4)) + 10.0 * (points[:, 0] <= 0.0)))
        side = 1.0 if rng.random() < 0.5 else -1.0
        arc = side * float(arcs[k])
        hung = any(
            a.start - reach < s < a.end + reach and abs(a.arc - arc) < 0.5 * a.width + reach
            for a in furniture
            if a.kind not in ("rail", "walkway", "kerb", "carriageway")
        )
        across = side * (float(points[k, 0]) - 0.3)
        gap = np.hypot(floor.taken[:, 0] - s, floor.taken[:, 1] - across)
        if (
            not hung
            and all(abs(n.chainage - s) > 0.5 * n.width + 0.6 for n in niches)
            and np.all(gap > floor.taken[:, 2] + 0.5)
        ):
            floor.take(s, across, 0.4)
            return s, arc
    raise UserError("no room on the walls for another target sphere or lamp; use fewer or a longer tunnel")


def _occluding_cable(floor: _Floor, s: float, centre: Float, wall: Float, radius: float) -> Primitive:
    """Return a cable along the tunnel that hides the upper half of a sphere from the scanner."""
    p, scanner, line = floor.parameters, floor.scanner, floor.tunnel.line
    if p.scanner == "static":
        k = int(np.argmin(np.abs(scanner.station_chainage - s)))
        eye = scanner.stations()[k]
    else:
        frame = line.frame(np.array([s]))
        eye = frame.position[0] + p.scanner_offset * frame.u[0] + scanner.height * frame.w[0]
    along = line.frame(np.array([s])).t[0]
    sight = eye - centre
    sight -= (sight @ along) * along
    sight /= np.linalg.norm(sight)
    upward = np.cross(along, sight)
    upward *= math.copysign(1.0, upward[2])
    thick = 0.41 * radius
    middle = centre + (radius + thick + 0.02) * sight + 0.45 * radius * upward
    ends = middle - 0.8 * along, middle + 0.8 * along
    back = wall - centre
    parts = [rod(*ends, thick), *(rod(end, end + back * 1.5, 0.008) for end in ends)]
    return Primitive("cable", APPENDAGE, 6.0, np.array(parts))


def _spheres(
    floor: _Floor, furniture: list[Appendage], niches: list[Niche], rng: np.random.Generator
) -> tuple[list[TargetSphere], list[Primitive]]:
    """Return target spheres on tripods and wall brackets in turn; the third touches the wall, the fourth is half hidden."""
    p, tunnel = floor.parameters, floor.tunnel
    radius = p.sphere_radius
    spheres: list[TargetSphere] = []
    carriers: list[Primitive] = []
    for i in range(p.spheres):
        kind = {2: "touching", 3: "hidden"}.get(i, "tripod" if i % 2 == 0 else "bracket")
        if kind == "tripod":
            place = floor.place(*floor.find("sphere", rng))
            centre = place.spot + rng.uniform(1.2, 1.7) * UP
            carriers.append(equipment.sphere_tripod(place, centre, radius, rng))
        else:
            s, arc = _wall_spot(floor, furniture, niches, radius + 0.15, rng)
            offset = radius if kind == "touching" else radius + float(rng.uniform(0.18, 0.4))
            wall = tunnel.to_space(np.array([s]), np.array([arc]))[0]
            centre = tunnel.to_space(np.array([s]), np.array([arc]), offset)[0]
            if kind != "touching":
                carriers.append(equipment.sphere_bracket(wall, centre, radius))
            if kind == "hidden":
                carriers.append(_occluding_cable(floor, s, centre, wall, radius))
        spheres.append(TargetSphere(i + 1, centre, radius, kind))
    return spheres, carriers


def _globe_radius(p: Parameters, rng: np.random.Generator) -> float:
    while True:
        radius = float(rng.uniform(0.05, 0.15))
        if abs(radius - p.sphere_radius) > MIN_RADIUS_DIFFERENCE * p.sphere_radius:
            return radius


def place_objects(
    parameters: Parameters,
    tunnel: Tunnel,
    scanner: Scanner,
    furniture: list[Appendage],
    niches: list[Niche],
    seed: np.random.SeedSequence,
) -> tuple[list[Primitive], list[TargetSphere]]:
    """Return all free-standing objects, numbered from 1, and the target spheres, which have the first numbers.

    Raises
    ------
    UserError
        If there is no space for all.
    """
    p = parameters
    floor = _Floor(p, tunnel, scanner, np.empty((0, 3)))
    streams = [np.random.default_rng(s) for s in seed.spawn(5)]
    spheres, carriers = _spheres(floor, furniture, niches, streams[0])
    things = [equipment.sphere(k.centre, k.radius) for k in spheres] + carriers
    for _ in range(p.people):
        things.append(equipment.person(floor.place(*floor.find("person", streams[1])), streams[1]))
    kinds = list(STANDING)
    for i in range(p.equipment):
        kind = kinds[i % len(kinds)]
        things.append(STANDING[kind](floor.place(*floor.find(kind, streams[2])), streams[2]))
    for _ in range(p.bollards):
        things.append(equipment.bollard(floor.place(*floor.find("bollard", streams[3])), streams[3]))
    for i in range(p.globes):
        radius = _globe_radius(p, streams[4])
        if i % 2 == 0:
            things.append(equipment.globe_on_post(floor.place(*floor.find("globe", streams[4])), radius, streams[4]))
        else:
            s, arc = _wall_spot(floor, furniture, niches, radius + 0.15, streams[4])
            at = tunnel.unroll(tunnel.to_space(np.array([s]), np.array([arc]), 0.1))
            wall = tunnel.to_space(np.array([s]), np.array([arc]))[0]
            things.append(equipment.globe_on_wall(wall, at.normal[0], radius))
    return [replace(thing, number=i + 1) for i, thing in enumerate(things)], spheres
