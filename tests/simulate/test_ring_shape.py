"""Rings that the simulator makes oval, shifted and stepped: points and truth against ellipses and steps of their own."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tunneldb.errors import UserError
from tunneldb.shape.ellipse import ELLIPSE, solve
from tunneldb.simulate import Cloud, Parameters, Simulation, simulate
from tunneldb.simulate.ring_truth import lips, ring_heights, write_ring_truth

pytestmark = pytest.mark.slow

BARE: dict[str, Any] = {
    "length": 12.0, "radius": 0.0, "scanner": "profiler", "profile_spacing": 0.1, "profile_points": 500, "leaks": 0,
    "appendages": False, "niches": False, "range_noise": 0.0, "outliers": 0.0, "intensity_noise": 0.0, "lining": "segments",
}  # fmt: skip


@pytest.fixture(scope="module")
def made() -> tuple[Simulation, Cloud]:
    p = Parameters(**BARE, ring_step=0.002, ring_shift=0.003, segment_step=0.002, ovality=(0.3, 0.6))
    return Simulation(p), simulate(p)


def test_points_lie_on_the_rings_of_the_truth(made: tuple[Simulation, Cloud], tmp_path: Path) -> None:
    simulation, cloud = made
    rings = simulation.rings
    number = np.floor((cloud.chainage - rings.first) / rings.length).astype(int)
    lining = (cloud.klass == 0) & (cloud.offset > -0.03)  # clear of bolt pockets
    path = write_ring_truth(simulation, tmp_path / "rings.csv")
    assert path is not None
    with path.open(encoding="utf-8") as file:
        rows = [{name: float(value) for name, value in row.items() if value} for row in csv.DictReader(file)]
    assert [row["number"] for row in rows][:2] == [1, 2]
    whole = [row for row in rows if row["chainage_from"] > 0.0 and row["chainage_to"] < 12.0]
    assert len(whole) >= 6
    for row in whole:
        here = lining & (number == row["number"] - 1)
        frame = simulation.tunnel.line.frame(cloud.chainage[here])
        off = cloud.xyz[here] - frame.position
        places = np.column_stack([(off * frame.u).sum(axis=1), (off * frame.w).sum(axis=1)])
        turn = np.arctan2(*places.T)
        third = np.column_stack([np.cos(3.0 * turn), np.sin(3.0 * turn)])
        found = solve(places, np.array([0.0, 0.0, 4.0, 0.0, 0.0]), ELLIPSE, beside=third)
        np.testing.assert_allclose(found[:3], [row["centre_right"], row["centre_up"], row["radius"]], atol=0.0003)
        assert 2.0 * np.hypot(*found[3:5]) / found[2] == pytest.approx(row["ovality"], abs=0.00015)
    arc = cloud.arc[lining].astype(float)
    grid = np.arange(-9.5, 9.5, 0.002)
    heights = ring_heights(simulation, grid)
    off = cloud.offset[lining] - heights[number[lining], np.rint((arc + 9.5) / 0.002).astype(int)]
    assert np.quantile(np.abs(off), 0.97) < 1e-5  # all but those at edges


def test_shapes_are_as_large_as_asked(made: tuple[Simulation, Cloud]) -> None:
    simulation, _ = made
    shape = simulation.ring_shape
    ovality = 4.0 * np.hypot(*shape.ellipse[:, 2:].T) / 8.0
    assert 0.003 <= ovality.min() < ovality.max() <= 0.006
    many = Simulation(Parameters(**{**BARE, "length": 400.0, "ring_shift": 0.003, "segment_step": 0.002})).ring_shape
    assert many.ellipse[:, :2].std() == pytest.approx(0.003, rel=0.1)
    assert many.stand.std() == pytest.approx(0.002, rel=0.1)
    arc, size = lips(simulation, 3)
    before, after = (ring_heights(simulation, arc + side)[3] for side in (-1e-4, 1e-4))
    np.testing.assert_allclose(after - before, size, atol=1e-5)


def test_a_lining_without_such_rings_is_refused_in_one_line() -> None:
    for values, said in (
        ({"lining": "plain", "ovality": (0.1, 0.2)}, "ovality needs rings"),
        ({"lining": "cast", "segment_step": 0.001}, "needs segments"),
        ({"section": "horseshoe", "ring_shift": 0.001}, "use circular"),
        ({"ovality": (0.0, 9.0)}, "give 0 to 5 %"),
    ):
        with pytest.raises(UserError, match=said):
            Parameters(**{**BARE, **values})
