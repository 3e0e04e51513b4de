"""Relief, clutter and the beam of the simulator, and its leaks of special places, against geometry of its own."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
import shapely
from support.lining_scans import inside

from tunneldb.simulate import Cloud, Parameters, Simulation, simulate
from tunneldb.simulate.radiometry import oren_nayar
from tunneldb.simulate.rays.beam import segment_share
from tunneldb.simulate.truth import as_built, dry_features

pytestmark = pytest.mark.slow

BARE: dict[str, Any] = {
    "length": 24.0, "straight": 5.0, "scanner": "profiler", "profile_spacing": 0.03, "profile_points": 600, "leaks": 0,
    "appendages": False, "niches": False, "range_noise": 0.0, "outliers": 0.0, "intensity_noise": 0.0,
}  # fmt: skip


def scan(**values: Any) -> tuple[Simulation, Cloud]:
    p = Parameters(**{**BARE, **values})
    return Simulation(p), simulate(p)


def observers(simulation: Simulation, cloud: Cloud) -> np.ndarray:
    """Return the position of the trolley's scanner at each point."""
    trajectory = simulation.scanner.trajectory()
    return np.column_stack([np.interp(cloud.time, trajectory[:, 0], c) for c in trajectory[:, 1:].T])


@pytest.fixture(scope="module")
def segments() -> tuple[Simulation, Cloud]:
    return scan(lining="segments", ring_step=0.005, slope=4.0, seed=2)


def test_rings_stand_apart_as_asked(segments: tuple[Simulation, Cloud]) -> None:
    simulation, cloud = segments
    outlines = np.array([d.outline.bounds for d in dry_features(simulation) if d.kind == "joint"])
    is_ring = outlines[:, 3] - outlines[:, 1] > 2.0 * simulation.tunnel.section.floor_arc - 1e-6
    edges = np.sort(outlines[is_ring][:, [0, 2]].mean(axis=1))
    lining = cloud.klass == 0
    heights = []
    for left, right in pairwise(edges):
        here = cloud.offset[lining & (cloud.chainage > left + 0.6) & (cloud.chainage < right - 0.1)]  # clear of pockets
        assert np.ptp(here) < 1e-4
        heights.append(here.mean())
    assert len(heights) >= 14
    assert 0.0025 < np.std(heights) < 0.0085
    assert np.abs(heights).max() <= 0.015 + 1e-5


def test_pockets_are_recesses_seen_through_their_mouths(segments: tuple[Simulation, Cloud]) -> None:
    simulation, cloud = segments
    pockets = [d.outline for d in dry_features(simulation) if d.kind == "pocket"]
    deep = (cloud.klass == 0) & (cloud.offset < -0.02)
    assert deep.sum() > 500
    back = cloud.offset[deep] < np.median(cloud.offset[deep]) + 0.02
    assert 0.05 - 0.015 < -np.median(cloud.offset[deep]) < 0.08 + 0.015  # and the ring's step
    points = shapely.points(cloud.chainage[deep], cloud.arc[deep])
    assert (shapely.distance(shapely.union_all(pockets), points) < 2e-3).all()
    # Where the way to the back of a pocket crosses the surface, the pocket is open.
    sample = np.flatnonzero(deep)[back][:300]
    observer, spot = observers(simulation, cloud)[sample], cloud.xyz[sample]
    share = np.linspace(0.0, 0.25, 251)
    length = np.linalg.norm(spot - observer, axis=1)[:, None, None]
    way = spot[:, None] + share[None, :, None] * (observer - spot)[:, None] / length
    plane = simulation.tunnel.unroll(way.reshape(-1, 3))
    offset = plane.offset.reshape(len(sample), -1)
    out = np.argmax(offset > 0.016, axis=1)  # above every ring
    assert (offset.max(axis=1) > 0.016).all()
    mouth = np.argmax(offset > -0.016, axis=1)
    rows = np.arange(len(sample))
    s, arc = plane.chainage.reshape(offset.shape), plane.arc.reshape(offset.shape)
    at_mouth = shapely.points(s[rows, mouth], arc[rows, mouth])
    assert (shapely.distance(shapely.union_all(pockets), at_mouth) < 0.01).all()
    assert (out >= mouth).all()


def test_the_section_is_wider_over_the_second_half_and_the_floor_goes_on() -> None:
    simulation, cloud = scan(radius_step=0.08, section="horseshoe", slope=-4.0)
    lining = cloud.klass == 0
    first, second = cloud.offset[lining & (cloud.chainage < 11.9)], cloud.offset[lining & (cloud.chainage > 12.1)]
    assert np.abs(first).max() < 1e-4
    assert np.abs(second + 0.08).max() < 1e-4
    f = simulation.tunnel.line.frame(cloud.chainage)
    w = np.sum((cloud.xyz - f.position) * f.w, axis=1)
    assert w[lining | (cloud.klass == 1)].min() > simulation.tunnel.section.floor - 1e-4
    wide = (cloud.klass == 1) & (cloud.chainage > 12.1)
    u = np.sum((cloud.xyz - f.position) * f.u, axis=1)
    assert np.abs(u[wide]).max() > simulation.tunnel.section.half_width + 0.05


