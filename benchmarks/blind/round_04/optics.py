"""How strong an echo is: range, incidence, gloss, noise of the scanner."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .geometry import Array


@dataclass(frozen=True)
class Law:
    """A scanner and how it reports amplitude.

    Attributes
    ----------
    constant : float
        Amplitude (dB) at 1 m without losses of a white target.
    near : float
        Range below which the receiver sees only part of the spot.
    power : float
        Loss with range: 10 · power · lg r (2 for a point that spreads, less behind a compressing amplifier).
    speckle : float
        Noise (dB) of a strong echo.
    floor : float
        Amplitude at which the noise is as strong as the echo.
    beam : float
        Full divergence (rad); the spot leaves the scanner 4 mm wide.
    range_noise : float
        Noise of range (m) on a bright wall.
    step : float
        Steps in which amplitude is kept (0: none).
    phase : bool
        Phase scanner: mixed pixels lie between two surfaces; else the first echo stands.
    """

    constant: float
    near: float = 1.5
    power: float = 2.0
    speckle: float = 0.35
    floor: float = -14.0
    beam: float = 3e-4
    range_noise: float = 0.0012
    step: float = 0.0
    phase: bool = True

    def range_term(self, r: Array) -> Array:
        """F(r) in dB."""
        return -10 * self.power * np.log10(r) - 10 * np.log10(1 + (self.near / r) ** 4)

    def observe(self, echo: Array, r: Array, rng: np.random.Generator) -> Array:
        """Amplitude of echoes (10 lg of reflectance and incidence) at ranges, with noise."""
        amplitude = self.constant + self.range_term(r) + echo
        deviation = np.hypot(self.speckle, 4.3 * 10 ** ((self.floor - amplitude) / 20))
        amplitude = amplitude + np.minimum(deviation, 3.0) * rng.standard_normal(r.shape)
        return np.rint(amplitude / self.step) * self.step if self.step else amplitude


def diffuse(cos: Array, rough: Array | float) -> Array:
    """Oren and Nayar's law seen from where the light comes from; 1 at square incidence, Lambert's for `rough` = 0."""
    m = np.square(rough)
    a, b = 1 - 0.5 * m / (m + 0.33), 0.45 * m / (m + 0.09)
    sin2 = 1 - cos * cos
    return (a * cos + b * sin2) / a


def lobe(cos: Array, m: float = 0.2) -> Array:
    """Gloss of a surface with slopes of deviation m; 1 at square incidence."""
    tan2 = 1 / (cos * cos) - 1
    return np.exp(-tan2 / m**2) / cos**4
