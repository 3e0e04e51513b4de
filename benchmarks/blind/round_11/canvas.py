"""The painted lining: tone, relief and water on the unrolled grid, with a record of all that was painted on purpose."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy import ndimage

from .texture import Grid, Shape, fractal, smoothstep


@dataclass
class Wet:
    """A leak as it was painted: where, and how much of its darkening is there."""

    window: tuple[slice, slice]
    share: np.ndarray
    phenomenon: str
    limit: str | None


@dataclass
class Mark:
    """Something dry that is dark or bright."""

    window: tuple[slice, slice]
    share: np.ndarray
    kind: str


@dataclass
class Canvas:
    """Tone (dB), water (dB) and relief (metres, positive into the lining) of the unrolled lining."""

    grid: Grid
    rng: np.random.Generator
    crown: float
    dry: np.ndarray = field(init=False)
    water: np.ndarray = field(init=False)
    relief: np.ndarray = field(init=False)
    wets: list[Wet] = field(default_factory=list)
    marks: list[Mark] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Empty layers."""
        self.dry = np.zeros(self.grid.shape, np.float32)
        self.water = np.zeros(self.grid.shape, np.float32)
        self.relief = np.zeros(self.grid.shape, np.float32)

    def down(self, u: float) -> int:
        """Which way along the girth water runs."""
        return 1 if u > self.crown else -1

    @property
    def s(self) -> np.ndarray:
        """Chainages of rows, as a column."""
        return ((np.arange(self.grid.shape[0], dtype=np.float32) + 0.5) * self.grid.cell)[:, None]

    @property
    def u(self) -> np.ndarray:
        """Girths of columns, as a row."""
        return ((np.arange(self.grid.shape[1], dtype=np.float32) + 0.5) * self.grid.cell)[None, :]

    # ------------------------------------------------------------------ surfaces

    def cloud(self, deviation: float, scale_s: float, scale_u: float, octaves: int = 3) -> np.ndarray:
        """Noise over the whole lining with waves of a size in metres."""
        cell = self.grid.cell
        return np.float32(deviation) * fractal(self.grid.shape, (scale_s / cell, scale_u / cell), self.rng, octaves)

    def concrete(self, clouds: float = 0.45, grain: float = 0.3, streaks: float = 0.3, pores_per_m2: float = 6.0) -> None:
        """Cast concrete: clouds of tone, grain, faint vertical streaks and air pores."""
        self.dry += self.cloud(clouds, 2.4, 1.6)
        self.dry += self.cloud(clouds * 0.6, 0.5, 0.5)
        self.dry += self.cloud(streaks, 0.12, 2.5, 2)
        self.dry += np.float32(grain) * self.rng.standard_normal(self.grid.shape, dtype=np.float32)
        self.pores(pores_per_m2)

    def pores(self, per_m2: float, depth_db: float = -2.2) -> None:
        """Air pores: single dark cells."""
        rows, columns = self.grid.shape
        count = int(per_m2 * self.grid.length * self.grid.girth)
        at = self.rng.integers(0, rows, count), self.rng.integers(0, columns, count)
        self.dry[at] += np.float32(depth_db) * self.rng.uniform(0.3, 1.2, count).astype(np.float32)

    def shade(self, profile_u: np.ndarray, tone_db: np.ndarray, uneven: float = 0.25, waves: float = 3.0) -> None:
        """A tone that changes round the section (dust, soot), a little uneven along the tunnel."""
        level = np.interp(self.u[0], profile_u, tone_db).astype(np.float32)[None, :]
        self.dry += level * (1 + self.cloud(uneven, waves, 0.7))

    # ------------------------------------------------------------------ painting

    def paint(
        self, shape: Shape, tone_db: float, edge: float, kind: str | None = None, uneven: float = 0.15, relief: float = 0.0
    ) -> None:
        """Paint something dry; ``kind`` records it, ``relief`` also sets it back (or, negative, forward)."""
        if not shape.distance.size:
            return
        share = smoothstep(shape.distance / np.float32(edge) + 0.5)
        mottle = 1 + np.float32(uneven) * fractal(share.shape, (30, 30), self.rng, 2)
        self.dry[shape.window] += np.float32(tone_db) * share * mottle
        if relief:
            self.relief[shape.window] += np.float32(relief) * share
        if kind is not None:
            self.marks.append(Mark(shape.window, share.astype(np.float32), kind))

    def soak(
        self,
        shape: Shape,
        drop_db: float,
        edge: float,
        phenomenon: str,
        limit: str | None = None,
        salt_db: float = 0.0,
        salt_width: float = 0.05,
        uneven: float = 0.2,
    ) -> None:
        """Paint water: darker by about ``drop_db``, with edges here soft, there sharp, and perhaps a bright fringe of salts."""
        if not shape.distance.size:
            return
        grid, rng = self.grid, self.rng
        softness = np.float32(edge) * (1 + 0.65 * np.clip(fractal(shape.distance.shape, (60, 60), rng, 2), -1.3, 1.6))
        share = smoothstep(shape.distance / np.maximum(softness, 0.008) + 0.5)
        share *= self._without_crumbs(share)
        inner = 0.82 + 0.25 * smoothstep(shape.distance / np.float32(max(3 * edge, 0.15)))
        inner *= 1 + np.float32(uneven) * np.clip(fractal(share.shape, (25, 60), rng, 3), -1.6, 1.6)
        self.water[shape.window] = np.minimum(self.water[shape.window], -np.float32(drop_db) * share * inner)
        self.wets.append(Wet(shape.window, share.astype(np.float32), phenomenon, limit))
        if salt_db:
            self._salts(shape, salt_db, salt_width, grid.cell)

    def _without_crumbs(self, share: np.ndarray, least: float = 0.006) -> np.ndarray:
        """One where a wet piece is larger than a palm, zero for crumbs beside it."""
        label, count = ndimage.label(share > 0.02, structure=np.ones((3, 3)))
        if count <= 1:
            return np.ones_like(share)
        core = ndimage.sum_labels(share >= 0.5, label, np.arange(count + 1))
        return (core * self.grid.cell**2 >= least)[label].astype(np.float32)

    def _salts(self, shape: Shape, salt_db: float, width: float, cell: float) -> None:
        """A patchy bright fringe just outside the outline."""
        away = -shape.distance - np.float32(width * 0.9)
        band = smoothstep(1.5 - np.abs(away) / np.float32(width))
        patchy = smoothstep(0.5 + 0.9 * fractal(band.shape, (0.35 / cell, 0.35 / cell), self.rng, 3))
        share = (band * patchy).astype(np.float32)
        self.dry[shape.window] += np.float32(salt_db) * share
        self.marks.append(Mark(shape.window, share, "salt fringe"))

    # ------------------------------------------------------------------ results

    @property
    def tone(self) -> np.ndarray:
        """Tone with water, dB."""
        return self.dry + self.water

    def slopes(self) -> tuple[np.ndarray, np.ndarray]:
        """Slope of the relief along the chainage and along the girth."""
        smooth = ndimage.gaussian_filter(self.relief, 1.2)
        return tuple(np.clip(np.gradient(smooth, self.grid.cell, axis=axis), -0.45, 0.45).astype(np.float32) for axis in (0, 1))
