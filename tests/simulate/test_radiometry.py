"""The simulator's intensity against the formulas of its sources."""

import math

import numpy as np
import pytest

from tunneldb.simulate import Cloud, Parameters, Simulation, simulate
from tunneldb.simulate.radiometry import counts, oren_nayar, range_term, reference_curve


def test_without_roughness_oren_nayar_is_lambert() -> None:
    theta = np.radians(np.linspace(0.0, 85.0, 18))
    np.testing.assert_allclose(oren_nayar(np.cos(theta), 0.0), 10.0 * np.log10(np.cos(theta)), atol=1e-12)


@pytest.mark.parametrize("degrees", [9.0, 20.0, 45.0])
def test_oren_nayar_is_equation_15(degrees: float) -> None:
    square = math.radians(degrees) ** 2
    for theta in (0.0, 0.3, 0.9, 1.4):
        value = math.cos(theta) * (
            1.0 - 0.5 * square / (square + 0.33) + 0.45 * square / (square + 0.09) * math.sin(theta) * math.tan(theta)
        )
        assert oren_nayar(np.cos([theta]), degrees)[0] == pytest.approx(10.0 * math.log10(value))


def test_range_term_peaks_near_ten_metres_and_ends_as_the_inverse_square() -> None:
    r = np.linspace(1.0, 40.0, 4000)
    assert r[range_term(r).argmax()] == pytest.approx(10.0, abs=0.5)
    # Xu et al. (2018), Fig. 3: steps of one metre lie between -0.40 and 0.62 dB from 4 to 35 m.
    steps = np.diff(range_term(np.arange(4.0, 36.0)))
    assert steps.min() > -0.40
    assert steps.max() < 0.62
    far = range_term(np.array([100.0, 200.0]))
    assert far[1] - far[0] == pytest.approx(-20.0 * math.log10(2.0), abs=1e-3)


def test_reference_curve_is_the_range_term_every_metre() -> None:
    curve = reference_curve(25.0, np.random.default_rng(1))
    np.testing.assert_allclose(np.diff(curve[:, 0]), 1.0)
    assert curve[0, 0] == 1.0
    assert curve[-1, 0] >= 25.0
    rest = curve[:, 1] - range_term(curve[:, 0])
    assert rest.std() < 0.05


def test_counts_are_linear_in_power_and_fit_sixteen_bits() -> None:
    amplitude = np.linspace(12.0, 30.0, 200)
    ratio = 10.0 * np.log10(counts(amplitude).astype(float)) - amplitude
    assert np.ptp(ratio) < 0.03
    assert counts(np.array([99.0]))[0] == 65535
    assert counts(np.array([-99.0]))[0] == 1


def scan(scanner: str, **values: float) -> tuple[Simulation, Cloud, np.ndarray]:
    """A small scan without noise, and the scanner's position at each point from the poses alone."""
    p = Parameters(
        length=40.0,
        straight=5.0,
        slope=4.0,
        scanner=scanner,  # type: ignore[arg-type]
        angular_step=0.8,
        profile_spacing=0.5,
        profile_points=200,
        range_noise=0.0,
        outliers=0.0,
        leaks=2,
        **values,  # type: ignore[arg-type]
    )
    simulation = Simulation(p)
    cloud = simulate(p)
    if scanner == "static":
        position = simulation.scanner.stations()[cloud.scan_id - 1]
    else:
        trajectory = simulation.scanner.trajectory()
        position = np.column_stack([np.interp(cloud.time, trajectory[:, 0], c) for c in trajectory[:, 1:].T])
    return simulation, cloud, position


@pytest.mark.parametrize("scanner", ["static", "profiler"])
def test_intensity_follows_from_poses_points_and_normals(scanner: str) -> None:
    simulation, cloud, position = scan(scanner, intensity_noise=0.0)
    dry = (cloud.klass == 0) & (cloud.leak < 0)
    ray = position[dry] - cloud.xyz[dry]
    distance = np.linalg.norm(ray, axis=1)
    np.testing.assert_allclose(distance, cloud.range[dry], atol=2e-4)
    cosine = np.sum(ray * simulation.tunnel.unroll(cloud.xyz[dry]).normal, axis=1) / distance
    np.testing.assert_allclose(np.cos(cloud.incidence[dry]), cosine, atol=1e-4)
    expected = range_term(distance) + oren_nayar(cosine, 12.0)
    rest = cloud.amplitude[dry] - expected
    soft = np.abs(rest - np.median(rest)) > 5e-3  # edges of leaks are half wet
    assert soft.mean() < 1e-3
    np.testing.assert_allclose(cloud.amplitude - range_term(cloud.range), cloud.reflectance + 54.5, atol=1e-4)


def test_noise_is_as_asked_and_leaks_are_darker_by_their_drop() -> None:
    simulation, cloud, _ = scan("profiler", intensity_noise=0.35)
    lining = cloud.klass == 0
    rest = cloud.reflectance - oren_nayar(np.cos(cloud.incidence), 12.0)
    dry = lining & (cloud.leak < 0)
    level = np.median(rest[dry])
    assert rest[dry].std() == pytest.approx(0.35, abs=0.02)
    quiet, still, _ = scan("profiler", intensity_noise=0.0)
    rest = still.reflectance - oren_nayar(np.cos(still.incidence), 12.0)
    assert {k for k in np.unique(still.leak) if k > 0} <= {k.id for k in quiet.leaks}
    for leak in quiet.leaks:
        inside = still.leak == leak.id
        if inside.any():
            assert level - rest[inside].min() == pytest.approx(leak.drop, abs=0.05)
    assert simulation.leaks == quiet.leaks
