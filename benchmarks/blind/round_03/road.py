"""Two city tunnels: a box with enamel panels, and an old tiled vault without any leak."""

from __future__ import annotations

import numpy as np

from ..scene import Scene
from . import dirt, linings
from .alignment import Alignment
from .canvas import Canvas
from .equipment import Bar, Fixture, Series, Tube
from .files import maker
from .furniture import cabinet, cables, lamps, pipe, places, tray
from .instrument import Instrument, Law
from .profile import Profile, box, horseshoe
from .scanners import Profiler, Stations
from .shapes import Blob, Foot, Joined, Line, Rect, Ring, Runs
from .survey import Build
from .tracing import Tunnel


def _panel_lining(profile: Profile) -> Canvas:
    canvas = Canvas(profile, 24.0, np.random.default_rng(30201))
    linings.concrete(canvas, 1.1)
    linings.formwork(canvas, 3.0, 1.5, -1.0, 0.3)
    linings.block_joints(canvas, (8.0, 16.0), -4.5, 0.003)
    linings.blow_holes(canvas, 10.0, 0.8)
    linings.panels(canvas, 3.7, 0.95, 1.5, 0.12, 1.6, 1.2)
    linings.floor(canvas, -4.5, lines=(0.08, 3.3))
    dirt.soot(canvas, 1.6, 4.0)
    dirt.splash(canvas, 3.0, 1.5)
    dirt.washed(canvas, 3.7, 0.95, 0.7, 0.9)
    for arc in (-2.2, 2.2):
        dirt.lamp_halos(canvas, places(1.6, 3.0, 8), arc, -1.5, 0.6)
    dirt.old_traces(canvas, 7, -1.3)
    dirt.dry_cracks(canvas, 10, 2.2, -1.2)
    dirt.repairs(canvas, ((13.0, 3.0, 0.8, 1.1, -1.9), (2.2, -1.2, 0.6, 0.6, 1.5), (21.6, 0.2, 1.0, 0.5, -1.6)))
    # resin of old injections along the joint, lime below a joint that was sealed
    canvas.stain("resin", Rect(0.22, 1.6, 0.015), 8.05, -2.6, -2.3, 0.015, covered=True, gloss=0.15)
    canvas.stain("lime crust", Blob(0.3, 0.5, 0.35, 0.15), 15.8, -3.1, 2.3, 0.03, uneven=0.4)
    canvas.stain("poster", Rect(0.8, 1.2), 18.2, profile.arc_of_height(2.2), 1.2, 0.01, covered=True)
    return canvas


def _panel_leaks(canvas: Canvas) -> None:
    at, foot = canvas.profile.arc_of_height, canvas.profile.foot
    canvas.leak("wet joint", Ring(3.3, 0.08, 0.45), 8.0, 0.3, 5.4, 0.025, gloss=0.06)
    haunch = Joined(((0.0, 0.0, Ring(1.9, 0.09, 0.4)), (0.02, 0.5, Runs(1.2, 0.18, 0.4, 3))))
    canvas.leak("wet joint", haunch, 16.0, at(3.72) - 2.0, 5.0, 0.03)
    canvas.leak("wet joint", Ring(0.6, 0.13, 0.3), 16.0, at(0.9), 4.2, 0.04)
    canvas.leak("salt fringe", Blob(0.75, 0.5, 0.3, 0.3), 4.6, -2.9, 4.2, 0.035, fringe=2.6, core=-0.15)
    canvas.leak("wet crack", Line(((-1.5, 0.0), (-0.3, 0.12), (0.6, -0.05), (1.7, 0.08)), 0.07), 19.5, 1.4, 4.4, 0.03)
    canvas.leak("curtain", Runs(1.3, 0.22, 1.8, 5, 0.14), 12.2, -at(3.74) + 1.3, 7.4, 0.03, soft_low=0.07, gloss=0.05)
    canvas.leak("foot seepage", Foot(3.2, 0.5, 0.3), 20.0, -foot, 4.6, 0.05)
    canvas.leak("foot seepage", Foot(1.5, 0.55, 0.25), 5.0, foot, 3.8, 0.04)
    canvas.leak("run on panel", Runs(2.3, 0.16, 0.1, 2, 0.1), 10.5, at(3.55), 3.2, 0.02, soft_low=0.05)
    canvas.leak("drip", Blob(0.22, 0.26, 0.25), 14.2, -0.4, 5.0, 0.03, fringe=1.8)
    canvas.leak("drip", Blob(0.45, 0.3, 0.3), 22.4, 2.9, 2.8, 0.04)


