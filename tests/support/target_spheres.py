"""Things of known shape in front of a scanner, and the points that it measures on them: truth for the target spheres."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Ball:
    """An ellipsoid, a sphere by default: centre and radius; ``stretch`` scales its axes."""

    centre: Sequence[float]
    radius: float
    stretch: Sequence[float] = (1.0, 1.0, 1.0)

    def hit(self, origin: Array, direction: Array) -> Array:
        scale = self.radius * np.array(self.stretch)
        o, d = (origin - np.array(self.centre)) / scale, direction / scale
        a, b, c = (d * d).sum(1), (o * d).sum(1), (o * o).sum(1) - 1.0
        root = b * b - a * c
        with np.errstate(invalid="ignore"):
            t = (-b - np.sqrt(root)) / a
        return np.where((root > 0) & (t > 0), t, np.inf)


@dataclass(frozen=True)
class Wall:
    """A plane through a point."""

    point: Sequence[float]
    normal: Sequence[float]

    def hit(self, origin: Array, direction: Array) -> Array:
        normal = np.array(self.normal, float)
        with np.errstate(divide="ignore", invalid="ignore"):
            t = ((np.array(self.point) - origin) @ normal) / (direction @ normal)
        return np.where(t > 0, t, np.inf)


@dataclass(frozen=True)
class Rod:
    """A cylinder between the centres of its two faces."""

    foot: Sequence[float]
    top: Sequence[float]
    radius: float

    def hit(self, origin: Array, direction: Array) -> Array:
        foot, axis = np.array(self.foot), np.array(self.top) - np.array(self.foot)
        length = np.linalg.norm(axis)
        axis = axis / length
        o = origin - foot
        along_o, along_d = o @ axis, direction @ axis
        across_o, across_d = o - np.outer(along_o, axis), direction - np.outer(along_d, axis)
        a, b = (across_d**2).sum(1), (across_o * across_d).sum(1)
        root = b * b - a * ((across_o**2).sum(1) - self.radius**2)
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (-b - np.sqrt(root)) / a
            h = along_o + t * along_d
            best = np.where((root > 0) & (t > 0) & (h >= 0) & (h <= length), t, np.inf)
            for end in (0.0, length):
                t = (end - along_o) / along_d
                inside = ((across_o + t[:, None] * across_d) ** 2).sum(1) <= self.radius**2
                best = np.where((t > 0) & inside & (t < best), t, best)
        return best


Thing = Ball | Wall | Rod


def scan(
    things: Sequence[Thing],
    station: Sequence[float],
    step: float,
    seed: int,
    noise: float = 0.003,
    beam: float = 0.004,
    towards: Sequence[float] | None = None,
    opening: float = 0.2,
) -> tuple[Array, NDArray[np.int64]]:
    """Points (n, 3) that a scanner at a station measures, and the number of the thing that each lies on.

    Parameters
    ----------
    things
        What stands there.
    station
        Where the scanner stands, m.
    step
        Between two rays, radians.
    seed
        Of the noise and of where the first ray points.
    noise
        Standard deviation of a range, m.
    beam
        Diameter of the beam, m: a ray on an edge measures a range between those of both sides (a mixed pixel).
    towards, opening
        Only rays within this angle (radians) of the direction to this place; all things' first centre by default.
    """
    rng = np.random.default_rng(seed)
    observer = np.array(station, float)
    aim = np.array(things[0].centre if towards is None else towards) - observer  # type: ignore[union-attr]
    aim = aim / np.linalg.norm(aim)
    side = np.cross(aim, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side)
    up = np.cross(side, aim)
    count = int(np.ceil(opening / step))
    u, v = np.meshgrid(np.arange(-count, count + 1) * step, np.arange(-count, count + 1) * step)
    u, v = u.ravel() + rng.uniform(0, step), v.ravel() + rng.uniform(0, step)
    direction = aim + np.outer(np.tan(u), side) + np.outer(np.tan(v), up)
    direction /= np.linalg.norm(direction, axis=1)[:, None]

    total, weight, number = np.zeros(len(u)), np.zeros(len(u)), np.full(len(u), -1)
    for k in range(7):  # the middle of the beam and six places of it
        shift = 0.0 if k == 0 else beam / 3.0
        origin = observer + shift * (np.cos(k * np.pi / 3) * side + np.sin(k * np.pi / 3) * up)
        ranges = np.array([thing.hit(np.broadcast_to(origin, direction.shape), direction) for thing in things])
        nearest = ranges.argmin(0)
        hit = np.isfinite(ranges.min(0))
        total[hit] += ranges.min(0)[hit]
        weight[hit] += 1
        if k == 0:
            number[hit] = nearest[hit]
    seen = number >= 0
    mean = total[seen] / weight[seen] + rng.standard_normal(int(seen.sum())) * noise
    return observer + mean[:, None] * direction[seen], number[seen]
