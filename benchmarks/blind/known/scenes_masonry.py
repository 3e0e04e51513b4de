"""Scenes in brick, stone and rock."""

from __future__ import annotations

import numpy as np

from benchmarks.blind.known import shapes
from benchmarks.blind.known.axis import Axis
from benchmarks.blind.known.build import BLACK, GALVANISED, Job, conduit, new_site, rails
from benchmarks.blind.known.patterns import Bricks, blast_rock, lay_stones
from benchmarks.blind.known.radiometry import Instrument, Law
from benchmarks.blind.known.record import Optics
from benchmarks.blind.known.scanner import Profiler, Stations
from benchmarks.blind.known.site import Leak, Site


def _foot_damp(site: Site, u: float, left: bool, length: float, height: float, drop: float) -> None:
    """Rising damp at one foot."""
    foot = 0.03 if left else site.section.lining - 0.03
    outline = shapes.on_wall(shapes.foot_damp(site.rng, length, height), u, foot, site.down(foot))
    site.add_leak(Leak(outline, drop, 0.14, "damp foot"))


def brick() -> Job:
    """Scene 6: a brick vault."""
    site = new_site(
        [(3.7, 82), (8.0, 20), (0.0, 0.6)], 36.0, 106, Axis(553_018.6, 5_919_442.0, 61.5, 5.9, 0.0, 0.003), dust=0.4
    )
    section = site.section
    site.surface.pattern = Bricks(section.lining, 1.2, 1.5, site.rng)
    rails(site)
    conduit(site, section.s_at(2.0, True), 0.05, 0.022, BLACK)
    for u, left, length, height, drop in (
        (7.5, True, 4.6, 0.62, 4.6),
        (24.0, False, 3.4, 0.5, 5.4),
        (30.5, True, 2.4, 0.42, 4.2),
    ):
        _foot_damp(site, u, left, length, height, drop)
    kinds = ["drip", "patch", "curtain", "drip", "patch", "drip", "curtain", "patch", "drip", "patch", "patch"]
    site.scatter_leaks(kinds, (0.22, 3.9), (4.0, 8.0), (0.5, section.lining - 0.5))
    scanner = Profiler(0.2, 2.3, 0.0175, 0.0053, 1.0)
    return Job(site, scanner, Optics(Instrument(constant=29.5, near=1.5, exit_radius=0.0015), Law(0.38, 0.03), -5.2))


def stone() -> Job:
    """Scene 7: coursed stone."""
    site = new_site([(3.5, 90), (0.0, 2.4)], 34.0, 107, Axis(548_760.3, 5_946_118.4, 88.2, 0.95, 0.0, 0.005), dust=0.4)
    section = site.section
    lay_stones(site.surface, 1.5, site.rng)
    rails(site)
    conduit(site, section.s_at(1.8, False), 0.06, 0.02, BLACK)
    site.scatter_leaks(["drip", "patch", "curtain", "drip", "patch", "drip", "patch", "drip"], (0.6, 2.9), (3.2, 8.0))
    site.scatter_leaks(["patch", "drip", "curtain", "patch", "drip", "patch"], (0.15, 0.5), (5.0, 8.0))
    scanner = Stations(((3.9, 0.3, 1.75), (12.4, -0.4, 1.8), (21.0, 0.4, 1.77), (29.8, -0.3, 1.8)), 0.0025, 0.027, 15.0)
    return Job(site, scanner, Optics(Instrument(constant=31.0, has_reference=False), Law(0.40, 0.02), -5.0))


def rock() -> Job:
    """Scene 8: rough rock."""
    site = new_site(
        [(3.1, 62), (1.9, 28), (0.0, 2.6)], 34.0, 108, Axis(590_105.5, 5_911_870.9, 140.7, 4.4, 0.0, 0.014), dust=0.3
    )
    section = site.section
    blast_rock(site.surface, 1.5, site.rng)
    conduit(site, section.s_at(2.5, True), 0.22, 0.024, BLACK)
    conduit(site, section.s_at(1.6, False), 0.25, 0.05, GALVANISED, 3.0)
    kinds = [
        "drip",
        "patch",
        "curtain",
        "patch",
        "drip",
        "patch",
        "curtain",
        "drip",
        "patch",
        "patch",
        "drip",
        "patch",
        "patch",
        "patch",
    ]
    site.scatter_leaks(kinds, (0.32, 4.8), (5.0, 9.0), (0.5, section.lining - 0.5))
    places = ((2.7, 0.3, 1.8), (9.6, -0.4, 1.75), (16.8, 0.3, 1.8), (23.9, -0.3, 1.78), (31.2, 0.2, 1.8))
    scanner = Stations(places, 0.0026, 0.028, 14.0)
    site.surface.dry[:, site.surface.lining_rows :] -= np.float32(1.0)
    return Job(site, scanner, Optics(Instrument(constant=33.0), Law(0.45, 0.0), -5.5))
