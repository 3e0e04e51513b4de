"""Two motorway tunnels of cast concrete, driven with a profiler."""

from __future__ import annotations

import numpy as np

from ..scene import Scene
from . import dirt, linings
from .alignment import Alignment
from .canvas import Canvas
from .equipment import Fixture, Series, Tube
from .files import maker
from .furniture import cabinet, cables, lamps, pipe, places, tray
from .instrument import Instrument, Law
from .profile import Profile, horseshoe, three_centred
from .scanners import Profiler
from .shapes import Blob, Foot, Joined, Line, Ring, Runs
from .survey import Build
from .tracing import Tunnel


def _fans_lining(profile: Profile) -> Canvas:
    canvas = Canvas(profile, 26.0, np.random.default_rng(30101))
    linings.concrete(canvas, 1.1)
    linings.formwork(canvas, 2.0, 1.25, -0.8, 0.25)
    linings.blow_holes(canvas, 14.0, 0.8, 3.6)
    linings.painted(canvas, 3.4, 0.18, 2.6, 0.12)
    linings.block_joints(canvas, (4.0, 14.0, 24.0))
    linings.floor(canvas, -4.5, lines=(0.1, 3.6))
    dirt.soot(canvas, 2.2, 6.5)
    dirt.splash(canvas, 2.6, 1.1)
    dirt.lamp_halos(canvas, places(2.5, 5.0, 5), -3.6, -1.7, 0.9)
    for arc in (-1.3, 1.3):
        dirt.fan_halo(canvas, 16.0, arc, -2.8, 2.6)
    dirt.bracket_streaks(canvas, (1.9, 7.9, 10.9, 18.4, 21.4), 3.35, -1.8, 0.7)
    dirt.old_traces(canvas, 9, -1.3)
    dirt.dry_cracks(canvas, 8, 2.0)
    dirt.marks(canvas, 3, 1.6, -3.0)
    low = profile.arc_of_height(1.5)
    dirt.repairs(canvas, ((6.3, -low, 0.7, 0.5, -2.2), (19.0, low - 1.9, 0.9, 0.6, 1.6), (11.0, 4.6, 0.5, 0.8, -1.8)))
    return canvas


def _fans_leaks(canvas: Canvas) -> None:
    at, foot = canvas.profile.arc_of_height, canvas.profile.foot
    canvas.leak("wet joint", Ring(3.3, 0.075, 0.4), 4.0, -at(5.3), 5.2, 0.025, core=0.1, gloss=0.05)
    canvas.leak(
        "wet joint",
        Joined(((0.0, 0.0, Ring(2.4, 0.06, 0.5)), (0.05, 0.9, Runs(1.7, 0.2, 0.25, 2)))),
        14.0,
        at(4.6),
        5.8,
        0.03,
        soft_low=0.08,
        gloss=0.06,
    )
    canvas.leak("behind tray", Runs(2.5, 0.22, 0.9, 4, 0.14), 8.9, 2.9, 7.6, 0.03, soft_low=0.1, gloss=0.08)
    canvas.leak("patch in grime", Blob(0.55, 0.4, 0.3), 17.6, -0.9, 4.6, 0.06)
    canvas.leak("curtain", Runs(1.5, 0.2, 1.9, 6, 0.1), 20.2, -at(4.4), 5.0, 0.03, soft_low=0.1)
    canvas.leak("foot seepage", Foot(2.6, 0.42), 8.0, foot, 4.4, 0.05, core=0.15)
    canvas.leak("drip", Blob(0.24, 0.22, 0.2), 22.6, 0.7, 5.5, 0.03, fringe=2.2)
    canvas.leak("damp patch", Blob(0.95, 0.6, 0.25, 0.5), 10.2, -5.2, 2.1, 0.16, uneven=0.25)
    crack = Line(((-0.9, -0.5), (-0.3, -0.2), (0.2, 0.35), (0.75, 0.6)), 0.07)
    canvas.leak("wet crack", crack, 22.0, at(2.9), 4.2, 0.03)


