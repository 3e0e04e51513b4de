r"""Effect of distance, estimated on the lining itself if no reference target was scanned.

For each small cell of the lining the scanner measures an intensity

.. math:: I_{dB} = F_1(R) + F_2(\theta; \sigma) + \rho(cell) + noise

with F₁ and F₂ as in Xu et al. (2018), eq. 5. For cells that several scans saw, the differences do not contain ρ, the cell's own
reflectance (the within-transformation of regressions with fixed effects). Only if these are not sufficient are cells compared
with each other, and only those of one strip along the tunnel, half a metre wide and a stretch of 5 m long: around the section
soot, grime and damp vary with range and incidence, and a scanner that moves along the tunnel cannot separate them. So a
reflectance that depends on the place in the section cancels. Changes along the tunnel are averaged; as far as the residuals
show them, these comparisons have less weight (random effects). A profiler sees all of a strip from the same range, and its
curve is uncertain. F₁ is a spline over ln R, in which the radar equation is a straight line; it rises to one maximum, or has
its maximum at the first range, and falls (Fig. 3 of Xu et al.: defocus at near range). F₂ is Oren–Nayar's with the σ of least
loss.

The uncertainty is that of clustered residuals (sandwich estimator), and of σ.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Bool, Float
from tunneldb.errors import UserError
from tunneldb.radiometry.cells import CELL, Cells, IntensitySamples, count_cells, group
from tunneldb.radiometry.range_spline import RangeSpline
from tunneldb.radiometry.reference_curve import ReferenceCurve
from tunneldb.radiometry.regression import Fit, fit
from tunneldb.radiometry.roughness import MAX_INCIDENCE

MAX_SIGMA = 0.3
"""Maximum standard deviation of a curve without a remark, dB: less than one of dry lining (Xu et al., 2018, Table 1)."""

MAX_SIGMA_FOR_DETECTION = 3.0
"""Maximum standard deviation of a curve for detecting darkening relative to the surrounding lining, dB: the darkening of water.

Only the change of the error within some metres matters, and the errors of the curve and of the roughness found with it cancel
where range and incidence change together. A curve that is not determined is uncertain by much more."""

MIN_CELLS = 200
"""Minimum number of cells; fewer do not average out the surface's texture."""

MIN_RANGE_RATIO = 1.1
"""Minimum ratio of the ranges that enclose nearly all points for a curve to be estimated."""

PRESENT_QUANTILES = (0.001, 0.999)
"""Quantiles of the points' ranges that limit the curve."""

EXTENSION = 1.1
"""Factor by which the curve extends beyond the ranges seen, by its slope over ln R: full density reaches a little farther."""

NODES = 60
"""Number of rows of the curve, without its limits."""

ADVICE = "scan a target and give its curve with --reference CSV, give the maker's, or take a reflectance dimension"


@dataclass(frozen=True)
class RangeCurve:
    """Range curve and roughness found on the lining.

    The curve is known except for a constant, which is set so that the corrected median of the lining is 0 dB.

    Attributes
    ----------
    curve : ReferenceCurve
        Intensity over range, dB.
    sigma_db : (n,) float array
        Standard deviation of the curve's shape at its rows, dB: of its difference from its mean over all cells used.
    roughness, roughness_sigma : float
        Roughness σ of the lining and its standard deviation, degrees.
    nearest, farthest : float
        Ranges that enclose nearly all points, m; rows of the curve.
    cells, overlapping : int
        Number of cells used, and of these seen by several scans.
    noise, lining : float
        Standard deviation of a cell seen again, and between cells, dB.
    """

    curve: ReferenceCurve
    sigma_db: Float
    roughness: float
    roughness_sigma: float
    nearest: float
    farthest: float
    cells: int
    overlapping: int
    noise: float
    lining: float

    @property
    def worst(self) -> tuple[float, float]:
        """Return the largest standard deviation within the ranges present, dB, and its range, m."""
        sigma = np.where(self.present, self.sigma_db, 0.0)
        return float(sigma.max()), float(self.curve.range_m[np.argmax(sigma)])

    @property
    def present(self) -> Bool:
        """Return the rows of the curve within the ranges present; beyond them it is extrapolated."""
        return np.asarray((self.curve.range_m >= self.nearest) & (self.curve.range_m <= self.farthest))

    @property
    def hardly_overlaps(self) -> bool:
        """Return True if several scans saw hardly any cell, so that the curve assumes uniform lining along the tunnel."""
        return self.overlapping < MIN_CELLS

    def require(self, most: float = MAX_SIGMA) -> None:
        """Raise UserError if the curve is more uncertain than ``most``, dB, and so not usable for correction."""
        sigma, at = self.worst
        if not sigma <= most:
            raise UserError(
                f"range and incidence cannot be separated on this lining: the range curve is uncertain by {sigma:.2f} dB"
                f" at {at:.1f} m (maximum {most:g} dB); {ADVICE}"
            )

    @property
    def remark(self) -> str | None:
        """Return a remark on a curve that is used although it is uncertain."""
        sigma, at = self.worst
        if sigma <= MAX_SIGMA:
            return None
        return f"the range curve is uncertain by {sigma:.2f} dB at {at:.1f} m, and so are faint leaks there; {ADVICE}"


