"""Usual equipment of tunnels, placed by its arc on the section and its distance from the wall."""

from __future__ import annotations

from .equipment import Bar, Fixture, Series, Tube
from .profile import Profile


def tray(
    profile: Profile, arc: float, length: float, width: float = 0.3, stand: float = 0.2, bay: float = 1.5, tone: float = -2.5
) -> list[Fixture]:
    """Cable tray along the whole tunnel, with its brackets."""
    u, v, turn = profile.point(arc, stand)
    bu, bv, _ = profile.point(arc, stand / 2)
    return [
        Bar(u, v, width, 0.08, turn, Series(-1.0, length + 2.0), tone, 0.1),
        Bar(bu, bv, 0.05, stand, turn, Series(0.4, 0.05, bay, int(length / bay)), -1.5, 0.1),
    ]


def cables(
    profile: Profile, arcs: tuple[float, ...], length: float, radius: float, stand: float, sag: float, tone: float = -4.0
) -> list[Fixture]:
    """Cables on hooks, one below the other."""
    found: list[Fixture] = []
    for index, arc in enumerate(arcs):
        u, v, _ = profile.point(arc, stand)
        found.append(
            Tube(u, v, radius, Series(-1.0, length + 2.0), tone - 0.7 * (index % 3), 0.03, sag * (1.0 + 0.4 * (index % 2)), 1.5)
        )
    return found


def pipe(
    profile: Profile, arc: float, length: float, radius: float, gap: float, tone: float, gloss: float = 0.1
) -> list[Fixture]:
    """Pipe on consoles, with couplings every six metres."""
    u, v, turn = profile.point(arc, gap + radius)
    bu, bv, _ = profile.point(arc, gap / 2)
    return [
        Tube(u, v, radius, Series(-1.0, length + 2.0), tone, gloss),
        Tube(u, v, 1.25 * radius, Series(1.7, 0.16, 6.0, int(length / 6.0) + 1), tone - 1.0, gloss),
        Bar(bu, bv, 0.08, max(gap, 0.02), turn, Series(0.9, 0.08, 3.0, int(length / 3.0)), -2.0),
    ]


def lamps(
    profile: Profile, arc: float, start: float, period: float, count: int, size: tuple[float, float, float], stand: float = 0.15
) -> list[Fixture]:
    """Row of lamps: ``size`` is length along the tunnel, width, depth."""
    u, v, turn = profile.point(arc, stand)
    bu, bv, _ = profile.point(arc, stand / 2)
    along = Series(start - size[0] / 2, size[0], period, count)
    return [
        Bar(u, v, size[1], size[2], turn, along, -4.0, 0.6),
        Bar(bu, bv, 0.04, stand, turn, Series(start - 0.02, 0.04, period, count), -2.0),
    ]


def cabinet(
    profile: Profile, arc: float, s: float, length: float, height: float, depth: float, tone: float = 0.5
) -> list[Fixture]:
    """Box or sign on the wall."""
    u, v, turn = profile.point(arc, depth / 2)
    return [Bar(u, v, height, depth, turn, Series(s - length / 2, length), tone, 0.2)]


def places(start: float, period: float, count: int) -> tuple[float, ...]:
    """Chainages of a row."""
    return tuple(start + period * index for index in range(count))