def _fans_build() -> Build:
    profile = three_centred(6.2, 40.0, 4.6, 7.2, (1.0, 0.18))
    canvas = _fans_lining(profile)
    _fans_leaks(canvas)
    fixtures: list[Fixture] = tray(profile, 3.2, 26.0, 0.4, 0.3)
    fixtures += cables(profile, (3.12, 3.2, 3.28), 26.0, 0.018, 0.37, 0.0)
    fixtures += lamps(profile, -3.6, 2.5, 5.0, 5, (0.8, 0.35, 0.2), 0.25)
    fixtures += [Tube(u, 6.15, 0.55, Series(9.4, 4.0), -1.0, 0.3) for u in (-1.3, 1.3)]
    fixtures += [Tube(u, 6.78, 0.03, Series(9.9, 0.06, 2.8, 2), -2.0) for u in (-1.3, 1.3)]
    fixtures += cabinet(profile, profile.arc_of_height(1.5), 12.4, 0.7, 0.9, 0.25)
    fixtures += cabinet(profile, -profile.arc_of_height(2.6), 16.8, 0.6, 0.6, 0.08, 1.5)
    return Build(
        tunnel=Tunnel(Alignment((563412.4, 5273318.7, 512.3), 41.0, 1.0 / 650.0, 0.012), canvas, tuple(fixtures)),
        scanner=Profiler(1.7, 2.6, 0.0112, 1350, 180.0, facets=2),
        instrument=Instrument(
            constant=31.0,
            near=1.2,
            law=Law(22.0, 0.15, 0.12),
            speckle=0.5,
            facets=(0.14, -0.14),
            drift=(0.35, 1.3, 0.1),
            step=0.1,
        ),
        seed=30102,
        outliers=0.0012,
        axis_height=2.8,
    )


def _winter_lining(profile: Profile) -> Canvas:
    canvas = Canvas(profile, 24.0, np.random.default_rng(30701))
    linings.concrete(canvas, 1.2)
    linings.formwork(canvas, 2.4, 1.2, -0.9, 0.3)
    linings.blow_holes(canvas, 30.0, 1.0, 3.0)
    linings.block_joints(canvas, (2.5, 12.5, 22.5), -3.5)
    linings.floor(canvas, -4.0, lines=(0.08, 3.4))
    dirt.soot(canvas, 1.5, 5.0)
    dirt.splash(canvas, 2.4, 1.6)
    dirt.washed(canvas, 2.9, 0.3, 0.8, 0.7)
    dirt.old_traces(canvas, 8, -1.2)
    dirt.dry_cracks(canvas, 14, 1.6, -1.3)
    dirt.bracket_streaks(canvas, (3.9, 9.9, 15.9, 18.9), profile.arc_of_height(3.4), -2.0, 1.0)
    wall = profile.arc_of_height(1.6)
    dirt.repairs(canvas, ((5.2, wall, 1.1, 0.8, 1.8), (9.0, -wall + 0.8, 0.6, 0.4, -2.4), (19.5, -4.0, 1.4, 0.35, -1.7)))
    # honeycombs at the cold joint between two pours
    for s, width in ((7.0, 0.5), (15.2, 0.8)):
        canvas.stain("honeycomb", Blob(width, 0.14, 0.35, 0.15), s, -profile.arc_of_height(2.4), -2.4, 0.02, uneven=0.5)
    canvas.stain("lime crust", Blob(0.35, 0.6, 0.35, 0.2), 17.2, 2.2, 2.4, 0.04, uneven=0.4)
    canvas.stain("old tide mark", Blob(0.8, 0.5, 0.2), 10.6, 3.9, -1.1, 0.06)
    dirt.foot_dust(canvas, -1.0, 0.15)
    return canvas


