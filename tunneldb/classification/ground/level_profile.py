"""Level stretches of ground across the tunnel: main floor, further carriageways, walkways, kerbs."""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from tunneldb.arrays import Bool, Float, Int64
from tunneldb.classification.ground.model import COLUMN

LOW, HIGH = -0.8, 1.2
"""Ground lies between these heights about the plane of a segment, m: walkways, platforms, ditches."""

_BIN = 0.01  # of heights, m
_PIECE = 0.5  # along, m; longer where points are few
_SEEN = 0.5  # share of the pieces along the segment in which a level must be seen
_RAISED = 0.04  # m; a stretch that stands higher over those on both sides of it is no ground
_NARROW = 0.35  # m; if it is no wider: a rail, a cable
_GRADUAL = 0.15  # of the width of the widest stretch, over which the surface grows steeper in a round tunnel


@njit(cache=True, nogil=True, parallel=True)
def profiles(
    along: Float, across: Float, z: Float, cells: Int64, start: int, first: int, columns: int,
    centres: Float, planes: Float, half: float, distance: float,
) -> Float:  # pragma: no cover - compiled  # fmt: skip
    """Level of the ground about each segment's plane in each column, (g, columns), m; NaN where there is none.

    A column's level is the lowest height about which, within τ, points lie in most of the pieces of the segment
    in which the column shows anything at all. It must show something in half of the segment: a niche does not.

    Parameters
    ----------
    along, across, z : (n,) float arrays
        Points, by rows of 1 m from ``start`` and in them by columns of 0.1 m from ``first``.
    cells : (rows * columns + 1,) int array
        First point of each of them.
    centres, planes : (g,), (g, 3) float arrays
        Segments: middle, and the plane z = c0 + c1 (along - middle) + c2 across.
    half : float
        Half of the segment's window, m.
    distance : float
        τ, m.
    """
    out = np.full((centres.shape[0], columns), np.nan)
    bins = round((HIGH - LOW) / _BIN)
    reach = round(distance / _BIN)
    most = round(2 * half / _PIECE)
    rows = (cells.shape[0] - 1) // columns
    # A piece at the tunnel's end, or beside a gap, is too short to tell ground from what stands on it.
    window = np.empty((centres.shape[0], 4), np.int64)
    shown_length = np.zeros(centres.shape[0])
    for g in prange(centres.shape[0]):
        low = max(int(np.floor(centres[g] - half)) - start, 0)
        high = min(int(np.ceil(centres[g] + half)) - start, rows)
        pieces = _cut(cells, columns, low, high, most)
        length = _pieces(along, cells, columns, low, high, centres[g] - half, pieces, 2 * half / pieces)
        window[g, 0], window[g, 1], window[g, 2], window[g, 3] = low, high, pieces, length
        shown_length[g] = length * 2 * half / pieces
    enough = min(half, shown_length.max())
    for g in prange(centres.shape[0]):
        if np.isnan(planes[g, 0]) or shown_length[g] < enough:
            continue
        low, high, pieces, length = window[g, 0], window[g, 1], window[g, 2], window[g, 3]
        piece_length = 2 * half / pieces
        count = np.empty(bins + 1, np.int64)
        seen = np.empty((bins, pieces), np.bool_)
        here = np.empty(pieces, np.bool_)
        for c in range(columns):
            count[:] = 0
            seen[:] = False
            here[:] = False
            for row in range(low, high):
                for n in range(cells[row * columns + c], cells[row * columns + c + 1]):
                    from_middle = along[n] - centres[g]
                    piece = int(np.floor((from_middle + half) / piece_length))
                    if piece < 0 or piece >= pieces:
                        continue
                    e = z[n] - planes[g, 0] - planes[g, 1] * from_middle - planes[g, 2] * across[n]
                    b = int(np.floor((e - LOW) / _BIN))
                    if b >= 0 and b < bins:
                        count[b + 1] += 1
                        seen[b, piece] = True
                        here[piece] = True
            shown = here.sum()
            if shown < max(3.0, _SEEN * length):
                continue
            for b in range(bins):
                count[b + 1] += count[b]
            out[g, c] = _lowest(count, seen, shown, reach, bins)
    return out


