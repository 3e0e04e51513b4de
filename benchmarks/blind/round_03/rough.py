"""Two tunnels with rough walls: unlined rock with mesh, and shotcrete with drainage half-shells."""

from __future__ import annotations

import numpy as np

from ..scene import Scene
from . import dirt, linings
from .alignment import Alignment
from .canvas import Canvas
from .equipment import Bar, Fixture, Mesh, Series, Tube
from .files import maker
from .furniture import cabinet, cables, lamps, pipe
from .instrument import Instrument, Law
from .profile import Profile, horseshoe
from .scanners import Stations
from .shapes import Blob, Foot, Joined, Line, Rect, Ring, Runs
from .survey import Build
from .tracing import Tunnel

_BOLTS = ((-3.6, 2.0), (-1.2, 2.0), (1.2, 2.0), (3.6, 2.0))


def _rock_lining(profile: Profile) -> Canvas:
    canvas = Canvas(profile, 32.0, np.random.default_rng(30301))
    linings.rock(canvas, 0.6, 0.13)
    linings.floor(canvas, -1.5, 0.02, loose=0.03)
    dirt.foot_dust(canvas, 0.8, 0.4)
    # a dyke of amphibolite, lenses of mica, quartz
    for side in (-1.0, 1.0):
        # upright and oblique to the tunnel: it crosses the vault and goes down both walls
        dyke = Line(((-0.1 * side, -0.1), (1.1 * side, 2.6), (1.7 * side, 4.6), (1.8 * side, 8.5)), 0.3, 0.3)
        canvas.stain("dark dyke", dyke, 21.2, side * 0.01, -2.6, 0.04, uneven=0.2)
    for s, arc, size in ((6.5, 5.4, 0.5), (11.8, -2.2, 0.7), (28.6, 2.6, 0.6)):
        canvas.stain("mica lens", Blob(size, 0.3 * size, 0.35, lean=0.5), s, arc, -2.0, 0.04, uneven=0.3)
    canvas.stain("quartz", Line(((-1.4, -0.4), (0.0, 0.1), (1.6, 0.5)), 0.1, 0.5), 13.4, 5.6, 2.6, 0.02)
    for s, arc, rx, ry in ((5.0, -1.6, 2.2, 1.3), (17.5, 1.9, 1.8, 1.6)):
        canvas.stain("shotcrete", Blob(rx, ry, 0.18, 0.5), s, arc, 1.4, 0.05, covered=True)
    # soot of the last blasts
    canvas.stain("blast soot", Blob(0.8, 0.6, 0.3), 26.2, -6.0, -1.8, 0.2)
    dirt.marks(canvas, 5, 1.6, 2.5)
    return canvas


def _rock_leaks(canvas: Canvas) -> None:
    at, foot = canvas.profile.arc_of_height, canvas.profile.foot
    joint = Joined(((0.0, 0.0, Line(((-1.3, -0.9), (-0.2, 0.0), (0.8, 0.9)), 0.08)), (0.1, 0.2, Runs(2.0, 0.28, 0.8, 3))))
    canvas.leak("rock joint", joint, 8.6, at(3.4), 7.2, 0.04, soft_low=0.08, gloss=0.12)
    second = Joined(((0.0, 0.0, Line(((-0.8, -0.5), (0.9, 0.4)), 0.09)), (0.3, 0.1, Runs(1.3, 0.22, 0.5, 2))))
    canvas.leak("rock joint", second, 15.0, -at(3.0), 5.0, 0.04, gloss=0.1)
    canvas.leak("foot seepage", Foot(4.6, 0.6, 0.4), 19.6, foot - 0.1, 4.6, 0.08, core=0.2)
    canvas.leak("foot seepage", Foot(2.4, 0.45, 0.4), 5.2, -foot + 0.1, 3.4, 0.06)
    canvas.leak("behind mesh", Blob(0.9, 0.55, 0.35, 0.3), 11.2, 0.9, 4.6, 0.06, gloss=0.08)
    canvas.leak("behind mesh", Runs(1.5, 0.24, 0.5, 3, 0.15), 25.0, -1.0, 5.2, 0.04, soft_low=0.09)
    canvas.leak("rim of shotcrete", Runs(1.6, 0.3, 1.1, 4, 0.12), 5.4, -3.1, 5.6, 0.04, soft_low=0.1, gloss=0.1)
    canvas.leak("rim of shotcrete", Blob(0.5, 0.7, 0.3), 18.6, 3.5, 4.2, 0.05, fringe=1.6)
    canvas.leak("bolt", Runs(0.9, 0.16, 0.0, 1, 0.14), 13.0, 3.6, 4.8, 0.03, soft_low=0.06)
    canvas.leak("bolt", Blob(0.22, 0.3, 0.3), 21.0, -3.6, 4.0, 0.03)
    canvas.leak("wall patch", Blob(1.1, 0.7, 0.4, 0.4), 29.2, at(2.0), 5.0, 0.08, core=0.3, gloss=0.1)
    canvas.leak("wall patch", Blob(0.6, 0.8, 0.35, 0.3), 29.8, -at(2.6), 3.2, 0.1, uneven=0.2)


