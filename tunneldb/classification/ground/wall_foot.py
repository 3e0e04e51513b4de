"""Where the walls meet the ground, and how they lean just above it."""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange
from scipy import ndimage

from tunneldb.arrays import Float, Int64
from tunneldb.classification.ground.model import COLUMN
from tunneldb.classification.ground.ransac import draw, through

_HIGH = 0.6  # points of the wall are looked for up to this height, m
_INWARD, _OUTWARD = 0.35, 0.9  # and so far from where the ground ends, m
_ALONG = 2  # and so many metres before and after a row
_WITHIN = 0.02  # of the wall's plane, m
_TRIALS = 60
_LEAST = 15
_NEIGHBOURS = 9  # rows whose median a foot must be near
_APART = 0.05  # m


@njit(cache=True, nogil=True, parallel=True)
def walls(
    along: Float, across: Float, z: Float, cells: Int64, start: int, first: int, height: Float, low: Float, seed: int
) -> tuple[Float, Float]:  # pragma: no cover - compiled
    """Foot and lean of the left and the right wall at each row, (rows, 2) each; NaN where no wall is seen.

    The wall is the plane in which, by RANSAC, most of the points lie that stand just above the outermost ground;
    then a surface curved in height that is fitted to them by least squares.

    Parameters
    ----------
    along, across, z : (n,) float arrays
        Points in rows and columns, m.
    cells : (metres * columns + 1,) int array
        First point of each cell.
    height : (rows, columns) float array
        Ground, m.
    low : (rows,) float array
        Height above the ground from which a point belongs to the wall for sure, m.
    seed : int
        Start of the random numbers.
    """
    rows, columns = height.shape
    metres = (cells.shape[0] - 1) // columns
    foot = np.full((rows, 2), np.nan)
    lean = np.full((rows, 2), np.nan)
    inward, outward = int(_INWARD / COLUMN + 0.5), int(_OUTWARD / COLUMN + 0.5)
    for i in prange(rows):
        for side in range(2):
            edge = -1
            for k in range(columns):
                c = k if side == 0 else columns - 1 - k
                if not np.isnan(height[i, c]):
                    edge = c
                    break
            if edge < 0:
                continue
            way = -1 if side == 0 else 1
            one, two = edge - way * inward, edge + way * outward
            left, right = max(min(one, two), 0), min(max(one, two) + 1, columns)
            count = 0
            for row in range(max(i - _ALONG, 0), min(i + _ALONG, metres)):
                count += cells[row * columns + right] - cells[row * columns + left]
            found = np.empty((count, 3))
            n = 0
            for row in range(max(i - _ALONG, 0), min(i + _ALONG, metres)):
                for p in range(cells[row * columns + left], cells[row * columns + right]):
                    share = along[p] - start - row
                    base = height[row, edge] * (1.0 - share) + height[row + 1, edge] * share
                    up = z[p] - base
                    if up > low[i] and up < _HIGH:
                        found[n, 0], found[n, 1], found[n, 2] = along[p] - start - i, up, across[p]
                        n += 1
            if n >= _LEAST:
                state = np.empty(1, np.uint64)
                state[0] = np.uint64(seed) + np.uint64(2 * (i + start + 1_000_000) + side)
                foot[i, side], lean[i, side] = _wall(found[:n], state)
    return foot, lean


@njit(cache=True, nogil=True)
def _wall(points: Float, state: Int64) -> tuple[float, float]:
    """Foot and lean of the wall among points (along, up, across)."""
    count = points.shape[0]
    plane, best = np.empty(3), np.empty(3)
    most = 0
    for _ in range(_TRIALS):
        i, j, k = int(draw(state) * count), int(draw(state) * count), int(draw(state) * count)
        if not through(points[i], points[j], points[k], plane) or abs(plane[1]) > 0.15 or abs(plane[2]) > 3.0:
            continue
        reach = _WITHIN * math.sqrt(1.0 + plane[2] ** 2)
        n = 0
        for m in range(count):
            if abs(points[m, 2] - plane[0] - plane[1] * points[m, 0] - plane[2] * points[m, 1]) < reach:
                n += 1
        if n > most:
            most = n
            best[:] = plane
    if most < _LEAST:
        return np.nan, np.nan
    c = np.array([best[0], best[1], best[2], 0.0])
    row = np.empty(4)
    reach = 1.5 * _WITHIN * math.sqrt(1.0 + best[2] ** 2)
    for _ in range(5):
        a = np.zeros((4, 4))
        b = np.zeros(4)
        for m in range(count):
            row[0], row[1], row[2], row[3] = 1.0, points[m, 0], points[m, 1], points[m, 1] ** 2
            e = points[m, 2] - c[0] - c[1] * row[1] - c[2] * row[2] - c[3] * row[3]
            if abs(e) >= reach:
                continue
            w = (1.0 - (e / reach) ** 2) ** 2
            for p in range(4):
                b[p] += w * row[p] * points[m, 2]
                for q in range(4):
                    a[p, q] += w * row[p] * row[q]
        a[3, 3] += 0.01  # no curvature where the points don't show any
        for p in range(4):
            a[p, p] += 1e-9
        c[:] = np.linalg.solve(a, b)
    return c[0], c[2]


def steady(foot: Float, lean: Float) -> tuple[Float, Float]:
    """Feet and leans again, those of niches, doors and things by the wall after the rows beside them."""
    foot, lean = foot.copy(), lean.copy()
    for side in range(2):
        usual = _median(foot[:, side])
        with np.errstate(invalid="ignore"):
            astray = ~(np.abs(foot[:, side] - usual) < _APART)
        slant = _median(np.where(astray, np.nan, lean[:, side]))
        foot[astray, side] = usual[astray]
        lean[:, side] = slant
    return foot, lean


def _median(values: Float) -> Float:
    """Median of each value and those beside it that are known; NaN where fewer than three are."""

    def middle(window: Float) -> float:
        known = window[np.isfinite(window)]
        return float(np.median(known)) if len(known) >= 3 else float("nan")

    return np.asarray(ndimage.generic_filter(values, middle, size=_NEIGHBOURS, mode="constant", cval=np.nan))
