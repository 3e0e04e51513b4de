"""What linings and tunnels of many kinds have in common: textures, joints, dirt, cable racks, lamps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from benchmarks.blind.round_08.fittings import Fittings
from benchmarks.blind.round_08.surface import Raster, Surface, smoothstep


def concrete(surface: Surface, blotch: float = 0.4, grain: float = 0.3, streak: float = 0.25) -> None:
    """Texture of concrete: clouds of cement paste, grain, and faint streaks down the wall."""
    surface.db += blotch * surface.noise(1.6, 1.2, octaves=4) + grain * surface.noise(0.06, octaves=2)
    surface.db += streak * surface.noise(0.12, 2.5, octaves=2)


def ballast(surface: Surface, level: float = -3.0) -> None:
    """A floor of ballast."""
    floor = surface.u >= surface.section.lined
    surface.relief += np.where(floor, 0.02 * surface.noise(0.08, octaves=2), 0.0).astype(np.float32)
    surface.db = np.where(floor, level + 1.2 * surface.noise(0.08, octaves=2), surface.db).astype(np.float32)


def slab(surface: Surface, level: float = -1.0) -> None:
    """A floor of concrete or asphalt, dusty, with darker wheel tracks or puddles' remains."""
    floor = surface.u >= surface.section.lined
    texture = level + 0.6 * surface.noise(1.5, 0.5) + 0.5 * surface.noise(0.05, octaves=2)
    surface.db = np.where(floor, texture, surface.db).astype(np.float32)


def soot(surface: Surface, half: float, change: float, kind: str | None = None) -> None:
    """Soot along the crown, its rims uneven; with a kind it is told where it is at its darkest."""
    off = np.abs(surface.u - surface.section.crown) - half * (1.0 + 0.15 * surface.wave(3.0))
    cover = smoothstep(0.5 - off / (0.9 * half) + 0.12 * surface.coarse)
    surface.db += change * cover * (1.0 + 0.12 * surface.noise(2.5, 1.0))
    if kind is not None:
        surface.others.append((kind, surface.lining & (cover > 0.6)))


def foot_dust(surface: Surface, rise: float, change: float) -> None:
    """Dust or brake dust on the lower wall, fading upwards."""
    cover = smoothstep(1.0 - surface.height / (rise * (1.0 + 0.2 * surface.wave(2.0))) + 0.1 * surface.coarse)
    surface.db += change * np.where(surface.lining, cover, 0.0)


def groove(surface: Surface, line: Raster, half: float, depth: float, change: float) -> None:
    """A joint: ``line`` is the distance from its middle, in metres."""
    inside = smoothstep((half - line) / surface.step + 0.5)
    surface.db += np.where(surface.lining, change * inside, 0.0)
    surface.relief += np.where(surface.lining, depth * inside, 0.0).astype(np.float32)


def rings(surface: Surface, first: float, width: float, half: float = 0.006, depth: float = 0.01, change: float = -2.0) -> None:
    """Joints across the tunnel, and a level of each ring or block of its own."""
    place = (surface.s - first) / width
    levels = surface.rng.normal(0.0, 0.3, int(surface.length / width) + 4)
    surface.db += levels[np.floor(place).astype(int) + 2].astype(np.float32)
    groove(surface, np.abs(place - np.round(place)) * width, half, depth, change)


def masonry(
    surface: Surface,
    course: float,
    stone: float,
    level: float,
    mortar: float,
    joint: float,
    bulge: float,
    band: tuple[float, float],
) -> None:
    """Courses of stones between two places along the girth.

    Parameters
    ----------
    surface : Surface
        Lining.
    course, stone : float
        Mean height of a course and length of a stone, in metres.
    level : float
        Scatter of reflectance between stones, in dB.
    mortar : float
        Level of the joints, in dB.
    joint : float
        Half-width of the joints, in metres.
    bulge : float
        How far stones stand out, in metres.
    band : tuple of float
        From and to along the girth.
    """
    rng = surface.rng
    edges = np.cumsum(np.concatenate([[band[0]], course * rng.uniform(0.8, 1.2, int((band[1] - band[0]) / course / 0.8) + 2)]))
    row = np.clip(np.searchsorted(edges, surface.u[0]) - 1, 0, edges.size - 2)
    bed = np.minimum(surface.u[0] - edges[row], edges[row + 1] - surface.u[0])[None, :]
    long = stone * rng.uniform(0.8, 1.25, edges.size)[row][None, :]
    place = (surface.s + 0.02 * surface.coarse) / long + rng.uniform(0.0, 1.0, edges.size)[row][None, :]
    number = np.floor(place).astype(int)
    head = np.minimum(place - number, 1.0 - place + number) * long
    table = rng.standard_normal((edges.size, int(number.max()) + 1))
    inside = (surface.u >= band[0]) & (surface.u < band[1])
    own = table[row[None, :], number]
    gap = np.minimum(bed, head) + 0.004 * surface.fine - joint
    face = smoothstep(gap / 0.015 + 0.5)
    surface.db += np.where(inside, face * level * own + (1.0 - face) * mortar, 0.0).astype(np.float32)
    stands = bulge * (0.4 * own + smoothstep(gap / 0.06)) * face
    surface.relief -= np.where(inside, stands, 0.0).astype(np.float32)


def cable_rack(
    fittings: Fittings,
    span: tuple[float, float],
    places: Sequence[float],
    radius: float,
    db: float,
    bracket: float,
    off: float = 0.12,
) -> None:
    """Cables along the wall at places along the girth, on brackets ``bracket`` metres apart."""
    for number, u in enumerate(places):
        fittings.cable(span, u, off, radius * (0.8 + 0.1 * (number % 4)), db - 0.7 * (number % 3))
    low, high = min(places) - 0.06, max(places) + 0.06
    for s in np.arange(span[0] + 0.4, span[1], bracket):
        fittings.mount((s - 0.02, s + 0.02), (low, high), (0.0, off - radius), 1.0, gloss=0.3)


def lamps(
    fittings: Fittings, places: Sequence[float], u: float, size: tuple[float, float], off: tuple[float, float], db: float = 1.5
) -> None:
    """Lamps on the lining, with their conduit."""
    for s in places:
        fittings.mount((s - size[0] / 2, s + size[0] / 2), (u - size[1] / 2, u + size[1] / 2), off, db, gloss=0.6)


def mark(
    surface: Surface, kind: str | None, s: float, u: float, size: tuple[float, float], change: float, written: bool = True
) -> None:
    """A painted field or a label, on it what is written."""
    field = surface.panel(s - size[0] / 2, s + size[0] / 2, u - size[1] / 2, u + size[1] / 2)
    surface.stain(kind, field, change, soft=0.015)
    if written:
        script = smoothstep(3.0 * surface.noise(0.05, 0.05, octaves=1) - 2.0)
        surface.db -= np.where(field > 0.03, 0.8 * change * script, 0.0).astype(np.float32)
