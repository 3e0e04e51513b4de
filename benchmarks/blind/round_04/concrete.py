"""Cast linings of the sixties, sprayed relinings, a frame under the railway."""

from __future__ import annotations

import numpy as np

from . import kit
from .build import Ground, Spec
from .geometry import Axis, Bar, Material, Section, Tube, arcs, box
from .linings import cast, dust, shotcrete, soot, washed, wavy
from .optics import Law
from .sheet import Sheet, Stain, blob, foot, joined, line, rect, runs
from .trace import Box, Profiler, Static

ASPHALT = Ground(-8.5, 0.7, 0.003, 0.02, 0.0)


def cast_with_sheet() -> Spec:
    """Cast vault of 1966 before a plastic sheet down to the springing: leaks at block joints, cracks and the sheet's foot."""
    sec = Section(
        arcs(6.2, [(3.0, 60), (4.2, 30), (7.5, 30)], -0.4),
        [(2.67, -0.05), (2.2, -0.05), (2.0, -0.25), (1.5, -0.2), (-1.5, -0.2), (-2.1, -0.28), (-2.57, -0.3)],
    )
    left, right = sec.left, sec.right

    def dress(sheet: Sheet, rng: np.random.Generator) -> None:
        cast(sheet, rng, 8.0, 2.5, 0.14)
        wavy(sheet, rng, 0.006, 3.5)
        soot(sheet, rng, 1.8, 1.5)
        dust(sheet, rng, 1.5, 0.6)
        washed(sheet, rng, 0.5)

    leaks = [
        Stain(
            "block joint",
            6.0,
            joined(line([(10.5, -3.9), (10.52, -1.0)], 0.24), runs(10.5, -3.0, 2.2, 0.25, 0.8)),
            rim=0.05,
            ragged=0.05,
            film=0.4,
        ),
        Stain("block joint", 4.6, line([(18.5, 1.2), (18.48, 3.0), (18.5, 5.0)], 0.22), rim=0.06, ragged=0.045, film=0.2),
        Stain(
            "wet crack",
            4.2,
            line([(12.3, 0.5), (13.1, 0.2), (13.9, 0.45), (14.9, 0.1), (15.6, 0.3)], 0.18),
            rim=0.06,
            ragged=0.04,
        ),
        Stain(
            "sheet's foot",
            4.0,
            joined(foot(19.5, 25.3, right(-0.05), 0.85), runs(22.0, right(1.9), 1.8, 0.3, 0.6)),
            rim=0.12,
            ragged=0.06,
            fade=-0.25,
        ),
        Stain(
            "springing joint",
            4.8,
            joined(
                rect(4.2, 7.6, left(1.62), left(1.48)), runs(5.2, left(1.6), 1.2, 0.3, 0.6), runs(6.8, left(1.6), 0.9, 0.2, 0.5)
            ),
            rim=0.05,
            ragged=0.04,
            fade=0.15,
        ),
        Stain("patch", 3.6, blob(22.6, -2.0, 0.75, 0.55), rim=0.16, ragged=0.08, fade=0.1),
        Stain("drip", 5.4, blob(7.2, 0.2, 0.26, 0.22), rim=0.04, ragged=0.03, film=0.5),
        Stain("behind cables", 4.4, runs(14.6, right(3.4), 2.4, 0.4, 0.9), rim=0.08, ragged=0.06, fade=0.2),
        Stain("tie hole", 4.6, runs(16.4, left(2.6), 1.1, 0.16, 0.28), rim=0.03, ragged=0.02),
        Stain("damp", 1.9, blob(25.6, left(3.2), 0.7, 0.6), rim=0.25, ragged=0.09),
    ]
    others = [
        Stain("laitance", -1.7, rect(8.0, 9.3, left(4.4), left(2.0)), rim=0.12, ragged=0.08, mottle=0.3),
        Stain("injected crack", 1.9, line([(24.0, 2.9), (24.6, 1.6), (24.5, 0.4)], 0.09), rim=0.02, ragged=0.012),
        Stain("honeycomb", 2.1, blob(4.4, right(2.7), 0.6, 0.3), rim=0.05, ragged=0.08, mottle=0.4),
        Stain("repair mortar", 1.9, rect(11.6, 12.5, left(3.3), left(2.4)), rim=0.012, ragged=0.006, mottle=0.1),
        Stain("repair mortar", -2.0, rect(20.4, 21.2, left(2.3), left(1.8)), rim=0.012, ragged=0.006, mottle=0.1),
        Stain("lime crust", -2.6, runs(18.5, -1.4, 2.6, 0.1, 0.4), rim=0.06, ragged=0.05, mottle=0.35, fade=0.4),
        Stain("bleached runs", -1.5, runs(2.5, 2.2, 3.0, 0.15, 0.6), rim=0.08, ragged=0.05, mottle=0.3),
        Stain("form oil", 2.2, blob(16.6, right(4.6), 0.9, 0.45), rim=0.25, ragged=0.1, mottle=0.25),
        *kit.rust_below(sec, 1, 1.9, [8.0, 17.0, 23.0], 0.7),
        *kit.number(13.2, left(1.8)),
    ]
    return Spec(
        seed=40405,
        axis=Axis(704312.0, 5201288.0, 968.4, 1.35, radius=-320.0, slope=0.015),
        section=sec,
        length=28.0,
        dress=dress,
        law=Law(32.0, near=2.4, speckle=0.35, beam=3e-4),
        scan=Static([(2.9, 0.4, 1.6), (10.6, 0.3, 1.6), (18.2, 0.45, 1.58), (25.6, 0.3, 1.6)], 0.0044),
        level=-4.6,
        rough=0.3,
        gloss=0.01,
        leaks=leaks,
        others=others,
        along=[
            *kit.rails(0.0),
            *kit.cables(sec, 1, 1.9, [0.03, 0.03, 0.02, 0.02]),
            Tube(0.0, 5.2, 0.011, kit.STEEL),
            Tube(*sec.off_wall(-1, 0.6, 0.09), 0.055, kit.ZINC),
        ],
        boxes=[
            *kit.hooks(sec, 1, 2.08, 0.5, 28.0, 1.5, 0.5),
            *kit.lamps(sec, -1, 2.9, [3.0, 15.0, 27.0]),
            Box(14.0, 0.05, 0.12, 0.12, 0.95, kit.ZINC),
            Box(20.9, right(1.2), 0.55, 0.7, 0.22, kit.GREY, gap=0.02),
        ],
    )


