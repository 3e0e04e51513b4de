"""What is looked at to see whether intensity depends on range or incidence."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Float
from tunneldb.radiometry.dependence import Dependence
from tunneldb.radiometry.range_curve import RangeCurve
from tunneldb.radiometry.reference_curve import ReferenceCurve


@dataclass(frozen=True)
class Diagnosis:
    """Points as seen, and what their intensity was corrected with.

    Attributes
    ----------
    title : str
        What is looked at.
    range_m, angle : (n,) float arrays
        Range, m, and incidence, degrees.
    raw, corrected : (n,) float arrays
        Intensity, dB; corrected NaN where it could not be.
    roughness : tuple of float
        Roughnesses that were used, degrees: of each kilometre.
    found : tuple of RangeCurve
        Range curves found on the surfaces themselves.
    measured : ReferenceCurve or None
        Curve measured on a target.
    notes : tuple of str
        What was used, and what was refused.
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
        """Courses over range and incidence."""
        return Dependence.of(self.range_m, self.angle, self.raw, self.corrected)


def pool(title: str, looks: list[Diagnosis]) -> Diagnosis:
    """Put looks at several kilometres of one survey together."""

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
