"""Planes of the ground where profiles stand farther apart than normals look, on ballast."""

from __future__ import annotations

import numpy as np
import pytest

from tunneldb.classification.ground.ransac import ransac_planes


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("roughness", [0.0, 0.02, 0.03])
def test_rough_profiles_half_a_metre_apart_have_the_plane_of_their_floor(roughness: float, seed: int) -> None:
    """Each profile by itself is a line, rough or not: it says nothing of how the floor falls along the tunnel."""
    rng = np.random.default_rng(seed)
    along, across = (grid.ravel() for grid in np.meshgrid(np.arange(-1.75, 2, 0.5), np.arange(-3.95, 4, 0.1), indexing="ij"))
    along = along + 0.01 * rng.standard_normal(len(along))
    floor = np.column_stack([along, across, 0.01 * along + 0.03 * across + roughness * rng.standard_normal(len(along))])
    u, z = (grid.ravel() for grid in np.meshgrid(np.arange(-1.75, 2, 0.5), np.arange(0.05, 2.4, 0.1), indexing="ij"))
    walls = [np.column_stack([u, np.full(len(u), side), z]) + 0.01 * rng.standard_normal((len(u), 3)) for side in (-4.0, 4.0)]
    points = np.concatenate([floor, *walls])
    found = ransac_planes(points, np.array([[0, len(points)]]), 0.05, 15.0, 0.3, np.array([seed]))
    assert found.coefficients[0] == pytest.approx([0.0, 0.01, 0.03], abs=0.008)
