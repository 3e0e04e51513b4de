"""Water on the lining."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from . import shapes
from .arrays import FloatArray
from .canvas import CELL, Canvas, Mark, Window
from .noise import fractal, line, ramp


@dataclass(frozen=True)
class Water:
    """How a wet place looks.

    Attributes
    ----------
    drop : float
        How much it darkens, dB.
    rim : float
        Width over which it fades, metres.
    rough, units : float
        Unevenness of its rim, metres: at random, and with bricks or stones.
    core : float
        How much darker than its margin its inside is, as a share of `drop`.
    film : float
        0 to 1, how much of a film of running water glistens on it.
    fringe : float
        How much brighter a fringe of salts about it is, dB.
    halo : float
        Share of `drop` that reaches a quarter of a metre beyond the rim as a capillary fringe.
    limit : str
        Why an inspector could not tell it, if so.
    """

    drop: float
    rim: float = 0.08
    rough: float = 0.05
    units: float = 0.0
    core: float = 0.25
    film: float = 0.0
    fringe: float = 0.0
    halo: float = 0.12
    limit: str = ""


class Moisture:
    """Brings water onto a canvas and keeps the leaks."""

    def __init__(self, canvas: Canvas, rng: np.random.Generator) -> None:
        self.canvas, self.rng = canvas, rng

    def _soak(self, phenomenon: str, window: Window, field: FloatArray, water: Water) -> None:
        """Darken where `field` is positive."""
        canvas = self.canvas
        field = shapes.ragged(self.rng, canvas, window, field, water.rough, water.units)
        weight = ramp(field / water.rim).astype(np.float32)
        depth = np.tanh(np.maximum(field, 0) / 0.25)
        mottled = 0.13 * fractal(self.rng, window.shape, CELL, (0.35, 0.07), (0.8, 0.5))
        strength = np.clip(1 + water.core * (2 * depth - 0.8) + mottled, 0.35, 1.7)
        fringe = water.halo * ramp((field + 0.12) / 0.30)
        drop = (water.drop * np.maximum(weight * strength, fringe)).astype(np.float32)
        index = window.index
        np.maximum(canvas.drop[index], drop, out=canvas.drop[index])
        np.maximum(canvas.wet[index], weight, out=canvas.wet[index])
        if water.film:
            np.maximum(canvas.film[index], water.film * weight, out=canvas.film[index])
        if water.fringe:
            broken = np.clip(0.6 + 0.6 * fractal(self.rng, window.shape, CELL, (0.5, 0.08), (0.8, 0.4)), 0, 1.3)
            ring = ramp((field + 0.16) / 0.06) * (1 - ramp((field + 0.02) / 0.05)) * broken
            canvas.albedo[index] += (water.fringe * ring).astype(np.float32)
            canvas.others.append(Mark("salt fringe", window, ring.astype(np.float32)))
        canvas.leaks.append(Mark(phenomenon, window, weight, water.limit))

    def patch(self, parts: list[tuple[float, float, float, float]], water: Water, phenomenon: str = "patch") -> None:
        """Union of ellipses (s, t, half lengths)."""
        self._soak(phenomenon, *shapes.blobs(self.canvas, parts, 0.45), water)

    def weeping(
        self, parts: list[tuple[float, float, float, float]], tails: int, length: float, water: Water, phenomenon: str = "patch"
    ) -> None:
        """Patch whose lower rim sends down some thin runs of up to `length` metres."""
        self.patch(parts, water, phenomenon)
        for _ in range(tails):
            s, t, a, b = parts[int(self.rng.integers(len(parts)))]
            start = s + a * self.rng.uniform(-0.6, 0.6)
            thin = replace(water, rim=min(water.rim, 0.06), rough=0.02, units=0.02, fringe=0.0)
            down = length * self.rng.uniform(0.4, 1.0) + b * 0.6
            self.run(start, t + 0.3 * b * np.sign(t), down, self.rng.uniform(0.09, 0.20), thin, phenomenon)

    def run(
        self, s: float, t: float, length: float, width: float, water: Water, phenomenon: str = "run", source: float = 0.0
    ) -> None:
        """Water that runs down from a point; about its source a damp round of radius `source`."""
        path, widths = shapes.falling(self.rng, s, t, length, width)
        if source:
            widths = np.concatenate([[source, source * 0.9], widths])
            path = np.concatenate([path[:1] - [0, 0.04 * np.sign(t)], path[:1], path])
        self._soak(phenomenon, *shapes.strip(self.canvas, path, widths, 0.4), water)

    def seam(
        self, corners: shapes.Path, width: float, water: Water, phenomenon: str = "wet joint", wander: float = 0.02
    ) -> None:
        """Wet strip along a joint, crack or fracture."""
        path, widths = shapes.wandering(self.rng, corners, width, wander, 0.35)
        self._soak(phenomenon, *shapes.strip(self.canvas, path, widths, 0.4), water)

    def foot(self, side: float, s0: float, s1: float, low: float, high: float, rise: float, water: Water) -> None:
        """Water that rises in the foot of a wall from girth `low` to about `high`; `side` is -1 on the left."""
        t0, t1 = sorted((side * low, side * (high - 2.2 * rise - 0.3)))
        window = self.canvas.window(s0 - 0.6, s1 + 0.6, t0, t1)
        up = low - side * window.t[None, :]
        limit = low - high + rise * (line(self.rng, window.s, 1.1) + 0.4 * line(self.rng, window.s, 0.3))[:, None]
        ends = np.minimum(window.s - s0, s1 - window.s)[:, None]
        self._soak("wet foot", window, np.minimum(limit - up, ends * 0.6), water)

    def drips(self, spots: list[tuple[float, float]], radius: float, water: Water) -> None:
        """Separate drops under the crown."""
        for s, t in spots:
            r = radius * self.rng.uniform(0.7, 1.3)
            self._soak("drip", *shapes.blobs(self.canvas, [(s, t, r, r * self.rng.uniform(0.8, 1.4))], 0.35), water)
