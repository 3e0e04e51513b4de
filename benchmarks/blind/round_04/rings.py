"""Rings of precast segments."""

from __future__ import annotations

import numpy as np

from . import kit
from .build import Ground, Spec
from .geometry import Axis, Material, Section, Tube, arcs
from .linings import cloud, dust, pockets, segments, soot
from .optics import Law
from .sheet import Sheet, Stain, blob, foot, joined, line, rect, runs
from .trace import Box, Static

RED_PIPE = Material(-5.5, 0.2, 0.08)


def ring_gallery() -> Spec:
    """Bored double-track tunnel of precast rings: gaskets drip at ring joints, corners and bolt pockets; thinly scanned."""
    sec = Section(
        arcs(6.3, [(4.7, 150)], -0.5),
        [(4.49, 0.25), (3.2, 0.25), (3.15, -0.2), (0.0, -0.22), (-3.15, -0.2), (-3.2, 0.25), (-4.49, 0.25)],
    )
    length, ring, count = 36.0, 1.5, 8
    left, right = sec.left, sec.right

    def dress(sheet: Sheet, rng: np.random.Generator) -> None:
        segments(sheet, rng, ring, count)
        cloud(sheet, rng, 0.35, 2.0, 3)
        soot(sheet, rng, 0.9, 2.5)
        dust(sheet, rng, 1.3, 0.9)

    leaks = [
        Stain(
            "ring joint",
            5.0,
            joined(line([(5.0, -6.2), (5.02, -2.6)], 0.24), runs(5.05, -4.4, 2.2, 0.25, 0.7)),
            rim=0.06,
            ragged=0.05,
            film=0.3,
        ),
        Stain(
            "corner",
            5.4,
            joined(blob(11.0, 2.6, 0.4, 0.35), runs(11.1, 2.7, 2.4, 0.35, 0.55, 0.1)),
            rim=0.06,
            ragged=0.05,
            fade=0.25,
            film=0.3,
        ),
        Stain("ring joint", 4.2, line([(17.0, -0.9), (17.0, 2.1)], 0.2), rim=0.05, ragged=0.045, film=0.3),
        Stain("bolt pocket", 4.8, runs(21.77, 5.05, 1.6, 0.25, 0.45), rim=0.05, ragged=0.04, fade=0.2),
        Stain(
            "segment joint", 4.4, joined(rect(23.1, 24.5, -3.0, -2.84), runs(23.9, -2.9, 1.7, 0.25, 0.5)), rim=0.06, ragged=0.04
        ),
        Stain("drip", 5.0, blob(27.5, 0.4, 0.32, 0.28), rim=0.05, ragged=0.04, film=0.5),
        Stain("patch", 3.2, blob(30.4, 3.6, 0.8, 0.65), rim=0.18, ragged=0.08),
        Stain("grout plug", 4.6, runs(32.4, -4.6, 1.9, 0.3, 0.6, 0.15), rim=0.06, ragged=0.05, fade=0.3),
        Stain("foot", 3.0, foot(12.5, 17.5, left(0.25), 0.8), rim=0.14, ragged=0.06, fade=-0.3),
        Stain("behind cables", 4.0, blob(7.6, right(2.7), 0.75, 0.7), rim=0.10, ragged=0.07),
        Stain("salt fringe", 4.2, blob(20.0, -5.0, 0.4, 0.5), rim=0.06, ragged=0.05),
    ]
    others = [
        *(
            Stain("bolt pocket", 2.6, rect(s - 0.09, s + 0.09, b - 0.11, b + 0.11), rim=0.012, ragged=0.0, mottle=0.1)
            for s, b in pockets(-4.0, length + 4.0, sec.end, ring, count)
            if 0.1 < s < length - 0.1
        ),
        Stain(
            "efflorescence",
            -2.2,
            blob(20.0, -5.0, 0.8, 0.9).difference(blob(20.0, -5.0, 0.4, 0.5)),
            rim=0.15,
            ragged=0.07,
            mottle=0.3,
        ),
        Stain("efflorescence", -2.4, line([(26.0, 2.0), (26.0, 4.8)], 0.3), rim=0.06, ragged=0.06, mottle=0.35),
        Stain("repair mortar", 1.8, rect(14.2, 14.8, 1.9, 2.3), rim=0.012, ragged=0.02, mottle=0.1),
        Stain("repair mortar", -1.7, rect(24.9, 25.5, -4.4, -4.0), rim=0.012, ragged=0.02, mottle=0.1),
        Stain("resin runs", 2.4, runs(29.05, -2.2, 1.0, 0.08, 0.22), rim=0.02, ragged=0.015, mottle=0.1),
        Stain("dark segment", 1.5, rect(18.52, 19.98, -1.1, 1.1), rim=0.012, ragged=0.0, mottle=0.15),
        *kit.rust_below(sec, 1, 2.4, [10.0, 22.0, 31.0], 0.5),
        *kit.number(16.0, left(2.6)),
    ]
    return Spec(
        seed=40408,
        axis=Axis(659426.0, 5247903.0, 611.9, 0.9, radius=850.0, slope=0.012),
        section=sec,
        length=length,
        dress=dress,
        law=Law(34.0, near=1.3, power=1.8, speckle=0.5, floor=-10.0, beam=5e-4, range_noise=0.002, phase=False),
        scan=Static([(3.5, 0.3, 1.6), (13.2, -0.4, 1.6), (22.9, 0.3, 1.65), (32.6, -0.3, 1.6)], 0.0046, reach=22.0),
        level=-4.4,
        rough=0.28,
        gloss=0.008,
        leaks=leaks,
        others=others,
        along=[
            *kit.rails(-1.95, 1.95),
            *kit.cables(sec, 1, 2.4, [0.03, 0.03, 0.02]),
            Tube(*sec.off_wall(-1, 1.5, 0.12), 0.075, RED_PIPE),
            Tube(-1.95, 5.1, 0.011, kit.STEEL),
            Tube(1.95, 5.1, 0.011, kit.STEEL),
            Tube(*sec.off_wall(-1, 3.2, 0.05), 0.02, kit.STEEL),
        ],
        boxes=[
            *kit.hooks(sec, 1, 2.52, 1.0, 36.0, 1.5, 0.4),
            *kit.lamps(sec, -1, 3.6, [6.0, 18.0, 30.0], 1.2),
            Box(25.2, right(1.6), 0.6, 0.8, 0.25, kit.GREY, gap=0.03),
        ],
        ground=Ground(level=-5.5, grain=0.5, stones=0.003, cell=0.03, tracks=(-1.95, 1.95)),
        reference=False,
    )
