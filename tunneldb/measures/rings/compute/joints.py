"""Joints between rings in the unrolled images, from columns of pixels that differ all around and repeat evenly.

A joint shows as a narrow dark or bright line of intensity, as a groove, or as a step of the offset. Each is measured column
by column, over many rows that are weak one by one; the ring length is the distance at which the columns repeat. Joints are then
followed one by one: rings of curved tunnels are tapered, a ring may have another length, and a joint may be hidden.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import median_filter
from scipy.stats import gamma

from tunneldb.arrays import Bool, Float, Int64, Single
from tunneldb.counted import counted
from tunneldb.robust import MAD_TO_SIGMA

LINE_SIDE = 0.06
"""Distance before and behind at which a line is compared with its surroundings, m: more than a joint with beam and pixels."""

STEP_SIDE = 0.12
"""Length before and behind over which means are compared for a step, m."""

SECTORS = 8
"""Number of sectors in which steps are measured separately: a shifted ring steps inwards on one side and outwards opposite."""

MIN_ROWS = 20
"""Minimum number of rows of a column in a sector."""

PEAK_LEVEL = 5.0
"""Minimum strength of a peak, in standard deviations of the columns' scatter."""

MIN_RING_LENGTH, MAX_RING_LENGTH = 0.8, 2.5
"""Ring lengths searched, m."""

STRETCH = 50.0
"""Length over which rings are assumed to repeat evenly, m."""

CHANCE_LEVEL = 1e-3
"""Share of surveys in which random peaks repeat as evenly (Rayleigh's test over all lengths)."""

MULTIPLE_PREFERENCE = 0.6
"""Relative regularity from which a longer length is preferred: half the ring length repeats as well as the whole."""

STRAY_LEVEL = 3.5
"""Deviation from the place that the neighbours give, in standard deviations of all joints, from which a peak is no joint."""

_BACKGROUND_WINDOW = 2.0  # m, window for the usual strength of columns
_TOLERANCE = 0.012  # m, standard deviation of a ring's length about that of its neighbours
_MAX_LENGTH_COST = 9.0  # squared deviations: maximum cost of a ring with another length (three standard deviations)
_OFF_LENGTH_COST = 2.0 * PEAK_LEVEL
_GAP_COST = 4.0  # cost of each unseen joint
_MAX_GAPS = 6
_NEIGHBOURS = 3  # joints on either side that predict a joint's place
_STRAY_ROUNDS = 20
_MIN_SCALE = 0.002  # m


class NoRingsError(ValueError):
    """Ring length not determined; the message gives the reason."""


@dataclass(frozen=True)
class Joints:
    """Joints of a tunnel.

    Attributes
    ----------
    chainage : (n,) float array
        Increasing, m.
    seen : (n,) bool array
        False if a joint is interpolated between its neighbours.
    pitch, pitch_se : float
        Mean length of the rings between seen joints, and its standard error, m.
    """

    chainage: Float
    seen: Bool
    pitch: float
    pitch_se: float


def column_signals(level: Single | None, offset: Single, pixel: float) -> Float:
    """Compute each column's likeness to a joint: dark, bright line, groove, ridge, step, (5, columns); NaN without lining.

    Parameters
    ----------
    level : (rows, columns) float32 array or None
        Corrected intensity of lining, dB; NaN elsewhere.
    offset : (rows, columns) float32 array
        Offset of the same pixels, m.
    pixel : float
        Side of a pixel, m.
    """
    none = np.full((2, offset.shape[1]), np.nan)
    return np.vstack([none if level is None else _lines(level, pixel), _lines(offset, pixel), _step(offset, pixel)])


def _lines(values: Single, pixel: float) -> Float:
    """Return how much darker, and how much brighter, each column is than both its sides, (2, columns)."""
    k = max(round(LINE_SIDE / pixel), 1)
    before, behind = (np.full(values.shape, np.nan, np.float32) for _ in range(2))
    before[:, k:-k] = values[:, : -2 * k] - values[:, k:-k]
    behind[:, k:-k] = values[:, 2 * k :] - values[:, k:-k]
    return np.stack([_clipped_mean(np.minimum(before, behind)), _clipped_mean(np.minimum(-before, -behind))])


def _clipped_mean(off: Single) -> Float:
    seen = np.isfinite(off)
    if not seen.any():
        return np.full(off.shape[1], np.nan)
    middle = float(np.median(off[seen]))
    limit = 3.0 * MAD_TO_SIGMA * float(np.median(np.abs(off[seen] - middle)))
    total = np.where(seen, np.clip(off - middle, -limit, limit), 0.0).sum(axis=0, dtype=np.float64)
    count = seen.sum(axis=0)
    return np.where(count >= MIN_ROWS, total / np.maximum(count, 1) * np.sqrt(count), np.nan)


