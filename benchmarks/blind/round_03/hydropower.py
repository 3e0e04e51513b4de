"""Two tunnels of a hydropower plant: an emptied waterway, and the gallery of a penstock."""

from __future__ import annotations

import numpy as np

from ..scene import Scene
from . import dirt, linings
from .alignment import Alignment
from .arrays import smooth_line, smooth_step
from .canvas import Canvas, Stain
from .equipment import Bar, Fixture, Series, Tube
from .files import maker
from .furniture import cabinet, cables, lamps, pipe, places, tray
from .instrument import Instrument, Law
from .profile import Profile, circle, horseshoe
from .scanners import Profiler, Stations
from .shapes import Blob, Foot, Joined, Line, Rect, Ring, Runs
from .survey import Build
from .tracing import Tunnel

_WATERLINE = 3.1


def _biofilm(canvas: Canvas) -> None:
    """Black film of manganese below the water line of operation, scoured in places, and the bright line of lime at its top."""
    depth = np.abs(canvas.a)[None, :]
    line = canvas.profile.arc_of_height(_WATERLINE) + 0.03 * smooth_line(canvas.rng, canvas.shape[0], 150.0)[:, None]
    below = smooth_step((depth - line) / 0.06 + 0.5)
    film = below * np.clip(1.0 + 0.25 * canvas.noise(1.5, 0.15) + 0.2 * canvas.noise(0.3, 0.2), 0.2, 1.6)
    canvas.albedo -= (2.3 * film * canvas.wall()).astype(np.float32)
    lime = np.exp(-(((depth - line + 0.06) / 0.035) ** 2)) * np.clip(0.6 + 0.5 * canvas.noise(0.3, 0.1), 0.0, 1.5)
    canvas.albedo += (1.4 * lime).astype(np.float32)
    foot = canvas.profile.foot
    for columns in (np.flatnonzero((canvas.a > -foot) & (canvas.a < 0)), np.flatnonzero((canvas.a >= 0) & (canvas.a < foot))):
        part = slice(int(columns[0]), int(columns[-1]) + 1)
        canvas.stains.append(Stain("manganese film", slice(0, canvas.shape[0]), part, (depth > line)[:, part]))


def _waterway_lining(profile: Profile) -> Canvas:
    canvas = Canvas(profile, 34.0, np.random.default_rng(30601))
    linings.concrete(canvas, 1.0)
    linings.formwork(canvas, 1.5, 1.02, -0.8, 0.3)
    linings.blow_holes(canvas, 12.0, 0.9)
    linings.block_joints(canvas, (5.0, 11.0, 17.0, 23.0, 29.0), -2.5)
    _biofilm(canvas)
    linings.floor(canvas, -11.0, 0.003)
    canvas.gloss[:, np.abs(canvas.a) > profile.half - 0.55] += np.float32(0.3)
    dirt.dry_cracks(canvas, 12, 2.0, -1.0)
    at = profile.arc_of_height
    for s, arc, rx, ry in ((7.6, at(3.9), 0.5, 0.4), (20.2, -at(4.2), 0.7, 0.3), (26.4, 0.7, 0.5, 0.5)):
        canvas.stain("manganese", Blob(rx, ry, 0.35, 0.3), s, arc, -2.4, 0.05, uneven=0.3)
    for s, arc in ((9.0, at(4.4)), (14.2, -at(4.0)), (31.6, at(4.2))):
        canvas.stain("dry streak", Runs(1.1, 0.1, 0.0, 1, 0.05), s, arc, -2.0, 0.03)
    canvas.stain("scoured", Blob(1.6, 0.35, 0.3, 0.4), 15.6, at(1.4), 2.2, 0.06)
    canvas.stain("scoured", Blob(1.1, 0.3, 0.3, 0.4), 27.8, -at(1.6), 2.0, 0.06)
    dirt.repairs(canvas, ((3.2, at(4.0), 0.9, 0.6, -1.8), (24.6, -at(2.2), 1.2, 0.5, 2.4), (12.6, -0.6, 0.5, 0.7, 1.6)))
    # plugs of grouting holes, three in each ring
    for s in places(2.0, 3.0, 11):
        for arc in (-at(3.9), 0.0, at(3.9)):
            canvas.stain(None, Blob(0.06, 0.06, 0.1, 0.1), s, arc + 0.02, 1.5, 0.01)
    return canvas


