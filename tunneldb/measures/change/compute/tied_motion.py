"""Motion of sections that changed their shape, from the motion of sections beside them.

If a whole wall moved, or a section became oval, the section alone does not show which of its sides stayed in place. The error
of a registration continues smoothly from section to section, except where a scanner position or a pass ends. So the motion of
the sections before and behind, where a part of this section followed it, is used as its motion, and the rest is change.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solveh_banded

from tunneldb.arrays import Bool, Float, Int64
from tunneldb.measures.change.compute.rigid_motion import (
    MOTIONS,
    Motion,
    SectionCells,
    loss,
    motion_from,
    removed_by,
    unexplained,
)
from tunneldb.robust import MAD_TO_SIGMA

MAX_UNEXPLAINED_SHARE = 0.04
"""Share of cells not explained by its own motion from which a section changed its shape."""

MIN_EXPLAINED_SHARE = 0.75
"""Share of the neighbours' residual explained by its own motion from which a section moved as a whole."""

MIN_SECTIONS = 8
"""Minimum number of sections that kept their shape, for estimating the smoothness of the motion."""

MIN_DETERMINED_SHARE = 0.5
"""Share of sections in which a motion must be determined to be tied."""

_LAGS = (1, 2)  # sections: longer lags contain too many breaks
_MIN_SCATTER = 1e-5  # m: lower limit of second differences and errors
_BREAK_LEVEL = 3.0  # standard deviations of a second difference from which it is a break
_ROUNDS = 8
_CONVERGED = 2e-5  # m
_MAX_VARIANCE = 1e6  # upper limit of variances, so that matrices can be solved


@dataclass(frozen=True)
class _Axes:
    """Independently determined motions: principal axes of the effect of the determined motions on cells.

    About the tunnel's axis, a roll and a shift to the right of a round lining are nearly the same. Each alone is known poorly
    and varies much from section to section; their joint effect on the lining is known well.

    Attributes
    ----------
    used : (6,) bool array
        The determined motions, m in number.
    turn : (m, m) float array
        From motions along the axes, m, to these motions.
    """

    used: Bool
    turn: Float

    def along(self, motion: Motion) -> tuple[Float, Float]:
        """Return values (m,) and variances (m,) of a motion along the axes."""
        back = np.linalg.inv(self.turn)
        selected = motion.covariance[np.ix_(self.used, self.used)]
        return back @ motion.values[self.used], np.einsum("ij,jk,ik->i", back, selected, back)

    def values(self, along: Float) -> Float:
        """Return values (6,) from values (m,) along the axes; NaN for motions that are not determined."""
        found = np.full(len(MOTIONS), np.nan)
        found[self.used] = self.turn @ along
        return found

    def removed(self, cells: SectionCells, along: Float, variance: Float) -> Motion:
        """Return the motion of a section from values (m,) along the axes, with variances (m,)."""
        return removed_by(cells, self.turn @ along, self.turn * variance @ self.turn.T, self.used)


@dataclass(frozen=True)
class _Even:
    """Smooth motions: values and variances along the axes, (sections, m).

    Also, for each axis, the weights of its second differences, (m, n), smaller at breaks.
    """

    values: Float
    variances: Float
    ties: Float


def tied_motions(sections: Sequence[SectionCells], number: Int64, motions: Sequence[Motion]) -> list[Motion]:
    """Replace the motions of sections that changed their shape and do not determine it by their neighbours'.

    Parameters
    ----------
    sections : sequence of SectionCells
    number : (k,) int array
        Numbers of the sections along the tunnel, increasing; equal steps are equal lengths.
    motions : sequence of Motion
        Motion of each by itself.
    """
    left = np.array([unexplained(s, s.difference - m.removed) for s, m in zip(sections, motions, strict=True)])
    if np.isfinite(left).sum() < MIN_SECTIONS:
        return list(motions)
    usual = float(np.nanmedian(left))
    kept, changed = left - usual < MAX_UNEXPLAINED_SHARE, np.flatnonzero(left - usual >= MAX_UNEXPLAINED_SHARE).tolist()
    if not changed:
        return list(motions)
    used = np.mean([m.used for m in motions if m.used.any()], axis=0) > MIN_DETERMINED_SHARE
    # A roll that is found in one section and not in the next would be in the next one's shift to the right.
    alike = {k: _determined_so(sections[k], motions[k], used) for k in np.flatnonzero(kept).tolist()}
    settled = {k: motion for k, motion in alike.items() if motion is not None}
    if len(settled) < MIN_SECTIONS:
        return list(motions)
    axes = _axes([sections[k] for k in settled], used)
    values, variances = np.full((2, len(motions), int(used.sum())), np.nan)
    for k, motion in settled.items():
        values[k], variances[k] = axes.along(motion)
    even = _with_changed(sections, number, values, variances, axes, changed)
    result = list(motions)
    for k in changed:
        result[k] = _chosen(
            sections[k],
            motions[k],
            axes.removed(sections[k], even.values[k], even.variances[k]),
            _broken(sections[k], values, number, k, axes),
            usual,
        )
    return result


def _determined_so(cells: SectionCells, own: Motion, used: Bool) -> Motion | None:
    """Return the motion of a section with the used components; None if it does not determine them."""
    motion = own if (own.used == used).all() else motion_from(cells, own.values, used)
    return motion if motion is not None and (motion.used == used).all() else None


