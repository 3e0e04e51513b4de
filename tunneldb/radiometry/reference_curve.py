"""Effect of distance: a curve measured on a reference target (Xu et al., 2018, eq. 7–12)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Bool, Float
from tunneldb.errors import UserError

SPAN_TOLERANCE = 0.05
"""Maximum distance of a range outside the curve's span, m; there the end value is used."""


@dataclass(frozen=True)
class ReferenceCurve:
    """Intensity of a reference target at several ranges, joined by straight lines (eq. 7–9).

    Attributes
    ----------
    range_m : (n,) float array
        Ranges, m, strictly increasing, n ≥ 2.
    intensity_db : (n,) float array
        Intensity of the target, dB.

    Raises
    ------
    UserError
        If there are fewer than two rows, a value is not finite, a range is not positive or occurs twice.
    """

    range_m: Float
    intensity_db: Float

    def __post_init__(self) -> None:
        ranges, intensity = self.range_m, self.intensity_db
        if len(ranges) < 2:
            raise UserError(f"a reference curve needs at least 2 rows; this one has {len(ranges)}")
        if not (np.all(np.isfinite(ranges)) and np.all(np.isfinite(intensity))):
            row = int(np.argmin(np.isfinite(ranges) & np.isfinite(intensity)))
            raise UserError(
                f"row {row + 1} of the reference curve, {ranges[row]:g} m, {intensity[row]:g} dB, is not finite: remove it"
            )
        if np.any(ranges <= 0):
            raise UserError(f"the reference curve has the range {ranges.min():g} m: ranges must be positive")
        if np.any(np.diff(ranges) <= 0):
            row = int(np.argmin(np.diff(ranges))) + 1
            raise UserError(f"ranges of the reference curve must increase strictly: {ranges[row]:g} m does not")

    @classmethod
    def from_rows(cls, range_m: Float, intensity_db: Float) -> ReferenceCurve:
        """Make a curve of rows in any order; a duplicate range raises UserError."""
        order = np.argsort(range_m, kind="stable")
        return cls(
            np.ascontiguousarray(range_m, dtype=np.float64)[order],
            np.ascontiguousarray(intensity_db, dtype=np.float64)[order],
        )

    def __call__(self, ranges: Float) -> Float:
        """Return the intensity of the target at the given ranges (m), dB (eq. 9); beyond the ends, the end values."""
        return np.interp(ranges, self.range_m, self.intensity_db)

    @property
    def span(self) -> tuple[float, float]:
        """Minimum and maximum range of the curve's use, m: SPAN_TOLERANCE beyond its ends."""
        return float(self.range_m[0]) - SPAN_TOLERANCE, float(self.range_m[-1]) + SPAN_TOLERANCE

    def outside(self, ranges: Float) -> Bool:
        """Return True for ranges (m) outside the curve's span by more than SPAN_TOLERANCE."""
        low, high = self.span
        return np.asarray((ranges < low) | (ranges > high), dtype=np.bool_)

    def outside_text(self, nearest: float, farthest: float, outside: int, count: int) -> str:
        """Return the message that too much of the lining is outside the curve's span, with advice.

        Parameters
        ----------
        nearest, farthest : float
            Ranges of the lining points, m.
        outside, count : int
            Number of lining points outside the curve's span, and in total.
        """
        return (
            f"the reference curve covers {self.range_m[0]:g} to {self.range_m[-1]:g} m, the lining is "
            f"{nearest:.2f} to {farthest:.2f} m from the scanner: {_share(outside, count)} of its points "
            f"are outside; give a curve that covers them, exclude oblique views with a smaller "
            f"intensity.max_incidence, or raise intensity.max_outside"
        )


def _share(part: int, whole: int) -> str:
    """Return the share in percent with two significant digits, so that a few of many points are not shown as none."""
    return f"{100.0 * part / whole:.2g} % ({part:,})"