def _rock_build() -> Build:
    profile = horseshoe(3.0, 3.2)
    canvas = _rock_lining(profile)
    _rock_leaks(canvas)
    fixtures: list[Fixture] = [
        Mesh(9.0, 14.0, 0.0, 3.0, 0.09),
        Mesh(23.5, 28.0, -0.8, 2.6, 0.08),
    ]
    for arc, period in _BOLTS:
        u, v, turn = profile.point(arc, 0.02)
        fixtures.append(Bar(u, v, 0.15, 0.03, turn, Series(0.95, 0.15, period, 16), -1.0, 0.1))
    fixtures += pipe(profile, profile.arc_of_height(0.8), 32.0, 0.08, 0.3, -1.5)
    fixtures += cables(profile, (-profile.arc_of_height(2.3), -profile.arc_of_height(2.15)), 32.0, 0.02, 0.25, 0.05)
    fixtures += lamps(profile, -2.7, 3.0, 8.0, 4, (0.7, 0.15, 0.12), 0.35)
    return Build(
        tunnel=Tunnel(Alignment((412377.6, 5198042.3, 871.2), 229.0, 0.0, 0.005), canvas, tuple(fixtures)),
        scanner=Stations(((3.2, 0.3, 1.6), (11.4, -0.4, 1.66), (19.8, 0.4, 1.58), (28.3, -0.2, 1.63)), 2.3e-3, 2300.0, 12.0),
        instrument=Instrument(
            constant=31.0,
            near=2.0,
            law=Law(32.0, 0.2, 0.2),
            speckle=0.7,
            weak=0.6,
            saturation=44.0,
            step=0.01,
            range_noise=0.002,
        ),
        seed=30302,
        outliers=0.002,
        axis_height=2.6,
    )


_SHELLS = (3.4, 8.6, 13.8, 19.0, 24.2)


def _sprayed_lining(profile: Profile) -> Canvas:
    canvas = Canvas(profile, 28.0, np.random.default_rng(30401))
    linings.shotcrete(canvas, 0.0045, 0.035)
    linings.ribs(canvas, _SHELLS, 0.24, 0.07, 0.6, (0.0, profile.foot))
    linings.floor(canvas, -2.0, 0.01, loose=0.012)
    dirt.foot_dust(canvas, 0.9, 0.5)
    dirt.soot(canvas, 0.8, 3.0)
    # a smooth sealing coat on one stretch, lapped over by the next day's
    canvas.stain("sealing coat", Rect(4.2, 14.4, 0.07), 16.4, 0.0, 1.5, 0.03, uneven=0.05, covered=True)
    canvas.stain("day joint", Rect(0.14, 7.0, 0.02), 10.9, 4.0, -1.1, 0.05)
    at = profile.arc_of_height
    for s, arc in ((2.0, 3.0), (6.2, -2.6), (11.6, 5.4), (21.4, -5.0), (26.0, 3.4)):
        canvas.stain("rust", Runs(0.8, 0.09, head=0.05, wander=0.03), s, arc, -2.4, 0.03)
    for s, arc, rx, ry in ((5.6, at(2.0), 0.9, 0.5), (22.6, -at(3.2), 0.6, 0.8), (12.2, -1.6, 0.7, 0.5)):
        canvas.stain("dark accelerator batch", Blob(rx, ry, 0.2, 0.6), s, arc, -1.7, 0.12)
    canvas.stain("diesel soot", Blob(1.3, 0.6, 0.25, 0.5), 25.6, -1.9, -2.1, 0.2)
    dirt.repairs(canvas, ((7.0, at(1.6), 0.8, 0.6, 1.8),))
    dirt.marks(canvas, 6, 1.5, 2.0)
    dirt.old_traces(canvas, 8, -1.2)
    return canvas


