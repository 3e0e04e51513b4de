"""Range curve and roughness found on the lining, against the simulator's curve and against made-up linings."""

import numpy as np
import pytest

from tunneldb.errors import UserError
from tunneldb.radiometry.cells import IntensitySamples
from tunneldb.radiometry.dependence import Dependence, class_means
from tunneldb.radiometry.oren_nayar import incidence_db
from tunneldb.radiometry.range_curve import MAX_SIGMA_FOR_DETECTION, RangeCurve, estimate_range_curve
from tunneldb.radiometry.range_spline import RangeSpline, one_maximum
from tunneldb.radiometry.reference_curve import ReferenceCurve
from tunneldb.simulate import Parameters, simulate
from tunneldb.simulate.radiometry import range_term

pytestmark = pytest.mark.slow


def _inverse_square(range_m):
    return -20.0 * np.log10(range_m)


def _sight(true=range_term, **parameters):
    """Lining of a simulated tunnel, its leaks and all, as many points as survey density has; by this range curve."""
    cloud = simulate(Parameters(**{"length": 40.0, "angular_step": 0.5, "leaks": 5, **parameters}))
    near = np.flatnonzero((np.abs(cloud.offset) < 0.05) & ((cloud.klass == 0) | (cloud.klass == 2)))
    range_m = cloud.range[near].astype(float)
    level = cloud.amplitude[near] - range_term(range_m) + true(range_m)
    place = np.column_stack([cloud.chainage[near], cloud.arc[near]])
    return IntensitySamples(place, cloud.scan_id[near], range_m, np.cos(cloud.incidence[near].astype(float)), level)


def _errors(found, true):
    """Difference of the curves' shapes over the ranges present, dB, and the deviation that is claimed there."""
    at = np.linspace(found.nearest, found.farthest, 60)
    off = found.curve(at) - true(at)
    return off - off.mean(), np.interp(at, found.curve.range_m, found.sigma_db)


@pytest.mark.parametrize(
    ("seed", "section", "roughness", "true"),
    [(1, "circular", 12.0, range_term), (2, "horseshoe", 28.0, _inverse_square), (3, "box", 6.0, range_term)],
)
def test_curve_of_static_stations_is_within_a_third_of_a_decibel(seed, section, roughness, true):
    found = estimate_range_curve(_sight(true, seed=seed, section=section, roughness=roughness, station_spacing=10.0))
    found.require()
    off, sigma = _errors(found, true)
    assert np.abs(off).max() < 0.3
    assert np.mean(np.abs(off) < 3.0 * sigma) > 0.9
    assert found.roughness == pytest.approx(roughness, abs=2.0)


def _alone(samples):
    """Each cell as only the nearest scan saw it."""
    cell = np.unique(np.floor(samples.place / 0.5).astype(int) @ [1, 100_000], return_inverse=True)[1]
    order = np.lexsort((samples.range_m, cell))
    nearest = samples.scan[order[np.unique(cell[order], return_index=True)[1]]]
    return samples.some(samples.scan == nearest[cell])


def _darker(samples, drop):
    """Soot up to so many dB, by chainage and arc."""
    return IntensitySamples(
        samples.place, samples.scan, samples.range_m, samples.cosine, samples.level - drop(*samples.place.T)
    )


SOOT = {
    "none": lambda x, y: np.zeros_like(x),
    "constant": lambda x, y: 3.0 * np.exp(-((y / 2.0) ** 2)),
    "wide": lambda x, y: 3.0 * np.exp(-((y / 4.0) ** 2)),
    "slight": lambda x, y: np.exp(-((y / 2.0) ** 2)),
    "comes and goes": lambda x, y: 3.0 * np.exp(-((y / 2.0) ** 2)) * (1.0 + 0.5 * np.sin(x / 5.0)),
    "in clouds": lambda x, y: 2.0 * np.exp(-((y / 3.0) ** 2)) * (1.0 + 0.8 * np.sin(x / 1.5)),
    "moves": lambda x, y: 3.0 * np.exp(-(((y - np.sin(x / 6.0)) / 2.0) ** 2)),
}


@pytest.fixture(scope="module")
def profiled():
    """Lining as a profiler off the middle sees it, always from the same place in the section."""
    return _sight(scanner="profiler", profile_spacing=0.1, profile_points=500, seed=4)


