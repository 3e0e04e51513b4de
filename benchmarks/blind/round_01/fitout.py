"""What a metro tunnel is fitted out with, and the dirt that gathers in it."""

from __future__ import annotations

import numpy as np

from .canvas import Canvas, ramp
from .equipment import Body, beam, hoop, plate, rack, strand
from .frames import Array, Tunnel
from .shapes import Crack, Disc, Joined, Patch, Run, Slab

RUBBER, ZINC, PAINTED = -9.0, -2.5, -1.5


def track(tunnel: Tunnel, floor: float, middle: float = 0.0, third_rail: float | None = None) -> list[Body]:
    """Two rails on the slab, and a covered conductor rail at an offset to the left."""
    end = tunnel.axis.length
    bodies: list[Body] = []
    for side in (-0.75, 0.75):
        bodies += beam(tunnel, (0.0, end), middle + side, -floor + 0.17, 0.07, 0.05, -5.0)
        bodies += beam(tunnel, (0.0, end), middle + side, -floor + 0.07, 0.02, 0.14, -6.5)
    if third_rail is not None:
        bodies += beam(tunnel, (0.0, end), third_rail, -floor + 0.33, 0.16, 0.14, -3.0)
    return bodies


def walkway(tunnel: Tunnel, side: int, y: float, top: float, width: float) -> list[Body]:
    """An escape walkway of slabs on brackets, on the left (1) or on the right (-1)."""
    end = tunnel.axis.length
    bodies: list[Body] = list(beam(tunnel, (0.0, end), side * y, top - 0.06, width, 0.12, -4.5))
    bodies += beam(tunnel, (0.0, end), side * (y - width / 2 + 0.03), top - 0.2, 0.06, 0.28, -4.8)
    return bodies


def lamps(tunnel: Tunnel, v: float, first: float, pitch: float, size: tuple[float, float, float]) -> list[Body]:
    """Luminaires along a line, and the conduit that feeds them."""
    bodies: list[Body] = [
        plate(tunnel, float(u), v, size, 0.0, 0.04) for u in np.arange(first, tunnel.axis.length - 0.3, pitch)
    ]
    bodies += strand(tunnel, (0.0, tunnel.axis.length), v + np.sign(v) * (size[1] / 2 + 0.06), 0.025, 0.012, ZINC)
    return bodies


def cabinet(tunnel: Tunnel, u: float, v: float, size: tuple[float, float, float], up: float) -> list[Body]:
    """A box on the wall, with conduits that leave it upwards as far as a girth."""
    top = np.sign(v) * (abs(v) - size[1] / 2)
    bodies: list[Body] = [plate(tunnel, u, v, size, PAINTED, 0.03)]
    for shift in (-0.12, 0.0, 0.12):
        bodies += hoop(tunnel, u + shift * size[0], (float(top), up), 0.03, 0.014, ZINC)
    return bodies


