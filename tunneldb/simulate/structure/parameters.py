"""Parameters of a synthetic structure and of its scan."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import pyproj

from tunneldb.errors import UserError
from tunneldb.simulate.checks import metric_crs, require_within

# Allowed values: low, high, unit.
LIMITS: dict[str, tuple[float, float, str]] = {
    "stations": (1, 4, "stations"),
    "distance": (3.0, 40.0, "m"),
    "width": (3.0, 60.0, "m"),
    "angular_step": (0.005, 1.0, "degrees"),
    "range_noise": (0.0, 0.05, "m"),
    "beam": (0.0, 5.0, "mrad"),
    "intensity_noise": (0.0, 5.0, "dB"),
    "misregistration": (0.0, 0.05, "m"),
    "gain": (0.0, 6.0, "dB"),
    "anomalies": (0, 1000, "anomalies"),
    "fronts": (0, 20, "objects"),
}


@dataclass(frozen=True, kw_only=True)
class StructureParameters:
    """Synthetic structure and its scan; lengths in m, angles in degrees, levels in dB.

    Attributes
    ----------
    seed : int
        Random seed for the structure, its anomalies and the noise.
    stations : int
        Number of scanner positions, 1 to 4, spread in front of the structure.
    distance : float
        Distance from the stations to the structure's front.
    width : float
        Width of the structure, across the view.
    angular_step : float
        Step between rays, in azimuth and in zenith.
    range_noise : float
        Standard deviation along the ray.
    beam : float
        Full divergence, mrad: echoes at edges mix surfaces (mixed pixels); 0: none.
    intensity_noise : float
        Standard deviation of a point's level.
    misregistration, gain : float
        Standard deviations of each station's shift along each axis, and of its level.
    anomalies : int
        Number of anomalies; 0 for a scene without.
    contrast : (float, float)
        Limits of the contrast of an anomaly.
    fronts : int
        Number of objects in front that divide the members behind.
    night : bool
        True for a scan by night: no colours, and other noise; structure and anomalies are the same.
    """

    name: str = "structure"
    seed: int = 1
    srid: int = 25830
    origin: tuple[float, float, float] = (272_000.0, 4_765_000.0, 640.0)
    stations: int = 2
    distance: float = 8.0
    width: float = 6.0
    angular_step: float = 0.08
    range_noise: float = 0.002
    beam: float = 0.3
    intensity_noise: float = 0.4
    misregistration: float = 0.001
    gain: float = 0.3
    anomalies: int = 12
    contrast: tuple[float, float] = (1.0, 6.0)
    fronts: int = 2
    night: bool = False

    def __post_init__(self) -> None:
        require_within(self, LIMITS)
        low, high = self.contrast
        if not 0.0 < low <= high <= 20.0:
            raise UserError(f"contrast is {low:g} to {high:g} dB: give two ascending values above 0 and up to 20")

    def crs(self) -> pyproj.CRS:
        """Return the coordinate system; projected, in metres."""
        return metric_crs(self.srid)

    def as_dict(self) -> dict[str, Any]:
        """Return all parameters, for the record."""
        return asdict(self)
