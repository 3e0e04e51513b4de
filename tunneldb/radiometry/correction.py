r"""Correction of intensity for distance and incidence, point by point (Xu et al., 2018, eq. 4, 12 and 16).

.. math:: I_c = I_{dB} - I_{ref}(R) - F_2(\theta)

The constant K₀ of eq. 16, the reference target's own reflectance, is left at 0: corrected intensity is in dB
relative to the reference target for ``amplitude`` and ``linear``, and to the maker's white target for
``reflectance``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numba import njit, prange

from tunneldb.arrays import Bool, Float, Single
from tunneldb.errors import UserError
from tunneldb.radiometry.oren_nayar import coefficients
from tunneldb.radiometry.reference_curve import SPAN_TOLERANCE, ReferenceCurve

Kind = Literal["amplitude", "reflectance", "linear"]
"""What the raw intensity is: dB that fall with range, dB from which the maker removed range, or counts."""


def to_decibel(raw: Single | Float, kind: Kind) -> Float:
    """Raw intensity in dB (eq. 4).

    Parameters
    ----------
    raw : float array
        Raw intensity as the file holds it.
    kind : {'amplitude', 'reflectance', 'linear'}
        ``linear`` counts become 10·lg(counts), NaN where not positive; the others are dB already.
    """
    raw = np.asarray(raw, dtype=np.float64)
    if kind != "linear":
        return raw
    positive = raw > 0
    return np.asarray(np.where(positive, 10.0 * np.log10(np.where(positive, raw, 1.0)), np.nan), dtype=np.float64)


@dataclass(frozen=True)
class Observations:
    """How the scanner saw each point; all arrays (n,).

    Attributes
    ----------
    range_m : float32 array
        Distance from the scanner, m.
    cosine : float32 array
        Cosine of the incidence angle; at most 0 where the surface's back is seen, NaN where there is no
        normal.
    raw_db : float32 array
        Intensity as measured, dB; NaN where the counts are not positive.
    distance_db : float32 array
        Intensity corrected for distance (eq. 12), dB.
    """

    range_m: Single
    cosine: Single
    raw_db: Single
    distance_db: Single

    def corrected(self, roughness: float) -> Single:
        """Intensity corrected for distance and incidence (eq. 16), dB; NaN where cosine ≤ 0."""
        corrected: Single = _corrected(self.distance_db, self.cosine, *coefficients(roughness))
        return corrected


def needs_reference(kind: Kind) -> bool:
    """Tell whether intensity of this kind has to be corrected for distance by a reference curve."""
    return kind != "reflectance"


def observe(
    points: Float, scanner: Float, normal: Float, raw: Single, kind: Kind, reference: ReferenceCurve | None
) -> Observations:
    """Range, incidence and distance-corrected intensity of points.

    Parameters
    ----------
    points, scanner : (n, 3) float arrays
        Points and the scanner's position at each, m, in the tunnel's SRID.
    normal : (n, 3) float array
        Unit surface normals, into the tunnel.
    raw : (n,) float array
        Raw intensity.
    kind : {'amplitude', 'reflectance', 'linear'}
        What it is.
    reference : ReferenceCurve or None
        The distance effect; not used for ``reflectance``.

    Raises
    ------
    UserError
        If the kind needs a reference curve and there is none.
    """
    if kind not in get_args(Kind):
        raise ValueError(f"intensity kind {kind!r}")
    if not needs_reference(kind):
        reference = None
    elif reference is None:
        raise UserError(
            f"intensity of kind {kind} needs a reference curve: add the survey with --reference CSV"
            " (columns range_m,intensity_db)"
        )
    knots = reference.range_m if reference else np.zeros(0)
    values = reference.intensity_db if reference else np.zeros(0)
    return Observations(*_observe(points, scanner, normal, raw.astype(np.float32, copy=False), kind == "linear", knots, values))


def range_span(observations: Observations, use: Bool, reference: ReferenceCurve) -> tuple[float, float, int, int]:
    """Nearest and farthest range (m) of the points to use, how many are outside the curve's span, and all."""
    nearest, farthest, outside, count = _range_span(
        observations.range_m, use, reference.range_m[0] - SPAN_TOLERANCE, reference.range_m[-1] + SPAN_TOLERANCE
    )
    return nearest, farthest, outside, count


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def level_of(raw: float, linear: bool) -> float:
    """Raw intensity in dB (eq. 4); NaN of counts that are not positive."""
    if not linear:
        return raw
    return 10.0 * np.log10(raw) if raw > 0.0 else np.nan


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def reference_at(knots: Float, values: Float, r: float, hint: int) -> tuple[float, int]:
    """Intensity of the reference target at range ``r`` (eq. 9), and the curve's interval, looked for from a hint on."""
    last = knots.shape[0] - 1
    if r <= knots[0]:
        return values[0], 0
    if r >= knots[last]:
        return values[last], 0
    k = hint
    while knots[k] > r:
        k -= 1
    while knots[k + 1] <= r:
        k += 1
    share = (r - knots[k]) / (knots[k + 1] - knots[k])
    return values[k] + share * (values[k + 1] - values[k]), k


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def incidence_loss(cosine: float, a: float, b: float) -> float:
    """Loss by incidence (eq. 15), dB, of a surface with these coefficients, for a cosine above 0."""
    return float(10.0 * np.log10(a * cosine + b * (1.0 - cosine * cosine)))


@njit(cache=True, nogil=True, parallel=True)
def _observe(
    points: Float, scanner: Float, normal: Float, raw: Single, linear: bool, knots: Float, values: Float
) -> tuple[Single, Single, Single, Single]:  # pragma: no cover - compiled
    count = points.shape[0]
    range_m = np.empty(count, np.float32)
    cosine = np.empty(count, np.float32)
    raw_db = np.empty(count, np.float32)
    distance_db = np.empty(count, np.float32)
    for i in prange(count):
        x = scanner[i, 0] - points[i, 0]
        y = scanner[i, 1] - points[i, 1]
        z = scanner[i, 2] - points[i, 2]
        r = np.sqrt(x * x + y * y + z * z)
        range_m[i] = r
        cosine[i] = min(1.0, (x * normal[i, 0] + y * normal[i, 1] + z * normal[i, 2]) / max(r, 1e-9))
        level = level_of(raw[i], linear)
        raw_db[i] = level
        if knots.shape[0] > 0:
            level -= reference_at(knots, values, r, 0)[0]
        distance_db[i] = level
    return range_m, cosine, raw_db, distance_db


@njit(cache=True, nogil=True, parallel=True)
def _corrected(distance_db: Single, cosine: Single, a: float, b: float) -> Single:  # pragma: no cover - compiled
    corrected = np.empty(distance_db.shape[0], np.float32)
    for i in prange(distance_db.shape[0]):
        c = float(cosine[i])
        corrected[i] = distance_db[i] - incidence_loss(c, a, b) if c > 0.0 else np.nan
    return corrected


@njit(cache=True, nogil=True)
def _range_span(
    range_m: Single, use: Bool, low: float, high: float
) -> tuple[float, float, int, int]:  # pragma: no cover - compiled
    nearest, farthest = np.inf, -np.inf
    outside, count = 0, 0
    for i in range(range_m.shape[0]):
        if use[i]:
            r = float(range_m[i])
            count += 1
            nearest = min(nearest, r)
            farthest = max(farthest, r)
            if r < low or r > high:
                outside += 1
    return nearest, farthest, outside, count
