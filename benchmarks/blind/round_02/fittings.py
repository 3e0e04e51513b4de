"""Common equipment of railway tunnels."""

from __future__ import annotations

import math

import numpy as np

from .solids import Beam, Cable, Solid, WallBox, Wire


def rack(
    rng: np.random.Generator, t: float, count: int, length: float, pitch: float = 0.11, span: float = 1.5, sag: float = 0.035
) -> tuple[Solid, ...]:
    """Cables on hooks, one above the other, from girth `t` upward; each of its own thickness and sag."""
    up = -math.copysign(1.0, t)
    cables: list[Solid] = []
    for number in range(count):
        radius = float(rng.choice([0.014, 0.019, 0.026, 0.033]))
        albedo = float(rng.choice([-6.5, -5.0, -8.0]))
        hang = sag * float(rng.uniform(0.5, 1.6))
        cables.append(Cable(t + up * pitch * number, 0.075, radius, albedo, hang, span, phase=0.02 * number))
    middle = t + up * pitch * (count - 1) / 2
    hooks = math.ceil(length / span) + 1
    return (*cables, WallBox(0.0, middle, 0.035, pitch * count, 0.0, 0.06, -7.0, every=span, count=hooks))


def pipe(t: float, radius: float, length: float, albedo: float = -4.0, gap: float = 0.06) -> tuple[Solid, ...]:
    """Pipe on brackets."""
    brackets = WallBox(1.1, t, 0.05, 2 * radius + 0.06, 0.0, gap + 0.01, -6.0, every=3.0, count=math.ceil(length / 3.0))
    return Cable(t, gap + radius, radius, albedo), brackets


def lamps(t: float, start: float, every: float, count: int, albedo: float = -2.5) -> tuple[Solid, ...]:
    """Tubular lamps with their cable."""
    return (
        WallBox(start, t, 0.68, 0.13, 0.03, 0.14, albedo, every=every, count=count),
        Cable(t + math.copysign(0.11, t), 0.02, 0.011, -6.0, 0.01, 0.8),
    )


def catenary(u: float, height: float, crown: float, start: float, every: float, count: int) -> tuple[Solid, ...]:
    """Contact wire and messenger with droppers' tubes under the crown."""
    post = crown - height - 0.25
    return (
        Wire(u, height, 0.0065, -8.0, stagger=0.2, span=2 * every),
        Wire(u, height + 0.42, 0.008, -8.0, sag=0.10, span=every),
        Beam(u + 0.3, crown - post / 2 + 0.1, 0.09, post, -5.0, start, 0.09, every, count),
        Beam(u + 0.1, height + 0.36, 0.75, 0.06, -4.0, start, 0.06, every, count),
    )


def trough(u: float, width: float = 0.42, height: float = 0.28, albedo: float = -4.5) -> Solid:
    """Concrete trough for cables beside the wall."""
    return Beam(u, height / 2, width, height, albedo)
