"""Vaults of brick and of dressed stone."""

from __future__ import annotations

import numpy as np

from . import kit
from .build import Ground, Spec
from .geometry import Axis, Bar, Section, Tube, arcs
from .linings import brick, cloud, dust, soot, stone, washed, wavy
from .optics import Law
from .sheet import Sheet, Stain, blob, foot, joined, line, rect, runs
from .trace import Box, Icicle, Profiler, Static


def brick_rings() -> Spec:
    """Single-track vault of 1884 in three rings of brick, steamed for seventy years, thawing in March."""
    sec = Section(arcs(5.85, [(2.75, 90), (9.0, 40)], -0.45), [(1.75, -0.28), (1.5, -0.2), (-1.5, -0.2), (-1.75, -0.3)])
    left, right = sec.left, sec.right

    def dress(sheet: Sheet, rng: np.random.Generator) -> None:
        brick(sheet, rng)
        wavy(sheet, rng, 0.006, 2.8)
        cloud(sheet, rng, 0.55, 1.3, 4)
        soot(sheet, rng, 2.6, 1.7)
        dust(sheet, rng, 1.4, 0.5)
        washed(sheet, rng, 0.5)

    leaks = [
        Stain("runs", 5.5, runs(4.6, -2.0, 2.6, 0.3, 0.75, 0.1), rim=0.06, ragged=0.05, fade=0.25, film=0.4),
        Stain("drip", 6.5, blob(8.7, 0.25, 0.42, 0.34), rim=0.05, ragged=0.05, film=0.5),
        Stain("bed joint", 5.0, joined(rect(10.2, 12.1, 3.0, 3.13), runs(11.0, 3.0, 1.2, 0.25, 0.45)), rim=0.04, ragged=0.025),
        Stain("patch behind cable", 4.2, blob(14.0, right(2.35), 0.65, 0.6), rim=0.10, ragged=0.06, fade=-0.2),
        Stain("rising damp", 3.0, foot(16.6, 20.6, -sec.end, 0.75), rim=0.14, ragged=0.05, fade=-0.3),
        Stain(
            "wet ring joint",
            5.2,
            line([(21.2, -2.9), (21.25, -1.2), (21.18, 0.4), (21.22, 2.4)], 0.2),
            rim=0.04,
            ragged=0.04,
            film=0.3,
        ),
        Stain(
            "patch", 4.6, joined(blob(24.4, left(2.9), 0.5, 0.4), runs(24.5, left(2.8), 1.1, 0.5, 0.2)), rim=0.12, ragged=0.06
        ),
        Stain("salt fringe", 5.0, blob(19.0, right(3.1), 0.34, 0.45), rim=0.05, ragged=0.04),
        Stain("drip", 4.0, blob(26.7, 1.3, 0.25, 0.2), rim=0.04, ragged=0.025),
        Stain(
            "damp",
            1.1,
            blob(14.2, -0.9, 0.6, 0.5),
            rim=0.25,
            ragged=0.08,
            limit="A breath of damp in the soot of the crown, weaker than the soot's own clouds.",
        ),
        Stain("niche edge", 5.4, runs(22.55, right(2.6), 1.7, 0.22, 0.4), rim=0.05, ragged=0.035, film=0.2),
    ]
    others = [
        Stain(
            "efflorescence",
            -2.4,
            blob(19.0, right(3.1), 0.68, 0.8).difference(blob(19.0, right(3.1), 0.34, 0.45)),
            rim=0.15,
            ragged=0.07,
            mottle=0.3,
        ),
        Stain("efflorescence", -2.6, runs(7.3, 2.2, 1.6, 0.15, 0.5), rim=0.08, ragged=0.05, mottle=0.35, fade=0.4),
        Stain("repointed", -1.4, rect(1.6, 3.6, right(3.6), right(1.6)), rim=0.04, ragged=0.04, mottle=0.3),
        Stain("engineering brick", 2.1, rect(25.6, 27.2, right(3.4), right(2.3)), rim=0.012, ragged=0.025, mottle=0.1),
        Stain("dry tide mark", 1.6, runs(12.6, -2.1, 1.9, 0.5, 0.7), rim=0.10, ragged=0.06, fade=0.4),
        Stain("soot plume", 2.3, blob(17.4, 0.2, 1.1, 0.55), rim=0.5, ragged=0.1),
        *kit.rust_below(sec, 1, 2.2, [5.0, 17.0], 0.45),
        *kit.number(9.6, left(1.7)),
    ]
    return Spec(
        seed=40401,
        axis=Axis(652118.0, 5236402.0, 871.3, 0.62, slope=0.011),
        section=sec,
        length=29.0,
        dress=dress,
        law=Law(30.0, near=2.1, speckle=0.4),
        scan=Static([(3.2, 0.25, 1.55), (11.0, -0.2, 1.6), (18.8, 0.2, 1.52), (26.4, 0.3, 1.6)], 0.00455),
        level=-6.0,
        rough=0.42,
        leaks=leaks,
        others=others,
        along=[
            *kit.rails(0.0),
            *kit.cables(sec, 1, 2.2, [0.02, 0.028]),
            *kit.cables(sec, -1, 0.55, [0.045], kit.GREY),
        ],
        boxes=[
            *kit.hooks(sec, 1, 2.27, 1.0, 29.0, 2.0, 0.26),
            *kit.lamps(sec, -1, 2.5, [5.9, 15.9, 25.2], 0.4),
            Box(23.4, right(0.95), 1.3, 2.2, 0.8, kit.NICHE, sunk=True),
            Box(7.2, right(1.5), 0.5, 0.35, 0.02, kit.PLATE, gap=0.03),
        ],
    )


