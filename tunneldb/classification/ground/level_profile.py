"""Level stretches of ground across the tunnel: main floor, further carriageways, walkways, kerbs."""

from __future__ import annotations

import numpy as np

from tunneldb.arrays import Float, Int64, UInt16
from tunneldb.classification.ground.model import COLUMN

LOW, HIGH = -0.8, 1.2
"""Limits of ground above and below the plane of a segment, m: walkways, platforms, ditches."""

_BIN = 0.01  # of heights, m
_PIECE = 0.5  # along, m; longer if points are sparse
_MIN_PIECES, _MAX_PIECES = 4, 16  # of a segment
_MIN_SEEN_SHARE = 0.5  # minimum share of the pieces along the segment in which a level is seen
_MIN_COUNT = 3  # minimum pieces, and points, of a level
_RAISED_BY = 0.04  # m; a stretch this much higher than both its neighbours is no ground
_MAX_RAISED_WIDTH = 0.35  # m; maximum width of such a stretch: a rail, a cable
_MIN_GRADUAL_SHARE = 0.15  # share of the widest stretch's width over which the surface becomes steeper in a round tunnel


def level_profiles(
    along: Float, across: Float, z: Float, cells: Int64, start: int, columns: int,
    centres: Float, planes: Float, half: float, distance: float,
) -> Float:  # fmt: skip
    """Find the level of the ground relative to each segment's plane in each column, (g, columns), m; NaN if none.

    A column's level is the lowest height with points within τ in most of the pieces of the segment in which the column has any
    points. A column must have points in half of the segment's pieces, which a niche does not.

    Parameters
    ----------
    along, across, z : (n,) float arrays
        Points, by rows of 1 m from ``start`` and within these by columns of 0.1 m.
    cells : (rows * columns + 1,) int array
        First point of each of them.
    centres, planes : (g,), (g, 3) float arrays
        Segments: middle, and the plane z = c0 + c1 (along - middle) + c2 across.
    half : float
        Half of the segment's window, m.
    distance : float
        τ, m.
    """
    rows = (len(cells) - 1) // columns
    bins, reach = round((HIGH - LOW) / _BIN), round(distance / _BIN)
    low = np.clip(np.floor(centres - half).astype(np.int64) - start, 0, rows)
    high = np.clip(np.ceil(centres + half).astype(np.int64) - start, low, rows)
    windows = list(zip(low.tolist(), high.tolist(), strict=True))
    pieces = [_pieces(cells[a * columns : b * columns + 1], columns, 2 * half) for a, b in windows]
    shown = [
        _pieces_with_points(along[cells[a * columns] : cells[b * columns]] - (centre - half), 2 * half, count)
        for (a, b), centre, count in zip(windows, centres, pieces, strict=True)
    ]
    # A piece at the tunnel's end, or beside a gap, is too short to separate the ground from objects on it.
    length = np.array([number * 2 * half / count for number, count in zip(shown, pieces, strict=True)])
    out = np.full((len(centres), columns), np.nan)
    for g in np.flatnonzero(~np.isnan(planes[:, 0]) & (length >= min(half, length.max()))).tolist():
        a, b = windows[g]
        inside = slice(cells[a * columns], cells[b * columns])
        column = np.repeat(np.arange((b - a) * columns) % columns, np.diff(cells[a * columns : b * columns + 1]))
        from_middle = along[inside] - centres[g]
        up = z[inside] - planes[g, 0] - planes[g, 1] * from_middle - planes[g, 2] * across[inside]
        piece = np.floor((from_middle + half) / (2 * half / pieces[g])).astype(np.int64)
        level = np.floor((up - LOW) / _BIN)
        kept = (piece >= 0) & (piece < pieces[g]) & (level >= 0) & (level < bins)
        bin_ = column[kept] * bins + level[kept].astype(np.int64)
        number = np.bincount(bin_, minlength=columns * bins).reshape(columns, bins)
        # One bit per piece.
        seen = np.zeros((columns, bins), np.uint16)
        np.bitwise_or.at(seen.reshape(-1), bin_, np.left_shift(1, piece[kept]).astype(np.uint16))
        there = _bits(np.bitwise_or.reduce(seen, axis=1))
        full = np.flatnonzero(there >= max(float(_MIN_COUNT), _MIN_SEEN_SHARE * shown[g]))
        out[g, full] = _lowest_levels(number[full], seen[full], there[full], reach)
    return out


def _pieces(cells: Int64, columns: int, window: float) -> int:
    """Return the number of pieces of a segment: as many as have two points in a typical column, but at least four."""
    pieces = min(round(window / _PIECE), _MAX_PIECES)
    number = np.diff(cells).reshape(-1, columns).sum(axis=0)
    number = number[number > 0]
    usual = float(np.median(number)) if len(number) else np.inf
    while pieces > _MIN_PIECES and usual < 2.0 * pieces:
        pieces //= 2
    return pieces


def _pieces_with_points(from_begin: Float, window: float, pieces: int) -> int:
    """Count the pieces of a segment that have points, from their distances from its beginning."""
    piece = np.floor(from_begin / (window / pieces))
    return len(np.unique(piece[(piece >= 0) & (piece < pieces)]))


