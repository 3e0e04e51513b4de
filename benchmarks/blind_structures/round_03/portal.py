"""The head wall of a tunnel portal in stone: mortar joints, damp at the foot, efflorescence, a steel door and a pipe."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from .engine import Array, Material, Quad, Scanner, View, World, band, blob, deliver, patch, run
from .parts import CONCRETE, GALVANISED, GRAVEL, RUST, WET, blades, bush, ground

STONE = Material(0.36, 0.92, tex=0.55, grain=0.12)
DRESSED = Material(0.42, 0.92, tex=0.4, grain=0.12)
DOOR = Material(0.30, 0.85, 0.9, 17.0, tex=0.15, grain=0.4)
SALT = Material(0.78, 0.95, tex=0.7, grain=0.12)
MOSS = Material(0.24, 0.8, tex=0.8, grain=0.05)


class Masonry:
    """Courses of stones with recessed joints: relief in metres and gain in dB over u, v."""

    def __init__(
        self,
        seed: int,
        course: tuple[float, float],
        stone: tuple[float, float],
        relief: float,
        tone: float,
        joint: float = 0.018,
    ) -> None:
        rng = np.random.default_rng(seed)
        self.edges = np.cumsum(np.r_[0.0, rng.uniform(*course, 60)])
        self.width, self.start = rng.uniform(*stone, 61), rng.uniform(0, 1, 61)
        self.jit = rng.uniform(-0.14, 0.14, (61, 97))
        self.bulge, self.tone = relief * rng.standard_normal((61, 97)), tone * rng.standard_normal((61, 97))
        self.joint = joint
        w = World(seed)
        self.fine, self.broad = w.pool[1][1], w.pool[2][1]

    def _cell(self, u: Array, v: Array) -> tuple[Array, Array, Array]:
        i = np.clip(np.searchsorted(self.edges, v, side="right") - 1, 0, 59)
        x = u / self.width[i] + self.start[i] + 40
        k = np.floor(x).astype(int)
        left, right = k + self.jit[i, k % 97], k + 1 + self.jit[i, (k + 1) % 97]
        k = np.where(x < left, k - 1, np.where(x > right, k + 1, k))
        left, right = k + self.jit[i, k % 97], k + 1 + self.jit[i, (k + 1) % 97]
        du = np.minimum(x - left, right - x) * self.width[i]
        wob = 0.004 * self.broad(u, v)
        d = np.minimum(np.minimum(v - self.edges[i], self.edges[i + 1] - v), du) + wob
        return i, k % 97, d

    def height(self, u: Array, v: Array) -> Array:
        """Relief above the mean face."""
        i, k, d = self._cell(u, v)
        face = self.bulge[i, k] + 0.0025 * self.fine(u, v) + 0.003 * self.broad(u, v)
        edge = np.clip((d - self.joint / 2) / 0.02, 0, 1)
        return np.where(d < self.joint / 2, -0.010 + 0.001 * self.fine(u, v), face * edge - 0.010 * (1 - edge) ** 2)

    def gain(self, u: Array, v: Array) -> Array:
        """Tone of the stones; mortar is lighter."""
        i, k, d = self._cell(u, v)
        return np.where(d < self.joint / 2, 1.3, self.tone[i, k])


def _lay(q: Quad, m: Masonry) -> Quad:
    q.height, q.gain = m.height, m.gain
    return q


def build() -> World:
    """The wall lies in y = 0 and looks towards -y; the track runs along y."""
    w = World(303)
    ground(w, GRAVEL)
    big, fine = Masonry(3031, (0.34, 0.46), (0.5, 0.95), 0.004, 0.55), Masonry(3032, (0.30, 0.38), (0.4, 0.7), 0.003, 0.45)
    half, spring, rad = 2.6, 2.9, 2.6
    n, up = (0, -1, 0), (0, 0, 1)
    left = _lay(w.quad((-6.35, 0, 0), n, up, 3.5, 7.2, STONE), big)
    mid = _lay(w.quad((0, 0, 0), n, up, 7.4, 7.2, STONE), big)
    right = _lay(w.quad((6.35, 0, 0), n, up, 3.5, 7.2, STONE), big)
    if mid.eu[0] < 0:
        raise AssertionError("u must run along x")

    def open_(u: Array, v: Array) -> Array:
        return ~((np.abs(u) < half) & (v < spring)) & ~(np.hypot(u, v - spring) < rad)

    mid.mask = open_
    door_x, door_w, door_h = -0.35, 1.05, 2.15
    left.mask = lambda u, v: ~((np.abs(u - door_x) < door_w / 2) & (v > 0.12) & (v < 0.12 + door_h))
    # voussoirs and quoins stand out by 4 cm
    arch = w.disc((0, -0.04, spring), n, rad + 0.5, DRESSED, rad)
    ring = arch.mask
    arch.mask = lambda u, v: ring(u, v) & (v > rad + 0.5)
    arch.gain = lambda u, v: np.where(np.abs((np.arctan2(v - rad - 0.5, u) * 2.85 / 0.42) % 1 - 0.5) > 0.478, 0.9, 0.0)
    arch.height = lambda u, v: np.where(np.abs((np.arctan2(v - rad - 0.5, u) * 2.85 / 0.42) % 1 - 0.5) > 0.478, -0.008, 0.0)
    for k in (-1, 1):
        _lay(w.quad((k * 2.85, -0.04, 0), n, up, 0.5, spring, DRESSED), fine)
    pil = [w.box((k * 4.15, 0.03, 0), (k * 4.15, 0.03, 7.2), 0.56, 0.9, DRESSED, (1, 0, 0)) for k in (-1, 1)]
    fronts = []
    for p in pil:
        f = min(p.values(), key=lambda q: q.n[1])
        _lay(f, fine)
        fronts.append(f)
    cornice = w.box((-8.3, -0.1, 7.3), (8.3, -0.1, 7.3), 0.75, 0.24, DRESSED)
    parapet = _lay(w.quad((0, -0.02, 7.42), n, up, 16.4, 0.75, STONE), fine)
    w.box((-8.3, 0.1, 8.25), (8.3, 0.1, 8.25), 0.5, 0.16, CONCRETE)
    # inside: side walls and vault of brick
    brick = Masonry(3033, (0.074, 0.078), (0.24, 0.26), 0.001, 0.35, 0.010)
    for k in (-1, 1):
        q = w.quad((k * half, 5.98, 0), (-k, 0, 0), up, 12.04, spring, STONE)
        q.gain = brick.gain
    vault = w.cyl((0, -0.04, spring), (0, 12, spring), rad, STONE, ref=(0, 0, 1), inside=True)
    vault.mask = lambda u, v: np.abs(u) < rad * math.pi / 2
    w.anomaly(vault, "soot", blob(0.2, 1.0, 1.9, 1.6, 811, 0.3), Material(0.09, 0.95, tex=0.5, grain=0.12))
    # the door in its niche
    dx = -6.35 + door_x
    zc = 0.12
    d = w.quad((dx, 0.16, zc), n, up, door_w, door_h, DOOR)
    for k in (-1, 1):
        w.quad((dx + k * door_w / 2, 0.08, zc), (-k, 0, 0), up, 0.16, door_h, DRESSED)
    w.quad((dx, 0.08, zc + door_h), (0, 0, -1), (1, 0, 0), 0.16, door_w, DRESSED)
    w.box((dx - 0.42, 0.14, zc + 1.05), (dx - 0.30, 0.14, zc + 1.05), 0.03, 0.03, Material(0.2, 1.3, 4.0, 14.0))
    for z in (0.3, 1.8):
        w.box((dx + 0.5, 0.14, zc + z), (dx + 0.5, 0.14, zc + z + 0.16), 0.03, 0.05, DOOR)
    d.design(patch(0.1, 1.6, 0.30, 0.20, 41, brush=0.0), Material(0.78, 0.9, 0.6, 16.0, tex=0.05))
    # louvres
    d.design(lambda u, v: 1.0 * ((np.abs(u) < 0.35) & (np.abs((v * 40) % 1 - 0.5) < 0.2) & (v > 0.35) & (v < 0.6)), -3.0)
    w.anomaly(d, "rust", band(0.16, 821, 0.07, 0.3), RUST)
    w.anomaly(d, "rust run", run(-0.36, 1.0, 0.7, 0.09, 823), RUST)
    # the pipe with its clamps, and what leaks from it
    pipe = w.cyl((5.5, -0.16, 0.35), (5.5, -0.16, 7.1), 0.065, Material(0.33, 1.0, 1.6, 15.0, tex=0.3))
    for z in (1.0, 2.6, 4.2, 5.8):
        w.cyl((5.5, -0.16, z), (5.5, -0.16, z + 0.05), 0.078, GALVANISED)
        w.box((5.5, -0.1, z + 0.025), (5.5, 0.0, z + 0.025), 0.04, 0.03, GALVANISED)
    w.anomaly(pipe, "rust", blob(0.0, 3.05, 0.10, 0.42, 825, 0.4), RUST)

    # damp, salts, moss, patches of mortar
    w.anomaly(left, "moisture", band(0.75, 831, 0.22, 0.9, 0.15, 1.75), WET)
    w.anomaly(mid, "moisture", blob(3.4, 0.55, 0.55, 0.8, 833), WET)
    w.anomaly(right, "moisture", band(0.95, 835, 0.28, 1.1, -1.75, 0.9), WET)
    w.anomaly(right, "moisture", run(-0.82, 4.2, 3.0, 0.42, 837, taper=-0.3), WET)
    w.anomaly(fronts[0], "moisture", band(0.8, 839, 0.2, 0.6), WET)
    w.anomaly(left, "efflorescence", run(0.7, 5.9, 2.2, 0.5, 841, taper=0.2), SALT)
    w.anomaly(mid, "efflorescence", blob(-2.6, 6.0, 0.75, 0.45, 843, 0.45), SALT)
    w.anomaly(mid, "efflorescence", run(2.4, 6.9, 1.3, 0.4, 845, taper=0.3), SALT)
    w.anomaly(right, "efflorescence", blob(0.75, 5.2, 0.5, 0.7, 847, 0.4), SALT)
    w.anomaly(fronts[1], "efflorescence", run(0.1, 5.4, 1.6, 0.3, 849, taper=0.1), SALT)
    w.anomaly(arch, "soot", blob(0.0, 2 * rad + 0.75, 0.95, 0.30, 851, 0.3), Material(0.10, 0.95, tex=0.5, grain=0.12))
    front = min(cornice.values(), key=lambda q: q.n[1])
    w.anomaly(front, "moss", blob(0.02, 11.2, 0.2, 1.3, 853, 0.45), MOSS)
    w.anomaly(parapet, "repointing", patch(4.1, 0.36, 1.3, 0.5, 855, 1.0, 0.02), Material(0.58, 0.95, tex=0.3))

    for k in (-0.75, 0.75):
        w.box((k, -9.0, 0.17), (k, 11.0, 0.17), 0.07, 0.16, Material(0.14, 1.2, 3.5, 12.0))
    for y in np.arange(-9.0, 11.0, 0.65):
        w.box((-1.25, y, 0.06), (1.25, y, 0.06), 0.24, 0.14, CONCRETE)
    blades(w, -8, -3.2, -1.2, -0.1, 160, 0.55)
    blades(w, 3.2, 8, -1.6, -0.1, 200, 0.6)
    bush(w, 7.3, -1.3, 2.0, 420)
    w.cyl((-8.4, -0.6, 6.2), (8.4, -0.5, 6.0), 0.008, Material(0.2, tex=0), smooth=False)
    return w


def make(folder: Path) -> None:
    """One station at 15 m, 1550 nm."""
    tool = Scanner(beam=0.3, sigma=0.0015, noise=0.45, const=33.0, near=2.0, floor=2.0)
    views = [View((1.4, -15.0, 1.85), (59, 122.5), (-7, 25.5), 0.055)]
    deliver(folder, build(), views, tool, 33, 2056, (2688104.3, 1171953.8, 512.7), 148.0)
