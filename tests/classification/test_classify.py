"""Classes of a scene against the simulator's truth, and clusters and their cells by themselves."""

import numpy as np
import pytest
from support.simulated_scenes import exact, scan, share

from tunneldb.classification.classes import PointClass
from tunneldb.classification.classify import find_bare_scene, find_scene
from tunneldb.classification.ground.extraction import GroundSettings, find_ground
from tunneldb.classification.objects.clusters import CELL, MAX_CELL_DISTANCE, Cluster, Lookup, look_up, pieces
from tunneldb.classification.objects.objects import ClusterSettings, bars
from tunneldb.classification.objects.spacing import Spacing
from tunneldb.classification.scene import Scene
from tunneldb.compiled import kernel
from tunneldb.geometry.centreline import centreline_through
from tunneldb.geometry.plan_line import PlanLine
from tunneldb.pointcloud.thinning import thin, voxel_edge
from tunneldb.pointcloud.voxels import Voxels
from tunneldb.simulate.parameters import Parameters
from tunneldb.stages.parameters import settings

pytestmark = pytest.mark.slow

THINGS = {
    "people": 3, "equipment": 4, "bollards": 1, "globes": 2, "spheres": 4, "free_cables": 1, "ballast": 0.01,
    "sleepers": True, "catenary": True, "leaks": 1,
}  # fmt: skip


@pytest.fixture(scope="module", params=["horseshoe", "circular", "box"])
def survey(request):
    parameters = Parameters(
        length=30,
        section=request.param,
        seed=5,
        slope=3,
        scanner="profiler",
        profile_spacing=0.04,
        profile_points=1000,
        **THINGS,
    )
    return scan(parameters)


def test_a_survey_is_classed_as_the_truth(survey) -> None:
    simulation, cloud, truth = survey
    surface, line = exact(simulation)
    points = cloud.xyz[thin(cloud.xyz, voxel_edge(100.0))]
    ground = find_ground(points, line, GroundSettings())
    found = find_scene(points, line, surface, ground)
    centres = np.array([[*sphere.centre, sphere.radius] for sphere in simulation.spheres])
    scene = Scene(line, ground, found.clusters, surface, found.relief, centres)
    classes = scene.classes(cloud.xyz)
    seen = truth != PointClass.NOISE
    assert (classes == truth)[seen].mean() > 0.98
    for klass, least, own in (
        (PointClass.GROUND, 0.99, 0.95), (PointClass.LINING, 0.99, 0.99), (PointClass.NICHE, 0.9, 0.9),
        (PointClass.APPENDAGE, 0.97, 0.9),
        (PointClass.OBJECT, 0.85, 0.85), (PointClass.SPHERE, 0.99, 0.9), (PointClass.RAIL, 0.3, 0.9),
    ):  # fmt: skip
        recall, precision = share(truth[seen], classes[seen], klass)
        assert recall > least, (klass.name, recall)
        assert precision > own, (klass.name, precision)


def test_a_bare_cloud_is_classed_as_the_truth(survey) -> None:
    _, cloud, truth = survey
    voxels = Voxels(0.1)
    voxels.add(cloud.xyz)
    points = voxels.centroids()
    line = centreline_through(points)
    ground = find_ground(points, line, GroundSettings(), spread=voxels.spread())
    scene = find_bare_scene(points, line, ground)
    assert scene.relief is not None
    classes = scene.classes(cloud.xyz)
    seen = (truth != PointClass.NOISE) & (truth != PointClass.SPHERE)
    assert (classes == truth)[seen].mean() > 0.97
    for klass, least, own in (
        (PointClass.LINING, 0.97, 0.99),
        (PointClass.APPENDAGE, 0.95, 0.85),
        (PointClass.OBJECT, 0.85, 0.8),
    ):
        recall, precision = share(truth[seen], classes[seen], klass)
        assert recall > least, (klass.name, recall)
        assert precision > own, (klass.name, precision)


def test_a_field_with_a_wall_has_no_lining() -> None:
    rng = np.random.default_rng(1)
    meadow = np.column_stack([rng.uniform(0, 60, 40_000), rng.uniform(-20, 20, 40_000), 0.01 * rng.standard_normal(40_000)])
    wall = np.column_stack([rng.uniform(10, 50, 20_000), np.full(20_000, 8.0), rng.uniform(0, 6, 20_000)])
    tree = rng.normal([30, -8, 4], 1.0, (3000, 3))
    points = np.concatenate([meadow, wall, tree])
    line = centreline_through(points)
    scene = find_bare_scene(points, line, find_ground(points, line, GroundSettings()))
    assert scene.relief is None
    assert not np.isin(scene.classes(points), (PointClass.LINING, PointClass.NICHE)).any()


