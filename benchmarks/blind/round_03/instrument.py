"""What a scanner makes of an echo: law of reflection, range, electronics."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .arrays import Floats, Ints, Rng


@dataclass(frozen=True)
class Law:
    """Echo of a rough surface over the incidence, lit and seen along the same line.

    Attributes
    ----------
    roughness : float
        Standard deviation of the slopes of its facets (Oren and Nayar), degrees.
    flat : float
        Share that follows the square root of the cosine instead, as dusty grounds do.
    lobe : float
        Width of the specular lobe: standard deviation of the slopes of the gloss.
    """

    roughness: float = 25.0
    flat: float = 0.15
    lobe: float = 0.1

    def diffuse(self, cosine: Floats) -> Floats:
        """Share of the echo at normal incidence."""
        variance = math.radians(self.roughness) ** 2
        first = 1.0 - 0.5 * variance / (variance + 0.33)
        second = 0.45 * variance / (variance + 0.09)
        rough = (first * cosine + second * (1.0 - cosine**2)) / first
        return (1.0 - self.flat) * rough + self.flat * np.sqrt(cosine)

    def specular(self, cosine: Floats) -> Floats:
        """Shape of the lobe of gloss."""
        return np.exp(-(1.0 / cosine**2 - 1.0) / (2.0 * self.lobe**2))


@dataclass(frozen=True)
class Instrument:
    """A scanner's radiometry.

    Attributes
    ----------
    constant : float
        Amplitude of a square target of 0 dB at 5 m.
    near : float
        Range below which the receiver sees less than the whole spot, m.
    ripple : float
        Wave of the curve over range, dB, as piecewise amplifiers leave it.
    law : Law
        Reflection of the lining.
    speckle, weak : float
        Noise in dB of a strong echo, and what is added at amplitude 10.
    threshold, saturation : float
        Amplitudes below which there is no point, and at which the receiver saturates.
    step : float
        Quantisation.
    beam, exit_size : float
        Divergence (full angle, rad) and width at the exit (m).
    range_noise : float
        Standard deviation at good signal, m.
    facets : tuple of float
        Offsets of the facets of the mirror, dB.
    drift : tuple of float
        Slow changes of gain over the scan: amplitude (dB), waves in the scan, phase.
    jump : tuple of float
        Step of gain: share of the scan after which it comes, dB.
    """

    constant: float = 30.0
    near: float = 1.5
    ripple: float = 0.0
    law: Law = Law()
    speckle: float = 0.4
    weak: float = 0.5
    threshold: float = 6.0
    saturation: float = 46.0
    step: float = 0.05
    beam: float = 0.3e-3
    exit_size: float = 0.004
    range_noise: float = 0.0015
    facets: tuple[float, ...] = (0.0,)
    drift: tuple[float, float, float] = (0.0, 1.0, 0.0)
    jump: tuple[float, float] = (1.0, 0.0)

    def range_term(self, distance: Floats) -> Floats:
        """Effect of the range, dB against 5 m."""

        def curve(r: Floats) -> Floats:
            return -20.0 * np.log10(r) - 10.0 * np.log10(1.0 + (self.near / r) ** 3) + self.ripple * np.sin(1.9 * r)

        return curve(distance) - curve(np.array([5.0]))

    def reference(self, rng: Rng, farthest: float, tone: float) -> list[tuple[float, float]]:
        """Range and amplitude of a target, as measured in the yard."""
        ranges = np.concatenate([np.arange(0.8, 4.0, 0.2), np.arange(4.0, farthest + 0.5, 0.5)])
        values = self.constant + tone + self.range_term(ranges) + rng.normal(0.0, 0.06, ranges.size)
        return [(float(r), float(v)) for r, v in zip(ranges, values, strict=True)]

    def half_beam(self, distance: Floats) -> Floats:
        """Half width of the spot."""
        return 0.5 * (self.exit_size + self.beam * distance)

    def amplitude(self, echo: Floats, distance: Floats, share: Floats, facet: Ints, rng: Rng) -> Floats:
        """Recorded amplitude.

        Parameters
        ----------
        echo : ndarray
            Against a square target of 0 dB.
        distance : ndarray
            Range in metres.
        share : ndarray
            Time within the scan, 0 to 1.
        facet : ndarray
            Number of the facet.
        rng : numpy.random.Generator
            Source of chance.
        """
        level = self.constant + self.range_term(distance) + 10.0 * np.log10(np.maximum(echo, 1e-6))
        size, waves, phase = self.drift
        level += size * np.sin(2.0 * math.pi * (waves * share + phase)) + np.where(share > self.jump[0], self.jump[1], 0.0)
        level += np.array(self.facets)[facet]
        noise = np.hypot(self.speckle, self.weak * 10.0 ** ((10.0 - level) / 20.0))
        level += noise * rng.standard_normal(level.size)
        level = -np.logaddexp(-level / 0.8, -self.saturation / 0.8) * 0.8
        return np.rint(level / self.step) * self.step
