"""How bright the lining is from place to place: its make, soot, grime and marks, in dB added to the reflectance."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit

from tunneldb.arrays import Float, Int64
from tunneldb.simulate.lining.marks import Mark, mark_table
from tunneldb.simulate.lining.rings import Rings, ring_level
from tunneldb.simulate.noise_field import clouds, normal
from tunneldb.simulate.objects.fixtures import Appendage, bin_of, bins
from tunneldb.simulate.parameters import Parameters
from tunneldb.simulate.tunnel.tunnel import Tunnel

# Clouds of formwork on cast lining: standard deviation, dB, and limits of their size, m.
FORMWORK, FORMWORK_SIZE = 0.2, (1.0, 2.0)
# Texture of shotcrete: limits of its standard deviation, dB, and of its correlation length, m.
SHOTCRETE, SHOTCRETE_SIZE = (0.3, 0.5), (0.2, 0.8)
# Tiles: limits of their size, m; standard deviation from tile to tile, dB; width, m, and drop, dB, of the grout.
TILE, TILE_LEVEL, GROUT, GROUT_DROP = (0.15, 0.30), 0.2, 0.005, 1.0
# Soot: width as a share of the lining's half arc (the level falls as a Gauss curve); length of its changes along the
# tunnel, m, and their standard deviation as a share; limits of the amount as a share.
SOOT_WIDTH, SOOT_LENGTH, SOOT_CHANGE, SOOT_RANGE = (0.15, 0.25), 15.0, 0.35, (0.2, 1.6)
# Grime beneath what runs along the wall: limits of the length over which it fades downwards, rise above, length of its
# changes along the tunnel, m, and their standard deviation as a share.
GRIME_FADE, GRIME_RISE, GRIME_LENGTH, GRIME_CHANGE = (0.1, 0.3), 0.04, 3.0, 0.25


class Reflectance(NamedTuple):
    """Levels of a lining for the kernels.

    Attributes
    ----------
    rings : Rings
    salt : int
        Of the fields.
    texture : (2,)
        Standard deviation, dB, and size, m; 0 dB: none.
    tile : float
        Side of the tiles, m; 0: none.
    soot : (3,)
        dB, arc of the middle, width, m.
    grime : (k, 4)
        Bands: side (+1, -1), distance of the upper edge from the crown along the arc, m, length of fading, m, dB.
    marks, mark_bins, mark_list
        Rows of :func:`mark_table`, by chainage.
    start : float
        Chainage of the tunnel's start, m.
    """

    rings: Rings
    salt: int
    texture: Float
    tile: float
    soot: Float
    grime: Float
    marks: Float
    mark_bins: Int64
    mark_list: Int64
    start: float


def coat(
    parameters: Parameters,
    tunnel: Tunnel,
    rings: Rings,
    furniture: Sequence[Appendage],
    marks: list[Mark],
    seed: np.random.SeedSequence,
) -> Reflectance | None:
    """Levels as asked; None: the lining is plain."""
    p, line, half = parameters, tunnel.line, tunnel.section.floor_arc
    if p.lining == "plain" and not (p.soot or p.grime or marks):
        return None
    make, black, bands = (np.random.default_rng(s) for s in seed.spawn(3))
    texture = {
        "cast": (FORMWORK, float(make.uniform(*FORMWORK_SIZE))),
        "shotcrete": (float(make.uniform(*SHOTCRETE)), float(make.uniform(*SHOTCRETE_SIZE))),
    }.get(p.lining, (0.0, 1.0))
    runs = [a for a in furniture if a.kind in ("cable", "tray", "pipe") and abs(a.arc) > 0.3 * half] if p.grime else []
    grime = [
        (math.copysign(1.0, a.arc), abs(a.arc) + 0.5 * a.width, bands.uniform(*GRIME_FADE), p.grime * bands.uniform(0.5, 1.0))
        for a in runs
    ]
    rows = mark_table(marks)
    return Reflectance(
        rings,
        int(seed.generate_state(1)[0]),
        np.array(texture),
        float(make.uniform(*TILE)) if p.lining == "tiles" else 0.0,
        np.array([p.soot, black.uniform(-0.05, 0.05) * half, black.uniform(*SOOT_WIDTH) * half]),
        np.array(grime).reshape(-1, 4),
        rows,
        *bins(rows[:, 0], rows[:, 1], line.start, line.end),
        line.start,
    )


@njit(cache=True, nogil=True)
def soot_amount(coat: Reflectance, s: float) -> float:
    """Soot in the middle at a chainage, as a share of what was asked."""
    return min(max(1.0 + SOOT_CHANGE * clouds(s / SOOT_LENGTH, 0.5, coat.salt + 2), SOOT_RANGE[0]), SOOT_RANGE[1])


@njit(cache=True, nogil=True)
def _grime(coat: Reflectance, s: float, arc: float) -> float:
    """Grime at a place, dB: the most that any band gives."""
    most = 0.0
    for i in range(coat.grime.shape[0]):
        below = arc * coat.grime[i, 0] - coat.grime[i, 1]
        fade = coat.grime[i, 2]
        if below < -GRIME_RISE or below > 6.0 * fade:
            continue
        shape = math.exp(-below / fade) if below > 0.0 else 1.0 + below / GRIME_RISE
        change = max(0.0, 1.0 + GRIME_CHANGE * clouds(s / GRIME_LENGTH, i + 0.5, coat.salt + 3))
        most = max(most, coat.grime[i, 3] * shape * change)
    return most


@njit(cache=True, nogil=True)
def _mark_level(coat: Reflectance, s: float, arc: float) -> float:
    """Level of the mark at a place, dB; 0: there is none. Strokes of a number overlap and are painted once."""
    b = bin_of(s, coat.start, coat.mark_bins)
    for j in range(coat.mark_bins[b], coat.mark_bins[b + 1]):
        row = coat.marks[coat.mark_list[j]]
        x, y = s - row[2], arc - row[3]
        if abs(x * row[4] + y * row[5]) <= row[6] and abs(y * row[4] - x * row[5]) <= row[7]:
            return row[8]
    return 0.0


@njit(cache=True, nogil=True)
def level(coat: Reflectance, s: float, arc: float) -> float:
    """Level of the lining at a chainage and an arc, dB added to the reflectance."""
    total = ring_level(coat.rings, s, arc)
    if coat.texture[0] > 0.0:
        total += coat.texture[0] * clouds(s / coat.texture[1], arc / coat.texture[1], coat.salt)
    if coat.tile > 0.0:
        x, y = s / coat.tile, arc / coat.tile
        i, j = math.floor(x), math.floor(y)
        total += TILE_LEVEL * normal(i, j, coat.salt + 1)
        edge = min(min(x - i, i + 1.0 - x), min(y - j, j + 1.0 - y)) * coat.tile
        if edge < 0.5 * GROUT:
            total -= GROUT_DROP
    if coat.soot[0] > 0.0:
        z = (arc - coat.soot[1]) / coat.soot[2]
        total -= coat.soot[0] * soot_amount(coat, s) * math.exp(-z * z)
    if coat.grime.shape[0] > 0:
        total -= _grime(coat, s, arc)
    if coat.marks.shape[0] > 0:
        total += _mark_level(coat, s, arc)
    return total
