"""What the simulator's scanner adds of its own: gains, saturation, noise by range, mirror images."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.lining_scans import BARE, whole_scan

from tunneldb.simulate import Parameters, Simulation, simulate
from tunneldb.simulate.radiometry import SYSTEM_CONSTANT, range_term

pytestmark = pytest.mark.slow


def gains(**values: Any) -> tuple[np.ndarray, np.ndarray]:
    """Time of points and what their amplitude differs by from a scan by a perfect instrument, dB."""
    _, cloud = whole_scan(**values)
    own = {"banding", "drift", "gain_step", "saturation"}
    _, perfect = whole_scan(**{k: v for k, v in values.items() if k not in own})
    np.testing.assert_array_equal(cloud.xyz, perfect.xyz)
    np.testing.assert_allclose(cloud.reflectance + SYSTEM_CONSTANT + range_term(cloud.range), cloud.amplitude, atol=1e-4)
    return cloud.time, cloud.amplitude.astype(float) - perfect.amplitude


@pytest.mark.parametrize("scanner", ["profiler", "static"])
def test_banding_is_one_gain_a_line(scanner: str) -> None:
    time, gain = gains(banding=0.4, scanner=scanner, angular_step=0.8)
    p = Parameters(**{**BARE, "scanner": scanner, "angular_step": 0.8})
    turn = p.profile_spacing / p.speed if scanner == "profiler" else 0.8 * 300.0 / round(360.0 / 0.8)
    start = np.zeros(len(time)) if scanner == "profiler" else 300.0 * np.floor((time - 300_000.0) / 300.0)
    line = np.floor((time - 300_000.0 - start) / turn + 1e-6) + 10.0 * start  # stations are 300 s apart
    lines, number = np.unique(line, return_inverse=True)
    mean = np.bincount(number, gain) / np.bincount(number)
    assert np.abs(gain - mean[number]).max() < 1e-4
    assert len(lines) > 600
    assert mean.std() == pytest.approx(0.4, rel=0.1)
    assert abs(np.corrcoef(mean[:-1], mean[1:])[0, 1]) < 0.15  # neighbours have nothing to do with each other


def test_drift_is_slow_and_a_step_is_at_once() -> None:
    time, gain = gains(drift=0.5, length=300.0, profile_spacing=0.5)
    order = np.argsort(time)
    assert 0.2 < gain.std() < 0.9
    assert np.abs(np.diff(gain[order])).max() < 0.1  # within half a second
    time, gain = gains(gain_step=1.5)
    np.testing.assert_allclose(np.unique(np.round(gain, 3)), [0.0, 1.5], atol=1e-3)
    after = gain > 0.75
    assert time[~after].max() < time[after].min()
    assert 0.3 < after.mean() < 0.7


def test_a_saturated_receiver_gives_its_greatest_amplitude() -> None:
    _, cloud = whole_scan(range_curve="inverse_square", saturation=36.0)
    _, free = whole_scan(range_curve="inverse_square")
    assert cloud.amplitude.max() == 36.0
    np.testing.assert_allclose(cloud.amplitude, np.minimum(free.amplitude, 36.0), atol=1e-5)
    near = cloud.range < 2.5
    assert (cloud.amplitude[near & (cloud.incidence < 0.3)] == 36.0).all()
    assert (cloud.amplitude < 36.0).any()


def test_noise_grows_with_the_square_of_the_range() -> None:
    values: dict[str, Any] = {"scanner": "static", "angular_step": 0.4, "station_spacing": 30.0}
    _, still = whole_scan(**values)
    _, noisy = whole_scan(**values, intensity_noise=0.2, noise_growth=1.0)
    rest = noisy.reflectance - still.reflectance
    for low, high in ((2.0, 3.0), (6.0, 7.0), (10.0, 12.0)):
        here = (still.range > low) & (still.range < high)
        assert here.sum() > 500
        assert rest[here].std() == pytest.approx(0.2 * (1.0 + (0.5 * (low + high) / 10.0) ** 2), rel=0.1)
    _, moved = whole_scan(**values, range_noise=0.002, noise_growth=1.0)
    square = moved.offset[(moved.klass == 0) & (moved.incidence < 0.3)].astype(float) ** 2
    distance = moved.range[(moved.klass == 0) & (moved.incidence < 0.3)].astype(float)
    expected = (0.002 * (1.0 + (distance / 10.0) ** 2)) ** 2
    assert square.mean() == pytest.approx(expected.mean(), rel=0.1)


def test_ghosts_are_mirror_images_below_the_floor() -> None:
    p = Parameters(**{**BARE, "ghosts": 0.1, "radius": 0.0, "straight": None, "section": "box"})
    simulation, cloud = Simulation(p), simulate(p)
    ghosts = cloud.klass == 4
    floors = cloud.klass == 1
    assert ghosts.sum() / (ghosts.sum() + floors.sum()) == pytest.approx(0.1, abs=0.02)
    line = simulation.tunnel.line
    floor = line.origin[2] + simulation.tunnel.section.floor  # level and straight
    assert cloud.xyz[ghosts, 2].max() < floor + 1e-3
    mirrored = cloud.xyz[ghosts] * [1.0, 1.0, -1.0] + [0.0, 0.0, 2.0 * floor]
    place = simulation.tunnel.unroll(mirrored)
    assert np.abs(place.offset).max() < 1e-4  # on the walls and the crown
    assert (cloud.leak[ghosts] == -1).all()
