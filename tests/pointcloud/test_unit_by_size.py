"""Unit of length of points without a stated one, by the size of the tunnel that they show."""

from __future__ import annotations

import numpy as np
import pytest

from tunneldb.arrays import Float
from tunneldb.geometry.units import METRES
from tunneldb.pointcloud.form import tunnel_form
from tunneldb.pointcloud.unit_by_size import guess_unit


def tube(radius: float, length: float = 40.0, count: int = 5_000) -> Float:
    """Points on a cylinder, m."""
    rng = np.random.default_rng(1)
    along, angle = rng.uniform(0.0, length, count), rng.uniform(-np.pi, np.pi, count)
    return np.column_stack([400.0 + along, 200.0 + radius * np.sin(angle), 50.0 + radius * np.cos(angle)])


@pytest.mark.parametrize(
    ("radius", "unit", "named"),
    [(9.0, "m", None), (4.0, "mm", ["mm"]), (4.0, "cm", ["cm"]), (4.0, "in", ["in", "cm"]), (8.0, "us-ft", ["ft"])],
)
def test_unit(radius: float, unit: str, named: list[str] | None) -> None:
    xyz = tube(radius) / METRES[unit]
    guess = guess_unit(xyz, 1.0, tunnel_form(xyz))
    if named is None:
        assert guess is None
        return
    assert guess is not None
    assert f"give {' or '.join(f'--unit {one}' for one in named)}, or --unit m" in guess.text
    assert guess.option == f" --unit {named[0] if len(named) == 1 else 'UNIT'}"


def test_a_dense_scan_of_a_large_site_is_not_a_small_tunnel() -> None:
    rng = np.random.default_rng(1)
    middles = rng.uniform([0.0, 0.0, 0.0], [700.0, 200.0, 180.0], (20, 3))
    xyz = np.concatenate([middle + rng.normal(0.0, 0.05, (500, 3)) for middle in middles])
    assert guess_unit(xyz, 1.0, None) is None
