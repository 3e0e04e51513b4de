"""Dry things that are bright or dark: salts, halos, repairs, paint, other concrete, soot, marks of washing."""

from __future__ import annotations

from functools import partial

import numpy as np
from shapely import Polygon, box
from shapely.geometry.base import BaseGeometry

from benchmarks.blind.known import shapes
from benchmarks.blind.known.equipment import boxes
from benchmarks.blind.known.patterns import Rings
from benchmarks.blind.known.site import Mark, Site


def _soft(shape: BaseGeometry, widest: float) -> float:
    """Width of a rim that leaves the middle of a shape at full strength."""
    return float(min(widest, 2.2 * shape.area / shape.length))


def salts(site: Site, share: float, gain: float) -> None:
    """Efflorescence on a share of the lining: seams of leaks, blotches, fringes under joints, curtains."""
    rng = site.rng
    wanted = share * site.section.lining * site.length
    done = 0.0
    seams: list[BaseGeometry] = []
    for leak in site.leaks:
        if rng.random() < 0.7:
            seam = shapes.fringe(rng, leak.outline, float(rng.uniform(0.07, 0.16)), float(rng.uniform(0.3, 0.65)))
            if 0.05 < seam.area < 1.0 and seam.bounds[1] > 0.02 and seam.bounds[3] < site.section.lining - 0.02:
                seams.append(seam)
    for seam in seams:
        site.add_mark(Mark(seam, "salts", gain + float(rng.normal(0, 0.3)), _soft(seam, 0.06)), take=True)
        done += seam.area
    while done < wanted:
        size = float(np.exp(rng.uniform(np.log(0.05), np.log(1.0))))
        kind = rng.random()

        def make(size: float = size, kind: float = float(kind)) -> BaseGeometry:
            if kind < 0.6:
                return shapes.largest(shapes.blob(rng, size, float(rng.uniform(0.5, 2.5)), 0.34).buffer(0))
            if kind < 0.82:
                width = float(rng.uniform(0.08, 0.18))
                return shapes.strip(rng, size / width, width, 0.3)
            return shapes.curtain(rng, size)

        outline = site.place(make, (0.25, site.section.lining - 0.25), 0.06)
        site.add_mark(Mark(outline, "salts", gain + float(rng.normal(0, 0.3)), _soft(outline, 0.12)), take=True)
        done += outline.area


def lamps(site: Site, s: float, first: float, pitch: float, halo: float) -> None:
    """A row of lamps on the lining with halos of grime about them, of some dB and 25 cm."""
    count = int((site.length - first - 0.5) / pitch) + 1
    site.items.append(boxes(site.section, s, 0.07, (0.03, 0.14), -3.5, (first, 0.62), (pitch, count)))
    for k in range(count):
        outline = box(first + k * pitch - 0.62, s - 0.07, first + k * pitch + 0.62, s + 0.07).buffer(0.15)
        site.add_mark(Mark(outline, "lamp halo", -halo, 0.26), take=True)


def repairs(site: Site, count: int) -> None:
    """Mortar repairs with straight sides, half of them turned, one of them with a notch."""
    rng = site.rng
    for k in range(count):
        turn = float(rng.uniform(6.0, 20.0) * rng.choice([-1, 1])) if k % 2 else 0.0
        length, height = float(rng.uniform(0.35, 1.5)), float(rng.uniform(0.3, 1.1))

        def make(length: float = length, height: float = height, turn: float = turn, k: int = k) -> BaseGeometry:
            if k == 2:
                notch = box(0.1 * length, -0.6 * height, 0.6 * length, 0.05 * height)
                return shapes.rectangle(length, height).difference(notch)
            return shapes.rectangle(length, height, turn)

        outline = site.place(make, (0.5, site.section.lining - 0.5), 0.2)
        site.add_mark(Mark(outline, "repair", -float(rng.uniform(3.5, 4.5)), 0.012), take=True)


def stripe_along(site: Site, s: float, width: float, start: float, end: float, gain: float) -> None:
    """A painted stripe along the tunnel."""
    site.add_mark(Mark(box(start, s - 0.5 * width, end, s + 0.5 * width), "paint", gain, 0.012))