def _lowest_levels(number: Int64, seen: UInt16, there: UInt16, reach: int) -> Float:
    """Find the lowest level of each column: most points within τ, where enough pieces have points.

    Parameters
    ----------
    number : (c, bins) int array
        Points in each bin of heights.
    seen : (c, bins) uint16 array
        Pieces with any points, one bit each.
    there : (c,) uint16 array
        Number of pieces with any points in the column.
    reach : int
        τ in bins.
    """
    count, bins = number.shape
    below = np.zeros((count, bins + 1), np.int64)
    np.cumsum(number, axis=1, out=below[:, 1:])
    middles = np.arange(reach, bins - reach)
    points = below[:, middles + reach + 1] - below[:, middles - reach]
    within = np.zeros((count, len(middles)), np.uint16)
    for shift in range(2 * reach + 1):
        within |= seen[:, shift : shift + len(middles)]
    pieces = _bits(within)
    points[(points < _MIN_COUNT) | (pieces < _MIN_COUNT) | (pieces < _MIN_SEEN_SHARE * there[:, None])] = 0
    out = np.full(count, np.nan)
    found = np.flatnonzero(points.any(axis=1))
    if not len(found):
        return out
    # From the lowest place on to one with more points, as long as the next is within τ.
    points, below = np.pad(points[found], ((0, 0), (0, reach))), below[found]
    each = np.arange(len(found))
    best = (points > 0).argmax(axis=1)
    while True:
        more = points[each[:, None], best[:, None] + np.arange(1, reach + 1)] > points[each, best][:, None]
        climbing = more.any(axis=1)
        if not climbing.any():
            break
        best[climbing] += 1 + more[climbing].argmax(axis=1)
    # Median of the points within τ: `best` counts from the first place, so it is the window's first bin.
    around = below[each[:, None], best[:, None] + np.arange(2 * reach + 2)]
    middle = around[:, 0] + 0.5 * (around[:, -1] - around[:, 0])
    k = (around[:, 1:] >= middle[:, None]).argmax(axis=1)
    inside = around[each, k + 1] - around[each, k]
    out[found] = LOW + _BIN * (best + k + (middle - around[each, k]) / inside)
    return out


def _bits(words: UInt16) -> UInt16:
    """Count the bits that are set in each word."""
    out = words - ((words >> 1) & 0x5555)
    out = (out & 0x3333) + ((out >> 2) & 0x3333)
    out = (out + (out >> 4)) & 0x0F0F
    return (out + (out >> 8)) & 0x1F


def level_ground(level: Float, slope: float) -> Float:
    """Return those levels of a segment that form ground.

    Columns whose levels rise or fall by less than δ from one to the next form a stretch. Ground is the widest stretch and all
    others, except narrow raised ones: rails.

    Parameters
    ----------
    level : (columns,) float array
        m.
    slope : float
        tan δ.
    """
    kept = np.full_like(level, np.nan)
    runs = _stretches(level, slope)
    for k, (low, high) in enumerate(runs):
        outermost = k == 0 or k == len(runs) - 1
        if outermost or (high - low) * COLUMN > _MAX_RAISED_WIDTH or not _raised(level, runs, k):
            kept[low:high] = level[low:high]
    return kept


def is_round(height: Float, slope: float) -> bool:
    """Return True if a segment rather shows the bottom of a round tunnel.

    There the surface becomes gradually steeper on both sides of its widest stretch; at a wall on a floor it is steep at once.

    Parameters
    ----------
    height : (columns,) float array
        Height of the segment's levels, m.
    slope : float
        tan δ.
    """
    runs = _stretches(height, slope)
    if not runs:
        return False
    low, high = max(runs, key=lambda run: run[1] - run[0])
    enough = _MIN_GRADUAL_SHARE * (high - low)
    return _gentle(height[high - 1 :], slope) > enough and _gentle(height[: low + 1][::-1], slope) > enough


def _raised(level: Float, runs: list[tuple[int, int]], k: int) -> bool:
    """Return True if a stretch is higher than both its neighbours."""
    (low, high), before, after = runs[k], runs[k - 1][1] - 1, runs[k + 1][0]
    neighbours = max(level[before], level[after])
    return bool(np.median(level[low:high]) > neighbours + _RAISED_BY)


def _stretches(level: Float, slope: float) -> list[tuple[int, int]]:
    """Return the first column, and one after the last, of stretches without steep or missing columns."""
    flat = np.abs(np.diff(level)) <= slope * COLUMN + _BIN
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flat, [False]]).astype(np.int8)))
    return [(int(low), int(high) + 1) for low, high in zip(edges[::2], edges[1::2], strict=True)]


def _gentle(height: Float, slope: float) -> int:
    """Count the columns over which the surface rises, by less than 3 δ, from a stretch's last column."""
    rise = (height[2:] - height[:-2]) / (2.0 * COLUMN)
    ends = np.flatnonzero(~((rise > 0.5 * slope) & (rise < 3.0 * slope)))
    return int(ends[0]) if len(ends) else len(rise)
