"""Scenes in cast concrete."""

from __future__ import annotations

import numpy as np
from shapely.affinity import rotate

from benchmarks.blind.known import marks, shapes
from benchmarks.blind.known.axis import Axis
from benchmarks.blind.known.build import BLACK, GALVANISED, PLASTIC, Job, bundle, conduit, kerb, new_site, rails
from benchmarks.blind.known.equipment import Hoop, boxes
from benchmarks.blind.known.patterns import block_joints, line_along
from benchmarks.blind.known.radiometry import Instrument, Law
from benchmarks.blind.known.record import Optics
from benchmarks.blind.known.scanner import Profiler, Stations
from benchmarks.blind.known.site import Leak, Site

PLAIN = [
    "patch",
    "drip",
    "patch",
    "curtain",
    "drip",
    "patch",
    "wet crack",
    "drip",
    "patch",
    "curtain",
    "patch",
    "drip",
    "patch",
]


def _strip_leak(site: Site, u: float, s: float, size: tuple[float, float], drop: float, rim: float, name: str) -> None:
    """A wet joint along the tunnel."""
    outline = shapes.on_wall(shapes.strip(site.rng, *size), u, s, site.down(s))
    site.add_leak(Leak(outline, drop, rim, name, 0.0))


def salts() -> Job:
    """Scene 1: bright salts in a box tunnel."""
    site = new_site([(0.0, 4.1), (0.5, 90), (0.0, 4.3)], 36.0, 101, Axis(565_210.4, 5_933_870.2, 4.1, 0.62, 0.0, 0.012))
    block_joints(site.surface, 9.0, 5.2, -2.0, 1.5)
    kerb(site, True, 0.9, 0.2)
    kerb(site, False, 0.9, 0.2)
    for s in (site.section.s_at(3.4, True), site.section.s_at(3.2, False)):
        conduit(site, s, 0.03, 0.016, BLACK + 1.0)
    for s in (site.section.crown - 1.9, site.section.crown + 1.9):
        site.items.append(boxes(site.section, s, 0.09, (0.06, 0.17), -3.0, (3.1, 0.6), (6.0, 6)))
    site.scatter_leaks([*PLAIN, "curtain"], (0.14, 2.9), (3.0, 8.0), (0.45, site.section.lining - 0.45))
    marks.salts(site, 0.04, 4.0)
    scanner = Stations(((4.2, 0.6, 1.78), (13.1, -0.4, 1.81), (22.3, 0.5, 1.76), (31.4, -0.5, 1.80)), 0.0024, 0.029)
    return Job(site, scanner, Optics(Instrument(constant=31.0), Law(0.28, 0.10), -4.4))


def springline_joints() -> Job:
    """Scene 2: wet joints along the springline."""
    parts = [(4.3, 48.0), (3.0, 42.0), (0.0, 1.9)]
    site = new_site(parts, 38.0, 102, Axis(571_044.0, 5_928_115.5, 17.3, 2.31, 1 / 620, -0.006))
    block_joints(site.surface, 10.0, 3.6, -2.2, 2.0)
    section = site.section
    reach = float(np.radians(48.0) * 4.3 + np.radians(42.0) * 3.0)
    left, right = section.crown - reach, section.crown + reach
    for s in (left, right):
        line_along(site.surface, s, 0.0, site.length, 0.012, -1.6)
    rails(site)
    conduit(site, section.s_at(0.9, True), 0.04, 0.018, BLACK)
    conduit(site, section.s_at(2.9, False), 0.03, 0.014, PLASTIC)
    conduit(site, section.crown + 0.7, 0.05, 0.022, GALVANISED)
    for u, s, length, width, drop in (
        (6.4, left, 6.6, 0.14, 5.8),
        (23.9, left, 7.9, 0.19, 6.6),
        (12.1, right, 5.2, 0.11, 5.2),
        (29.6, right, 7.1, 0.16, 6.9),
        (15.0, left, 2.0, 0.10, 5.6),
        (20.1, right, 2.0, 0.10, 6.2),
    ):
        _strip_leak(site, u, s, (length, width), drop, 0.035, "wet joint")
    site.scatter_leaks(PLAIN[:8], (0.15, 2.8), (3.0, 8.0))
    scanner = Profiler(0.25, 2.35, 0.019, 0.0059, 1.4)
    return Job(site, scanner, Optics(Instrument(constant=29.0, near=1.6), Law(0.25, 0.06), -4.2))


