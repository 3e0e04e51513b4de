"""Boundary of dark regions, at half of their own contrast."""

from __future__ import annotations

import numpy as np

from tunneldb.anomalies.background.contrast import ContrastImage
from tunneldb.anomalies.windows import row_blocks
from tunneldb.arrays import Bool, Int16, Int64, Single, UInt8
from tunneldb.compiled import kernel
from tunneldb.raster.geotiff import NODATA, STEP
from tunneldb.raster.polygons import mask_of_polygons
from tunneldb.raster.state import PixelState

BAND_PIXELS = 2
"""Width of the zone on both sides of the boundary in which pixels may change sides, pixels, per iteration."""

ITERATIONS = 2
"""Number of iterations; doubled where lining is averaged over windows, which blur the boundary more."""

CONTRAST_HALF_WIDTH = 6
"""Half the side of the window for the contrast of a region, pixels."""

MIN_CONTRAST_PIXELS = 5
"""Minimum number of pixels for a contrast."""

VOTING_PIXELS = 4
"""Number of pixels for deciding the side of one: half of a contrast of four sigma is four sigma of their mean."""

MIN_SIGNIFICANCE = 2.5
"""Significance of half of the contrast: 1 of 160 pixels near a boundary is then on the wrong side."""

EMPTY, RECESS = int(PixelState.EMPTY), int(PixelState.RECESS)


def refine_boundary(dark: Bool, contrast: ContrastImage, size: int) -> Bool:
    """Move the boundary of dark regions to half of their contrast.

    The threshold of three sigma is at the outer edge of a strongly wet patch and at the inner edge of a weak one. A mean passes
    half of the contrast exactly at the edge, whatever the contrast, the beam's footprint and the noise.

    Parameters
    ----------
    dark : (rows, columns) bool array
        Dark pixels by the threshold; changed in place.
    contrast : ContrastImage
        Their darkening.
    size : int
        Side of the median filter that was applied, pixels.

    Returns
    -------
    (rows, columns) bool array
        The same array.
    """
    windows, sigmas, tile = np.zeros((1, 1), np.uint8), np.zeros((2, 1, 1), np.float32), max(dark.shape)
    if contrast.texture is not None and contrast.texture.half.any():
        windows, tile = contrast.texture.half, contrast.tile
        sigmas = np.stack([contrast.texture.pixel_sigma, contrast.texture.sigma]) / np.float32(STEP["corrected"])
    for _ in range(2 * ITERATIONS if windows.any() else ITERATIONS):
        interior, near = _about_boundary(dark)
        changed = np.zeros(len(near), np.bool_)
        _changed(dark, interior, contrast.drop, contrast.state, windows, sigmas, tile, near, size // 2, changed)
        row, column = np.divmod(near[changed], dark.shape[1])
        dark[row, column] = ~dark[row, column]
    for columns, mask in mask_of_polygons(contrast.grid, contrast.drawn):
        dark[:, columns][mask] = False
    return dark


def _about_boundary(dark: Bool) -> tuple[Bool, Int64]:
    """Find the dark pixels of the interior (all four neighbours dark), and list the pixels within BAND_PIXELS of the boundary.

    Returns
    -------
    interior : (rows, columns) bool array
    near : (n,) int array
        Numbers of pixels, row by row.
    """
    interior, near = np.empty_like(dark), []
    for rows, about in row_blocks(len(dark), BAND_PIXELS):
        part = dark[about]
        edge = np.zeros_like(part)  # next to a pixel of the other kind
        for axis in (0, 1):
            here, there = (np.moveaxis(edge, axis, 0)[k] for k in (slice(1, None), slice(None, -1)))
            differs = np.moveaxis(part, axis, 0)
            differs = differs[1:] != differs[:-1]
            here |= differs
            there |= differs
        inner = slice(rows.start - about.start, rows.stop - about.start)
        np.logical_and(part[inner], ~edge[inner], out=interior[rows])
        for axis in (0, 1):
            edge = _dilated(edge, axis, BAND_PIXELS - 1)
        near.append(np.flatnonzero(edge[inner]) + rows.start * dark.shape[1])
    return interior, np.concatenate(near)


def _dilated(mask: Bool, axis: int, reach: int) -> Bool:
    """Dilate a mask by so many pixels along an axis."""
    out = mask.copy()
    grown, given = np.moveaxis(out, axis, 0), np.moveaxis(mask, axis, 0)
    for step in range(1, reach + 1):
        grown[step:] |= given[:-step]
        grown[:-step] |= given[step:]
    return out


@kernel
def _changed(
    dark: Bool,
    interior: Bool,
    drop: Int16,
    state: UInt8,
    windows: UInt8,
    sigmas: Single,
    tile: int,
    near: Int64,
    most: int,
    changed: Bool,
) -> None:  # pragma: no cover - compiled
    """Decide which pixels near the boundary change sides: ``changed`` (n,), False before.

    The contrast of a region is the mean darkening of its interior around a pixel, from every other pixel. The pixel is dark if
    the mean darkening of the lining next to it, within up to ``most`` pixels, exceeds half of that. In a tile with ``windows``
    (half their side, pixels) lining varies by the first of ``sigmas`` from pixel to pixel, by the second over a window, steps;
    there the average includes enough pixels for half of the contrast to be MIN_SIGNIFICANCE times the rest.
    """
    rows, columns = dark.shape
    for k in range(near.shape[0]):
        i, j = near[k] // columns, near[k] % columns
        if state[i, j] > RECESS:
            continue
        down, along = i // tile, min(j // tile, windows.shape[1] - 1)
        window = int(windows[down, along])
        reach, step = max(CONTRAST_HALF_WIDTH, 2 * window), 2 if window == 0 else 3
        contrast, selected = 0, 0
        for m in range(i - reach, i + reach + 1, step):
            for n in range(j - reach, j + reach + 1, step):
                if 0 <= m < rows and 0 <= n < columns and interior[m, n] and drop[m, n] != NODATA:
                    contrast += drop[m, n]
                    selected += 1
        if selected < MIN_CONTRAST_PIXELS:
            continue
        half = 0
        if window > 0:
            floor_sigma, single = sigmas[1, down, along], sigmas[0, down, along]
            share = (single - 0.5 * contrast / selected / MIN_SIGNIFICANCE) / max(single - floor_sigma, 1e-6)
            half = max(round(window * min(max(share, 0.0), 1.0)) - 1, 0)
        level, seen = 0, 0
        while seen < VOTING_PIXELS and half < max(most, window):
            half += 1
            level, seen = 0, 0
            for m in range(i - half, i + half + 1):
                for n in range(j - half, j + half + 1):
                    if 0 <= m < rows and 0 <= n < columns and EMPTY < state[m, n] <= RECESS and drop[m, n] != NODATA:
                        level += drop[m, n]
                        seen += 1
        if seen >= VOTING_PIXELS:
            changed[k] = (2.0 * (level / seen) > contrast / selected) != dark[i, j]
