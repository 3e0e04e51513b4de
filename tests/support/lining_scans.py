"""Scans of a bare simulated lining without noise, for tests of what lies on it."""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely

from tunneldb.simulate import Cloud, Parameters, Simulation, simulate
from tunneldb.simulate.radiometry import oren_nayar

BARE: dict[str, Any] = {
    "length": 30.0, "straight": 5.0, "scanner": "profiler", "profile_spacing": 0.04, "profile_points": 700, "leaks": 0,
    "appendages": False, "niches": False, "range_noise": 0.0, "outliers": 0.0, "intensity_noise": 0.0,
}  # fmt: skip


def whole_scan(**values: Any) -> tuple[Simulation, Cloud]:
    """The simulation and all of its points."""
    p = Parameters(**{**BARE, **values})
    return Simulation(p), simulate(p)


def levels(cloud: Cloud) -> np.ndarray:
    """Reflectance of points over plain lining, dB."""
    return cloud.reflectance - oren_nayar(np.cos(cloud.incidence.astype(float)), 12.0) - 10.0 * np.log10(0.3)


def scan(**values: Any) -> tuple[Simulation, np.ndarray, np.ndarray]:
    """A scan of the lining: the simulation, points (chainage, arc) of the lining, their level over plain lining, dB."""
    simulation, cloud = whole_scan(**values)
    lining = cloud.klass == 0
    return simulation, np.column_stack([cloud.chainage, cloud.arc])[lining], levels(cloud)[lining]


def inside(outline: shapely.Geometry, points: np.ndarray) -> np.ndarray:
    """Return True for points (n, 2) in an outline."""
    left, low, right, high = outline.bounds
    within = (points[:, 0] >= left) & (points[:, 0] <= right) & (points[:, 1] >= low) & (points[:, 1] <= high)
    shapely.prepare(outline)
    within[within] = shapely.contains_xy(outline, points[within])
    return within
