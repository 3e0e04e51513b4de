"""Rays of the simulator: what they meet, against marching in small steps and closed formulas."""

from typing import Any

import numpy as np
import pytest

from tunneldb.simulate import Cloud, Parameters, Simulation, simulate
from tunneldb.simulate.objects.fixtures import appendage_table, distance

pytestmark = pytest.mark.slow

FEW: dict[str, Any] = {
    "length": 40.0,
    "straight": 5.0,
    "angular_step": 0.8,
    "profile_spacing": 0.4,
    "profile_points": 300,
    "leaks": 2,
}
CASES: list[dict[str, Any]] = [
    {"section": "circular", "scanner": "static", "slope": 4.0},
    {"section": "horseshoe", "scanner": "profiler", "slope": -4.0},
    {"section": "box", "scanner": "static", "radius": -300.0},
    {"section": "circular", "scanner": "static", "density": 60.0},
    {"section": "horseshoe", "scanner": "profiler", "density": 60.0, "transition": 10.0, "s_curve": True},
]


@pytest.mark.parametrize("case", CASES)
def test_points_without_noise_lie_on_the_surface(case: dict[str, Any]) -> None:
    cloud = simulate(Parameters(**FEW, **case, range_noise=0.0, outliers=0.0))
    assert np.abs(cloud.offset[cloud.klass == 0]).max() < 1e-5
    floor = cloud.offset[cloud.klass == 1]
    assert floor.min() > -1e-5
    assert floor.max() < 0.18  # rails
    assert (floor < 1e-5).mean() > 0.9
    for klass in range(4):
        assert (cloud.klass == klass).any()


@pytest.mark.parametrize("case", CASES)
def test_truth_is_the_exact_unrolling_of_the_stored_point(case: dict[str, Any]) -> None:
    p = Parameters(**FEW, **case, outliers=0.01)
    cloud = simulate(p)
    tunnel = Simulation(p).tunnel
    exact = tunnel.unroll(cloud.xyz)
    np.testing.assert_allclose(cloud.chainage, exact.chainage, atol=1e-6)
    np.testing.assert_allclose(cloud.offset, exact.offset, atol=1e-5)
    near = np.abs(cloud.offset) < 0.1
    np.testing.assert_allclose(cloud.arc[near], exact.arc[near], atol=1e-5)


def test_truth_agrees_with_the_formula_of_a_torus() -> None:
    p = Parameters(**{**FEW, "straight": 0.0}, azimuth=0.0, origin=(0.0, 0.0, 0.0), radius=300.0)
    cloud = simulate(p)
    arch = (cloud.klass == 0) & (np.abs(cloud.arc) < 9.3)  # at the corner the floor may be nearer
    x, y, z = cloud.xyz[arch].T
    to_centre = np.hypot(x - 300.0, y)
    np.testing.assert_allclose(cloud.chainage[arch], 300.0 * np.arctan2(y, 300.0 - x), atol=1e-6)
    np.testing.assert_allclose(cloud.arc[arch], 4.0 * np.arctan2(300.0 - to_centre, z), atol=1e-5)
    np.testing.assert_allclose(cloud.offset[arch], 4.0 - np.hypot(to_centre - 300.0, z), atol=1e-5)


def test_range_noise_acts_along_the_ray() -> None:
    cloud = simulate(Parameters(**FEW, scanner="static", range_noise=0.004, outliers=0.0))
    lining = cloud.klass == 0
    along = cloud.offset[lining] / np.cos(cloud.incidence[lining])
    assert along.std() == pytest.approx(0.004, rel=0.03)
    assert abs(along.mean()) < 2e-4


def test_relief_moves_the_lining_by_millimetres_and_smoothly() -> None:
    cloud = simulate(Parameters(**FEW, scanner="profiler", range_noise=0.0, outliers=0.0, relief=0.003))
    lining = cloud.klass == 0
    assert 0.0005 < cloud.offset[lining].std() < 0.003
    assert np.abs(cloud.offset[lining]).max() < 0.0035


def sight(simulation: Simulation, cloud: Cloud) -> np.ndarray:
    if simulation.parameters.scanner == "static":
        return simulation.scanner.stations()[cloud.scan_id - 1]
    trajectory = simulation.scanner.trajectory()
    return np.column_stack([np.interp(cloud.time, trajectory[:, 0], c) for c in trajectory[:, 1:].T])


