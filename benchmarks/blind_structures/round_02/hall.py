"""Scene 2: a crane hall with painted frames in two colours; scene 5: a clean pipe bridge."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.blind_structures.round_02.engine import Instrument, Material, Station, World, blob, flakes, foot, noise, streak
from benchmarks.blind_structures.round_02.stairs import ASPHALT, CONCRETE, RUST, SIGN, ZINC, bolt

GREEN = Material(-5.6, 1.0, 1.6, 7.0, 0.2, 0.7)
GREY = Material(-2.4, 1.0, 2.2, 6.0, 0.2, 0.7)
YELLOW = Material(-1.6, 1.0, 1.4, 8.0, 0.15, 0.7)
PRIMER = Material(-8.4, 0.9, 0.2, 12.0, 0.4, 0.1, 0.3)
FILLER = Material(-1.2, 0.9, 0.0, 10.0, 0.3, 0.1, 0.3)
RAIL = Material(-6.0, 1.0, 6.0, 6.0, 0.3, 0.3)
RUBBER = Material(-9.0, 1.0, 0.6, 9.0, 0.2)
SHEET = Material(-3.0, 1.0, 1.5, 7.0, 0.2, 1.0)
BRICK = Material(-3.6, 0.9, 0.0, 10.0, 0.3, 0.9, 0.4)
FLOOR = Material(-5.0, 1.0, 0.8, 6.0, 0.35, 1.5, 0.25)
ALU = Material(-5.5, 1.2, 11.0, 7.0, 0.3, 0.5, 0.0, 0.3)
BLUE = Material(-4.2, 1.0, 1.8, 7.0, 0.15, 0.8)
RED = Material(-2.6, 1.0, 1.6, 8.0, 0.15, 0.8)
TAPE = Material(-0.6, 1.0, 0.8, 8.0, 0.1)


def soot(mid: float, reach: float, seed: int, depth: float = 1.0):
    """A plume along a member: strongest in the middle, with a visible end."""

    def level(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        x = np.abs(a - mid) / reach + 0.35 * noise(a, b, 0.35, seed, 3)
        return depth * np.clip((1.0 - x) / 0.35, 0, 1) ** 0.8

    return level


def tray(w: World, p, q, width: float, seed: int, cables: int) -> None:
    """A cable ladder from p to q with cables that sag and cross a little."""
    p, q = np.asarray(p, float), np.asarray(q, float)
    d = q - p
    n = np.linalg.norm(d)
    side = np.cross(d / n, (0, 0, 1.0))
    rng = np.random.default_rng(seed)
    for g in (0, width):
        w.box(p + g * side, d, 0.002 * side, (0, 0, 0.06), ZINC)
    rung = w.surface(ZINC, none=True)
    for f in np.arange(0.1, n, 0.3):
        w.patch(p + f * d / n + (0, 0, 0.012), 0.025 * d / n, width * side, rung)
    black = w.surface(RUBBER, none=True)
    for k in range(cables):
        r = rng.uniform(0.006, 0.018)
        knots = np.linspace(0, n, 7)
        y = 0.02 + (width - 0.04) * (k + 0.5) / cables + rng.normal(0, 0.012, 7)
        pts = [p + x * d / n + yy * side + (0, 0, 0.018 + r + 0.01 * rng.random()) for x, yy in zip(knots, y, strict=True)]
        for s, t in zip(pts[:-1], pts[1:], strict=True):
            w.tube(s, t, r, black)


def cable(w: World, p, q, sag: float, r: float) -> None:
    """A hanging cable."""
    s = w.surface(RUBBER, none=True)
    p, q = np.asarray(p, float), np.asarray(q, float)
    f = np.linspace(0, 1, 9)
    pts = p + f[:, None] * (q - p) - np.outer(4 * sag * f * (1 - f), (0, 0, 1.0))
    for a, b in zip(pts[:-1], pts[1:], strict=True):
        w.tube(a, b, r, s)


def make(folder: Path) -> None:
    """Writes the hall."""
    w = World(202)
    long, wide, eave = 15.0, 11.0, 6.6
    w.patch((-0.5, -0.3, 0), (long + 1, 0, 0), (0, wide + 0.6, 0), FLOOR)
    w.patch((3.0, 1.6, 0.002), (9.0, 0, 0), (0, 0.1, 0), w.surface(YELLOW, none=True))  # lane marks: thin, design

    def courses(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        i = np.floor(b / 0.083)
        joint = ((b % 0.083) < 0.011) | (((a + 0.13 * (i % 2)) % 0.26) < 0.011)
        return -0.7 * joint + np.where(b < 1.5, -1.8, 0.0)  # a painted dado

    back = w.patch((-0.5, wide + 0.25, 0), (long + 1, 0, 0), (0, 0, eave + 0.6), w.surface(BRICK, courses))
    w.flaw(back, "soot", blob(9.4, 4.6, 1.5, 2.4, 0.6, 12, 0.35, 1.0), change=-3.2)
    w.flaw(back, "efflorescence", blob(3.6, 3.2, 1.2, 0.8, 0.5, 13, 0.15), change=2.2)
    gable = w.patch((long + 0.45, -0.3, 0), (0, wide + 0.6, 0), (0, 0, eave + 1.6), SHEET)
    w.flaw(gable, "moisture", streak(4.4, 7.6, 5.2, 1.0, 14), change=-2.3)
    for y in np.arange(0.0, wide + 0.3, 0.5):  # ribs of the cladding
        w.box((long + 0.41, y, 0), (0, 0.05, 0), (0.04, 0, 0), (0, 0, eave + 1.6), SHEET, "z0 z1")
    for k, x in enumerate(np.arange(0.3, long, 1.25)):  # purlins, and roof sheets above
        w.box((x, -0.2, eave + 0.55), (0.07, 0, 0), (0, wide + 0.4, 0), (0, 0, 0.16), ZINC, "z1 y0 y1")
    for k in range(3):
        w.patch((-0.5 + k * 5.33, -0.3, eave + 0.72), (5.33, 0, 0), (0, wide + 0.6, 0), SHEET)
    for k, x in enumerate((1.5, 6.5, 11.5)):
        for side, y in ((1, 0.15), (-1, wide - 0.15)):
            # columns HE 300: flanges across the hall, webs along y seen from the bays
            c = w.ibeam((x, y - 0.145 * side, 0.02), (0, 0, eave), (0, side, 0), (1, 0, 0), 0.29, 0.30, 0.0085, 0.014, GREEN)
            w.box((x - 0.2, y - 0.2, 0), (0.4, 0, 0), (0, 0.4, 0), (0, 0, 0.025), GREEN, "z0")
            for dx in (-0.15, 0.15):
                bolt(w, (x + dx, y + 0.16 * side, 0.025), (0, 0, 1), ZINC)
            n = 10 * k + (5 if side < 0 else 0)
            if side < 0:
                w.flaw(c["top"], "peeled paint", flakes(1.3 + 0.9 * k, 0.15, 0.8, 0.16, 0.09, 20 + n, 0.1), PRIMER)
                w.flaw(c["web-"], "rust", foot(0.28 + 0.12 * k, 0.12, 21 + n, axis="a"), RUST)
                w.flaw(c["web+"], "peeled paint", flakes(2.6, 0.13, 0.7, 0.16, 0.1, 22 + n, 0.2), FILLER if k == 1 else PRIMER)
                if k != 1:
                    w.flaw(c["top"], "rust", foot(0.18, 0.08, 24 + n, axis="a"), RUST)
                # crane girder bracket
                w.box((x - 0.006, y - 0.75, 4.45), (0.012, 0, 0), (0, 0.6, 0), (0, 0, 0.3), GREEN)
                w.box((x - 0.1, y - 0.75, 4.75), (0.2, 0, 0), (0, 0.6, 0), (0, 0, 0.015), GREEN)
                w.box((x - 0.085, y - 0.1605, 1.75), (0.17, 0, 0), (0, 0.004, 0), (0, 0, 0.12), SIGN, "y1")  # label of the axis
            else:
                w.flaw(c["top"], "patched paint", blob(1.9 + 0.8 * k, 0.15, 0.35, 0.2, 0.2, 23 + n, 0.05), change=1.9)
                w.flaw(c["web+"], "stain", blob(1.6, 0.13, 0.5, 0.1, 0.4, 25 + n), change=-2.0)
        # haunched rafter IPE 400 in the other colour, bolted end plates
        r = w.ibeam((x, 0.3, eave - 0.0), (0, wide - 0.6, 0), (0, 0, 1), (1, 0, 0), 0.4, 0.18, 0.0086, 0.0135, GREY)
        for y in (0.3, wide - 0.32):
            w.box((x - 0.1, y, eave - 0.06), (0.2, 0, 0), (0, 0.02, 0), (0, 0, 0.5), GREY)
        for g, name in ((-1, "web-"), (1, "web+")):
            for y in (3.5, 7.0):  # stiffeners
                w.patch((x + 0.0043 * g, y, eave + 0.0135), (0.085 * g, 0, 0), (0, 0, 0.373), GREY)
            if k != 2:
                w.flaw(r[name], "soot", soot(5.2 + 1.2 * k, 1.3, 60 + 2 * k + g), change=-3.4)
            else:
                w.flaw(r[name], "peeled paint", flakes(3.0, 0.19, 0.7, 0.2, 0.12, 66 + g, 0.25), PRIMER)
        if k != 1:
            w.flaw(r["low"], "soot", soot(5.0 + 0.6 * k, 1.5, 70 + k), change=-3.0)
    # crane girder IPE 450, yellow, rail on it, along the far columns; stops and a conductor bar
    y = wide - 0.75
    g = w.ibeam((0.2, y, 4.765), (long - 0.4, 0, 0), (0, 0, 1), (0, 1, 0), 0.45, 0.19, 0.0094, 0.0146, YELLOW)
    w.flaw(g["web-"], "peeled paint", flakes(4.2, 0.2, 0.9, 0.25, 0.15, 80, 0.25), PRIMER)
    w.flaw(g["web-"], "stain", blob(8.8, 0.2, 0.8, 0.16, 0.5, 81), change=-2.6)
    w.flaw(g["web-"], "rust", streak(12.4, 0.42, 0.42, 0.9, 82), RUST)
    w.flaw(g["low"], "stain", blob(9.2, 0.09, 1.0, 0.07, 0.5, 83), change=-2.4)
    w.box((0.2, y - 0.03, 5.215), (long - 0.4, 0, 0), (0, 0.06, 0), (0, 0, 0.05), RAIL)
    for x in np.arange(1.0, long, 1.5):
        bolt(w, (x, y - 0.07, 5.215), (0, 0, 1), ZINC)
        w.patch((x, y - 0.005, 4.78), (0, -0.085, 0), (0, 0, 0.42), YELLOW)
    for x in (2.3, 9.7):  # capacity plates
        w.patch((x, y - 0.0065, 4.86), (0.6, 0, 0), (0, 0, 0.2), SIGN)
    # services in front: ladders with cables, a sprinkler pipe with red bands, hanging cables, drop cables
    tray(w, (0.4, wide - 1.3, 3.6), (long - 0.5, wide - 1.3, 3.6), 0.3, 5, 7)
    tray(w, (5.0, 0.8, 6.1), (5.0, wide - 0.8, 6.1), 0.2, 6, 4)
    for x in np.arange(1.2, long, 2.5):
        w.tube((x, wide - 1.45, 3.6), (x, wide - 1.45, eave + 0.5), 0.005, w.surface(ZINC, none=True), ref=(1, 0, 0))

    def bands(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return np.where((b % 3.0) < 0.25, 2.2, 0.0)

    w.tube((0.3, 4.2, 6.25), (long, 4.2, 6.25), 0.057, w.surface(RED, bands))
    cable(w, (0.5, 8.4, 5.4), (long - 1, 9.1, 5.2), 0.9, 0.011)
    cable(w, (0.5, 8.5, 5.5), (long - 1, 9.0, 5.4), 0.7, 0.008)
    for x in (3.4, 8.0):
        cable(w, (x, wide - 1.2, 3.6), (x + 0.5, wide - 0.35, 1.2), 0.25, 0.009)
    w.box((7.6, wide - 0.1, 0.9), (0.8, 0, 0), (0, 0.3, 0), (0, 0, 1.1), GREY, "y1")  # a switch cabinet
    w.box((3.2, 8.2, 0), (1.2, 0, 0), (0, 0.8, 0), (0, 0, 0.9), YELLOW, "z0")  # a crate
    ins = Instrument(0.25, 0.0012, 0.4, 21.0, 2.2, 20.0, -20.0, False, 0.0)
    stations = [
        Station((4.3, 3.3, 1.6), (28, 150), (-14, 52), 0.0, 0.115),
        Station((10.6, 4.6, 1.62), (30, 152), (-14, 52), 2.6, 0.115),
        Station((8.4, 7.4, 1.75), (-160, -20), (-12, 48), -1.7, 0.12),
    ]
    w.write(folder, stations, ins, (371442.8, 5708215.9, 61.3), -23.5, 25832, "crane hall")


def pipe_bridge(folder: Path) -> None:
    """Writes the pipe bridge: much design, no anomaly."""
    w = World(205)
    w.patch((-4, -10, 0), (26, 0, 0), (0, 15, 0), ASPHALT)
    for x in (1.0, 17.0):  # trestles on footings, of another coating than the bridge
        for y in (0.0, 2.4):
            w.box((x - 0.35, y - 0.35, 0), (0.7, 0, 0), (0, 0.7, 0), (0, 0, 0.35), CONCRETE, "z0")
            w.box((x - 0.22, y - 0.22, 0.35), (0.44, 0, 0), (0, 0.44, 0), (0, 0, 0.025), GREEN, "z0")
            for dx in (-0.17, 0.17):
                for dy in (-0.17, 0.17):
                    bolt(w, (x + dx, y + dy, 0.375), (0, 0, 1), ZINC)

            def hazard(a: np.ndarray, b: np.ndarray) -> np.ndarray:  # black and yellow up to 1.4 m: design
                return np.where(b < 1.4, np.where((a + b) % 0.24 < 0.12, -3.2, 3.4), 0.0)

            o = np.array([x - 0.1, y - 0.1, 0.375])
            z = (0, 0, 4.6)
            for p, e in ((o, (0.2, 0, 0)), (o + (0, 0.2, 0), (0.2, 0, 0)), (o, (0, 0.2, 0)), (o + (0.2, 0, 0), (0, 0.2, 0))):
                w.patch(p, e, z, w.surface(GREEN, hazard))
        for s in (1, -1):
            y0 = 0.1 if s > 0 else 2.3
            d = np.array([0, s * 2.2, 4.2])
            w.tube((x, y0, 0.6), np.array([x, y0, 0.6]) + d, 0.038 if s > 0 else 0.0381, GREEN, ref=(1, 0, 0))
        w.ibeam((x, -0.4, 4.975), (0, 3.2, 0), (0, 0, 1), (1, 0, 0), 0.22, 0.22, 0.0095, 0.016, GREEN)
    # trusses of hollow sections; the middle field was delivered in another grey
    zl, zu = 5.2, 6.7
    for y in (-0.06, 2.34):
        for z in (zl, zu):
            for n, (x0, x1) in enumerate(((-1.5, 5.5), (5.5, 12.5), (12.5, 19.5))):
                m = Material(-3.4, 1.0, 2.0, 7.0, 0.15, 0.7) if n == 1 else GREY
                w.box((x0, y, z), (x1 - x0, 0, 0), (0, 0.12, 0), (0, 0, 0.12), m, "x0 x1")
                w.box((x0 - 0.012, y - 0.05, z - 0.05), (0.024, 0, 0), (0, 0.22, 0), (0, 0, 0.22), GREY)  # joint plates
                for dy in (-0.03, 0.15):
                    for dz in (-0.03, 0.15):
                        bolt(w, (x0 - 0.012, y + dy, z + dz), (-1, 0, 0), ZINC)
        xs = np.arange(-1.4, 19.6, 1.75)
        for n, x in enumerate(xs[:-1]):
            a, b = (zl + 0.12, zu) if n % 2 == 0 else (zu, zl + 0.12)
            w.tube((x, y + 0.06, a), (x + 1.75, y + 0.06, b), 0.038, GREY, ref=(0, 1, 0))
            w.tube((x, y + 0.06, zl + 0.12), (x, y + 0.06, zu), 0.03, GREY, ref=(0, 1, 0))
    for x in np.arange(-1.0, 19.5, 1.75):
        w.box((x, 0.06, zl), (0.08, 0, 0), (0, 2.28, 0), (0, 0, 0.1), GREY, "y0 y1")
    # pipes: blue with bands, flow arrows and flanges; aluminium jacket with laps; white with a heat tape; a small red one
    rng = np.random.default_rng(5)
    for y, r, m, ring, half, pitch in (
        (0.45, 0.162, BLUE, 2.4, 0.12, 3.5),
        (1.1, 0.25, ALU, 0.0, 0.0, 1.0),
        (1.75, 0.11, TAPE, -2.6, 0.09, 2.6),
        (2.1, 0.057, RED, 2.0, 0.08, 2.0),
    ):
        tones = rng.normal(0, 0.5, 40)

        def design(a, b, ring=ring, half=half, pitch=pitch, tones=tones, r=r):
            if not ring:  # sheets of the jacket, one tone each, a lap at each metre
                return tones[np.floor(b).astype(int) % 40] - 1.5 * ((b % 1.0) < 0.015)
            band = ring * (np.abs(b % pitch - 0.8) < half)
            arrow = -0.9 * ring * ((np.abs(b % pitch - 1.35) < 0.22) & (np.abs(a) < 0.45 * r))
            return band + arrow

        z = zl + 0.1 + r + 0.06
        w.tube((-2.0, y, z), (20.0, y, z), r, w.surface(m, design), ref=(0, -1, -0.25))
        if m is not ALU:
            for x in (2.2, 7.45, 12.7, 17.95) if m is not RED else (4.5, 14.5):
                for dx in (-0.026, 0.004):  # flanges of bare or painted steel, bolts around
                    f = w.surface(m if m is BLUE else ZINC)
                    w.tube((x + dx, y, z), (x + dx + 0.022, y, z), r * 1.45 + 0.01, f, ref=(0, -1, 0))
                    for e in (dx, dx + 0.022):
                        w.disc((x + e, y, z), (1, 0, 0), r * 1.45 + 0.01, m if m is BLUE else ZINC, r)
                for t in np.arange(0, 2 * np.pi, np.pi / 4):
                    p = np.array([x - 0.026, y + 1.22 * r * np.cos(t), z + 1.22 * r * np.sin(t)])
                    bolt(w, p, (-1, 0, 0), ZINC)
                    bolt(w, p + (0.052, 0, 0), (1, 0, 0), ZINC)
        for x in np.arange(-1.0, 19.5, 3.5):  # saddles
            w.box((x, y - 0.7 * r, zl + 0.1), (0.08, 0, 0), (0, 1.4 * r, 0), (0, 0, 0.075), ZINC, "z0")
    # labels on chords and trestles, a warning board over the lane, a valve, an earth cable, a walkway rail
    for x in (0.0, 7.0, 14.6):
        w.patch((x, -0.0615, zl + 0.02), (0.42, 0, 0), (0, 0, 0.085), SIGN)
    w.box((8.2, -0.115, zl - 0.5), (1.6, 0, 0), (0, 0.003, 0), (0, 0, 0.45), YELLOW)
    w.patch((8.45, -0.1165, zl - 0.4), (1.1, 0, 0), (0, 0, 0.25), RUBBER)
    w.tube((10.4, 0.45, zl + 0.3), (10.4, 0.45, zl + 0.95), 0.06, BLUE, ref=(0, -1, 0))
    w.disc((10.4, 0.45, zl + 0.95), (0, 0.2, 1), 0.2, w.surface(RED, none=True), 0.17)
    for p, q in (((0.87, -0.1, 0.1), (0.87, -0.1, 5.0)), ((0.87, -0.1, 5.0), (3.0, -0.08, 5.33))):
        w.tube(p, q, 0.008, w.surface(RUBBER, none=True), ref=(1, 0, 0))
    for z in (0.5, 1.0):
        w.tube((-1.5, 2.4, zu + 0.12 + z), (19.5, 2.4, zu + 0.12 + z), 0.0212, YELLOW)
    for x in np.arange(-1.4, 19.6, 1.75):
        w.tube((x, 2.4, zu + 0.12), (x, 2.4, zu + 1.1), 0.0212, YELLOW, ref=(0, 1, 0))
    ins = Instrument(0.3, 0.0015, 0.5, 26.0, 3.0, 20.0, -17.0, True)
    stations = [
        Station((5.6, -7.6, 1.7), (30, 146), (-9, 45), 0.0, 0.05),
        Station((13.4, -6.4, 1.66), (34, 150), (-9, 50), -1.2, 0.05),
    ]
    w.write(folder, stations, ins, (297881.5, 5663048.1, 38.9), 112.0, 25832, "pipe bridge")
