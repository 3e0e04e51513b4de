"""Physical model of a scanner's intensity, in dB.

amplitude = C + F1(R) + F2(theta) + 10 log10(reflectance) + drop + noise, as in Xu et al. (2018), eq. 5:
F1 is the range term with the loss of near ranges (brightness reduction and defocus, their Fig. 3), F2 the
Oren-Nayar term (eq. 13-15).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Bool, Float, UInt16

# Near-range loss 1 - exp(-(R / NEAR_RANGE)**NEAR_POWER): with the inverse square, the curve peaks at 10 m and rises by
# 0.6 dB/m at 4 m, as the curve of the VZ-400i in Xu et al. (2018), Fig. 3.
NEAR_RANGE = 13.3
NEAR_POWER = 2.57
# dB of a white, perpendicular target at 1 m without near-range loss; puts concrete near 25 dB at 10 m, as there.
SYSTEM_CONSTANT = 54.5
# Counts at the strongest echo a diffuse target gives; 16 bits hold 65535.
FULL_SCALE = 50_000.0


def range_term(distance: Float, near_loss: bool = True) -> Float:
    """Return F1, the change of amplitude with range (m) of a fixed target, dB: inverse square with near-range loss."""
    r = np.asarray(distance, dtype=float)
    if not near_loss:
        return np.asarray(-20.0 * np.log10(r))
    near = -np.expm1(-((r / NEAR_RANGE) ** NEAR_POWER))
    return -20.0 * np.log10(r) + 10.0 * np.log10(near)


def oren_nayar_coefficients(roughness: float) -> tuple[float, float]:
    """Return A and B of Oren-Nayar for a standard deviation of facet slope in degrees (Xu et al., 2018, eq. 14)."""
    square = math.radians(roughness) ** 2
    return 1.0 - 0.5 * square / (square + 0.33), 0.45 * square / (square + 0.09)


def oren_nayar(cosine: Float, roughness: float) -> Float:
    """Return F2 for the cosine of incidence, dB (Xu et al., 2018, eq. 15).

    cos * (A + B sin tan) is written A cos + B sin², which is finite at grazing incidence, too.
    """
    a, b = oren_nayar_coefficients(roughness)
    c = np.asarray(cosine, dtype=float)
    return 10.0 * np.log10(a * c + b * (1.0 - c * c))


def counts(amplitude: Float, near_loss: bool = True) -> UInt16:
    """Return the linear intensity: power in counts, with a white target at the best range at full scale."""
    best = np.linspace(5.0, 15.0, 101) if near_loss else np.array([1.0])
    peak = SYSTEM_CONSTANT + float(range_term(best, near_loss).max())
    linear = FULL_SCALE * 10.0 ** ((np.asarray(amplitude, dtype=float) - peak) / 10.0)
    return np.clip(np.rint(linear), 1, 65535).astype(np.uint16)


@dataclass(frozen=True)
class Radiometry:
    """Surface and noise of the intensity.

    Attributes
    ----------
    roughness : float
        Oren-Nayar standard deviation of facet slope, degrees.
    lining, floor : float
        Reflectance (0 to 1) of concrete walls and of the floor.
    near_loss : bool
        True for a scanner with near-range loss; otherwise its range term is the inverse square.
    """

    roughness: float = 12.0
    lining: float = 0.30
    floor: float = 0.15
    near_loss: bool = True

    def reflectance(self, cosine: Float, floor: Bool, drop: Float) -> Float:
        """Return the range-independent part, dB: incidence, material and darkening (dB, positive is darker)."""
        material = np.where(floor, 10.0 * math.log10(self.floor), 10.0 * math.log10(self.lining))
        return oren_nayar(cosine, self.roughness) + material - drop

    def amplitude(self, distance: Float, reflectance: Float) -> Float:
        """Return the amplitude, dB, from range (m) and the range-independent part (dB)."""
        return SYSTEM_CONSTANT + range_term(distance, self.near_loss) + reflectance


# The reference target of Xu et al. (2018): 30 % at normal incidence.
TARGET_REFLECTANCE = 0.30


def reference_curve(furthest: float, rng: np.random.Generator, near_loss: bool = True) -> Float:
    """Return amplitudes of the reference target at every metre from 1 m to beyond ``furthest`` m; (n, 2): range m, dB.

    They are averages over a target, so their noise is small (0.02 dB).
    """
    r = np.arange(1.0, math.ceil(furthest) + 2.0)
    level = SYSTEM_CONSTANT + 10.0 * math.log10(TARGET_REFLECTANCE)
    return np.column_stack([r, level + range_term(r, near_loss) + rng.normal(0.0, 0.02, r.size)])
