"""Regression of intensity on range and incidence, over cells whose own reflectance is unknown.

Views of one cell are compared with each other (fixed effects), and so are the cells of one strip along the tunnel within a
stretch, as far as their reflectance is alike (fixed effects of strips, random ones of cells: Swamy and Arora, 1972). Cells
beside each other around the section are never compared: there soot and grime vary with range and incidence. Outliers – leaks,
joints, fixtures – lose their weight (Tukey's biweight). The covariance is a sandwich (Liang and Zeger, 1986): views are
clustered by rings of the lining; for cells it uses the covariance of what the whole section has in common at some distance
along the tunnel, such as rings and blocks, and that of neighbours.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from tunneldb.arrays import Float, Int64
from tunneldb.radiometry.cells import CELL, ROUGHNESS, STRETCH, Cells
from tunneldb.radiometry.range_spline import RangeSpline, one_maximum
from tunneldb.robust import MAD_TO_SIGMA

TUKEY = 4.685
"""Standard deviations from which residuals have no weight: 95 % efficient on normal ones (Holland and Welsch, 1977)."""

ROUNDS = 8
"""Number of reweighting rounds."""

NEIGHBOUR_DISTANCE = 6.0
"""Distance beyond which cells are not treated as neighbours, m."""

MAX_LAG = 2.0 * STRETCH
"""Maximum distance along the tunnel of what the whole section has in common, m: as long as blocks of in-situ lining."""


NO_INFLUENCE = 1e6
"""Design effect of a comparison that must have no influence."""


@dataclass(frozen=True)
class Fit:
    """Result of the regression.

    Attributes
    ----------
    coefficients : (p,) float array
        Coefficients of the range spline, dB.
    covariance : (p, p) float array
        Their covariance, which has a meaning only without a constant.
    level : float
        Median residual of the cells, dB.
    roughness, roughness_sigma : float
        σ and its standard deviation, degrees.
    noise, lining : float
        Standard deviation of a view with ENOUGH points, and of cells, dB.
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
        Weight of each view, in points, and robust weight of each cell.
    noise, lining : float
        Variance of a view with one point, and of cells, dB².
    design : float
        Factor by which comparisons between cells are less informative than if cells were independent.
    """

    view: Float
    cell: Float
    noise: float
    lining: float
    design: float


def fit(cells: Cells, spline: RangeSpline, *, among: bool) -> Fit:
    """Fit range spline and roughness.

    Parameters
    ----------
    cells : Cells
        Views of cells.
    spline : RangeSpline
        Functions of range.
    among : bool
        True to compare also cells with each other, not only the views of each.
    """
    problem = _Problem(cells, spline)
    weights = _Weights(cells.weight, np.ones(cells.count), 1.0, 1.0, 1.0 if among else NO_INFLUENCE)
    solution = problem.solve(weights)
    for k in range(ROUNDS):
        weights = problem.reweighted(solution, weights)
        if among and k >= ROUNDS // 2:
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
    """Coefficients (p,) at the best roughness, degrees, and at all tested ones (s, p), with the loss (s,) of each."""

    coefficients: Float
    roughness: float
    tried: Float
    loss: Float


class _Problem:
    """Columns of the regression, in the order of cells: range functions, F₂ for each roughness, intensity."""

    def __init__(self, cells: Cells, spline: RangeSpline) -> None:
        self.cells = cells
        self.basis = cells.basis
        self.bending = spline.bending()
        self.columns = np.column_stack([cells.basis, cells.incidence, cells.level])
        self.terms = len(spline)
        self.unrolled = bool(cells.column.min() >= 0)
        self.views = np.bincount(cells.cell, minlength=cells.count)

    def cell_means(self, values: Float, weight: Float) -> Float:
        """Return weighted means (count, …) over the views of each cell of values (n, …)."""
        return _sums(self.cells.cell, values, weight, self.cells.count) / _per(
            np.maximum(_sums(self.cells.cell, np.ones(len(weight)), weight, self.cells.count), 1e-9), values
        )

    def _parts(self, weights: _Weights, columns: Float) -> tuple[Float, Float, Float, Float]:
        """Return columns minus their cell's mean, means, and the weights of both in the loss."""
        total = _sums(self.cells.cell, np.ones(len(weights.view)), weights.view, self.cells.count)
        means = self.cell_means(columns, weights.view)
        between = weights.cell / (weights.lining + weights.noise / np.maximum(total, 1e-9)) / weights.design
        between = np.where(total > 0, between, 0.0)
        side_offset = self.cell_means(self.cells.side_offset, weights.view)
        return (
            columns - means[self.cells.cell],
            _within(self.cells.alike, means, side_offset, between),
            weights.view / weights.noise,
            between,
        )

    def solve(self, weights: _Weights) -> _Solution:
        """Find the roughness and the coefficients of the least loss."""
        within, means, one, other = self._parts(weights, self.columns)
        products = within.T @ (within * one[:, None]) + means.T @ (means * other[:, None])
        p = self.terms
        matrix = products[:p, :p] + self.bending + self._tie(products[:p, :p])
        losses, tried = [], []
        for k in range(len(ROUGHNESS)):
            mixed = np.zeros(len(products))
            mixed[-1], mixed[p + k] = 1.0, -1.0
            along = products @ mixed
            b = one_maximum(matrix, along[:p])
            tried.append(b)
            losses.append(float(mixed @ along - 2.0 * b @ along[:p] + b @ matrix @ b))
        roughness = _lowest(ROUGHNESS, np.array(losses))
        # Between two roughnesses coefficients are not linear, so those at the best are solved for.
        level = (self.cells.level - self.cells.incidence_at(roughness))[:, None]
        rest, among, _, _ = self._parts(weights, level)
        right = within[:, :p].T @ (rest[:, 0] * one) + means[:, :p].T @ (among[:, 0] * other)
        return _Solution(one_maximum(matrix, right), roughness, np.array(tried), np.array(losses))

    def _tie(self, products: Float) -> Float:
        """Return the information that keeps the curve's constant, which is not determined, near 0."""
        return 1e-7 * float(np.trace(products)) * np.full(products.shape, 1.0 / self.terms)

    def residuals(self, solution: _Solution) -> Float:
        """Return intensity minus range and incidence effects, (n,), dB."""
        incidence = self.cells.incidence_at(solution.roughness)
        return np.asarray(self.cells.level - self.basis @ solution.coefficients - incidence)

    def reweighted(self, solution: _Solution, weights: _Weights) -> _Weights:
        """Return robust weights and variances of the residuals."""
        cells, residual = self.cells, self.residuals(solution)
        means = self.cell_means(residual, weights.view)
        several = self.views[cells.cell] > 1
        scaled = (residual - means[cells.cell]) * np.sqrt(cells.weight)
        # n views of a cell leave n - 1 differences.
        lost = self.views[cells.cell] / np.maximum(self.views[cells.cell] - 1, 1)
        away = means - _medians(self.cells.alike, means)
        among = _deviation(away)
        noise = _deviation(scaled[several] * np.sqrt(lost[several])) ** 2 if several.sum() >= 100 else among**2
        noise = max(noise, 1e-6)
        view = np.where(several, cells.weight * _tukey(scaled / np.sqrt(noise)), cells.weight)
        typical = noise * float(np.median(1.0 / np.bincount(cells.cell, cells.weight)))
        return _Weights(view, _tukey(away / max(among, 1e-3)), noise, max(among**2 - typical, 0.0), weights.design)

    def design_effect(self, solution: _Solution, weights: _Weights) -> float:
        """Return the mean ratio of the variance of cells' scores to that of independent cells."""
        _, means, _, between = self._parts(replace(weights, design=1.0), self.basis)
        information = means.T @ (means * between[:, None])
        spread = self._spread(self._left(solution, weights), weights, means, between)
        return max(1.0, float(np.trace(np.linalg.pinv(information, rcond=1e-6) @ spread)) / (self.terms - 1))

    def covariance(self, solution: _Solution, weights: _Weights) -> tuple[Float, float]:
        """Return the covariance (p, p) of the coefficients, the roughness's part of it, and the roughness's deviation."""
        p = self.terms
        step = ROUGHNESS[1] - ROUGHNESS[0]
        sides = np.clip([solution.roughness - step, solution.roughness + step], ROUGHNESS[0], ROUGHNESS[-1])
        slope = self.cells.incidence_at(sides[1]) - self.cells.incidence_at(sides[0])
        columns = np.column_stack([self.basis, slope])
        within, means, one, between = self._parts(weights, columns)
        residual = self.residuals(solution)
        scores = _sums(
            self.cells.cell,
            within * (residual - self.cell_means(residual, weights.view)[self.cells.cell])[:, None],
            one,
            self.cells.count,
        )
        # Joints run around the section, and a scan's rows of points cross them similarly all around.
        clusters = int(self.cells.ring.max()) + 1
        spread = _outer(_sums(self.cells.ring, scores)) * clusters / max(clusters - p - 1, 1)
        spread += self._spread(self._left(solution, weights), weights, means, between)
        information = within.T @ (within * one[:, None]) + means.T @ (means * between[:, None])
        information[:p, :p] += self.bending
        spread[:p, :p] += self.bending
        inverse = np.linalg.inv(information[:p, :p] + self._tie(information[:p, :p]))
        whole = np.linalg.pinv(information, rcond=1e-12, hermitian=True)
        excess = (whole @ spread @ whole)[p, p] / max(whole[p, p], 1e-300)
        # Loss and coefficients between tested roughnesses: the result may be finer than their steps.
        fine = np.linspace(ROUGHNESS[0], ROUGHNESS[-1], 50 * (len(ROUGHNESS) - 1) + 1)
        loss = CubicSpline(ROUGHNESS, solution.loss)(fine)
        chance = np.exp(-0.5 * (loss - loss.min()) / max(excess, 1.0))
        chance /= chance.sum()
        off = CubicSpline(ROUGHNESS, solution.tried)(fine) - solution.coefficients
        covariance = inverse @ spread[:p, :p] @ inverse + off.T @ (off * chance[:, None])
        return covariance, float(np.sqrt(chance @ (fine - solution.roughness) ** 2))

    def _left(self, solution: _Solution, weights: _Weights) -> Float:
        """Return the residual of each cell within its strip, dB; 0 for outliers.

        It is the difference from the whole strip, not from its stretch: few cells minus their mean would seem more similar than
        they are. Scores contain only differences within stretches, so the rest cancels.
        """
        means = self.cell_means(self.residuals(solution), weights.view)
        strip = self.cells.column if self.unrolled else self.cells.stretch
        middles = _sums(strip, means, weights.cell) / np.maximum(_sums(strip, weights.cell), 1e-9)
        return np.asarray((means - middles[strip]) * weights.cell)

    def _spread(self, left: Float, weights: _Weights, means: Float, between: Float) -> Float:
        """Return the variance of the scores (Conley, 1999): common effects of the section, and neighbouring cells."""
        from scipy import signal  # its import takes as long as a third of all others, and few need it

        cells = self.cells
        scores = means * between[:, None]
        if not self.unrolled:
            return _outer(_sums(cells.stretch, scores * left[:, None]))
        shape = int(cells.row.max()) + 1, int(cells.column.max()) + 1

        def plane(values: Float) -> Float:
            out = np.zeros(shape)
            out[cells.row, cells.column] = values
            return out

        fields = np.array([plane(column) for column in scores.T])
        ring, near = _covariances(plane(left), plane(weights.cell))
        along = np.array([signal.fftconvolve(one, ring, mode="full") for one in fields.sum(axis=2)])
        spread = along[:, len(ring) // 2 :][:, : shape[0]] @ fields.sum(axis=2).T
        spread_out = [signal.oaconvolve(one, near, mode="same") for one in fields]
        spread += np.array([[np.sum(one * other) for other in spread_out] for one in fields])
        return _positive(spread)


def _within(number: Int64, values: Float, side_offset: Float, weight: Float) -> Float:
    """Return values (n, m) minus a constant and a slope over ``side_offset`` (n,) of those with the same number.

    So a reflectance that depends on the place in the section, constant along a strip, leaves no residual, even where the points
    of a strip are unevenly placed in its cells.
    """
    total = np.maximum(_sums(number, weight), 1e-12)

    def centred(of: Float) -> Float:
        return np.asarray(of - (_sums(number, of, weight) / _per(total, of))[number])

    values, side_offset = centred(values), centred(side_offset)
    slope = (
        _sums(number, values * side_offset[:, None], weight) / np.maximum(_sums(number, side_offset**2, weight), 1e-12)[:, None]
    )
    return np.asarray(values - slope[number] * side_offset[:, None])


def _positive(matrix: Float) -> Float:
    """Return the nearest covariance: symmetric, without negative variance."""
    values, vectors = np.linalg.eigh(0.5 * (matrix + matrix.T))
    return np.asarray(vectors * np.maximum(values, 0.0) @ vectors.T)


def _covariances(left: Float, there: Float) -> tuple[Float, Float]:
    """Return the covariance, dB², of cells of a plane: by distance along the tunnel, and in addition between neighbours.

    Parameters
    ----------
    left, there : (rows, columns) float arrays
        Residuals times the weights, and the weights; 0 without a cell.

    Returns
    -------
    along : (2m + 1,) float array
        For cells more than NEIGHBOUR_DISTANCE apart around the section, for each shift of up to m = MAX_LAG / CELL rows.
        Relative to the farthest: anything else changes too slowly to matter within a stretch.
    near : (2k + 1, 2k + 1) float array
        Additional covariance of neighbours, by their distance, up to k = NEIGHBOUR_DISTANCE / CELL and only where it is
        positive.
    """
    from scipy import signal

    k, m = int(NEIGHBOUR_DISTANCE / CELL), int(MAX_LAG / CELL)

    def shifted(values: Float) -> Float:
        padded = np.pad(values, ((m, m), (k, k)))
        whole = signal.oaconvolve(padded, padded[::-1, ::-1], mode="full")
        row, column = padded.shape[0] - 1, padded.shape[1] - 1
        return np.asarray(whole[row - m : row + m + 1, column - k : column + k + 1])

    def rows(values: Float) -> Float:
        series = np.pad(values.sum(axis=1), m)
        return np.asarray(np.correlate(series, series, mode="full")[len(series) - 1 - m : len(series) + m])

    products, pairs = shifted(left), shifted(there)
    others = np.maximum(rows(there) - pairs.sum(axis=1), 0.0)
    along = np.where(others > 0.5, (rows(left) - products.sum(axis=1)) / np.maximum(others, 0.5), 0.0)
    # Many lags share noise: the common part must not grow with distance.
    half = np.minimum.accumulate(along[m:])
    half = np.maximum(half - half[-1], 0.0)
    along = np.concatenate([half[:0:-1], half])
    shift = np.arange(-k, k + 1)
    distance = np.rint(np.hypot(shift[:, None], shift)).astype(np.int64)
    rest = (products - pairs * along[:, None])[m - k : m + k + 1]
    of = np.bincount(distance.ravel(), rest.ravel()) / np.maximum(
        np.bincount(distance.ravel(), pairs[m - k : m + k + 1].ravel()), 1e-9
    )
    end = np.flatnonzero(of[: k + 1] <= 0.0)
    of[end[0] if len(end) else k + 1 :] = 0.0
    return along, np.asarray(of[distance])


def _sums(number: Int64, values: Float, weight: Float | None = None, count: int = 0) -> Float:
    """Sum values (n, …), times their weights (n,), by number: (count, …)."""
    if values.ndim == 1:
        return np.asarray(np.bincount(number, values if weight is None else values * weight, minlength=count), np.float64)
    return np.column_stack([_sums(number, column, weight, count) for column in values.T])


def _per(values: Float, like: Float) -> Float:
    return values if like.ndim == 1 else values[:, None]


def _medians(number: Int64, values: Float) -> Float:
    """Return the median (n,) of all values with the same number."""
    order = np.argsort(number, kind="stable")
    there, first = np.unique(number[order], return_index=True)
    medians = np.zeros(int(there.max()) + 1)
    medians[there] = [np.median(part) for part in np.split(values[order], first[1:])]
    return np.asarray(medians[number])


def _outer(rows: Float) -> Float:
    return np.asarray(rows.T @ rows)


def _deviation(values: Float) -> float:
    """Return the standard deviation from the median deviation from 0."""
    return MAD_TO_SIGMA * float(np.median(np.abs(values)))


def _tukey(scaled: Float) -> Float:
    return np.asarray(np.where(np.abs(scaled) < TUKEY, (1.0 - (scaled / TUKEY) ** 2) ** 2, 0.0))


def _lowest(at: Float, values: Float) -> float:
    """Return the minimum of a parabola through the lowest value and its neighbours, within the given places."""
    k = int(np.clip(np.argmin(values), 1, len(at) - 2))
    before, middle, after = values[k - 1 : k + 2]
    bend = before - 2.0 * middle + after
    if bend <= 0:
        return float(at[np.argmin(values)])
    return float(np.clip(at[k] + 0.5 * (before - after) / bend * (at[1] - at[0]), at[0], at[-1]))
