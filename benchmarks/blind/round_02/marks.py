"""What is dark but dry on a lining, or bright: soot, repairs, lime, rust, paint."""

from __future__ import annotations

import numpy as np

from . import shapes
from .arrays import FloatArray
from .canvas import CELL, Canvas, Mark, Window
from .linings import brickwork, lay, sprayed
from .noise import fractal, line, ramp, smooth


class Marks:
    """Brings dirt, repairs and deposits onto a canvas and keeps their outlines."""

    def __init__(self, canvas: Canvas, rng: np.random.Generator) -> None:
        self.canvas, self.rng = canvas, rng

    def note(self, kind: str, window: Window, weight: FloatArray) -> None:
        """Keep the outline of something."""
        self.canvas.others.append(Mark(kind, window, weight.astype(np.float32)))

    def soot(self, tracks: tuple[float, ...], depth: float, width: float, flaked: float = 0.0, noted: bool = True) -> None:
        """Soot where the blast met the lining above each track.

        Parameters
        ----------
        tracks : tuple of float
            Girths of the middles of the bands.
        depth, width : float
            Darkening in the middle, dB, and half width of a band, metres.
        flaked : float
            Share of the band whose crust has fallen off.
        noted : bool
            Whether it has an outline in the truth.
        """
        canvas, rng = self.canvas, self.rng
        window = canvas.whole()
        band = np.zeros(canvas.shape, dtype=np.float32)
        for middle in tracks:
            sway = middle + 0.15 * line(rng, canvas.s, 4.0)
            breadth = width * (1 + 0.12 * line(rng, canvas.s, 2.5))
            x = np.abs(canvas.t[None, :] - sway[:, None]) / breadth[:, None]
            band = np.maximum(band, 1 / (1 + x**4)).astype(np.float32)
        smoke = np.clip(1 + fractal(rng, canvas.shape, CELL, (3.0, 0.7, 0.15), (0.16, 0.14, 0.08)), 0.2, 1.6)
        crust = band * smoke
        if flaked:
            level = 1.55 - 2.2 * flaked
            gone = ramp((fractal(rng, canvas.shape, CELL, (0.5, 0.16), (0.8, 0.5)) + 0.5 * canvas.units - level) / 0.12)
            crust = crust * (1 - 0.75 * gone)
        canvas.albedo -= (depth * crust).astype(np.float32)
        canvas.soot[:] = np.maximum(canvas.soot, np.clip(depth * crust / 7, 0, 1))
        if noted:
            self.note("soot", window, crust)

    def grime(self, side: float, foot: float, height: float, depth: float) -> None:
        """Brake dust on the lower wall, fading upward over `height`; bright dust if `depth` is negative."""
        canvas = self.canvas
        up = foot - side * canvas.t[None, :]
        top = height * (1 + 0.2 * line(self.rng, canvas.s, 3.0))[:, None]
        fade = np.clip(1 - up / top, 0, 1) * (side * canvas.t[None, :] > 0)
        patchy = np.clip(1 + fractal(self.rng, canvas.shape, CELL, (0.9, 0.2), (0.25, 0.15)), 0, 2)
        canvas.albedo -= (depth * fade**1.3 * patchy).astype(np.float32)

    def _blend(self, kind: str, window: Window, weight: FloatArray, change: FloatArray | float) -> None:
        """Change the reflectance by so many dB where `weight` is."""
        self.canvas.albedo[window.index] += (weight * change).astype(np.float32)
        self.note(kind, window, weight)

    def rebuilt(self, s0: float, s1: float, t0: float, t1: float, level: float, kind: str, scatter: float = 0.5) -> None:
        """Casing of other brick, toothed into the old work; its face is free of soot."""
        canvas, rng = self.canvas, self.rng
        window, field = shapes.rectangle(canvas, s0, s1, t0, t1, 0.3)
        mask = ramp((field + 0.09 * canvas.units[window.index]) / 0.012)
        before = canvas.albedo[window.index].copy()
        lay(canvas, window, brickwork(rng, window, level, scatter, 0.0, 1.2), mask)
        canvas.albedo[window.index] += 0.35 * mask * (before - before.mean())
        canvas.soot[window.index] *= 1 - mask
        self.note(kind, window, mask)

    def sprayed_patch(self, parts: list[tuple[float, float, float, float]], level: float, thickness: float = 0.03) -> None:
        """Patch of sprayed concrete with feathered rims and overspray."""
        canvas, rng = self.canvas, self.rng
        window, field = shapes.blobs(canvas, parts, 0.6)
        field = shapes.ragged(rng, canvas, window, field, 0.08, 0.0)
        mask = ramp(field / 0.10)
        albedo, relief, units = sprayed(rng, window, level)
        lay(canvas, window, (albedo, relief + np.float32(thickness), units), mask)
        canvas.albedo[window.index] += (1.0 * ramp((field + 0.2) / 0.3) * (1 - mask)).astype(np.float32)
        canvas.soot[window.index] *= 1 - mask
        self.note("sprayed concrete patch", window, mask)

    def pointed(self, parts: list[tuple[float, float, float, float]], change: float) -> None:
        """Cement smeared over the joints by repointing; bricks show through."""
        window, field = shapes.blobs(self.canvas, parts, 0.4)
        field = shapes.ragged(self.rng, self.canvas, window, field, 0.08, 0.06)
        smear = np.clip(0.65 + 0.3 * smooth(self.rng, window.shape, CELL, 0.06), 0.2, 1)
        self._blend("repointing", window, ramp(field / 0.08), change * smear)

    def lime(self, s: float, t: float, length: float, width: float, gain: float, count: int = 3, kind: str = "calcite") -> None:
        """Calcite that has run down and stands before the lining as a bright crust of several tongues."""
        canvas, rng = self.canvas, self.rng
        for _ in range(count):
            start = s + rng.uniform(-0.5, 0.5) * width
            path, half = shapes.falling(rng, start, t, length * rng.uniform(0.55, 1.0), width / count * rng.uniform(0.6, 1.5))
            part, tongue = shapes.strip(canvas, path, half, 0.3)
            weight = ramp(shapes.ragged(rng, canvas, part, tongue, 0.02, 0.0) / 0.04)
            self._blend(kind, part, weight, gain * np.clip(1 + 0.2 * smooth(rng, part.shape, CELL, 0.07), 0.3, 1.6))
            crust = (0.008 + 0.004 * smooth(rng, part.shape, CELL, 0.09, 0.2)) * weight
            canvas.relief[part.index] += crust.astype(np.float32)
            canvas.soot[part.index] *= 1 - weight

    def stain(self, s: float, t: float, length: float, width: float, depth: float, kind: str) -> None:
        """Dry streak: rust below iron, soot washed down, bitumen that has run."""
        path, half = shapes.falling(self.rng, s, t, length, width, 0.04)
        window, field = shapes.strip(self.canvas, path, half, 0.3)
        fade = np.clip(1 - np.abs(window.t - t)[None, :] / (1.25 * length), 0.2, 1)
        field = shapes.ragged(self.rng, self.canvas, window, field, 0.02, 0.0)
        self._blend(kind, window, ramp(field / 0.05), -depth * fade)

    def blotch(
        self, parts: list[tuple[float, float, float, float]], change: float, kind: str, rim: float = 0.06, rough: float = 0.05
    ) -> None:
        """Dry spot of other brightness: paint, bitumen, a spalled face, scorched soot, plaster."""
        window, field = shapes.blobs(self.canvas, parts, 0.4)
        units = 0.08 if kind == "spalled face" else 0.0
        field = shapes.ragged(self.rng, self.canvas, window, field, rough, units)
        weight = ramp(field / rim)
        self._blend(kind, window, weight, change * np.clip(1 + 0.12 * smooth(self.rng, window.shape, CELL, 0.1), 0.5, 1.5))
        if kind == "spalled face":
            self.canvas.relief[window.index] -= (0.02 * weight).astype(np.float32)
            self.canvas.soot[window.index] *= 1 - weight

    def painted(self, s0: float, s1: float, t0: float, t1: float, change: float, kind: str, worn: float = 0.3) -> None:
        """Band or board of paint or limewash, worn by a share."""
        window, field = shapes.rectangle(self.canvas, s0, s1, t0, t1, 0.05)
        wear = fractal(self.rng, window.shape, CELL, (0.5, 0.08), (0.7, 0.6))
        weight = ramp(field / 0.012) * (1 - ramp((wear - 1.6 + 2.5 * worn) / 0.2))
        self._blend(kind, window, weight, change)

    def chase(self, s: float, t0: float, t1: float, width: float, change: float) -> None:
        """Drainage channel cut into the lining and closed with mortar."""
        window, field = shapes.rectangle(self.canvas, s - width / 2, s + width / 2, t0, t1, 0.1)
        field = field + 0.012 * smooth(self.rng, window.shape, CELL, 0.12)
        weight = ramp(field / 0.015)
        trowel = 0.5 * smooth(self.rng, window.shape, CELL, 0.15, 0.05)
        self._blend("drainage channel", window, weight, change + trowel)
        self.canvas.relief[window.index] -= (0.012 * weight).astype(np.float32)
        self.canvas.soot[window.index] *= 1 - weight

    def weephole(self, s: float, t: float, radius: float = 0.045) -> None:
        """Hole through the lining."""
        window = self.canvas.window(s - 0.12, s + 0.12, t - 0.12, t + 0.12)
        hole = ramp((radius - np.hypot(window.s[:, None] - s, window.t[None, :] - t)) / 0.012)
        self.canvas.albedo[window.index] -= (6 * hole).astype(np.float32)
        self.canvas.relief[window.index] -= (0.10 * hole).astype(np.float32)
        self.note("weephole", window, hole)

    def niche(self, s: float, t0: float, t1: float, width: float = 1.0, depth: float = 0.45) -> None:
        """Refuge in the wall."""
        window, field = shapes.rectangle(self.canvas, s - width / 2, s + width / 2, t0, t1, 0.1)
        hollow = ramp(field / 0.02)
        self.canvas.relief[window.index] -= (depth * hollow).astype(np.float32)
        self._blend("refuge", window, hollow, -1.0)