def _step(offset: Single, pixel: float) -> Float:
    """Return the root mean square, over the sectors, of the mean difference behind and before each column."""
    k = max(round(STEP_SIDE / pixel), 2)
    seen = np.isfinite(offset)
    sums = [np.cumsum(np.pad(part, ((0, 0), (1, 0))), axis=1, dtype=np.float64) for part in (np.where(seen, offset, 0.0), seen)]
    columns = offset.shape[1]
    total, count = ([one[:, j : columns - 2 * k + j + 1] for j in (0, k, 2 * k)] for one in sums)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean_before = (total[1] - total[0]) / (count[1] - count[0])
        mean_behind = (total[2] - total[1]) / (count[2] - count[1])
    change = (mean_behind - mean_before).astype(np.float32)
    parts = np.stack([_clipped_mean(part) for part in np.array_split(change, SECTORS, axis=0)])
    determined = np.isfinite(parts)
    out = np.full(columns, np.nan)
    with np.errstate(invalid="ignore", divide="ignore"):
        # The difference at edge j + k is between two columns; it is assigned to the one behind it.
        out[k : columns - k + 1] = np.sqrt(np.where(determined, parts**2, 0.0).sum(axis=0) / determined.sum(axis=0))
    return out


def strength(signals: Float, pixel: float) -> Float:
    """Combine all signals into one strength (columns,), in standard deviations; 0 where nothing is seen."""
    total = np.zeros(signals.shape[1])
    window = 2 * round(_BACKGROUND_WINDOW / pixel / 2.0) + 1
    for signal in signals:
        seen = np.isfinite(signal)
        if seen.sum() < window:
            continue
        filled = np.where(seen, signal, np.median(signal[seen]))
        out = filled - median_filter(filled, window, mode="nearest")
        spread = MAD_TO_SIGMA * float(np.median(np.abs(out[seen])))
        if spread > 0.0:
            total += np.where(seen, np.clip(out / spread, 0.0, 40.0), 0.0) ** 2
    return np.sqrt(total)


def peaks(strong: Float, pixel: float) -> tuple[Float, Float]:
    """Return places of peaks, in columns with fractions, and their strength, (n,) each."""
    half = max(round(0.12 / pixel), 2)
    padded = np.pad(strong, half)
    highest = np.array([padded[half + k : len(padded) - half + k] for k in range(-half, half + 1)]).max(axis=0)
    at = np.flatnonzero((strong >= PEAK_LEVEL) & (strong == highest))
    at = at[np.diff(at, prepend=-half - 1) > half]
    near = at[:, None] + np.arange(-2, 3)
    weight = np.take(strong, near, mode="clip") ** 2
    return (weight * near).sum(axis=1) / weight.sum(axis=1), strong[at]


def ring_length(places: Float, weight: Float) -> float:
    """Find the length with which peaks repeat, m.

    Parameters
    ----------
    places, weight : (n,) float arrays
        Chainage, m, and strength of the peaks.

    Raises
    ------
    NoRingsError
        If they repeat no better than random places.
    """
    if len(places) < 5:
        raise NoRingsError(f"only {counted(len(places), 'joint', 'joints')} found that run around the whole section")
    per_metre = np.arange(1.0 / MAX_RING_LENGTH, 1.0 / MIN_RING_LENGTH, 0.1 / STRETCH)
    power, parts = np.zeros(len(per_metre)), 0
    weight = np.minimum(weight, 4.0 * np.median(weight))
    number = np.floor(places / STRETCH).astype(np.int64)
    for first, stop in _runs(number):
        if stop - first < 4:
            continue
        turned = np.exp(2j * np.pi * np.outer(per_metre, places[first:stop] - places[first])) @ weight[first:stop]
        power += np.abs(turned) ** 2 / (weight[first:stop] ** 2).sum()
        parts += 1
    # With random peaks each stretch adds an exponential of mean 1 (Rayleigh's test): the sum has a gamma distribution.
    limit = gamma.isf(CHANCE_LEVEL / len(per_metre), max(parts, 1))
    if not parts or power.max() < limit:
        raise NoRingsError("places that look like joints do not repeat evenly")
    top = (power >= MULTIPLE_PREFERENCE * power.max()) & (power >= np.maximum(np.roll(power, 1), np.roll(power, -1)))
    return float(1.0 / per_metre[np.flatnonzero(top)[0]])


def _runs(number: Int64) -> Sequence[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(number, prepend=number[0] - 1, append=number[-1] + 1))
    return list(zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True))


