"""Where a tunnel lies, what its cross-section looks like, and what a scanner sees of it.

Three kinds of coordinates: real ones (east, north, height); those of the straightened tunnel (``s`` chainage, ``y`` to
the right, ``z`` up from the axis); and those of the unrolled lining (``s`` and ``u``, metres along the section from the
crown, positive on the right, negative on the left).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Alignment:
    """An axis that is a straight line or a circle in plan, with an even slope.

    ``heading`` is counted from east against the clock (radians); a positive ``radius`` turns to the left.
    """

    east: float
    north: float
    height: float
    heading: float
    radius: float = np.inf
    slope: float = 0.0

    def world(self, s: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Real coordinates of places in the straightened tunnel, one a row."""
        s = np.asarray(s, dtype=float)
        if np.isinf(self.radius):
            angle = np.full_like(s, self.heading)
            east, north = s * np.cos(self.heading), s * np.sin(self.heading)
        else:
            angle = self.heading + s / self.radius
            east = self.radius * (np.sin(angle) - np.sin(self.heading))
            north = -self.radius * (np.cos(angle) - np.cos(self.heading))
        east = self.east + east + y * np.sin(angle)
        north = self.north + north - y * np.cos(angle)
        return np.stack(np.broadcast_arrays(east, north, self.height + self.slope * s + z), axis=-1)

    def local(self, points: np.ndarray) -> np.ndarray:
        """The reverse of :meth:`world`: ``s, y, z``, one place a row."""
        east, north = points[:, 0] - self.east, points[:, 1] - self.north
        if np.isinf(self.radius):
            s = east * np.cos(self.heading) + north * np.sin(self.heading)
            y = east * np.sin(self.heading) - north * np.cos(self.heading)
        else:
            east = east + self.radius * np.sin(self.heading)
            north = north - self.radius * np.cos(self.heading)
            reach = np.sign(self.radius) * np.hypot(east, north)
            y = reach - self.radius
            turn = np.arctan2(east / reach, -north / reach) - self.heading
            s = np.angle(np.exp(1j * turn)) * self.radius
        return np.stack([s, y, points[:, 2] - self.height - self.slope * s], axis=-1)


def arc(centre: tuple[float, float], radius: float, start: float, end: float) -> np.ndarray:
    """Points of an arc; angles in degrees clockwise from straight up."""
    angle = np.radians(np.linspace(start, end, max(int(abs(end - start) * 2), 2)))
    return np.stack([centre[0] + radius * np.sin(angle), centre[1] + radius * np.cos(angle)], axis=1)


class Profile:
    """A closed cross-section: lining and floor."""

    def __init__(self, right: np.ndarray, left: np.ndarray, foot_right: tuple[float, float], foot_left: tuple[float, float]):
        """Each half goes from the crown to the middle of the floor; feet are where the wall meets the floor (y, z)."""
        self.step = 0.01
        halves = [self._even(np.asarray(half, dtype=float)) for half in (right, left)]
        self.points = np.concatenate([halves[1][:0:-1], halves[0]])
        self.u = (np.arange(len(self.points)) - (len(halves[1]) - 1)) * self.step
        tangent = np.gradient(self.points, axis=0)
        self.tangent = tangent / np.linalg.norm(tangent, axis=1, keepdims=True)
        self.normal = np.stack([self.tangent[:, 1], -self.tangent[:, 0]], axis=1)
        self.foot_right = self.nearest(np.array([foot_right]))[0]
        self.foot_left = self.nearest(np.array([foot_left]))[0]

    def _even(self, half: np.ndarray) -> np.ndarray:
        length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(half, axis=0), axis=1))])
        at = np.arange(0, length[-1] + self.step / 2, self.step)
        return np.stack([np.interp(at, length, half[:, i]) for i in (0, 1)], axis=1)

    @property
    def low(self) -> float:
        """The least ``u``."""
        return float(self.u[0])

    @property
    def high(self) -> float:
        """The greatest ``u``."""
        return float(self.u[-1])

    def nearest(self, places: np.ndarray) -> np.ndarray:
        """``u`` of the vertices nearest to places of the section."""
        return np.array([self.u[np.argmin(np.sum((self.points - p) ** 2, axis=1))] for p in places])

    def at(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Place, direction of growing ``u`` and inward normal (each: y, z in rows)."""
        u = np.asarray(u, dtype=float)
        out = []
        for table in (self.points, self.tangent, self.normal):
            out.append(np.stack([np.interp(u, self.u, table[:, 0]), np.interp(u, self.u, table[:, 1])], axis=-1))
        for i in (1, 2):
            out[i] /= np.maximum(np.linalg.norm(out[i], axis=-1, keepdims=True), 1e-6)
        return out[0], out[1], out[2]

    def is_floor(self, u: np.ndarray) -> np.ndarray:
        """Whether a place is floor rather than lining."""
        return (np.asarray(u) > self.foot_right) | (np.asarray(u) < self.foot_left)

    def height_u(self, z: float, side: int) -> float:
        """``u`` of the lining at a height ``z`` on the right (1) or left (-1), the lowest such place above the foot."""
        foot = self.foot_right if side > 0 else self.foot_left
        on_side = (self.u * side > 0) & (self.u * side <= foot * side)
        return float(self.u[on_side][np.argmin(np.abs(self.points[on_side, 1] - z))])


class SectionView:
    """The section as seen from a place inside: which ``u`` a beam meets first, by its direction in the section."""

    def __init__(self, profile: Profile, y: float, z: float, bins: int = 14400):
        self.profile, self.origin, self.bins = profile, np.array([y, z]), bins
        start = profile.points - self.origin
        end = np.roll(start, -1, axis=0)
        angle = np.arctan2(start[:, 1], start[:, 0])
        turn = np.angle(np.exp(1j * (np.roll(angle, -1) - angle)))
        width = 2 * np.pi / bins
        first = np.ceil((np.minimum(0, turn) + angle) / width - 1e-9).astype(int)
        last = np.floor((np.maximum(0, turn) + angle) / width + 1e-9).astype(int)
        count = np.maximum(last - first + 1, 0)
        which = np.repeat(np.arange(len(start)), count)
        number = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count) + first[which]
        beam = np.stack([np.cos(number * width), np.sin(number * width)], axis=1)
        edge = end[which] - start[which]
        across = beam[:, 0] * edge[:, 1] - beam[:, 1] * edge[:, 0]
        across = np.where(np.abs(across) < 1e-9, 1e-9, across)
        reach = (start[which, 0] * edge[:, 1] - start[which, 1] * edge[:, 0]) / across
        part = np.clip((start[which, 0] * beam[:, 1] - start[which, 1] * beam[:, 0]) / across, 0, 1)
        order = np.argsort(-np.where(reach > 0, reach, 1e9), kind="stable")
        self.table = np.zeros(bins)
        self.table[number[order] % bins] = (profile.u[which] + part * profile.step)[order]

    def look(self, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """``u`` that beams of these directions meet, and how far it is in the section."""
        place = (np.asarray(angle) % (2 * np.pi)) * (self.bins / (2 * np.pi))
        lower = np.floor(place).astype(int)
        part = place - lower
        a, b = self.table[lower % self.bins], self.table[(lower + 1) % self.bins]
        u = np.where(np.abs(b - a) < 0.08, a + part * (b - a), np.where(part < 0.5, a, b))
        y = np.interp(u, self.profile.u, self.profile.points[:, 0]) - self.origin[0]
        z = np.interp(u, self.profile.u, self.profile.points[:, 1]) - self.origin[1]
        return u, np.hypot(y, z)
