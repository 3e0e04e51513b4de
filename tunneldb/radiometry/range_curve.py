r"""The effect of distance, found on the lining itself where no reference target was scanned.

Of each small cell of the lining the scanner sees an intensity

.. math:: I_{dB} = F_1(R) + F_2(\theta; \sigma) + \rho(cell) + noise

with F₁ and F₂ as in Xu et al. (2018), eq. 5. Of cells that several scans saw the differences don't hold ρ, the cell's own
reflectance (the within-transformation of regressions with fixed effects). Only where they don't suffice are cells compared
with each other, and only those of one strip along the tunnel, half a metre wide and a stretch of 5 m long: around the section
soot, grime and damp go with range and incidence, which no scanner that moves along the tunnel could tell apart. So a
reflectance that depends on the place in the section cancels; what changes along the tunnel is averaged out, and as far as
the residuals show that it changes, that part counts by so much less (random effects). A profiler sees all of a strip from
the same range, and its curve is uncertain. F₁ is a spline over ln R, in which the radar equation is a straight line; it rises
to one maximum, or from the first, and falls (Fig. 3 of Xu et al.: defocus at near range). F₂ is Oren–Nayar's with the σ of
least loss.

The uncertainty is that of clustered residuals (sandwich), and of σ.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Bool, Float
from tunneldb.errors import UserError
from tunneldb.radiometry.cells import CELL, Cells, IntensitySamples, group
from tunneldb.radiometry.range_spline import RangeSpline
from tunneldb.radiometry.reference_curve import ReferenceCurve
from tunneldb.radiometry.regression import Fit, fit
from tunneldb.radiometry.roughness import STEEPEST

MOST_UNCERTAIN = 0.3
"""Largest standard deviation of a curve that needs no remark, dB: less than one of dry lining (Xu et al., 2018, Table 1)."""

USABLE = 0.75
"""Largest standard deviation of a curve that is used where drops are told from the lining about them, dB: twice as much is what
damp lining loses at least (1.5 dB), and of the error only what changes within some metres remains."""

FEWEST_CELLS = 200
"""Cells that it takes at least; fewer don't average out what a surface's texture does."""

LEAST_SPREAD = 1.1
"""Ratio of the ranges between which nearly all points lie, from which there is a course to find."""

PRESENT = (0.001, 0.999)
"""Shares of the points between whose ranges the curve must be known."""

BEYOND = 1.1
"""Factor by which the curve goes on beyond the ranges seen, by its slope over ln R: full density reaches a little farther."""

NODES = 60
"""Rows of the curve, without those at the ranges between which it must be known."""

ADVICE = "scan a target and give its curve with --reference CSV, give the maker's, or take a reflectance dimension"


@dataclass(frozen=True)
class RangeCurve:
    """Range curve and roughness found on the lining.

    The curve is known but for a constant. It is set so that the median of the lining is 0 dB when corrected.

    Attributes
    ----------
    curve : ReferenceCurve
        Intensity over range, dB.
    sigma_db : (n,) float array
        Standard deviation of the curve's shape at its rows, dB: of its difference from its mean over all cells used.
    roughness, roughness_sigma : float
        Roughness σ of the lining and its standard deviation, degrees.
    nearest, farthest : float
        Ranges between which nearly all points lie, m; rows of the curve.
    cells, overlapping : int
        Cells used, and those of them that several scans saw.
    noise, lining : float
        Standard deviation of a cell seen again, and of cells among each other, dB.
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
        """Largest standard deviation within the ranges present, dB, and the range where it is, m."""
        sigma = np.where(self.present, self.sigma_db, 0.0)
        return float(sigma.max()), float(self.curve.range_m[np.argmax(sigma)])

    @property
    def present(self) -> Bool:
        """Rows of the curve within the ranges present; beyond them it goes on by its slope."""
        return np.asarray((self.curve.range_m >= self.nearest) & (self.curve.range_m <= self.farthest))

    @property
    def hardly_overlaps(self) -> bool:
        """Whether it rests on cells being alike along the tunnel, as hardly any were seen by several scans."""
        return self.overlapping < FEWEST_CELLS

    def require(self, most: float = MOST_UNCERTAIN) -> None:
        """Raise UserError where the curve is more uncertain than ``most``, dB, so that it can't be corrected with."""
        sigma, at = self.worst
        if not sigma <= most:
            raise UserError(
                f"range and incidence can't be told apart on this lining: the range curve is uncertain by {sigma:.2f} dB"
                f" at {at:.1f} m (at most {most:g} dB will do); {ADVICE}"
            )

    @property
    def remark(self) -> str | None:
        """What is to be known of a curve that is used though it is uncertain."""
        sigma, at = self.worst
        if sigma <= MOST_UNCERTAIN:
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
        Whether their places are in the unrolled plane of a tunnel, else in space.
    reach : (float, float)
        Ranges that the curve is to span too, m; beyond those of the points by its slope over ln R.

    Raises
    ------
    UserError
        If there are too few points, or all are seen from the same distance. How sure the curve is, is not judged:
        see :meth:`RangeCurve.require`.
    """
    angle = np.degrees(np.arccos(np.clip(samples.cosine, 0.0, 1.0)))
    usable = np.isfinite(samples.level) & (angle <= STEEPEST) & (samples.cosine > 0) & (samples.range_m > 0)
    samples = samples.some(usable & np.isfinite(samples.place).all(axis=1))
    count = len(np.unique(np.floor(samples.place / CELL), axis=0))
    if count < FEWEST_CELLS:
        raise UserError(
            f"a range curve can't be found on {count} cells of lining of {CELL:g} m: it takes {FEWEST_CELLS}; {ADVICE}"
        )
    nearest, low, high, farthest = (float(r) for r in np.quantile(samples.range_m, (PRESENT[0], 0.01, 0.99, PRESENT[1])))
    if high < LEAST_SPREAD * low:
        raise UserError(
            f"range and incidence can't be told apart on this lining: nearly all of it lies {low:.2f} to {high:.2f} m from"
            f" the scanner, so that no course over range shows; {ADVICE}"
        )
    spline = RangeSpline.over(nearest, farthest)
    cells = group(samples, spline, unrolled=unrolled)
    rows = np.union1d(
        np.geomspace(min(reach[0], samples.range_m.min()) / BEYOND, max(reach[1], samples.range_m.max()) * BEYOND, NODES),
        [nearest, farthest],
    )
    curves = []
    if cells.overlapping >= FEWEST_CELLS:
        curves.append(_curve(cells, spline, fit(cells, spline, among=False), rows, (nearest, farthest)))
    # What views of one cell say doesn't depend on what the lining is like: where it suffices, nothing else is asked.
    if not curves or not curves[0].worst[0] <= MOST_UNCERTAIN:
        curves.append(_curve(cells, spline, fit(cells, spline, among=True), rows, (nearest, farthest)))
    return min(curves, key=lambda curve: curve.worst[0])


def _curve(cells: Cells, spline: RangeSpline, found: Fit, rows: Float, present: tuple[float, float]) -> RangeCurve:
    """Table of the curve, with the uncertainty of its shape."""
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
