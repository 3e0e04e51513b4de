"""Objects on the wall along the whole tunnel, trunking and bundles of thin cables, and sheets in front of it."""

from __future__ import annotations

import math

import numpy as np

from tunneldb.errors import UserError
from tunneldb.simulate.objects.fixtures import Appendage
from tunneldb.simulate.objects.wall_clutter import ARC_LIMITS, is_free
from tunneldb.simulate.parameters import Parameters
from tunneldb.simulate.tunnel.tunnel import Tunnel

TRIES = 400
# Trunking: limits of width and depth, m, and of darkening, dB.
TRUNK_WIDTH, TRUNK_DEPTH, TRUNK_DROP = (0.10, 0.60), (0.10, 0.40), (-3.0, 6.0)
# Thin cables on the wall: limits of their number side by side; of their thickness, m (the thinnest vanish in the noise of
# ranges), and of their darkening, dB; share of runs that are flat ducts.
THIN_BUNDLE, THIN, THIN_DROP, FLAT_SHARE = (1, 10), (0.003, 0.025), (2.0, 7.0), 0.5
FLAT_WIDTH = (0.02, 0.15)  # m
# Sheets: limits of length and of height along the wall, of their distance from it, m, of darkening, dB; thickness,
# width of the strips that follow the section, m.
SHEET_LENGTH, SHEET_HEIGHT, SHEET_GAP, SHEET_DROP = (1.0, 8.0), (0.8, 4.0), (0.04, 0.20), (-3.0, 4.0)
SHEET_THICK, STRIP = 0.003, 0.2


def _trunking(start: float, end: float, arc: float, rng: np.random.Generator) -> list[Appendage]:
    """Return a closed box along the tunnel, flush with the wall."""
    low, high = np.array([TRUNK_WIDTH, TRUNK_DEPTH, TRUNK_DROP]).T
    width, depth, drop = rng.uniform(low, high).tolist()
    return [Appendage("trunking", start, end, arc, 0.5 * depth, width, depth, drop)]


def _thin_cables(start: float, end: float, arc: float, rng: np.random.Generator) -> list[Appendage]:
    """Return cables side by side on the wall, or a flat duct."""
    thick = math.exp(rng.uniform(math.log(THIN[0]), math.log(THIN[1])))
    if rng.random() < FLAT_SHARE:
        width, drop = rng.uniform(*np.array([FLAT_WIDTH, THIN_DROP]).T).tolist()
        return [Appendage("duct", start, end, arc, 0.5 * thick, width, thick, drop)]
    count = int(rng.integers(THIN_BUNDLE[0], THIN_BUNDLE[1] + 1))
    drops = rng.uniform(*THIN_DROP, count).tolist()
    return [Appendage("cable", start, end, arc + i * thick, 0.5 * thick, thick, thick, drop) for i, drop in enumerate(drops)]


def _sheet(start: float, end: float, arc: float, rng: np.random.Generator) -> list[Appendage]:
    """Return a sheet in front of the wall, in flat strips along the tunnel."""
    low, high = np.array([SHEET_LENGTH, SHEET_HEIGHT, SHEET_GAP, SHEET_DROP]).T
    length, height, gap, drop = rng.uniform(low, high).tolist()
    s = float(rng.uniform(start, max(start, end - length)))
    count = math.ceil(height / STRIP)
    off, until = gap + 0.5 * SHEET_THICK, min(s + length, end)
    middles = arc + STRIP * (np.arange(count) - 0.5 * (count - 1))
    return [Appendage("sheet", s, until, middle, off, STRIP, SHEET_THICK, drop) for middle in middles.tolist()]


def covers(parameters: Parameters, tunnel: Tunnel, furniture: list[Appendage], seed: np.random.SeedSequence) -> list[Appendage]:
    """Return the requested trunking, thin cables and sheets, away from existing objects.

    Raises
    ------
    UserError
        If there is no space on the walls for all.
    """
    p, line, lowest = parameters, tunnel.line, tunnel.section.floor_arc
    hung = [a for a in furniture if abs(a.arc) < lowest]
    own: list[Appendage] = []
    kinds = (("trunking", p.trunking, _trunking), ("thin cables", p.thin_cables, _thin_cables), ("sheet", p.sheets, _sheet))
    for (name, count, make), stream in zip(kinds, seed.spawn(len(kinds)), strict=True):
        rng = np.random.default_rng(stream)
        for number in range(count):
            for _ in range(TRIES):
                arc = math.copysign(float(rng.uniform(*ARC_LIMITS)) * lowest, float(rng.uniform(-1.0, 1.0)))
                made = make(line.start, line.end, arc, rng)
                inside = all(abs(a.arc) + 0.5 * a.width < lowest for a in made)
                if inside and is_free(made, hung + own):
                    break
            else:
                raise UserError(f"no room on the walls for {name} {number + 1} of {count}; use fewer objects on the walls")
            own += made
    return own