def _axes(sections: Sequence[SectionCells], used: Bool) -> _Axes:
    """Return the principal axes of the effect of motions on the cells of sections."""
    normal, cells = np.zeros((int(used.sum()),) * 2), 0
    for one in sections:
        design = one.columns[:, used].astype(np.float64)
        normal, cells = normal + design.T @ design, cells + len(design)
    spread = np.sqrt(np.diag(normal) / cells)
    _, vectors = np.linalg.eigh(normal / cells / np.outer(spread, spread))
    return _Axes(used, vectors / spread[:, None])


def _chosen(cells: SectionCells, own: Motion, tied: Motion, broken: Motion | None, usual: float) -> Motion:
    """Choose a section's motion: its own, its neighbours', or a split between those before and behind it."""

    def excess(motion: Motion) -> float:
        return unexplained(cells, cells.difference - motion.removed) - usual

    if broken is not None and excess(broken) < (1.0 - MIN_EXPLAINED_SHARE) * excess(own):
        return broken
    return tied if excess(own) >= (1.0 - MIN_EXPLAINED_SHARE) * excess(tied) else own


def _with_changed(
    sections: Sequence[SectionCells], number: Int64, values: Float, variances: Float, axes: _Axes, changed: list[int]
) -> _Even:
    """Return smooth motions of the sections that kept their shape, extended by cells of the others that follow them."""
    values, variances = values.copy(), variances.copy()
    wander = _wander(number, values, variances)
    even = _even(number, values, variances, wander)
    for _ in range(_ROUNDS):
        for k in changed:
            own = motion_from(sections[k], axes.values(even.values[k]), axes.used)
            values[k], variances[k] = np.nan, np.nan
            if own is not None:
                # Cells that only a part of the section shares count less, the farther they are from the neighbours' motion.
                found, variance = axes.along(own)
                separation = (found - even.values[k]) ** 2 / (_BREAK_LEVEL**2 * (variance + even.variances[k]))
                values[k], variances[k] = found, variance * (1.0 + separation) ** 2
        before, even = even, _even(number, values, variances, wander, even.ties)
        if float(np.abs(even.values - before.values).max()) < _CONVERGED:
            break
    return even


def _broken(cells: SectionCells, values: Float, number: Int64, k: int, axes: _Axes) -> Motion | None:
    """Return the motion of a section where the scanner position changes: as before it up to a cut, as behind it after.

    The cut minimises the residuals of both; None without two unchanged sections on either side.
    """
    if not 2 <= k < len(number) - 2 or number[k + 2] - number[k - 2] != 4:
        return None
    starts = [axes.values(2.0 * values[k + near] - values[k + far]) for near, far in ((-1, -2), (1, 2))]
    used = axes.used
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
    for selected, part in ((first, one), (~first, other)):
        removed[selected], error[selected] = part.removed, part.removed_error
    larger = one if 2 * first.sum() > len(first) else other
    return Motion(larger.values, larger.covariance, removed, error, len(first))


def _wander(number: Int64, values: Float, variances: Float) -> Float:
    """Return the variance (m,) of the second differences of the motions between sections, without their own errors."""
    place = {int(n): k for k, n in enumerate(number)}
    found = np.full(values.shape[1], _MIN_SCATTER**2)
    for lag in _LAGS:
        triples = [(place[n - lag], k, place[n + lag]) for n, k in place.items() if n - lag in place and n + lag in place]
        if not triples:
            continue
        first, middle, last = np.array(triples).T
        bent = values[first] - 2.0 * values[middle] + values[last]
        shown = np.isfinite(bent[:, 0])
        if shown.sum() < MIN_SECTIONS // 2:
            continue
        noise = variances[first] + 4.0 * variances[middle] + variances[last]
        spread = (MAD_TO_SIGMA * np.median(np.abs(bent[shown]), axis=0)) ** 2 - np.median(noise[shown], axis=0)
        # With independent second differences, those over a lag grow in this way.
        found = np.maximum(found, spread / (lag * (2.0 * lag**2 + 1.0) / 3.0))
    return found


def _even(number: Int64, values: Float, variances: Float, wander: Float, ties: Float | None = None) -> _Even:
    """Return the most probable motions of all sections, with independent second differences, and their variances."""
    at = (number - number[0]).astype(np.int64)
    count = int(at[-1]) + 1
    shown = np.isfinite(values[:, 0])
    result = np.empty((2, *values.shape))
    found = np.empty((len(wander), count - 2)) if ties is None else ties
    for c, spread in enumerate(wander):
        weight, target = np.zeros(count), np.zeros(count)
        weight[at[shown]] = 1.0 / np.maximum(variances[shown, c], _MIN_SCATTER**2)
        target[at[shown]] = weight[at[shown]] * values[shown, c]
        if ties is None:
            found[c] = 1.0 / spread
        for _ in range(_ROUNDS if ties is None else 1):
            smooth = solveh_banded(_bands(weight, found[c]), target)
            if ties is None:
                found[c] = 1.0 / (spread * (1.0 + (np.diff(smooth, 2) / _BREAK_LEVEL) ** 2 / spread))
        result[0, :, c] = smooth[at]
        result[1, :, c] = np.diag(solveh_banded(_bands(weight, found[c]), np.eye(count)))[at]
    return _Even(result[0], result[1], found)


def _bands(weight: Float, rows: Float) -> Float:
    """Return the upper bands (3, n) of the normal matrix of data (n,) and second differences (n - 2,) with these weights."""
    count = len(weight)
    bands = np.zeros((3, count))
    bands[2] = weight + 1.0 / _MAX_VARIANCE
    for k, factor in enumerate((1.0, -2.0, 1.0)):
        bands[2, k : count - 2 + k] += rows * factor**2
    bands[1, 1 : count - 1] -= 2.0 * rows
    bands[1, 2:] -= 2.0 * rows
    bands[0, 2:] += rows
    return bands