def ashlar_curve() -> Spec:
    """Double-track vault of dressed limestone and gneiss in a curve; stones of every colour, wet where the lime is gone."""
    sec = Section(
        arcs(6.7, [(4.0, 58), (5.2, 32), (11.0, 30)], -0.55),
        [(3.91, -0.35), (3.55, -0.22), (0.7, -0.2), (0.0, -0.28), (-0.7, -0.2), (-3.55, -0.22), (-3.91, -0.35)],
    )
    left, right = sec.left, sec.right

    def dress(sheet: Sheet, rng: np.random.Generator) -> None:
        stone(sheet, rng, 1.0)
        wavy(sheet, rng, 0.006, 3.0)
        cloud(sheet, rng, 0.5, 1.8, 4)
        soot(sheet, rng, 1.8, 1.6, -1.9)
        soot(sheet, rng, 1.8, 1.6, 1.9)
        dust(sheet, rng, 1.6, 0.6)
        washed(sheet, rng, 0.7)

    leaks = [
        Stain("runs", 6.2, runs(3.6, right(5.4), 3.4, 0.35, 0.9, 0.15), rim=0.07, ragged=0.06, fade=0.3, film=0.5),
        Stain("patch", 4.8, joined(blob(7.6, -2.6, 0.9, 0.6), runs(7.3, -2.8, 2.2, 0.5, 0.3)), rim=0.12, ragged=0.08, film=0.2),
        Stain(
            "crown joint",
            6.0,
            joined(rect(11.0, 14.2, -0.12, 0.08), blob(12.0, 0.05, 0.35, 0.3)),
            rim=0.05,
            ragged=0.04,
            film=0.3,
        ),
        Stain("drip", 5.6, blob(16.6, 1.9, 0.28, 0.24), rim=0.04, ragged=0.03, film=0.4),
        Stain("patch behind cables", 4.4, blob(11.8, right(2.1), 0.8, 0.7), rim=0.10, ragged=0.08, fade=-0.25),
        Stain("rising damp", 3.2, foot(17.4, 23.0, sec.end, 0.7), rim=0.15, ragged=0.06, fade=-0.3),
        Stain(
            "runs",
            5.0,
            joined(runs(20.6, left(4.6), 2.8, 0.2, 0.5), runs(21.2, left(4.4), 2.2, 0.2, 0.4, -0.25)),
            ragged=0.05,
            fade=0.2,
        ),
        Stain("tide mark", 3.6, blob(25.2, 2.7, 0.7, 0.6), rim=0.08, ragged=0.07, fade=-0.2),
        Stain(
            "damp stone",
            1.5,
            blob(15.6, left(2.9), 0.45, 0.35),
            rim=0.10,
            ragged=0.03,
            limit="Two damp stones, no darker than their dry neighbours of gneiss.",
        ),
        Stain(
            "wet joints",
            4.5,
            joined(rect(5.5, 6.9, left(1.9), left(1.78)), rect(6.1, 6.24, left(1.9), left(1.2))),
            rim=0.04,
            ragged=0.03,
        ),
        Stain("patch", 3.4, blob(23.6, -1.5, 0.55, 0.4), rim=0.2, ragged=0.07),
    ]
    others = [
        Stain("lime crust", -3.0, runs(9.6, right(4.6), 2.0, 0.15, 0.55), rim=0.08, ragged=0.05, mottle=0.35, fade=0.3),
        Stain(
            "tide rim", -1.8, blob(25.2, 2.7, 1.0, 0.9).difference(blob(25.2, 2.7, 0.7, 0.6)), rim=0.12, ragged=0.07, mottle=0.3
        ),
        Stain("concrete repair", -1.8, rect(0.6, 2.3, left(3.2), left(1.5)), rim=0.012, ragged=0.01, mottle=0.15),
        Stain("dark mortar", 2.6, rect(18.0, 19.1, right(3.6), right(2.9)), rim=0.02, ragged=0.03, mottle=0.15),
        Stain("gneiss course", 2.4, rect(9.0, 10.1, left(2.75), left(2.4)), rim=0.012, ragged=0.004, mottle=0.12),
        Stain("gneiss course", 2.2, rect(13.7, 14.3, right(4.1), right(3.8)), rim=0.012, ragged=0.004, mottle=0.12),
        Stain("soot plume", 2.0, blob(19.2, -1.9, 1.4, 0.5), rim=0.5, ragged=0.1),
        Stain("moss, dry", 2.3, foot(2.6, 4.8, -sec.end, 0.9), rim=0.08, ragged=0.06, mottle=0.3),
        *kit.rust_below(sec, 1, 1.8, [6.0, 15.0, 24.0], 0.6),
        *kit.number(17.3, left(1.8)),
    ]
    return Spec(
        seed=40402,
        axis=Axis(676540.0, 5218833.0, 1104.6, 2.1, radius=290.0, slope=-0.018),
        section=sec,
        length=27.0,
        dress=dress,
        law=Law(33.0, near=2.6, power=1.95, speckle=0.45, beam=2.5e-4),
        scan=Static([(2.8, 1.9, 1.6), (10.2, -1.8, 1.65), (17.4, 1.9, 1.6), (24.6, -1.7, 1.6)], 0.0039, reach=20.0),
        level=-5.2,
        rough=0.45,
        leaks=leaks,
        others=others,
        along=[
            *kit.rails(-1.9, 1.9),
            *kit.cables(sec, 1, 1.8, [0.03, 0.022, 0.04]),
            Bar(-3.75, -0.22, 0.42, 0.2, kit.CONCRETE),
            Tube(-1.9, 5.3, 0.011, kit.STEEL),
            Tube(1.9, 5.3, 0.011, kit.STEEL),
        ],
        boxes=[
            *kit.hooks(sec, 1, 1.95, 0.8, 27.0, 1.5, 0.42),
            *kit.lamps(sec, -1, 2.8, [4.5, 19.5]),
            Box(13.5, -1.9 * 1.06, 0.12, 0.12, 1.0, kit.ZINC),
            Box(13.5, 1.9 * 1.06, 0.12, 0.12, 1.0, kit.ZINC),
            Box(8.9, right(1.3), 0.6, 0.45, 0.2, kit.GREY, gap=0.03),
        ],
        ground=Ground(tracks=(-1.9, 1.9)),
        drift=0.2,
    )


