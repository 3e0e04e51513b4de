"""The ground found in simulated tunnels against their truth, and in clouds that have none."""

from __future__ import annotations

import numpy as np
import pytest

from tunneldb.classification.ground.accuracy import Agreement
from tunneldb.classification.ground.extraction import MARGIN, GroundSettings, find_ground
from tunneldb.classification.ground.ransac import ransac_planes
from tunneldb.geometry.centreline import centreline_through
from tunneldb.geometry.plan_line import PlanLine
from tunneldb.pointcloud.voxels import Voxels
from tunneldb.simulate import Cloud, Parameters, rise, simulate

pytestmark = pytest.mark.slow

FLOOR, NICHE, RAIL = 1, 3, 5
SETTINGS = GroundSettings()
SCENE = {"length": 24.0, "straight": 6.0, "leaks": 1, "people": 3, "equipment": 2, "spheres": 2, "free_cables": 1}
PROFILER = {"scanner": "profiler", "profile_spacing": 0.05, "profile_points": 800}


def _axis(parameters: Parameters) -> PlanLine:
    """The tunnel's own axis, with a vertex every 5 m."""
    line = parameters.tunnel().line
    vertices = line.vertices(5.0)
    return PlanLine.of(vertices, line.start + 5.0 * np.arange(len(vertices)))


def _agreement(cloud: Cloud, line: PlanLine) -> Agreement:
    """Of ground found from voxels, as for a bare file, at all points; rails are no part of it."""
    voxels = Voxels(SETTINGS.voxel)
    voxels.add(cloud.xyz)
    ground = find_ground(voxels.centroids(), line, SETTINGS, 0, voxels.spread())
    assert ground is not None
    kept = cloud.klass != RAIL
    found = ground.is_ground(*line.place(cloud.xyz), cloud.xyz[:, 2])
    return Agreement.of(cloud.klass[kept] == FLOOR, found[kept])


@pytest.mark.parametrize(
    ("section", "radius", "slope", "ballast", "scanner"),
    [
        ("horseshoe", 300, 4.0, 0.03, PROFILER),
        ("circular", -300, 4.0, 0.0, PROFILER),
        ("circular", 300, 2.0, 0.03, PROFILER),
        ("box", 0, 0.0, 0.015, PROFILER),
        ("circular", 0, 2.0, 0.015, {"scanner": "static", "angular_step": 0.3}),
        ("box", 300, -4.0, 0.0, {"scanner": "static", "angular_step": 0.3}),
    ],
)
def test_errors_stay_below_half_a_percent(section, radius, slope, ballast, scanner):
    parameters = Parameters(
        section=section, radius=radius, slope=slope, ballast=ballast, sleepers=ballast > 0, **SCENE, **scanner
    )
    cloud = simulate(parameters)
    agreement = _agreement(cloud, centreline_through(cloud.xyz))
    assert agreement.total < 0.005
    assert agreement.kappa > 0.98


@pytest.mark.parametrize("extra", [{"walkway": 0.35}, {"carriageway": 0.25, "camber": 2.5}, {"walkway": 0.3, "camber": 4.0}])
@pytest.mark.parametrize("section", ["horseshoe", "box"])
def test_walkways_further_carriageways_and_camber_are_ground(section, extra):
    parameters = Parameters(section=section, radius=300, slope=3, length=24, straight=6, leaks=1, people=1, **PROFILER, **extra)
    cloud = simulate(parameters)
    agreement = _agreement(cloud, _axis(parameters))
    assert agreement.type_one < 0.005
    assert agreement.total < 0.005


def test_heights_are_those_of_the_floor():
    parameters = Parameters(section="box", radius=300, slope=4, camber=3, length=24, straight=6, leaks=1, **PROFILER)
    tunnel = parameters.tunnel()
    line = _axis(parameters)
    ground = find_ground(simulate(parameters).xyz, line, SETTINGS)
    assert ground is not None
    chainage, across = (g.ravel() for g in np.meshgrid(np.arange(1.0, 23.0), np.arange(-3.9, 3.95, 0.2)))
    frame = tunnel.line.frame(chainage)
    up = tunnel.section.floor + rise(parameters, tunnel.section, across)
    true = frame.position + across[:, None] * frame.u + up[:, None] * frame.w
    error = ground.height_at(*line.place(true)) - true[:, 2]
    clear_of_rails = np.abs(np.abs(across) - 0.75) > 0.15
    assert np.abs(error[clear_of_rails]).max() < 0.01
    assert np.sqrt(np.mean(error[clear_of_rails] ** 2)) < 0.002