def cable_wall(
    tunnel: Tunnel,
    rng: np.random.Generator,
    girths: list[float],
    bundle: int,
    off: float = 0.14,
    pitch: float = 1.0,
) -> list[Body]:
    """Brackets with tiers of cables at given girths, ``bundle`` cables in each tier."""
    bodies: list[Body] = []
    end = tunnel.axis.length
    for girth in girths:
        places = []
        for n in range(bundle):
            radius = float(rng.choice([0.009, 0.013, 0.018, 0.024]))
            away = off - 0.045 * (n % 3) + float(rng.normal(0, 0.004))
            low = float(rng.normal(0, 0.006)) - 0.03 * (n // 3)
            places.append((girth + np.sign(girth) * low, max(away, radius + 0.008), radius, RUBBER + float(rng.normal(0, 1.0))))
        bodies += rack(tunnel, (0.0, end), places, pitch, (0.03, 0.05, off + 0.05), rng)
    return bodies


def plates(canvas: Canvas, v: float, first: float, pitch: float) -> list[Body]:
    """Number plates, which send the beam straight back."""
    return [plate(canvas.tunnel, float(u), v, (0.3, 0.2, 0.012), 3.5) for u in np.arange(first, canvas.u[-1] - 0.5, pitch)]


def grain(canvas: Canvas, sizes: tuple[float, float, float]) -> None:
    """Mottle of the concrete: broad, of a palm's width, and fine."""
    for size, scale in zip(sizes, (1.6, 0.3, 0.05), strict=True):
        canvas.texture(canvas.shade, size, scale)


def floor_dirt(canvas: Canvas, roughness: float, mottle: float) -> None:
    """Unevenness and spots of the floor, which is not lining."""
    floor = np.abs(canvas.v) >= canvas.tunnel.section.foot
    shade = canvas.noise.field(0.35)(canvas.u[:, None], canvas.v[None, floor])
    stones = canvas.noise.field(0.06)(canvas.u[:, None], canvas.v[None, floor])
    canvas.shade[:, floor] = (mottle * (shade + 0.6 * stones)).astype(np.float32)
    canvas.relief[:, floor] = (roughness * stones).astype(np.float32)


def brake_dust(canvas: Canvas, size: float, height: float, side: int = 0) -> None:
    """Dust of brakes and rails on the lower walls, up to about a height above the floor, on one side (-1, 1) or both."""
    foot = canvas.tunnel.section.foot

    def profile(v: Array) -> Array:
        level = np.exp(-(((foot - np.abs(v)) / height) ** 2))
        return np.where((np.abs(v) < foot) & ((side == 0) | (np.sign(v) == side)), level, 0.0)

    canvas.gradient(size, profile, 1.5)


def soot(canvas: Canvas, size: float, width: float) -> None:
    """Grime along the crown."""
    canvas.gradient(size, lambda v: np.exp(-((v / width) ** 2)), 2.5)


def old_runs(canvas: Canvas, count: int, shade: tuple[float, float], kind: str, span: tuple[float, float]) -> None:
    """Dried streaks on the walls, starting between two girths (absolute values)."""
    rng, foot = canvas.rng, canvas.tunnel.section.foot
    for _ in range(count):
        side = 1 if rng.random() < 0.5 else -1
        top = float(rng.uniform(*span))
        bottom = min(foot - 0.05, top + float(rng.uniform(0.4, 1.8)))
        width = float(rng.uniform(0.03, 0.14))
        run = Run(float(rng.uniform(0.8, canvas.u[-1] - 0.8)), side * top, side * bottom, width, 0.6 * width, 0.04)
        canvas.stain(run, float(rng.uniform(*shade)), kind, rim=0.04)


def repairs(canvas: Canvas, count: int, shade: tuple[float, float], kind: str = "repair mortar") -> None:
    """Trowelled patches of mortar, some millimetres proud of the lining."""
    rng, foot = canvas.rng, canvas.tunnel.section.foot
    for _ in range(count):
        size = (float(rng.uniform(0.2, 0.9)), float(rng.uniform(0.15, 0.6)))
        place = (float(rng.uniform(1.0, canvas.u[-1] - 1.0)), float(rng.uniform(-0.85, 0.85)) * foot)
        canvas.stain(Slab(*place, *size), float(rng.uniform(*shade)), kind, rim=0.02, lift=-0.003)


def injected(canvas: Canvas, start: tuple[float, float], end: tuple[float, float], shade: float, width: float) -> None:
    """A crack or joint that was injected: resin smeared along it, packers drilled on both sides, rubbed-off drips."""
    rng = canvas.rng
    canvas.stain(Crack(start, end, width, 0.02), shade, "injection resin", rim=0.025, patchy=0.3, lift=-0.002)
    way = np.subtract(end, start)
    length = float(np.hypot(*way))
    unit, aside = way / length, np.array([-way[1], way[0]]) / length
    for n, step in enumerate(np.arange(0.12, length, 0.22)):
        middle = np.array(start) + step * unit + (0.11 if n % 2 else -0.11) * aside
        canvas.stain(Disc(float(middle[0]), float(middle[1]), 0.014), -4.0, "", rim=0.008)
        if rng.random() < 0.3:
            drop = float(rng.uniform(0.1, 0.35))
            sign = np.sign(middle[1]) or 1.0
            run = Run(float(middle[0]), float(middle[1]), float(middle[1] + sign * drop), 0.04, 0.015, 0.01)
            canvas.stain(run, 0.7 * shade, "injection resin", rim=0.02)


def stencils(canvas: Canvas, v: float, first: float, pitch: float, shade: float) -> None:
    """Painted chainage marks: three figures, 12 cm high, and a stroke."""
    for u in np.arange(first, canvas.u[-1] - 0.8, pitch):
        for n in range(3):
            spot = float(u) + 0.11 * n
            bars = (Slab(spot - 0.025, v, 0.016, 0.12), Slab(spot, v + 0.052 * (n - 1), 0.06, 0.016))
            canvas.stain(Joined(bars), shade, "", rim=0.008)
        canvas.stain(Slab(float(u) + 0.5, v, 0.02, 0.3), shade, "", rim=0.008)


def oil(canvas: Canvas, spots: list[tuple[float, float, float]], shade: float, kind: str = "grease") -> None:
    """Splashes: a core with droplets around it, at (chainage, girth, radius)."""
    rng = canvas.rng
    for u, v, radius in spots:
        parts = [Patch(u, v, radius, 0.8 * radius, 0.4)]
        for _ in range(10):
            turn, away = rng.uniform(0, 2 * np.pi), radius * float(rng.uniform(1.1, 2.2))
            size = radius * float(rng.uniform(0.05, 0.2))
            parts.append(Patch(u + away * float(np.cos(turn)), v + away * float(np.sin(turn)), size, size, 0.2))
        canvas.stain(Joined(tuple(parts)), shade, kind, rim=0.03)


def vignette(canvas: Canvas, border: float, size: float, width: float) -> None:
    """A step of reflectance at a girth, as between two coats or washings, the lower part differing by ``size``."""
    below = ramp((np.abs(canvas.v) - border) / width)
    canvas.shade += (size * below).astype(np.float32)[None, :]
