"""Things in a tunnel that a beam meets before the lining: cables, pipes, rails, boxes, and niches that it passes into.

All is in the straightened tunnel. Beams start at ``(s0, y0, z0)`` and have a direction of unit length in the section and
the slope ``k`` along the tunnel, so that a beam that went ``r`` in the section is at ``s0 + k r``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .geometry import Profile


@dataclass(frozen=True)
class Beams:
    """Many beams of one place of the section."""

    s0: np.ndarray
    y0: float
    z0: float
    angle: np.ndarray
    k: np.ndarray

    def pick(self, which: np.ndarray) -> Beams:
        """Some of them."""
        return Beams(self.s0[which], self.y0, self.z0, self.angle[which], self.k[which])

    def near(self, ys: np.ndarray, zs: np.ndarray, pad: float = 0.01) -> np.ndarray:
        """Numbers of the beams that go between the outermost of some places of the section."""
        angles = np.arctan2(zs - self.z0, ys - self.y0)
        middle = np.angle(np.mean(np.exp(1j * angles)))
        half = np.abs(np.angle(np.exp(1j * (angles - middle)))).max() + pad
        return np.flatnonzero(np.abs((self.angle - middle + np.pi) % (2 * np.pi) - np.pi) < half)


@dataclass(frozen=True)
class Meeting:
    """Beams that meet a fixture: which, how far, how squarely (cosine), and whether only the rim of the footprint does."""

    which: np.ndarray
    reach: np.ndarray
    square: np.ndarray
    rim: np.ndarray


@dataclass(frozen=True)
class Bar:
    """A cable or a pipe along the tunnel, that sags between brackets."""

    y: float
    z: float
    radius: float
    tone: float
    s1: float = -np.inf
    s2: float = np.inf
    sag: float = 0.0
    span: float = 1.0
    phase: float = 0.0

    def meet(self, beams: Beams, rim: float) -> Meeting:
        """Beams that meet it."""
        spread = self.radius + rim + self.sag
        which = beams.near(self.y + spread * np.array([-1, 1, 1, -1]), self.z + spread * np.array([-1, -1, 1, 1]))
        b = beams.pick(which)
        cy, cz = np.cos(b.angle), np.sin(b.angle)
        dy, dz = self.y - beams.y0, self.z - beams.z0
        reach = dy * cy + dz * cz
        for _ in range(2):
            part = ((b.s0 + b.k * reach - self.phase) / self.span) % 1.0
            sag = -4 * self.sag * part * (1 - part)
            along = dy * cy + (dz + sag) * cz
            across = (dz + sag) * cy - dy * cz
            reach = along - np.sqrt(np.maximum(self.radius**2 - across**2, 0))
        s = b.s0 + b.k * reach
        hit = (np.abs(across) < self.radius + rim) & (s > self.s1) & (s < self.s2) & (reach > 0.05)
        square = np.sqrt(np.maximum(1 - (across / self.radius) ** 2, 0.01)) / np.sqrt(1 + b.k**2)
        return Meeting(which[hit], reach[hit], square[hit], np.abs(across[hit]) > self.radius)


def _slab(origin: np.ndarray, direction: np.ndarray, half: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where beams enter and leave a box about the origin, and through which pair of its faces they enter."""
    direction = np.where(np.abs(direction) < 1e-9, 1e-9, direction)
    a, b = (-half - origin) / direction, (half - origin) / direction
    enter, leave = np.minimum(a, b), np.maximum(a, b)
    return enter.max(axis=1), leave.min(axis=1), enter.argmax(axis=1)


@dataclass(frozen=True)
class Block:
    """A box: place in the section and along the tunnel, size along the tunnel, along ``v`` and across it; ``turn`` tilts ``v``.

    ``v`` is the direction (cos turn, sin turn) in the section (y, z).
    """

    s: float
    y: float
    z: float
    length: float
    width: float
    depth: float
    tone: float
    turn: float = 0.0

    def meet(self, beams: Beams, rim: float) -> Meeting:
        """Beams that meet it."""
        v = np.array([np.cos(self.turn), np.sin(self.turn)])
        n = np.array([-v[1], v[0]])
        half = np.array([self.length, self.width, self.depth]) / 2
        corner = np.array([[a * (half[1] + rim), b * (half[2] + rim)] for a in (-1, 1) for b in (-1, 1)])
        which = beams.near(
            self.y + corner[:, 0] * v[0] + corner[:, 1] * n[0], self.z + corner[:, 0] * v[1] + corner[:, 1] * n[1]
        )
        away = np.hypot(self.y - beams.y0, self.z - beams.z0)
        s = beams.s0[which] + beams.k[which] * away
        slack = half[0] + rim + np.abs(beams.k[which]) * (half[1] + half[2]) + 0.02
        which = which[np.abs(s - self.s) < slack]
        b = beams.pick(which)
        d = np.stack([np.cos(b.angle), np.sin(b.angle)], axis=1)
        o = np.array([beams.y0 - self.y, beams.z0 - self.z])
        origin = np.stack([b.s0 - self.s, np.full(len(which), o @ v), np.full(len(which), o @ n)], axis=1)
        direction = np.stack([b.k, d @ v, d @ n], axis=1)
        enter, leave, _ = _slab(origin, direction, half + rim)
        hit = (enter < leave) & (enter > 0.05)
        enter2, leave2, face = _slab(origin, direction, half)
        inner = enter2 < leave2
        reach = np.where(inner, enter2, enter)
        square = np.abs(np.take_along_axis(direction, face[:, None], axis=1)[:, 0]) / np.sqrt(1 + b.k**2)
        return Meeting(which[hit], reach[hit], np.clip(square[hit], 0.05, 1), ~inner[hit])


@dataclass(frozen=True)
class Niche:
    """A recess in a wall: chainages, and the place of its opening (``u``), ``depth`` behind the lining; ``tone`` within."""

    s1: float
    s2: float
    u1: float
    u2: float
    depth: float
    tone: float


def on_lining(
    profile: Profile, s: float, u: float, length: float, width: float, depth: float, tone: float, gap: float = 0.0
) -> Block:
    """A box that is fixed to the lining, ``gap`` before it."""
    place, tangent, normal = profile.at(np.array([u]))
    y, z = place[0] + normal[0] * (gap + depth / 2)
    return Block(s, y, z, length, width, depth, tone, float(np.arctan2(tangent[0, 1], tangent[0, 0])))


def along_lining(profile: Profile, u: float, gap: float, radius: float, tone: float, **more: float) -> Bar:
    """A cable or a pipe along the lining; ``gap`` is from the lining to its middle."""
    place, _, normal = profile.at(np.array([u]))
    y, z = place[0] + normal[0] * gap
    return Bar(float(y), float(z), radius, tone, **more)


Fixture = Bar | Block