@njit(cache=True, nogil=True)
def _cut(cells: Int64, columns: int, low: int, high: int, most: int) -> int:
    """How many pieces a segment is cut into: as many as hold two points of a usual column, but four at least."""
    number = np.zeros(columns)
    for c in range(columns):
        for row in range(low, high):
            number[c] += cells[row * columns + c + 1] - cells[row * columns + c]
    known = number[number > 0]
    pieces = most
    while pieces > 4 and known.size and np.median(known) < 2.0 * pieces:
        pieces //= 2
    return pieces


@njit(cache=True, nogil=True)
def _pieces(
    along: Float, cells: Int64, columns: int, low: int, high: int, begin: float, pieces: int, piece_length: float
) -> int:
    """How many pieces of a segment hold points at all."""
    seen = np.zeros(pieces, np.bool_)
    for n in range(cells[low * columns], cells[max(high, low) * columns]):
        piece = int(np.floor((along[n] - begin) / piece_length))
        if 0 <= piece < pieces:
            seen[piece] = True
    return seen.sum()


@njit(cache=True, nogil=True)
def _lowest(count: Int64, seen: Bool, shown: int, reach: int, bins: int) -> float:
    """The lowest level: where most points lie within τ, of those places where enough pieces show something."""
    best, most = -1, 0
    for b in range(reach, bins - reach):
        n = count[b + reach + 1] - count[b - reach]
        if best >= 0 and (b > best + reach):
            break
        if n > most and n >= 3:
            pieces = 0
            for p in range(seen.shape[1]):
                for k in range(b - reach, b + reach + 1):
                    if seen[k, p]:
                        pieces += 1
                        break
            if pieces >= _SEEN * shown and pieces >= 3:
                most, best = n, b
    if best < 0:
        return np.nan
    # Median of what lies within τ.
    below = count[best - reach]
    middle = below + 0.5 * (count[best + reach + 1] - below)
    k = best - reach
    while count[k + 1] < middle:
        k += 1
    inside = count[k + 1] - count[k]
    return LOW + _BIN * (k + (middle - count[k]) / inside)


def level_ground(level: Float, slope: float) -> Float:
    """Keep of a segment's levels those that make up ground.

    Columns whose levels rise or fall by less than δ from one to the next make up a stretch. Ground is the widest
    one, and the others but for narrow ones that stand out: rails.

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
        if outermost or (high - low) * COLUMN > _NARROW or not _raised(level, runs, k):
            kept[low:high] = level[low:high]
    return kept


def is_round(height: Float, slope: float) -> bool:
    """Tell whether a segment rather shows the bottom of a round tunnel.

    There the surface grows steeper bit by bit on both sides of its widest stretch; where a wall stands on a floor
    it does so at once.

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
    enough = _GRADUAL * (high - low)
    return _gentle(height[high - 1 :], slope) > enough and _gentle(height[: low + 1][::-1], slope) > enough


def _raised(level: Float, runs: list[tuple[int, int]], k: int) -> bool:
    """Whether a stretch stands out over those on both sides of it."""
    (low, high), before, after = runs[k], runs[k - 1][1] - 1, runs[k + 1][0]
    beside = max(level[before], level[after])
    return bool(np.median(level[low:high]) > beside + _RAISED)


def _stretches(level: Float, slope: float) -> list[tuple[int, int]]:
    """First column, and the one after the last, of stretches without steep or missing columns."""
    flat = np.abs(np.diff(level)) <= slope * COLUMN + _BIN
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flat, [False]]).astype(np.int8)))
    return [(int(low), int(high) + 1) for low, high in zip(edges[::2], edges[1::2], strict=True)]


def _gentle(height: Float, slope: float) -> int:
    """How many columns on the surface rises, by less than 3 δ, from a stretch's last column."""
    rise = (height[2:] - height[:-2]) / (2.0 * COLUMN)
    ends = np.flatnonzero(~((rise > 0.5 * slope) & (rise < 3.0 * slope)))
    return int(ends[0]) if len(ends) else len(rise)
