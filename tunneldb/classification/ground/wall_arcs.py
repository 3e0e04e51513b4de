"""Limits of the ground in the unrolled plane: the unrolled feet of the walls."""

from __future__ import annotations

import numpy as np

from tunneldb.arrays import Float, Intp
from tunneldb.classification.ground.model import COLUMN, Ground
from tunneldb.geometry.plan_line import PlanLine
from tunneldb.geometry.surface import Surface


def foot_arcs(ground: Ground | None, line: PlanLine, surface: Surface) -> Float:
    """Return the arcs of the ground's left and right limits, at each of its whole metres of chainage.

    The feet are lines in space. Both their coordinates change when unrolled, so that arcs are interpolated to whole metres.
    Where a wall is missing for a stretch, for example at a niche, it is interpolated from its neighbours; if it is missing
    everywhere, the ground ends where it was last seen.

    Returns
    -------
    (rows, 2) float array
        m; NaN without ground, or without surface.
    """
    if ground is None:
        return np.empty((0, 2))
    metres = ground.start + np.arange(len(ground.height), dtype=np.float64)
    arcs = np.full((len(metres), 2), np.nan)
    seen = np.isfinite(ground.height)
    there = seen.any(axis=1)
    if not there.any():
        return arcs
    last = np.column_stack([seen.argmax(axis=1), seen.shape[1] - 1 - seen[:, ::-1].argmax(axis=1)])
    for side in range(2):
        across = ground.foot[:, side]
        if not np.isfinite(across[there]).any():
            across = (ground.first + last[:, side]) * COLUMN
        rows = np.flatnonzero(there & np.isfinite(across))
        # the ground reaches to the foot or up to a cell less
        column = np.clip(np.rint(across[rows] / COLUMN).astype(np.intp) - ground.first, last[rows, 0], last[rows, 1])
        height = _nearest_height(ground.height[rows], column)
        unrolled = surface.unroll(np.column_stack([line.point(metres[rows], across[rows]), height]))
        known = np.isfinite(unrolled.arc)
        if known.any():
            order = np.argsort(unrolled.chainage[known])
            arcs[there, side] = np.interp(metres[there], unrolled.chainage[known][order], unrolled.arc[known][order])
    return arcs


def _nearest_height(height: Float, column: Intp) -> Float:
    """Return the height in each row at the column, or at the nearest one with a height."""
    away = np.abs(np.arange(height.shape[1])[None, :] - column[:, None]).astype(np.float64)
    away[np.isnan(height)] = np.inf
    return np.asarray(height[np.arange(len(height)), away.argmin(axis=1)])
