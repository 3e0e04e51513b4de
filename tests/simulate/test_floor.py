"""Floors of the simulator that are not flat: ballast, camber, walkway, kerb, second carriageway, sleepers, rails."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree

from tunneldb.simulate import Cloud, Parameters, Simulation, rise, simulate

pytestmark = pytest.mark.slow

FEW: dict[str, Any] = {
    "length": 20.0,
    "straight": 3.0,
    "leaks": 1,
    "range_noise": 0.0,
    "outliers": 0.0,
    "angular_step": 0.4,
    "profile_spacing": 0.03,
    "profile_points": 900,
}
LINING, FLOOR, RAIL = 0, 1, 5


def across_and_height(simulation: Simulation, cloud: Cloud) -> tuple[np.ndarray, np.ndarray]:
    """Right of the axis and over the section's floor, m."""
    frame = simulation.tunnel.line.frame(cloud.chainage)
    d = cloud.xyz - frame.position
    return np.sum(d * frame.u, axis=1), np.sum(d * frame.w, axis=1) - simulation.tunnel.section.floor


def floor(**values: Any) -> tuple[Simulation, np.ndarray, np.ndarray, Cloud]:
    p = Parameters(**{**FEW, "appendages": False, "niches": False, **values})
    simulation, cloud = Simulation(p), simulate(p)
    return simulation, *across_and_height(simulation, cloud), cloud


@pytest.mark.parametrize("sigma", [0.005, 0.02])
@pytest.mark.parametrize("seed", [1, 2])
def test_ballast_is_as_rough_as_asked_and_level(sigma: float, seed: int) -> None:
    """Seen from straight above, where no stone hides another."""
    _, u, h, cloud = floor(scanner="profiler", ballast=sigma, seed=seed, slope=4.0)
    below = (cloud.klass == FLOOR) & (np.abs(u - 0.3) < 0.4)
    assert below.sum() > 5000
    assert h[below].std() == pytest.approx(sigma, rel=0.05)
    assert abs(h[below].mean()) < 0.06 * sigma
    assert np.abs(h[below]).max() < 2.5 * sigma


def test_stones_are_three_to_six_centimetres() -> None:
    """Heights agree within a stone and have nothing in common a stone further."""
    _, u, h, cloud = floor(scanner="profiler", ballast=0.02, density=3000.0, length=10.0)
    below = (cloud.klass == FLOOR) & (np.abs(u - 0.3) < 0.5)
    xy, h = cloud.xyz[below, :2], h[below]
    tree = cKDTree(xy)
    correlation = []
    for lag in (0.005, 0.12):
        _, other = tree.query(xy + np.array([lag, 0.0]), distance_upper_bound=0.004)
        found = other < len(h)
        correlation.append(np.corrcoef(h[found], h[other[found]])[0, 1])
    assert correlation[0] > 0.7
    assert abs(correlation[1]) < 0.1


def test_both_scanners_meet_the_same_stones() -> None:
    values: dict[str, Any] = {"ballast": 0.02, "length": 10.0, "section": "box"}
    _, _, h1, one = floor(scanner="profiler", density=1500.0, **values)
    _, _, h2, other = floor(scanner="static", density=1500.0, **values)
    a, b = one.klass == FLOOR, other.klass == FLOOR
    apart, index = cKDTree(one.xyz[a, :2]).query(other.xyz[b, :2])
    near = apart < 0.001
    assert near.sum() > 300
    same = np.median(np.abs(h1[a][index[near]] - h2[b][near]))
    other_places = np.median(np.abs(np.roll(h1[a][index[near]], 7) - h2[b][near]))
    assert same < 0.002
    assert other_places > 3.0 * same


