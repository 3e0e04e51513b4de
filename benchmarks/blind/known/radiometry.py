"""How strong an echo is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from benchmarks.blind.known.section import Array


@dataclass(frozen=True)
class Law:
    """Reflection of the lining: rough after Oren and Nayar, seen from where it is lit, with a weak gloss.

    Attributes
    ----------
    roughness : float
        Standard deviation of the slopes, radians.
    gloss, gloss_width : float
        Share that is added square to the wall, and its width in degrees.
    sheen : float
        What a wet film gives back within some 5 degrees of square incidence, dB.
    """

    roughness: float = 0.3
    gloss: float = 0.08
    gloss_width: float = 12.0
    sheen: float = 0.4

    def incidence_db(self, cos: Array) -> Array:
        """Loss by incidence, 0 when square."""
        square = self.roughness**2
        a = 1.0 - 0.5 * square / (square + 0.33)
        b = 0.45 * square / (square + 0.09)
        rough = (a * cos + b * (1.0 - cos**2)) / a
        theta = np.degrees(np.arccos(np.clip(cos, 0.0, 1.0)))
        lobe = self.gloss * np.exp(-((theta / self.gloss_width) ** 2))
        loss: Array = 10.0 * np.log10(np.maximum((rough + lobe) / (1.0 + self.gloss), 1e-3))
        return loss

    def sheen_db(self, cos: Array, wet: Array) -> Array:
        """Gain by the film where it is wet."""
        theta = np.degrees(np.arccos(np.clip(cos, 0.0, 1.0)))
        gain: Array = self.sheen * np.clip(wet / 5.0, 0.0, 1.0) * np.exp(-((theta / 5.0) ** 2))
        return gain


@dataclass(frozen=True)
class Instrument:
    """Amplitude over range, beam and noise.

    Attributes
    ----------
    constant : float
        Amplitude of a white target at 10 m, dB.
    near : float
        Range (m) within which the receiver loses signal out of focus.
    damping : float
        Further loss, dB/m.
    exit_radius, half_angle : float
        Radius of the beam at the exit (m), half its divergence (rad).
    noise : float
        Standard deviation of an amplitude at usual strength, dB.
    step : float
        Step in which amplitudes are given, dB.
    has_reference : bool
        Whether the owner has a reference curve.
    """

    constant: float = 30.0
    near: float = 2.0
    damping: float = 0.01
    exit_radius: float = 0.002
    half_angle: float = 0.00015
    noise: float = 0.35
    step: float = 0.01
    has_reference: bool = True

    def range_db(self, t: Array) -> Array:
        """Amplitude of a white target square to the beam."""
        focus = 1.0 - np.exp(-((t / self.near) ** 2))
        value: Array = self.constant - 20.0 * np.log10(t / 10.0) + 10.0 * np.log10(focus) - self.damping * t
        return value

    def beam(self, t: Array) -> Array:
        """Radius of the beam."""
        return self.exit_radius + self.half_angle * t

    def noisy(self, amplitude: Array, rng: np.random.Generator) -> Array:
        """Add noise, stronger where the signal is weak, and round."""
        weak = 10.0 ** (-(amplitude - (self.constant - 2.0)) / 10.0)
        sigma = self.noise * np.sqrt(0.85 + 0.15 * np.clip(weak, 0.0, 60.0))
        value = amplitude + sigma * rng.standard_normal(len(amplitude))
        rounded: Array = np.round(value / self.step) * self.step
        return rounded


def mix_db(one: Array, other: Array, share: Array) -> Array:
    """Signal of a beam of which a share falls on one surface, the rest on another."""
    value: Array = 10.0 * np.log10(share * 10.0 ** (0.1 * one) + (1.0 - share) * 10.0 ** (0.1 * other) + 1e-9)
    return value