def _panel_build() -> Build:
    profile = box(4.9, 5.2, 0.5, (0.6, 0.25))
    canvas = _panel_lining(profile)
    _panel_leaks(canvas)
    fixtures: list[Fixture] = tray(profile, 0.75, 24.0, 0.4, 0.3, 2.0)
    fixtures += pipe(profile, -1.0, 24.0, 0.06, 0.15, -2.0)
    for arc in (-2.2, 2.2):
        fixtures += lamps(profile, arc, 1.6, 3.0, 8, (1.3, 0.25, 0.15), 0.12)
    fixtures += [Bar(0.0, 4.75, 0.9, 0.25, 0.0, Series(11.2, 0.3), -3.0, 0.1)]
    fixtures += cabinet(profile, profile.arc_of_height(1.9), 21.6, 0.8, 1.2, 0.42, 1.0)
    fixtures += cables(profile, (-3.9, -4.0), 24.0, 0.02, 0.08, 0.015)
    return Build(
        tunnel=Tunnel(Alignment((691204.3, 5334770.9, 508.9), 97.0, 0.0, -0.02), canvas, tuple(fixtures)),
        scanner=Stations(((3.6, -1.2, 1.75), (12.1, 0.9, 1.72), (20.3, -0.8, 1.78)), 2.0e-3, 2150.0, 15.0),
        instrument=Instrument(
            constant=32.0,
            near=2.6,
            ripple=0.12,
            law=Law(20.0, 0.15, 0.12),
            speckle=0.45,
            weak=0.6,
            saturation=43.0,
            drift=(0.15, 1.5, 0.2),
            step=0.02,
        ),
        seed=30202,
        outliers=0.001,
        axis_height=2.4,
    )


def _tile_lining(profile: Profile) -> Canvas:
    canvas = Canvas(profile, 28.0, np.random.default_rng(30501))
    at = profile.arc_of_height
    linings.concrete(canvas, 1.2)
    linings.painted(canvas, 6.0, 3.3, 1.0, 0.0)
    linings.block_joints(canvas, (7.0, 14.0, 21.0), -2.5, 0.003)
    linings.tiles(canvas, 3.2, 0.2, 0.15, 2.0, 1.0)
    linings.floor(canvas, -4.0, lines=(0.1, 3.0))
    dirt.soot(canvas, 3.0, 4.6)
    dirt.splash(canvas, 2.6, 1.0)
    dirt.washed(canvas, 3.1, 0.4, 0.9, 0.75)
    dirt.lamp_halos(canvas, places(2.0, 4.0, 7), -2.6, -2.6, 0.9)
    dirt.lamp_halos(canvas, places(4.0, 4.0, 6), 2.6, -2.2, 0.8)
    dirt.fan_halo(canvas, 19.0, 0.3, -3.2, 3.0)
    dirt.bracket_streaks(canvas, places(0.95, 1.5, 17), at(3.95), -2.4, 0.9)
    dirt.bracket_streaks(canvas, places(2.0, 4.0, 7), -2.9, -1.8, 1.2)
    dirt.old_traces(canvas, 16, -2.0)
    dirt.dry_cracks(canvas, 12, 1.8, -1.2)
    for s, arc, width, height in (
        (3.3, at(1.9), 0.6, 0.45),
        (9.3, at(1.2), 0.9, 0.6),
        (16.5, -at(2.4), 0.45, 0.75),
        (24.2, -at(1.4), 1.2, 0.3),
        (12.0, -at(0.8), 0.3, 0.45),
    ):
        canvas.stain("missing tiles", Rect(width, height, 0.01), s, arc, -3.6, 0.01, uneven=0.25, covered=True)
    dirt.repairs(canvas, ((6.2, -at(2.0), 1.05, 0.75, 2.6), (20.4, at(2.2), 0.6, 0.9, -1.6), (23.0, 3.0, 1.2, 0.7, -2.0)))
    canvas.stain("bitumen", Rect(0.5, 2.4, 0.02), 14.0, at(4.9), -4.2, 0.02, covered=True)
    canvas.stain("bitumen", Rect(0.35, 1.3, 0.02), 21.0, -at(5.4), -3.6, 0.02, covered=True)
    canvas.stain("scorched vault", Blob(1.6, 0.9, 0.25, 0.8), 10.5, -1.0, -3.4, 0.3, uneven=0.2)
    canvas.stain("tyre scuff", Blob(2.2, 0.12, 0.3, 0.4), 18.0, at(0.55), -2.6, 0.03, uneven=0.3)
    canvas.stain(
        "graffito",
        Joined(((0.0, 0.0, Line(((-0.7, 0.2), (-0.4, -0.3), (-0.1, 0.25), (0.3, -0.3), (0.7, 0.2)), 0.05, 0.15)),)),
        26.0,
        at(1.7),
        -3.0,
        0.015,
    )
    return canvas