def _winter_leaks(canvas: Canvas) -> None:
    at, foot = canvas.profile.arc_of_height, canvas.profile.foot
    canvas.leak("foot seepage", Foot(4.2, 0.55, 0.35), 6.0, foot, 4.8, 0.06, core=0.2, gloss=0.05)
    canvas.leak("foot seepage", Foot(1.7, 0.35, 0.3), 17.0, foot, 4.0, 0.04, fringe=1.8)
    canvas.leak("foot seepage", Foot(3.0, 0.75, 0.35), 14.4, -foot, 6.8, 0.05, core=0.25, gloss=0.08)
    canvas.leak("foot seepage", Foot(1.2, 0.3, 0.3), 20.6, -foot, 2.7, 0.04)
    joint = Joined(((0.0, 0.0, Ring(3.6, 0.07, 0.5)), (0.0, 3.5, Blob(0.5, 0.35, 0.3))))
    canvas.leak("wet joint", joint, 12.5, at(5.6), 5.6, 0.03, gloss=0.06)
    canvas.leak("wet joint", Ring(2.2, 0.09, 0.35), 22.5, -at(4.2), 4.2, 0.04)
    canvas.leak("behind pipe", Runs(1.5, 0.25, 0.6, 3, 0.12), 8.6, -at(2.2), 5.0, 0.03, soft_low=0.09)
    canvas.leak("salt fringe", Blob(0.6, 0.45, 0.3, 0.25), 3.8, -3.4, 3.4, 0.03, fringe=2.8, core=-0.2)
    canvas.leak("salt fringe", Blob(0.35, 0.7, 0.25), 20.3, at(3.9), 4.0, 0.035, fringe=2.4)
    canvas.leak("drip", Runs(1.6, 0.13, 0.0, 1, 0.16), 15.4, 1.2, 5.2, 0.025, soft_low=0.07)
    canvas.leak("curtain", Runs(1.4, 0.2, 1.6, 5, 0.09), 18.0, -at(4.9), 4.6, 0.04, soft_low=0.12)
    faint = "1.4 dB over a soft rim of half a metre on cloudy concrete: nobody draws it without a moisture meter"
    canvas.leak("damp patch", Blob(0.8, 0.7, 0.3, 0.6), 8.2, 1.9, 1.4, 0.25, uneven=0.3, limit=faint)


def _winter_build() -> Build:
    profile = horseshoe(5.0, 2.2, 0.0, (0.9, 0.25))
    canvas = _winter_lining(profile)
    _winter_leaks(canvas)
    at = profile.arc_of_height
    fixtures: list[Fixture] = pipe(profile, -at(1.9), 24.0, 0.06, 0.12, -1.5)
    fixtures += tray(profile, at(3.5), 24.0, 0.25, 0.16)
    fixtures += cables(profile, (at(3.35), at(3.27)), 24.0, 0.022, 0.1, 0.02)
    fixtures += lamps(profile, 4.6, 1.5, 4.0, 6, (1.2, 0.22, 0.16), 0.2)
    fixtures += cabinet(profile, at(1.5), 10.8, 0.9, 1.1, 0.3, 1.0)
    fixtures += cabinet(profile, -at(1.3), 16.4, 0.5, 0.7, 0.22, -1.0)
    fixtures += cables(profile, (-at(1.15), -at(0.75)), 24.0, 0.02, 0.2, 0.0, 0.0)
    return Build(
        tunnel=Tunnel(Alignment((498731.2, 5247905.5, 1184.6), 312.0, 0.0, -0.008), canvas, tuple(fixtures)),
        scanner=Profiler(2.3, 2.4, 0.0125, 1500, 120.0, yaw=40.0, facets=4),
        instrument=Instrument(
            constant=33.0,
            near=2.2,
            ripple=0.15,
            law=Law(30.0, 0.1, 0.15),
            speckle=0.7,
            weak=0.8,
            threshold=7.0,
            saturation=40.0,
            step=0.25,
            beam=0.5e-3,
            exit_size=0.006,
            range_noise=0.003,
            facets=(0.25, -0.05, -0.3, 0.1),
            drift=(0.3, 0.7, 0.3),
        ),
        seed=30702,
        outliers=0.003,
        axis_height=2.8,
    )


FANS = Scene(
    name="motorway-jet-fans",
    lining="cast",
    phenomenon="grime of jet fans, tray on the haunch, wet joints",
    description=(
        "Three-centred vault with painted walls, profiler with two facets and a slow drift. Jet fans hide the crown "
        "and blow soot on it; lamps have halos; water comes from block joints, from behind the cable tray and at the "
        "walkway, as manuals of road tunnel inspection show it."
    ),
    make=maker(_fans_build),
)
WINTER = Scene(
    name="portal-zone-tilted-profiler",
    lining="cast",
    phenomenon="seepage at the foot of the wall, salt fringes, four facets, saturation near by",
    description=(
        "Unpainted vault near the portal, splashed with salt water. Damp rises at the construction joint above the "
        "walkway, behind pipe, handrail and hydrants. Plane of profiles turned by 40 degrees, pulse scanner with a "
        "wide beam and coarse amplitudes."
    ),
    make=maker(_winter_build),
)
