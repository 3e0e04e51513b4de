"""The rim of dark regions, where half of their own contrast is reached."""

from __future__ import annotations

import numpy as np
from numba import njit

from tunneldb.anomalies.background.contrast import ContrastImage
from tunneldb.anomalies.joints import longer
from tunneldb.arrays import Bool, Int16, Int32, UInt8
from tunneldb.raster.geotiff import NODATA
from tunneldb.raster.polygons import mask_of_polygons

BAND = 2
"""Pixels to both sides of the rim that may change sides, each time."""

TIMES = 2
"""How many times they may."""

CONTRAST = 6
"""Half the side of the window in which the contrast of a region is taken, pixels."""

FEW = 5
"""Fewer pixels tell no contrast."""

ENOUGH = 4
"""So many pixels tell whether one lies on this side or that: half of a contrast of four sigma is four of their mean's."""

RIM, LISTED = 1, 2


def refine_boundary(dark: Bool, relative: ContrastImage, size: int) -> Bool:
    """Move the rim of dark regions to where half of their contrast is reached.

    The threshold of three sigma lies at the outermost edge of a strongly wet patch and at the innermost of a weak one; a mean
    passes half of the contrast just where the edge is, whatever the contrast, the beam's footprint and the noise.

    Parameters
    ----------
    dark : (rows, columns) bool array
        Dark pixels by the threshold; changed in place.
    relative : ContrastImage
        Their drop.
    size : int
        Side of the median filter that they went through, pixels.

    Returns
    -------
    (rows, columns) bool array
        The same array.
    """
    for _ in range(TIMES):
        row, column, becomes = _settled(dark, relative.drop, relative.state, size // 2)
        dark[row, column] = becomes
    for columns, mask in mask_of_polygons(relative.grid, relative.drawn):
        dark[:, columns][mask] = False
    return dark


@njit(cache=True, nogil=True)
def _settled(dark: Bool, drop: Int16, state: UInt8, most: int) -> tuple[Int32, Int32, Bool]:  # pragma: no cover - compiled
    """Pixels near the rim that change sides, and to which."""
    near, row, column = _near(dark)
    becomes = np.empty(len(row), np.bool_)
    count = 0
    for k in range(len(row)):
        i, j = row[k], column[k]
        if state[i, j] > 2:
            continue
        contrast, held = _core(dark, near, drop, i, j)
        if held < FEW:
            continue
        level, seen = 0.0, 0
        for half in range(1, most + 1):
            if seen < ENOUGH:
                level, seen = _level(drop, state, i, j, half)
        if seen >= ENOUGH and (2.0 * level > contrast) != dark[i, j]:
            row[count], column[count], becomes[count] = i, j, not dark[i, j]
            count += 1
    return row[:count], column[:count], becomes[:count]


@njit(cache=True, nogil=True)
def _near(dark: Bool) -> tuple[UInt8, Int32, Int32]:  # pragma: no cover - compiled
    """Which pixels lie within BAND of the rim (LISTED), which dark ones at it (RIM), and a list of the former."""
    rows, columns = dark.shape
    near = np.zeros((rows, columns), np.uint8)
    row, column = np.empty(1024, np.int32), np.empty(1024, np.int32)
    count = 0
    for i in range(rows):
        for j in range(columns):
            if not dark[i, j]:
                continue
            for di, dj in ((-1, 0), (1, 0), (0, -1), (0, 1)):
                p, q = i + di, j + dj
                if p < 0 or p >= rows or q < 0 or q >= columns or dark[p, q]:
                    continue
                near[i, j] |= RIM
                for m in range(max(min(i, p) - BAND + 1, 0), min(max(i, p) + BAND, rows)):
                    for n in range(max(min(j, q) - BAND + 1, 0), min(max(j, q) + BAND, columns)):
                        if not near[m, n] & LISTED:
                            near[m, n] |= LISTED
                            if count == len(row):
                                row, column = longer(row), longer(column)
                            row[count], column[count] = m, n
                            count += 1
    return near, row[:count], column[:count]


@njit(cache=True, nogil=True)
def _core(dark: Bool, near: UInt8, drop: Int16, i: int, j: int) -> tuple[float, int]:  # pragma: no cover - compiled
    """Mean drop of dark pixels about one, every other one, but for those at the rim, and of how many it is."""
    rows, columns = dark.shape
    total, held = 0.0, 0
    for m in range(i - CONTRAST, i + CONTRAST + 1, 2):
        for n in range(j - CONTRAST, j + CONTRAST + 1, 2):
            if 0 <= m < rows and 0 <= n < columns and dark[m, n] and not near[m, n] & RIM and drop[m, n] != NODATA:
                total += drop[m, n]
                held += 1
    return total / max(held, 1), held


@njit(cache=True, nogil=True)
def _level(drop: Int16, state: UInt8, i: int, j: int, half: int) -> tuple[float, int]:  # pragma: no cover - compiled
    """Mean drop of the lining about a pixel, and of how many pixels it is."""
    total, seen = 0.0, 0
    for m in range(max(i - half, 0), min(i + half + 1, drop.shape[0])):
        for n in range(max(j - half, 0), min(j + half + 1, drop.shape[1])):
            if 1 <= state[m, n] <= 2 and drop[m, n] != NODATA:
                total += drop[m, n]
                seen += 1
    return total / max(seen, 1), seen
