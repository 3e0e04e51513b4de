"""Fixtures as inspectors meet them: cables on brackets, pipes, rails, walkways, lamps, signs, boxes, niches."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from .tunnel import Block, Niche, Section, Strand


class Furniture:
    """Collects the fixtures of a tunnel."""

    def __init__(self, section: Section, length: float, rng: np.random.Generator):
        """Fixtures stand on ``section``, over ``length`` metres."""
        self.section, self.length, self.rng = section, length, rng
        self.strands: list[Strand] = []
        self.blocks: list[Block] = []
        self.niches: list[Niche] = []

    def off_wall(self, u: float, depth: float) -> tuple[float, float]:
        """A place (y, z) at a distance from the lining."""
        position, normal = self.section.at(np.array([u]))
        return tuple((position[0] + depth * normal[0]).tolist())

    def on_wall(self, u0: float, u1: float, depth0: float, depth1: float, start: float, stop: float, tone_db: float) -> None:
        """A flat thing before the lining, between two girths and two distances from it."""
        corners = [self.off_wall(u0, depth0), self.off_wall(u1, depth0), self.off_wall(u1, depth1), self.off_wall(u0, depth1)]
        self.blocks.append(Block(corners, start, stop, tone_db))

    def plate(self, y0: float, y1: float, z0: float, z1: float, start: float, stop: float, tone_db: float) -> None:
        """A box that stands square in the section."""
        self.blocks.append(Block([(y0, z0), (y1, z0), (y1, z1), (y0, z1)], start, stop, tone_db))

    def cable(
        self,
        u: float,
        depth: float,
        radius: float,
        tone_db: float,
        sag: float = 0.0,
        spacing: float = 1.0,
        start: float = -20.0,
        stop: float = 200.0,
    ) -> None:
        """A cable or pipe along the wall."""
        y, z = self.off_wall(u, depth)
        self.strands.append(Strand(y, z, radius, tone_db, start, stop, sag, spacing))

    def cables_on_brackets(
        self,
        us: Sequence[float],
        depth: float,
        radius: float,
        spacing: float,
        tone_db: float = -7.0,
        sag: float = 0.02,
        first: float = 0.4,
    ) -> None:
        """A rack: cables at several girths, and brackets at even distances."""
        for u in us:
            own = radius * float(self.rng.uniform(0.7, 1.15))
            self.cable(u, depth + float(self.rng.normal(0, 0.006)), own, tone_db + float(self.rng.normal(0, 0.8)), sag, spacing)
        low, high = min(us) - 0.06, max(us) + 0.06
        s = first
        while s < self.length:
            self.on_wall(low, high, 0.0, depth - radius, s - 0.02, s + 0.02, -1.5)
            for u in us:
                self.on_wall(
                    u - radius - 0.02, u + radius + 0.02, depth - radius - 0.012, depth - radius, s - 0.02, s + 0.02, -1.0
                )
            s += spacing

    def rail_track(
        self, y: float, top_z: float, gauge: float = 1.5, sleeper: float = 0.6, sleeper_z: float | None = None
    ) -> None:
        """Two rails, and perhaps sleepers or plates."""
        for side in (-1, 1):
            middle = y + side * gauge / 2
            self.plate(middle - 0.036, middle + 0.036, top_z - 0.05, top_z, -20, 200, 2.0)
            self.plate(middle - 0.012, middle + 0.012, top_z - 0.15, top_z - 0.05, -20, 200, -4.0)
        if sleeper_z is not None:
            s = 0.3
            while s < self.length:
                self.plate(y - 1.25, y + 1.25, sleeper_z - 0.1, sleeper_z, s - 0.13, s + 0.13, -1.5)
                s += sleeper

    def handrail(
        self, y: float, floor_z: float, height: float, spacing: float, tone_db: float = 1.0, start: float = 0.0
    ) -> None:
        """A rail on posts."""
        self.strands.append(Strand(y, floor_z + height, 0.021, tone_db))
        s = start + 0.5
        while s < self.length:
            self.plate(y - 0.02, y + 0.02, floor_z, floor_z + height, s - 0.02, s + 0.02, tone_db)
            s += spacing

    def conduit(self, u0: float, u1: float, s: float, radius: float, tone_db: float, depth: float = 0.015) -> None:
        """A pipe round the section at one chainage, in short straight pieces."""
        knots = np.linspace(min(u0, u1), max(u0, u1), max(int(abs(u1 - u0) / 0.25), 1) + 1)
        for a, b in itertools.pairwise(knots):
            self.on_wall(float(a), float(b), depth, depth + 2 * radius, s - radius, s + radius, tone_db)

    def lamps(
        self, u: float, depth: float, spacing: float, size: float, width: float, tone_db: float = 3.0, first: float = 2.0
    ) -> None:
        """Lamps in a row."""
        s = first
        while s + size < self.length:
            self.on_wall(u - width / 2, u + width / 2, depth, depth + 0.1, s, s + size, tone_db)
            s += spacing

    def niche(self, side: int, s0: float, s1: float, z0: float, z1: float, depth: float) -> None:
        """A refuge or cabinet niche in a wall."""
        u0, u1 = sorted((self.section.u_at(side, z0), self.section.u_at(side, z1)))
        wall = [float(self.off_wall(u, 0.0)[0]) for u in (u0, u1)]
        inner, outer = min(map(abs, wall)) - 0.6, max(map(abs, wall)) + depth
        hollow = Block([(side * inner, z0), (side * outer, z0), (side * outer, z1), (side * inner, z1)], s0, s1, -2.0)
        self.niches.append(Niche(hollow, u0, u1))
