"""Variation of the lining's reflectance, dB: material, soot, grime, marks and blotches."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tunneldb.arrays import Float, Int64
from tunneldb.compiled import kernel
from tunneldb.simulate.lining.blotches import Blotch, BlotchTable, add_blotches, blotch_table
from tunneldb.simulate.lining.marks import Mark, mark_table
from tunneldb.simulate.lining.masonry import Masonry, unit_level
from tunneldb.simulate.lining.rings import Rings, ring_level
from tunneldb.simulate.noise_field import normal_field, smooth_field
from tunneldb.simulate.objects.fixtures import Appendage, bin_of, bins
from tunneldb.simulate.parameters import Parameters
from tunneldb.simulate.tunnel.tunnel import Tunnel

# Clouds of formwork on cast lining: standard deviation, dB, and limits of their size, m.
FORMWORK, FORMWORK_SIZE = 0.2, (1.0, 2.0)
# Texture of shotcrete: limits of its standard deviation, dB, and of its correlation length, m.
SHOTCRETE, SHOTCRETE_SIZE = (0.3, 0.5), (0.2, 0.8)
# Texture of other linings, likewise.
TEXTURES = {
    "rough_shotcrete": ((0.3, 1.0), (0.1, 1.0)),
    "stone": ((0.2, 0.8), (0.1, 0.5)),
    "brick": ((0.1, 0.5), (0.2, 1.0)),
    "rock": ((0.5, 1.5), (0.2, 1.5)),
}
# Tiles: limits of their size, m; standard deviation from tile to tile, dB; width, m, and darkening, dB, of the grout.
TILE, TILE_LEVEL, GROUT, GROUT_DROP = (0.15, 0.30), 0.2, 0.005, 1.0
# Soot: width as a share of the lining's half arc (the level falls as a Gauss curve); length of its changes along the
# tunnel, m, and their standard deviation as a share; limits of the amount as a share.
SOOT_WIDTH, SOOT_LENGTH, SOOT_CHANGE, SOOT_RANGE = (0.15, 0.25), 15.0, 0.35, (0.2, 1.6)
# Grime beneath fixtures along the wall: limits of the length of its fading downwards, rise above, length of its
# changes along the tunnel, m, and their standard deviation as a share.
GRIME_FADE, GRIME_RISE, GRIME_LENGTH, GRIME_CHANGE = (0.1, 0.3), 0.04, 3.0, 0.25


class Reflectance(NamedTuple):
    """Reflectance levels of a lining.

    Attributes
    ----------
    rings : Rings
    masonry : Masonry
    salt : int
        Salt of the random fields.
    texture : (2,)
        Standard deviation, dB, and size, m; 0 dB: none.
    tile : float
        Side of the tiles, m; 0: none.
    soot : (3,)
        Darkening dB, arc of the middle, width, m.
    grime : (k, 4)
        Bands: side (+1, -1), distance of the upper edge from the crown along the arc, m, length of fading, m, dB.
    marks, mark_bins, mark_list
        Rows of :func:`mark_table`, by chainage.
    blotches : BlotchTable
    start : float
        Chainage of the tunnel's start, m.
    """

    rings: Rings
    masonry: Masonry
    salt: int
    texture: Float
    tile: float
    soot: Float
    grime: Float
    marks: Float
    mark_bins: Int64
    mark_list: Int64
    blotches: BlotchTable
    start: float


def lining_reflectance(
    parameters: Parameters,
    tunnel: Tunnel,
    rings: Rings,
    masonry: Masonry,
    furniture: Sequence[Appendage],
    marks: list[Mark],
    blotches: list[Blotch],
    seed: np.random.SeedSequence,
) -> Reflectance | None:
    """Return the requested levels; None: the lining is uniform."""
    p, line, half = parameters, tunnel.line, tunnel.section.floor_arc
    if p.lining == "plain" and not (p.soot or p.grime or marks or blotches):
        return None
    make, black, bands = (np.random.default_rng(s) for s in seed.spawn(3))
    texture = {
        "cast": (FORMWORK, float(make.uniform(*FORMWORK_SIZE))),
        "shotcrete": (float(make.uniform(*SHOTCRETE)), float(make.uniform(*SHOTCRETE_SIZE))),
    }.get(p.lining, (0.0, 1.0))
    if p.lining in TEXTURES:
        spread, size = TEXTURES[p.lining]
        texture = float(make.uniform(*spread)), float(make.uniform(*size))
    runs = [a for a in furniture if a.kind in ("cable", "tray", "pipe") and abs(a.arc) > 0.3 * half] if p.grime else []
    grime = [
        (math.copysign(1.0, a.arc), abs(a.arc) + 0.5 * a.width, bands.uniform(*GRIME_FADE), p.grime * bands.uniform(0.5, 1.0))
        for a in runs
    ]
    rows = mark_table(marks)
    return Reflectance(
        rings,
        masonry,
        int(seed.generate_state(1)[0]),
        np.array(texture),
        float(make.uniform(*TILE)) if p.lining == "tiles" else 0.0,
        np.array([p.soot, black.uniform(-0.05, 0.05) * half, black.uniform(*SOOT_WIDTH) * half]),
        np.array(grime).reshape(-1, 4),
        rows,
        *bins(rows[:, 0], rows[:, 1], line.start, line.end),
        blotch_table(blotches, tunnel),
        line.start,
    )


def soot_amount(reflectance: Reflectance, s: Float) -> Float:
    """Return the soot in the middle at chainages (n,), as a share of the requested amount."""
    change = smooth_field(s / SOOT_LENGTH, np.full(s.size, 0.5), reflectance.salt + 2)
    return np.minimum(np.maximum(1.0 + SOOT_CHANGE * change, SOOT_RANGE[0]), SOOT_RANGE[1])


def _grime(reflectance: Reflectance, s: Float, arc: Float) -> Float:
    """Return the grime at positions (n,), dB: the greatest value of all bands."""
    greatest = np.zeros(s.size)
    for i, (side, edge, fade, drop) in enumerate(reflectance.grime.tolist()):
        below = arc * side - edge
        near = np.flatnonzero((below >= -GRIME_RISE) & (below <= 6.0 * fade))
        below = below[near]
        shape = np.where(below > 0.0, np.exp(-np.maximum(below, 0.0) / fade), 1.0 + below / GRIME_RISE)
        change = smooth_field(s[near] / GRIME_LENGTH, np.full(near.size, i + 0.5), reflectance.salt + 3)
        greatest[near] = np.maximum(greatest[near], drop * shape * np.maximum(0.0, 1.0 + GRIME_CHANGE * change))
    return greatest


@kernel
def _mark_level(marks: Float, bins: Int64, listed: Int64, start: float, s: Float, arc: Float, out: Float) -> None:
    """Add the level of the mark at positions (n,), dB. Strokes of a number overlap and are painted once."""
    for i in range(s.shape[0]):
        b = bin_of(s[i], start, bins)
        for j in range(bins[b], bins[b + 1]):
            k = listed[j]
            x, y = s[i] - marks[k, 2], arc[i] - marks[k, 3]
            eu, ew = marks[k, 4], marks[k, 5]
            if abs(x * eu + y * ew) <= marks[k, 6] and abs(y * eu - x * ew) <= marks[k, 7]:
                out[i] += marks[k, 8]
                break


def _tiles(reflectance: Reflectance, s: Float, arc: Float) -> Float:
    """Return the level of tiles and of the grout between them at positions (n,), dB."""
    x, y = s / reflectance.tile, arc / reflectance.tile
    i, j = np.floor(x), np.floor(y)
    level = TILE_LEVEL * normal_field(i.astype(np.int64), j.astype(np.int64), reflectance.salt + 1)
    edge = np.minimum(np.minimum(x - i, i + 1.0 - x), np.minimum(y - j, j + 1.0 - y)) * reflectance.tile
    return level - np.where(edge < 0.5 * GROUT, GROUT_DROP, 0.0)


def level(reflectance: Reflectance, s: Float, arc: Float) -> Float:
    """Return the level of the lining at chainages and arcs (n,), dB added to the reflectance."""
    own = reflectance
    total = ring_level(own.rings, s, arc)
    texture, size = own.texture.tolist()
    if texture > 0.0:
        total += texture * smooth_field(s / size, arc / size, own.salt)
    if own.masonry.length > 0.0:
        total += unit_level(own.masonry, s, arc)
    if own.tile > 0.0:
        total += _tiles(own, s, arc)
    asked, middle, width = own.soot.tolist()
    if asked > 0.0:
        z = (arc - middle) / width
        total -= asked * soot_amount(own, s) * np.exp(-z * z)
    if len(own.grime):
        total -= _grime(own, s, arc)
    if len(own.marks):
        _mark_level(own.marks, own.mark_bins, own.mark_list, own.start, s, arc, total)
    if len(own.blotches.rows):
        add_blotches(own.blotches, own.start, s, arc, total)
    return total
