"""Data for diagnosing the dependence of intensity on range and incidence."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Float
from tunneldb.radiometry.dependence import Dependence
from tunneldb.radiometry.range_curve import RangeCurve
from tunneldb.radiometry.reference_curve import ReferenceCurve


@dataclass(frozen=True)
class Diagnosis:
    """Points with range, incidence and intensity, and the correction used.

    Attributes
    ----------
    title : str
        Name of the data.
    range_m, angle : (n,) float arrays
        Range, m, and incidence, degrees.
    raw, corrected : (n,) float arrays
        Intensity, dB; corrected is NaN if not possible.
    roughness : tuple of float
        Roughness of each kilometre, degrees.
    found : tuple of RangeCurve
        Range curves estimated from the surfaces themselves.
    measured : ReferenceCurve or None
        Curve measured on a target.
    notes : tuple of str
        Remarks on what was used and what was refused.
    """

    title: str
    range_m: Float
    angle: Float
    raw: Float
    corrected: Float
    roughness: tuple[float, ...] = ()
    found: tuple[RangeCurve, ...] = ()
    measured: ReferenceCurve | None = None
    notes: tuple[str, ...] = ()

    @property
    def dependence(self) -> Dependence:
        """Return the dependence on range and incidence."""
        return Dependence.of(self.range_m, self.angle, self.raw, self.corrected)


def pool(title: str, looks: list[Diagnosis]) -> Diagnosis:
    """Combine the diagnoses of several kilometres of one survey."""

    def all_of(name: str) -> Float:
        return np.concatenate([getattr(look, name) for look in looks])

    return Diagnosis(
        title,
        all_of("range_m"),
        all_of("angle"),
        all_of("raw"),
        all_of("corrected"),
        tuple(roughness for look in looks for roughness in look.roughness),
        tuple(curve for look in looks for curve in look.found),
        next((look.measured for look in looks if look.measured), None),
        tuple(note for look in looks for note in look.notes),
    )
