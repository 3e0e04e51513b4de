"""The shape of a region: how wide and how long it is, whether its sides are straight."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from tunneldb.arrays import Bool, Intp

PIECE = 2.0
"""Sides are compared with straight lines piece by piece, so long at most, m: a tunnel's alignment is no straighter."""

CORNER = 0.12
"""Share of a side that belongs to the corners, at either end of it."""


@dataclass(frozen=True)
class Shape:
    """Measures of a region, m.

    Attributes
    ----------
    along, across : float
        Extent in chainage and in arc.
    area : float
        m².
    width : float
        Diameter of the largest circle that fits in, about.
    fill : float
        Share that it fills, 0 to 1, of the box of the rows and columns that hold at least half as many of its pixels as the
        one of the median pixel: what sticks out of it is left out.
    corners : float
        Share that it fills of the emptiest corner of that box, 0 to 1.
    wander_box : float
        As ``wander_along``, of what lies in that box.
    slender : float
        Length of that box along the tunnel over its width.
    wander_along, wander_across : float
        Standard deviation about straight lines of the sides that face arcs, as one goes along the tunnel, and of those that
        face chainages, as one goes around it.
    """

    along: float
    across: float
    area: float
    width: float
    fill: float
    corners: float
    wander_box: float
    slender: float
    wander_along: float
    wander_across: float

    @property
    def length(self) -> float:
        """The greater extent, m."""
        return max(self.along, self.across)

    @property
    def mean_width(self) -> float:
        """Area over length, m."""
        return self.area / self.length


def measure(mask: Bool, pixel: float) -> Shape:
    """Measure a region of pixels with a given side, m."""
    rows, columns = mask.shape
    piece = max(4, round(PIECE / pixel))
    return Shape(
        columns * pixel,
        rows * pixel,
        float(np.count_nonzero(mask)) * pixel**2,
        float(_widest(mask)) * pixel,
        *_box(mask, pixel, piece),
        float(_wander(mask, piece)) * pixel,
        float(_wander(np.ascontiguousarray(mask.T), piece)) * pixel,
    )


def _box(mask: Bool, pixel: float, piece: int) -> tuple[float, float, float, float]:
    """Of the box without what sticks out: fill, corners, wander and slenderness."""
    full = np.ascontiguousarray(mask[np.ix_(_usual(np.count_nonzero(mask, axis=1)), _usual(np.count_nonzero(mask, axis=0)))])
    high, wide = (max(2, round(CORNER * side)) for side in full.shape)
    corners = (full[i, j] for i in (slice(high), slice(-high, None)) for j in (slice(wide), slice(-wide, None)))
    wander = float(_wander(full, piece)) * pixel
    return float(full.mean()), min(float(corner.mean()) for corner in corners), wander, full.shape[1] / full.shape[0]


def _usual(counts: Intp) -> Bool:
    """Which rows or columns hold at least half as many pixels as the one of the median pixel."""
    ordered = np.sort(counts)
    median = ordered[np.searchsorted(np.cumsum(ordered), 0.5 * ordered.sum())]
    return np.asarray(counts >= 0.5 * median, dtype=np.bool_)


@njit(cache=True, nogil=True)
def _widest(mask: Bool) -> float:  # pragma: no cover - compiled
    """Diameter of the largest inscribed circle, pixels: by chamfer distances (Borgefors, 1986: 3 to sides, 4 to corners)."""
    rows, columns = mask.shape
    far = np.zeros((rows + 2, columns + 2), np.uint16)
    for i in range(1, rows + 1):
        for j in range(1, columns + 1):
            if mask[i - 1, j - 1]:
                near = min(far[i - 1, j] + 3, far[i, j - 1] + 3)
                near = min(near, min(far[i - 1, j - 1], far[i - 1, j + 1]) + 4)
                far[i, j] = min(near, 65000)
    widest = 0
    for i in range(rows, 0, -1):
        for j in range(columns, 0, -1):
            if mask[i - 1, j - 1]:
                near = min(far[i + 1, j] + 3, far[i, j + 1] + 3)
                near = min(near, min(far[i + 1, j + 1], far[i + 1, j - 1]) + 4)
                far[i, j] = min(near, far[i, j])
                widest = max(widest, int(far[i, j]))
    return 2.0 * widest / 3.0 - 1.0


@njit(cache=True, nogil=True)
def _wander(mask: Bool, piece: int) -> float:  # pragma: no cover - compiled
    """Standard deviation, pixels, of the first and the last pixel of the columns about straight lines, piece by piece."""
    rows, columns = mask.shape
    first, last = np.full(columns, -1.0), np.full(columns, -1.0)
    for i in range(rows):
        for j in range(columns):
            if mask[i, j]:
                if first[j] < 0:
                    first[j] = i
                last[j] = i
    trim = max(1, round(CORNER * columns))
    begin, stop = trim, columns - trim
    if stop - begin < 3:
        return 0.0
    pieces = -(-(stop - begin) // piece)
    total, number = 0.0, 0
    for side in (first, last):
        for k in range(pieces):
            a, b = begin + (stop - begin) * k // pieces, begin + (stop - begin) * (k + 1) // pieces
            x = a + np.flatnonzero(side[a:b] >= 0.0).astype(np.float64)
            if len(x) < 3:
                continue
            y = side[a:b][side[a:b] >= 0.0]
            x -= x.mean()
            slope = (x * y).sum() / (x * x).sum()
            left = y - y.mean() - slope * x
            total += (left * left).sum()
            number += len(x)
    return float(np.sqrt(total / max(number, 1)))
