"""Trunking, thin cables, sheets and meshes of the simulator: where their points lie off the wall."""

from __future__ import annotations

import numpy as np
import pytest
from support.lining_scans import inside, whole_scan

pytestmark = pytest.mark.slow


def test_trunking_stands_off_by_its_depth_from_end_to_end() -> None:
    simulation, cloud = whole_scan(trunking=2, seed=2)
    points = np.column_stack([cloud.chainage, cloud.arc])
    for item in simulation.appendages:
        assert item.kind == "trunking"
        assert 0.1 <= item.depth <= 0.4
        assert (item.start, item.end) == (0.0, 30.0)
        front = inside(item.footprint().buffer(-0.03), points) & (cloud.klass == 2)
        assert front.sum() > 500
        assert np.quantile(cloud.offset[front], 0.9) == pytest.approx(item.depth, abs=0.01)
        assert not (inside(item.footprint().buffer(-0.01), points) & (cloud.klass == 0)).any()


def test_thin_cables_hardly_show_in_range() -> None:
    simulation, cloud = whole_scan(thin_cables=4, profile_points=2000, profile_spacing=0.1, seed=3)
    kinds = {a.kind for a in simulation.appendages}
    assert kinds <= {"cable", "duct"}
    assert all(0.003 <= a.depth <= 0.025 and a.standoff == 0.5 * a.depth for a in simulation.appendages)
    hung = cloud.klass == 2
    assert hung.sum() > 300
    assert -1e-3 < cloud.offset[hung].min() <= cloud.offset[hung].max() < 0.026
    dark = cloud.reflectance[hung].mean() - cloud.reflectance[cloud.klass == 0].mean()
    assert -8.0 < dark < -1.0


def test_sheets_hide_the_lining_behind_them() -> None:
    simulation, cloud = whole_scan(sheets=3, seed=4)
    points = np.column_stack([cloud.chainage, cloud.arc])
    strips = simulation.appendages
    for strip in strips:
        on_it = inside(strip.footprint().buffer(-0.02), points) & (cloud.klass == 2)
        # A flat strip of 0.2 m lies nearer to the arch of 4 m at its edges, by 1.3 mm.
        np.testing.assert_allclose(np.median(cloud.offset[on_it]), strip.standoff + 0.5 * strip.depth, atol=0.003)
    below = inside(strips[0].footprint().buffer(-0.05), points)
    assert (cloud.klass[below] == 2).mean() > 0.6  # a slanting ray passes below its edge


@pytest.mark.parametrize("lining", ["plain", "rock"])
def test_a_mesh_lies_before_the_lining_in_a_grid(lining: str) -> None:
    simulation, cloud = whole_scan(mesh=0.1, lining=lining, profile_spacing=0.03, length=10.0, straight=2.0, seed=5)
    mesh = simulation._mesh
    assert mesh is not None
    wires = cloud.klass == 2
    np.testing.assert_allclose(cloud.offset[wires], mesh.offset, atol=0.002)
    from_wire = [np.abs(np.mod(x[wires].astype(float), 0.1) - 0.05) for x in (cloud.chainage, cloud.arc)]
    assert np.minimum(*from_wire).max() < 0.5 * mesh.wire + 1e-4
    share = wires.sum() / (wires.sum() + (cloud.klass == 0).sum())
    covered = 1.0 - (1.0 - mesh.wire / 0.1) ** 2
    assert share == pytest.approx(covered, rel=0.15) if lining == "plain" else 0.3 * covered < share < 1.2 * covered
    assert (cloud.leak[wires] == -1).all()
