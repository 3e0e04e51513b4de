"""Regression of intensity on range and incidence, over cells whose own reflectance is unknown.

Views of one cell are compared with each other (fixed effects), cells with each other as far as their reflectance is alike
(random effects: Swamy and Arora, 1972). Outliers – leaks, joints, what hangs on the lining – lose their weight (Tukey's
biweight). The covariance is a sandwich, clustered by patches of the lining (Liang and Zeger, 1986), with what stretches
and strips of it have in common added as its own component of variance.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tunneldb.intensity.cells import SECTOR, Cells, Index
from tunneldb.intensity.oren_nayar import incidence_db
from tunneldb.intensity.spline import RangeSpline, one_maximum

Float = NDArray[np.float64]

ROUGHNESS = np.arange(0.0, 60.1, 2.5)
"""Roughnesses that are tried, degrees; the best is refined by a parabola."""

TUKEY = 4.685
"""Residuals of so many standard deviations have no weight: 95 % efficient on normal ones (Holland and Welsch, 1977)."""

ROUNDS = 8
"""Rounds of weighting."""

ALIKE = 2.0
"""Distance over which neighbouring strips along the tunnel are alike, m: soot and grime change over metres."""


@dataclass(frozen=True)
class Fit:
    """What was found.

    Attributes
    ----------
    coefficients : (p,) float array
        Of the range spline, dB.
    covariance : (p, p) float array
        Theirs, of which only what is left without a constant means anything.
    level : float
        Median of what is left of the cells, dB.
    roughness, roughness_sigma : float
        σ and its standard deviation, degrees.
    noise, lining : float
        Standard deviation of a view of ENOUGH points, and of cells, dB.
    weight : (n,) float array
        Weights of the views, 0 of outliers.
    """

    coefficients: Float
    covariance: Float
    level: float
    roughness: float
    roughness_sigma: float
    noise: float
    lining: float
    weight: Float


@dataclass(frozen=True)
class _Weights:
    """Weights of the regression.

    Attributes
    ----------
    view, cell : (n,), (count,) float arrays
        Of each view, in points, and robust ones of each cell.
    noise, lining : float
        Variance of a view of one point, and of cells, dB².
    design : float
        By how much less cells compared with each other say than if each stood for itself.
    """

    view: Float
    cell: Float
    noise: float
    lining: float
    design: float


def fit(cells: Cells, spline: RangeSpline) -> Fit:
    """Fit range spline and roughness.

    Parameters
    ----------
    cells : Cells
        Views of cells.
    spline : RangeSpline
        Functions of range.
    """
    problem = _Problem(cells, spline)
    weights = _Weights(cells.weight, np.ones(cells.count), 1.0, 1.0, 1.0)
    solution = problem.solve(weights)
    for k in range(ROUNDS):
        weights = problem.reweighted(solution, weights)
        if k >= ROUNDS // 2:
            weights = replace(weights, design=problem.design_effect(solution, weights))
        solution = problem.solve(weights)
    covariance, roughness_sigma = problem.covariance(solution, weights)
    left = problem.cell_means(problem.residuals(solution), weights.view)
    return Fit(
        solution.coefficients,
        covariance,
        float(np.median(left)),
        solution.roughness,
        roughness_sigma,
        float(np.sqrt(weights.noise / cells.weight.max())),
        float(np.sqrt(weights.lining)),
        weights.view * weights.cell[cells.cell],
    )


@dataclass(frozen=True)
class _Solution:
    """Coefficients (p,) at the best roughness, degrees, and at all (s, p) that are tried, with the loss (s,) of each."""

    coefficients: Float
    roughness: float
    tried: Float
    loss: Float


class _Problem:
    """Columns of the regression, in the order of cells: range functions, F₂ for each roughness, intensity."""

    def __init__(self, cells: Cells, spline: RangeSpline) -> None:
        self.cells = cells
        self.basis = spline(cells.range_m)
        self.bending = spline.bending()
        self.incidence = np.column_stack([incidence_db(cells.cosine, s) for s in ROUGHNESS])
        self.columns = np.column_stack([self.basis, self.incidence, cells.level])
        self.terms = len(spline)
        self.views = np.bincount(cells.cell, minlength=cells.count)

    def cell_means(self, values: Float, weight: Float) -> Float:
        """Weighted means (count, …) over the views of each cell of values (n, …)."""
        return _sums(self.cells.cell, values, weight, self.cells.count) / _per(
            np.maximum(_sums(self.cells.cell, np.ones(len(weight)), weight, self.cells.count), 1e-9), values
        )

    def _parts(self, weights: _Weights, columns: Float) -> tuple[Float, Float, Float, Float]:
        """Columns less their cell's mean, means, and the weights of both in the loss."""
        total = _sums(self.cells.cell, np.ones(len(weights.view)), weights.view, self.cells.count)
        means = self.cell_means(columns, weights.view)
        between = weights.cell / (weights.lining + weights.noise / np.maximum(total, 1e-9)) / weights.design
        between = np.where(total > 0, between, 0.0)
        return columns - means[self.cells.cell], means, weights.view / weights.noise, between

    def solve(self, weights: _Weights) -> _Solution:
        """Find the roughness and the coefficients of the least loss."""
        within, means, one, other = self._parts(weights, self.columns)
        products = within.T @ (within * one[:, None]) + means.T @ (means * other[:, None])
        p = self.terms
        matrix = products[:p, :p] + self.bending + 1e-9 * np.eye(p)
        losses, tried = [], []
        for k in range(len(ROUGHNESS)):
            mixed = np.zeros(len(products))
            mixed[-1], mixed[p + k] = 1.0, -1.0
            along = products @ mixed
            b = one_maximum(matrix, along[:p])
            tried.append(b)
            losses.append(float(mixed @ along - 2.0 * b @ along[:p] + b @ matrix @ b))
        roughness = _lowest(ROUGHNESS, np.array(losses))
        # Between two roughnesses coefficients are no straight line, so those at the best are solved for.
        level = self.cells.level - incidence_db(self.cells.cosine, roughness)
        rest = level - self.cell_means(level, weights.view)[self.cells.cell]
        right = within[:, :p].T @ (rest * one) + means[:, :p].T @ (self.cell_means(level, weights.view) * other)
        return _Solution(one_maximum(matrix, right), roughness, np.array(tried), np.array(losses))

    def residuals(self, solution: _Solution) -> Float:
        """Intensity less range and incidence, (n,), dB."""
        incidence = incidence_db(self.cells.cosine, solution.roughness)
        return np.asarray(self.cells.level - self.basis @ solution.coefficients - incidence)

    def reweighted(self, solution: _Solution, weights: _Weights) -> _Weights:
        """Robust weights and variances of what is left."""
        cells, residual = self.cells, self.residuals(solution)
        means = self.cell_means(residual, weights.view)
        several = self.views[cells.cell] > 1
        scaled = (residual - means[cells.cell]) * np.sqrt(cells.weight)
        # n views of a cell leave n - 1 differences.
        lost = self.views[cells.cell] / np.maximum(self.views[cells.cell] - 1, 1)
        away = means - np.median(means)
        among = _deviation(away)
        noise = _deviation(scaled[several] * np.sqrt(lost[several])) ** 2 if several.sum() >= 100 else among**2
        noise = max(noise, 1e-6)
        view = np.where(several, cells.weight * _tukey(scaled / np.sqrt(noise)), cells.weight)
        typical = noise * float(np.median(1.0 / np.bincount(cells.cell, cells.weight)))
        return _Weights(view, _tukey(away / max(among, 1e-3)), noise, max(among**2 - typical, 0.0), weights.design)

    def design_effect(self, solution: _Solution, weights: _Weights) -> float:
        """By how much the score of cells among each other varies more than if each stood for itself, on average."""
        plain = replace(weights, design=1.0)
        _, means, _, between = self._parts(plain, self.basis)
        means = means - between @ means / between.sum()
        information = means.T @ (means * between[:, None])
        left = self._left(solution, weights)
        own = _outer(_sums(self.cells.patch, means * left[:, None], between))
        spread = own + self._common(left, weights, means, between)
        return max(1.0, float(np.trace(np.linalg.pinv(information, rcond=1e-6) @ spread)) / (self.terms - 1))

    def covariance(self, solution: _Solution, weights: _Weights) -> tuple[Float, float]:
        """Covariance (p, p) of the coefficients, that of the roughness in it, and the roughness's deviation."""
        p = self.terms
        step = ROUGHNESS[1] - ROUGHNESS[0]
        sides = np.clip([solution.roughness - step, solution.roughness + step], ROUGHNESS[0], ROUGHNESS[-1])
        slope = incidence_db(self.cells.cosine, sides[1]) - incidence_db(self.cells.cosine, sides[0])
        columns = np.column_stack([self.basis, slope])
        within, means, one, between = self._parts(weights, columns)
        residual = self.residuals(solution)
        left = self._left(solution, weights)
        scores = _sums(
            self.cells.cell,
            within * (residual - self.cell_means(residual, weights.view)[self.cells.cell])[:, None],
            one,
            self.cells.count,
        )
        scores += means * (between * left)[:, None]
        patches = self.cells.patch.max() + 1
        spread = _outer(_sums(self.cells.patch, scores)) * patches / max(patches - p - 1, 1)
        spread += self._common(left, weights, means, between)
        information = within.T @ (within * one[:, None]) + means.T @ (means * between[:, None])
        information[:p, :p] += self.bending
        spread[:p, :p] += self.bending
        ridge = 1e-9 * np.eye(p)
        inverse = np.linalg.inv(information[:p, :p] + ridge)
        whole = np.linalg.pinv(information, rcond=1e-12, hermitian=True)
        excess = (whole @ spread @ whole)[p, p] / max(whole[p, p], 1e-300)
        chance = np.exp(-0.5 * (solution.loss - solution.loss.min()) / max(excess, 1.0))
        chance /= chance.sum()
        off = solution.tried - solution.coefficients
        covariance = inverse @ spread[:p, :p] @ inverse + off.T @ (off * chance[:, None])
        return covariance, float(np.sqrt(chance @ (ROUGHNESS - solution.roughness) ** 2))

    def _left(self, solution: _Solution, weights: _Weights) -> Float:
        """What is left of each cell, dB, less its mean; 0 of outliers."""
        means = self.cell_means(self.residuals(solution), weights.view)
        return np.asarray((means - np.average(means, weights=weights.cell)) * weights.cell)

    def _common(self, left: Float, weights: _Weights, means: Float, between: Float) -> Float:
        """Variance of the scores by what stretches, and strips along the tunnel, have in common."""
        cells, there = self.cells, weights.cell
        stretches = cells.stretch.max() + 1
        if cells.sector.min() < 0:
            stretch = _shared(left, there, cells.stretch, cells.patch)
            return stretch * _outer(_sums(cells.stretch, means, between))
        block = cells.sector * stretches + cells.stretch
        patch = _shared(left, there, cells.patch, np.arange(cells.count))
        stretch = _shared(left, there, cells.stretch, block)
        # Around the section reflectance may change as it does along the tunnel: where range and incidence are functions
        # of the place in the section, what is left doesn't show it.
        sector = max(_shared(left, there, cells.sector, block), patch - stretch, 0.0)
        by_sector = _sums(cells.sector, means, between)
        number = np.arange(len(by_sector))
        alike = np.exp(-np.abs(number[:, None] - number) * SECTOR / ALIKE)
        return stretch * _outer(_sums(cells.stretch, means, between)) + sector * (by_sector.T @ alike @ by_sector)


