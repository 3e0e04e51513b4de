"""Reflectance and colour of materials.

A surface's level is 10 lg(d ON(θ) + s B(θ)): a diffuse part by Oren and Nayar (1994), and the lobe of a glossy rough surface
observed along the light, B = exp(-tan²θ / m²) / cos⁵θ with the slope m of its facets (Beckmann's distribution; Hodgson's and
Cook and Torrance's, 1982, eq. 5 without shadowing).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Float
from tunneldb.simulate.radiometry import oren_nayar


@dataclass(frozen=True)
class Material:
    """Reflectance of the diffuse part and of the lobe, Oren–Nayar roughness (degrees), slope of the lobe's facets.

    ``mottle`` and ``cell`` are the standard deviation (dB) and the size (m) of its unevenness, ``colour`` is RGB, 0 to 1.
    """

    diffuse: float
    lobe: float
    roughness: float
    slope: float
    mottle: float
    cell: float
    colour: tuple[float, float, float]

    def level(self, cosine: Float) -> Float:
        """Return the level (n,) in dB at the cosines of incidence (n,)."""
        c = np.clip(cosine, 0.01, 1.0)
        diffuse = self.diffuse * 10.0 ** (0.1 * oren_nayar(c, self.roughness))
        square = 1.0 / (c * c) - 1.0
        return np.asarray(10.0 * np.log10(diffuse + self.lobe * np.exp(-square / self.slope**2) / c**5))


MATERIALS = {
    "painted steel": Material(0.35, 0.10, 8.0, 0.30, 0.15, 0.4, (0.30, 0.42, 0.40)),
    "grey paint": Material(0.22, 0.05, 10.0, 0.35, 0.15, 0.4, (0.45, 0.46, 0.48)),
    "white paint": Material(0.60, 0.08, 10.0, 0.30, 0.15, 0.4, (0.85, 0.85, 0.83)),
    "bare steel": Material(0.15, 0.50, 12.0, 0.35, 0.20, 0.2, (0.58, 0.58, 0.60)),
    "galvanised": Material(0.30, 0.25, 12.0, 0.30, 0.30, 0.1, (0.68, 0.70, 0.72)),
    "rusty steel": Material(0.16, 0.0, 30.0, 1.0, 0.40, 0.15, (0.42, 0.24, 0.14)),
    "concrete": Material(0.30, 0.0, 15.0, 1.0, 0.30, 0.5, (0.60, 0.58, 0.55)),
    "brick": Material(0.20, 0.0, 25.0, 1.0, 0.30, 0.3, (0.55, 0.32, 0.25)),
    "cable": Material(0.05, 0.02, 15.0, 0.40, 0.20, 0.2, (0.10, 0.10, 0.11)),
}
RUST = MATERIALS["rusty steel"]