def cables() -> Job:
    """Scene 5: bundles of cables, flat ducts."""
    site = new_site([(3.35, 84), (7.0, 16), (0.0, 0.9)], 34.0, 105, Axis(558_920.7, 5_941_302.9, 33.0, 4.02, 0.0, 0.004))
    block_joints(site.surface, 8.0, 6.3, -2.0, 1.6)
    section = site.section
    rails(site)
    heights = [section.s_at(1.15, True), section.s_at(2.75, True), section.s_at(1.25, False), section.s_at(2.9, False)]
    for s, count in zip(heights, (8, 6, 10, 7), strict=True):
        bundle(site, s, count)
    site.items.append(Hoop(16.84, 16.96, 0.02, 0.04, -10.0, section.lining))
    duct = section.crown - 2.1
    site.items.append(boxes(section, duct, 0.06, (0.02, 0.04), -10.0, (0.5 * site.length, site.length)))
    for kind, size, drop, u, s in (
        ("patch", 1.9, 6.2, 4.2, heights[0] + 0.05),
        ("drip", 2.6, 5.1, 10.6, heights[1] + 0.75),
        ("curtain", 1.2, 6.8, 21.4, heights[2] - 0.45),
        ("patch", 0.7, 7.4, 27.2, heights[3]),
        ("drip", 1.6, 4.2, 13.0, heights[3] - 0.9),
        ("patch", 0.9, 4.6, 16.7, section.crown + 1.2),
        ("drip", 1.1, 5.7, 24.0, duct + 0.5),
    ):
        maker = shapes.blob(site.rng, size, 1.3) if kind == "patch" else None
        local = maker or (shapes.dripping(site.rng, size) if kind == "drip" else shapes.curtain(site.rng, size))
        site.add_leak(Leak(shapes.on_wall(local, u, s, site.down(s)), drop, 0.07, kind, 0.15))
    site.scatter_leaks(["drip", "patch", "curtain", "patch", "patch", "wet crack", "patch"], (0.16, 1.6), (3.0, 8.0))
    scanner = Stations(
        ((3.0, 0.4, 1.9), (10.9, -0.5, 1.85), (18.8, 0.5, 1.9), (26.6, -0.3, 1.88), (32.0, 0.2, 1.9)), 0.0026, 0.029, 15.0
    )
    return Job(site, scanner, Optics(Instrument(constant=32.5), Law(0.30, 0.08), -4.6))


def wet_ring() -> Job:
    """Scene 9: a wet ring joint, cables and pipes across wet patches."""
    parts = [(5.2, 54), (3.7, 40), (9.0, 14)]
    site = new_site(parts, 36.0, 109, Axis(580_377.1, 5_920_660.8, 8.4, 5.35, -1 / 480, 0.009), dust=-0.6)
    block_joints(site.surface, 12.0, 3.4, -2.0, 2.0)
    section = site.section
    kerb(site, False, 0.8, 0.15)
    band = rotate(shapes.strip(site.rng, section.lining - 0.08, 0.5, 0.07), 90, origin=(0, 0))
    site.add_leak(Leak(shapes.on_wall(band, 15.4, section.crown, 1.0), 6.0, 0.06, "wet ring joint"))
    cable = [section.s_at(3.3, True), section.s_at(3.6, False)]
    pipe = [section.s_at(1.6, True), section.s_at(2.2, False), section.s_at(4.6, True)]
    conduit(site, cable[0], 0.03, 0.018, BLACK, 1.0, 0.012)
    conduit(site, cable[1], 0.04, 0.024, BLACK + 1.0, 1.0, 0.015)
    conduit(site, pipe[0], 0.04, 0.0725, GALVANISED, 3.0)
    conduit(site, pipe[1], 0.05, 0.055, GALVANISED - 1.0, 3.0)
    conduit(site, pipe[2], 0.03, 0.030, PLASTIC, 2.0)
    for size, drop, u, s in (
        (2.2, 5.6, 5.2, pipe[0] + 0.1),
        (1.3, 7.1, 9.8, pipe[1] - 0.1),
        (0.8, 4.4, 21.6, pipe[2]),
        (1.7, 6.4, 26.3, cable[1]),
        (0.6, 5.0, 30.8, pipe[0]),
        (1.0, 3.8, 32.0, cable[0] + 0.1),
    ):
        local = shapes.blob(site.rng, size, float(site.rng.uniform(0.7, 1.6)))
        site.add_leak(Leak(shapes.on_wall(local, u, s, site.down(s)), drop, 0.09, "patch", 0.15))
    site.scatter_leaks(["drip", "curtain", "drip", "patch", "patch", "drip", "wet crack"], (0.15, 2.4), (3.0, 8.0))
    scanner = Profiler(-0.4, 2.5, 0.020, 0.0046, 1.5)
    return Job(site, scanner, Optics(Instrument(constant=30.5, near=1.8, damping=0.02), Law(0.33, 0.05), -4.8))
