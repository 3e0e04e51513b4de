"""Steps of the lining: from ring to ring in cells of arc, and lips between the segments of a ring.

On either side of a joint a plane is fitted robustly to patches and extrapolated to the joint; the step is the difference.
Positions about the given axis along the wall's normal are compared, not offsets: the reference surface of the offsets changes
smoothly from section to section, and so hides a part of each step.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from tunneldb.arrays import Bool, Float
from tunneldb.measures.rings.compute.patches import Patches, inward_normals, row_medians
from tunneldb.robust import MAD_TO_SIGMA
from tunneldb.shape.tukey import CUT, rate, weights

MARGIN = 0.05
"""Distance from a joint within which patches are ignored: chamfer, sealing, mortar, m."""

REACH = 1.0
"""Length on either side for fitting planes, m, at most one ring."""

CELL_ROWS = 5
"""Rows of patches in a cell of arc."""

MIN_PATCH_SHARE = 0.6
"""Minimum seen share of a cell's patches on either side."""

MIN_SEEN_LENGTH = 0.25
"""Minimum seen length on either side, m: no plane is extrapolated from less."""

LIP_REACH = 0.5
"""Length along the arc on either side of a joint between segments for fitting lines, m."""

LIP_LEVEL = 6.0
"""Minimum ratio of a lip to its standard error: some hundred places are tested all around."""

_ROUNDS = 6
_MIN_SCALE = 1e-5  # m


@dataclass(frozen=True)
class Steps:
    """Steps at a joint around the tunnel.

    Attributes
    ----------
    arc : (k,) float array
        Middles of the cells, m.
    Inward step of the lining behind the joint relative to that before it, and its standard error, m; NaN if not determined.
        Inward step of the lining behind the joint relative to that before it, and its standard error, m; NaN if not determined.
    """

    arc: Float
    step: Float
    se: Float

    @property
    def greatest(self) -> tuple[float, float, float] | None:
        """Return the greatest step, its standard error and arc, m, without the least accurate ones; None if none is left."""
        determined = np.isfinite(self.step)
        if not determined.any():
            return None
        good = determined & (self.se <= 2.0 * np.median(self.se[determined]))
        k = int(np.argmax(np.where(good, np.abs(self.step), -1.0)))
        return float(self.step[k]), float(self.se[k]), float(self.arc[k])


@dataclass(frozen=True)
class Lip:
    """Step between two segments of a ring, m; positive where the clockwise one is further inside."""

    size: float
    se: float
    arc: float


def joint_steps(patches: Patches, joint: float, before: float, behind: float) -> Steps:
    """Measure the steps at a joint.

    Parameters
    ----------
    patches : Patches
        Patches of both rings.
    joint : float
        Chainage, m.
    before, behind : float
        Lengths of the rings before and behind it, m.
    """
    sides = (
        patches.between(joint - min(REACH, before - MARGIN), joint - MARGIN),
        patches.between(joint + MARGIN, joint + min(REACH, behind - MARGIN)),
    )
    count = len(patches.arc) // CELL_ROWS
    arc = patches.arc[: count * CELL_ROWS].reshape(count, CELL_ROWS).mean(axis=1)
    both = patches.between(joint - REACH, joint + REACH)
    normals = inward_normals(row_medians(both)) if len(both.chainage) else np.full((len(patches.arc), 2), np.nan)
    level, variance = np.empty((2, count)), np.empty((2, count))
    for k, side in enumerate(sides):
        level[k], variance[k] = _drawn_on(side, joint, normals, count)
    return Steps(arc, level[1] - level[0], np.sqrt(variance.sum(axis=0)))


def _drawn_on(side: Patches, joint: float, normals: Float, count: int) -> tuple[Float, Float]:
    """Return the level at the joint of each cell of one side, inwards, and its variance, both (count,)."""
    none = np.full(count, np.nan)
    columns = len(side.chainage)
    if columns < 3 or side.chainage[-1] - side.chainage[0] < MIN_SEEN_LENGTH:
        return none, none
    inward = side.right * normals[:, 0] + side.up * normals[:, 1]
    cells = inward[:, : count * CELL_ROWS].reshape(columns, count, CELL_ROWS).transpose(1, 0, 2).reshape(count, -1)
    along = np.repeat(side.chainage - joint, CELL_ROWS)
    across = np.tile(np.arange(CELL_ROWS) - (CELL_ROWS - 1) / 2.0, columns)
    design = np.column_stack([np.ones(len(along)), along, across])
    seen = np.isfinite(cells)
    far = np.where(seen, along, np.nan)
    with np.errstate(invalid="ignore"):
        long = np.fmax.reduce(far, axis=1) - np.fmin.reduce(far, axis=1) >= MIN_SEEN_LENGTH
    enough = (seen.mean(axis=1) >= MIN_PATCH_SHARE) & long
    rows = np.fmin.reduce(np.where(seen, across, np.nan), axis=1) < np.fmax.reduce(np.where(seen, across, np.nan), axis=1)
    indices = np.flatnonzero(enough & rows)
    level, variance = none.copy(), none.copy()
    if len(indices):
        level[indices], variance[indices] = _planes(cells[indices], seen[indices], design)
    return level, variance


