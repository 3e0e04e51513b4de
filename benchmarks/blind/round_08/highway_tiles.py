"""An American highway tunnel of the 1950s: glazed tiles on its walls, a plastered ceiling slab, expansion joints."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.blind.round_08 import dressing
from benchmarks.blind.round_08.fittings import Fittings
from benchmarks.blind.round_08.scanner import Instrument, station
from benchmarks.blind.round_08.surface import Surface, smoothstep
from benchmarks.blind.round_08.survey import Survey, make
from benchmarks.blind.round_08.tunnel import Array, Axis, box_section
from benchmarks.blind.scene import Scene

LENGTH, HALF, WALL, TILE = 32.0, 4.05, 4.3, 0.108
JOINTS = (7.6, 16.75, 25.9)


def _law(reach: Array) -> Array:
    """Phase-based: beam and receiver overlap fully from 4 m on."""
    return 40.0 - 18.5 * np.log10(reach) - 2.2 * np.exp(-((reach - 1.0) / 1.5))


def _tiles(surface: Surface) -> None:
    """Tiles with grout, courses of another colour, tiles replaced, ceiling of painted plaster."""
    rng, section = surface.rng, surface.section
    walls = surface.lining & ((surface.u < WALL) | (surface.u > section.lined - WALL))
    low = np.where(surface.u < section.crown, surface.u, section.lined - surface.u)
    course, number = np.floor(low / TILE).astype(int), np.floor(surface.s / TILE).astype(int)
    shade = rng.normal(0.0, 0.35, (course.max() + 1, number.max() + 1)).astype(np.float32)
    # Replaced tiles come from another batch.
    for _ in range(9):
        i, j = rng.integers(0, 30), rng.integers(0, number.max() - 8)
        shade[i : i + rng.integers(2, 7), j : j + rng.integers(2, 9)] += rng.choice([-0.9, 0.8])
    grout = np.minimum(np.abs(low / TILE - np.round(low / TILE)), np.abs(surface.s / TILE - np.round(surface.s / TILE))) * TILE
    lines = smoothstep((0.004 - grout) / surface.step + 0.5)
    tiled = 1.6 + shade[course, number] - 1.1 * lines
    # A green course at the top of the dado and a black one at its foot.
    tiled = tiled + np.where((course == 33) | (course == 34), -2.2, 0.0) + np.where(course < 2, -3.5, 0.0)
    ceiling = 0.6 * surface.noise(1.5, 1.0) + 0.3 * surface.noise(0.07, octaves=2) - 0.6
    surface.db = np.where(walls, tiled, ceiling).astype(np.float32)
    surface.gloss = np.where(walls, 4.0 * (1.0 - 0.7 * lines), 0.0).astype(np.float32)
    for s in JOINTS:
        dressing.groove(surface, np.abs(surface.s - s) * np.ones_like(surface.u), 0.012, 0.012, -2.5)
    # Ceiling slabs and exhaust louvres along the middle.
    dressing.rings(surface, 1.5, 3.05, half=0.006, depth=0.0, change=-1.0)
    for s in np.arange(2.4, LENGTH, 4.6):
        slot = surface.panel(s, s + 0.9, section.crown - 0.12, section.crown + 0.12)
        surface.stain("louvre", slot, -5.0, soft=0.02)
    # Road film, washed off in horizontal sweeps down to where the brushes do not reach.
    film = smoothstep(1.0 - (low - 0.25) / (0.8 + 0.1 * surface.wave(1.5)))
    surface.db += np.where(walls, -2.8 * film * (1.0 + 0.15 * surface.noise(2.0, 0.12)), 0.0).astype(np.float32)
    surface.gloss *= np.where(walls, 1.0 - 0.8 * film, 1.0).astype(np.float32)
    surface.db += np.where(walls, 0.35 * surface.noise(4.0, 0.15, octaves=2), 0.0).astype(np.float32)
    # Exhaust dulls the ceiling above both lanes.
    for lane in (-1.9, 1.9):
        off = np.abs(surface.u - section.crown - lane)
        surface.db += np.where(walls, 0.0, -1.0 * smoothstep(1.0 - off / 1.6)).astype(np.float32)


def _bare(surface: Surface, s: float, low: float, columns: int, courses: int, side: int) -> None:
    """Tiles that fell off, or were taken off; the mortar bed is darker and dull."""
    s0, u0 = np.floor(s / TILE) * TILE, np.floor(low / TILE) * TILE
    if side > 0:
        u0 = surface.section.lined - u0 - courses * TILE
    place = surface.panel(s0, s0 + columns * TILE, u0, u0 + courses * TILE)
    surface.db = np.where(place > 0, -1.7 + 0.6 * surface.coarse + 0.5 * surface.fine, surface.db).astype(np.float32)
    surface.gloss = np.where(place > 0, 0.0, surface.gloss).astype(np.float32)
    surface.relief += np.where(place > 0, 0.015, 0.0).astype(np.float32)
    surface.others.append(("tiles missing", place > 0))


def _dry(surface: Surface) -> None:
    """Missing tiles, scratches, posters' rests, stains."""
    right = surface.section.lined
    for s, low, columns, courses, side in (
        (3.1, 1.4, 5, 4, 1),
        (12.6, 2.5, 8, 3, -1),
        (20.9, 1.0, 3, 6, 1),
        (29.1, 2.9, 4, 4, -1),
    ):
        _bare(surface, s, low, columns, courses, side)
    for s, u, length in ((10.4, 1.15, 2.2), (22.0, right - 0.85, 3.1)):
        surface.stain("scrape", surface.seam([(s, u), (s + length, u + 0.06)], 0.02, vary=0.6), -2.2, soft=0.03, ragged=0.01)
    surface.stain("rust run", surface.run(5.4, 3.1, 1.1, 0.03, 0.05), -1.8, soft=0.03)
    surface.stain("rust run", surface.run(23.6, right - 3.3, 0.9, 0.03, 0.04), -2.2, soft=0.03)
    surface.stain("patch of paint", surface.panel(28.0, 29.3, right - 2.4, right - 1.6), 1.2, ragged=0.004)
    surface.stain(
        "plaster patch", surface.panel(18.3, 19.6, surface.section.crown - 2.9, surface.section.crown - 1.7), 1.6, ragged=0.03
    )
    surface.stain("plaster spalled", surface.blob(13.4, surface.section.crown + 2.6, 0.5, 0.3), -1.9, soft=0.03, ragged=0.06)
    for s in (6.4, 21.6):
        dressing.mark(surface, "sign painted", s, 2.6, (0.6, 0.3), -2.6)