def test_no_ray_goes_through_a_stone() -> None:
    """Each stone hides what is behind it: along rays to the ballast all other points of it stay below."""
    simulation, u, h, cloud = floor(scanner="static", ballast=0.02, length=10.0, angular_step=0.25)
    stone = np.flatnonzero((cloud.klass == FLOOR) & (np.abs(u) < 2.5))
    observer = simulation.scanner.stations()[0]
    rng = np.random.default_rng(3)
    chosen = rng.choice(stone, 4000)
    back = cloud.xyz[chosen] - observer
    back /= np.linalg.norm(back, axis=1)[:, None]
    tree = cKDTree(cloud.xyz[stone, :2])
    for before in (0.03, 0.06, 0.12):
        at = cloud.xyz[chosen] - before * back
        apart, index = tree.query(at[:, :2])
        near = apart < 0.001
        above = at[near, 2] - cloud.xyz[stone[index[near]], 2]
        assert near.sum() > 50
        assert above.min() > -0.005
    assert np.abs(h[stone]).max() < 0.06


@pytest.mark.parametrize("scanner", ["static", "profiler"])
@pytest.mark.parametrize("section", ["circular", "horseshoe", "box"])
def test_camber_walkway_kerb_and_carriageway_are_the_closed_formula(scanner: str, section: str) -> None:
    simulation, u, h, cloud = floor(
        scanner=scanner, section=section, camber=2.0, walkway=0.3, carriageway=0.2, slope=4.0, radius=100.0
    )
    p = simulation.parameters
    truth = rise(p, simulation.tunnel.section, u)
    jump = np.ptp([rise(p, simulation.tunnel.section, u + d) for d in (-0.002, 0.002)], axis=0) > 0.01
    on = (cloud.klass == FLOOR) & ~jump
    # A ray that creeps along a riser within millimetres may slip into it.
    assert np.mean(np.abs(h[on] - truth[on]) > 5e-4) < 5e-5
    assert {0.3, 0.2, 0.5} <= {round(float(x), 2) for x in truth[on]}
    assert jump[cloud.klass == FLOOR].any()  # risers
    assert h[cloud.klass == LINING].min() > -1e-3


def test_the_lining_goes_down_to_the_ballast() -> None:
    _, u, h, cloud = floor(scanner="profiler", section="box", ballast=0.02)
    lining = cloud.klass == LINING
    assert -0.05 < h[lining].min() < 0.0
    assert np.abs(cloud.offset[lining & (h > 0.0)]).max() < 1e-4
    assert np.abs(u[cloud.klass == FLOOR]).max() < 4.0 + 1e-4


def test_sleepers_lie_in_the_ballast_under_the_rails() -> None:
    simulation, u, h, cloud = floor(scanner="profiler", ballast=0.005, sleepers=True, appendages=True)
    ground = (cloud.klass == FLOOR) & (np.abs(u) < 0.6)
    phase = np.mod(cloud.chainage - simulation.tunnel.line.start, 0.6)
    ground &= cloud.chainage < 19.8  # there is no room for another sleeper
    on = ground & (np.abs(phase - 0.3) < 0.12)
    between = ground & (np.abs(phase - 0.3) > 0.14)
    np.testing.assert_allclose(h[on], 0.04, atol=5e-4)
    assert h[between].mean() == pytest.approx(0.0, abs=0.001)
    assert np.all(cloud.thing == 0)
    rail = cloud.klass == RAIL
    assert rail.sum() > 500
    assert np.abs(np.abs(u[rail]) - 0.75).max() < 0.04
    assert h[rail].max() == pytest.approx(0.17, abs=1e-3)


def test_ballast_darkens_and_lightens_by_its_slopes_and_is_seen_further() -> None:
    """Beyond the greatest incidence on a flat floor, stones still show their faces."""
    far = []
    for sigma in (0.0, 0.02):
        simulation, _, _, cloud = floor(scanner="static", ballast=sigma, length=50.0, station_spacing=60.0)
        ground = cloud.klass == FLOOR
        assert np.all(np.cos(cloud.incidence[ground]) >= 0.087 - 1e-6)
        plan = cloud.xyz[ground] - simulation.scanner.stations()[0]
        far.append(np.hypot(plan[:, 0], plan[:, 1]).max())
    assert far[0] == pytest.approx(1.7 / 0.087, rel=0.02)
    assert far[1] > far[0] + 2.0
