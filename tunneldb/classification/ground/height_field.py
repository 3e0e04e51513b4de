"""Heights of the ground row by row: blended levels of the segments, refined by the points around them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from tunneldb.arrays import Bool, Float, Int64
from tunneldb.classification.ground.model import COLUMN

_LOWER_SHARE = 0.4  # share of the height that contains the ground
_MIN_LOWER = 1.0  # m
_OUTLIER_SHARE = 0.005  # share of the lowest and highest points that is ignored for the height
_BIN = 0.05  # of the heights, m
_MAX_BINS = 100_000
_MAX_WIDTH = 30.0  # m
_ALONG = 1.0  # half of the window of a row's points, m
_PRIOR = 4.0  # weight of the segments' level, in points
_STEP = 0.02  # maximum step between columns of a slope, m
_SLOPE = 4  # columns for the slope at the edge
_MAX_GAP_COLUMNS = 20  # maximum columns of hidden floor that are filled


def in_lower_part(along: Float, across: Float, z: Float, step: float) -> Bool:
    """Select points in the lower 40 % of the heights of their segment (Li et al. 2023, eq. 1), or in its lowest metre.

    Parameters
    ----------
    along, across, z : (n,) float arrays
        Points, m; not selected if not finite, or farther than 30 m from the line.
    step : float
        Length of a segment, m.
    """
    kept = np.abs(across) < _MAX_WIDTH
    kept &= np.isfinite(along) & np.isfinite(z)
    if not kept.any():
        return kept
    segment = np.floor(along[kept] / step).astype(np.int64)
    segment -= segment.min()
    z = z[kept]
    kept[kept] = z <= _tops_of_lower_parts(segment, z)[segment]
    return kept


def _tops_of_lower_parts(segment: Int64, z: Float) -> Float:
    """Return the height of the top of each segment's lower part, m, from histograms without the outermost 0.5 % of points."""
    number = np.bincount(segment)
    low, high = np.full(len(number), np.inf), np.full(len(number), -np.inf)
    np.minimum.at(low, segment, z)
    np.maximum.at(high, segment, z)
    selected = number > 0
    # On whole multiples of a bin, so that distant points do not shift them.
    low = np.floor(np.where(selected, low, 0.0) / _BIN) * _BIN
    bins = np.where(selected, np.minimum((np.where(selected, high, 0.0) - low) / _BIN, _MAX_BINS).astype(np.int64) + 1, 0)
    first = np.concatenate([[0], np.cumsum(bins)])
    level = np.minimum((z - low[segment]) / _BIN, bins[segment] - 1).astype(np.int64)
    below = np.concatenate([[0], np.cumsum(np.bincount(first[segment] + level, minlength=first[-1]))])
    few = (_OUTLIER_SHARE * number).astype(np.int64)
    begin, end = first[:-1], first[1:]
    lowest = np.searchsorted(below[1:], below[begin] + few, side="right")
    highest = np.maximum(np.searchsorted(below, below[end] - few, side="left") - 1, lowest)
    bottom = low + (lowest - begin) * _BIN
    return np.asarray(bottom + np.maximum(_LOWER_SHARE * (highest + 1 - lowest) * _BIN, _MIN_LOWER))


