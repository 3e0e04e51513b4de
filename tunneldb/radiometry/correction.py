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

from tunneldb.arrays import Bool, Float, Single
from tunneldb.compiled import point_inner
from tunneldb.errors import UserError
from tunneldb.radiometry.oren_nayar import incidence_db
from tunneldb.radiometry.reference_curve import ReferenceCurve

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


@point_inner
def decibel(raw: float, linear: bool) -> float:  # pragma: no cover - compiled
    """Return the raw intensity of a point in dB, see `to_decibel`."""
    if linear:
        return 10.0 * np.log10(raw) if raw > 0.0 else np.nan
    return float(raw)


@dataclass(frozen=True)
class Observations:
    """Range and incidence of each point; all arrays (n,).

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
        seen = self.cosine > 0.0
        loss = incidence_db(np.where(seen, self.cosine, 1.0), roughness)
        return np.where(seen, self.distance_db - loss, np.nan).astype(np.float32)


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
            f"intensity of kind {kind} needs a reference curve: tunneldb survey set SURVEY --reference FILE (CSV with"
            " range_m,intensity_db)"
        )
    x, y, z = (scanner - points).T
    nx, ny, nz = normal.T
    range_m = np.sqrt(x * x + y * y + z * z)
    cosine = np.minimum(1.0, (x * nx + y * ny + z * nz) / np.maximum(range_m, 1e-9))
    raw_db = to_decibel(raw, kind)
    distance_db = raw_db - reference(range_m) if reference else raw_db
    return Observations(*(array.astype(np.float32) for array in (range_m, cosine, raw_db, distance_db)))


def unposed(raw: Single, kind: Kind) -> Observations:
    """Intensity taken as it is, since nobody knows where the scanner was: as if seen squarely, from no distance.

    Parameters
    ----------
    raw : (n,) float array
        Raw intensity.
    kind : {'amplitude', 'reflectance', 'linear'}
        What it is.
    """
    level = to_decibel(raw, kind).astype(np.float32)
    return Observations(np.zeros(len(level), np.float32), np.ones(len(level), np.float32), level, level)


def range_span(observations: Observations, use: Bool, reference: ReferenceCurve) -> tuple[float, float, int, int]:
    """Nearest and farthest range (m) of the points to use, how many are outside the curve's span, and all."""
    used = observations.range_m[use].astype(np.float64)
    outside = int(np.count_nonzero(reference.outside(used)))
    return float(used.min(initial=np.inf)), float(used.max(initial=-np.inf)), outside, len(used)


@point_inner
def reference_at(knots: Float, values: Float, r: float, hint: int) -> tuple[float, int]:  # pragma: no cover - compiled
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
