"""Outlines on the surface, at its very end, too."""

import numpy as np
import pytest
import shapely
from shapely.geometry import box
from support.simulated_scenes import exact

from tunneldb.anomalies.geometries import anomaly_geometries
from tunneldb.simulate.generate import Simulation
from tunneldb.simulate.parameters import Parameters


@pytest.fixture(scope="module")
def surface():
    parameters = Parameters(length=20.0, start_chainage=100.0, radius=0.0, leaks=0, appendages=False, niches=False)
    return exact(Simulation(parameters))[0]


@pytest.mark.parametrize("beyond", [0.0, 0.02, 0.05])
@pytest.mark.parametrize("side", [0, 1])
def test_an_outline_a_pixel_beyond_the_end_lies_on_the_surface(surface, side, beyond):
    end = surface.ends[0, 0] if side == 0 else surface.ends[-1, 1]
    inward = 1.0 if side == 0 else -1.0
    first, last = sorted([end - inward * beyond, end + inward * 0.5])
    made = anomaly_geometries(box(first, 0.0, last, 0.5), surface)
    space = shapely.get_coordinates(made.surface, include_z=True)
    assert np.isfinite(space).all()
    assert np.isfinite(shapely.get_coordinates(made.map)).all()
    assert made.map.area == pytest.approx(0.25, abs=0.001)
    assert made.area == pytest.approx(0.5 * (0.5 + beyond), abs=0.001)