@pytest.mark.parametrize("points", [np.empty((0, 3)), np.ones((1, 3)), np.ones((50, 3))])
def test_hardly_any_points_are_no_tunnel(points: np.ndarray) -> None:
    line = PlanLine.of([[0.0, 0.0], [1.0, 0.0]], [0.0, 1.0])
    scene = find_bare_scene(points, line, None)
    assert scene.relief is None
    assert len(scene.classes(points)) == len(points)
    assert not np.isin(scene.classes(points), (PointClass.LINING, PointClass.NICHE, PointClass.GROUND)).any()


def test_classes_do_not_depend_on_how_points_are_cut(survey) -> None:
    simulation, cloud, _ = survey
    surface, line = exact(simulation)
    points = cloud.xyz[::20]
    scene = find_scene(points, line, surface, find_ground(points, line, GroundSettings()))
    whole = scene.classes(points)
    parts = np.concatenate([scene.classes(part) for part in np.array_split(points, 7)])
    assert (whole == parts).all()


def test_defaults_are_those_of_the_parameters() -> None:
    assert ClusterSettings() == ClusterSettings.of(settings([]))
    assert GroundSettings() == GroundSettings.of(settings([]))


@kernel
def classes_of(x, first, last, keys, klass):
    return look_up(x, 0.05, 0.05, first, last, keys, klass)


def test_a_point_finds_the_nearest_cluster() -> None:
    near = Cluster.of(PointClass.OBJECT, np.array([[0.05, 0.05, 0.05]]), np.zeros(1), np.zeros(1))
    far = Cluster.of(PointClass.APPENDAGE, np.array([[0.35, 0.05, 0.05]]), np.zeros(1), np.zeros(1))
    for order in ([near, far], [far, near]):
        lookup = Lookup.of(order)
        x = (np.arange(-6, 10) + 0.5) * CELL
        found = [classes_of(at, lookup.first, lookup.last, lookup.keys, lookup.klass) for at in x]
        cells = np.floor(x / CELL).astype(int)
        expected = [
            PointClass.OBJECT
            if abs(c) <= min(MAX_CELL_DISTANCE, abs(c - 3))
            else PointClass.APPENDAGE
            if abs(c - 3) <= MAX_CELL_DISTANCE
            else 0
            for c in cells
        ]
        assert found == expected


def test_long_clusters_are_cut_at_whole_tens_of_metres() -> None:
    along = np.linspace(983.0, 1023.5, 500)
    xyz = np.column_stack([along + 4e5, np.zeros(500), np.ones(500)])
    parts = pieces(PointClass.APPENDAGE, xyz, along, np.full(500, 1.0))
    assert [np.floor(part.along_from / 10) for part in parts] == [98, 99, 100, 101, 102]
    assert all(np.floor(part.along_to / 10) == np.floor(part.along_from / 10) for part in parts)
    assert sum(part.points for part in parts) == 500
    short = pieces(PointClass.OBJECT, xyz[along < 992], along[along < 992], np.full(500, np.nan)[along < 992])
    assert len(short) == 1
    assert short[0].height_from is None


def test_hull_holds_the_cells() -> None:
    one = Cluster.of(PointClass.OBJECT, np.array([[5e5 + 0.02, 4.7e6 + 0.03, 7.0]]), np.zeros(1), np.zeros(1))
    x, y = one.hull.T
    area = 0.5 * float(np.sum((x - x[0]) * np.roll(y - y[0], -1) - np.roll(x - x[0], -1) * (y - y[0])))
    assert area == pytest.approx(CELL**2, rel=1e-3)


def test_rails_are_bars_and_boxes_are_not() -> None:
    rng = np.random.default_rng(0)
    rail = np.column_stack([rng.uniform(0, 30, 3000), 0.72 + rng.uniform(-0.035, 0.035, 3000), rng.uniform(0.05, 0.17, 3000)])
    box = np.column_stack([rng.uniform(5, 6, 500), rng.uniform(-2, -1, 500), rng.uniform(0.05, 0.3, 500)])
    ridge = np.column_stack([rng.uniform(0, 30, 6000), rng.uniform(-4, -3, 6000), rng.uniform(0.05, 0.3, 6000)])
    person = np.column_stack([rng.uniform(10, 10.3, 300), rng.uniform(0.6, 0.9, 300), rng.uniform(0.2, 1.7, 300)])
    points = np.concatenate([rail, box, ridge, person])
    found = bars(*points.T)
    assert found[:3000].mean() > 0.97
    assert not found[3000:9500].any()
    assert found[9500:].mean() < 0.05


def test_spacing_of_profiles_and_of_even_points() -> None:
    rng = np.random.default_rng(0)
    profiles, within = np.meshgrid(np.arange(40) * 0.5, np.arange(200) * 0.05)
    apart = Spacing.of(np.column_stack([profiles.ravel(), within.ravel()]))
    assert apart is not None
    assert (apart.along, apart.across) == (pytest.approx(0.5, rel=0.06), pytest.approx(0.05, rel=0.06))
    even = Spacing.of(rng.uniform(0, 20, (40_000, 2)))
    assert even is not None
    assert even.shrink > 0.85
    assert Spacing.of(np.ones((5, 2))) is None
