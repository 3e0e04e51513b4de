"""Heights of the ground row by row: levels of the segments blended, then refined by the points about them."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from numba import njit, prange

from tunneldb.arrays import Bool, Float, Int64
from tunneldb.classification.ground.model import COLUMN

_LOWER = 0.4  # share of the height in which the ground lies
_LEAST_LOWER = 1.0  # m
_OUTERMOST = 0.005  # share of points below and above all others that are no measure of the height
_SLICE = 0.05  # of the heights, m
_WIDEST = 30.0  # m
_ALONG = 1.0  # half of the window of a row's points, m
_PRIOR = 4.0  # points that the segments' level counts for
_STEP = 0.02  # between columns, m, that is no slope
_GAP = 20  # columns across which a hidden floor is filled in


def below(along: Float, across: Float, z: Float, step: float) -> Bool:
    """Tell which points lie in the lower 40 % of the heights of their segment (eq. 1), or its lowest metre.

    Parameters
    ----------
    along, across, z : (n,) float arrays
        Points, m; those not finite, or farther than 30 m from the line, are not kept.
    step : float
        Length of a segment, m.
    """
    kept = np.abs(across) < _WIDEST
    kept &= np.isfinite(along) & np.isfinite(z)
    if not kept.any():
        return kept
    segment = np.where(kept, np.floor(along / step), 0.0).astype(np.int64)
    segment -= segment[kept].min()
    _below(segment, z, int(segment[kept].max()) + 1, kept)
    return kept


@njit(cache=True, nogil=True)
def _below(segment: Int64, z: Float, segments: int, kept: Bool) -> None:  # pragma: no cover - compiled
    """Keep of the points those that lie low, by histograms of heights; the outermost 0.5 % of points don't count."""
    low, high = np.full(segments, np.inf), np.full(segments, -np.inf)
    number = np.zeros(segments, np.int64)
    for n in range(z.shape[0]):
        if kept[n]:
            k = segment[n]
            low[k], high[k] = min(low[k], z[n]), max(high[k], z[n])
            number[k] += 1
    first = np.zeros(segments + 1, np.int64)
    for k in range(segments):
        bins = 0
        if number[k] > 0:
            # On whole multiples of a bin, so that what lies farther off does not move them.
            low[k] = math.floor(low[k] / _SLICE) * _SLICE
            bins = int(min((high[k] - low[k]) / _SLICE, 1e5)) + 1
        first[k + 1] = first[k] + bins
    count = np.zeros(first[segments], np.int64)
    for n in range(z.shape[0]):
        if kept[n]:
            k = segment[n]
            count[min(first[k] + int((z[n] - low[k]) / _SLICE), first[k + 1] - 1)] += 1
    limit = np.empty(segments)
    for k in range(segments):
        few = _OUTERMOST * number[k]
        i, j = first[k], first[k + 1] - 1
        total = 0
        while i < j and total + count[i] <= few:
            total += count[i]
            i += 1
        total = 0
        while j > i and total + count[j] <= few:
            total += count[j]
            j -= 1
        bottom = low[k] + (i - first[k]) * _SLICE
        limit[k] = bottom + max(_LOWER * (j + 1 - i) * _SLICE, _LEAST_LOWER)
    for n in range(z.shape[0]):
        if kept[n] and z[n] > limit[segment[n]]:
            kept[n] = False


def blended(rows: Float, columns: Float, centres: Float, planes: Float, level: Float, step: float) -> Float:
    """Heights (rows, columns) of the segments' levels, passing evenly from each segment's middle to the next.

    Parameters
    ----------
    rows, columns : (r,), (c,) float arrays
        Distance along the line and to its right, m.
    centres, planes, level : (g,), (g, 3), (g, c) float arrays
        Segments, ``step`` m apart: middle, plane, and level about it; NaN where there is none.
    """
    height = planes[:, :1] + planes[:, 2:] * columns + level
    place = (rows - centres[0]) / step
    before = np.floor(place).astype(int)
    total, weight = np.zeros((len(rows), len(columns))), np.zeros((len(rows), len(columns)))
    for k in (before, before + 1):
        inside = (k >= 0) & (k < len(centres))
        at = np.clip(k, 0, len(centres) - 1)
        here = height[at] + (planes[at, 1] * (rows - centres[at]))[:, None]
        share = np.where(inside, 1.0 - np.abs(place - k), 0.0)
        # A level that only one of both segments has goes to the end of the other's part.
        share = np.maximum(share, np.where(inside, 1e-9, 0.0))[:, None] * np.isfinite(here)
        total += share * np.nan_to_num(here)
        weight += share
    with np.errstate(invalid="ignore"):
        return np.asarray(total / np.where(weight > 0, weight, np.nan))


