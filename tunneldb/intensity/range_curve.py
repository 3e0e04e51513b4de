r"""The effect of distance, found on the lining itself where no reference target was scanned.

Of each small cell of the lining the scanner sees an intensity

.. math:: I_{dB} = F_1(R) + F_2(\theta; \sigma) + \rho(cell) + noise

with F₁ and F₂ as in Xu et al. (2018), eq. 5. Of cells seen from several places the differences don't hold ρ, the cell's
own reflectance (the within-transformation of regressions with fixed effects). What cells differ by among each other says
something only as far as their reflectance is alike; how far, the residuals tell, and that part counts by so much less
(random effects). F₁ is a spline over ln R, in which the radar equation is a straight line; it rises to one maximum, or
from the first, and falls (Fig. 3 of Xu et al.: defocus at near range). F₂ is Oren–Nayar's with the σ of least loss.

The uncertainty is that of clustered residuals (sandwich), of σ, and of what a reflectance could do that changes around the
section, or from one stretch to the next, as much as the residuals show that it changes anywhere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tunneldb.errors import UserError
from tunneldb.intensity.cells import Cells, group
from tunneldb.intensity.fit import Fit, fit
from tunneldb.intensity.reference import ReferenceCurve
from tunneldb.intensity.roughness import STEEPEST
from tunneldb.intensity.spline import RangeSpline

Float = NDArray[np.float64]

MOST_UNCERTAIN = 0.3
"""Largest standard deviation of a curve that is used, dB: less than one of dry lining (Xu et al., 2018, Table 1)."""

FEWEST_CELLS = 200
"""Cells that it takes at least; fewer don't average out what a surface's texture does."""

LEAST_SPREAD = 1.1
"""Ratio of the ranges between which nearly all points lie, from which there is a course to find."""

PRESENT = (0.001, 0.999)
"""Shares of the points between whose ranges the curve must be known."""

BEYOND = 1.1
"""Factor by which the curve goes on beyond the ranges seen, by its slope over ln R: full density reaches a little farther."""

NODES = 60
"""Rows of the curve."""

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
        Ranges between which nearly all points lie, m.
    cells, overlapping : int
        Cells used, and those of them seen in several ways.
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
        at = np.union1d(
            self.curve.range_m[(self.curve.range_m > self.nearest) & (self.curve.range_m < self.farthest)],
            [self.nearest, self.farthest],
        )
        sigma = np.interp(at, self.curve.range_m, self.sigma_db)
        return float(sigma.max()), float(at[np.argmax(sigma)])

    def require(self) -> None:
        """Raise UserError where the curve is too uncertain to correct with."""
        sigma, at = self.worst
        if not sigma <= MOST_UNCERTAIN:
            raise UserError(
                f"range and incidence can't be told apart on this lining: the range curve is uncertain by {sigma:.2f} dB"
                f" at {at:.1f} m (at most {MOST_UNCERTAIN:g} dB will do); {ADVICE}"
            )


def estimate_range_curve(place: Float, range_m: Float, cosine: Float, raw_db: Float, *, unrolled: bool = True) -> RangeCurve:
    """Estimate range curve and roughness from points on the lining.

    Parameters
    ----------
    place : (n, 2) or (n, 3) float array
        Where the points lie, m: chainage and arc when ``unrolled``, else coordinates in space.
    range_m, cosine : (n,) float arrays
        Distance from the scanner, m, and cosine of the incidence angle.
    raw_db : (n,) float array
        Intensity, dB.
    unrolled : bool
        Whether places are in the unrolled plane of a tunnel.

    Raises
    ------
    UserError
        If there are too few points, or all are seen from the same distance. How sure the curve is, is not judged:
        see :meth:`RangeCurve.require`.
    """
    angle = np.degrees(np.arccos(np.clip(cosine, 0.0, 1.0)))
    usable = np.isfinite(raw_db) & (angle <= STEEPEST) & (cosine > 0) & (range_m > 0) & np.isfinite(place).all(axis=1)
    cells = group(place[usable], range_m[usable], cosine[usable], raw_db[usable], unrolled=unrolled)
    if cells.count < FEWEST_CELLS:
        raise UserError(
            f"a range curve can't be found on {cells.count} cells of lining of 0.5 m: it takes {FEWEST_CELLS}; {ADVICE}"
        )
    nearest, farthest = (float(r) for r in np.quantile(range_m[usable], PRESENT))
    low, high = np.quantile(range_m[usable], (0.01, 0.99))
    if high < LEAST_SPREAD * low:
        raise UserError(
            f"range and incidence can't be told apart on this lining: nearly all of it lies {low:.2f} to {high:.2f} m from"
            f" the scanner, so that no course over range shows; {ADVICE}"
        )
    spline = RangeSpline.over(nearest, farthest)
    found = fit(cells, spline)
    return _curve(cells, spline, found, nearest, farthest, (range_m[usable].min(), range_m[usable].max()))


def _curve(
    cells: Cells, spline: RangeSpline, found: Fit, nearest: float, farthest: float, seen: tuple[float, float]
) -> RangeCurve:
    """Table of the curve, with the uncertainty of its shape."""
    rows = np.geomspace(seen[0] / BEYOND, seen[1] * BEYOND, NODES)
    basis = spline(rows)
    centred = basis - found.weight @ spline(cells.range_m) / found.weight.sum()
    variance = np.einsum("ij,jk,ik->i", centred, found.covariance, centred)
    return RangeCurve(
        ReferenceCurve(rows, basis @ found.coefficients + found.level),
        np.sqrt(np.maximum(variance, 0.0)),
        found.roughness,
        found.roughness_sigma,
        nearest,
        farthest,
        cells.count,
        int(np.count_nonzero(np.bincount(cells.cell) > 1)),
        found.noise,
        found.lining,
    )
