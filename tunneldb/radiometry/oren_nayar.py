"""Effect of the incidence angle on a rough surface (Oren & Nayar, 1994; Xu et al., 2018, eq. 13–15).

Roughness is the standard deviation σ of the facets' slope angles. It is in degrees everywhere outside the
formulas of this module.
"""

from __future__ import annotations

import numpy as np

from tunneldb.arrays import Float


def coefficients(roughness: float) -> tuple[float, float]:
    """Return the coefficients A and B of eq. 14.

    Parameters
    ----------
    roughness : float
        σ, degrees, 0 to 90. At 0 the surface is Lambert's: A = 1, B = 0.
    """
    square = np.radians(roughness) ** 2
    return float(1.0 - 0.5 * square / (square + 0.33)), float(0.45 * square / (square + 0.09))


def incidence_db(cosine: Float, roughness: float) -> Float:
    """Return the loss by incidence, F₂ of eq. 15.

    Written as 10·lg(A cos θ + B sin² θ), the same as eq. 15 but finite up to 90° when the surface is rough.

    Parameters
    ----------
    cosine : float array
        Cosine of the incidence angle, 0 to 1.
    roughness : float
        σ, degrees.

    Returns
    -------
    float array
        dB; −inf at 90° on a surface without roughness.
    """
    a, b = coefficients(roughness)
    cosine = np.asarray(cosine, dtype=np.float64)
    with np.errstate(divide="ignore"):
        return np.asarray(10.0 * np.log10(a * cosine + b * (1.0 - cosine * cosine)), dtype=np.float64)