def filled(height: Float) -> Float:
    """Fill columns hidden between others of their row, up to 2 m wide."""
    out = height.copy()
    for row in out:
        known = np.flatnonzero(np.isfinite(row))
        for left, right in pairwise(known.tolist()):
            if 1 < right - left <= _GAP:
                row[left + 1 : right] = np.interp(np.arange(left + 1, right), [left, right], row[[left, right]])
    return out


@njit(cache=True, nogil=True)
def carried_on(height: Float, count: int) -> Float:  # pragma: no cover - compiled
    """Replace the outermost columns of each row, which the wall may touch, by those inside them, carried straight on.

    They keep the slope of the four columns inside, unless there is a step.

    Parameters
    ----------
    height : (rows, columns) float array
        m.
    count : int
        Columns at each end.
    """
    out = height.copy()
    columns = height.shape[1]
    for i in range(height.shape[0]):
        for way in (1, -1):
            edge = 0 if way == 1 else columns - 1
            while 0 <= edge < columns and np.isnan(height[i, edge]):
                edge += way
            inner = edge + way * count
            if 0 <= inner < columns and height[i, inner - way] - height[i, inner] > 2.0 * _STEP:
                inner -= way  # a kerb at the wall
            beyond = inner + way * 4
            if beyond < 0 or beyond >= columns or np.isnan(height[i, inner]):
                continue
            slope = (height[i, inner] - height[i, beyond]) / 4.0
            for k in range(4):
                rise = height[i, inner + way * k] - height[i, inner + way * (k + 1)]
                if not abs(rise) < _STEP:
                    slope = 0.0
            for k in range(1, abs(inner - edge) + 1):
                out[i, inner - way * k] = height[i, inner] + slope * k
    return out


@njit(cache=True, nogil=True, parallel=True)
def refined(
    along: Float, across: Float, z: Float, spread: Float, cells: Int64, start: int, first: int, height: Float, gate: Float
) -> tuple[Float, Float, Float]:  # pragma: no cover - compiled
    """Heights moved to the mean of the points about them; of each row the number and sum of squares of what is left.

    Parameters
    ----------
    along, across, z, spread : (n,) float arrays
        Points in rows and columns, and the standard deviation of the heights that each stands for.
    cells : (rows * columns + 1,) int array
        First point of each cell.
    height : (rows + 1, columns) float array
        m; row i stands at ``start + i``, where the cells of row i begin.
    gate : (rows,) float array
        Points farther off than this don't count, m.
    """
    columns = height.shape[1]
    metres = (cells.shape[0] - 1) // columns
    out = height.copy()
    number = np.zeros(height.shape[0])
    square = np.zeros(height.shape[0])
    for i in prange(height.shape[0]):
        for c in range(columns):
            if np.isnan(height[i, c]):
                continue
            total, weight = 0.0, _PRIOR
            for k in range(max(c - 1, 0), min(c + 2, columns)):
                # Columns beside it count half, but not beyond a step.
                if not abs(height[i, k] - height[i, c]) <= _STEP:
                    continue
                near = 1.0 if k == c else 0.5
                for row in range(max(i - 1, 0), min(i + 1, metres)):
                    for n in range(cells[row * columns + k], cells[row * columns + k + 1]):
                        e = z[n] - _at(height, along[n] - start, across[n] / COLUMN - first)
                        if abs(e) < gate[i]:
                            w = near * (1.0 - (abs(along[n] - start - i) / _ALONG) ** 2)
                            total += w * e
                            weight += w
            out[i, c] += total / weight
    for i in prange(height.shape[0]):
        for row in range(max(i - 2, 0), min(i + 2, metres)):
            for c in range(1, columns - 1):
                if abs(out[i, c + 1] - out[i, c - 1]) > 2.0 * _STEP:
                    continue
                for n in range(cells[row * columns + c], cells[row * columns + c + 1]):
                    e = z[n] - _at(out, along[n] - start, across[n] / COLUMN - first)
                    if abs(e) < gate[i]:
                        number[i] += 1.0
                        square[i] += e * e + spread[n] ** 2
    return out, number, square


@njit(cache=True, nogil=True, inline="always")
def _at(height: Float, row: float, column: float) -> float:
    """Height between rows and columns; NaN beside a missing one."""
    i = min(max(int(row), 0), height.shape[0] - 2)
    j = min(max(math.floor(column), 0), height.shape[1] - 2)
    g, f = row - i, column - j
    one = (1.0 - g) * height[i, j] + g * height[i + 1, j]
    two = (1.0 - g) * height[i, j + 1] + g * height[i + 1, j + 1]
    if np.isnan(one) or f > 1.0:
        return two
    if np.isnan(two):
        return one
    return (1.0 - f) * one + f * two