def _waterway_leaks(canvas: Canvas) -> None:
    at = canvas.profile.arc_of_height
    canvas.leak("wet joint", Ring(2.6, 0.08, 0.4), 11.0, at(4.7), 6.6, 0.03, gloss=0.08)
    canvas.leak("wet joint", Ring(2.0, 0.1, 0.45), 23.0, -at(3.7), 4.2, 0.035, gloss=0.06)
    canvas.leak("wet joint", Ring(1.6, 0.07, 0.6), 17.0, 0.2, 4.6, 0.03)
    crack = Line(((-2.0, 0.1), (-0.8, 0.0), (0.4, -0.12), (1.3, 0.05), (2.1, 0.0)), 0.06)
    canvas.leak(
        "wet crack",
        Joined(((0.0, 0.0, crack), (-0.5, 0.05, Runs(1.1, 0.16, 1.2, 4, 0.06)))),
        20.0,
        at(3.6),
        5.2,
        0.03,
        soft_low=0.08,
    )
    canvas.leak("grout hole", Runs(1.5, 0.16, 0.0, 1, 0.16), 8.0, -at(3.9), 5.0, 0.03, soft_low=0.08, fringe=1.6)
    canvas.leak("grout hole", Blob(0.3, 0.35, 0.3), 26.0, at(3.9), 4.4, 0.035, fringe=2.2)
    canvas.leak("patch in film", Blob(0.8, 0.5, 0.3), 5.8, at(2.2), 3.6, 0.05, gloss=0.05)
    canvas.leak("patch in film", Blob(0.55, 0.7, 0.35, 0.3), 30.6, -at(2.0), 4.0, 0.05, gloss=0.05)
    canvas.leak("drip", Blob(0.3, 0.25, 0.3), 3.6, -0.5, 5.4, 0.03, fringe=2.0)
    canvas.leak("patch", Blob(0.9, 0.5, 0.3), 28.6, -0.9, 2.6, 0.1)


def _waterway_build() -> Build:
    profile = circle(2.6, 26.0)
    canvas = _waterway_lining(profile)
    _waterway_leaks(canvas)
    fixtures: list[Fixture] = cables(profile, (profile.arc_of_height(3.5),), 34.0, 0.012, 0.04, 0.05, -2.0)
    for arc in (-1.9, 1.9):
        u, v, turn = profile.point(arc, 0.03)
        fixtures.append(Bar(u, v, 0.06, 0.06, turn, Series(4.0, 0.06, 6.0, 5), -1.0))
    fixtures += cabinet(profile, -profile.arc_of_height(3.4), 18.4, 0.3, 0.4, 0.1)
    stations = ((3.4, 0.1, 1.55), (12.2, -0.15, 1.5), (21.4, 0.1, 1.57), (30.4, 0.0, 1.52))
    return Build(
        tunnel=Tunnel(Alignment((387655.2, 5162893.7, 1421.5), 14.0, 0.0, -0.003), canvas, tuple(fixtures)),
        scanner=Stations(stations, 2.2e-3, 2300.0, 11.0, -50.0),
        instrument=Instrument(
            constant=30.0, near=2.2, law=Law(24.0, 0.1, 0.15), speckle=0.45, weak=0.6, threshold=13.0, saturation=41.0
        ),
        seed=30602,
        outliers=0.001,
        has_reference=False,
        axis_height=2.6,
    )


def _gallery_lining(profile: Profile) -> Canvas:
    canvas = Canvas(profile, 38.0, np.random.default_rng(30801))
    linings.concrete(canvas, 1.0)
    linings.boards(canvas, 0.12, 0.35)
    linings.blow_holes(canvas, 8.0, 0.8)
    linings.block_joints(canvas, (6.0, 14.0, 22.0, 30.0), -2.5)
    linings.floor(canvas, -1.0, 0.003)
    at = profile.arc_of_height
    dirt.lamp_halos(canvas, places(4.0, 6.0, 6), 0.35, -1.9, 0.55)
    dirt.old_traces(canvas, 12, -1.6)
    dirt.dry_cracks(canvas, 10, 1.4, -1.0)
    dirt.foot_dust(canvas, -0.8, 0.2)
    dirt.bracket_streaks(canvas, (5.9, 13.4, 19.4, 29.9), at(2.5), -1.7, 0.6)
    dirt.repairs(canvas, ((9.6, -at(3.2), 0.7, 0.5, -1.8), (25.4, -at(2.4), 0.9, 0.7, 1.7), (33.2, at(3.6), 0.5, 0.4, -1.6)))
    canvas.stain("oil", Runs(0.9, 0.3, 0.5, 3, 0.1), 17.4, -at(1.9), -2.6, 0.03)
    canvas.stain("gravel nest", Blob(0.7, 0.12, 0.35, 0.15), 27.6, at(3.4), -2.2, 0.02, uneven=0.5)
    canvas.stain("lime crust", Blob(0.3, 0.5, 0.35, 0.15), 14.2, -at(3.6), 2.2, 0.03, uneven=0.4)
    canvas.stain("chainage board", Rect(0.5, 0.25), 20.4, -at(2.6), 2.6, 0.01, covered=True)
    return canvas


