"""Errors of a scanner's intensities: gain by time and line, saturation, noise that grows with range."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Float, Int64
from tunneldb.simulate.noise_field import normal_field, smooth_field
from tunneldb.simulate.parameters import Parameters

DRIFT_TIME = 40.0  # s: half the wavelength of drift
# Limits of the time of the gain step, as shares of the survey's time.
STEP_BETWEEN = (0.35, 0.65)
NOISE_RANGE = 10.0  # m


@dataclass(frozen=True)
class Instrument:
    """Errors of the scanner in the intensity.

    Attributes
    ----------
    banding, drift : float
        Standard deviations of the gain from line to line and over time, dB.
    step : float
        Change of the gain, dB, at ``step_time``, s.
    saturation : float or None
        Greatest amplitude, dB.
    noise_growth : float
        Relative growth of the noise at 10 m; it grows with the square of the range.
    salt : int
        Salt of the random gains.
    """

    banding: float
    drift: float
    step: float
    step_time: float
    saturation: float | None
    noise_growth: float
    salt: int

    @classmethod
    def of(cls, parameters: Parameters, begin: float, end: float, seed: np.random.SeedSequence) -> Instrument:
        """Return the scanner of a survey from ``begin`` to ``end``, s."""
        p = parameters
        share = float(np.random.default_rng(seed).uniform(*STEP_BETWEEN))
        salt = int(seed.generate_state(1)[0])
        return cls(p.banding, p.drift, p.gain_step, begin + share * (end - begin), p.saturation, p.noise_growth, salt)

    def gain(self, time: Float, line: Int64) -> Float:
        """Return the gain at times (n,), s, in lines (n,) of the scan, dB."""
        total = np.zeros(len(time))
        if self.banding:
            total += self.banding * normal_field(line, np.zeros_like(line), self.salt)
        if self.drift:
            total += self.drift * smooth_field(time / DRIFT_TIME, np.full(len(time), 0.5), self.salt + 1)
        if self.step:
            total += np.where(time >= self.step_time, self.step, 0.0)
        return total

    def capped(self, amplitude: Float) -> Float:
        """Return amplitudes limited by saturation of the receiver, dB."""
        return amplitude if self.saturation is None else np.minimum(amplitude, self.saturation)


def noise_scale(growth: float, distance: Float) -> Float:
    """Return the factor of the noise at ranges (n,), m, relative to no growth."""
    return 1.0 + growth * (distance / NOISE_RANGE) ** 2
