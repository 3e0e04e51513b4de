"""Probability that a leak is found, by its area and darkening and by the conditions at its place.

A logistic regression on the trials of a kilometre (Cox, 1958), with a normal prior by which few trials do not lead to extreme
slopes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.anomalies.detectability.conditions import NAMES
from tunneldb.anomalies.detectability.trials import Trials
from tunneldb.arrays import Bool, Float

PRIOR = 2.0
"""Standard deviation of the slopes before any trial, for standardised variables."""

SIGNS = np.array([1.0, 1.0, -1.0, 1.0, -1.0])
"""Signs that the slopes can have: larger or darker leaks, and leaks in less noise, with more points, in less clutter are not
found less often."""

_GOOD = SIGNS[2:]

MAX_STEPS = 50
"""Maximum number of Newton steps."""

TOLERANCE = 1e-8
"""Change of the coefficients at which they are final."""


@dataclass(frozen=True)
class Chance:
    """Model of the probability that a leak is found.

    Attributes
    ----------
    centre, scale : (2 + len(NAMES),) float arrays
        Means and standard deviations of the variables.
    coefficients : (3 + len(NAMES),) float array
        Constant, and slopes of the standardised variables.
    best, worst : (len(NAMES),) float arrays
        Conditions of the trials that are best and worst for detection.
    """

    centre: Float
    scale: Float
    coefficients: Float
    best: Float
    worst: Float

    @classmethod
    def fit(cls, trials: Trials) -> Chance:
        """Fit the model to trials (n ≥ 1); a slope against SIGNS is set to 0."""
        raw = _variables(trials.area, trials.drop, trials.conditions)
        best = (_GOOD * trials.conditions).max(axis=0) * _GOOD
        worst = (_GOOD * trials.conditions).min(axis=0) * _GOOD
        centre, scale = raw.mean(axis=0), np.maximum(raw.std(axis=0), 1e-6)
        x = np.column_stack([np.ones(len(raw)), (raw - centre) / scale])
        used = np.ones(x.shape[1], np.bool_)
        while True:
            coefficients = np.zeros(x.shape[1])
            coefficients[used] = _newton(x[:, used], trials.found.astype(np.float64))
            wrong = np.flatnonzero(SIGNS * coefficients[1:] < 0.0) + 1
            if not len(wrong):
                return cls(centre, scale, coefficients, best, worst)
            used[wrong] = False

    def probability(self, area: Float, drop: Float, conditions: Float) -> Float:
        """Return the probability that leaks are found; conditions better than in all trials count as the best of these.

        Parameters
        ----------
        area, drop : (n,) float arrays
            Area, m², and mean darkening, dB.
        conditions : (n, len(NAMES)) float array
        """
        limited = _GOOD * np.minimum(_GOOD * conditions, _GOOD * self.best)
        x = (_variables(area, drop, limited) - self.centre) / self.scale
        return _logistic(self.coefficients[0] + x @ self.coefficients[1:])

    def covers(self, conditions: Float) -> Bool:
        """Return True for conditions (n, len(NAMES)) that are not worse than in all trials."""
        covered: Bool = np.all(_GOOD * conditions >= _GOOD * self.worst, axis=1)
        return covered


def _variables(area: Float, drop: Float, conditions: Float) -> Float:
    assert conditions.shape[1] == len(NAMES)
    return np.column_stack([np.log(area), np.log(drop), conditions])


def _newton(x: Float, found: Float) -> Float:
    """Return the most probable coefficients."""
    penalty = np.full(x.shape[1], 1.0 / PRIOR**2)
    penalty[0] = 1e-3  # the constant is free
    w = np.zeros(x.shape[1])
    for _ in range(MAX_STEPS):
        p = _logistic(x @ w)
        hessian = (x * (p * (1.0 - p))[:, None]).T @ x + np.diag(penalty)
        step = np.linalg.solve(hessian, x.T @ (found - p) - penalty * w)
        w += np.clip(step, -2.0, 2.0)
        if np.abs(step).max() < TOLERANCE:
            break
    return w


def _logistic(value: Float) -> Float:
    result: Float = 1.0 / (1.0 + np.exp(-np.clip(value, -40.0, 40.0)))
    return result
