"""Which side moved: walls of boxes, oval rings, sagging roofs between two epochs whose registration wanders or has breaks.

    python -m benchmarks.motion_scenes              # two minutes of CPU
    python -m benchmarks.motion_scenes --seed 11    # other noise, errors of registration, and places

Made of pixels of 2 cm about the surface itself, three in five with a point of 2.5 mm noise, and noise of 0.1 mm that is alike
over half a metre. The newer epoch is off by 20 mm and 0.02°; beyond that `drift` wanders by 3 mm and 0.005° (Gaussian, alike
over 12 m), and `stations` jump by 1 mm and 0.003° every 12 m. What moved is the truth in space, along the lining's normal. A
movement is found where regions of its sign cover half of its outline (at half height); a region is false where it lies farther
than BESIDE from all of them. A stretch that moved as a whole is a motion of its sections: its regions count neither way.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
from scipy import ndimage

from benchmarks.common import print_table, save
from tunneldb.arrays import Bool, Float
from tunneldb.geometry.frame import segment_rows, tangents
from tunneldb.geometry.surface import Surface
from tunneldb.measures.change.compute.cells import CellGrid, Cells, CellSums, without_edges
from tunneldb.measures.change.compute.change import change_regions
from tunneldb.measures.change.compute.sections import measure_change

sys.path.append(str(Path(__file__).parent.parent / "tests"))
from support.curved_lining import helix

PIXEL, CELL, NOISE, KEPT = 0.02, 0.1, 0.0025, 0.6
WEST, LENGTH = 21.0, 48.0
POSE, TURN = 0.02, np.radians(0.02)
ALIKE = 0.0001, 0.5
"""Noise that neighbours share, and how far it goes, m."""

BESIDE = 0.75
"""How far from what moved a region may lie, m."""

Change = Callable[[Float, Float, Float], Float]
"""Movement inwards, m, at places along the tunnel, to the right and up, m."""


@dataclass(frozen=True)
class Scene:
    """A lining, what its registration does, and what moved, each with whether it counts."""

    profile: str
    registration: str
    moved: tuple[tuple[Change, bool], ...] = ()


def box() -> Float:
    """Outline of a box, 7 by 5 m."""
    return np.array([[-3.5, -2.5], [3.5, -2.5], [3.5, 2.5], [-3.5, 2.5]])


def round_() -> Float:
    """Outline of a tube of 6 m."""
    angle = np.radians(np.arange(0.0, 360.0, 0.5))
    return 3.0 * np.column_stack([np.sin(angle), np.cos(angle)])


def horseshoe() -> Float:
    """Outline of an arch of 3.3 m on walls of 2.2 m."""
    angle = np.radians(np.arange(-90.0, 90.1, 0.5))
    arch = 3.3 * np.column_stack([np.sin(angle), np.cos(angle)])
    return np.vstack([arch, [[3.3, -2.2], [-3.3, -2.2]]])


PROFILES = {"box": (box, -2.4), "round": (round_, -2.0), "horseshoe": (horseshoe, -2.1)}
"""Outline, and the height above which the lining is seen, m."""


def ramp(along: Float, low: float, high: float, width: float) -> Float:
    """1 between two places, 0 beyond them, linearly over a width about each."""
    return np.clip(0.5 + np.minimum(along - low, high - along) / width, 0.0, 1.0)


def wall(side: float, low: float, high: float, change: float, width: float = 0.2) -> Change:
    """A whole wall."""
    return lambda s, right, up: change * ramp(s, low, high, width) * (right * side > 3.25) * (up < 2.49)


def roof(low: float, high: float, change: float) -> Change:
    """A whole roof of a box, most in its middle."""
    return lambda s, right, up: change * ramp(s, low, high, 1.0) * (up > 2.49) * np.cos(np.pi * right / 7.0)


def oval(low: float, high: float, change: float, turned: float = 0.0, ring: float = 1.5) -> Change:
    """Rings that are as much narrower as higher, most in the middle of the stretch."""

    def of(s: Float, right: Float, up: Float) -> Float:
        place = (np.floor((s - low) / ring) + 0.5) * ring / (high - low)
        most = np.where((s >= low) & (s < high), np.sin(np.pi * np.clip(place, 0.0, 1.0)), 0.0)
        return np.asarray(-change * most * np.cos(2.0 * (np.arctan2(right, up) - np.radians(turned))), dtype=np.float64)

    return of


def crown(low: float, high: float, change: float) -> Change:
    """The upper third of an arch."""

    def of(s: Float, right: Float, up: Float) -> Float:
        angle = np.arctan2(right, up)
        most = np.clip(np.cos(1.5 * angle), 0.0, 1.0) * (np.abs(angle) < np.pi / 3.0)
        return np.asarray(change * ramp(s, low, high, 1.0) * most, dtype=np.float64)

    return of


def whole(low: float, high: float, change: float) -> Change:
    """A stretch that settled as a whole: the crown inwards, the invert outwards."""
    return lambda s, right, up: change * ramp(s, low, high, 0.2) * up / np.hypot(right, up)


def bulge(along: float, right: float, up: float, change: float = 0.003, side: float = 1.0) -> Change:
    """A square about a place."""
    half = side / 2.0
    return lambda s, r, u: change * (np.abs(s - along) < half) * (np.hypot(r - right, u - up) < half)


def scenes(shift: float) -> dict[str, Scene]:
    """All scenes, what moved by some metres farther along."""
    at = shift
    return {
        "box, wall": Scene("box", "pose", ((wall(1, 15 + at, 24 + at, 0.004, 1.0), True), (bulge(35, -3.5, 0.3), True))),
        "box, wall, drift": Scene("box", "drift", ((wall(-1, 14 + at, 20 + at, 0.003), True), (bulge(36, 1.0, 2.5), True))),
        "box, roof and wall, stations": Scene(
            "box", "stations", ((roof(8 + at, 16 + at, 0.005), True), (wall(1, 28 + at, 33 + at, -0.004), True))
        ),
        "box, long wall, drift": Scene("box", "drift", ((wall(1, 10 + at, 30 + at, 0.005, 0.5), True),)),
        "round, one ring, drift": Scene(
            "round", "drift", ((oval(15 + at, 16.5 + at, 0.004), True), (oval(27 + at, 34.5 + at, 0.003), True))
        ),
        "round, turned ovals, stations": Scene(
            "round", "stations", ((oval(15 + at, 18 + at, 0.005, 30.0), True), (bulge(30, -2.6, 1.5), True))
        ),
        "horseshoe, walls, drift": Scene(
            "horseshoe", "drift",
            ((wall(1, 10 + at, 20 + at, 0.0035, 0.5), True), (wall(1, 28 + at, 32 + at, 0.004), True),
             (wall(-1, 28 + at, 32 + at, 0.004), True)),
        ),
        "horseshoe, crown, stations": Scene("horseshoe", "stations", ((crown(14 + at, 20 + at, 0.006), True),)),
        "round, settled, pose": Scene("round", "pose", ((whole(18 + at, 24 + at, 0.006), False),)),
        **{
            f"{profile}, unchanged, {registration}": Scene(profile, registration)
            for profile in PROFILES for registration in ("pose", "drift", "stations")
        },
    }  # fmt: skip


def surface_about(outline: Float) -> Surface:
    """Surface with an outline about the axis of tests/support/curved_lining."""
    vertices = helix(LENGTH + 2.0 * WEST, 10.0)
    rows = segment_rows(vertices, tangents(vertices))
    starts = np.arange(len(rows)) * 10.0
    at = np.sort(np.concatenate([starts + 2.5, starts + 7.5]))
    shape = shapely.LinearRing(outline)
    angle = np.radians(np.arange(361) - 180.0)
    rays = shapely.linestrings([[[0.0, 0.0], [20.0 * np.sin(a), 20.0 * np.cos(a)]] for a in angle])
    met = shapely.get_coordinates(shapely.intersection(rays, shape))
    ray = np.hypot(*met.T)
    arcs = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(met, axis=0).T))])
    arcs -= arcs[180]
    return Surface(
        np.arange(len(rows)), rows, np.column_stack([starts, starts + 10.0]), at,
        np.tile(ray, (len(at), 1)), np.tile(arcs, (len(at), 1)), 10.0,
    )  # fmt: skip


def places(surface: Surface, arc: Float) -> tuple[Float, Float]:
    """Right and up of arcs."""
    angle = np.radians(np.arange(361) - 180.0)
    right, up = (np.interp(arc, surface.arcs[0], surface.radius[0] * f(angle)) for f in (np.sin, np.cos))
    return right, up


def alike(rng: np.random.Generator, shape: tuple[int, ...], sigma: float, reach: float, step: float) -> Float:
    """Gaussian noise that is alike over a reach, m."""
    noise = ndimage.gaussian_filter(rng.normal(size=shape), reach / step / 2.0, mode="wrap")
    return np.asarray(sigma * noise / noise.std())


def registered(scene: Scene, rng: np.random.Generator, points: Float, surface: Surface, chainage: Float) -> Float:
    """Points (n, 3) as a registration that is off places them."""
    middle = points.mean(axis=0)
    turn = np.array([[1.0, -TURN, TURN], [TURN, 1.0, -TURN], [-TURN, TURN, 1.0]])
    points = middle + (points - middle) @ turn.T + POSE / np.sqrt(3.0)
    if scene.registration == "pose":
        return points
    step = 0.5
    number = int((LENGTH + 2.0 * WEST) / step)
    if scene.registration == "drift":
        scales = (0.003, 0.003, np.radians(0.005))
        values = [alike(rng, (number + 200,), sigma, 12.0, step)[100:-100] for sigma in scales]
        right, up, roll = (np.interp(chainage, np.arange(number) * step, value) for value in values)
    else:
        scales = (0.001, 0.001, np.radians(0.003))
        station = np.floor((chainage - WEST + 5.0) / 12.0).astype(int)
        right, up, roll = (rng.normal(0.0, sigma, 12)[station + 2] for sigma in scales)
    tabulated = np.arange(0.0, LENGTH + 2.0 * WEST, 0.25)
    frames = surface.frames(tabulated)
    nearest = np.clip(np.rint(chainage / 0.25).astype(int), 0, len(frames) - 1)
    origin, _, rightwards, upwards = (frames[nearest, k] for k in range(4))
    away = points - origin
    across, above = (np.einsum("ij,ij->i", away, axis) for axis in (rightwards, upwards))
    return points + (right + roll * above)[:, None] * rightwards + (up - roll * across)[:, None] * upwards


def epoch(scene: Scene, surface: Surface, grid: CellGrid, rng: np.random.Generator, later: bool) -> Cells:
    """Cells of a scan."""
    floor = PROFILES[scene.profile][1]
    along, across = (np.arange(round(n * CELL / PIXEL)) for n in (grid.columns, grid.rows))
    chainage, arc = (v.ravel() for v in np.meshgrid(grid.west + (along + 0.5) * PIXEL, grid.south + (across + 0.5) * PIXEL))
    right, up = places(surface, arc)
    kept = (rng.random(len(arc)) < KEPT) & (up > floor)
    shared = np.repeat(np.repeat(alike(rng, (grid.rows, grid.columns), *ALIKE, CELL), 5, axis=0), 5, axis=1).ravel()
    offset = rng.normal(0.0, NOISE, len(arc)) + shared
    if later:
        offset += sum((of(chainage - WEST, right, up) for of, _ in scene.moved), np.zeros(len(arc)))
    chainage, arc, offset = chainage[kept], arc[kept], offset[kept]
    points = surface.to_space(chainage, arc, offset)
    if later:
        points = registered(scene, rng, points, surface, chainage)
    there = surface.unroll(points)
    sums = CellSums(grid, PIXEL)
    sums.add(there.chainage, there.arc, np.round(there.offset, 3), np.ones(len(points), np.bool_))
    return without_edges(sums.cells())


def made(scene: Scene, seed: int) -> tuple[Surface, CellGrid, Cells, Cells, list[tuple[Bool, float, bool]]]:
    """Surface, grid, both epochs, and the outline, sign and weight of each part that moved."""
    outline, _ = PROFILES[scene.profile]
    surface = surface_about(outline())
    low, high = surface.arcs[0, 0], surface.arcs[0, -1]
    rows = int((high - low) / CELL) - 2
    grid = CellGrid(CELL, WEST, float(np.ceil(low / CELL + 1) * CELL), round(LENGTH / CELL), rows)
    rng = np.random.default_rng(seed)
    old, new = (epoch(scene, surface, grid, rng, later) for later in (False, True))
    chainage, arc = np.meshgrid(grid.chainage - WEST, grid.arc)
    right, up = places(surface, arc)
    both = np.isfinite(old.offset) & np.isfinite(new.offset)
    parts = []
    for of, counts in scene.moved:
        change = of(chainage.ravel(), right.ravel(), up.ravel()).reshape(chainage.shape)
        lobes = ndimage.label(np.abs(change) >= 0.5 * np.abs(change).max())[0] * np.sign(change)
        for lobe in np.unique(lobes[lobes != 0]):
            part = (lobes == lobe) & both
            if part.sum() * CELL**2 > 0.2:
                parts.append((part, float(np.sign(lobe)), counts))
    return surface, grid, old, new, parts


def judged(name: str, scene: Scene, seed: int) -> dict[str, object]:
    """Return the result of compare for a scene."""
    surface, grid, old, new, parts = made(scene, seed)
    begun = time.process_time()
    found = measure_change(surface, grid, old, new, 1.5, PIXEL)
    regions = change_regions(found.difference, found.variance, found.removed_error, found.scatter, found.place_error)
    seconds = time.process_time() - begun
    signed = np.zeros(found.difference.shape)
    for region in regions:
        signed[region.rows, region.columns] = np.sign(region.mean)
    about = np.zeros(signed.shape, np.bool_)
    for part, _, _ in parts:
        about |= part
    near = ndimage.binary_dilation(about, iterations=round(BESIDE / CELL)) if about.any() else about
    false = [region for region in regions if not near[region.rows, region.columns].any()]
    cover = [float((signed[part] == sign).mean()) for part, sign, counts in parts if counts]
    plain = np.isfinite(found.difference) & ~near
    return {
        "scene": name, "moved": len(cover), "found": sum(one >= 0.5 for one in cover), "covered": [round(c, 2) for c in cover],
        "false": len(false), "false_area": sum(len(region.rows) for region in false) * CELL**2,
        "area": float(plain.sum()) * CELL**2, "seconds": seconds,
        "holds": float((np.abs(found.difference[plain]) <= found.lod[plain]).mean()),
    }  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, nargs="+", default=[1], help="of noise, registration and places")
    arguments = parser.parse_args()
    figures = [
        {"seed": seed, **judged(name, scene, 100 * seed + k)}
        for seed in arguments.seed
        for k, (name, scene) in enumerate(scenes(np.random.default_rng(seed).uniform(0.0, 5.0)).items())
    ]
    columns = ("scene", "moved", "found", "covered", "false", "false m²", "of m²", "LoD holds")
    keys = ("scene", "moved", "found", "covered", "false", "false_area", "area", "holds")
    print_table("Which side moved", columns, [[row[key] for key in keys] for row in figures])
    moved, found, false, area = (sum(float(str(row[key])) for row in figures) for key in ("moved", "found", "false", "area"))
    print(f"\n{found:.0f} of {moved:.0f} found; {false:.0f} false in {area:.0f} m², {1e3 * false / area:.2f} in 1000 m²")
    print(save("motion_scenes", {"scenes": figures}))


if __name__ == "__main__":
    main()
