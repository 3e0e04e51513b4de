"""Ground of a tunnel: heights on a grid along and across, and the feet of the walls."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Bool, Float
from tunneldb.compiled import inner, point_kernel
from tunneldb.threads import in_blocks

COLUMN = 0.1
"""Distance of the columns, m; rows are 1 m apart."""

_BLOCK = 1 << 16  # points


@dataclass(frozen=True)
class Ground:
    """Heights of the ground, interpolated between rows and columns.

    Attributes
    ----------
    start : int
        Distance along the line of the first row, m; rows are at whole metres.
    first : int
        The first column is ``first * 0.1`` m to the right of the line.
    height : (rows, columns) float array
        Height of the ground, m; NaN if there is none.
    gamma : (rows,) float array
        Points up to this height above it are ground, m.
    foot : (rows, 2) float array
        Places of the left and the right wall's foot, m to the right of the line; NaN if no wall was seen.
    lean : (rows, 2) float array
        Lean of the left and the right wall to the right per metre up, just above the foot.
    """

    start: int
    first: int
    height: Float
    gamma: Float
    foot: Float
    lean: Float

    def height_at(self, along: Float, across: Float) -> Float:
        """Return the height of the ground at places (n,), m; NaN if there is none."""
        return self._at(along, across, np.full(len(along), np.nan))[0]

    def is_ground(self, along: Float, across: Float, z: Float) -> Bool:
        """Return True for points (n,) on the ground (Li et al. 2023, section 2.1, step 4).

        They are up to γ above the ground's height and no more than γ below; beside a step (a kerb) the step's face is ground
        too. In the corner at a wall a point belongs to the nearer of both surfaces; points beyond a wall by more than γ are not
        ground.

        Parameters
        ----------
        along, across, z : (n,) float arrays
            Distance along the line and to its right, and height, m.
        """
        return self._at(along, across, z)[1]

    def _at(self, along: Float, across: Float, z: Float) -> tuple[Float, Bool]:
        """Return the height of the ground at points (n,), and True for ground points."""
        a, x, h = (np.ascontiguousarray(v, dtype=np.float64) for v in (along, across, z))
        grids = [np.ascontiguousarray(v) for v in (self.height, self.gamma, self.foot, self.lean)]
        height, ground = np.empty(len(a)), np.empty(len(a), np.bool_)

        def work(begin: int, end: int) -> None:
            block = slice(begin, end)
            _compare(self.start, self.first, *grids, a[block], x[block], h[block], height[block], ground[block])

        in_blocks(work, len(a), _BLOCK)
        return height, ground

    def rows(self, first: int, stop: int) -> Ground:
        """Return the rows at ``first`` m and beyond, before ``stop`` m."""
        low = min(max(first - self.start, 0), len(self.height))
        kept = slice(low, max(min(stop - self.start, len(self.height)), low))
        return Ground(
            self.start + low, self.first, self.height[kept], self.gamma[kept], self.foot[kept], self.lean[kept]
        )  # fmt: skip


@inner
def _mix(one: float, two: float, share: float) -> float:  # pragma: no cover - compiled
    """Interpolate between two numbers; use one of them if the other is missing and has not the full weight."""
    if np.isnan(one):
        return two if share > 0.0 else np.nan
    if np.isnan(two):
        return one if share < 1.0 else np.nan
    return (1.0 - share) * one + share * two


@point_kernel
def _compare(
    start: int, first: int, height: Float, gamma: Float, foot: Float, lean: Float,
    along: Float, across: Float, z: Float, out: Float, ground: Bool,
) -> None:  # pragma: no cover - compiled  # fmt: skip
    """Return the height of the ground at points (n,), NaN if there is none, and whether they are ground."""
    rows, columns = height.shape
    for n in range(along.shape[0]):
        out[n] = np.nan
        ground[n] = False
        row, column = along[n] - start, across[n] / COLUMN - first
        if not (row >= 0.0 and row <= rows - 1 and column >= 0.0 and column <= columns - 1):
            continue
        i, j = min(int(row), max(rows - 2, 0)), min(int(column), max(columns - 2, 0))
        after, right = min(i + 1, rows - 1), min(j + 1, columns - 1)
        g = row - i
        mean = _mix(_mix(height[i, j], height[after, j], g), _mix(height[i, right], height[after, right], g), column - j)
        out[n] = mean
        if np.isnan(mean) or np.isnan(z[n]):
            continue
        gate = _mix(gamma[i], gamma[after], g)
        # Its own height, or from foot to top of a step beside it: the face of a kerb is somewhere in its column, and so up to a
        # column beyond the place's own.
        low, high = mean, mean
        for k in range(max(j - 1, 0), min(j + 3, columns)):
            level = _mix(height[i, k], height[after, k], g)
            if level < low - gate:
                low = level
            if level > high + gate:
                high = level
        if not (z[n] <= high + gate and z[n] >= low - gate):
            continue
        up = z[n] - mean
        selected = True
        for side in range(2):
            at = _mix(foot[i, side], foot[after, side], g)
            if np.isnan(at):
                continue
            slant = _mix(lean[i, side], lean[after, side], g)
            inside = (across[n] - at - slant * up) / math.sqrt(1.0 + slant * slant)
            if side == 1:
                inside = -inside
            if inside < -gate or abs(inside) < abs(up):
                selected = False
        ground[n] = selected