@pytest.mark.parametrize("soot", SOOT)
def test_a_profilers_range_is_its_place_in_the_section_and_refused(profiled, soot):
    """It sees each strip along the tunnel from one distance: what soot does can't be told from range."""
    with pytest.raises(UserError, match="uncertain by"):
        estimate_range_curve(_darker(profiled, SOOT[soot])).require()


def test_a_profiler_that_moves_across_the_section_tells():
    """On a cart that goes to and fro by a metre, in a box: made up, so that soot around the section is exactly constant."""
    rng = np.random.default_rng(10)
    place = np.column_stack([rng.uniform(0, 200, 200_000), rng.uniform(-6, 6, 200_000)])
    away = 3.0 + 1.5 * np.sin(place[:, 0] / 1.5)
    range_m = np.hypot(away, place[:, 1])
    level = range_term(range_m) + incidence_db(away / range_m, 15.0) + rng.normal(0, 0.3, len(place))
    samples = IntensitySamples(place, np.zeros(len(place), int), range_m, away / range_m, level)
    found = estimate_range_curve(_darker(samples, SOOT["constant"]))
    found.require()
    assert found.overlapping == 0
    assert np.abs(_errors(found, range_term)[0]).max() < 0.2


@pytest.fixture(scope="module")
def lone():
    """Lining of which static stations see no cell twice."""
    return _alone(_sight(seed=11, station_spacing=13.0))


@pytest.mark.parametrize("soot", ["none", "constant", "comes and goes", "moves"])
def test_static_stations_that_see_no_cell_twice(lone, soot):
    """A strip is seen from near and far: constant soot cancels, and what changes along the tunnel is in the deviation."""
    found = estimate_range_curve(_darker(lone, SOOT[soot]))
    off, sigma = _errors(found, range_term)
    assert found.overlapping == 0
    assert np.mean(np.abs(off) < 3.0 * sigma) > 0.9
    if soot in ("none", "constant"):
        found.require()
        assert np.abs(off).max() < 0.2


@pytest.mark.parametrize("lining", ["cast", "segments"])
def test_rings_that_differ_are_in_the_deviation(lining):
    """Blocks and rings of reflectances of their own, seen by one station each."""
    found = estimate_range_curve(_alone(_sight(seed=12, lining=lining, station_spacing=13.0)))
    off, sigma = _errors(found, range_term)
    assert np.sqrt(np.mean((off / sigma) ** 2)) < 2.0


def test_a_centred_profiler_in_a_round_tunnel_is_refused():
    with pytest.raises(UserError, match=r"cannot be separated.*4\.00 to 4\.00 m.*scan a target"):
        estimate_range_curve(
            _sight(scanner="profiler", profile_spacing=0.1, profile_points=500, scanner_offset=0.0, scanner_height=2.8)
        )


def test_cells_of_any_reflectance_seen_by_several_scans():
    """Each cell has its own reflectance, up to 1 dB from the others'; seven scans see them across each other."""
    rng = np.random.default_rng(5)
    place = np.column_stack([rng.uniform(0, 60, 60_000), rng.uniform(-6, 6, 60_000)])
    scan = rng.integers(0, 7, len(place))
    wall = 3.0 + 0.5 * np.abs(place[:, 1])
    range_m = np.hypot(place[:, 0] - 10.0 * scan, wall)
    cosine = wall / range_m
    cell = np.floor(place / 0.5) @ [1, 1000]
    level = np.sin(cell * 12.9898) + range_term(range_m) + incidence_db(cosine, 15.0) + rng.normal(0, 0.3, len(place))
    found = estimate_range_curve(IntensitySamples(place, scan, range_m, cosine, level).some(cosine > np.cos(np.radians(75))))
    found.require()
    assert np.abs(_errors(found, range_term)[0]).max() < 0.3
    assert found.roughness == pytest.approx(15.0, abs=2.0)


def test_range_and_incidence_that_are_one_function_are_refused():
    """A wall 4 m off, seen along a line: R cos θ is the same everywhere."""
    rng = np.random.default_rng(6)
    place = np.column_stack([rng.uniform(0, 60, 40_000), rng.uniform(-6, 6, 40_000)])
    scan = rng.integers(0, 4, len(place))
    range_m = np.hypot(place[:, 0] - 20.0 * scan, 4.0)
    level = range_term(range_m) + incidence_db(4.0 / range_m, 15.0) + rng.normal(0, 0.3, len(place))
    with pytest.raises(UserError, match=r"uncertain by .* dB at .*scan a target"):
        estimate_range_curve(IntensitySamples(place, scan, range_m, 4.0 / range_m, level)).require()


