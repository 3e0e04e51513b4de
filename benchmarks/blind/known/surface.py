"""What the inner surface looks like, on a grid of chainage and outline coordinate."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.spatial import cKDTree
from shapely import Polygon, contains_xy, get_parts, segmentize
from shapely.geometry.base import BaseGeometry

from benchmarks.blind.known.section import Array

Grid = NDArray[np.float32]
Pattern = Callable[[Array, Array, Array], tuple[Array, Array]]

CELL = 0.01
COARSE = 0.1


class Surface:
    """Reflectance, wetness and relief over ``length`` metres of tunnel.

    ``dry`` is in dB, ``wet`` the darkening by water in dB (positive), ``relief`` outward in metres. A ``pattern`` adds what is
    too fine for the grid: from chainage, outline coordinate and beam radius, decibels and outward metres.
    """

    def __init__(self, length: float, lining: float, total: float, rng: np.random.Generator) -> None:
        self.length, self.lining, self.total = length, lining, total
        self.shape = (int(np.ceil(length / CELL)) + 1, int(np.ceil(total / CELL)) + 1)
        self.u: Array = np.linspace(0.0, CELL * (self.shape[0] - 1), self.shape[0])
        self.s: Array = np.linspace(0.0, CELL * (self.shape[1] - 1), self.shape[1])
        self.dry: Grid = np.zeros(self.shape, np.float32)
        self.wet: Grid = np.zeros(self.shape, np.float32)
        self.relief: Grid | None = None
        self.relief_range = (0.0, 0.0)
        self.pattern: Pattern | None = None
        self.coarse: list[Grid] = []
        self._rng = rng

    @property
    def lining_rows(self) -> int:
        """Number of grid columns in s that lie on the lining."""
        return int(self.lining / CELL) + 1

    def add_smooth(self, std: float, reach: float) -> None:
        """Add smooth variation of a standard deviation (dB) over lengths of ``reach`` metres."""
        shape = (int(self.length / COARSE) + 2, int(self.total / COARSE) + 2)
        noise = gaussian_filter(self._rng.standard_normal(shape), reach / COARSE, mode="reflect")
        self.coarse.append((noise * (std / noise.std())).astype(np.float32))

    def add_fine(self, std: float, reach: float) -> None:
        """Add texture of centimetres."""
        noise = gaussian_filter(self._rng.standard_normal(self.shape, dtype=np.float32), reach / CELL, mode="wrap")
        self.dry += noise * np.float32(std / noise.std())

    def add_by_s(self, profile: Callable[[Array], Array]) -> None:
        """Add decibels that depend on the outline coordinate alone."""
        self.dry += profile(self.s).astype(np.float32)[None, :]

    def set_relief(self, relief: Grid) -> None:
        """Give the surface a relief and note its extent."""
        self.relief = relief
        self.relief_range = (float(relief.min()), float(relief.max()))

    def sample(self, grid: Grid, u: Array, s: Array, cell: float = CELL) -> Array:
        """Interpolate a grid."""
        value: Array = map_coordinates(grid, np.stack([u / cell, s / cell]), order=1, mode="nearest", output=np.float64)
        return value

    def dry_db(self, u: Array, s: Array) -> Array:
        """Reflectance without water and pattern, dB against the lining's mean."""
        value = self.sample(self.dry, u, s)
        for layer in self.coarse:
            value += self.sample(layer, u, s, COARSE)
        return value

    def depth(self, u: Array, s: Array) -> Array:
        """Relief, outward."""
        return np.zeros_like(u) if self.relief is None else self.sample(self.relief, u, s)

    def window(self, outline: BaseGeometry, margin: float) -> tuple[slice, slice]:
        """Part of the grid about an outline; not beyond the lining."""
        u0, s0, u1, s1 = outline.bounds
        low_u, high_u = int((u0 - margin) / CELL), int((u1 + margin) / CELL) + 2
        low_s, high_s = int((s0 - margin) / CELL), int((s1 + margin) / CELL) + 2
        return (
            slice(max(low_u, 0), min(high_u, self.shape[0])),
            slice(max(low_s, 0), min(high_s, self.lining_rows)),
        )


def signed_distance(outline: BaseGeometry, u: Array, s: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Distance to the boundary on a grid (positive inside), and which nodes are inside."""
    uu, ss = np.meshgrid(u, s, indexing="ij")
    rings: list[Array] = []
    for part in get_parts(outline):
        if isinstance(part, Polygon):
            rings += [np.asarray(segmentize(ring, 0.006).coords) for ring in (part.exterior, *part.interiors)]
    distance, _ = cKDTree(np.vstack(rings)).query(np.column_stack([uu.ravel(), ss.ravel()]))
    inside = np.asarray(contains_xy(outline, uu, ss))
    signed = np.where(inside, 1.0, -1.0) * distance.reshape(uu.shape)
    return signed, inside


def rim_profile(distance: Array, width: float) -> Array:
    """Rise from 0 outside to 1 inside over ``width``, one half at the outline."""
    x = np.clip(distance / width + 0.5, 0.0, 1.0)
    rise: Array = x * x * (3.0 - 2.0 * x)
    return rise
