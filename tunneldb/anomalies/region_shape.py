"""Shape of a region: width, length, and straightness of its sides."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Bool, Int32, Intp
from tunneldb.compiled import kernel

PIECE_LENGTH = 2.0
"""Maximum length of the pieces in which sides are compared with straight lines, m: a tunnel's alignment is no straighter."""

CORNER_SHARE = 0.12
"""Share of a side that belongs to the corners, at either end of it."""

MAX_DISTANCE = np.int32(65000)
"""Maximum distance, in thirds of a pixel."""


@dataclass(frozen=True)
class Shape:
    """Shape measures of a region, m.

    Attributes
    ----------
    along, across : float
        Extent in chainage and in arc.
    area : float
        m².
    width : float
        Approximate diameter of the largest inscribed circle.
    rectangularity : float
        Share that it fills, 0 to 1, of its box without protruding parts. The box has the rows and columns with at least half as
        many pixels as that of the median pixel.
    corners : float
        Share that it fills of the emptiest corner of that box, 0 to 1.
    deviation_box : float
        ``deviation_along`` within that box.
    aspect_ratio : float
        Length of that box along the tunnel over its width.
    deviation_along, deviation_across : float
        Standard deviation about straight lines of the sides that face arcs, along the tunnel, and of those that face
        chainages, around it.
    """

    along: float
    across: float
    area: float
    width: float
    rectangularity: float
    corners: float
    deviation_box: float
    aspect_ratio: float
    deviation_along: float
    deviation_across: float

    @property
    def length(self) -> float:
        """Greater extent, m."""
        return max(self.along, self.across)

    @property
    def mean_width(self) -> float:
        """Area over length, m."""
        return self.area / self.length


def measure_shape(mask: Bool, pixel: float) -> Shape:
    """Measure a region of pixels with a given side, m."""
    rows, columns = mask.shape
    piece = max(4, round(PIECE_LENGTH / pixel))
    return Shape(
        columns * pixel,
        rows * pixel,
        float(np.count_nonzero(mask)) * pixel**2,
        _inscribed_diameter(mask) * pixel,
        *_box(mask, pixel, piece),
        _edge_deviation(mask, piece) * pixel,
        _edge_deviation(mask.T, piece) * pixel,
    )


def _box(mask: Bool, pixel: float, piece: int) -> tuple[float, float, float, float]:
    """Measure the box without protruding parts: rectangularity, its emptiest corner, edge deviation and aspect ratio."""
    full = mask[np.ix_(_usual(np.count_nonzero(mask, axis=1)), _usual(np.count_nonzero(mask, axis=0)))]
    high, wide = (max(2, round(CORNER_SHARE * side)) for side in full.shape)
    corners = (full[i, j] for i in (slice(high), slice(-high, None)) for j in (slice(wide), slice(-wide, None)))
    emptiest = min(float(corner.mean()) for corner in corners)
    return float(full.mean()), emptiest, _edge_deviation(full, piece) * pixel, full.shape[1] / full.shape[0]


def _usual(counts: Intp) -> Bool:
    """Select rows or columns with at least half as many pixels as that of the median pixel."""
    ordered = np.sort(counts)
    median = ordered[np.searchsorted(np.cumsum(ordered), 0.5 * ordered.sum())]
    return np.asarray(counts >= 0.5 * median, dtype=np.bool_)


def _inscribed_diameter(mask: Bool) -> float:
    """Return the diameter of the largest inscribed circle, pixels, by chamfer distances (Borgefors, 1986: 3 and 4)."""
    distance = np.where(np.pad(mask, 1), MAX_DISTANCE, np.int32(0))
    _chamfer(distance)
    return 2.0 * float(distance.max()) / 3.0 - 1.0


@kernel
def _chamfer(distance: Int32) -> None:  # pragma: no cover - compiled
    """Lower distances (rows, columns) to those from the nearest 0, in thirds of a pixel; the border is 0."""
    rows, columns = distance.shape
    for turn in range(2):
        step = 1 - 2 * turn  # forwards, then backwards
        for m in range(1, rows - 1):
            i = m if turn == 0 else rows - 1 - m
            for n in range(1, columns - 1):
                j = n if turn == 0 else columns - 1 - n
                if distance[i, j] == 0:
                    continue
                for di, dj, far in ((step, 0, 3), (0, step, 3), (step, 1, 4), (step, -1, 4)):
                    near = distance[i - di, j - dj] + far
                    if near < distance[i, j]:
                        distance[i, j] = near


def _edge_deviation(mask: Bool, piece: int) -> float:
    """Return the standard deviation, pixels, of the first and last pixel of the columns about straight lines, by pieces."""
    rows, columns = mask.shape
    trim = max(1, round(CORNER_SHARE * columns))
    begin, stop = trim, columns - trim
    if stop - begin < 3:
        return 0.0
    mask = mask[:, begin:stop]
    indices = np.flatnonzero(mask.any(axis=0))
    pieces = -(-(stop - begin) // piece)
    bounds = np.searchsorted(indices, [(stop - begin) * k // pieces for k in range(pieces + 1)])
    total, number = 0.0, 0
    for side in (mask.argmax(axis=0), rows - 1 - mask[::-1].argmax(axis=0)):
        for k in range(pieces):
            at = indices[bounds[k] : bounds[k + 1]]
            if len(at) < 3:
                continue
            x, y = at - at.mean(), side[at]
            slope = (x * y).sum() / (x * x).sum()
            residual = y - y.mean() - slope * x
            total += (residual * residual).sum()
            number += len(x)
    return float(np.sqrt(total / max(number, 1)))
