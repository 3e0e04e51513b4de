"""Leaks at special places: along joints, on the back walls of niches, and drips separate from a leak."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from shapely import affinity
from shapely.geometry import LineString, MultiPolygon, Polygon
from shapely.ops import unary_union

from tunneldb.errors import UserError
from tunneldb.simulate.lining.leaks import FreeArea, Leak, star
from tunneldb.simulate.lining.rings import Rings
from tunneldb.simulate.objects.fixtures import Niche, niche_table
from tunneldb.simulate.parameters import Parameters
from tunneldb.simulate.tunnel.tunnel import Tunnel

TRIES = 600
# Wet bands along joints: limits of width and length, m.
BAND_WIDTH, BAND_LENGTH = (0.1, 0.4), (0.5, 3.0)
# Share of the joint leaks of segments along joints between rings (the rest: between segments).
ALONG_RINGS = 0.7
# Leaks in niches: limits of area, m², and distance to the edges of the back wall, m.
NICHE_AREA, NICHE_MARGIN = (0.05, 0.8), 0.1
# Drips: least area of leaks with drips (m²), and their probability; limits of their length and width, m.
MIN_DRIP_AREA, DRIP_SHARE = 0.1, 0.7
DRIP_LENGTH, DRIP_WIDTH = (0.03, 0.30), (0.02, 0.06)


def band_of(length: float, width: float, rng: np.random.Generator) -> Polygon:
    """Return a band around the x axis, of uneven width, narrower at its ends."""
    x = np.linspace(-1.0, 1.0, 25)
    sides = []
    for side in (1.0, -1.0):
        wave = sum(rng.uniform(0.0, 0.12) * np.sin(k * np.pi * x + rng.uniform(0.0, 2.0 * np.pi)) for k in range(1, 6))
        half = 0.5 * width * np.clip(0.8 + wave, 0.4, 1.0) * np.sqrt(1.0 - 0.95 * x**4)
        sides.append(np.column_stack([0.5 * length * x, side * half]))
    return Polygon(np.vstack([sides[0], sides[1][::-1]]))


def joint_leaks(
    parameters: Parameters, tunnel: Tunnel, rings: Rings, free_area: FreeArea, seed: np.random.SeedSequence
) -> list[Leak]:
    """Return wet bands along joints of the lining, numbered from 1.

    Raises
    ------
    UserError
        If there is no space for all.
    """
    p, rng = parameters, np.random.default_rng(seed)
    lowest = tunnel.section.floor_arc
    m = rings.seam_width.shape[1]
    leaks: list[Leak] = []
    while len(leaks) < p.joint_leaks:
        for _ in range(TRIES):
            length, width = rng.uniform((BAND_LENGTH[0], BAND_WIDTH[0]), (BAND_LENGTH[1], BAND_WIDTH[1])).tolist()
            i = int(rng.integers(0, rings.level.size))
            if m == 0 or rng.random() < ALONG_RINGS:
                band = affinity.rotate(band_of(length, width, rng), 90.0, origin=(0.0, 0.0))
                s, arc = rings.first + i * rings.length, float(rng.uniform(-lowest, lowest))
            else:
                band = band_of(min(length, rings.length), width, rng)
                half = 0.5 * m * rings.period
                s = rings.first + (i + 0.5) * rings.length
                arc = (rings.shift[i] + int(rng.integers(0, m)) * rings.period + half) % (2.0 * half) - half
            band = affinity.translate(band, s, arc)
            if free_area.fits(band):
                break
        else:
            raise UserError(f"no room for joint leak {len(leaks) + 1} of {p.joint_leaks}; use fewer leaks")
        free_area.reserve(band)
        factor = float(tunnel.area_factor(np.array([s]), np.array([arc]))[0])
        leaks.append(Leak(len(leaks) + 1, band, band.area * factor, float(rng.uniform(*p.leak_drop)), "joint"))
    return leaks


def niche_leaks(parameters: Parameters, tunnel: Tunnel, niches: list[Niche], seed: np.random.SeedSequence) -> list[Leak]:
    """Return leaks on the back walls of niches, in turn, numbered from 1.

    The polygon contains the wet points in the unrolled plane (their chainage and the arc of the section's nearest point);
    ``area_surface`` is the area on the back wall.

    Raises
    ------
    UserError
        If there is no space for all.
    """
    p, rng = parameters, np.random.default_rng(seed)
    rows = niche_table(tunnel, niches)
    taken: list[list[Polygon]] = [[] for _ in niches]
    leaks: list[Leak] = []
    while len(leaks) < p.niche_leaks:
        k = len(leaks) % len(niches)
        row = rows[k]
        x_most, z_most = row[14] - NICHE_MARGIN, row[15] - NICHE_MARGIN
        for _ in range(TRIES):
            area = float(np.exp(rng.uniform(*np.log(NICHE_AREA))))
            patch = star(rng, float(rng.uniform(0.8, 1.8)))
            scale = math.sqrt(area / patch.area)
            patch = affinity.scale(patch, scale, scale, origin=(0.0, 0.0))
            patch = affinity.translate(patch, float(rng.uniform(-x_most, x_most)), float(rng.uniform(NICHE_MARGIN, z_most)))
            left, low, right, high = patch.bounds
            inside = left > -x_most and right < x_most and low > NICHE_MARGIN and high < z_most
            if inside and all(patch.distance(t) > 0.2 for t in taken[k]):
                break
        else:
            raise UserError(f"no room for niche leak {len(leaks) + 1} of {p.niche_leaks}; use fewer or a longer tunnel")
        taken[k].append(patch)
        x, z = np.asarray(patch.segmentize(0.02).exterior.coords).T
        space = row[2:5] + x[:, None] * row[5:8] + row[16] * row[8:11] + z[:, None] * row[11:14]
        plane = tunnel.unroll(space + tunnel.line.origin)
        outline = Polygon(np.column_stack([plane.chainage, plane.arc]))
        leaks.append(Leak(len(leaks) + 1, outline, patch.area, float(rng.uniform(*p.leak_drop)), "niche"))
    return leaks


def _drip(leak: Polygon | MultiPolygon, down: float, gaps: tuple[float, float], rng: np.random.Generator) -> Polygon | None:
    """Return a drop or a streak on the wall below a leak, separate from it; None: the leak is not above the position tried."""
    left, low, right, high = leak.bounds
    x = float(rng.uniform(0.8 * left + 0.2 * right, 0.2 * left + 0.8 * right))
    across = leak.intersection(LineString([(x, low - 0.1), (x, high + 0.1)]))
    gap, length, width = rng.uniform(*np.array([gaps, DRIP_LENGTH, DRIP_WIDTH]).T).tolist()
    if across.is_empty:
        return None
    edge = across.bounds[3] if down > 0.0 else across.bounds[1]
    begin = edge + down * (gap + 0.5 * width)
    return LineString([(x, begin), (x + float(rng.normal(0.0, 0.01)), begin + down * length)]).buffer(0.5 * width)


def with_drips(leaks: list[Leak], gaps: tuple[float, float], free_area: FreeArea, seed: np.random.SeedSequence) -> list[Leak]:
    """Return the leaks, larger ones with one to three drips below them, which belong to their reference outline.

    ``gaps`` are the limits of the distance between a drip and its leak, m.
    """
    dripping = []
    for leak, sequence in zip(leaks, seed.spawn(len(leaks)), strict=True):
        rng = np.random.default_rng(sequence)
        down = math.copysign(1.0, leak.polygon.centroid.y)
        if leak.kind == "niche" or leak.area < MIN_DRIP_AREA or rng.random() > DRIP_SHARE:
            dripping.append(leak)
            continue
        drips = [_drip(leak.polygon, down, gaps, rng) for _ in range(int(rng.integers(1, 4)))]
        separate = unary_union([d for d in drips if d is not None and free_area.fits_drip(d, leak.polygon)])
        outline = leak.polygon.union(separate)
        scale = leak.area_surface / leak.area
        dripping.append(replace(leak, polygon=outline, area_surface=outline.area * scale))
    return dripping
