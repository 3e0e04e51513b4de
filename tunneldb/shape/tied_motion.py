"""Motion of sections that changed their shape, by what sections beside them did.

A section of which a whole wall moved, or which became oval, does not tell by itself which of its sides stayed. The error of a
registration goes on from section to section evenly, but where a scanner's place or a pass ends; so what sections before and
behind it did, and what part of it did the same, is taken for its motion, and the rest for a change of its shape.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solveh_banded

from tunneldb.arrays import Bool, Float, Int64
from tunneldb.robust import MAD_TO_SIGMA
from tunneldb.shape.rigid_motion import MOTIONS, Motion, SectionCells, loss, motion_from, removed_by, unexplained

MOVED = 0.04
"""A section of which more cells than this share are not explained by its own motion changed its shape."""

EXPLAINED = 0.75
"""A section of which its own motion explains more than this share of what its neighbours' leaves moved as a whole."""

LEAST_SECTIONS = 8
"""With fewer sections that kept their shape nothing is known of how even the motion is."""

COMMON = 0.5
"""Motions that are determined in a larger share of the sections are tied."""

_LAGS = (1, 2)  # sections: over more, breaks are in too many of them
_EVEN = 1e-5  # m or rad / 10 m: second differences are never taken to be smaller
_BREAK = 3.0  # second differences beyond so many standard deviations are of breaks
_ROUNDS = 8
_STILL = 2e-5  # m
_LARGE = 1e6  # variances are never larger than this, so that matrices can be solved


@dataclass(frozen=True)
class _Even:
    """Motions that go on evenly: values and variances, (sections, 6), NaN of motions that no section determines.

    And for each motion the weights of its second differences, less where it breaks.
    """

    values: Float
    variances: Float
    ties: dict[int, Float]


def tied_motions(sections: Sequence[SectionCells], number: Int64, motions: Sequence[Motion]) -> list[Motion]:
    """Motions of sections, those replaced by what their neighbours say that changed their shape and do not tell.

    Parameters
    ----------
    sections : sequence of SectionCells
    number : (k,) int array
        Of the sections along the tunnel, growing; equal steps are equal lengths.
    motions : sequence of Motion
        Of each by itself.
    """
    left = np.array([unexplained(s, s.difference - m.removed) for s, m in zip(sections, motions, strict=True)])
    if np.isfinite(left).sum() < LEAST_SECTIONS:
        return list(motions)
    usual = float(np.nanmedian(left))
    kept, changed = left - usual < MOVED, np.flatnonzero(left - usual >= MOVED).tolist()
    if kept.sum() < LEAST_SECTIONS or not changed:
        return list(motions)
    used = np.mean([m.used for m in motions if m.used.any()], axis=0) > COMMON
    values, variances = np.full((2, len(motions), len(MOTIONS)), np.nan)
    for k in np.flatnonzero(kept).tolist():
        # A roll that is found here and not there would be in the shift to the right there.
        own = motions[k] if (motions[k].used == used).all() else motion_from(sections[k], motions[k].values, used)
        if own is not None and (own.used == used).all():
            values[k], variances[k] = own.values, own.errors**2
    even = _with_changed(sections, number, values, variances, used, changed)
    result = list(motions)
    for k in changed:
        result[k] = _chosen(
            sections[k],
            motions[k],
            removed_by(sections[k], even.values[k], np.sqrt(even.variances[k]), used),
            _broken(sections[k], values, number, k, used),
            usual,
        )
    return result


def _chosen(cells: SectionCells, own: Motion, tied: Motion | None, broken: Motion | None, usual: float) -> Motion:
    """Which motion a section made: its own, its neighbours', or in one part that of those before and in one of those behind."""

    def excess(motion: Motion) -> float:
        return unexplained(cells, cells.difference - motion.removed) - usual

    if broken is not None and excess(broken) < (1.0 - EXPLAINED) * excess(own):
        return broken
    if tied is not None and excess(own) >= (1.0 - EXPLAINED) * excess(tied):
        return tied
    return own


def _with_changed(
    sections: Sequence[SectionCells], number: Int64, values: Float, variances: Float, used: Bool, changed: list[int]
) -> _Even:
    """Even motions of the sections that kept their shape, and of what the others share with them."""
    values, variances = values.copy(), variances.copy()
    wander = _wander(number, values, variances)
    even = _even(number, values, variances, wander)
    for _ in range(_ROUNDS):
        for k in changed:
            own = motion_from(sections[k], even.values[k], used)
            values[k], variances[k] = np.nan, np.nan
            if own is not None:
                # What only some of its cells share counts the less, the farther it is from what its neighbours did.
                apart = (own.values - even.values[k]) ** 2 / (_BREAK**2 * (own.errors**2 + even.variances[k]))
                values[k], variances[k] = own.values, own.errors**2 * (1.0 + apart) ** 2
        before, even = even, _even(number, values, variances, wander, even.ties)
        if float(np.nanmax(np.abs(even.values - before.values), initial=0.0)) < _STILL:
            break
    return even


