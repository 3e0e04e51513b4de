"""Leaks at typical places: across cables, at the foot, along the springline, at bolts, over a ring or a panel."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from shapely import affinity
from shapely.geometry import LineString, Polygon, box

from tunneldb.errors import UserError
from tunneldb.simulate.floor_profile import rise
from tunneldb.simulate.lining.leaks import FreeArea, Leak, star, wet_patch
from tunneldb.simulate.lining.rings import POCKET, POCKET_FROM_JOINT, POCKETS, Rings
from tunneldb.simulate.lining.seepage import band_of
from tunneldb.simulate.objects.fixtures import Appendage
from tunneldb.simulate.parameters import Parameters
from tunneldb.simulate.tunnel.tunnel import Tunnel

TRIES = 600
# Extent of a leak across a cable on either side, m, and its least area, m².
CROSSING_MARGIN, CROSSING_AREA = 0.1, 0.1
# At the foot: limits of the length along the floor and the height up the wall, m.
FOOT_LENGTH, FOOT_HEIGHT = (0.5, 4.0), (0.1, 0.8)
# Wet joint along the springline: limits of length and width, m.
SPRING_LENGTH, SPRING_WIDTH = (5.0, 8.0), (0.1, 0.2)
# Below a weeping pocket: limits of the streak's length and width, m; limits of the wet margin around the pocket, m.
STREAK_LENGTH, STREAK_WIDTH, POCKET_MARGIN = (0.1, 1.2), (0.04, 0.12), (0.01, 0.06)
# Wet ring where the lining has no rings of segments: limits of its width, m. Panel where it has none: of its sides, m.
RING_WIDTH, PANEL = (0.2, 1.5), (0.8, 2.5)
SEAM = 0.01  # between a wet segment and its joints, m

# Function that returns an outline, or None if the attempt fails.
Make = Callable[[np.random.Generator], Polygon | None]


class _Sites:
    """Generator of outlines of leaks of each kind, at random places of a tunnel."""

    def __init__(self, parameters: Parameters, tunnel: Tunnel, rings: Rings, appendages: Sequence[Appendage]) -> None:
        self.p, self.tunnel, self.rings = parameters, tunnel, rings
        self.start, self.end = tunnel.line.start, tunnel.line.end
        self.lowest = tunnel.section.floor_arc
        self.runs = [a for a in appendages if a.is_run and abs(a.arc) < self.lowest]
        self.left, self.right = (self._foot(side) for side in (-1.0, 1.0))

    def _foot(self, side: float) -> float:
        """Return the arc at which the wall meets the floor, or the walkway on it, m."""
        section = self.tunnel.section
        arcs = np.linspace(0.0, section.floor_arc, 4001)
        height = section.point(arcs)[0][:, 1] - section.floor
        on_floor = float(rise(self.p, section, np.array([side * section.half_width]))[0])
        return side * float(arcs[np.flatnonzero(height >= on_floor)[-1]])

    def cable(self, rng: np.random.Generator) -> Polygon | None:
        run = self.runs[int(rng.integers(len(self.runs)))]
        low, high = (math.log(max(a, CROSSING_AREA)) for a in self.p.leak_area)
        patch = wet_patch(rng, math.exp(rng.uniform(low, high)), 1 if run.arc >= 0.0 else -1, False)
        patch = affinity.translate(patch, rng.uniform(self.start, self.end), run.arc + rng.uniform(-0.3, 0.3))
        half = 0.5 * run.width + CROSSING_MARGIN
        crosses = patch.bounds[1] < run.arc - half and patch.bounds[3] > run.arc + half
        return patch if crosses else None

    def foot(self, rng: np.random.Generator) -> Polygon | None:
        arc = self.left if rng.random() < 0.5 else self.right
        length, height = rng.uniform((FOOT_LENGTH[0], FOOT_HEIGHT[0]), (FOOT_LENGTH[1], FOOT_HEIGHT[1])).tolist()
        blob = affinity.scale(star(rng, 1.0), 0.5 * length, height)
        s = float(rng.uniform(self.start, self.end))
        above = box(self.start, min(arc, 0.0), self.end, max(arc, 0.0))
        wet = affinity.translate(blob, s, arc).intersection(above)
        return wet if isinstance(wet, Polygon) and wet.area > 0.02 else None

    def springline(self, rng: np.random.Generator) -> Polygon | None:
        points = self.tunnel.section.point(arcs := np.linspace(0.0, self.lowest, 2001))[0]
        arc = float(arcs[np.argmax(np.round(points[:, 0], 6))]) * (1.0 if rng.random() < 0.5 else -1.0)
        band = band_of(float(rng.uniform(*SPRING_LENGTH)), float(rng.uniform(*SPRING_WIDTH)), rng)
        return affinity.translate(band, rng.uniform(self.start, self.end), arc)

    def _segment(self, rng: np.random.Generator) -> tuple[int, int, float]:
        """Return a ring, a segment of it, and the arc of its start."""
        rings = self.rings
        i, m = int(rng.integers(rings.level.size)), rings.seam_width.shape[1]
        k, half = int(rng.integers(m)), 0.5 * m * rings.period
        return i, k, (rings.shift[i] + k * rings.period + half) % (2.0 * half) - half

    def pocket(self, rng: np.random.Generator) -> Polygon | None:
        i, _, seam = self._segment(rng)
        s = self.rings.first + i * self.rings.length + POCKET_FROM_JOINT
        arc = seam + POCKETS[int(rng.integers(len(POCKETS)))] * self.rings.period
        around = float(rng.uniform(*POCKET_MARGIN))
        wet = box(s - 0.5 * POCKET[0], arc - 0.5 * POCKET[1], s + 0.5 * POCKET[0], arc + 0.5 * POCKET[1]).buffer(around)
        length, width = rng.uniform((STREAK_LENGTH[0], STREAK_WIDTH[0]), (STREAK_LENGTH[1], STREAK_WIDTH[1])).tolist()
        bottom = arc + math.copysign(0.5 * POCKET[1] + length, arc)
        x = s + float(rng.uniform(-0.05, 0.05))
        streak = wet.union(LineString([(x, arc), (x, bottom)]).buffer(0.5 * width))
        return streak if isinstance(streak, Polygon) else None

    def ring(self, rng: np.random.Generator) -> Polygon | None:
        if self.p.lining == "segments":
            begin = self.rings.first + int(rng.integers(self.rings.level.size)) * self.rings.length
            return box(begin + SEAM, self.left, begin + self.rings.length - SEAM, self.right)
        s, width = float(rng.uniform(self.start, self.end)), float(rng.uniform(*RING_WIDTH))
        if self.rings.length:
            s = self.rings.first + round((s - self.rings.first) / self.rings.length) * self.rings.length
        arc = np.linspace(self.left, self.right, 120)
        sides = []
        for side in (-1.0, 1.0):
            waves = sum(rng.uniform(0.0, 0.06) * np.sin(k * arc / 2.0 + rng.uniform(0.0, 2.0 * math.pi)) for k in range(1, 7))
            sides.append(np.column_stack([s + side * 0.5 * width * (1.0 + waves), arc]))
        return Polygon(np.vstack([sides[0], sides[1][::-1]]))

    def panel(self, rng: np.random.Generator) -> Polygon | None:
        if self.p.lining == "segments":
            i, _, seam = self._segment(rng)
            begin = self.rings.first + i * self.rings.length
            return box(begin + SEAM, seam + SEAM, begin + self.rings.length - SEAM, seam + self.rings.period - SEAM)
        length, width = rng.uniform(*PANEL, 2).tolist()
        s, arc = float(rng.uniform(self.start, self.end)), float(rng.uniform(self.left, self.right))
        return box(s - 0.5 * length, arc - 0.5 * width, s + 0.5 * length, arc + 0.5 * width)


def site_leaks(
    parameters: Parameters,
    tunnel: Tunnel,
    rings: Rings,
    appendages: Sequence[Appendage],
    free_area: FreeArea,
    seed: np.random.SeedSequence,
) -> list[Leak]:
    """Return leaks at particular places, the largest kinds first, numbered from 1; all may be behind fixtures along the wall.

    Raises
    ------
    UserError
        If there is no space for all, or no cable to cross.
    """
    p, sites = parameters, _Sites(parameters, tunnel, rings, appendages)
    if p.cable_leaks and not sites.runs:
        raise UserError("cable leaks need cables along the wall; omit --no-appendages, or add --clutter")
    kinds: list[tuple[str, int, Make]] = [
        ("ring", p.ring_leaks, sites.ring),
        ("panel", p.panel_leaks, sites.panel),
        ("springline", p.springline_leaks, sites.springline),
        ("cable", p.cable_leaks, sites.cable),
        ("foot", p.foot_leaks, sites.foot),
        ("pocket", p.pocket_leaks, sites.pocket),
    ]
    leaks: list[Leak] = []
    for (kind, count, make), stream in zip(kinds, seed.spawn(len(kinds)), strict=True):
        rng = np.random.default_rng(stream)
        for number in range(count):
            for _ in range(TRIES):
                outline = make(rng)
                if outline is not None and free_area.fits(outline, across=True):
                    break
            else:
                raise UserError(f"no room for {kind} leak {number + 1} of {count}; use fewer leaks or a longer tunnel")
            free_area.reserve(outline)
            inside = outline.representative_point()
            factor = float(tunnel.area_factor(np.array([inside.x]), np.array([inside.y]))[0])
            leaks.append(Leak(len(leaks) + 1, outline, outline.area * factor, float(rng.uniform(*p.leak_drop)), kind))
    return leaks