def _planes(values: Float, seen: Bool, design: Float) -> tuple[Float, Float]:
    """Fit robust planes to values (k, n), and return their constants and variances, (k,) each."""
    filled = np.where(seen, values, 0.0)
    base = np.nanmedian(values, axis=1)[:, None]
    filled = np.where(seen, filled - base, 0.0)
    weight = seen.astype(np.float64)
    outer = np.einsum("ni,nj->nij", design, design).reshape(len(design), -1)
    for _ in range(_ROUNDS):
        inner = (weight @ outer).reshape(-1, 3, 3)
        solved = np.linalg.solve(inner + 1e-12 * np.eye(3), ((weight * filled) @ design)[:, :, None])[:, :, 0]
        off = filled - solved @ design.T
        spread = np.nanmedian(np.where(seen, np.abs(off), np.nan), axis=1)
        scale = np.maximum(MAD_TO_SIGMA * spread, _MIN_SCALE)[:, None]
        weight = np.where(seen, weights(off / (CUT * scale)), 0.0)
    # Variance of robust estimates (Huber, 1981, section 7.6): influence of each residual, and its derivative.
    used = seen & (weight > 0.0)
    influence = np.where(used, weight * off, 0.0)
    sigma2 = (influence**2).sum(axis=1) / np.maximum(used.sum(axis=1) - 3.0, 1.0)
    slope = np.where(seen, rate(off / (CUT * scale)), 0.0)
    inverse = np.linalg.pinv((slope @ outer).reshape(-1, 3, 3))
    inner = (used.astype(np.float64) @ outer).reshape(-1, 3, 3)
    return solved[:, 0] + base[:, 0], (inverse @ inner @ inverse)[:, 0, 0] * sigma2


def greatest_lip(places: Float, arc: Float) -> Lip | None:
    """Return the greatest lip of a ring; None if none exceeds the scatter of the lining's rows.

    Parameters
    ----------
    places : (r, 2) float array
        Place of each row of arc, from `row_medians`, with or without the ring's shape removed, m.
    arc : (r,) float array
        Arc of the rows, m.

    Notes
    -----
    At each row a line with the wall's bend is fitted to the rows on either side, without the row itself, which may contain the
    joint. The greatest difference is a lip if it is `LIP_LEVEL` times its standard error.
    """
    side = float(np.median(np.diff(arc))) if len(arc) > 1 else 1.0
    reach = round(LIP_REACH / side)
    if len(arc) < 2 * reach + 1 or reach < 3:
        return None
    windows = sliding_window_view(places, 2 * reach + 1, axis=0)  # (n, 2, w)
    whole = np.isfinite(windows[:, 0]).all(axis=1)
    if not whole.any():
        return None
    windows = windows[whole]
    middle = arc[reach:-reach][whole]
    chord = windows[:, :, -1] - windows[:, :, 0]
    normal = np.stack([chord[:, 1], -chord[:, 0]], axis=1) / np.linalg.norm(chord, axis=1)[:, None]
    height = np.einsum("nkw,nk->nw", windows, normal)
    at = np.delete(np.arange(-reach, reach + 1) / reach, reach)
    behind = (at > 0.0).astype(np.float64)
    # The bend is the same across the joint; the tilt may change there, because segments can hinge.
    design = np.column_stack([np.ones(len(at)), behind, at, at * behind, at**2])
    inverse = np.linalg.pinv(design)
    values = np.delete(height, reach, axis=1)
    solved = values @ inverse.T
    off = values - solved @ design.T
    own = np.sqrt((off**2).sum(axis=1) / (len(at) - design.shape[1]))
    scale = np.maximum(own, np.median(own))
    se = scale * float(np.linalg.norm(inverse[1]))
    determined = np.where(np.abs(solved[:, 1]) >= LIP_LEVEL * np.maximum(se, 1e-9), np.abs(solved[:, 1]) / se, 0.0)
    peak = determined.copy()
    for shift in range(1, reach + 1):
        peak[shift:] = np.where(determined[shift:] < determined[:-shift], 0.0, peak[shift:])
        peak[:-shift] = np.where(determined[:-shift] < determined[shift:], 0.0, peak[:-shift])
    if not peak.any():
        return None
    k = int(np.argmax(np.where(peak > 0.0, np.abs(solved[:, 1]), -1.0)))
    return Lip(float(solved[k, 1]), float(se[k]), float(middle[k]))