def estimate_range_curve(
    samples: IntensitySamples, *, unrolled: bool = True, reach: tuple[float, float] = (np.inf, 0.0)
) -> RangeCurve:
    """Estimate range curve and roughness from points on the lining.

    Parameters
    ----------
    samples : IntensitySamples
        Points.
    unrolled : bool
        True if their places are in the unrolled plane of a tunnel, False if in space.
    reach : (float, float)
        Ranges that the curve must also cover, m; beyond those of the points it is extrapolated by its slope over ln R.

    Raises
    ------
    UserError
        If there are too few points, or all are seen from the same distance. The uncertainty of the curve is not checked: see
        :meth:`RangeCurve.require`.
    """
    angle = np.degrees(np.arccos(np.clip(samples.cosine, 0.0, 1.0)))
    usable = np.isfinite(samples.level) & (angle <= MAX_INCIDENCE) & (samples.cosine > 0) & (samples.range_m > 0)
    samples = samples.some(usable & np.isfinite(samples.place).all(axis=1))
    count = count_cells(samples.place)
    if count < MIN_CELLS:
        raise UserError(f"only {count} cells of {CELL:g} m of lining; a range curve needs at least {MIN_CELLS}; {ADVICE}")
    nearest, low, high, farthest = (
        float(r) for r in np.quantile(samples.range_m, (PRESENT_QUANTILES[0], 0.01, 0.99, PRESENT_QUANTILES[1]))
    )
    if high < MIN_RANGE_RATIO * low:
        raise UserError(
            f"range and incidence cannot be separated on this lining: nearly all of it is {low:.2f} to {high:.2f} m from"
            f" the scanner, too small a range of distances; {ADVICE}"
        )
    spline = RangeSpline.over(nearest, farthest)
    cells = group(samples, spline, unrolled=unrolled)
    rows = np.union1d(
        np.geomspace(min(reach[0], samples.range_m.min()) / EXTENSION, max(reach[1], samples.range_m.max()) * EXTENSION, NODES),
        [nearest, farthest],
    )
    curves = []
    if cells.overlapping >= MIN_CELLS:
        curves.append(_curve(cells, spline, fit(cells, spline, among=False), rows, (nearest, farthest)))
    # Comparisons of views of one cell do not depend on the lining: if they suffice, nothing else is used.
    if not curves or not curves[0].worst[0] <= MAX_SIGMA:
        curves.append(_curve(cells, spline, fit(cells, spline, among=True), rows, (nearest, farthest)))
    return min(curves, key=lambda curve: curve.worst[0])


def _curve(cells: Cells, spline: RangeSpline, found: Fit, rows: Float, present: tuple[float, float]) -> RangeCurve:
    """Return the table of the curve, with the uncertainty of its shape."""
    basis = spline(rows)
    centred = basis - found.weight @ cells.basis / found.weight.sum()
    variance = np.einsum("ij,jk,ik->i", centred, found.covariance, centred)
    return RangeCurve(
        ReferenceCurve(rows, basis @ found.coefficients + found.level),
        np.sqrt(np.maximum(variance, 0.0)),
        found.roughness,
        found.roughness_sigma,
        *present,
        cells.count,
        cells.overlapping,
        found.noise,
        found.lining,
    )
