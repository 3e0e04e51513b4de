"""The ground of a tunnel: heights on a grid along and across, and where the walls meet it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit, prange

from tunneldb.arrays import Bool, Float

COLUMN = 0.1
"""Distance of the columns, m; rows stand 1 m apart."""


@dataclass(frozen=True)
class Ground:
    """Heights of the ground; between rows and columns they are interpolated.

    Attributes
    ----------
    start : int
        Distance along the line of the first row, m; rows stand at whole metres.
    first : int
        The first column stands ``first * 0.1`` m to the right of the line.
    height : (rows, columns) float array
        Height of the ground, m; NaN where there is none.
    gamma : (rows,) float array
        Points up to this height above it are ground, m.
    foot : (rows, 2) float array
        Where the left and the right wall meet it, m to the right of the line; NaN where no wall was seen.
    lean : (rows, 2) float array
        How far the left and the right wall lean to the right for each metre up, just above the foot.
    """

    start: int
    first: int
    height: Float
    gamma: Float
    foot: Float
    lean: Float

    def height_at(self, along: Float, across: Float) -> Float:
        """Height of the ground at places (n,), m; NaN where there is none."""
        a, x = (np.ascontiguousarray(v, dtype=np.float64) for v in (along, across))
        out = np.empty(len(a))
        _heights(self.start, self.first, self.height, a, x, out)
        return out

    def is_ground(self, along: Float, across: Float, z: Float) -> Bool:
        """Tell which points (n,) are ground (Li et al. 2023, section 2.1, step 4).

        They lie up to γ above the ground's height and no more than γ below; beside a step (a kerb)
        the step's face belongs to it. In the corner before a wall a point belongs to that of both
        surfaces to which it is nearer; what lies beyond a wall by more than γ is no ground.

        Parameters
        ----------
        along, across, z : (n,) float arrays
            Distance along the line and to its right, and height, m.
        """
        a, x, h = (np.ascontiguousarray(v, dtype=np.float64) for v in (along, across, z))
        out = np.empty(len(a), np.bool_)
        _grounds(self.start, self.first, self.height, self.gamma, self.foot, self.lean, a, x, h, out)
        return out

    def rows(self, first: int, stop: int) -> Ground:
        """The rows at ``first`` m and beyond, before ``stop`` m."""
        low = min(max(first - self.start, 0), len(self.height))
        kept = slice(low, max(min(stop - self.start, len(self.height)), low))
        return Ground(
            self.start + low, self.first, self.height[kept], self.gamma[kept], self.foot[kept], self.lean[kept]
        )  # fmt: skip


@njit(cache=True, nogil=True, inline="always")
def _mix(one: float, two: float, share: float) -> float:
    """Between two numbers; one of them where the other is missing, unless it alone counts."""
    if np.isnan(one):
        return two if share > 0.0 else np.nan
    if np.isnan(two):
        return one if share < 1.0 else np.nan
    return (1.0 - share) * one + share * two


@njit(cache=True, nogil=True, inline="always")
def _place(start: int, first: int, height: Float, along: float, across: float) -> tuple[int, int, float, float]:
    """Row and column before a place (-1: outside) and the shares of the way to the next ones."""
    rows, columns = height.shape
    row, column = along - start, across / COLUMN - first
    if not (row >= 0.0 and row <= rows - 1 and column >= 0.0 and column <= columns - 1):
        return -1, -1, 0.0, 0.0
    i, j = min(int(row), max(rows - 2, 0)), min(int(column), max(columns - 2, 0))
    return i, j, row - i, column - j


@njit(cache=True, nogil=True, inline="always")
def _column(height: Float, i: int, j: int, g: float) -> float:
    """Height in a column between two rows."""
    return _mix(height[i, j], height[min(i + 1, height.shape[0] - 1), j], g)


@njit(cache=True, nogil=True, inline="always")
def _height(height: Float, i: int, j: int, g: float, f: float) -> float:
    return _mix(_column(height, i, j, g), _column(height, i, min(j + 1, height.shape[1] - 1), g), f)


@njit(cache=True, nogil=True, inline="always")
def _reach(height: Float, i: int, j: int, g: float, mean: float, gamma: float) -> tuple[float, float]:
    """Lowest and highest ground at a place: its own height, or from foot to top of a step beside it.

    The face of a kerb stands somewhere in the column that holds it, and so up to a column beyond the place's own.
    """
    low, high = mean, mean
    for k in range(max(j - 1, 0), min(j + 3, height.shape[1])):
        h = _column(height, i, k, g)
        if h < low - gamma:
            low = h
        if h > high + gamma:
            high = h
    return low, high


@njit(cache=True, nogil=True, parallel=True)
def _heights(start: int, first: int, height: Float, along: Float, across: Float, out: Float) -> None:  # pragma: no cover
    for n in prange(along.shape[0]):
        i, j, g, f = _place(start, first, height, along[n], across[n])
        out[n] = _height(height, i, j, g, f) if i >= 0 else np.nan


@njit(cache=True, nogil=True, parallel=True)
def _grounds(
    start: int, first: int, height: Float, gamma: Float, foot: Float, lean: Float,
    along: Float, across: Float, z: Float, out: Bool,
) -> None:  # pragma: no cover - compiled  # fmt: skip
    for n in prange(along.shape[0]):
        out[n] = False
        i, j, g, f = _place(start, first, height, along[n], across[n])
        if i < 0:
            continue
        mean = _height(height, i, j, g, f)
        if np.isnan(mean):
            continue
        after = min(i + 1, height.shape[0] - 1)
        most = _mix(gamma[i], gamma[after], g)
        low, high = _reach(height, i, j, g, mean, most)
        if not (z[n] <= high + most and z[n] >= low - most):
            continue
        up = z[n] - mean
        out[n] = True
        for side in range(2):
            at = _mix(foot[i, side], foot[after, side], g)
            if np.isnan(at):
                continue
            slant = _mix(lean[i, side], lean[after, side], g)
            inside = (across[n] - at - slant * up) / np.sqrt(1.0 + slant * slant)
            if side == 1:
                inside = -inside
            if inside < -most or abs(inside) < abs(up):
                out[n] = False