def blend_segments(rows: Float, columns: Float, centres: Float, planes: Float, level: Float, step: float) -> Float:
    """Return heights (rows, columns) of the segments' levels, blended from each segment's middle to the next.

    Parameters
    ----------
    rows, columns : (r,), (c,) float arrays
        Distance along the line and to its right, m.
    centres, planes, level : (g,), (g, 3), (g, c) float arrays
        Segments, ``step`` m apart: middle, plane, and level above it; NaN if there is none.
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
        # A level that only one of both segments has continues to the end of the other's part.
        share = np.maximum(share, np.where(inside, 1e-9, 0.0))[:, None] * np.isfinite(here)
        total += share * np.nan_to_num(here)
        weight += share
    with np.errstate(invalid="ignore"):
        return np.asarray(total / np.where(weight > 0, weight, np.nan))


def fill_gaps(height: Float) -> Float:
    """Fill columns hidden between others of their row, up to 2 m wide."""
    out = height.copy()
    for row in out:
        known = np.flatnonzero(np.isfinite(row))
        for left, right in pairwise(known.tolist()):
            if 1 < right - left <= _MAX_GAP_COLUMNS:
                row[left + 1 : right] = np.interp(np.arange(left + 1, right), [left, right], row[[left, right]])
    return out


def extrapolate_edges(height: Float, count: int) -> Float:
    """Replace the outermost columns of each row, which the wall may touch, by extrapolation of the inner ones.

    The slope of the four inner columns continues, unless there is a step.

    Parameters
    ----------
    height : (rows, columns) float array
        m.
    count : int
        Columns at each end.
    """
    out = height.copy()
    for way in (1, -1):
        _extrapolate_left(height[:, ::way], out[:, ::way], count)
    return out


def _extrapolate_left(height: Float, out: Float, count: int) -> None:
    """Extrapolate the heights of each row to its first ``count`` known columns."""
    columns = height.shape[1]
    known = np.isfinite(height)
    edge = known.argmax(axis=1)
    rows = np.flatnonzero(known.any(axis=1) & (edge + count < columns))
    edge = edge[rows]
    inner = edge + count
    kerb = height[rows, inner - 1] - height[rows, inner] > 2.0 * _STEP  # at the wall
    inner = inner - kerb
    fits = inner + _SLOPE < columns
    rows, edge, inner = rows[fits], edge[fits], inner[fits]
    fits = known[rows, inner]
    rows, edge, inner = rows[fits], edge[fits], inner[fits]
    level = height[rows[:, None], inner[:, None] + np.arange(_SLOPE + 1)]
    even = (np.abs(level[:, :-1] - level[:, 1:]) < _STEP).all(axis=1)
    slope = np.where(even, (level[:, 0] - level[:, -1]) / _SLOPE, 0.0)
    for k in range(1, count + 1):
        outer = k <= inner - edge
        out[rows[outer], inner[outer] - k] = level[outer, 0] + slope[outer] * k


def refine_heights(
    along: Float, across: Float, z: Float, spread: Float, cells: Int64, start: int, first: int, height: Float, gate: Float
) -> tuple[Float, Float, Float]:
    """Move heights to the mean of the points around them; also return number and sum of squared residuals of each row.

    Parameters
    ----------
    along, across, z, spread : (n,) float arrays
        Points in rows and columns, and the standard deviation of the heights that each represents.
    cells : (metres * columns + 1,) int array
        First point of each cell.
    height : (metres + 1, columns) float array
        m; row i is at ``start + i``, where the cells of row i begin.
    gate : (metres + 1,) float array
        Maximum distance of points that count, m.
    """
    rows, columns = height.shape
    cell = np.repeat(np.arange(len(cells) - 1), np.diff(cells))
    metre, column = np.divmod(cell, columns)
    row, place = along - start, across / COLUMN - first
    rise = z - _between(height, row, place)
    moment, weight = np.zeros(height.shape), np.zeros(height.shape)
    off = np.abs(rise)
    for before in (1, 0):  # the metre before a row, and the one after it
        near = np.flatnonzero(off < gate[metre + before])
        i = metre[near] + before
        share = 1.0 - (np.abs(row[near] - i) / _ALONG) ** 2
        at = i * columns + column[near]
        moment += np.bincount(at, share * rise[near], height.size).reshape(height.shape)
        weight += np.bincount(at, share, height.size).reshape(height.shape)
    total, prior = moment.copy(), _PRIOR + weight
    # Columns beside it count half, but not beyond a step.
    even = np.abs(np.diff(height, axis=1)) <= _STEP
    for one, other in ((np.s_[:, 1:], np.s_[:, :-1]), (np.s_[:, :-1], np.s_[:, 1:])):
        total[one] += np.where(even, 0.5 * moment[other], 0.0)
        prior[one] += np.where(even, 0.5 * weight[other], 0.0)
    out = height + total / prior
    rise = z - _between(out, row, place)
    near = np.flatnonzero(np.abs(rise) < gate.max())
    metre, column, rise = metre[near], column[near], rise[near]
    off, left = np.abs(rise), rise * rise + spread[near] ** 2
    # Maximum distance of points by rows and columns; 0 beside a step, before the first row and beyond the last.
    even = np.zeros((rows + 2, columns), np.bool_)
    even[1:-1, 1:-1] = ~(np.abs(out[:, 2:] - out[:, :-2]) > 2.0 * _STEP)
    limit = even * np.pad(gate, 1)[:, None]
    number, square = np.zeros(rows + 2), np.zeros(rows + 2)
    for before in (2, 1, 0, -1):  # rows up to 2 m ahead of a metre, and up to 1 m behind it
        i = metre + before + 1
        selected = off < limit[i, column]
        number += np.bincount(i[selected], minlength=rows + 2)
        square += np.bincount(i[selected], left[selected], rows + 2)
    return out, number[1:-1], square[1:-1]


def _between(height: Float, row: Float, column: Float) -> Float:
    """Interpolate the height at places (n,) between rows and columns, m; beside a missing column use the other one."""
    i = np.clip(row.astype(np.int64), 0, height.shape[0] - 2)
    j = np.clip(np.floor(column).astype(np.int64), 0, height.shape[1] - 2)
    g, f = row - i, column - j
    one = (1.0 - g) * height[i, j] + g * height[i + 1, j]
    two = (1.0 - g) * height[i, j + 1] + g * height[i + 1, j + 1]
    mixed = np.where(np.isnan(two), one, (1.0 - f) * one + f * two)
    return np.where(np.isnan(one) | (f > 1.0), two, mixed)