def test_truth_lies_on_the_section_as_built() -> None:
    """Arcs of a wider round section are longer in proportion to the radii."""
    simulation = Simulation(Parameters(**{**BARE, "radius_step": 0.08, "section": "circular"}))
    lay = as_built(simulation)
    radius, middle = 4.0, 0.5 * (simulation.tunnel.line.start + simulation.tunnel.line.end)
    before, behind = shapely.box(middle - 3, -5, middle - 1, 2), shapely.box(middle + 1, -5, middle + 3, 2)
    assert lay(before).equals(before)
    longer = (radius + 0.08) / radius
    np.testing.assert_allclose(lay(behind).bounds, (middle + 1, -5 * longer, middle + 3, 2 * longer), atol=1e-4)


def test_shotcrete_is_rough_by_millimetres_and_hides_nothing_wrongly() -> None:
    simulation, cloud = scan(lining="shotcrete", seed=3, profile_spacing=0.1)
    lining = cloud.klass == 0
    assert 0.004 < cloud.offset[lining].std() < 0.009
    assert np.abs(cloud.offset[lining]).max() < 0.025
    exact = simulation.tunnel.unroll(cloud.xyz)
    np.testing.assert_allclose(cloud.offset, exact.offset, atol=1e-5)
    # The way there is clear of the surface, which the points themselves sample.
    assert np.abs(np.mean(cloud.offset[lining])) < 0.003


def test_clutter_hangs_close_to_the_wall_and_leaks_keep_clear_of_it() -> None:
    simulation, cloud = scan(clutter=6, leaks=4, seed=4)
    kinds = [a.kind for a in simulation.appendages]
    assert kinds.count("pipe") == 2
    assert kinds.count("cable") >= 6
    assert {"sign", "box"} <= set(kinds)
    hidden = 0
    for a in simulation.appendages:
        seen = a.standoff + 0.5 * a.depth
        if a.kind == "cable":
            assert 0.02 <= a.width <= 0.08
            assert 0.03 - 1e-9 <= seen <= 0.30 + 1e-9
        assert a.standoff - 0.5 * a.depth >= -1e-9
        assert all(leak.polygon.distance(a.footprint()) > 0.2 for leak in simulation.leaks)
        on = (
            (cloud.klass == 2)
            & (cloud.chainage > a.start)
            & (cloud.chainage < a.end)
            & (np.abs(cloud.arc - a.arc) < 0.5 * a.width)
        )
        hidden += not on.any()
        assert cloud.offset[on].max(initial=0.0) < seen + 0.02
    assert hidden < 0.3 * len(kinds)  # behind the others of its bundle


def test_mixed_echoes_lie_at_edges_only_and_between_both_surfaces() -> None:
    _, smooth = scan(beam=0.5, section="box")
    assert (smooth.klass == 4).mean() < 2e-3  # nothing but the corners of the floor
    quiet = Parameters(**{**BARE, "appendages": True, "profile_points": 2500, "profile_spacing": 0.2})
    plain = simulate(quiet)
    cloud = simulate(Parameters(**{**quiet.as_dict(), "beam": 0.5}))
    assert len(cloud) == len(plain)
    mixed = np.flatnonzero((cloud.klass == 4) & (plain.klass != 4))
    assert len(mixed) > 100
    same = cloud.klass != 4
    np.testing.assert_array_equal(cloud.xyz[same & (plain.klass != 4)], plain.xyz[same & (plain.klass != 4)])
    # Among the next points of the profile there are two things, and the echo lies between the nearest and the farthest.
    window = np.clip(mixed[:, None] + np.arange(-4, 5), 0, len(plain) - 1)
    kinds = np.array([len(set(row)) for row in plain.klass[window].tolist()])
    assert (kinds > 1).mean() > 0.95
    ranges = plain.range[window]
    assert (cloud.range[mixed] > ranges.min(axis=1) - 0.01).all()
    assert (cloud.range[mixed] < ranges.max(axis=1) + 0.01).mean() > 0.95


def test_share_of_the_footprint_is_that_of_a_segment() -> None:
    rng = np.random.default_rng(1)
    x, y = rng.uniform(-1.0, 1.0, (2, 400_000))
    disc = x * x + y * y < 1.0
    for distance in (0.0, 0.3, 0.8):
        expected = (x[disc] > distance).mean()
        assert segment_share(np.array([distance]))[0] == pytest.approx(expected, abs=3e-3)
    assert segment_share(np.array([1.0]))[0] == 0.0


