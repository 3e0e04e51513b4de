"""Geometry of a tunnel: its axis, its cross section and what hangs in it.

Local coordinates are the chainage ``s``, ``y`` to the right of it and ``z`` up from the axis. The lining is unrolled by
its girth ``u`` from the left foot over the crown to the right foot; the floor by ``v`` from the right foot back to the
left one.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

LINING, FLOOR, FIXTURE, NICHE = 0, 1, 2, 3


class Axis:
    """A line in plan of piecewise constant curvature, with a slope."""

    def __init__(
        self,
        origin: tuple[float, float, float],
        heading_deg: float,
        length: float,
        radii: Sequence[tuple[float, float]],
        slope: float,
    ):
        """
        Parameters
        ----------
        origin : tuple
            World coordinates of chainage zero.
        heading_deg : float
            Direction of travel, anticlockwise from east.
        length : float
            Length that is scanned; the line goes on for some metres on both sides.
        radii : sequence
            Chainage from where on a radius holds, and the radius (positive to the left, infinite when straight).
        slope : float
            Rise by metre.
        """
        step = 0.05
        self.s = np.arange(-12.0, length + 12.0 + step / 2, step)
        starts = np.array([r[0] for r in radii])
        bends = np.array([0.0 if np.isinf(r[1]) else 1.0 / r[1] for r in radii])
        curvature = bends[np.clip(np.searchsorted(starts, self.s, side="right") - 1, 0, None)]
        turn = np.cumsum(curvature) * step
        zero = np.argmin(np.abs(self.s))
        self.heading = np.radians(heading_deg) + turn - turn[zero]
        x, y = np.cumsum(np.cos(self.heading)) * step, np.cumsum(np.sin(self.heading)) * step
        self.x, self.y = x - x[zero] + origin[0], y - y[zero] + origin[1]
        self.z = origin[2] + slope * self.s
        self.slope = slope

    def frame(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Cosine and sine of the heading."""
        heading = np.interp(s, self.s, self.heading)
        return np.cos(heading), np.sin(heading)

    def world(self, s: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """World coordinates of local ones, as rows."""
        cosine, sine = self.frame(s)
        return np.stack(
            [
                np.interp(s, self.s, self.x) + y * sine,
                np.interp(s, self.s, self.y) - y * cosine,
                np.interp(s, self.s, self.z) + z,
            ],
            axis=-1,
        )


def arc(centre: tuple[float, float], radius: float, start_deg: float, end_deg: float, step: float = 0.06) -> np.ndarray:
    """Points of an arc; angles are anticlockwise from the right."""
    count = max(int(np.ceil(abs(np.radians(end_deg - start_deg)) * radius / step)), 2)
    angle = np.radians(np.linspace(start_deg, end_deg, count + 1))
    return np.stack([centre[0] + radius * np.cos(angle), centre[1] + radius * np.sin(angle)], axis=1)


def circle_lining(radius: float, floor_z: float) -> np.ndarray:
    """Lining of a round tunnel above a floor."""
    below = np.degrees(np.arcsin(floor_z / radius))
    return arc((0.0, 0.0), radius, 180.0 - below, below)


def horseshoe_lining(radius: float, wall_radius: float, floor_z: float) -> np.ndarray:
    """A half circle over walls of larger radius that meet it at the springline."""
    below = np.degrees(np.arcsin(-floor_z / wall_radius))
    left = arc((wall_radius - radius, 0.0), wall_radius, 180.0 + below, 180.0)
    right = arc((radius - wall_radius, 0.0), wall_radius, 0.0, -below)
    return np.concatenate([left[:-1], arc((0.0, 0.0), radius, 180.0, 0.0), right[1:]])


def polygon_lining(corners: Sequence[tuple[float, float]], step: float = 0.25) -> np.ndarray:
    """Straight walls and slabs."""
    points: list[np.ndarray] = []
    for start, end in itertools.pairwise(corners):
        first, last = np.asarray(start, float), np.asarray(end, float)
        count = max(int(np.ceil(np.linalg.norm(last - first) / step)), 1)
        points.append(first + (last - first) * (np.arange(count) / count)[:, None])
    return np.concatenate([*points, np.asarray(corners[-1:], float)])


class Section:
    """A cross section: lining from the left foot to the right one, then the floor back."""

    def __init__(self, lining: np.ndarray, floor: Sequence[tuple[float, float]]):
        """``floor`` goes from the right foot (left out) to the left foot (left out)."""
        inner = polygon_lining([tuple(lining[-1]), *floor, tuple(lining[0])])
        self.lining, self.floor = lining, inner
        self.start = np.concatenate([lining[:-1], inner[:-1]])
        self.end = np.concatenate([lining[1:], inner[1:]])
        self.is_floor = np.arange(len(self.start)) >= len(lining) - 1
        step = self.end - self.start
        self.size = np.hypot(step[:, 0], step[:, 1])
        self.u = np.concatenate([[0.0], np.cumsum(self.size[~self.is_floor])])
        self.v = np.concatenate([[0.0], np.cumsum(self.size[self.is_floor])])
        self.offset = np.concatenate([self.u[:-1], self.v[:-1]])
        self.normal = np.stack([step[:, 1], -step[:, 0]], axis=1) / self.size[:, None]
        self.girth, self.floor_width = float(self.u[-1]), float(self.v[-1])
        self.crown = float(self.u[np.argmin(np.abs(lining[:, 0]) - 1e-6 * lining[:, 1])])

    def at(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Points (y, z) of the lining and its normals that look into the tunnel."""
        position = np.stack([np.interp(u, self.u, self.lining[:, 0]), np.interp(u, self.u, self.lining[:, 1])], axis=-1)
        segment = np.clip(np.searchsorted(self.u, u, side="right") - 1, 0, len(self.u) - 2)
        return position, self.normal[segment]

    def u_at(self, side: int, z: float) -> float:
        """Girth where the left (-1) or right (1) wall has a height above the axis."""
        half = self.u <= self.crown if side < 0 else self.u >= self.crown
        order = np.argsort(self.lining[half, 1], kind="stable")
        return float(np.interp(z, self.lining[half, 1][order], self.u[half][order]))

    def u_at_angle(self, degrees: float) -> float:
        """Girth at an angle from the crown, positive to the right, for a round lining."""
        angle = np.degrees(np.arctan2(self.lining[:, 0], self.lining[:, 1]))
        return float(np.interp(degrees, angle, self.u))

    def first_segments(self, origin: tuple[float, float], count: int = 65536) -> np.ndarray:
        """Which segment a ray in the plane of the section meets first, for directions in equal steps from -180 degrees on."""
        best = np.full(count, np.inf)
        owner = np.zeros(count, np.int32)
        first = np.arctan2(self.start[:, 1] - origin[1], self.start[:, 0] - origin[0])
        turn = np.angle(np.exp(1j * (np.arctan2(self.end[:, 1] - origin[1], self.end[:, 0] - origin[0]) - first)))
        step = 2 * np.pi / count
        for j in range(len(self.start)):
            low, high = sorted((first[j], first[j] + turn[j]))
            index = np.arange(int(np.floor((low + np.pi) / step)), int(np.ceil((high + np.pi) / step)) + 1)
            angle = -np.pi + (index + 0.5) * step
            edge = self.end[j] - self.start[j]
            to_start = self.start[j] - np.asarray(origin)
            with np.errstate(divide="ignore", invalid="ignore"):
                bottom = np.cos(angle) * edge[1] - np.sin(angle) * edge[0]
                reach = (to_start[0] * edge[1] - to_start[1] * edge[0]) / bottom
                along = (np.cos(angle) * to_start[1] - np.sin(angle) * to_start[0]) / -bottom
            good = (reach > 0) & (along > -0.02) & (along < 1.02)
            index = index % count
            good &= reach < best[index]
            best[index[good]] = reach[good]
            owner[index[good]] = j
        return owner


@dataclass
class Strand:
    """Something round along the tunnel: a cable, pipe, handrail or rail."""

    y: float
    z: float
    radius: float
    tone_db: float
    start: float = -50.0
    stop: float = 500.0
    sag: float = 0.0
    spacing: float = 1.0

    def centre_z(self, s: np.ndarray) -> np.ndarray:
        """Height of the middle, hanging between supports."""
        if not self.sag:
            return np.full_like(s, self.z)
        phase = (s / self.spacing) % 1.0
        return self.z - self.sag * 4 * phase * (1 - phase)


@dataclass
class Block:
    """A convex prism: a polygon of the section (anticlockwise) between two chainages; as a niche it is hollow."""

    corners: Sequence[tuple[float, float]]
    start: float
    stop: float
    tone_db: float

    def planes(self) -> tuple[np.ndarray, np.ndarray]:
        """Outward normals and offsets of the sides."""
        points = np.asarray(self.corners, float)
        area = np.sum(points[:, 0] * np.roll(points[:, 1], -1) - points[:, 1] * np.roll(points[:, 0], -1))
        if area < 0:
            points = points[::-1]
        step = np.roll(points, -1, axis=0) - points
        normal = np.stack([step[:, 1], -step[:, 0]], axis=1) / np.hypot(step[:, 0], step[:, 1])[:, None]
        return normal, np.sum(normal * points, axis=1)


@dataclass
class Niche:
    """A recess behind an opening of the lining."""

    hollow: Block
    u0: float
    u1: float


@dataclass
class Tunnel:
    """All geometry of a scene."""

    axis: Axis
    section: Section
    length: float
    strands: list[Strand]
    blocks: list[Block]
    niches: list[Niche]
