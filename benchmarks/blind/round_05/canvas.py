"""The lining unrolled: rasters of reflectance, relief and water that the scan samples."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import shapely
from scipy import ndimage
from shapely.geometry.base import BaseGeometry

from .geometry import Array, Section

Raster = npt.NDArray[np.float32]
Window = tuple[slice, slice]
MARGIN = 0.6


class Canvas:
    """Rasters over arc (rows) and chainage (columns).

    Attributes
    ----------
    dry : ndarray
        10 lg of the dry lining's reflectance.
    drop : ndarray
        By how many dB water lowers it.
    relief : ndarray
        Height of the surface into the tunnel, in m.
    film : ndarray
        Share of the surface on which water stands as a film that mirrors, 0 to 1.
    """

    def __init__(self, section: Section, length: float, cell: float, base_db: float, rng: np.random.Generator) -> None:
        self.section, self.length, self.cell, self.rng = section, length, cell, rng
        shape = (int(section.perimeter / cell) + 2, int((length + 2 * MARGIN) / cell) + 2)
        self.dry: Raster = np.full(shape, base_db, np.float32)
        self.drop: Raster = np.zeros(shape, np.float32)
        self.relief: Raster = np.zeros(shape, np.float32)
        self.film: Raster = np.zeros(shape, np.float32)
        self.c: Array = np.arange(shape[1], dtype=np.float64) * cell - MARGIN
        self.s: Array = np.arange(shape[0], dtype=np.float64) * cell - section.half

    def rows(self, a: float, b: float) -> slice:
        """Rows of a range of arc."""
        return self._slice(a + self.section.half, b + self.section.half, len(self.s))

    def cols(self, a: float, b: float) -> slice:
        """Columns of a range of chainage."""
        return self._slice(a + MARGIN, b + MARGIN, len(self.c))

    def _slice(self, a: float, b: float, count: int) -> slice:
        low = int(np.clip(round(a / self.cell), 0, count - 1))
        return slice(low, int(np.clip(round(b / self.cell), low + 1, count)))

    def noise(self, along: float, around: float, window: Window | None = None) -> Raster:
        """A smooth random field of unit deviation with lengths of correlation along chainage and arc, in m."""
        full = (slice(0, len(self.s)), slice(0, len(self.c))) if window is None else window
        shape = (full[0].stop - full[0].start, full[1].stop - full[1].start)
        step = (max(around / 2, self.cell), max(along / 2, self.cell))
        coarse = tuple(int(n * self.cell / d) + 4 for n, d in zip(shape, step, strict=True))
        field = ndimage.gaussian_filter(self.rng.standard_normal(coarse).astype(np.float32), 1.0)
        field /= max(float(field.std()), 1e-6) if field.size > 60 else 0.28
        rows = np.linspace(1, coarse[0] - 2, shape[0], dtype=np.float32)
        cols = np.linspace(1, coarse[1] - 2, shape[1], dtype=np.float32)
        low_r, low_c = rows.astype(int), cols.astype(int)
        high_r, high_c = np.minimum(low_r + 1, coarse[0] - 1), np.minimum(low_c + 1, coarse[1] - 1)
        share_r, share_c = (rows - low_r)[:, None], (cols - low_c)[None, :]
        strips = field[low_r] * (1 - share_r) + field[high_r] * share_r
        out: Raster = strips[:, low_c] * (1 - share_c) + strips[:, high_c] * share_c
        return out

    def distance(self, shape: BaseGeometry, margin: float) -> tuple[Window, Raster]:
        """Signed distance to an outline (positive inside) in the window about it."""
        c0, s0, c1, s1 = shape.bounds
        window = (self.rows(s0 - margin, s1 + margin), self.cols(c0 - margin, c1 + margin))
        shapely.prepare(shape)
        cc, ss = np.meshgrid(self.c[window[1]], self.s[window[0]])
        inside = shapely.contains_xy(shape, cc, ss)
        padded = np.pad(inside, 1)
        within = ndimage.distance_transform_edt(padded)[1:-1, 1:-1]
        beyond = ndimage.distance_transform_edt(~padded)[1:-1, 1:-1]
        signed = np.where(inside, within - 0.5, 0.5 - beyond) * self.cell
        return window, signed.astype(np.float32)

    def stain(self, shape: BaseGeometry, amount: float, soft: float, grain: float = 0.2) -> None:
        """Darken or brighten what an outline holds; at the outline half of it is reached."""
        window, signed = self.distance(shape, 3 * soft + 0.05)
        level = rim(signed, soft) * (1 + grain * self.noise(0.15, 0.2, window))
        self.dry[window] += (amount * level).astype(np.float32)

    def sample(self, layer: Raster, c: Array, s: Array) -> Array:
        """Values of a layer at points of the lining."""
        at = np.stack([(s + self.section.half) / self.cell, (c + MARGIN) / self.cell])
        out: Array = ndimage.map_coordinates(layer, at, order=1, mode="nearest").astype(np.float64)
        return out


def rim(signed: Raster, soft: float) -> Raster:
    """From 0 outside to 1 inside, one half on the outline; ``soft`` is the standard width of the transition."""
    out: Raster = (1.0 / (1.0 + np.exp(np.clip(-1.7 * signed / max(soft, 1e-3), -40, 40)))).astype(np.float32)
    return out
