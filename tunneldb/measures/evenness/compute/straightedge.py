"""Gaps beneath a virtual straightedge on a lining, along rows of cells."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Bool, Float, Int64, Single
from tunneldb.compiled import inner, kernel
from tunneldb.threads import in_blocks

MAX_UNSEEN_SHARE = 0.25
"""Maximum unseen share of a straightedge in one piece; otherwise it is not placed there."""

MIN_RIM_DISTANCE = 2
"""Minimum distance from a rim to the lowest place of a hollow, in cells; nearer it is roughness or noise, not a wave."""

_LEVEL_TOLERANCE = 1e-9  # m: of places equally deep within this, the one farther from the rims is the lowest
_BLOCK_ROWS = 64  # in a block of a thread


@dataclass(frozen=True)
class Gaps:
    """Gaps beneath straightedges, arrays (rows, cells) like the heights; NaN where not inspected or not measured.

    Attributes
    ----------
    gap : float array
        Greatest gap between a cell and a straightedge over it, m.
    waviness : float array
        At the lowest place of a hollow that is entirely beneath the straightedge, its depth divided by the distance to its
        nearer rim, the greatest value; else 0.
    """

    gap: Float
    waviness: Float

    @property
    def measured(self) -> Bool:
        """Cells over which a straightedge was placed."""
        return np.isfinite(self.gap)


def reach(length: float, cell: float) -> int:
    """Return the number of cells on either side of its middle that a straightedge of a length, m, covers."""
    return max(round(length / cell / 2.0), 1)


def gaps_beneath(height: Float, length: float, cell: float) -> Gaps:
    """Measure the gaps beneath a straightedge placed at each cell of the rows.

    Parameters
    ----------
    height : (rows, cells) float array
        Height of each cell towards the straightedge, m; NaN unseen.
    length : float
        Length of the straightedge, m.
    cell : float
        Distance of the cells, m.

    Notes
    -----
    With its middle on a cell, the straightedge rests on two points: the ends of the edge of the upper convex hull above that
    cell. If the middle itself is highest, it tips to either side. The gap is measured only between the two points of contact,
    not beyond them. The whole straightedge must be within the row.
    """
    half = reach(length, cell)
    height = np.ascontiguousarray(height, np.float64)
    found = Gaps(np.full(height.shape, np.nan), np.full(height.shape, np.nan))
    max_unseen = int(np.floor(MAX_UNSEEN_SHARE * length / cell))

    def block(begin: int, end: int) -> None:
        part = slice(begin, end)
        _gaps_beneath(height[part], half, max_unseen, cell, found.gap[part], found.waviness[part])

    in_blocks(block, len(height), _BLOCK_ROWS)
    return found


@kernel
def _gaps_beneath(
    height: Float, half: int, max_unseen: int, cell: float, gap: Float, waviness: Float
) -> None:  # pragma: no cover - compiled
    """Compute :func:`gaps_beneath` row by row; the last two arrays are overwritten."""
    rows, count = height.shape
    broken = np.zeros(count + 1, np.int64)  # number of cells so far that end an unseen gap that is too long
    for r in range(rows):
        h = height[r]
        unseen = 0
        for x in range(count):
            unseen = unseen + 1 if np.isnan(h[x]) else 0
            broken[x + 1] = broken[x] + (1 if unseen > max_unseen else 0)
        for c in range(half, count - half):
            first, last = c - half, c + half
            if broken[last + 1] > broken[first]:
                continue
            left, right = _contacts(h, c, first, last)
            if left < 0:
                continue
            for x in range(first, last + 1):  # under the straightedge, if it has no gap
                if not np.isnan(h[x]) and np.isnan(gap[r, x]):
                    gap[r, x] = waviness[r, x] = 0.0
            level = (h[left] * (right - c) + h[right] * (c - left)) / (right - left)
            if np.isnan(h[c]) or h[c] <= level:
                _hollow(h, left, right, left > first and right < last, cell, gap[r], waviness[r])
                continue
            left, right = _edges(h, c, first, last)
            _hollow(h, left, c, left > first, cell, gap[r], waviness[r])
            _hollow(h, c, right, right < last, cell, gap[r], waviness[r])


@inner
def _contacts(h: Float, c: int, first: int, last: int) -> tuple[int, int]:  # pragma: no cover - compiled
    """Return the contact points left and right of c of the straightedge over both, without c; -1 if a side has none."""
    left, right = c - 1, c + 1
    while left >= first and np.isnan(h[left]):
        left -= 1
    while right <= last and np.isnan(h[right]):
        right += 1
    if left < first or right > last:
        return -1, -1
    while True:
        changed = False
        slope = (h[right] - h[left]) / (right - left)
        for x in range(left - 1, first - 1, -1):
            steep = (h[right] - h[x]) / (right - x)
            if steep < slope - 1e-12:  # NaN never is
                left, slope, changed = x, steep, True
        for x in range(c + 1, last + 1):
            steep = (h[x] - h[left]) / (x - left)
            if steep > slope + 1e-12:
                right, slope, changed = x, steep, True
        if not changed:
            return left, right
        for x in range(c - 1, first - 1, -1):
            steep = (h[right] - h[x]) / (right - x)
            if steep < slope - 1e-12:
                left, slope = x, steep


@inner
def _edges(h: Float, c: int, first: int, last: int) -> tuple[int, int]:  # pragma: no cover - compiled
    """Return the next contact points to the left and right of c, which is one itself."""
    left, right = c, c
    slope = np.inf
    for x in range(c - 1, first - 1, -1):
        steep = (h[c] - h[x]) / (c - x)
        if steep < slope - 1e-12:
            left, slope = x, steep
    slope = -np.inf
    for x in range(c + 1, last + 1):
        steep = (h[x] - h[c]) / (x - c)
        if steep > slope + 1e-12:
            right, slope = x, steep
    return left, right


@inner
def _hollow(
    h: Float, left: int, right: int, whole: bool, cell: float, gap: Float, waviness: Float
) -> None:  # pragma: no cover - compiled
    """Record the gaps between two contact points, and a whole hollow's depth over the distance to its nearer rim.

    A hollow is not whole if the straightedge ends at a contact point: its rim may be beyond.
    """
    deepest, lowest, near = 0.0, -1, 0
    for x in range(left + 1, right):
        beneath = (h[left] * (right - x) + h[right] * (x - left)) / (right - left) - h[x]
        if beneath > gap[x] or (np.isnan(gap[x]) and beneath >= 0.0):
            gap[x] = beneath
        rim_distance = min(x - left, right - x)
        if beneath > deepest + _LEVEL_TOLERANCE or (
            beneath > deepest - _LEVEL_TOLERANCE and beneath > _LEVEL_TOLERANCE and rim_distance > near
        ):
            deepest, lowest, near = beneath, x, rim_distance
    if whole and near >= MIN_RIM_DISTANCE and deepest / (near * cell) > waviness[lowest]:
        waviness[lowest] = deepest / (near * cell)


@dataclass(frozen=True)
class Cells:
    """Means of an image in cells.

    Attributes
    ----------
    mean : (rows, cells) float array
        m; NaN where too little was seen.
    sigma : float array
        Standard deviation of each mean from the scatter of pixels, same shape.
    seen : int array
        Number of pixels seen in each.
    """

    mean: Float
    sigma: Float
    seen: Int64


def cell_means(values: Single, factor: int, least: int) -> Cells:
    """Return means of ``factor`` × ``factor`` pixels (rows, columns) with ``least`` pixels or more; both are multiples."""
    rows, columns = values.shape
    blocks = values.reshape(rows // factor, factor, columns // factor, factor)
    valid = np.isfinite(blocks)
    seen = valid.sum(axis=(1, 3))
    kept = np.where(valid, blocks, np.float32(0.0)).astype(np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = np.where(seen >= least, kept.sum(axis=(1, 3)) / seen, np.nan)
        square = np.maximum((kept**2).sum(axis=(1, 3)) / seen - mean**2, 0.0)
        sigma = np.sqrt(square / (seen - 1))
    return Cells(mean, sigma, seen.astype(np.int64))
