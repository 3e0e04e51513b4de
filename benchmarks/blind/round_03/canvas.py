"""The lining unrolled: reflectance, moisture, gloss and relief on rasters over chainage and section."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from scipy.ndimage import distance_transform_edt, map_coordinates

from .arrays import Floats, Ints, Mask, Rng, smooth_noise, smooth_step
from .profile import Profile
from .shapes import Shape

CELL = 0.01
RELIEF_CELL = 0.025
_MARGIN = 0.6


@dataclass
class Leak:
    """A wet place: what is known of it before the scan."""

    owner: int
    phenomenon: str
    limit: str | None


@dataclass
class Stain:
    """Something dark but dry, or bright: where its mask lies in the raster, and what it is."""

    kind: str
    rows: slice
    columns: slice
    inside: Mask


@dataclass
class Canvas:
    """Rasters of the lining; rows are chainage, columns the length along the section from the crown.

    Attributes
    ----------
    profile : Profile
        The section.
    length : float
        Of the tunnel that is scanned, from chainage 0.
    rng : numpy.random.Generator
        Source of chance for all that is painted.
    albedo : ndarray
        Dry reflectance in dB.
    drop : ndarray
        What water takes from it, dB.
    gloss : ndarray
        Height of the specular lobe against a diffuse 0 dB.
    relief : ndarray
        Excess over the section, outwards, on its own coarser raster.
    owner : ndarray
        Number of the leak to which a cell belongs, 0 for none.
    """

    profile: Profile
    length: float
    rng: Rng
    albedo: Floats = field(init=False)
    drop: Floats = field(init=False)
    gloss: Floats = field(init=False)
    relief: Floats = field(init=False)
    owner: Ints = field(init=False)
    leaks: list[Leak] = field(default_factory=list)
    stains: list[Stain] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.shape = (math.ceil((self.length + 2 * _MARGIN) / CELL), math.ceil(2 * self.profile.half / CELL))
        self.s = -_MARGIN + CELL * (np.arange(self.shape[0]) + 0.5)
        self.a = -self.profile.half + CELL * (np.arange(self.shape[1]) + 0.5)
        self.albedo = np.zeros(self.shape, np.float32)
        self.drop = np.zeros(self.shape, np.float32)
        self.gloss = np.zeros(self.shape, np.float32)
        self.owner = np.zeros(self.shape, np.int16)
        coarse = (math.ceil((self.length + 2 * _MARGIN) / RELIEF_CELL), math.ceil(2 * self.profile.half / RELIEF_CELL))
        self.relief = np.zeros(coarse, np.float32)
        self.relief_s = -_MARGIN + RELIEF_CELL * (np.arange(coarse[0]) + 0.5)
        self.relief_a = -self.profile.half + RELIEF_CELL * (np.arange(coarse[1]) + 0.5)

    def noise(self, along: float, down: float) -> Floats:
        """Unit noise over the whole raster, with correlation lengths in metres."""
        return smooth_noise(self.rng, self.shape, (along / CELL, down / CELL))

    def relief_noise(self, along: float, down: float) -> Floats:
        """The same on the raster of the relief."""
        return smooth_noise(self.rng, (self.relief.shape[0], self.relief.shape[1]), (along / RELIEF_CELL, down / RELIEF_CELL))

    def wall(self) -> Floats:
        """1 on wall and vault, 0 on the floor, over the columns."""
        return (np.abs(self.a) < self.profile.foot).astype(np.float32)

    def band(self, high: float, low: float, soft: float = 0.02) -> Floats:
        """1 where the wall on both sides lies between two heights above the floor, over the columns."""
        top, bottom = self.profile.arc_of_height(high), self.profile.arc_of_height(low)
        depth = np.abs(self.a)
        return smooth_step((depth - top) / soft + 0.5) * smooth_step((bottom - depth) / soft + 0.5)

    def sample(self, raster: Floats, s: Floats, a: Floats) -> Floats:
        """Bilinear value of a raster of either size."""
        cell = CELL if raster.shape == self.shape else RELIEF_CELL
        rows, columns = (s + _MARGIN) / cell - 0.5, (a + self.profile.half) / cell - 0.5
        return map_coordinates(raster, np.stack([rows, columns]), order=1, mode="nearest", prefilter=False)

    def _window(self, shape: Shape, s: float, a: float, more: float) -> tuple[slice, slice, Floats, Floats]:
        x0, x1, y0, y1 = shape.extent()
        side = -1.0 if a < 0 else 1.0
        bounds = sorted((a + side * (y0 - more), a + side * (y1 + more)))
        rows = slice(*np.clip(np.searchsorted(self.s, [s + x0 - more, s + x1 + more]), 0, self.shape[0]).tolist())
        columns = slice(*np.clip(np.searchsorted(self.a, bounds), 0, self.shape[1]).tolist())
        return rows, columns, (self.s[rows] - s)[:, None], (side * (self.a[columns] - a))[None, :]

    def _lay(self, shape: Shape, s: float, a: float, more: float) -> tuple[slice, slice, Floats, Mask]:
        """Window, signed distance (positive inside) and mask of a shape at its place."""
        rows, columns, x, y = self._window(shape, s, a, more)
        flip = bool(y.size > 1 and y[0, 1] < y[0, 0])
        inside = shape.field(x, y[:, ::-1] if flip else y, self.rng) > 0
        if flip:
            inside = inside[:, ::-1]
        inside = inside & (np.abs(self.a[columns]) < self.profile.foot)[None, :]
        reach = distance_transform_edt(inside) - distance_transform_edt(~inside)
        return rows, columns, (reach * CELL).astype(np.float32), inside

    def leak(
        self,
        phenomenon: str,
        shape: Shape,
        s: float,
        a: float,
        drop: float,
        soft: float = 0.05,
        soft_low: float | None = None,
        core: float = 0.2,
        uneven: float = 0.12,
        fringe: float = 0.0,
        gloss: float = 0.0,
        limit: str | None = None,
    ) -> None:
        """Wet the lining.

        Parameters
        ----------
        phenomenon : str
            What it is.
        shape : Shape
            Its outline, where half of the drop is reached.
        s, a : float
            Its place.
        drop : float
            Loss in dB, well inside.
        soft : float
            Width of the rim (metres from a quarter to three quarters of the drop, about).
        soft_low : float, optional
            The same at the lower end.
        core : float
            By what share the core is wetter, and the rim less wet, than the mean.
        uneven : float
            Relative unevenness inside.
        fringe : float
            Bright crust of salt outside of the rim, dB.
        gloss : float
            Specular lobe of the film of water.
        limit : str, optional
            Why nobody could tell it from its surroundings.
        """
        more = max(0.3, 2.5 * max(soft, soft_low or 0.0))
        rows, columns, reach, inside = self._lay(shape, s, a, more)
        width = np.full(reach.shape[1], soft)
        if soft_low is not None:
            used = np.flatnonzero(inside.any(axis=0))
            lower, upper = (used[0], used[-1]) if a < 0 else (used[-1], used[0])
            share = np.clip((np.arange(reach.shape[1]) - upper) / ((lower - upper) or 1), 0.0, 1.0)
            width = soft + (soft_low - soft) * share
        wet = 0.5 * (1.0 + np.tanh(reach / np.maximum(width, 0.006)[None, :]))
        deep = max(float(np.quantile(reach[inside], 0.9)), 0.02)
        strength = 1.0 + core * (2.0 * smooth_step(reach / deep) - 1.0)
        patchy = 1.0 + uneven * smooth_noise(self.rng, (reach.shape[0], reach.shape[1]), (20.0, 20.0))
        wall = (np.abs(self.a[columns]) < self.profile.foot)[None, :]
        taken = drop * wet * strength * np.clip(patchy, 0.5, 1.5) * wall
        self.drop[rows, columns] = np.maximum(self.drop[rows, columns], taken)
        self.gloss[rows, columns] += (gloss * wet * wall).astype(np.float32)
        if fringe:
            broken = np.clip(0.7 + 0.5 * smooth_noise(self.rng, (reach.shape[0], reach.shape[1]), (12.0, 12.0)), 0.0, 1.6)
            crust = broken * np.exp(-(((reach + 0.07) / 0.035) ** 2))
            self.albedo[rows, columns] += (fringe * crust * wall).astype(np.float32)
        self._own(rows, columns, inside, reach > -0.03, phenomenon, limit)

    def _own(self, rows: slice, columns: slice, inside: Mask, near: Mask, phenomenon: str, limit: str | None) -> None:
        """Enter a leak; one that touches others becomes one with them."""
        number = len(self.leaks) + 1
        owner = self.owner[rows, columns]
        touched = [int(n) for n in np.unique(owner[near]) if n]
        owner[inside] = number
        self.leaks.append(Leak(number, phenomenon, limit))
        for other in touched:
            self.owner[self.owner == other] = number
            self.leaks[other - 1].owner = number

    def stain(
        self,
        kind: str | None,
        shape: Shape,
        s: float,
        a: float,
        change: float,
        soft: float = 0.05,
        uneven: float = 0.15,
        gloss: float = 0.0,
        covered: bool = False,
    ) -> None:
        """Paint something dry: dirt, repair, paint, crust; entered as ``kind`` unless None.

        ``covered`` replaces what there is by the change (a coat); else the change adds to it.
        """
        rows, columns, reach, inside = self._lay(shape, s, a, max(0.1, 2.5 * soft))
        there = 0.5 * (1.0 + np.tanh(reach / max(soft, 0.006))) * (np.abs(self.a[columns]) < self.profile.foot)[None, :]
        patchy = 1.0 + uneven * smooth_noise(self.rng, (reach.shape[0], reach.shape[1]), (25.0, 25.0))
        before = self.albedo[rows, columns]
        painted = before * (1.0 - 0.75 * there) if covered else before
        self.albedo[rows, columns] = painted + change * there * patchy
        if covered:
            self.gloss[rows, columns] *= (1.0 - there).astype(np.float32)
        self.gloss[rows, columns] += (gloss * there).astype(np.float32)
        if kind is not None:
            self.stains.append(Stain(kind, rows, columns, inside))