def _broken(cells: SectionCells, values: Float, number: Int64, k: int, used: Bool) -> Motion | None:
    """Motion of a section in which one scanner's place ends and another begins: as before it, and from a cut on as behind it.

    The cut is where both together leave least; None without two sections on either side that kept their shape.
    """
    if not 2 <= k < len(number) - 2 or number[k + 2] - number[k - 2] != 4:
        return None
    starts = [2.0 * values[k + near] - values[k + far] for near, far in ((-1, -2), (1, 2))]
    if not np.isfinite([start[used] for start in starts]).all():
        return None
    before, behind = (loss(cells, cells.difference - cells.columns[:, used] @ start[used]) for start in starts)
    left = np.concatenate([[0.0], np.cumsum(np.bincount(cells.column, before - behind))])
    first = cells.column < int(left.argmin())
    one = motion_from(cells.part(first), starts[0], used)
    other = motion_from(cells.part(~first), starts[1], used)
    if one is None or other is None:
        return None
    removed, error = np.empty(len(first)), np.empty(len(first))
    for held, part in ((first, one), (~first, other)):
        removed[held], error[held] = part.removed, part.removed_error
    larger = one if 2 * first.sum() > len(first) else other
    return Motion(larger.values, larger.errors, removed, error, len(first))


def _wander(number: Int64, values: Float, variances: Float) -> Float:
    """Variance (6,) of the second differences of the motions from section to section, without their own errors."""
    place = {int(n): k for k, n in enumerate(number)}
    found = np.full(len(MOTIONS), _EVEN**2)
    for lag in _LAGS:
        triples = [(place[n - lag], k, place[n + lag]) for n, k in place.items() if n - lag in place and n + lag in place]
        if not triples:
            continue
        first, middle, last = np.array(triples).T
        bent = values[first] - 2.0 * values[middle] + values[last]
        noise = variances[first] + 4.0 * variances[middle] + variances[last]
        for c in range(len(MOTIONS)):
            shown = np.isfinite(bent[:, c])
            if shown.sum() < LEAST_SECTIONS // 2:
                continue
            spread = (MAD_TO_SIGMA * np.median(np.abs(bent[shown, c]))) ** 2 - np.median(noise[shown, c])
            # Of a motion whose second differences are independent, those over a lag grow so.
            found[c] = max(found[c], spread / (lag * (2.0 * lag**2 + 1.0) / 3.0))
    return found


def _even(number: Int64, values: Float, variances: Float, wander: Float, ties: dict[int, Float] | None = None) -> _Even:
    """The most probable motions of all sections, second differences being independent, and their variances."""
    at = (number - number[0]).astype(np.int64)
    count = int(at[-1]) + 1
    found: dict[int, Float] = {}
    result = np.full((2, len(number), len(MOTIONS)), np.nan)
    for c in range(len(MOTIONS)):
        shown = np.isfinite(values[:, c]) & np.isfinite(variances[:, c])
        if shown.sum() < LEAST_SECTIONS:
            continue
        weight, target = np.zeros(count), np.zeros(count)
        weight[at[shown]] = 1.0 / np.maximum(variances[shown, c], _EVEN**2)
        target[at[shown]] = weight[at[shown]] * values[shown, c]
        rows = np.full(count - 2, 1.0 / wander[c]) if ties is None else ties[c]
        for _ in range(_ROUNDS if ties is None else 1):
            smooth = solveh_banded(_bands(weight, rows), target)
            if ties is None:
                bent = np.diff(smooth, 2)
                rows = 1.0 / (wander[c] * (1.0 + (bent / _BREAK) ** 2 / wander[c]))
        found[c] = rows
        result[0, :, c] = smooth[at]
        result[1, :, c] = np.diag(solveh_banded(_bands(weight, rows), np.eye(count)))[at]
    return _Even(result[0], result[1], found)


def _bands(weight: Float, rows: Float) -> Float:
    """Upper bands (3, n) of the normal matrix of data (n,) and second differences (n - 2,) with these weights."""
    count = len(weight)
    bands = np.zeros((3, count))
    bands[2] = weight + 1.0 / _LARGE
    for k, factor in enumerate((1.0, -2.0, 1.0)):
        bands[2, k : count - 2 + k] += rows * factor**2
    bands[1, 1 : count - 1] -= 2.0 * rows
    bands[1, 2:] -= 2.0 * rows
    bands[0, 2:] += rows
    return bands
