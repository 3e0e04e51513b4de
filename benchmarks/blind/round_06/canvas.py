"""The unrolled lining: what it reflects, where it is wet, how its surface stands out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy import ndimage

from .fields import Array, Part, inside, noise
from .tunnel import Section

CELL = 0.015
"""Width of the cells (m)."""

SPECK = 0.012
"""Wet specks smaller than this are left out (m²)."""


@dataclass(frozen=True)
class Leak:
    """Water on the lining.

    Attributes
    ----------
    parts : sequence of Part
        What it is put together of.
    drop : float
        Loss well inside (dB).
    phenomenon : str
        What it is.
    side : int
        1 right, -1 left.
    soft : float
        How gradually it begins (m).
    warp : float
        How ragged its outline is (m).
    uneven : float
        Deviation of the loss inside, as part of the loss.
    fade : float
        Loss at the bottom less loss at the top, as part of the loss.
    gloss : float
        Mirror reflection of the film.
    tide : float
        Brightening by salt along the outline (dB).
    limit : str
        Why it cannot be told.
    """

    parts: Sequence[Part]
    drop: float
    phenomenon: str
    side: int = 1
    soft: float = 0.03
    warp: float = 0.05
    uneven: float = 0.12
    fade: float = 0.0
    gloss: float = 0.05
    tide: float = 0.0
    limit: str = ""


@dataclass(frozen=True)
class Stain:
    """Outline, kept for ``other.geojson``: signed field over a part of the canvas."""

    kind: str
    change: float
    rows: slice
    columns: slice
    outline: Array


@dataclass
class Canvas:
    """Rasters over chainage (rows) and ``u`` (columns)."""

    section: Section
    length: float
    rng: np.random.Generator
    base: float
    leaks: list[Leak] = field(default_factory=list)
    stains: list[Stain] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.s = np.arange(0, self.length + CELL, CELL, dtype=np.float32)
        half = self.section.around / 2
        self.u = np.arange(-half, half + CELL, CELL, dtype=np.float32)
        self.shape = len(self.s), len(self.u)
        self.wall = np.abs(self.u) < self.section.foot
        self.albedo = np.full(self.shape, self.base, np.float32)
        self.drop = np.zeros(self.shape, np.float32)
        self.gloss = np.zeros(self.shape, np.float32)
        self.relief = np.zeros(self.shape, np.float32)
        self.outline = np.full(self.shape, 9.0, np.float32)
        self.owner = np.full(self.shape, -1, np.int16)
        self.hole = np.zeros(self.shape, bool)

    def noise(self, scale: float | tuple[float, float], shape: tuple[int, int] | None = None) -> Array:
        """Noise with features of ``scale`` metres."""
        scales = (scale, scale) if isinstance(scale, int | float) else scale
        return noise(self.rng, shape or self.shape, (scales[0] / CELL, scales[1] / CELL))

    def texture(self, *octaves: tuple[float, float]) -> None:
        """Add noise to the reflectance: pairs of scale (m) and deviation (dB)."""
        for scale, deviation in octaves:
            self.albedo += deviation * self.noise(scale)

    def rough(self, *octaves: tuple[float, float]) -> None:
        """Add noise to the surface: pairs of scale and deviation (m); the floor stays even."""
        fade = np.clip((self.section.foot - np.abs(self.u)) / 0.3, 0, 1)
        for scale, deviation in octaves:
            self.relief += deviation * self.noise(scale) * fade

    def _window(self, parts: Sequence[Part], side: int, margin: float) -> tuple[slice, slice]:
        s0, s1 = min(p.box[0] for p in parts) - margin, max(p.box[1] for p in parts) + margin
        v0, v1 = min(p.box[2] for p in parts) - margin, max(p.box[3] for p in parts) + margin
        u0, u1 = (v0, v1) if side > 0 else (-v1, -v0)
        return (
            slice(*np.clip(np.searchsorted(self.s, [s0, s1]), 0, self.shape[0])),
            slice(*np.clip(np.searchsorted(self.u, [u0, u1]), 0, self.shape[1])),
        )

    def _field(self, parts: Sequence[Part], side: int, warp: float, rows: slice, columns: slice) -> Array:
        S, V = self.s[rows, None], side * self.u[None, columns]
        shape = rows.stop - rows.start, columns.stop - columns.start
        ripple = self.noise(0.5, shape) + 0.4 * self.noise(0.12, shape)
        outline = np.minimum.reduce([part.field(S, V) + min(warp, part.ragged) * ripple for part in parts])
        return np.asarray(np.maximum(outline, V - self.section.foot), np.float32)

    def paint(
        self, parts: Sequence[Part], change: float, kind: str = "", side: int = 1, soft: float = 0.02, warp: float = 0.0
    ) -> None:
        """Change the reflectance by ``change`` dB; with ``kind`` the outline is kept as something dry."""
        rows, columns = self._window(parts, side, 5 * soft + 3 * warp + 0.05)
        outline = self._field(parts, side, warp, rows, columns)
        self.albedo[rows, columns] += change * inside(outline, soft) * self.wall[columns]
        if kind:
            self.stains.append(Stain(kind, change, rows, columns, outline))

    def wet(self, leak: Leak) -> None:
        """Put water on the lining."""
        rows, columns = self._window(leak.parts, leak.side, 5 * leak.soft + 3 * leak.warp + 0.05)
        outline = _without_specks(self._field(leak.parts, leak.side, leak.warp, rows, columns))
        shape = (outline.shape[0], outline.shape[1])
        soft = leak.soft * np.exp(0.4 * self.noise(0.6, shape))
        down = np.linspace(-0.5, 0.5, shape[1])[:: leak.side]
        strength = np.clip(1 + leak.uneven * self.noise(0.35, shape) + leak.fade * down, 0.4, 1.6)
        share = inside(outline, soft) * self.wall[columns]
        self.albedo[rows, columns] += leak.tide * np.exp(-(((outline - 0.07) / 0.04) ** 2)) * self.wall[columns]
        drop = leak.drop * strength * share
        self.gloss[rows, columns] = np.maximum(self.gloss[rows, columns], leak.gloss * share)
        nearer = outline < self.outline[rows, columns]
        self.owner[rows, columns][nearer] = len(self.leaks)
        self.outline[rows, columns] = np.minimum(self.outline[rows, columns], outline)
        self.drop[rows, columns] = np.maximum(self.drop[rows, columns], drop)
        self.leaks.append(leak)

    def sample(self, grid: Array, s: Array, u: Array) -> Array:
        """Bilinear values."""
        x, y = np.clip(s / CELL, 0, self.shape[0] - 1.001), np.clip((u - self.u[0]) / CELL, 0, self.shape[1] - 1.001)
        i, j = x.astype(np.int32), y.astype(np.int32)
        f, g = (x - i).astype(np.float32), (y - j).astype(np.float32)
        upper = grid[i, j] * (1 - g) + grid[i, j + 1] * g
        lower = grid[i + 1, j] * (1 - g) + grid[i + 1, j + 1] * g
        return np.asarray(upper * (1 - f) + lower * f)


def _without_specks(outline: Array) -> Array:
    labels, count = ndimage.label(outline < 0)
    if count < 2:
        return outline
    small = np.r_[False, np.bincount(labels.ravel())[1:] * CELL**2 < SPECK]
    return np.where(small[labels], 0.02, outline)
