"""Intensity over range as a spline with one maximum."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline
from scipy.optimize import nnls

from tunneldb.arrays import Float

STEP = np.log(1.35)
"""Distance of knots over ln R: a scanner's intensity (Xu et al., 2018, Fig. 3) bends over a factor of 5."""

BEND_SIGMA = 1.0
"""Prior standard deviation of the second differences of coefficients, dB. The radar equation has none; the curve of Xu et al.
(2018), Fig. 3, has 0.7 dB."""

_DEGREE = 3


@dataclass(frozen=True)
class RangeSpline:
    """Cubic B-splines over ln R, linear beyond their ends.

    Attributes
    ----------
    knots : (m,) float array
        Over ln R (R in m); the end knots are fourfold.
    """

    knots: Float

    @classmethod
    def over(cls, nearest: float, farthest: float) -> RangeSpline:
        """Place the knots between two ranges, m."""
        low, high = np.log(nearest), np.log(farthest)
        inner = np.linspace(low, high, max(1, int(np.ceil((high - low) / STEP))) + 1)
        return cls(np.concatenate([np.full(_DEGREE, low), inner, np.full(_DEGREE, high)]))

    def __len__(self) -> int:
        """Return the number of coefficients."""
        return len(self.knots) - _DEGREE - 1

    def __call__(self, range_m: Float) -> Float:
        """Return the basis functions, (n, len), at ranges (n,), m; the sum of each row is 1."""
        x = np.log(range_m)
        inside = np.clip(x, self.knots[0], self.knots[-1])
        values = BSpline.design_matrix(inside, self.knots, _DEGREE).toarray()
        ends = np.array([self.knots[0], self.knots[-1]])
        slopes = BSpline(self.knots, np.eye(len(self)), _DEGREE).derivative()(ends)
        values += np.minimum(x - ends[0], 0.0)[:, None] * slopes[0] + np.maximum(x - ends[1], 0.0)[:, None] * slopes[1]
        return np.asarray(values)

    def bending(self) -> Float:
        """Return the prior information (len, len) that coefficients are on a line over ln R, with a deviation of BEND_SIGMA."""
        # Abscissae (Greville) for which coefficients of a straight line are linear; closer at the ends than inside.
        at = np.array([self.knots[i + 1 : i + 1 + _DEGREE].mean() for i in range(len(self))])
        slope = np.diff(np.eye(len(self)), axis=0) / np.diff(at)[:, None]
        second = np.diff(slope, axis=0) * np.diff(at)[0:-1, None]
        return np.asarray(second.T @ second / BEND_SIGMA**2)


def one_maximum(matrix: Float, right: Float) -> Float:
    """Return the coefficients of least loss that rise to one maximum and then fall; so does the spline.

    Parameters
    ----------
    matrix, right : (p, p) and (p,) float arrays
        Matrix and vector of the loss ½ bᵀ·matrix·b − right·b.
    """
    free: Float = np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)
    if _has_one_maximum(free):
        return free
    root = np.linalg.cholesky(matrix)
    target = np.linalg.solve(root, right)
    best, least = free, np.inf
    count = len(free)
    for top in range(count):
        # Columns: the level, up and down; then the steps, each of which lowers all beyond it.
        steps = [-(np.arange(count) <= i).astype(float) for i in range(top)]
        steps += [-(np.arange(count) > i).astype(float) for i in range(top, count - 1)]
        basis = np.column_stack([np.ones(count), -np.ones(count), *steps])
        amounts, rest = nnls(root.T @ basis, target)
        if rest < least:
            best, least = basis @ amounts, rest
    return np.asarray(best)


def _has_one_maximum(values: Float) -> bool:
    top = int(np.argmax(values))
    steps = np.diff(values)
    return bool(np.all(steps[:top] >= 0) and np.all(steps[top:] <= 0))
