"""What a scanner makes of range, incidence and reflectance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .arrays import FloatArray


@dataclass(frozen=True)
class Instrument:
    """A scanner, with the way in which the lining scatters its light.

    Attributes
    ----------
    beam : float
        Full angle of the beam, radians.
    constant : float
        Amplitude of a white target, square at 10 m, dB.
    near : float
        Range below which the receiver no longer sees the whole spot, metres.
    ripple : float
        Amplitude of the deviation of the receiver's curve from the law, dB.
    rough : float
        Slope of facets of a rough surface (Oren and Nayar's sigma, radians); 0 is Lambert's law.
    gloss : float
        Strength of a lobe about the perpendicular as on a trowelled or laitance surface.
    speckle : float
        Noise that does not depend on the signal, dB.
    threshold : float
        Amplitude at which noise equals signal, dB.
    quantum : float
        Step of the recorded amplitude, dB.
    range_noise : float
        Metres, at good signal.
    blends : bool
        Whether echoes of two surfaces in a beam give a range between them, however far apart they are (phase comparison).
    """

    beam: float
    constant: float
    near: float
    ripple: float
    rough: float
    gloss: float = 0.0
    speckle: float = 0.4
    threshold: float = -10.0
    quantum: float = 0.01
    range_noise: float = 0.001
    blends: bool = False

    def range_db(self, distance: FloatArray) -> FloatArray:
        """Amplitude of a white target, square to the beam."""
        spread = -20 * np.log10(distance / 10)
        spot = 10 * np.log10(1 - 0.97 * np.exp(-((distance / self.near) ** 1.6)))
        curve = self.ripple * (np.sin(distance / 1.3) + 0.6 * np.sin(distance / 0.55 + 1.0))
        return np.asarray(self.constant + spread + spot + curve)

    def incidence_db(self, cosine: FloatArray) -> FloatArray:
        """Loss by incidence against the perpendicular."""
        c = np.clip(cosine, 0.03, 1.0)
        variance = self.rough**2
        a, b = 1 - 0.5 * variance / (variance + 0.33), 0.45 * variance / (variance + 0.09)
        angle = np.degrees(np.arccos(c))
        lobe = self.gloss * np.exp(-((angle / 9) ** 2))
        return np.asarray(10 * np.log10((a * c + b * (1 - c * c) + lobe) / (a + self.gloss)))

    def noisy(self, rng: np.random.Generator, amplitude: FloatArray) -> FloatArray:
        """Amplitude as recorded."""
        thermal = 4.34 * 10 ** ((self.threshold - amplitude) / 10)
        sigma = np.hypot(self.speckle, np.minimum(thermal, 6))
        return np.asarray(np.rint((amplitude + sigma * rng.standard_normal(amplitude.size)) / self.quantum) * self.quantum)