@pytest.mark.parametrize(("section", "lean"), [("box", 0.0), ("circular", 2.8 / np.sqrt(4.0**2 - 2.8**2))])
def test_feet_and_leans_are_those_of_the_walls(section, lean):
    parameters = Parameters(section=section, radius=0, slope=2, length=24, leaks=1, niches=False, **PROFILER)
    ground = find_ground(simulate(parameters).xyz, _axis(parameters), SETTINGS)
    assert ground is not None
    half = parameters.tunnel().section.half_width
    inner = ground.foot[2:-2]
    assert np.abs(inner - [-half, half]).max() < 0.015
    assert np.abs(ground.lean[2:-2] - [-lean, lean]).max() < 0.06


def test_floor_of_a_niche_is_no_ground():
    parameters = Parameters(section="horseshoe", radius=0, length=24, leaks=1, **PROFILER)
    cloud = simulate(parameters)
    line = _axis(parameters)
    ground = find_ground(cloud.xyz, line, SETTINGS)
    assert ground is not None
    niche = cloud.xyz[cloud.klass == NICHE]
    assert len(niche) > 500
    assert ground.is_ground(*line.place(niche), niche[:, 2]).mean() < 0.002


def test_result_depends_on_the_seed_and_not_on_the_order_of_the_points():
    parameters = Parameters(section="horseshoe", radius=300, ballast=0.02, **SCENE, **PROFILER)
    xyz, line = simulate(parameters).xyz, _axis(parameters)
    one, two = (find_ground(points, line, SETTINGS, 3) for points in (xyz, xyz[np.random.default_rng(1).permutation(len(xyz))]))
    assert one is not None
    assert two is not None
    for name in ("height", "gamma", "foot", "lean"):
        np.testing.assert_allclose(getattr(one, name), getattr(two, name), atol=1e-6)


def test_two_stretches_agree_where_they_overlap():
    parameters = Parameters(section="circular", radius=0, length=110, density=60, leaks=1, scanner="profiler", ballast=0.01)
    cloud = simulate(parameters)
    line = _axis(parameters)
    along = line.place(cloud.xyz)[0]
    border = 55
    before = find_ground(cloud.xyz[along < border + MARGIN], line, SETTINGS)
    after = find_ground(cloud.xyz[along > border - MARGIN], line, SETTINGS)
    assert before is not None
    assert after is not None
    place = np.full(61, float(border)), np.linspace(-2.7, 2.7, 61)
    assert np.abs(before.height_at(*place) - after.height_at(*place)).max() < 1e-6
    rows = [g.rows(border, border + 1) for g in (before, after)]
    np.testing.assert_allclose(rows[0].gamma, rows[1].gamma, atol=1e-6)
    np.testing.assert_allclose(rows[0].foot, rows[1].foot, atol=1e-6)


@pytest.mark.parametrize("radius", [2.0, 4.0, 6.0])
def test_a_round_tunnel_has_no_ground(radius):
    rng = np.random.default_rng(6)
    angle, along = rng.uniform(0, 2 * np.pi, 200_000), rng.uniform(0, 25, 200_000)
    cloud = np.column_stack([along, radius * np.sin(angle), radius * np.cos(angle)]) + rng.normal(0, 0.003, (200_000, 3))
    assert find_ground(cloud, PlanLine.of([[0, 0], [25, 0]], [0, 25]), SETTINGS) is None


@pytest.mark.parametrize("points", [np.empty((0, 3)), np.zeros((1, 3)), np.ones((1000, 3)), np.full((9, 3), np.nan)])
def test_too_few_points_make_no_ground(points):
    assert find_ground(points, PlanLine.of([[0, 0], [5, 0]], [0, 5]), SETTINGS) is None