def _sprayed_leaks(canvas: Canvas) -> None:
    at, foot = canvas.profile.arc_of_height, canvas.profile.foot
    canvas.leak("beside half-shell", Runs(2.2, 0.22, 0.3, 2, 0.15), 8.95, at(3.6), 3.4, 0.04, soft_low=0.08)
    canvas.leak("beside half-shell", Ring(2.6, 0.11, 0.4), 18.72, -at(4.0), 3.0, 0.04)
    canvas.leak(
        "end of half-shell",
        Joined(((0.0, -0.2, Blob(0.45, 0.5, 0.3)), (0.0, 0.2, Foot(1.6, 0.4)))),
        24.2,
        foot - 0.2,
        3.2,
        0.05,
    )
    canvas.leak("day joint", Ring(2.4, 0.1, 0.5, 0.05), 10.9, -2.2, 3.0, 0.04)
    canvas.leak("patch", Blob(0.7, 0.55, 0.35), 5.4, -at(3.0), 3.3, 0.06)
    canvas.leak("patch", Blob(0.5, 0.9, 0.3, 0.35), 21.8, at(2.7), 2.6, 0.08, core=0.3)
    canvas.leak("through coat", Runs(1.9, 0.15, 0.7, 4, 0.1), 15.8, at(3.9), 3.8, 0.025, soft_low=0.05)
    canvas.leak("salt fringe", Blob(0.4, 0.55, 0.3), 26.6, -at(2.3), 3.0, 0.03, fringe=2.4)
    canvas.leak("behind duct", Blob(1.1, 0.6, 0.3, 0.4), 13.2, -0.4, 3.2, 0.06)
    canvas.leak("foot seepage", Foot(3.4, 0.55, 0.35), 7.4, -foot, 3.2, 0.06)
    canvas.leak("foot seepage", Foot(1.8, 0.4, 0.3), 17.6, foot, 2.8, 0.05)


def _sprayed_build() -> Build:
    profile = horseshoe(3.6, 3.0)
    canvas = _sprayed_lining(profile)
    _sprayed_leaks(canvas)
    at = profile.arc_of_height
    fixtures: list[Fixture] = [
        Tube(-1.1, 5.55, 0.45, Series(-1.0, 30.0), 1.0, 0.1, 0.06, 3.0),
        Tube(-1.1, 5.5, 0.47, Series(1.4, 0.06, 3.0, 9), -1.0),
    ]
    fixtures += pipe(profile, at(1.2), 28.0, 0.08, 0.15, -1.0)
    fixtures += pipe(profile, at(0.9), 28.0, 0.055, 0.15, -2.0)
    fixtures += cables(profile, (-at(2.4), -at(2.25), -at(2.1)), 28.0, 0.022, 0.14, 0.06)
    fixtures += lamps(profile, 3.0, 4.0, 6.0, 4, (0.6, 0.14, 0.12), 0.2)
    fixtures += cabinet(profile, -at(1.4), 20.6, 0.7, 0.9, 0.3)
    return Build(
        tunnel=Tunnel(Alignment((634980.1, 5221467.4, 744.0), 358.0, 1.0 / 450.0, 0.01), canvas, tuple(fixtures)),
        scanner=Stations(((2.8, 0.4, 1.7), (10.4, 0.9, 1.68), (17.5, 0.2, 1.74), (25.2, 0.8, 1.7)), 2.2e-3, 2100.0, 13.0),
        instrument=Instrument(
            constant=27.0,
            near=3.0,
            ripple=0.2,
            law=Law(30.0, 0.1, 0.2),
            speckle=0.5,
            weak=0.7,
            saturation=42.0,
            drift=(0.1, 2.0, 0.4),
            step=0.05,
            beam=0.25e-3,
        ),
        seed=30402,
        outliers=0.0015,
        has_reference=False,
        axis_height=2.6,
    )


ROCK = Scene(
    name="headrace-gneiss-mesh",
    lining="rock",
    phenomenon="seepage from rock joints, behind mesh and at the rim of shotcrete",
    description=(
        "Blasted headrace tunnel in banded gneiss with a dark dyke, mica and quartz; bolts, mesh that takes part of "
        "each beam, two fields of shotcrete. Water comes from joints and bolts and along the rim of the shotcrete, as "
        "in inspections of dewatered waterways."
    ),
    make=maker(_rock_build),
)
SPRAYED = Scene(
    name="shotcrete-half-shells-785nm",
    lining="shotcrete",
    phenomenon="small drops at 785 nm, water beside drainage half-shells, ventilation duct, no reference",
    description=(
        "Tunnel under construction, primary lining with half-shells under shotcrete and one stretch with a sealing "
        "coat. At 785 nm water takes 2 to 4 dB only, rust and soot take as much. Four stations in a bend, without a "
        "curve over the range."
    ),
    make=maker(_sprayed_build),
)