def dry_brick() -> Spec:
    """Brick vault on a dry south slope: soot, patches of other brick, old lime, bitumen, paint, rust; not a drop of water."""
    sec = Section(
        arcs(6.1, [(2.3, 42), (3.4, 48), (8.0, 45)], -0.4), [(1.96, -0.28), (1.5, -0.2), (-1.5, -0.2), (-1.96, -0.28)]
    )
    left, right = sec.left, sec.right

    def dress(sheet: Sheet, rng: np.random.Generator) -> None:
        brick(sheet, rng, 0.9, 1.5)
        wavy(sheet, rng, 0.007, 2.5)
        cloud(sheet, rng, 0.8, 1.6, 4)
        soot(sheet, rng, 4.0, 1.5)
        dust(sheet, rng, 2.2, 0.7)
        washed(sheet, rng, 1.3)

    others = [
        Stain("soot plume", 3.0, blob(5.4, 0.1, 1.6, 0.8), rim=0.6, ragged=0.12),
        Stain("soot plume", 3.4, blob(21.0, -0.3, 1.3, 0.7), rim=0.5, ragged=0.15),
        Stain("dark mortar", 3.2, rect(8.1, 9.6, right(3.4), right(2.2)), rim=0.02, ragged=0.03, mottle=0.12),
        Stain(
            "dark mortar", 2.6, line([(13.2, right(4.9)), (13.6, right(3.7)), (13.4, right(2.4))], 0.22), rim=0.03, ragged=0.03
        ),
        Stain("engineering brick", 2.6, rect(15.2, 17.9, left(2.3), left(0.9)), rim=0.012, ragged=0.02, mottle=0.1),
        Stain("bitumen", 5.5, runs(11.6, left(3.4), 1.5, 0.15, 0.35), rim=0.03, ragged=0.03, mottle=0.1),
        Stain("bitumen", 5.0, rect(24.3, 26.0, right(1.1), right(0.55)), rim=0.02, ragged=0.03, mottle=0.12),
        Stain("dry tide mark", 1.8, blob(19.4, right(3.6), 0.8, 0.9), rim=0.12, ragged=0.08, fade=0.3),
        Stain(
            "efflorescence",
            -2.2,
            blob(19.4, right(3.4), 1.0, 1.15).difference(blob(19.4, right(3.6), 0.8, 0.9)),
            rim=0.1,
            ragged=0.05,
        ),
        Stain("lime crust", -3.4, runs(3.0, left(4.3), 2.0, 0.2, 0.6), rim=0.07, ragged=0.06, mottle=0.35),
        Stain("limewash", -2.4, rect(22.4, 27.2, left(1.6), left(0.5)), rim=0.03, ragged=0.05, mottle=0.3),
        Stain("blistered faces", -1.5, blob(10.2, left(2.0), 0.6, 0.5), rim=0.03, ragged=0.08, mottle=0.4),
        Stain(
            "smoke of a fire",
            4.2,
            joined(blob(7.0, left(0.9), 0.5, 0.5), runs(7.0, left(0.9), -1.9, 0.6, 1.2)),
            rim=0.35,
            ragged=0.08,
            fade=-0.3,
        ),
        *kit.rust_below(sec, 1, 1.9, [2.0, 6.0, 10.0, 12.0, 18.0, 24.0], 0.8),
        *kit.number(14.1, left(1.5)),
    ]
    return Spec(
        seed=40403,
        axis=Axis(612904.0, 5176215.0, 742.0, -1.2, radius=-410.0, slope=0.006),
        section=sec,
        length=30.0,
        dress=dress,
        law=Law(28.0, near=1.8, power=1.85, speckle=0.35, step=0.1, beam=4e-4),
        scan=Profiler(0.1, 2.3, 0.0165, 1180),
        level=-6.2,
        rough=0.4,
        others=others,
        along=[*kit.rails(0.0), *kit.cables(sec, 1, 1.9, [0.032, 0.018, 0.018]), Bar(2.0, -0.2, 0.4, 0.2, kit.CONCRETE)],
        boxes=[
            *kit.hooks(sec, 1, 2.0, 2.0, 30.0, 2.0, 0.34),
            *kit.lamps(sec, -1, 2.4, [4.0, 12.8, 20.0, 28.0], 0.45),
            Box(18.9, left(0.95), 1.4, 2.1, 0.9, kit.NICHE, sunk=True),
            Box(16.0, right(1.2), 0.5, 0.7, 0.25, kit.GREY, gap=0.02),
        ],
        mixed=0.5,
    )