@pytest.mark.parametrize("case", CASES[:3])
def test_nothing_stands_between_scanner_and_point(case: dict[str, Any]) -> None:
    """March along a sample of rays: free of lining, floor and appendages up to the point."""
    p = Parameters(**FEW, **case, range_noise=0.0, outliers=0.0, niches=False)
    simulation = Simulation(p)
    cloud = simulate(p)
    tunnel = simulation.tunnel
    rows = appendage_table(tunnel, simulation.appendages)
    sample = np.random.default_rng(2).choice(len(cloud), 400, replace=False)
    start = sight(simulation, cloud)[sample]
    share = np.linspace(0.01, 0.999, 300)
    way = start[:, None] + share[:, None] * (cloud.xyz[sample] - start)[:, None]
    unrolled = tunnel.unroll(way.reshape(-1, 3))
    # Along the last millimetres of a grazing ray the offset is as small as the rounding.
    assert unrolled.offset.min() > -1e-5
    f = tunnel.line.frame(unrolled.chainage)
    d = way.reshape(-1, 3) - f.position
    u, w = np.sum(d * f.u, axis=1), np.sum(d * f.w, axis=1)
    for k, row in enumerate(rows):
        near = np.flatnonzero((unrolled.chainage > row[1] - 1) & (unrolled.chainage < row[2] + 1))
        near = near[np.hypot(u[near] - row[3], w[near] - row[4]) < 0.5]
        gaps = [distance.py_func(rows, k, unrolled.chainage[i], u[i], w[i]) for i in near]
        assert min(gaps, default=1.0) > -1e-3


def test_cables_are_tubes_and_hide_the_lining_behind_them() -> None:
    p = Parameters(**FEW, scanner="profiler", range_noise=0.0, outliers=0.0)
    simulation = Simulation(p)
    cloud = simulate(p)
    cable = next(a for a in simulation.appendages if a.kind == "cable")
    row = appendage_table(simulation.tunnel, [cable])[0]
    f = simulation.tunnel.line.frame(cloud.chainage)
    d = cloud.xyz - f.position
    to = np.hypot(np.sum(d * f.u, axis=1) - row[3], np.sum(d * f.w, axis=1) - row[4])
    on = (cloud.klass == 2) & (to < 1.5 * row[7])
    assert on.sum() > 50
    np.testing.assert_allclose(to[on], row[7], atol=2e-4)
    # Seen from the trolley, no point of the lining lies in line with the middle of the cable.
    assert simulation.tunnel.section.floor < row[4]
    observer = np.array([p.scanner_offset, simulation.tunnel.section.floor + p.scanner_height])
    point = np.column_stack([np.sum(d * f.u, axis=1), np.sum(d * f.w, axis=1)]) - observer
    middle = row[3:5] - observer
    angle = np.arctan2(*point.T) - np.arctan2(*middle)
    hidden = np.abs(angle) < 0.8 * np.arcsin(row[7] / np.hypot(*middle))
    assert hidden.sum() > 50
    assert not (cloud.klass[hidden] == 0).any()


def test_niche_is_as_deep_as_it_says() -> None:
    p = Parameters(**FEW, section="horseshoe", scanner="profiler", range_noise=0.0, outliers=0.0)
    simulation = Simulation(p)
    cloud = simulate(p)
    niche = simulation.niches[0]
    inside = cloud.klass == 3
    assert inside.sum() > 50
    assert np.abs(cloud.chainage[inside] - niche.chainage).max() < 0.5 * niche.width + 0.02
    assert np.all(np.sign(cloud.arc[inside]) == niche.side)
    back = -cloud.offset[inside]
    assert back.max() < niche.depth + 0.01
    assert np.median(back) == pytest.approx(niche.depth, abs=0.01)


def test_outliers_are_as_many_as_asked_off_the_surface_and_within_range() -> None:
    p = Parameters(**FEW, scanner="profiler", outliers=0.05, appendages=False)
    cloud = simulate(p)
    stray = cloud.klass == 4
    assert stray.mean() == pytest.approx(0.05, abs=0.005)
    assert (np.abs(cloud.offset[stray]) > 0.02).mean() > 0.9
    assert np.all(cloud.leak[stray] == -1)
    distance = np.linalg.norm(cloud.xyz - sight(Simulation(p), cloud), axis=1)
    assert distance.min() > 1.0 - 1e-3
    assert distance.max() < p.max_range


@pytest.mark.parametrize("scanner", ["static", "profiler"])
def test_density_is_as_asked_and_even(scanner: Any) -> None:
    p = Parameters(length=100.0, scanner=scanner, density=100.0, appendages=False, niches=False, leaks=1)
    cloud = simulate(p)
    perimeter = 2.0 * Simulation(p).tunnel.section.half_perimeter
    assert len(cloud) / (100.0 * perimeter) == pytest.approx(100.0, rel=0.005)
    cells, _, _ = np.histogram2d(cloud.chainage, cloud.arc, bins=(20, 8), range=((0, 100), (-9, 9)))
    expected = 100.0 * 5.0 * 18.0 / 8.0
    assert np.abs(cells - expected).max() < 6.0 * np.sqrt(expected)


def test_profiles_are_apart_as_asked_and_a_helix() -> None:
    cloud = simulate(
        Parameters(
            length=10.0,
            radius=0.0,
            scanner="profiler",
            profile_spacing=0.1,
            profile_points=100,
            range_noise=0.0,
            outliers=0.0,
            leaks=0,
            appendages=False,
            niches=False,
            scanner_offset=0.0,
        )
    )
    assert len(cloud) == 100 * 100
    np.testing.assert_allclose(np.diff(cloud.chainage), 0.1 / 100, atol=1e-7)
    np.testing.assert_allclose(np.diff(cloud.time), 0.1 / 100, atol=1e-7)