def _water(surface: Surface) -> None:
    """Leaks at expansion joints, through the ceiling, behind tiles."""
    section = surface.section
    right, crown = section.lined, section.crown
    first = np.maximum(surface.run(JOINTS[0], 3.9, 3.3, 0.12, 0.3), surface.run(JOINTS[0] + 0.3, 2.2, 1.5, 0.14, 0.24))
    surface.wet("wet joint", first, 3.4, soft=0.06, mottle=0.35, film=1.0)
    ceiling = np.maximum(
        surface.seam([(JOINTS[1], crown + 0.5), (JOINTS[1], crown + 3.4)], 0.16), surface.blob(17.0, crown + 2.3, 1.1, 0.85)
    )
    surface.wet("wet joint", ceiling, 3.7, soft=0.09, ragged=0.05, mottle=0.3, salt=1.8)
    behind = np.maximum(surface.blob(11.6, right - 1.9, 0.75, 0.5), surface.run(11.7, right - 1.7, 1.4, 0.4, 0.25))
    surface.wet("behind tiles", behind, 2.7, soft=0.08, ragged=0.04, mottle=0.4)
    surface.wet("ceiling patch", surface.blob(4.6, crown - 2.2, 0.65, 0.42), 2.6, soft=0.15, ragged=0.07, salt=1.5)
    surface.wet("ceiling patch", surface.blob(29.9, crown + 1.4, 0.36, 0.3), 4.1, soft=0.07, ragged=0.05, salt=1.0)
    surface.wet("wet joint", surface.run(JOINTS[2], right - 2.9, 2.3, 0.09, 0.17), 3.0, soft=0.05, mottle=0.4, film=0.8)
    corner = surface.seam([(19.6, WALL - 0.05), (21.9, WALL - 0.05)], 0.12)
    for s, fall in ((20.1, 1.3), (21.3, 0.8)):
        corner = np.maximum(corner, surface.run(s, WALL - 0.1, fall, 0.14, 0.1))
    surface.wet("drip", corner, 3.2, soft=0.07, ragged=0.03, mottle=0.3)
    surface.wet("drip", surface.run(14.6, right - 3.2, 1.0, 0.045, 0.03), 2.6, soft=0.04)
    surface.wet(
        "behind tiles",
        surface.blob(25.2, 0.6, 0.9, 0.3),
        1.0,
        soft=0.2,
        ragged=0.05,
        limit="In the road film at the foot of the wall, whose own clouds are as dark.",
    )