def ice_portal() -> Spec:
    """Portal reach of a stone tunnel in January: ice sheets on the wall, icicles, drip tins under the crown, wet about them."""
    sec = Section(arcs(5.9, [(2.65, 90), (10.0, 40)], -0.45), [(1.8, -0.28), (1.5, -0.2), (-1.5, -0.2), (-1.8, -0.28)])
    left, right = sec.left, sec.right
    rng = np.random.default_rng(77)

    def dress(sheet: Sheet, rng: np.random.Generator) -> None:
        stone(sheet, rng, 0.8, 0.007)
        wavy(sheet, rng, 0.006, 2.6)
        cloud(sheet, rng, 0.5, 1.5, 4)
        soot(sheet, rng, 1.6, 1.5)
        dust(sheet, rng, 0.8, 0.5)
        washed(sheet, rng, 0.6)

    leaks = [
        Stain(
            "ice sheet",
            8.0,
            joined(blob(4.4, left(3.6), 0.6, 0.7), runs(4.5, left(3.7), 2.9, 0.8, 0.6)),
            rim=0.03,
            ragged=0.06,
            mottle=0.22,
            film=0.8,
        ),
        Stain("icicles' root", 6.5, blob(7.8, 0.1, 0.75, 0.4), rim=0.06, ragged=0.06, film=0.6),
        Stain("runs", 5.4, runs(10.6, 2.2, 2.9, 0.25, 0.7, 0.2), rim=0.05, ragged=0.05, fade=0.3, film=0.4),
        Stain("beside a drip tin", 5.0, blob(13.3, -1.1, 0.8, 0.85), rim=0.09, ragged=0.07, film=0.2),
        Stain("patch", 4.0, blob(14.3, right(2.6), 0.7, 0.55), rim=0.16, ragged=0.07, fade=-0.2),
        Stain("ice fringe", 7.0, runs(17.0, -2.9, 1.3, 0.3, 0.2), rim=0.03, ragged=0.04, film=0.7),
        Stain(
            "icicles' root",
            6.0,
            joined(rect(18.6, 20.6, 1.0, 1.16), blob(19.5, 1.1, 0.3, 0.25)),
            rim=0.05,
            ragged=0.04,
            film=0.5,
        ),
        Stain("rising damp", 2.8, foot(8.3, 12.2, -sec.end, 0.6), rim=0.15, ragged=0.05, fade=-0.3),
        Stain(
            "thaw zone", 2.6, joined(blob(21.6, left(2.4), 0.6, 0.8), blob(22.2, left(1.7), 0.5, 0.5)), rim=0.22, ragged=0.09
        ),
        Stain("drip", 5.0, blob(16.0, 0.7, 0.24, 0.2), rim=0.04, ragged=0.03, film=0.4),
    ]
    others = [
        Stain("hoarfrost", 2.4, rect(0.2, 2.6, right(4.2), right(1.2)), rim=0.4, ragged=0.1, mottle=0.25),
        Stain("lime crust", -2.8, runs(6.1, right(4.4), 1.9, 0.15, 0.5), rim=0.08, ragged=0.05, mottle=0.35, fade=0.3),
        Stain("new stones", -1.7, rect(22.4, 23.9, right(3.0), right(1.8)), rim=0.012, ragged=0.004, mottle=0.15),
        Stain(
            "dark mortar", 2.2, line([(16.4, right(4.4)), (17.0, right(3.0)), (17.3, right(1.8))], 0.2), rim=0.03, ragged=0.03
        ),
        Stain("salt bloom", -1.5, foot(18.0, 23.5, sec.end, 0.5), rim=0.15, ragged=0.06, mottle=0.3),
        *kit.rust_below(sec, 1, 1.5, [4.0, 13.0], 0.5),
        *kit.number(18.5, left(1.7)),
    ]
    under = [
        (7.8, 0.1, 0.6, 0.3, 34),
        (19.6, 1.08, 0.95, 0.06, 26),
        (4.4, left(4.4), 0.45, 0.2, 16),
        (17.0, -2.75, 0.2, 0.1, 7),
    ]
    icicles = [
        Icicle(
            s + rng.normal(0, ds * 0.55), b + rng.normal(0, dl * 0.5), rng.gamma(3.0, 0.13) + 0.08, rng.uniform(0.012, 0.035)
        )
        for s, b, ds, dl, n in under
        for _ in range(n)
    ]
    return Spec(
        seed=40404,
        axis=Axis(598377.0, 5192660.0, 1322.8, 0.05, slope=0.02),
        section=sec,
        length=24.0,
        dress=dress,
        law=Law(31.0, near=2.3, speckle=0.4, beam=3e-4),
        scan=Static([(2.4, -0.3, 1.6), (9.6, 0.3, 1.6), (16.4, -0.25, 1.55), (22.6, 0.2, 1.6)], 0.0047),
        level=-5.4,
        rough=0.42,
        leaks=leaks,
        others=others,
        along=[*kit.rails(0.0), *kit.cables(sec, 1, 1.5, [0.025, 0.025])],
        boxes=[
            *kit.hooks(sec, 1, 1.55, 1.0, 24.0, 3.0, 0.25),
            *kit.tin(sec, 13.2, -3.4, 1.2, 0.45),
            *kit.tin(sec, 20.9, -2.8, 2.8, 0.4),
            *kit.lamps(sec, -1, 2.6, [7.0, 15.4], 0.4),
        ],
        icicles=icicles,
        reference=False,
    )
