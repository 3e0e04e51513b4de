"""Scanners and surfaces: how amplitude depends on range and incidence."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .section import Array


@dataclass(frozen=True)
class Instrument:
    """A laser scanner.

    Attributes
    ----------
    constant : float
        Amplitude of a white target at one metre, without what the range laws take, in dB.
    decay : float
        Exponent of the range in the power received.
    plateau : float
        Range up to which the received power is evened out, in metres.
    near, near_range : float
        Loss close to the instrument, in dB, and the range in which it fades, in metres.
    noise : float
        Deviation of the amplitude of strong echoes, in dB.
    weak : float
        Amplitude at which the noise has doubled, in dB.
    limit : float
        Amplitude below which no echo is found, in dB.
    step : float
        Resolution of the amplitude, in dB.
    drift : float
        Wander of the amplitude over a scan or a drive, in dB.
    range_noise : float
        In metres.
    beam : float
        Half the angle over which a footprint meets two surfaces, in radians.
    mixing : float
        Distance between two surfaces up to which their echoes merge, in metres.
    """

    constant: float
    decay: float = 2.0
    plateau: float = 0.0
    near: float = 0.0
    near_range: float = 1.0
    noise: float = 0.25
    weak: float = -30.0
    limit: float = -60.0
    step: float = 0.01
    drift: float = 0.1
    range_noise: float = 0.002
    beam: float = 0.0006
    mixing: float = 1.0

    def range_law(self, distance: Array) -> Array:
        """Part of the amplitude that depends on the range, in dB."""
        spread = np.sqrt(distance**2 + self.plateau**2)
        return -10 * self.decay * np.log10(spread) - self.near * np.exp(-distance / self.near_range)


@dataclass(frozen=True)
class Matt:
    """How a lining scatters back.

    Attributes
    ----------
    roughness : float
        Deviation of the slope of its facets, in radians (Oren and Nayar).
    lobe : float
        Width of the lobe about the normal of what shines, in radians.
    """

    roughness: float = 0.3
    lobe: float = 0.14

    def law(self, cosine: Array, sheen: Array | float = 0.0) -> Array:
        """Part of the amplitude that depends on the incidence, in dB."""
        cosine = np.clip(cosine, 0.02, 1)
        variance = self.roughness**2
        tilt = 0.45 * variance / (variance + 0.09) * (1 - cosine**2) / cosine
        diffuse = cosine * (1 - 0.5 * variance / (variance + 0.33) + tilt)
        return 10 * np.log10(diffuse + sheen * np.exp(-((np.arccos(cosine) / self.lobe) ** 2)))