@pytest.mark.parametrize(("uncertain", "remarked", "refused"), [(0.29, False, False), (0.89, True, False), (3.1, True, True)])
def test_an_uncertain_curve_is_remarked_and_a_useless_one_refused(uncertain, remarked, refused):
    nodes = np.geomspace(2.0, 15.0, 30)
    sigma = np.where(np.arange(30) == 20, uncertain, 0.05)
    found = RangeCurve(ReferenceCurve(nodes, -20.0 * np.log10(nodes)), sigma, 12.0, 1.0, 2.0, 15.0, 900, 500, 0.2, 0.4)
    assert bool(found.remark) == remarked
    if remarked:
        assert f"uncertain by {uncertain:.2f} dB at {nodes[20]:.1f} m" in found.remark
    if refused:
        with pytest.raises(UserError, match=r"cannot be separated.*scan a target"):
            found.require(MAX_SIGMA_FOR_DETECTION)
    else:
        found.require(MAX_SIGMA_FOR_DETECTION)


def test_too_little_lining_is_refused():
    samples = _sight()
    with pytest.raises(UserError, match="needs at least 200"):
        estimate_range_curve(samples.some(samples.place[:, 0] < 2.0))


def test_a_curve_goes_on_beyond_what_it_was_found_on():
    samples = _sight(_inverse_square, seed=6)
    found = estimate_range_curve(samples, reach=(1.0, 40.0))
    assert found.curve.range_m[0] < 1.0
    assert found.curve.range_m[-1] > 40.0
    # The inverse square is a straight line over ln R.
    drop = found.curve(np.array([found.farthest]))[0] - found.curve(np.array([2.0 * found.farthest]))[0]
    assert drop == pytest.approx(20.0 * np.log10(2.0), abs=1.0)


def test_splines_add_up_to_one_and_are_straight_outside():
    spline = RangeSpline.over(2.0, 20.0)
    np.testing.assert_allclose(spline(np.geomspace(0.5, 60.0, 50)).sum(axis=1), 1.0, atol=1e-9)
    outside = spline(np.exp(np.array([3.5, 3.7, 3.9])))
    np.testing.assert_allclose(outside[2] - outside[1], outside[1] - outside[0], atol=1e-9)


def test_one_maximum_is_the_least_loss_of_that_shape():
    rng = np.random.default_rng(7)
    root = rng.normal(size=(20, 6))
    target = rng.normal(size=20)
    b = one_maximum(root.T @ root, root.T @ target)
    steps = np.sign(np.round(np.diff(b), 9))
    assert np.all(np.diff(steps[steps != 0]) <= 0)
    loss = np.sum((root @ b - target) ** 2)
    for _ in range(300):
        other = np.sort(rng.normal(size=6))
        top = rng.integers(0, 6)
        other[top:] = other[top:][::-1]
        if np.sum(np.diff(np.sign(np.diff(other))) > 0) == 0:
            assert loss <= np.sum((root @ other - target) ** 2) + 1e-9


def test_course_of_a_straight_line():
    rng = np.random.default_rng(8)
    at = rng.uniform(2.0, 12.0, 50_000)
    seen = class_means(at, 3.0 - 0.5 * at + rng.normal(0, 0.1, len(at)))
    assert seen.slope == pytest.approx(-0.5, abs=0.005)
    assert seen.spread == pytest.approx(0.5 * 10.0 / np.sqrt(12.0), rel=0.02)
    assert len(class_means(at[:5], at[:5]).at) == 0


def test_verdict_says_what_is_left():
    rng = np.random.default_rng(9)
    range_m, angle = rng.uniform(2, 12, 20_000), rng.uniform(0, 70, 20_000)
    noise = rng.normal(0, 0.2, 20_000)
    assert "neither" in Dependence.of(range_m, angle, noise, noise).verdict()
    # 0.35 dB of range beside a scatter of 1.5 dB
    slope = 0.35 / np.std(range_m)
    small = Dependence.of(range_m, angle, noise, 7.5 * noise + slope * range_m).verdict()
    assert small.startswith("Sufficient for detection")
    assert "range (medians differ by 0.3" in small
    left = Dependence.of(range_m, angle, noise, noise - 0.2 * range_m).verdict()
    assert "still depends on range" in left
    assert "incidence" not in left
