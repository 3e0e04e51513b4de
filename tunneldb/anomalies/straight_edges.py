"""Sides by which a dark region ends: which of them are sharp, and which of those lie on straight lines."""

from __future__ import annotations

import numpy as np
from numba import njit

from tunneldb.anomalies.joints import longer
from tunneldb.arrays import Bool, Int16, Int64, UInt8
from tunneldb.raster.geotiff import NODATA

SHARP = 0.5
"""Part of the region's mean drop that is lost over a sharp side."""

SLOPES = np.arange(-0.04, 0.05, 0.02)
"""Slopes of lines along the tunnel and around it, on which sides are taken for straight: what is built keeps to these within
some degrees, and so does the unrolled plane."""


def straight(runs: Int64, dark: Bool, drop: Int16, state: UInt8, across: int, least: float) -> tuple[int, int]:
    """Count the sharp sides of a region, and those of them that lie on one straight line for each of the four directions.

    What was built ends along the tunnel and around it, on four lines; water ends anywhere. Sides that face appendages, the
    floor or other dark pixels don't count.

    Parameters
    ----------
    runs : (n, 3) int array
        Row, first column and column behind the last one of the runs of the region.
    dark, drop, state
        Dark pixels, drop and state of the kilometre.
    across : int
        The drop is compared so far inside and outside a side, pixels, as the mean of three pixels.
    least : float
        Difference from which a side is sharp, steps of the drop.

    Returns
    -------
    sharp, straight : int
    """
    sides = _sharp(runs, dark, drop, state, across, least)
    return len(sides), sum(_on_a_line(sides[sides[:, 0] == facing]) for facing in range(4))


def _on_a_line(sides: Int64) -> int:
    """Most of the sides of a direction (any, place along them, place across them) that lie within a pixel of a line."""
    if not len(sides):
        return 0
    most = 0
    for slope in SLOPES:
        place = np.rint(sides[:, 2] - slope * (sides[:, 1] - sides[0, 1])).astype(np.int64)
        count = np.pad(np.bincount(place - place.min()), 1)
        most = max(most, int((count[:-2] + count[1:-1] + count[2:]).max()))
    return most


@njit(cache=True, nogil=True)
def _sharp(
    runs: Int64, dark: Bool, drop: Int16, state: UInt8, across: int, least: float
) -> Int64:  # pragma: no cover - compiled
    """Direction (0 to 3), place along and place across of the sharp sides."""
    rows, columns = dark.shape
    found = np.empty((1024, 3), np.int64)
    count = 0
    for k in range(runs.shape[0]):
        i = runs[k, 0]
        for j in range(runs[k, 1], runs[k, 2]):
            if not dark[i, j]:
                continue
            for facing, (di, dj) in enumerate(((-1, 0), (1, 0), (0, -1), (0, 1))):
                m, n = i + di, j + dj
                if m < 0 or m >= rows or n < 0 or n >= columns or dark[m, n] or state[m, n] > 2:
                    continue
                if _step(dark, drop, state, i, j, di, dj, across) < least:
                    continue
                if count == len(found):
                    found = longer(found)
                found[count] = (facing, j, i) if di else (facing, i, j)
                count += 1
    return found[:count]


@njit(cache=True, nogil=True)
def _step(
    dark: Bool, drop: Int16, state: UInt8, i: int, j: int, di: int, dj: int, across: int
) -> float:  # pragma: no cover - compiled
    """Mean drop of dark pixels inside a side less that of others outside; -inf where either is hidden."""
    rows, columns = dark.shape
    inside, outside, held, beyond = 0.0, 0.0, 0, 0
    for beside in range(-1, 2):
        m, n = i + across * di + beside * dj, j + across * dj + beside * di
        if 0 <= m < rows and 0 <= n < columns:
            if state[m, n] > 2:
                return -np.inf
            if state[m, n] > 0 and not dark[m, n] and drop[m, n] != NODATA:
                outside += drop[m, n]
                beyond += 1
        m, n = i - (across - 1) * di + beside * dj, j - (across - 1) * dj + beside * di
        if 0 <= m < rows and 0 <= n < columns and dark[m, n] and drop[m, n] != NODATA:
            inside += drop[m, n]
            held += 1
    return inside / held - outside / beyond if held and beyond else -np.inf