def test_leaks_along_joints() -> None:
    simulation = Simulation(Parameters(length=60.0, lining="segments", leaks=2, joint_leaks=10, seed=5))
    joints = [d.outline for d in dry_features(simulation) if d.kind == "joint"]
    bands = [k for k in simulation.leaks if k.kind == "joint"]
    assert [k.id for k in simulation.leaks] == list(range(1, 13))
    assert len(bands) == 10
    for band in bands:
        left, low, right, high = band.polygon.bounds
        assert 0.05 < min(right - left, high - low) <= 0.4 + 1e-9
        assert 0.5 - 1e-9 <= max(right - left, high - low) <= 3.0 + 1e-9
        along = max(band.polygon.intersection(j).length / 2.0 for j in joints if j.intersects(band.polygon))
        assert along > 0.95 * max(right - left, high - low)
    for i, one in enumerate(simulation.leaks):
        assert all(one.polygon.distance(other.polygon) > 0.25 for other in simulation.leaks[i + 1 :])


@pytest.mark.parametrize("section", ["circular", "horseshoe"])
def test_leaks_in_niches_wet_the_back_wall(section: Any) -> None:
    simulation, cloud = scan(section=section, niches=True, niche_leaks=2, seed=6, profile_spacing=0.02, profile_points=1500)
    depth = simulation.niches[0].depth
    rest = cloud.reflectance - oren_nayar(np.cos(cloud.incidence.astype(float)), 12.0)
    for leak in simulation.leaks:
        assert leak.kind == "niche"
        wet = cloud.leak == leak.id
        assert wet.sum() > 30
        assert np.all(cloud.klass[wet] == 3)
        assert -cloud.offset[wet].max() > 0.5 * depth
        within = (
            shapely.contains_xy(leak.polygon, cloud.chainage, cloud.arc) & (cloud.klass == 3) & (cloud.offset < -0.5 * depth)
        )
        assert (within == wet).mean() > 0.9999
        dry = (cloud.klass == 3) & (cloud.leak < 0)
        assert np.median(rest[dry]) - np.median(rest[wet]) == pytest.approx(leak.drop, abs=0.05)
        # Area of the wet points on the back wall, triangulated flat: chainage by height.
        f = simulation.tunnel.line.frame(cloud.chainage[wet])
        w = np.sum((cloud.xyz[wet] - f.position) * f.w, axis=1)
        hull = shapely.concave_hull(shapely.MultiPoint(np.column_stack([cloud.chainage[wet], w])), 0.2)
        assert hull.area == pytest.approx(leak.area_surface, rel=0.25)


def test_drips_hang_below_their_leaks_and_are_wet() -> None:
    p = {"leaks": 6, "length": 40.0, "seed": 7, "leak_area": (0.3, 1.0)}
    simulation, cloud = scan(**p, drips=True, profile_points=1200)
    dry = Simulation(Parameters(**{**BARE, **p}))
    assert sum(k.polygon.geom_type == "MultiPolygon" for k in simulation.leaks) >= 3
    lining = cloud.klass == 0
    points = np.column_stack([cloud.chainage, cloud.arc])[lining]
    for leak, before in zip(simulation.leaks, dry.leaks, strict=True):
        assert leak.polygon.is_valid
        assert leak.id == before.id
        assert leak.polygon.contains(before.polygon.buffer(-1e-6))
        differ = inside(leak.polygon, points) != (cloud.leak[lining] == leak.id)
        assert np.all(shapely.distance(leak.polygon.boundary, shapely.points(points[differ])) < 1e-5)
        down = np.sign(before.polygon.centroid.y)
        drips = leak.polygon.difference(before.polygon.buffer(1e-6))
        for drip in () if drips.is_empty else getattr(drips, "geoms", [drips]):
            assert drip.distance(before.polygon) > 0.004
            assert down * (drip.centroid.y - before.polygon.centroid.y) > 0.0


def test_edges_of_leaks_are_as_soft_as_asked() -> None:
    simulation, cloud = scan(leaks=2, leak_edge=0.2, leak_area=(0.8, 1.0), seed=8, profile_points=1500)
    lining = cloud.klass == 0
    rest = (cloud.reflectance - oren_nayar(np.cos(cloud.incidence.astype(float)), 12.0) - 10.0 * np.log10(0.3))[lining]
    points = np.column_stack([cloud.chainage, cloud.arc])[lining]
    for leak in simulation.leaks:
        near = inside(leak.polygon.buffer(0.5), points)
        depth = shapely.distance(leak.polygon.boundary, shapely.points(points[near])) * np.where(
            inside(leak.polygon, points[near]), 1, -1
        )
        share = -rest[near] / leak.drop
        assert np.abs(share[depth < -0.1]).max() < 1e-4
        assert np.abs(share[np.abs(depth) < 0.002] - 0.5).max() < 0.02
        assert np.abs(share[depth > 0.1] - 1.0).max(initial=0.0) < 1e-4


def test_inverse_square_curve_is_that_of_points_and_reference() -> None:
    simulation, cloud = scan(range_curve="inverse_square", profile_spacing=0.5)
    np.testing.assert_allclose(cloud.amplitude - cloud.reflectance + 20.0 * np.log10(cloud.range), 54.5, atol=1e-4)
    r, level = simulation.reference.T
    assert np.ptp(level + 20.0 * np.log10(r)) < 0.2
    assert cloud.intensity.max() < 65535
