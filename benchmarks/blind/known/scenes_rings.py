"""Scenes in rings of segments."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from shapely import box

from benchmarks.blind.known import marks, shapes
from benchmarks.blind.known.axis import Axis
from benchmarks.blind.known.build import BLACK, GALVANISED, PLASTIC, Job, conduit, kerb, new_site, rails
from benchmarks.blind.known.patterns import Rings, chamfer, make_rings
from benchmarks.blind.known.radiometry import Instrument, Law
from benchmarks.blind.known.record import Optics
from benchmarks.blind.known.scanner import Profiler, Stations
from benchmarks.blind.known.site import Leak, Mark, Site


def _tones(site: Site, rings: Rings, std: float) -> None:
    """Segments differ a little by their batch of concrete."""
    rng, surface = site.rng, site.surface
    for ring, cuts in enumerate(rings.cuts):
        bounds = np.concatenate([[0.0], cuts, [site.section.lining]])
        rows = slice(max(int(rings.joints[ring] * 100), 0), max(int(rings.joints[ring + 1] * 100), 0))
        for low, high in pairwise(bounds):
            surface.dry[rows, int(low * 100) : int(high * 100)] += np.float32(rng.normal(0.0, std))


def wet_panel() -> Job:
    """Scene 3: whole panels wet."""
    site = new_site([(2.87, 138)], 36.0, 103, Axis(563_900.2, 5_936_448.7, -11.2, 1.14, 0.0, -0.008))
    section = site.section
    rings = make_rings(section, site.length, 1.5, 3.0, 0.0, site.rng)
    _tones(site, rings, 0.2)
    rings.paint(site.surface, 0.016, -2.6)
    rails(site)
    conduit(site, section.s_at(1.5, True), 0.04, 0.02, BLACK)
    conduit(site, section.s_at(3.1, False), 0.03, 0.018, BLACK + 1.0)
    conduit(site, section.s_at(1.1, False), 0.05, 0.04, GALVANISED)
    for ring, column, drop, beside in ((7, 1, 2.6, 2), (17, 2, 4.0, 1)):
        cuts = rings.cuts[ring]
        wet = rings.panel(ring, float(cuts[column]), float(cuts[column + 1]), 0.006)
        site.add_leak(Leak(wet, drop, 0.025, "wet panel"))
        other = rings.panel(ring, float(cuts[beside]), float(cuts[beside + 1]), 0.006)
        site.add_mark(Mark(other, "other concrete", -1.0, 0.012))
        following = rings.cuts[ring + 1]
        after = rings.panel(ring + 1, float(following[column]), float(following[column + 1]), 0.006)
        if ring == 17:
            site.add_mark(Mark(after, "other concrete", -1.0, 0.012))
    kinds = ["drip", "patch", "curtain", "patch", "drip", "wet crack", "patch", "drip", "patch", "curtain", "patch", "patch"]
    site.scatter_leaks(kinds, (0.14, 2.2), (3.0, 8.0), (0.4, section.lining - 0.4))
    scanner = Stations(
        ((2.6, 0.2, 1.7), (9.2, -0.3, 1.72), (16.4, 0.3, 1.7), (23.6, -0.2, 1.74), (31.8, 0.2, 1.7)), 0.0027, 0.027, 14.0
    )
    return Job(site, scanner, Optics(Instrument(constant=30.0, near=1.7, has_reference=False), Law(0.22, 0.10), -4.0))


def chamfered_joints() -> Job:
    """Scene 4: wide dark chamfers on slanting joints."""
    site = new_site([(3.05, 136)], 36.0, 104, Axis(569_511.9, 5_925_037.3, 21.6, 3.3, 1 / 410, 0.011))
    section = site.section
    rings = make_rings(section, site.length, 1.2, 2.9, 1.5, site.rng)
    _tones(site, rings, 0.15)
    rings.paint(site.surface, 0.05, -6.0)
    chamfer(site.surface, rings, 0.05, 0.010)
    inner = box(0.0, 0.0, site.length, section.lining)
    for strip in rings.strips(0.05):
        site.marks.append(Mark(strip.intersection(inner), "joint", -6.0, 0.01))
    rails(site)
    conduit(site, section.s_at(1.4, False), 0.04, 0.02, BLACK)
    conduit(site, section.crown - 0.9, 0.04, 0.016, PLASTIC)
    kinds = [
        "patch",
        "drip",
        "curtain",
        "patch",
        "drip",
        "patch",
        "drip",
        "wet crack",
        "patch",
        "curtain",
        "patch",
        "drip",
        "patch",
    ]
    site.scatter_leaks([*kinds, "patch"], (0.15, 2.7), (3.0, 8.0), (0.4, section.lining - 0.4))
    scanner = Profiler(0.15, 2.05, 0.019, 0.0068, 1.1)
    return Job(site, scanner, Optics(Instrument(constant=28.0, near=1.4), Law(0.27, 0.07), -4.5))


def _road_tube(site: Site, halo_rows: tuple[float, float], ring: float, tilt: float) -> Rings:
    """Rings with half-ring steps, lamps with halos, painted stripes and repairs."""
    section = site.section
    rings = make_rings(section, site.length, ring, 3.1, tilt, site.rng)
    _tones(site, rings, 0.2)
    rings.paint(site.surface, 0.018, -2.4)
    marks.half_rings(site, rings, {3: (True, -1.3), 6: (False, 0.9), 9: (True, -0.9), 12: (False, -1.6), 15: (True, 1.1)})
    marks.stripe_along(site, section.s_at(1.3, True), 0.30, 3.0, 24.0, -3.0)
    marks.stripe_along(site, section.s_at(1.7, False), 0.10, 8.0, 33.0, 3.2)
    marks.stripe_around(site, 11.4, 0.05, 0.6, section.lining - 0.6, 3.0)
    marks.stripe_around(site, 27.9, 0.20, 0.9, section.s_at(3.2, True), -3.4)
    marks.stripe_around(site, 19.2, 0.12, section.s_at(2.9, False), section.lining - 0.5, -2.8)
    for s, first in zip(halo_rows, (2.4, 4.4), strict=True):
        marks.lamps(site, s, first, 7.0, 2.5)
    return rings


def halos_and_repairs() -> Job:
    """Scene 10: halos, repairs, paint, half-ring steps, interrupted drips, bolt pockets."""
    site = new_site([(4.5, 124)], 36.0, 110, Axis(576_802.3, 5_930_719.6, 2.8, 0.2, 1 / 700, 0.015))
    section = site.section
    rings = _road_tube(site, (section.crown - 3.4, section.crown + 3.4), 2.0, 0.2)
    kerb(site, True, 0.8, 0.18)
    conduit(site, section.s_at(4.2, True), 0.03, 0.02, BLACK)
    places = marks.bolt_pockets(site, rings, 0.05)
    weeping = 0
    for index in site.rng.permutation(len(places)):
        u, s = places[index]
        outline = shapes.on_wall(shapes.pocket(site.rng, (0.14, 0.2, 0.26)[weeping]), u, s, site.down(s))
        if abs(s - section.crown) > 1.0 and site.free(outline, 0.3):
            site.add_leak(Leak(outline, (5.5, 6.8, 4.6)[weeping], 0.04, "bolt pocket", 0.1))
            weeping += 1
            if weeping == 3:
                break
    site.scatter_leaks(["interrupted drip"] * 4, (0.8, 2.4), (4.5, 7.0), (2.4, section.lining - 2.4))
    site.scatter_leaks(["drip", "patch", "curtain", "patch", "drip", "wet crack", "patch"], (0.16, 2.6), (3.0, 8.0))
    marks.repairs(site, 9)
    scanner = Profiler(-0.2, 2.5, 0.020, 0.0048, 1.3)
    return Job(site, scanner, Optics(Instrument(constant=31.5, near=2.2), Law(0.30, 0.08), -4.3))


def dry_dirty() -> Job:
    """Scene 11: everything that is no leak."""
    site = new_site([(3.6, 130)], 36.0, 111, Axis(561_333.8, 5_938_905.1, -6.7, 2.75, 0.0, -0.004), dust=-0.9)
    section = site.section
    marks.soot(site, 1.6, 0)
    rings = _road_tube(site, (section.crown - 2.3, section.crown + 2.3), 2.0, 0.2)
    kerb(site, True, 0.8, 0.2)
    conduit(site, section.s_at(3.9, False), 0.03, 0.022, BLACK)
    conduit(site, section.s_at(1.0, False), 0.04, 0.045, GALVANISED)
    marks.bolt_pockets(site, rings, 0.05)
    marks.washing(site, 2.7)
    marks.repairs(site, 9)
    marks.salts(site, 0.02, 4.0)
    marks.soot(site, 0.0, 5)
    scanner = Stations(((3.8, 0.4, 1.8), (12.6, -0.3, 1.76), (21.5, 0.4, 1.8), (30.6, -0.4, 1.77)), 0.0025, 0.027, 16.0)
    return Job(site, scanner, Optics(Instrument(constant=30.0, has_reference=False), Law(0.26, 0.09), -4.4))