def _fittings(axis: Axis, surface: Surface) -> Fittings:
    """Walkway with its handrail, lamps, conduits, cabinets, signs, kerb."""
    fittings = Fittings(axis, surface.section)
    section, span = surface.section, (0.0, LENGTH)
    fittings.box(span, (3.3, 4.05), (0.0, 0.62), -0.8)
    for height in (1.15, 1.6):
        fittings.rod(span, 3.36, height, 0.022, -1.5, gloss=0.5)
    for s in np.arange(1.0, LENGTH, 2.2):
        fittings.post(s, 3.36, (0.62, 1.6), 0.045, -1.5)
    fittings.box(span, (-4.05, -3.75), (0.0, 0.3), -0.6)
    for side in (-1, 1):
        u = section.crown + side * 3.55
        dressing.lamps(fittings, np.arange(1.6, LENGTH, 2.6), u, (1.25, 0.16), (0.03, 0.15))
        fittings.cable(span, section.crown + side * 3.8, 0.04, 0.02, -1.0, gloss=0.3)
    for s in (9.8, 27.2):
        fittings.mount((s, s + 0.7), (section.lined - 1.75, section.lined - 0.85), (0.0, 0.08), -2.8, gloss=1.0)
    fittings.mount((18.6, 19.1), (1.3, 2.0), (0.0, 0.12), -1.0, gloss=0.6)
    fittings.box((13.96, 14.0), (-1.4, 0.2), (3.65, 4.2), 5.5)
    return fittings


def build() -> Survey:
    """Everything of the scene."""
    axis = Axis((589_734.0, 5_509_411.0, 38.6), 1.12, curvature=1.0 / 900.0, grade=-0.025)
    section = box_section(HALF, WALL, 0.12)
    surface = Surface(section, LENGTH, seed=80_401)
    _tiles(surface)
    _dry(surface)
    _water(surface)
    dressing.slab(surface, -2.5)
    surface.blur(0.005)
    instrument = Instrument(
        _law, speckle=0.5, floor=4.0, drift=0.3, offsets=0.25, jitter=0.0015, mixed=0.5, exponent=1.0, lobe=0.16
    )
    places = ((3.2, -0.6), (11.4, 0.4), (20.3, -0.3), (28.6, 0.5))
    sweeps = [station(axis, s, h, 1.8, scan, 0.15) for scan, (s, h) in enumerate(places, 1)]
    return Survey(axis, section, surface, _fittings(axis, surface), instrument, sweeps, 1200.0)


def _make(folder: Path) -> None:
    """Write the scene."""
    make(build(), folder)


SCENE = Scene(
    name="highway-glazed-tiles",
    lining="tiles",
    phenomenon="expansion joints, ceiling, behind tiles",
    description=(
        "Two lanes between walls of glazed 4¼-inch tiles under a plastered ceiling slab. Water at expansion joints "
        "and from behind the tiles; tiles missing or replaced, road film, scrapes; as in the FHWA's inspection manual"
        " (TOMIE) and its photographs."
    ),
    make=_make,
)