def drained_shotcrete() -> Spec:
    """Old stone vault sprayed over in 1978, its water in half pipes under the spray: wet at their edges, where they clog."""
    sec = Section(
        arcs(6.5, [(4.1, 62), (5.0, 28), (9.0, 30)], -0.5),
        [(3.9, -0.3), (3.4, -0.2), (0.5, -0.2), (-0.5, -0.2), (-3.4, -0.2), (-3.9, -0.3)],
    )
    left, right = sec.left, sec.right

    def dress(sheet: Sheet, rng: np.random.Generator) -> None:
        shotcrete(sheet, rng)
        wavy(sheet, rng, 0.006, 2.4)
        soot(sheet, rng, 1.4, 2.6)
        dust(sheet, rng, 1.2, 0.8)
        washed(sheet, rng, 0.4)
        for s in (6.2, 14.8, 23.1):
            strip = np.exp(-(((sheet.s - s - 0.05 * np.sin(sheet.l)) / 0.13) ** 2))
            sheet.relief -= 0.015 * strip
            sheet.light += 0.5 * strip

    leaks = [
        Stain(
            "drain's edge",
            2.9,
            joined(line([(6.4, -5.6), (6.42, -3.2), (6.38, -1.4)], 0.22), blob(6.5, -4.3, 0.3, 0.5)),
            rim=0.10,
            ragged=0.05,
        ),
        Stain(
            "clogged drain",
            3.8,
            joined(line([(14.7, 3.4), (14.8, 6.6)], 0.4), runs(14.9, 3.6, 3.2, 0.4, 1.1)),
            rim=0.08,
            ragged=0.07,
            film=0.3,
        ),
        Stain("patch", 2.8, blob(10.2, 1.4, 0.9, 0.7), rim=0.2, ragged=0.09),
        Stain("runs", 3.4, runs(18.4, -2.4, 3.3, 0.25, 0.8, -0.15), rim=0.07, ragged=0.06, fade=0.25, film=0.3),
        Stain("drip", 3.5, blob(21.0, -0.4, 0.3, 0.26), rim=0.05, ragged=0.035, film=0.4),
        Stain("shrinkage crack", 2.6, line([(25.4, 2.2), (25.9, 3.1), (25.7, 4.0), (26.3, 4.9)], 0.17), rim=0.05, ragged=0.035),
        Stain("rising damp", 2.2, foot(8.0, 13.0, left(-0.28), 0.75), rim=0.16, ragged=0.07, fade=-0.35),
        Stain("behind cables", 2.9, blob(20.2, right(2.3), 0.75, 0.65), rim=0.12, ragged=0.08),
        Stain(
            "drain's edge",
            2.5,
            joined(line([(22.85, 0.6), (22.88, 2.6)], 0.2), blob(22.8, 2.2, 0.22, 0.4)),
            rim=0.08,
            ragged=0.045,
        ),
        Stain("drip", 2.6, blob(3.0, 2.9, 0.34, 0.3), rim=0.1, ragged=0.05),
        Stain(
            "damp",
            0.7,
            blob(27.4, -3.4, 0.6, 0.5),
            rim=0.25,
            ragged=0.08,
            limit="At this wavelength damp darkens the spray less than its own clouds do.",
        ),
    ]
    others = [
        Stain("young shotcrete", -1.6, rect(0.4, 2.6, -2.6, 0.8), rim=0.1, ragged=0.1, mottle=0.2),
        Stain("dark shotcrete", 1.7, rect(15.8, 17.4, -5.4, -3.9), rim=0.06, ragged=0.09, mottle=0.2),
        Stain("soot plume", 1.9, blob(12.8, 1.9, 1.3, 0.5), rim=0.5, ragged=0.12),
        Stain("lime crust", -1.9, runs(23.1, -3.4, 2.2, 0.15, 0.5), rim=0.07, ragged=0.06, mottle=0.35, fade=0.3),
        Stain("dry tide mark", 1.2, runs(9.0, right(4.6), 1.9, 0.4, 0.6), rim=0.1, ragged=0.06, fade=0.4),
        Stain("rebound, dusty", 1.3, foot(22.0, 27.0, right(-0.1), 0.5), rim=0.15, ragged=0.07, mottle=0.3),
        *kit.rust_below(sec, 1, 2.0, [4.5, 12.0, 25.5], 0.6),
        *kit.rust_below(sec, -1, 3.6, [9.5], 0.9),
        *kit.number(19.4, left(1.7)),
    ]
    return Spec(
        seed=40406,
        axis=Axis(631777.0, 5222094.0, 803.2, 2.7, radius=520.0, slope=-0.008),
        section=sec,
        length=30.0,
        dress=dress,
        law=Law(29.0, near=1.6, power=1.9, speckle=0.5, beam=4.5e-4, step=0.05, range_noise=0.0015),
        scan=Profiler(-1.7, 2.6, 0.0175, 1560),
        level=-4.2,
        rough=0.5,
        leaks=leaks,
        others=others,
        along=[
            *kit.rails(-1.9, 1.9),
            *kit.cables(sec, 1, 2.0, [0.03, 0.03, 0.025]),
            Bar(*sec.off_wall(-1, 3.4, 0.2), 0.08, 0.22, kit.ZINC, -0.1),
            Tube(-1.9, 5.25, 0.011, kit.STEEL),
            Tube(1.9, 5.25, 0.011, kit.STEEL),
            Bar(3.75, -0.2, 0.45, 0.2, kit.CONCRETE),
        ],
        boxes=[
            *kit.hooks(sec, 1, 2.12, 0.0, 30.0, 1.5, 0.4),
            *kit.lamps(sec, -1, 2.8, [5.0, 17.0, 29.0]),
            Box(7.7, right(1.2), 0.5, 0.6, 0.2, kit.GREY, gap=0.03),
        ],
        ground=Ground(tracks=(-1.9, 1.9)),
        mixed=0.4,
    )


