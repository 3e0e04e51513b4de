"""Leaks at particular places of the simulator: their outlines against section, cables and joints, and their points."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import shapely
from support.lining_scans import inside, levels, whole_scan

from tunneldb.simulate import Parameters, Simulation
from tunneldb.simulate.truth import dry_features

pytestmark = pytest.mark.slow


def of_kind(simulation: Simulation, kind: str) -> list[shapely.Geometry]:
    return [leak.polygon for leak in simulation.leaks if leak.kind == kind]


@pytest.fixture(scope="module")
def segments() -> Simulation:
    values: dict[str, Any] = {"pocket_leaks": 4, "panel_leaks": 2, "ring_leaks": 1, "cable_leaks": 3, "springline_leaks": 2}
    return Simulation(Parameters(length=80.0, lining="segments", leaks=3, foot_leaks=3, seed=2, **values))


def test_leaks_have_their_kinds_and_keep_apart(segments: Simulation) -> None:
    kinds = [leak.kind for leak in segments.leaks]
    expected = ["wall"] * 3 + ["ring"] + ["panel"] * 2 + ["springline"] * 2 + ["cable"] * 3 + ["foot"] * 3 + ["pocket"] * 4
    assert kinds == expected
    assert [leak.id for leak in segments.leaks] == list(range(1, len(kinds) + 1))
    for i, leak in enumerate(segments.leaks):
        assert leak.polygon.is_valid
        assert all(leak.polygon.distance(other.polygon) > 0.25 for other in segments.leaks[i + 1 :])


def test_a_leak_across_a_cable_is_wet_above_and_below_it(segments: Simulation) -> None:
    runs = [a for a in segments.appendages if a.is_run]
    for outline in of_kind(segments, "cable"):
        _, low, _, high = outline.bounds
        assert any(low < a.arc - 0.5 * a.width - 0.09 and high > a.arc + 0.5 * a.width + 0.09 for a in runs)


def test_foot_springline_and_ring_lie_where_the_section_has_them(segments: Simulation) -> None:
    section = segments.tunnel.section
    for outline in of_kind(segments, "foot"):
        low, high = outline.bounds[1::2]
        assert max(-low, high) == pytest.approx(section.floor_arc, abs=1e-6)
        assert high - low < 1.5
    for outline in of_kind(segments, "springline"):
        left, low, right, high = outline.bounds
        assert 5.0 - 1e-6 <= right - left <= 8.0 + 1e-6
        assert 0.04 < high - low <= 0.2 + 1e-6
        assert abs(0.5 * (low + high)) == pytest.approx(0.5 * np.pi * 4.0, abs=0.1)  # the circle is widest there
    (ring,) = of_kind(segments, "ring")
    left, low, right, high = ring.bounds
    assert (-low, high) == pytest.approx((section.floor_arc, section.floor_arc), abs=0.01)
    assert right - left == pytest.approx(1.48)


def test_panels_are_segments_and_pockets_are_bolts(segments: Simulation) -> None:
    dry = dry_features(segments)
    joints = shapely.union_all([d.outline for d in dry if d.kind == "joint"])
    bolts = [d.outline for d in dry if d.kind == "pocket"]
    for outline in of_kind(segments, "panel"):
        assert outline.disjoint(joints)
        assert outline.buffer(0.02, join_style="mitre").intersects(joints)
    for outline in of_kind(segments, "pocket"):
        assert sum(outline.contains(bolt) for bolt in bolts) == 1
        assert abs(outline.bounds[3 if outline.centroid.y > 0 else 1]) > abs(outline.centroid.y)


def test_at_a_walkway_the_foot_is_its_edge() -> None:
    simulation = Simulation(Parameters(length=60.0, section="box", walkway=0.4, leaks=0, foot_leaks=6, seed=3))
    for outline in of_kind(simulation, "foot"):
        low, high = outline.bounds[1::2]
        assert max(-low, high) == pytest.approx(4.0 + 6.0 - 0.4, abs=0.01)


def test_points_of_such_leaks_are_darker_and_the_cable_before_them_is_none() -> None:
    simulation, cloud = whole_scan(leaks=0, cable_leaks=2, foot_leaks=2, appendages=True, leak_edge=0.002, seed=4)
    points, level = np.column_stack([cloud.chainage, cloud.arc]), levels(cloud)
    for leak in simulation.leaks:
        within = inside(leak.polygon.buffer(-0.01), points)
        wet = within & (cloud.klass == 0)
        assert wet.sum() > 30
        assert (cloud.leak[wet] == leak.id).all()
        np.testing.assert_allclose(level[wet], -leak.drop, atol=0.01)
        before = within & (cloud.klass == 2)
        assert (cloud.leak[before] == -1).all()
        assert leak.kind != "cable" or before.sum() > 10


def test_drips_hang_as_far_below_as_asked() -> None:
    p = Parameters(length=60.0, leaks=8, leak_area=(0.3, 1.0), drips=True, drip_gap=(0.2, 0.4), appendages=False, seed=5)
    apart = []
    for leak in Simulation(p).leaks:
        parts = sorted(getattr(leak.polygon, "geoms", [leak.polygon]), key=lambda part: -part.area)
        apart += [part.distance(parts[0]) for part in parts[1:]]
    assert len(apart) > 4
    assert np.median(apart) > 0.15  # straight below is 0.2 m and more; a streak of the leak beside it may be nearer
    assert max(apart) < 0.401
