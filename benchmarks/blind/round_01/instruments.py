"""What a scanner makes of an echo: curve over the range, noise, threshold; and how surfaces reflect."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .frames import Array


@dataclass(frozen=True)
class Instrument:
    """A scanner's radiometry and noise.

    Attributes
    ----------
    constant : float
        Amplitude of a white target at 1 m, were it not for the losses close by, dB.
    falloff : float
        Decades of power lost per decade of range: 2 for a plain one.
    near : float
        Range below which the optics lose part of the light, m.
    wiggle : float
        Deviation from that smooth curve, dB.
    threshold : float
        Amplitude below which nothing is recorded.
    speckle, floor : float
        Deviation of the amplitude: of strong echoes, dB; of echoes at the threshold, dB more.
    range_noise : float
        Deviation of the range for echoes 20 dB above the threshold, m.
    beam : tuple of float
        Diameter at the exit, m, and divergence, radians.
    quantum : float
        Resolution of the amplitude, dB.
    drift : float
        Deviation of the amplitude from station to station, or along a ride, dB.
    stray : float
        Share of echoes that are nowhere near a surface.
    """

    constant: float
    falloff: float
    near: float
    wiggle: float
    threshold: float
    speckle: float
    floor: float
    range_noise: float
    beam: tuple[float, float]
    quantum: float = 0.01
    drift: float = 0.1
    stray: float = 0.001

    def curve(self, reach: Array) -> Array:
        """Amplitude of a white target, square to the beam, over the range."""
        lost = 10 * np.log10(1 - np.exp(-((reach / self.near) ** 2)) + 1e-6)
        bent = self.wiggle * np.sin(2.2 * np.log(reach) * np.pi)
        curve: Array = self.constant - 10 * self.falloff * np.log10(reach) + lost + bent
        return curve

    def noise(self, amplitude: Array, rng: np.random.Generator) -> Array:
        """Amplitude as it is recorded; not a number where the echo is too weak."""
        weak = self.floor * 10 ** (-(amplitude - self.threshold) / 20)
        seen = amplitude + rng.normal(0.0, 1.0, len(amplitude)) * np.hypot(self.speckle, np.minimum(weak, 4.0))
        seen = np.round(seen / self.quantum) * self.quantum
        return np.where(seen > self.threshold, seen, np.nan)

    def range_error(self, amplitude: Array, rng: np.random.Generator) -> Array:
        """Errors of the range, larger for weak echoes."""
        size = self.range_noise * np.clip(10 ** (-(amplitude - self.threshold - 20.0) / 20), 0.6, 4.0)
        return rng.normal(0.0, 1.0, len(amplitude)) * size


@dataclass(frozen=True)
class Law:
    """How a dry surface sends light back, as a mixture.

    Attributes
    ----------
    rough : float
        Deviation of the facets' slope, degrees, after Oren and Nayar: 0 is Lambert's law.
    power : float
        Exponent of the cosine that the former is multiplied by: 0 changes nothing, less than 0 is flatter (dust).
    gloss : float
        Height of a lobe about the square, as a part of the rest.
    lobe : float
        Half width of that lobe, degrees.
    """

    rough: float = 20.0
    power: float = 0.0
    gloss: float = 0.0
    lobe: float = 8.0

    def __call__(self, cosine: Array) -> Array:
        """Decibels against the same surface square to the beam, but for the lobe."""
        cos = np.clip(cosine, 0.03, 1.0)
        sine2 = 1 - cos**2
        s2 = np.radians(self.rough) ** 2
        first, second = 1 - 0.5 * s2 / (s2 + 0.33), 0.45 * s2 / (s2 + 0.09)
        diffuse = cos * (first + second * sine2 / cos) / first * cos**self.power
        angle = np.degrees(np.arccos(cos))
        level: Array = 10 * np.log10(diffuse + self.gloss * np.exp(-((angle / self.lobe) ** 2)))
        return level


def mirror(loss: Array, film: Array, cosine: Array) -> Array:
    """What a film of water does to the echo: less diffuse light, and a glint where the beam strikes squarely, dB."""
    angle = np.degrees(np.arccos(np.clip(cosine, 0.0, 1.0)))
    level: Array = 10 * np.log10(10 ** (-loss / 10) + 0.9 * film * np.exp(-((angle / 4.5) ** 2)))
    return level