def salt_underpass() -> Spec:
    """Road frame of 1963 under a station: salt and damp at the foot of the walls, slab joints that drip in thaw, rust."""
    sec = Section(box(9.2, 4.75, 0.25, 0.12), [(3.4, 0.12), (3.38, 0.0), (-3.38, 0.0), (-3.4, 0.12)])
    left, right = sec.left, sec.right

    def dress(sheet: Sheet, rng: np.random.Generator) -> None:
        cast(sheet, rng, 7.0, 4.0, 0.11)
        wavy(sheet, rng, 0.005, 3.0)
        soot(sheet, rng, 1.3, 3.4)
        dust(sheet, rng, 1.1, 0.7)
        washed(sheet, rng, 0.5)

    leaks = [
        Stain(
            "slab joint",
            5.6,
            joined(line([(11.0, -3.9), (11.02, -1.0), (10.98, 1.4)], 0.26), blob(11.0, -2.1, 0.5, 0.35)),
            rim=0.05,
            ragged=0.05,
            film=0.4,
        ),
        Stain("joint, wall", 5.0, runs(11.0, right(4.2), 3.3, 0.22, 0.75), rim=0.05, ragged=0.05, fade=0.2, film=0.3),
        Stain("salt damp", 3.2, foot(2.4, 8.2, -sec.end, 0.75), rim=0.10, ragged=0.07, fade=-0.35, mottle=0.2),
        Stain("salt damp", 2.7, foot(13.0, 17.8, sec.end, 0.6), rim=0.12, ragged=0.06, fade=-0.3, mottle=0.2),
        Stain("wet crack", 4.2, line([(5.2, 1.4), (6.1, 0.9), (6.9, 1.2), (7.8, 0.7)], 0.16), rim=0.05, ragged=0.035, film=0.2),
        Stain("patch under tray", 4.6, blob(15.2, -2.0, 0.8, 0.7), rim=0.09, ragged=0.07),
        Stain("drip at lamp", 5.0, blob(7.35, -0.1, 0.35, 0.3), rim=0.05, ragged=0.04, film=0.4),
        Stain(
            "haunch",
            4.4,
            joined(rect(17.2, 19.9, left(4.66), left(4.52)), runs(18.3, left(4.5), 1.3, 0.3, 0.6)),
            rim=0.06,
            ragged=0.04,
        ),
        Stain("downpipe leaks", 4.8, blob(4.3, right(2.2), 0.35, 1.0), rim=0.08, ragged=0.06),
        Stain("drip", 4.0, blob(19.4, 2.7, 0.26, 0.22), rim=0.05, ragged=0.03),
        Stain("damp", 1.8, blob(13.4, left(2.4), 0.7, 0.55), rim=0.25, ragged=0.09),
    ]
    others = [
        Stain(
            "salt bloom",
            -2.2,
            foot(2.0, 8.8, -sec.end, 1.05).difference(foot(2.4, 8.2, -sec.end, 0.75)),
            rim=0.08,
            ragged=0.06,
            mottle=0.35,
        ),
        Stain("splash, dry", -1.3, foot(15.4, 20.5, -sec.end, 0.7), rim=0.2, ragged=0.08, mottle=0.3),
        Stain(
            "graffito",
            3.6,
            joined(line([(8.7, left(1.3)), (9.0, left(2.3)), (9.4, left(1.3)), (9.8, left(2.3)), (10.3, left(1.4))], 0.13)),
            rim=0.02,
            ragged=0.006,
            mottle=0.08,
        ),
        Stain("graffito painted over", -1.9, rect(13.2, 15.6, right(2.5), right(1.1)), rim=0.015, ragged=0.02, mottle=0.08),
        Stain("bare bars", 2.4, joined(rect(17.0, 18.2, 0.9, 1.3)), rim=0.04, ragged=0.06, mottle=0.4),
        Stain("repair mortar", 2.0, rect(1.4, 2.3, -1.8, -0.9), rim=0.012, ragged=0.006, mottle=0.1),
        Stain("exhaust soot", 2.3, blob(9.2, 1.9, 1.1, 0.5), rim=0.4, ragged=0.1),
        Stain("tyre rubber", 2.6, rect(17.6, 20.0, right(0.62), right(0.5)), rim=0.02, ragged=0.02, mottle=0.2),
        Stain("sealed joint", 2.8, line([(18.0, 0.2), (18.0, 4.2)], 0.1), rim=0.015, ragged=0.005, mottle=0.08),
        *kit.rust_below(sec, -1, 3.6, [12.4, 20.6], 0.9),
        *kit.rust_below(sec, 1, 3.2, [3.9, 19.4], 0.4),
    ]
    pipe = Material(-6.0, 0.2, 0.05)
    return Spec(
        seed=40407,
        axis=Axis(688051.0, 5239710.0, 527.6, -0.45, slope=-0.012),
        section=sec,
        length=22.0,
        dress=dress,
        law=Law(30.0, near=1.9, speckle=0.3, beam=2.5e-4),
        scan=Static([(3.0, 0.8, 1.5), (10.8, -1.0, 1.5), (18.6, 0.6, 1.5)], 0.0035),
        level=-4.8,
        rough=0.32,
        gloss=0.012,
        leaks=leaks,
        others=others,
        along=[
            Bar(-2.1, 4.42, 0.3, 0.05, kit.ZINC),
            Tube(-2.15, 4.47, 0.02, kit.BLACK),
            *kit.cables(sec, 1, 3.9, [0.02]),
        ],
        boxes=[
            *(Box(s, 0.0, 1.3, 0.22, 0.12, kit.LAMP, gap=0.05) for s in (2.0, 8.0, 14.0, 20.0)),
            Box(4.3, right(2.3), 0.11, 4.0, 0.11, pipe, gap=0.04),
            Box(16.8, right(2.0), 0.7, 0.7, 0.03, kit.PLATE, gap=0.04),
            *(Box(s, -2.1, 0.04, 0.34, 0.3, kit.ZINC) for s in (1.5, 6.5, 11.7, 16.5, 21.5)),
        ],
        ground=ASPHALT,
    )
