"""A riveted truss railway bridge: old paint, repairs, rust at the nodes; a fence and bushes in front."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .engine import Material, Scanner, View, World, blob, deliver, patch, run, speckle
from .parts import CONCRETE, GRAVEL, GRASS, RUST, RUST_LIGHT, blades, bush, fence, ground, studs_along

PAINT = Material(0.42, 0.85, 0.7, 18.0, tex=0.35, grain=0.4)
FRESH = Material(0.62, 0.80, 1.1, 16.0, tex=0.15, grain=0.4)
OTHER = Material(0.27, 0.85, 0.8, 17.0, tex=0.2, grain=0.4)
PRIMER = Material(0.26, 0.9, 0.2, 20.0, tex=0.3, grain=0.12)
WOOD = Material(0.22, 0.9, tex=0.9, grain=0.12)


def build() -> World:
    """The bridge; the near truss lies in the plane y = 0, its chords at z = 1.5 and 5.3."""
    w = World(301)
    ground(w, GRASS)
    low, top, panel, n = 1.5, 5.3, 4.0, 4
    xs = [panel * (i - n / 2) for i in range(n + 1)]
    chords, posts, diagonals, plates = {}, {}, {}, {}
    for y, near in ((0.0, True), (4.6, False)):
        for i in range(n):
            a, b = xs[i], xs[i + 1]
            chords[near, "low", i] = w.channel((a, y, low), (b, y, low), 0.42, 0.14, 0.014, PAINT, (0, 1, 0), False)
            if 0 < i < n - 1:
                chords[near, "top", i] = w.box((a, y + 0.15, top), (b, y + 0.15, top), 0.34, 0.40, PAINT, caps=False)
            up = i in (0, 2)
            z0, z1 = (low, top) if up else (top, low)
            p, q = (a, y + 0.03, z0), (b, y + 0.03, z1)
            diagonals[near, i] = w.channel(p, q, 0.30, 0.10, 0.012, PAINT, (0, 1, 0), False)
        for i in range(1, n):
            p, q = (xs[i], y + 0.14, low + 0.2), (xs[i], y + 0.14, top - 0.2)
            posts[near, i] = w.box(p, q, 0.20, 0.24, PAINT, (0, 1, 0), False)
        for i in range(n + 1):
            for key, z in (("low", low), ("top", top)):
                if key == "top" and i in (0, n):
                    continue
                p = w.box((xs[i], y - 0.012, z - 0.40), (xs[i], y - 0.012, z + 0.40), 1.0, 0.016, PAINT, (0, -1, 0))
                f = p["+3"]
                f.studs = studs_along([-0.43, -0.15, 0.15, 0.43], np.arange(0.05, 0.8, 0.1))
                plates[near, key, i] = f
    for x in np.arange(xs[0], xs[-1] + 0.1, panel / 2):
        w.box((x, 0.16, low + 0.05), (x, 4.44, low + 0.05), 0.20, 0.34, PAINT, caps=False)
    for y in (1.6, 3.0):
        w.box((xs[0], y, low + 0.35), (xs[-1], y, low + 0.35), 0.16, 0.26, OTHER, caps=False)
    for x in np.arange(xs[0], xs[-1], 0.62):
        w.box((x, 1.0, low + 0.56), (x, 3.6, low + 0.56), 0.24, 0.16, WOOD)
    for y in (1.6, 3.0):
        w.box((xs[0], y, low + 0.72), (xs[-1], y, low + 0.72), 0.07, 0.15, Material(0.14, 1.2, 3.0, 12.0))
    for k in (-1, 1):
        w.box((k * 8.9, -0.9, 0.6), (k * 8.9, 5.5, 0.6), 1.3, 1.25, CONCRETE)

    # design: splice straps with rivets, weld seams, a number plate, a stripe
    for i in range(n):
        web = chords[True, "low", i]["web"]["-2"]
        web.studs = studs_along([-0.16, 0.16], np.arange(0.65, 3.4, 0.15), 0.012, 0.009)
        f = diagonals[True, i]["web"]["-2"]
        f.studs = studs_along([-0.1, 0.1], np.arange(0.7, f.lv - 0.6, 0.3), 0.012, 0.009)
    w.box((-3.0, -0.030, low + 0.02), (-2.5, -0.030, low + 0.02), 0.012, 0.22, Material(0.75, 0.9, 0.5, 15.0, tex=0.1))
    posts[True, 3]["-3"].design(patch(0, 0.7, 0.3, 0.25, 5), Material(0.7, 0.8, 0.9, 16.0, tex=0.1))

    # rust at the nodes
    for k, (key, i, u, v, ru, rv, mat) in enumerate(
        (
            ("low", 1, 0.1, 0.15, 0.38, 0.22, RUST),
            ("low", 2, -0.2, 0.2, 0.24, 0.2, RUST_LIGHT),
            ("low", 3, 0.0, 0.32, 0.33, 0.26, RUST),
            ("top", 1, 0.2, 0.25, 0.22, 0.26, RUST),
            ("top", 3, -0.15, 0.5, 0.3, 0.2, RUST_LIGHT),
            ("low", 4, -0.3, 0.2, 0.25, 0.2, RUST),
        )
    ):
        shape = blob(u, v, ru, rv, 400 + 10 * k, 0.35)
        w.anomaly(plates[True, key, i], "rust", speckle(shape, 900 + k, 0.05, 1.0) if k % 2 else shape, mat)
    for k, i in enumerate((0, 1, 3)):
        f = chords[True, "low", i]["web"]["-2"]
        w.anomaly(f, "rust", blob(-0.12, (3.2, 0.9, 0.9)[k], 0.11, 0.35, 520 + 7 * k, 0.4), RUST)
    for k, i in enumerate((1, 2)):
        f = posts[True, i]["-3"]
        w.anomaly(f, "rust run", run(0.02 - 0.03 * k, 3.0, 1.7, 0.09, 560 + 7 * k), RUST_LIGHT)
        w.anomaly(f, "rust", blob(0.03, 0.28, 0.1, 0.2, 580 + 7 * k), RUST)
    # repairs: patches of fresh paint, one of primer, and peeling
    w.anomaly(diagonals[True, 0]["web"]["-2"], "patched paint", patch(0.02, 2.1, 0.22, 0.7, 601, 2), FRESH)
    w.anomaly(diagonals[True, 1]["web"]["-2"], "patched paint", patch(-0.02, 3.2, 0.24, 0.5, 603, -3), OTHER)
    w.anomaly(chords[True, "low", 2]["web"]["-2"], "patched paint", patch(0.05, 2.0, 0.26, 0.8, 605, 1), FRESH)
    w.anomaly(chords[True, "top", 1]["-2"], "primer", patch(-0.03, 2.3, 0.28, 0.9, 607, -1), PRIMER)
    w.anomaly(
        chords[True, "top", 2]["-2"], "peeled paint", speckle(blob(0.02, 1.7, 0.16, 0.6, 609, 0.4), 611, 0.09, 0.6), PRIMER
    )
    w.anomaly(
        diagonals[True, 3]["web"]["-2"], "peeled paint", speckle(blob(0.0, 2.6, 0.13, 0.5, 613, 0.4), 615, 0.08, 0.7), RUST
    )
    w.anomaly(diagonals[False, 1]["web"]["+2"], "rust", blob(0.0, 3.4, 0.12, 0.5, 617), RUST)
    w.anomaly(
        chords[True, "low", 3]["web"]["-2"],
        "soiling",
        blob(0.0, 2.6, 0.17, 0.5, 619, soft=0.4),
        -0.45,
        "a film of dust of less than half a decibel, weaker than the texture of the paint",
    )

    fence(w, -9.5, 9.5, -3.2, 2.05)
    for x, y, h, m in ((-5.2, -2.4, 2.3, 650), (1.3, -2.2, 1.9, 520), (5.9, -2.6, 2.9, 760)):
        bush(w, x, y, h, m)
    blades(w, -9, 9, -4.5, -0.6, 500, 0.9)
    w.cyl((-9.5, -0.6, 6.4), (9.5, -0.6, 6.25), 0.006, Material(0.2, tex=0), smooth=False)
    w.quad((0, 12.0, 0.0), (0, -1, 0), (0, 0.35, 1), 60, 2.2, GRAVEL, smooth=False)
    return w


def make(folder: Path) -> None:
    """Two stations at 1064 nm."""
    tool = Scanner(beam=0.35, sigma=0.0018, noise=0.5, const=31.0, near=2.8, floor=3.0, false=0.001)
    views = [View((-3.8, -9.2, 1.75), (36, 120), (-9, 26), 0.06), View((4.6, -8.4, 1.68), (57, 147), (-9, 28), 0.06, 0.3)]
    deliver(folder, build(), views, tool, 31, 25832, (478213.4, 5391877.2, 243.6), 33.0)
