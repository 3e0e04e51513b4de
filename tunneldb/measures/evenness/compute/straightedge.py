"""Gaps beneath a straightedge laid on a lining, along rows of cells."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Bool, Float, Int64, Single
from tunneldb.compiled import inner, kernel
from tunneldb.threads import in_blocks

MOST_UNSEEN = 0.25
"""A straightedge is not laid over a gap in what was seen that is longer than this share of it."""

NEAREST = 2
"""A rim nearer to the lowest place of a hollow than so many cells tells nothing of a wave: it is roughness, or noise."""

_LEVEL = 1e-9  # m: of two places no deeper than that the one farther from the rims is the lowest
_ROWS = 64  # in a block of a thread


@dataclass(frozen=True)
class Gaps:
    """Beneath straightedges, arrays (rows, cells) as the heights; NaN where none could be laid, or nothing was seen.

    Attributes
    ----------
    gap : float array
        Greatest gap between a cell and a straightedge laid over it, m.
    waviness : float array
        At the lowest place of a hollow that lies whole beneath the straightedge its depth over the distance to its nearer rim,
        the greatest; else 0.
    """

    gap: Float
    waviness: Float

    @property
    def measured(self) -> Bool:
        """Cells over which a straightedge was laid."""
        return np.isfinite(self.gap)


def reach(length: float, cell: float) -> int:
    """Cells to either side of its middle that a straightedge of a length, m, covers."""
    return max(round(length / cell / 2.0), 1)


def gaps_beneath(height: Float, length: float, cell: float) -> Gaps:
    """Lay a straightedge on each place of rows of cells, and look beneath it.

    Parameters
    ----------
    height : (rows, cells) float array
        Height of each cell towards the straightedge, m; NaN unseen.
    length : float
        Of the straightedge, m.
    cell : float
        Distance of the cells, m.

    Notes
    -----
    Laid with its middle on a cell, it rests on the two points nearest to that on either side at which the upper convex hull of
    what lies beneath it has its edge there; where the middle itself is highest, it tips to either side. The gap is measured
    between the two points of contact alone: where it stands out over an edge, nothing is. It is laid whole, nowhere over an
    end of the row.
    """
    half = reach(length, cell)
    height = np.ascontiguousarray(height, np.float64)
    found = Gaps(np.full(height.shape, np.nan), np.full(height.shape, np.nan))
    most = int(np.floor(MOST_UNSEEN * length / cell))

    def block(begin: int, end: int) -> None:
        part = slice(begin, end)
        _gaps_beneath(height[part], half, most, cell, found.gap[part], found.waviness[part])

    in_blocks(block, len(height), _ROWS)
    return found


@kernel
def _gaps_beneath(
    height: Float, half: int, most: int, cell: float, gap: Float, waviness: Float
) -> None:  # pragma: no cover - compiled
    """What :func:`gaps_beneath` says, row by row; the last two arrays are overwritten."""
    rows, count = height.shape
    broken = np.zeros(count + 1, np.int64)  # how many cells up to here end an unseen gap that is too long
    for r in range(rows):
        h = height[r]
        unseen = 0
        for x in range(count):
            unseen = unseen + 1 if np.isnan(h[x]) else 0
            broken[x + 1] = broken[x] + (1 if unseen > most else 0)
        for c in range(half, count - half):
            first, last = c - half, c + half
            if broken[last + 1] > broken[first]:
                continue
            left, right = _contacts(h, c, first, last)
            if left < 0:
                continue
            for x in range(first, last + 1):  # under the straightedge, if with no gap
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
    """The points left and right of c that the straightedge over both rests on, c left out; -1 where a side has none."""
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
    """The next points of contact to the left and the right of c, which is one itself."""
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
    """Take note of the gaps between two points of contact, and of a whole hollow's depth over the way to its nearer rim.

    It is not whole where the straightedge ends at a point of contact: its rim may lie beyond.
    """
    deepest, lowest, near = 0.0, -1, 0
    for x in range(left + 1, right):
        beneath = (h[left] * (right - x) + h[right] * (x - left)) / (right - left) - h[x]
        if beneath > gap[x] or (np.isnan(gap[x]) and beneath >= 0.0):
            gap[x] = beneath
        aside = min(x - left, right - x)
        if beneath > deepest + _LEVEL or (beneath > deepest - _LEVEL and beneath > _LEVEL and aside > near):
            deepest, lowest, near = beneath, x, aside
    if whole and near >= NEAREST and deepest / (near * cell) > waviness[lowest]:
        waviness[lowest] = deepest / (near * cell)


@dataclass(frozen=True)
class Cells:
    """Means of an image in cells.

    Attributes
    ----------
    mean : (rows, cells) float array
        m; NaN where too little was seen.
    sigma : float array
        Standard deviation of each mean by the scatter of pixels, of the same shape.
    seen : int array
        Pixels seen in each.
    """

    mean: Float
    sigma: Float
    seen: Int64


def cell_means(values: Single, factor: int, least: int) -> Cells:
    """Means of ``factor`` × ``factor`` pixels (rows, columns), both whole multiples of it, with ``least`` pixels or more."""
    rows, columns = values.shape
    blocks = values.reshape(rows // factor, factor, columns // factor, factor)
    held = np.isfinite(blocks)
    seen = held.sum(axis=(1, 3))
    kept = np.where(held, blocks, np.float32(0.0)).astype(np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = np.where(seen >= least, kept.sum(axis=(1, 3)) / seen, np.nan)
        square = np.maximum((kept**2).sum(axis=(1, 3)) / seen - mean**2, 0.0)
        sigma = np.sqrt(square / (seen - 1))
    return Cells(mean, sigma, seen.astype(np.int64))
