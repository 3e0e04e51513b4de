"""Points in the nodes of an octree, brought there tile by tile."""

from __future__ import annotations

import numpy as np
import pytest

from tunneldb.pointcloud import octree
from tunneldb.pointcloud.octree import GRID, CellCounts, Nodes, Tiling

COUNT = 60_000


@pytest.fixture(scope="module")
def tunnel() -> np.ndarray:
    """A lining 200 m long, dense at one end, and a point far above it."""
    rng = np.random.default_rng(3)
    along, angle = 200.0 * rng.random(COUNT) ** 3, rng.uniform(0.0, 2.0 * np.pi, COUNT)
    xyz = np.column_stack([500_000.0 + along, 4.7e6 + along / 3 + 4 * np.cos(angle), 640.0 + 4 * np.sin(angle)])
    xyz[7] += [0.0, 0.0, 60.0]
    return xyz


def numbered(xyz: np.ndarray) -> np.ndarray:
    """Records (n, 4) that are the points' numbers."""
    return np.arange(len(xyz), dtype="<u4").view(np.uint8).reshape(-1, 4)


def nodes_of(xyz: np.ndarray, tiling: Tiling) -> dict[octree.Key, np.ndarray]:
    """Numbers of the points in each node."""
    nodes, found = Nodes(), {}
    records, tile_of = numbered(xyz), tiling.tiles_of(xyz)
    for number, tile in enumerate(tiling.tiles):
        own = tile_of == number
        assert own.sum() == tile.points
        for key, chosen in nodes.add(tile, xyz[own], records[own]):
            found[key] = chosen.copy().view("<u4")[:, 0]
    for key, chosen in nodes.close():
        found[key] = chosen.copy().view("<u4")[:, 0]
    return found


@pytest.mark.parametrize("most", [500, 10_000, 10 * COUNT])
def test_each_point_is_in_one_node_that_it_lies_in(monkeypatch: pytest.MonkeyPatch, tunnel: np.ndarray, most: int) -> None:
    monkeypatch.setattr(octree, "LEAF", 300)
    counts = CellCounts(tunnel[0])
    for part in np.array_split(tunnel, 7):
        counts.add(part)
    tiling = Tiling.of(counts, most)
    nodes = nodes_of(tunnel, tiling)
    assert (np.sort(np.concatenate(list(nodes.values()))) == np.arange(COUNT)).all()
    deepest = max(level for level, *_ in nodes)
    assert deepest > 3
    for (level, *place), numbers in nodes.items():
        assert len(numbers) > 0
        edge = tiling.edge / 2**level
        inside = (tunnel[numbers] - tiling.low) / edge - place
        assert (inside >= 0).all()
        assert (inside < 1).all()
        # Its sample is even: one point for each cell of its grid, or all that there are.
        cells = np.unique(np.floor(inside * 2**GRID), axis=0)
        if len(cells) < len(numbers):
            assert len(numbers) <= octree.LEAF
            below = (level + 1, *(2 * n for n in place))
            assert not any(key[0] == below[0] and [n // 2 for n in key[1:]] == place for key in nodes)
    for level, *place in nodes:
        if level:
            assert (level - 1, *(n // 2 for n in place)) in nodes  # readers go down from the root


def test_a_sample_covers_what_lies_below_it(monkeypatch: pytest.MonkeyPatch, tunnel: np.ndarray) -> None:
    monkeypatch.setattr(octree, "LEAF", 300)
    counts = CellCounts(tunnel[0])
    counts.add(tunnel)
    tiling = Tiling.of(counts, 2000)
    nodes = nodes_of(tunnel, tiling)
    cell = tiling.edge / 2**GRID
    everywhere = np.unique(np.floor((tunnel - tiling.low) / cell), axis=0)
    root = np.unique(np.floor((tunnel[nodes[0, 0, 0, 0]] - tiling.low) / cell), axis=0)
    np.testing.assert_array_equal(root, everywhere)


def test_points_too_far_apart_are_refused_by_what_they_are() -> None:
    counts = CellCounts(np.zeros(3))
    for place in ([0.0, 0.0, 16_400.0], [9e6, 0.0, 0.0]):
        with pytest.raises(ValueError, match="16 km apart in height, or thousands of kilometres in plan"):
            counts.add(np.array([place]))
