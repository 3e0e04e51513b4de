"""Unrolled lining on which dirt, water and unevenness are painted."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_closing, binary_fill_holes, label, zoom
from shapely import box, unary_union
from shapely.geometry import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from .section import Array, Section

Grid = NDArray[np.float32]
Mask = NDArray[np.bool_]
Window = tuple[slice, slice]

# Where a damp rim has fallen to this part of the wetness inside it, an inspector draws the line.
OUTLINE = 0.4


def fractal(
    rng: np.random.Generator,
    shape: tuple[int, int],
    cell: float,
    longest: float,
    octaves: int = 4,
    persistence: float = 0.55,
    stretch: tuple[float, float] = (1.0, 1.0),
) -> Grid:
    """Correlated noise of zero mean and unit deviation.

    Parameters
    ----------
    rng : numpy.random.Generator
        Source of randomness.
    shape : tuple of int
        Cells along and around.
    cell : float
        Size of a cell, in metres.
    longest : float
        Longest wavelength, in metres.
    octaves : int
        Number of wavelengths, each half the one before.
    persistence : float
        Amplitude of an octave by that of the one before.
    stretch : tuple of float
        Factors of the wavelength along and around.

    Returns
    -------
    ndarray
    """
    total = np.zeros(shape, dtype=np.float32)
    for octave in range(octaves):
        steps = [max(2.0, longest * f / 2**octave / cell) for f in stretch]
        coarse = rng.normal(size=[int(np.ceil(n / step)) + 4 for n, step in zip(shape, steps, strict=True)]).astype(np.float32)
        fine = zoom(coarse, steps, order=3, grid_mode=True, mode="nearest")
        trim = [int(step) for step in steps]
        total += persistence**octave * fine[trim[0] : trim[0] + shape[0], trim[1] : trim[1] + shape[1]]
    return (total - total.mean()) / (total.std() + 1e-9)


def polygons(mask: Mask, cell: float, origin: tuple[float, float]) -> BaseGeometry:
    """Outline of the cells of a mask, with its steps rounded off.

    Parameters
    ----------
    mask : ndarray
        Cells along and around.
    cell : float
        Their size, in metres.
    origin : tuple of float
        Chainage and place on the girth of the first cell's corner.

    Returns
    -------
    shapely geometry
        In chainage and place on the girth.
    """
    rows = []
    for i in np.flatnonzero(mask.any(axis=1)):
        edges = np.flatnonzero(np.diff(np.concatenate([[0], mask[i].astype(np.int8), [0]])))
        u = origin[0] + i * cell
        rows += [box(u, origin[1] + a * cell, u + cell, origin[1] + b * cell) for a, b in edges.reshape(-1, 2)]
    outline = unary_union(rows).buffer(0.03).buffer(-0.05).buffer(0.02).simplify(0.006)
    parts = [p for p in getattr(outline, "geoms", [outline]) if isinstance(p, Polygon) and p.area > 0.015]
    return MultiPolygon(parts) if len(parts) > 1 else (parts[0] if parts else Polygon())


@dataclass
class Patch:
    """Weights from 0 to 1 over a part of the canvas."""

    window: Window
    weight: Grid


@dataclass
class Mark:
    """Something on the lining that has an outline."""

    name: str
    window: Window
    mask: Mask
    limit: str | None = None


@dataclass
class Canvas:
    """What covers the lining, on a grid of chainage and place on the girth.

    Attributes
    ----------
    section : Section
        The tunnel's cross-section.
    length : float
        Length of the tunnel, in metres.
    cell : float
        Size of a cell, in metres.
    rng : numpy.random.Generator
        Source of randomness.
    base, water : ndarray
        Reflectance of what is dry, and what water changes of it, in dB.
    sheen : ndarray
        Strength of the lobe about the normal that paint, tiles and films of water have.
    height : ndarray
        Unevenness, towards the inside, in metres.
    leaks, others : list of Mark
        What is wet; what is dark but dry, or bright.
    """

    section: Section
    length: float
    cell: float
    rng: np.random.Generator
    leaks: list[Mark] = field(default_factory=list)
    others: list[Mark] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.origin = float(self.section.s[0])
        self.shape = (int(np.ceil(self.length / self.cell)), int(np.ceil((self.section.s[-1] - self.origin) / self.cell)))
        self.base, self.water, self.sheen, self.height = (np.zeros(self.shape, dtype=np.float32) for _ in range(4))
        self.u: Array = (np.arange(self.shape[0]) + 0.5) * self.cell
        self.s: Array = self.origin + (np.arange(self.shape[1]) + 0.5) * self.cell
        self.z: Array = self.section.locate(self.s)[:, 1]
        self.on_wall: Mask = (self.s > self.section.foot_right) & (self.s < self.section.foot_left)

    def noise(
        self, longest: float, octaves: int = 4, persistence: float = 0.55, stretch: tuple[float, float] = (1.0, 1.0)
    ) -> Grid:
        """Correlated noise over the whole canvas."""
        return fractal(self.rng, self.shape, self.cell, longest, octaves, persistence, stretch)

    def window(self, u0: float, u1: float, s0: float, s1: float) -> tuple[Window, Array, Array]:
        """Part of the canvas, with the chainages and places of its cells."""
        i0, i1 = np.clip(np.array([u0, u1]) / self.cell, 0, self.shape[0]).astype(int)
        j0, j1 = np.clip((np.array([s0, s1]) - self.origin) / self.cell, 0, self.shape[1]).astype(int)
        return (slice(i0, i1), slice(j0, j1)), self.u[i0:i1, None], self.s[None, j0:j1]

    def merge(self, patches: list[Patch]) -> Patch:
        """Join patches, where they overlap by the greater weight."""
        bounds = [[p.window[k].start for p in patches] for k in (0, 1)], [[p.window[k].stop for p in patches] for k in (0, 1)]
        window = tuple(slice(min(bounds[0][k]), max(bounds[1][k])) for k in (0, 1))
        weight = np.zeros([w.stop - w.start for w in window], dtype=np.float32)
        for patch in patches:
            part = tuple(slice(p.start - w.start, p.stop - w.start) for p, w in zip(patch.window, window, strict=True))
            np.maximum(weight[part], patch.weight, out=weight[part])
        return Patch((window[0], window[1]), weight)

    def stain(self, patches: Patch | list[Patch], level: float, kind: str | None = None, sheen: float = 0.0) -> None:
        """Paint something dry.

        Parameters
        ----------
        patches : Patch or list of Patch
            Where.
        level : float
            Change of reflectance, in dB.
        kind : str, optional
            What it is; with it, its outline is recorded.
        sheen : float
            Change of the lobe about the normal.
        """
        patch = self.merge(patches) if isinstance(patches, list) else patches
        self.base[patch.window] += level * patch.weight
        self.sheen[patch.window] += sheen * patch.weight
        if kind:
            self.others.append(Mark(kind, patch.window, patch.weight > 0.5))

    def leak(
        self,
        phenomenon: str,
        patches: list[Patch],
        drop: float,
        limit: str | None = None,
        film: float = 0.0,
        salt: list[Patch] | None = None,
        salt_level: float = 4.0,
        uneven: float = 0.15,
    ) -> None:
        """Wet the lining.

        Parameters
        ----------
        phenomenon : str
            What it is.
        patches : list of Patch
            Where; one outline about what hangs together.
        drop : float
            Loss where it is wettest, in dB.
        limit : str, optional
            Why an inspector could not tell it.
        film : float
            Lobe about the normal of a film of water.
        salt : list of Patch, optional
            Bright deposits within.
        salt_level : float
            By how much these are brighter than the wet lining about them, in dB.
        uneven : float
            Deviation of the wetness, as a part of it.
        """
        patch = self.merge(patches)
        mottle = fractal(self.rng, patch.weight.shape, self.cell, 0.5, 4)
        wet = -drop * patch.weight * np.clip(1 + uneven * mottle, 0.4, 1.6)
        np.minimum(self.water[patch.window], wet, out=self.water[patch.window])
        np.maximum(self.sheen[patch.window], film * patch.weight**2, out=self.sheen[patch.window])
        for deposit in salt or []:
            self.water[deposit.window] += salt_level * deposit.weight
        padded = np.pad(patch.weight > OUTLINE, 8)
        mask = binary_closing(padded, iterations=max(1, round(0.05 / self.cell)))
        filled = binary_fill_holes(mask)
        holes, count = label(filled & ~mask)
        for hole in range(1, count + 1):
            if (holes == hole).sum() * self.cell**2 < 0.05:
                mask |= holes == hole
        mask = mask[8:-8, 8:-8] & self.on_wall[None, patch.window[1]]
        self.leaks.append(Mark(phenomenon, patch.window, mask, limit))

    def outline(self, mark: Mark, hidden: Mask | None = None) -> BaseGeometry:
        """Outline of a mark, without what is hidden."""
        mask = mark.mask if hidden is None else mark.mask & ~hidden[mark.window]
        return polygons(mask, self.cell, (mark.window[0].start * self.cell, self.origin + mark.window[1].start * self.cell))
