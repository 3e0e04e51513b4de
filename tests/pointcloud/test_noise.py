import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from tunneldb.pointcloud.noise import is_noise, noise_filter, search_radii
from tunneldb.pointcloud.voxels import CellCounts

pytestmark = pytest.mark.slow

ORIGIN = np.array([500_000.0, 4_500_000.0, 100.0])


def tube(density: float, length: float, seed: int, radius: float = 4.0) -> np.ndarray:
    """Points spread evenly over a circular tunnel."""
    rng = np.random.default_rng(seed)
    count = int(density * 2 * np.pi * radius * length)
    along, angle = rng.uniform(0, length, count), rng.uniform(-np.pi, np.pi, count)
    radial = radius + rng.normal(0, 0.002, count)
    return ORIGIN + np.column_stack([along, radial * np.sin(angle), radial * np.cos(angle)])


def profiles(spacing: float, step: float, length: float, radius: float = 4.0) -> np.ndarray:
    """Profiles far apart, with points close to each other along each."""
    angle = np.arange(-np.pi, np.pi, step / radius)
    along = np.arange(0.0, length, spacing)
    grid, turn = (a.ravel() for a in np.meshgrid(along, angle))
    return ORIGIN + np.column_stack([grid, radius * np.sin(turn), radius * np.cos(turn)])


def strays(count: int, length: float, seed: int) -> np.ndarray:
    """Points in mid-air, at least 1.5 m off the lining and far from each other."""
    rng = np.random.default_rng(seed)
    wanted = rng.uniform([0, -1.7, -1.7], [length, 1.7, 1.7], (count * 20, 3))
    chosen: list[np.ndarray] = []
    for point in wanted:
        if all(np.linalg.norm(point - other) > 0.6 for other in chosen):
            chosen.append(point)
        if len(chosen) == count:
            break
    return ORIGIN + np.array(chosen)


@pytest.mark.parametrize("edge", [0.02, 0.1, 0.5])
def test_agrees_with_a_search_tree(edge: float) -> None:
    rng = np.random.default_rng(1)
    xyz = ORIGIN + rng.uniform(-5, 5, (4000, 3)) * [2, 1, 0.3] * edge
    radius = rng.uniform(edge / 4, edge, len(xyz))
    expected = cKDTree(xyz).query_ball_point(xyz, radius, return_length=True) < 5
    assert 0 < expected.sum() < len(xyz)
    np.testing.assert_array_equal(is_noise(xyz, xyz, radius, 5), expected)


@given(st.integers(0, 10_000), st.integers(1, 300), st.sampled_from([0.05, 0.3, 2.0]), st.integers(1, 8))
@settings(max_examples=50, deadline=None)
def test_agrees_with_a_search_tree_in_any_cloud(seed: int, count: int, spread: float, points: int) -> None:
    rng = np.random.default_rng(seed)
    xyz = np.round(rng.normal(0, spread, (count, 3)), 2)
    expected = cKDTree(xyz).query_ball_point(xyz, 0.1, return_length=True) < points
    # Rounded coordinates put neighbours exactly on the radius, where the last bit decides: leave those clouds out.
    distance = np.linalg.norm(xyz[:, None] - xyz[None], axis=2)
    if not np.any(np.abs(distance - 0.1) < 1e-9):
        np.testing.assert_array_equal(is_noise(xyz, xyz, np.full(count, 0.1), points), expected)


def test_only_judged_points_are_noise_but_all_are_neighbours() -> None:
    xyz = np.array([[0.0, 0, 0], [0.01, 0, 0], [0.02, 0, 0], [5.0, 0, 0], [9.0, 0, 0]])
    np.testing.assert_array_equal(is_noise(xyz, xyz[[0, 3]], np.full(2, 0.05), 3), [False, True])


@pytest.mark.parametrize("judged", [1, 40, 4000])
def test_few_are_judged_as_all_are(judged: int) -> None:
    """Points left out because they are far from the few points to classify are not neighbours of these."""
    rng = np.random.default_rng(2)
    cloud = ORIGIN + rng.uniform(-2, 2, (20_000, 3)) * [1, 1, 0.1]
    radius = rng.uniform(0.02, 0.15, len(cloud))
    expected = cKDTree(cloud).query_ball_point(cloud, radius, return_length=True) < 5
    assert 0.1 < expected.mean() < 0.9
    chosen = rng.choice(len(cloud), judged, replace=False)
    np.testing.assert_array_equal(is_noise(cloud, cloud[chosen], radius[chosen], 5), expected[chosen])


def test_at_full_density_the_filter_is_the_papers() -> None:
    xyz = tube(20_000, 0.4, seed=2)
    xyz = np.concatenate([xyz, strays(10, 0.4, seed=3)])
    expected = cKDTree(xyz).query_ball_point(xyz, 0.025, return_length=True) < 5
    np.testing.assert_array_equal(noise_filter(xyz), expected)


@pytest.mark.parametrize(
    "wall",
    [
        tube(100, 30.0, seed=4),
        tube(1000, 30.0, seed=5),
        tube(20_000, 3.0, seed=6),
        profiles(0.5, 0.004, 30.0),
        profiles(0.5, 0.05, 30.0),
        profiles(1.0, 0.004, 30.0),
    ],
    ids=["100/m2", "1000/m2", "20000/m2", "profiles-4mm", "profiles-5cm", "profiles-1m-apart"],
)
def test_walls_survive_at_any_density_and_strays_go(wall: np.ndarray) -> None:
    length = float(np.ptp(wall[:, 0]))
    lone = strays(int(10 * length), length, seed=7)
    noise = noise_filter(np.concatenate([wall, lone]))
    assert noise[: len(wall)].mean() < 0.0005
    assert noise[len(wall) :].all()


def test_density_may_change_along_the_tunnel() -> None:
    sparse = tube(150, 20.0, seed=8)
    dense = tube(20_000, 2.0, seed=9) + np.array([60.0, 0, 0])
    lone = strays(20, 2.0, seed=10) + np.array([60.0, 0, 0])
    xyz = np.concatenate([sparse, dense, lone])
    cells = CellCounts()
    number = cells.add(xyz)
    stretch = np.floor(cells.centres[:, 0] / 5.0).astype(np.int64)
    radius = search_radii(cells.counts, cells.edge, stretch=stretch)[number]
    assert radius[len(sparse) :].max() < 0.05
    noise = is_noise(xyz, xyz, radius)
    assert noise[: len(sparse)].mean() < 0.0005
    assert noise[-len(lone) :].all()


def test_cells_are_counted_chunk_by_chunk() -> None:
    rng = np.random.default_rng(11)
    xyz = rng.uniform(-20, 20, (20_000, 3))
    cells = CellCounts(0.5)
    number = np.concatenate([cells.add(part) for part in np.array_split(xyz, 7)])
    where, inverse, counts = np.unique(np.floor(xyz / 0.5), axis=0, return_inverse=True, return_counts=True)
    assert len(cells.counts) == len(where)
    np.testing.assert_array_equal(cells.counts[number], counts[inverse.ravel()])
    np.testing.assert_allclose(cells.centres[number], (where[inverse.ravel()] + 0.5) * 0.5)


def test_no_points_no_noise() -> None:
    assert len(noise_filter(np.empty((0, 3)))) == 0