def follow(places: Float, weight: Float, pitch: float) -> Joints:
    """Follow joints along the tunnel: find the strongest and most even chain of peaks.

    Parameters
    ----------
    places, weight : (n,) float arrays
        Chainage of the peaks, increasing, m, and strength.
    pitch : float
        Initial ring length, m.

    Notes
    -----
    The best chain is found by dynamic programming (Bellman, 1954). Each peak adds its strength, and costs its distance from
    a whole number of rings behind the previous one, up to a limit, so that one ring of another length does not break the chain.
    It is done twice, the second time with the local ring lengths (tapered rings form curves).
    """
    local = np.full(len(places), pitch)
    chain = _chain(places, weight, local)
    if len(chain) >= 8:
        gaps = np.diff(places[chain])
        rings = np.maximum(np.rint(gaps / pitch), 1.0)
        each = median_filter(gaps / rings, min(21, len(gaps) // 2 * 2 - 1), mode="nearest")
        local = np.interp(places, places[chain[1:]], each)
        chain = _chain(places, weight, local)
    chain = chain[_in_row(places[chain], local[chain])]
    return _filled(places[chain], local[chain], pitch)


def _chain(places: Float, weight: Float, local: Float) -> Int64:
    """Return the indices of the peaks on the best chain."""
    gain = np.minimum(weight, 3.0 * PEAK_LEVEL)
    best, back, leader = gain.copy(), np.full(len(places), -1), np.zeros(len(places), np.int64)
    for k in range(1, len(places)):
        first = int(np.searchsorted(places, places[k] - (_MAX_GAPS + 0.5) * local[k]))
        gaps = places[k] - places[first:k]
        indices = np.flatnonzero(gaps >= 0.4 * local[k])
        gaps = gaps[indices]
        rings = np.maximum(np.rint(gaps / local[k]), 1.0)
        off = np.minimum((gaps - rings * local[k]) ** 2 / (_TOLERANCE**2 * rings), _MAX_LENGTH_COST)
        total = best[first + indices] - off * _OFF_LENGTH_COST / _MAX_LENGTH_COST - _GAP_COST * (rings - 1.0)
        source = first + indices
        if first:  # across a long unseen stretch the chain continues from what came before
            total = np.append(total, best[leader[first - 1]] - _OFF_LENGTH_COST - _GAP_COST * _MAX_GAPS)
            source = np.append(source, leader[first - 1])
        if len(total) and total.max() > 0.0:
            last = int(np.argmax(total))
            best[k], back[k] = gain[k] + total[last], source[last]
        leader[k] = k if best[k] > best[leader[k - 1]] else leader[k - 1]
    chain = [int(np.argmax(best))]
    while back[chain[-1]] >= 0:
        chain.append(int(back[chain[-1]]))
    return np.array(chain[::-1])


def _in_row(seen: Float, local: Float) -> Bool:
    """Return True for joints where the joints before or behind predict them, (n,).

    A joint off from both sides is another peak beside a hidden joint: a ring of another length shifts all joints behind it.
    """
    kept = np.ones(len(seen), np.bool_)
    for _ in range(_STRAY_ROUNDS):
        at, length = seen[kept], local[kept]
        if len(at) < 2 * _NEIGHBOURS + 2:
            break
        rings = np.cumsum(np.maximum(np.rint(np.diff(at, prepend=at[0]) / length), 0.0))
        off = np.full((2, _NEIGHBOURS, len(at)), np.nan)
        for k in range(1, _NEIGHBOURS + 1):
            gap = at[k:] - at[:-k] - (rings[k:] - rings[:-k]) * length[k:]
            off[0, k - 1, k:], off[1, k - 1, :-k] = gap, -gap
        off[0, :, 0], off[1, :, -1] = np.inf, np.inf  # the ends have neighbours on one side only
        away = np.abs(np.nanmedian(off, axis=1))
        scale = MAD_TO_SIGMA * float(np.median(away[np.isfinite(away)]))
        deviation = away.min(axis=0)
        stray = deviation > STRAY_LEVEL * max(scale, _MIN_SCALE)
        if not stray.any():
            break
        near = np.pad(deviation, _NEIGHBOURS)
        highest = np.array([near[k : k + len(deviation)] for k in range(2 * _NEIGHBOURS + 1)]).max(axis=0)
        kept[np.flatnonzero(kept)[stray & (deviation == highest)]] = False
    return kept


def _filled(seen: Float, local: Float, pitch: float) -> Joints:
    """Insert hidden joints evenly between detected ones."""
    if len(seen) < 4:
        raise NoRingsError("places that look like joints form no regular series")
    gaps = np.diff(seen)
    rings = np.maximum(np.rint(gaps / local[1:]), 1.0).astype(np.int64)
    number = np.concatenate([[0], np.cumsum(rings)])
    whole = np.arange(number[-1] + 1)
    chainage = np.interp(whole, number, seen)
    one = rings == 1
    lengths = gaps / rings
    middle = float(np.median(lengths))
    usual = np.abs(lengths - middle) < 0.1 * pitch  # without rings of another length
    mean = float(gaps[usual].sum() / rings[usual].sum()) if usual.any() else middle
    spread = float(np.std(lengths[usual & one])) if (usual & one).sum() > 2 else _TOLERANCE
    return Joints(chainage, np.isin(whole, number), mean, spread / np.sqrt(max(int(usual.sum()), 1)))