def _shared(left: Float, there: Float, cluster: Index, part: Index) -> float:
    """Covariance of cells that share a cluster, but no part of it, dB²; 0 where there are no such."""
    pairs = np.sum(_sums(cluster, there) ** 2) - np.sum(_sums(part, there) ** 2)
    products = np.sum(_sums(cluster, left) ** 2) - np.sum(_sums(part, left) ** 2)
    return max(float(products / pairs), 0.0) if pairs > 0 else 0.0


def _sums(number: Index, values: Float, weight: Float | None = None, count: int = 0) -> Float:
    """Sums (count, …) of values (n, …), times their weights (n,), of each number."""
    if values.ndim == 1:
        return np.asarray(np.bincount(number, values if weight is None else values * weight, minlength=count), np.float64)
    return np.column_stack([_sums(number, column, weight, count) for column in values.T])


def _per(values: Float, like: Float) -> Float:
    return values if like.ndim == 1 else values[:, None]


def _outer(rows: Float) -> Float:
    return np.asarray(rows.T @ rows)


def _deviation(values: Float) -> float:
    """Standard deviation by the median deviation from 0."""
    return 1.4826 * float(np.median(np.abs(values)))


def _tukey(scaled: Float) -> Float:
    return np.asarray(np.where(np.abs(scaled) < TUKEY, (1.0 - (scaled / TUKEY) ** 2) ** 2, 0.0))


def _lowest(at: Float, values: Float) -> float:
    """Where a parabola through the lowest value and its neighbours is lowest, within the given places."""
    k = int(np.clip(np.argmin(values), 1, len(at) - 2))
    before, middle, after = values[k - 1 : k + 2]
    bend = before - 2.0 * middle + after
    if bend <= 0:
        return float(at[np.argmin(values)])
    return float(np.clip(at[k] + 0.5 * (before - after) / bend * (at[1] - at[0]), at[0], at[-1]))
