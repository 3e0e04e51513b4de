"""Fittings of a metro tunnel: racks with cables, pipes, lamps, track, walkway, rigid overhead conductor."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .objects import Box, Tube
from .tunnel import Tunnel


def wall_box(
    t: Tunnel, c: float, s: float, stand: float, size: tuple[float, float, float], db: float, gloss: float = 0.0
) -> None:
    """A block on the lining: ``size`` is along the tunnel, along the wall, and depth; ``stand`` the gap behind it."""
    u, w, turn = t.on_wall(s, stand + size[2] / 2)
    t.things.append(Box(c, u, w, (size[0] / 2, size[1] / 2, size[2] / 2), db, turn, gloss))


def cable(t: Tunnel, s: float, stand: float, radius: float, db: float = -9.0, sag: float = 0.0, bay: float = 1.2) -> None:
    """A cable or conduit over the whole length."""
    u, w, _ = t.on_wall(s, stand)
    t.things.append(Tube(u, w, radius, -0.5, t.axis.length + 0.5, db, 0.1, sag, bay))


def rack(t: Tunnel, levels: Sequence[float], radii: Sequence[float], bay: float, start: float, db: float = -6.0) -> None:
    """Upright brackets every ``bay`` m with a cable at each position ``levels`` on the wall (0 leaves the arm empty)."""
    low, high = min(levels), max(levels)
    for c in np.arange(start, t.axis.length, bay):
        for part in np.linspace(low - 0.06, high + 0.06, 4)[:-1] + (high - low + 0.12) / 6:
            wall_box(t, float(c), float(part), 0.005, (0.05, (high - low + 0.12) / 3 + 0.02, 0.04), db, 0.2)
        for s in levels:
            wall_box(t, float(c), s + 0.05 * np.sign(s), 0.04, (0.04, 0.035, 0.20), db, 0.2)
    for s, radius in zip(levels, radii, strict=True):
        if radius:
            cable(t, s, 0.10 + radius, radius, -10.0 + t.rng.normal(0, 0.8), 0.012, bay)
            if radius < 0.03:
                cable(t, s, 0.19 + radius, radius * 0.8, -9.0 + t.rng.normal(0, 0.8), 0.02, bay)


def pipe(t: Tunnel, s: float, stand: float, radius: float, db: float, bay: float, gloss: float = 0.25) -> None:
    """A pipe with clamps."""
    cable(t, s, stand + radius, radius, db)
    u, w, _ = t.on_wall(s, stand + radius)
    for c in np.arange(0.9, t.axis.length, bay):
        t.things.append(Tube(u, w, radius + 0.012, float(c) - 0.03, float(c) + 0.03, db - 1.5, gloss))
        wall_box(t, float(c), s, 0.0, (0.06, 0.06, stand + 0.02), db - 2, gloss)


def lamps(t: Tunnel, s: float, spacing: float, start: float, size: tuple[float, float, float] = (1.2, 0.14, 0.10)) -> None:
    """Lamps on the wall: bright diffusers in a grey housing."""
    for c in np.arange(start, t.axis.length, spacing):
        wall_box(t, float(c), s, 0.03, size, -2.5, 0.3)


def track(t: Tunnel, lateral: float = 0.0, spacing: float = 0.6) -> None:
    """Two rails on blocks, on the slab."""
    floor = t.section.floor
    for side in (-1, 1):
        u = lateral + side * 0.7535
        t.things.append(Box(t.axis.length / 2, u, floor + 0.16, (t.axis.length / 2 + 0.5, 0.036, 0.02), -5.0, (1.0, 0.0), 0.4))
        t.things.append(Box(t.axis.length / 2, u, floor + 0.07, (t.axis.length / 2 + 0.5, 0.01, 0.07), -8.0))
    rows_l = t.canvas.rows(-t.section.half, -t.section.foot), t.canvas.rows(t.section.foot, t.section.half)
    for rows in rows_l:
        for c in np.arange(0.2, t.axis.length, spacing):
            t.canvas.dry[rows, t.canvas.cols(float(c), float(c) + 0.26)] += np.float32(1.2)


def platform(t: Tunnel, side: int, top: float, width: float, rail: bool = True) -> None:
    """An evacuation platform of concrete or steel along one wall, with a handrail."""
    s = t.section.height_at(top, side)
    u = float(t.section.at(s)[0])
    middle = u - side * width / 2
    t.things.append(Box(t.axis.length / 2, middle, top - 0.06, (t.axis.length / 2 + 0.5, width / 2, 0.06), -5.5))
    for c in np.arange(0.4, t.axis.length, 1.5):
        t.things.append(Box(float(c), middle, top - 0.3, (0.04, width / 2, 0.18), -7.0))
    if rail:
        cable(t, t.section.height_at(top + 0.95, side), 0.09, 0.02, -4.0)


def overhead(t: Tunnel, drop: float, spacing: float, start: float) -> None:
    """A rigid overhead conductor below the crown with its supports."""
    _, top = t.section.at(0.0)
    w = float(top) - drop
    t.things.append(Box(t.axis.length / 2, 0.0, w, (t.axis.length / 2 + 0.5, 0.04, 0.055), -4.0, (1.0, 0.0), 0.3))
    for c in np.arange(start, t.axis.length, spacing):
        t.things.append(Box(float(c), 0.0, w + 0.2, (0.07, 0.06, 0.15), -8.0))
        t.things.append(Box(float(c), 0.0, float(top) - 0.08, (0.05, 0.30, 0.03), -5.0, (1.0, 0.0), 0.3))
        for side in (-1, 1):
            t.things.append(Box(float(c), side * 0.26, float(top) - 0.07, (0.015, 0.015, 0.09), -5.0))


def cabinets(t: Tunnel, places: Sequence[tuple[float, float, tuple[float, float, float]]], db: float = -4.5) -> None:
    """Signal boxes, junction boxes, telephones: (chainage, arc, size)."""
    for c, s, size in places:
        wall_box(t, c, s, 0.02, size, db + t.rng.normal(0, 1.0), 0.2)