def test_a_wall_alone_has_no_ground_and_a_floor_alone_no_feet():
    rng = np.random.default_rng(7)
    line = PlanLine.of([[0, 0], [20, 0]], [0, 20])
    wall = rng.uniform(0, 1, (40_000, 3)) * [20, 0, 5] + rng.normal(0, 0.003, (40_000, 3))
    floor = rng.uniform(0, 1, (40_000, 3)) * [20, 5, 0] + rng.normal(0, 0.003, (40_000, 3))
    assert find_ground(wall, line, SETTINGS) is None
    ground = find_ground(floor, line, SETTINGS)
    assert ground is not None
    assert np.isnan(ground.foot).all()
    assert ground.is_ground(*line.place(floor), floor[:, 2]).mean() > 0.98


def test_floor_is_found_beside_a_parked_train_that_hides_it():
    """A box of 8 m by 6 m, 40 m long; from 10 to 30 m a train 3.2 m wide, seen from 0.3 to 4 m over the floor."""
    rng = np.random.default_rng(9)

    def sheet(origin: list[float], one: list[float], two: list[float]) -> np.ndarray:
        count = int(150 * np.linalg.norm(one) * np.linalg.norm(two))
        return np.array(origin) + rng.random((count, 1)) * one + rng.random((count, 1)) * two

    floor = sheet([0, -4, 0], [40, 0, 0], [0, 8, 0])
    floor = floor[~((np.abs(floor[:, 0] - 20) < 10) & (np.abs(floor[:, 1]) < 1.6))]
    other = [sheet([0, side, 0], [40, 0, 0], [0, 0, 6]) for side in (-4, 4)]
    other += [sheet([10, side, 0.3], [20, 0, 0], [0, 0, 3.7]) for side in (-1.6, 1.6)]
    other += [sheet([0, -4, 6], [40, 0, 0], [0, 8, 0]), sheet([10, -1.6, 4], [20, 0, 0], [0, 3.2, 0])]
    cloud = np.vstack([floor, *other]) + rng.normal(0, 0.003, (len(floor) + sum(map(len, other)), 3))
    cloud[:, 2] += 0.03 * cloud[:, 0]
    line = PlanLine.of([[0, 0], [40, 0]], [0, 40])
    ground = find_ground(cloud, line, SETTINGS)
    assert ground is not None
    found = ground.is_ground(*line.place(cloud), cloud[:, 2])
    assert Agreement.of(np.arange(len(cloud)) < len(floor), found).total < 0.002
    assert np.abs(ground.foot - [-4, 4]).max() < 0.01


@pytest.mark.parametrize("density", [10, 30])
def test_few_points_show_the_ground_too(density):
    parameters = Parameters(section="horseshoe", slope=2, radius=300, length=40, density=density, leaks=1, scanner="profiler")
    assert _agreement(simulate(parameters), _axis(parameters)).total < 0.005


def test_plane_of_many_points_stands_up_to_a_larger_one_that_is_steep():
    """A floor of 30 % beside a wall of 70 % of the points: only checked normals find it."""
    rng = np.random.default_rng(8)
    floor = np.column_stack([rng.uniform(-2, 2, 900), rng.uniform(-2, 2, 900), np.zeros(900)])
    floor[:, 2] = 0.04 * floor[:, 0] + 5.0
    slant = np.column_stack([rng.uniform(-2, 2, 2100), rng.uniform(2, 5, 2100), np.zeros(2100)])
    slant[:, 2] = 5.0 + (slant[:, 1] - 2.0)
    points = np.vstack([floor, slant]) + rng.normal(0, 0.005, (3000, 3))
    bounds, seed = np.array([[0, 3000]]), np.array([1])
    checked = ransac_planes(points, bounds, 0.05, 15.0, 0.3, seed)
    np.testing.assert_allclose(checked.coefficients[0], [5.0, 0.04, 0.0], atol=0.01)
    plain = ransac_planes(points, bounds, 0.05, 15.0, 0.3, seed, check=False)
    assert plain.coefficients[0, 2] == pytest.approx(1.0, abs=0.05)