def stripe_around(site: Site, u: float, width: float, low: float, high: float, gain: float) -> None:
    """A painted stripe around the lining."""
    site.add_mark(Mark(box(u - 0.5 * width, low, u + 0.5 * width, high), "paint", gain, 0.012))


def half_rings(site: Site, rings: Rings, steps: dict[int, tuple[bool, float]]) -> None:
    """Halves of rings (left or not) of another concrete."""
    for ring, (left, gain) in steps.items():
        low, high = (0.0, site.section.crown) if left else (site.section.crown, site.section.lining)
        site.add_mark(Mark(rings.panel(ring, low, high, 0.005), "other concrete", gain, 0.012))


def bolt_pockets(site: Site, rings: Rings, depth: float) -> list[tuple[float, float]]:
    """Recesses along the ring joints, two a segment, dry; returns where they are."""
    surface = site.surface
    relief = np.zeros(surface.shape, np.float32) if surface.relief is None else surface.relief
    places = []
    for ring, cuts in enumerate(rings.cuts):
        for cut in cuts:
            for further in (0.7, 2.1):
                s = float(cut) + further
                u = float(rings.edge(ring, np.array([s]))[0]) + 0.3
                if s > site.section.lining - 0.3 or not 0.5 < u < site.length - 0.5:
                    continue
                places.append((u, s))
                outline = box(u - 0.09, s - 0.07, u + 0.09, s + 0.07).buffer(0.015)
                site.add_mark(Mark(outline, "bolt pocket", -2.0, 0.02))
                where = (
                    slice(round((u - 0.09) * 100), round((u + 0.09) * 100)),
                    slice(round((s - 0.07) * 100), round((s + 0.07) * 100)),
                )
                relief[where] = depth
    surface.set_relief(relief)
    return places


def soot(site: Site, strength: float, plumes: int) -> None:
    """A sooty crown, uneven along the tunnel, and plumes with soft rims."""
    rng, crown = site.rng, site.section.crown
    uneven = 1.0 + shapes.wave(rng, site.surface.u, 18.0, 2.0, 0.25)
    across = strength * np.exp(-(((site.surface.s - crown) / 1.3) ** 2))
    site.surface.dry -= (uneven[:, None] * across[None, :]).astype(np.float32)
    for _ in range(plumes):
        area = float(rng.uniform(0.8, 3.0))
        outline = site.place(
            partial(shapes.blob, rng, area, float(rng.uniform(0.5, 1.6)), 0.2),
            (0.25 * crown, 1.75 * crown),
            0.15,
        )
        site.add_mark(Mark(outline, "soot", -float(rng.uniform(2.0, 3.5)), 0.45), take=True)


def washing(site: Site, height: float) -> None:
    """Walls washed up to a height, brighter, with the brush's scallops at the upper edge, and runs of dirty water below it."""
    rng = site.rng
    for left in (True, False):
        top = site.section.s_at(height, left)
        u = np.linspace(0.05, site.length - 0.05, 900)
        scallop = 0.10 * np.abs(np.sin(np.pi * u / 1.7)) + shapes.wave(rng, u, 9.0, 1.0, 0.05)
        edge = top - scallop if left else top + scallop
        foot = 0.3 if left else site.section.lining - 0.3
        shape = Polygon(np.vstack([np.column_stack([u, edge]), [[u[-1], foot], [u[0], foot]]])).buffer(0)
        site.add_mark(Mark(shape, "washed", 0.9, 0.08))
        sign = site.down(top)
        for _ in range(14):
            width, length = float(rng.uniform(0.03, 0.08)), float(rng.uniform(0.4, 1.6))
            run = shapes.run(rng, 0.0, 0.0, length, width)
            place = shapes.on_wall(run, float(rng.uniform(1, site.length - 1)), top + 0.2 * sign, sign)
            if site.free(place, 0.05):
                site.add_mark(Mark(place, "dirt run", -float(rng.uniform(1.0, 2.2)), 0.03))
