"""DBSCAN against the definition, and against scikit-learn where it is installed."""

import numpy as np
import pytest

from tunneldb.classification.objects.dbscan import dbscan


def cloud(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    blobs = [rng.normal(rng.uniform(0, 8, 3), rng.uniform(0.1, 0.5), (rng.integers(10, 300), 3)) for _ in range(7)]
    return np.concatenate([*blobs, rng.uniform(0, 8, (150, 3))]) + np.array([5e5, 4.7e6, 600.0])


def by_definition(points: np.ndarray, radius: float, least: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Distances, core points and the component of each core point."""
    distance = np.linalg.norm(points[:, None] - points[None], axis=-1)
    core = (distance <= radius).sum(axis=1) >= least
    component = np.where(core, np.arange(len(points)), -1)
    for _ in range(len(points)):
        near = (distance <= radius) & core[None, :] & core[:, None]
        lowest = np.where(near, component[None, :], len(points)).min(axis=1)
        if (new := np.where(core, lowest, -1)).tolist() == component.tolist():
            break
        component = new
    return distance, core, component


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("radius", "least"), [(0.3, 5), (0.12, 3), (0.8, 20)])
def test_clusters_are_those_of_the_definition(seed: int, radius: float, least: int) -> None:
    points = cloud(seed)[::2]
    labels = dbscan(points, radius, least)
    distance, core, component = by_definition(points, radius, least)
    pairs = set(zip(labels[core].tolist(), component[core].tolist(), strict=True))
    assert core.any()
    assert len(pairs) == len({label for label, _ in pairs}) == len({part for _, part in pairs})
    to_core = np.where(core[None, :], distance, np.inf)
    assert ((labels >= 0) == (to_core.min(axis=1) <= radius)).all()
    edge = ~core & (labels >= 0)
    assert (labels[edge] == labels[to_core.argmin(axis=1)][edge]).all()


def test_agrees_with_scikit_learn() -> None:
    cluster = pytest.importorskip("sklearn.cluster")
    points = cloud(11)
    labels = dbscan(points, 0.25, 6)
    theirs = cluster.DBSCAN(eps=0.25, min_samples=6).fit(points - points.mean(axis=0))
    core = theirs.core_sample_indices_
    pairs = set(zip(labels[core].tolist(), theirs.labels_[core].tolist(), strict=True))
    assert len(pairs) == theirs.labels_.max() + 1 == labels.max() + 1
    assert ((labels < 0) == (theirs.labels_ < 0)).all()


def test_labels_do_not_depend_on_the_order_of_points() -> None:
    points = cloud(3)
    labels = dbscan(points, 0.3, 5)
    order = np.random.default_rng(0).permutation(len(points))
    shuffled = np.empty_like(labels)
    shuffled[order] = dbscan(points[order], 0.3, 5)
    pairs = set(zip(labels.tolist(), shuffled.tolist(), strict=True))
    assert len(pairs) == len(set(labels.tolist()))
    assert ((labels < 0) == (shuffled < 0)).all()


def test_first_points_number_the_clusters() -> None:
    points = np.array([[5.0, 0, 0], [0.0, 0, 0], [5.1, 0, 0], [0.1, 0, 0], [9.0, 0, 0]])
    assert dbscan(points, 0.2, 2).tolist() == [0, 1, 0, 1, -1]


def test_radius_counts_as_near() -> None:
    points = np.array([[0.0, 0, 0], [0.25, 0, 0], [0.5, 0, 0]])
    assert dbscan(points, 0.25, 3).tolist() == [0, 0, 0]
    assert dbscan(points, 0.2499, 2).tolist() == [-1, -1, -1]


def test_many_points_in_one_place() -> None:
    assert dbscan(np.ones((1000, 3)), 0.1, 5).tolist() == [0] * 1000
    assert dbscan(np.empty((0, 3)), 0.1, 5).tolist() == []


@pytest.mark.parametrize(("radius", "least"), [(0.0, 5), (-1.0, 5), (float("nan"), 5), (0.1, 0)])
def test_bounds(radius: float, least: int) -> None:
    with pytest.raises(ValueError, match="must be above 0"):
        dbscan(np.zeros((3, 3)), radius, least)


def test_shape() -> None:
    with pytest.raises(ValueError, match=r"\(n, 3\)"):
        dbscan(np.zeros((3, 2)), 0.1, 5)