def _gallery_leaks(canvas: Canvas) -> None:
    at, foot = canvas.profile.arc_of_height, canvas.profile.foot
    canvas.leak("behind tray", Runs(2.2, 0.22, 0.7, 4, 0.12), 7.8, at(3.2), 4.6, 0.03, soft_low=0.08)
    canvas.leak("behind tray", Blob(0.6, 0.55, 0.3), 24.0, at(2.2), 4.2, 0.05)
    canvas.leak(
        "wet joint", Joined(((0.0, 0.0, Ring(2.6, 0.06, 0.45)), (0.0, 1.6, Runs(0.9, 0.16, 0.2, 2)))), 14.0, 0.3, 4.8, 0.025
    )
    canvas.leak("wet joint", Ring(2.2, 0.08, 0.4), 30.0, -at(3.7), 4.0, 0.03)
    canvas.leak("above pipe", Runs(1.8, 0.2, 0.9, 4, 0.1), 11.0, -at(3.0), 4.4, 0.03, soft_low=0.07)
    canvas.leak("foot seepage", Foot(2.6, 0.4, 0.35), 19.0, foot, 3.8, 0.05)
    canvas.leak("drip", Blob(0.3, 0.22, 0.25), 4.2, -0.6, 4.8, 0.03, fringe=2.0)
    canvas.leak("drip", Runs(1.0, 0.12, 0.0, 1, 0.14), 34.2, 0.8, 4.6, 0.025, soft_low=0.06, gloss=0.08)
    canvas.leak("patch", Blob(0.8, 0.45, 0.3), 27.4, -1.2, 3.4, 0.08, core=0.3)
    canvas.leak("salt fringe", Blob(0.5, 0.4, 0.3, 0.2), 36.0, -at(2.7), 3.2, 0.03, fringe=2.4)
    faint = "1.3 dB among boards whose tones differ as much, with a rim of a hand's breadth"
    canvas.leak("damp patch", Blob(0.45, 0.5, 0.3, 0.4), 17.0, 1.6, 1.3, 0.15, uneven=0.3, limit=faint)


def _gallery_build() -> Build:
    profile = horseshoe(2.1, 2.1)
    canvas = _gallery_lining(profile)
    _gallery_leaks(canvas)
    at = profile.arc_of_height
    fixtures: list[Fixture] = [
        Tube(-1.35, 0.85, 0.45, Series(-1.0, 40.0), 0.5, 0.25),
        Tube(-1.35, 0.85, 0.52, Series(5.0, 0.12, 12.0, 3), -0.5, 0.2),
        Bar(-1.35, 0.2, 0.7, 0.4, 0.0, Series(2.0, 0.4, 6.0, 6), 0.0),
    ]
    for height in (2.5, 2.15, 1.8):
        fixtures += tray(profile, at(height), 38.0, 0.08, 0.2, 1.5)
        u, v, _ = profile.point(at(height), 0.2)
        fixtures.append(Bar(u, v, 0.03, 0.3, 1.5708, Series(-1.0, 40.0), -3.0, 0.1))
    fixtures += pipe(profile, at(0.5), 38.0, 0.05, 0.08, -1.0)
    fixtures += lamps(profile, 0.35, 4.0, 6.0, 6, (0.6, 0.12, 0.1), 0.06)
    fixtures += cabinet(profile, -at(2.3), 22.8, 0.5, 0.6, 0.2)
    return Build(
        tunnel=Tunnel(Alignment((596318.9, 5188241.0, 1003.8), 203.0, 0.0, 0.03), canvas, tuple(fixtures)),
        scanner=Profiler(0.15, 1.75, 0.0145, 760, 100.0, sway=0.01, facets=1, blind=30.0),
        instrument=Instrument(
            constant=22.0,
            near=1.4,
            law=Law(22.0, 0.1, 0.12),
            speckle=0.5,
            saturation=36.0,
            drift=(0.6, 0.6, 0.0),
            jump=(0.36, 0.5),
            step=0.1,
            beam=0.4e-3,
        ),
        seed=30802,
        outliers=0.0015,
        axis_height=2.0,
    )


WATERWAY = Scene(
    name="emptied-waterway-circle",
    lining="cast",
    phenomenon="film of manganese below the water line, wet joints and cracks on both sides of it, no reference",
    description=(
        "Free-flow tunnel of a power plant, emptied for inspection: below the line of operation a black dry film, at "
        "its top a line of lime, water on the invert. Ground water comes in through ring joints, a crack along the "
        "tunnel and plugs of grouting holes."
    ),
    make=maker(_waterway_build),
)
GALLERY = Scene(
    name="penstock-gallery",
    lining="cast",
    phenomenon="narrow gallery: leaks above and beside the penstock, behind three tiers of cable ladders",
    description=(
        "Board-marked gallery with a penstock on saddles and ladders of cables close before the wall; trolley "
        "profiler from 1 to 3 m, whose gain drifts and steps. Leaks are cut up by the shadows of the equipment."
    ),
    make=maker(_gallery_build),
)
