import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tunneldb.pointcloud.spool import ROW
from tunneldb.pointcloud.thinning import first_of_voxels, pick, thin, voxel_edge

ORIGIN = np.array([500_000.0, 4_500_000.0, 100.0])


def as_set(xyz: np.ndarray) -> set[tuple[float, ...]]:
    return set(map(tuple, xyz.tolist()))


clouds = st.builds(
    lambda seed, count, spread, digits: np.round(np.random.default_rng(seed).normal(0, spread, (count, 3)) + ORIGIN, digits),
    st.integers(0, 10**6),
    st.integers(0, 200),
    st.sampled_from([0.05, 0.3, 3.0]),
    st.sampled_from([2, 3, 6]),
)


@given(clouds, st.integers(0, 10**6))
@settings(deadline=None)
def test_order_does_not_matter(xyz: np.ndarray, seed: int) -> None:
    shuffled = np.random.default_rng(seed).permutation(xyz)
    assert as_set(xyz[thin(xyz, 0.1225)]) == as_set(shuffled[thin(shuffled, 0.1225)])


@given(clouds, st.integers(0, 10**6))
@settings(deadline=None)
def test_thinning_parts_first_changes_nothing(xyz: np.ndarray, seed: int) -> None:
    parts = np.array_split(np.random.default_rng(seed).permutation(xyz), 3)
    union = np.concatenate([part[thin(part, 0.1225)] for part in parts])
    assert as_set(union[thin(union, 0.1225)]) == as_set(xyz[thin(xyz, 0.1225)])


@given(clouds)
@settings(deadline=None)
def test_each_voxel_keeps_its_point_nearest_to_the_centre(xyz: np.ndarray) -> None:
    edge = 0.1225
    keep = thin(xyz, edge)
    voxel = np.floor(xyz / edge)
    distance = np.linalg.norm(xyz - (voxel + 0.5) * edge, axis=1)
    assert len(np.unique(voxel, axis=0)) == keep.sum()
    for row in np.flatnonzero(keep):
        same = np.all(voxel == voxel[row], axis=1)
        assert distance[row] <= distance[same].min() + 1e-12


def test_points_at_one_place_are_told_apart_by_their_values() -> None:
    rows = np.zeros(3, ROW)
    rows["time"], rows["intensity"] = [2.0, 1.0, 1.0], [0.0, 5.0, 4.0]
    for order in ([0, 1, 2], [2, 1, 0], [1, 2, 0]):
        chosen, before = first_of_voxels(rows[order], 0.1, np.ones(3, bool))
        assert rows[order][chosen]["intensity"].tolist() == [4.0]
        assert not before.any()


@given(clouds, st.integers(0, 10**6))
@settings(deadline=None)
def test_the_first_good_one_is_chosen_and_what_stood_before_it_told(xyz: np.ndarray, seed: int) -> None:
    edge = 0.1225
    good = np.random.default_rng(seed).random(len(xyz)) < 0.5
    rows = np.zeros(len(xyz), ROW)
    for column, name in enumerate("xyz"):
        rows[name] = xyz[:, column]
    rows["time"] = np.arange(len(xyz))
    chosen, before = first_of_voxels(rows, edge, good)
    voxels: dict[tuple[float, ...], list[int]] = {}
    for row in sorted(range(len(xyz)), key=lambda i: _standing(xyz[i], edge, i)):
        voxels.setdefault(tuple(np.floor(xyz[row] / edge)), []).append(row)
    for members in voxels.values():
        first = next((k for k, row in enumerate(members) if good[row]), len(members))
        assert before[members].tolist() == [k < first for k in range(len(members))]
        assert chosen[members].tolist() == [k == first for k in range(len(members))]


def _standing(point: np.ndarray, edge: float, number: int) -> tuple[float, ...]:
    centre = (np.floor(point / edge) + 0.5) * edge
    x, y, z = (float(p - c) for p, c in zip(point, centre, strict=True))
    return (x**2 + y**2 + z**2, *point.tolist(), number)


@given(clouds, st.integers(1, 6), st.integers(0, 10**6))
@settings(deadline=None)
def test_what_is_picked_of_chunks_holds_the_first_good_one(xyz: np.ndarray, points: int, seed: int) -> None:
    """Thinning what was picked of each chunk, noise left out, is thinning all, noise left out."""
    edge, limit = 0.1225, 0.03**2
    apart = ((xyz[:, None] - xyz[None]) ** 2).sum(axis=2)
    good = (apart <= limit).sum(axis=1) >= points
    expected = as_set(xyz[good][thin(xyz[good], edge)])
    found = []
    for part in np.array_split(np.random.default_rng(seed).permutation(len(xyz)), 3):
        cloud = np.ascontiguousarray(xyz[part])
        none = np.zeros(len(part))
        numbers, certain = pick(
            cloud, none, none.astype("f4"), none.astype("i4"), none.astype("u1"), none == 0, edge, limit, points
        )
        assert good[part[numbers[certain]]].all()
        found.append(part[numbers][good[part[numbers]]])
    rows = np.concatenate(found).astype(int)
    assert as_set(xyz[rows][thin(xyz[rows], edge)]) == expected


@pytest.mark.parametrize("density", [100.0, 400.0])
def test_density_on_planes_of_random_orientation(density: float) -> None:
    rng = np.random.default_rng(0)
    edge = voxel_edge(density)
    found, cut = [], []
    for _ in range(40):
        frame, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        size = 40 * edge
        plane = rng.uniform(-size / 2, size / 2, (80_000, 2)) @ frame[:2] + rng.uniform(0, 1000, 3)
        found.append(thin(plane, edge).sum() / size**2)
        cut.append(np.abs(frame[2]).sum() / edge**2)
    # A voxel at the rim counts although only a part of it lies on the plane: 4 / 40 of the side.
    assert np.mean(found) == pytest.approx(density, rel=0.12)
    np.testing.assert_allclose(found, cut, rtol=0.12)


def test_edge() -> None:
    assert voxel_edge(100.0) == pytest.approx(0.122474, abs=1e-6)
