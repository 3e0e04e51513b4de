"""Cables and a contact line along the tunnel, away from the wall, and the sleepers under the rails."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from tunneldb.arrays import Float
from tunneldb.simulate.objects.fixtures import APPENDAGE, FLOOR
from tunneldb.simulate.objects.primitives import Primitive, brick, rod
from tunneldb.simulate.parameters import Parameters
from tunneldb.simulate.tunnel.tunnel import Tunnel

HANGERS = 5.0  # m between the hangers of a cable
MASTS = 40.0  # m between the arms of the contact line
DROPPERS = 5.0  # m between droppers
PIECE = 0.5  # m: wires are rods of about this length
SLEEPERS = 0.6  # m
SLEEPER = (0.26, 2.6, 0.25)  # along, across, up, m
SLEEPER_TOP = 0.04  # above the floor, m


def _wire(tunnel: Tunnel, chainage: Float, across: Float | float, up: Float | float, radius: float) -> list[Float]:
    """Return rods through points (across, up) from the axis, m."""
    frame = tunnel.line.frame(chainage)
    u, w = np.broadcast_to(across, chainage.shape)[:, None], np.broadcast_to(up, chainage.shape)[:, None]
    points = frame.position + u * frame.u + w * frame.w
    return [rod(a, b, radius) for a, b in pairwise(points)]


def _sag(chainage: Float, supports: Float, depth: float) -> Float:
    """Return the sag of a wire below its supports, m: a parabola of ``depth`` between each two."""
    k = np.clip(np.searchsorted(supports, chainage, "right") - 1, 0, supports.size - 2)
    share = (chainage - supports[k]) / (supports[k + 1] - supports[k])
    return np.asarray(4.0 * depth * share * (1.0 - share))


def _supports(start: float, end: float, spacing: float) -> Float:
    return np.linspace(start, end, max(1, round((end - start) / spacing)) + 1)


def _free_cable(tunnel: Tunnel, rng: np.random.Generator) -> Primitive:
    """Return a cable on hangers 0.35 to 0.9 m off the lining; its spans of 4 to 8 m sag by 5 to 25 cm."""
    line, section = tunnel.line, tunnel.section
    supports = _supports(line.start, line.end, HANGERS)
    arc = float(rng.uniform(0.3, 0.7) * rng.choice([-1.0, 1.0])) * section.floor_arc
    off, depth, radius = rng.uniform((0.35, 0.05, 0.012), (0.9, 0.25, 0.03)).tolist()
    (point,), (normal,) = section.point(np.array([arc]))
    u, w = point + off * normal
    chainage = _supports(line.start, line.end, PIECE)
    parts = _wire(tunnel, chainage, u, w - _sag(chainage, supports, depth), radius)
    wall, hook = tunnel.to_space(supports, np.array(arc)), tunnel.to_space(supports, np.array(arc), off)
    parts += [rod(a, b, 0.008) for a, b in zip(wall, hook, strict=True)]
    return Primitive("cable", APPENDAGE, 6.0, np.array(parts))


def _contact_line(tunnel: Tunnel) -> Primitive:
    """Return contact wire and messenger above the track, droppers between them, arms from the crown."""
    line, section = tunnel.line, tunnel.section
    crown = float(section.point(np.array([0.0]))[0][0, 1])
    wire = min(section.floor + 5.3, crown - 0.9)
    top = min(wire + 0.7, crown - 0.15)
    masts = _supports(line.start, line.end, MASTS)
    chainage = _supports(line.start, line.end, PIECE)
    messenger = top - _sag(chainage, masts, 0.6 * (top - wire))
    parts = _wire(tunnel, chainage, 0.0, wire, 0.007) + _wire(tunnel, chainage, 0.0, messenger, 0.007)
    for s in _supports(line.start, line.end, DROPPERS):
        high = top - float(_sag(np.array([s]), masts, 0.6 * (top - wire))[0])
        parts += _wire(tunnel, np.array([s, s]), 0.0, np.array([wire, high]), 0.004)
    for s in masts:
        parts += _wire(tunnel, np.array([s, s]), 0.0, np.array([top, crown]), 0.03)
        parts += _wire(tunnel, np.array([s, s]), np.array([0.0, 0.6]), np.array([wire, top]), 0.02)
        parts += _wire(tunnel, np.array([s, s]), 0.6, np.array([top, crown]), 0.02)
    return Primitive("catenary", APPENDAGE, 3.0, np.array(parts))


def overhead(parameters: Parameters, tunnel: Tunnel, seed: np.random.SeedSequence, first: int) -> list[Primitive]:
    """Return free cables and the contact line, numbered from ``first``."""
    things = [_free_cable(tunnel, np.random.default_rng(s)) for s in seed.spawn(parameters.free_cables)]
    if parameters.catenary:
        things.append(_contact_line(tunnel))
    return [replace(thing, number=first + i) for i, thing in enumerate(things)]


def sleepers(parameters: Parameters, tunnel: Tunnel) -> list[Primitive]:
    """Return sleepers along the track; they are floor and have no number."""
    if not parameters.sleepers:
        return []
    line, section = tunnel.line, tunnel.section
    s = np.arange(line.start + 0.5 * SLEEPERS, line.end, SLEEPERS)
    frame = line.frame(s)
    middle = frame.position + (section.floor + SLEEPER_TOP - 0.5 * SLEEPER[2]) * frame.w
    parts = [brick(*row) for row in zip(middle, [SLEEPER] * s.size, np.stack([frame.t, frame.u, frame.w], axis=1), strict=True)]
    return [Primitive("sleeper", FLOOR, 1.0, np.array(parts))]