def _tile_build() -> Build:
    profile = horseshoe(4.6, 2.4, 0.0, (0.8, 0.2))
    canvas = _tile_lining(profile)
    at = profile.arc_of_height
    fixtures: list[Fixture] = tray(profile, at(4.1), 28.0, 0.3, 0.2)
    fixtures += cables(profile, (at(4.1) - 0.08, at(4.1) + 0.05), 28.0, 0.02, 0.26, 0.0)
    fixtures += cables(profile, (-at(4.3), -at(4.2), -at(4.12)), 28.0, 0.016, 0.07, 0.03)
    fixtures += lamps(profile, -2.6, 2.0, 4.0, 7, (1.0, 0.3, 0.18), 0.2)
    fixtures += lamps(profile, 2.6, 4.0, 4.0, 6, (1.0, 0.3, 0.18), 0.2)
    fixtures += [Tube(0.3, 6.1, 0.4, Series(12.8, 3.0), -1.5, 0.3)]
    fixtures += cabinet(profile, at(1.5), 13.0, 0.9, 1.0, 0.28, 0.0)
    fixtures += cabinet(profile, -at(2.3), 7.9, 1.0, 0.5, 0.06, 2.0)
    return Build(
        tunnel=Tunnel(Alignment((566120.8, 5934406.2, -8.4), 171.0, -1.0 / 420.0, 0.0), canvas, tuple(fixtures)),
        scanner=Profiler(-1.2, 2.2, 0.0115, 1250, 150.0, facets=3),
        instrument=Instrument(
            constant=29.0,
            near=1.0,
            law=Law(18.0, 0.2, 0.13),
            speckle=0.5,
            saturation=38.0,
            facets=(0.2, -0.1, -0.1),
            drift=(0.5, 0.8, 0.6),
            jump=(0.57, -0.8),
            step=0.1,
        ),
        seed=30502,
        outliers=0.0015,
        axis_height=2.8,
    )


PANELS = Scene(
    name="underpass-enamel-panels",
    lining="panels",
    phenomenon="wet joints and cracks of the roof, water behind and over enamelled panels",
    description=(
        "Box of cut and cover with enamelled panels hung before its walls, washed in stripes, shining where the beam "
        "meets them square. Expansion joints leak at the roof and the haunch, water comes out again below the panels "
        "and in one place runs over them. Three stations of a phase scanner."
    ),
    make=maker(_panel_build),
)
TILES = Scene(
    name="old-tiled-vault-dirty",
    lining="tiles",
    phenomenon="no leak: soot, halos, washing stripes, missing tiles, bitumen, dry streaks, step of gain",
    description=(
        "Tiled city tunnel which is dry. Exhaust on the vault, halos of lamps and of the fan, rust streaks below "
        "brackets, beds of missing tiles, bitumen on old joints, a scorched place; the profiler's gain drifts and "
        "steps down by 0.8 dB past the middle."
    ),
    make=maker(_tile_build),
)
