"""Plan of the roofed area of a cloud, and the path along its middle.

A tunnel's axis is found in the projection of its points onto the plan (Kang et al., 2014). The path along the middle is the
shortest path with greater cost per step near the edge (Wan et al., 2002).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import cKDTree

from tunneldb.arrays import Bool, Float, Int64

CELLS = (1.0, 2.0, 4.0)
"""Edges of a cell of the plan, m; the smallest for which most neighbours of a roofed cell are roofed is used."""

CLEARANCE = 1.5
"""Empty height between points above each other from which the upper ones are a roof, m. Slopes and walls have none."""

_CONNECTED_WITHIN = 3.0  # edges: distance up to which cells are connected, since profiles have gaps
_WINDOW = 2  # cells on each side, of the window that fills holes
_CELL_OFFSET = 1 << 25  # cells; more than the length of any tunnel


@dataclass(frozen=True)
class Footprint:
    """Connected cells of the plan under a roof.

    Attributes
    ----------
    cells : (n, 2) float array
        Centres of the cells, m.
    depth : (n,) float array
        Distance of each cell from the edge of the roofed area, m.
    edge : float
        Edge of a cell, m.
    """

    cells: Float
    depth: Float
    edge: float

    def part(self, chosen: Bool) -> Footprint:
        """Return the footprint of some of the cells, with the same depths."""
        return Footprint(self.cells[chosen], self.depth[chosen], self.edge)

    @property
    def area(self) -> float:
        """Area, m²."""
        return len(self.cells) * self.edge**2


def roofed_parts(points: Float) -> list[Footprint]:
    """Return parts of the plan where points have a roof above them and free height below it, the largest part first.

    Parameters
    ----------
    points : (n, 3) float array
        Evenly spread points, m.
    """
    for edge in CELLS:
        roofed = _roofed(points, edge)
        cells = _filled(roofed)
        if 2 * len(cells) > len(roofed):
            break
    if not len(cells):
        return []
    footprint = Footprint(np.asarray((cells + 0.5) * edge, dtype=np.float64), edge * _depth(cells), edge)
    label = connected_components(_graph(footprint.cells, edge), directed=False)[1]
    order = np.argsort(-np.bincount(label), kind="stable")
    return [footprint.part(label == number) for number in order]


def without_side_rooms(part: Footprint) -> Footprint:
    """Remove parts narrower than 0.6 of the tunnel's width: niches, cross passages.

    This is the morphological opening of the footprint, with the tunnel's half-width from the longest path through it.
    """
    half = half_width(part, longest_path(part))
    core = part.cells[part.depth >= 0.6 * half]
    opened = part.part(cKDTree(core).query(part.cells)[0] <= half)
    label = connected_components(_graph(opened.cells, part.edge), directed=False)[1]
    size = np.bincount(label)
    # if the tunnel itself is that narrow somewhere, it stays unchanged
    return opened.part(label == np.argmax(size)) if size.max() > 0.8 * size.sum() else part


def half_width(part: Footprint, path: Int64) -> float:
    """Return the half-width of the area around a path, m."""
    return float(np.median(part.depth[path]))


def longest_path(part: Footprint) -> Int64:
    """Return the indices of the cells along the middle of a part, from one of its ends to the other."""
    graph = _graph(part.cells, part.edge).tocsr()
    start = 0
    for _ in range(2):
        start = int(np.argmax(dijkstra(graph, directed=False, indices=start)))
    end = int(np.argmax(dijkstra(graph, directed=False, indices=start)))
    _, before = dijkstra(_dear_at_the_edge(graph, part.depth), directed=False, indices=start, return_predecessors=True)
    path = [end]
    while path[-1] != start:
        path.append(int(before[path[-1]]))
    return np.array(path[::-1], dtype=np.int64)


def branches(part: Footprint, path: Int64) -> Float:
    """Return centres (k, 2) of branches of a path that are as wide as the tunnel and longer than wide, m."""
    half = half_width(part, path)
    away = cKDTree(part.cells[path]).query(part.cells)[0]
    rest = part.part((away > 2.0 * half + _CONNECTED_WITHIN * part.edge) & (part.depth >= 0.6 * half))
    groups = _groups(rest.cells, part.edge)
    return np.array([g.mean(axis=0) for g in groups if np.hypot(*np.ptp(g, axis=0)) > 2.0 * half]).reshape(-1, 2)


def largest_group(cells: Float, edge: float) -> Float:
    """Return the largest connected group (k, 2) of the cells (n, 2), m."""
    return _groups(cells, edge)[0]


def _groups(cells: Float, edge: float) -> list[Float]:
    """Return groups of connected cells, the largest first."""
    if not len(cells):
        return []
    label = connected_components(_graph(cells, edge), directed=False)[1]
    return [cells[label == number] for number in np.argsort(-np.bincount(label), kind="stable")]


def _roofed(points: Float, edge: float) -> Int64:
    """Return cells (n, 2) of the plan with a roof, and the walls beside them."""
    key = _key(np.floor(points[:, :2] / edge).astype(np.int64))
    order = np.lexsort((points[:, 2], key))
    key, z = key[order], points[order, 2]
    occupied, first, count = np.unique(key, return_index=True, return_counts=True)
    empty = np.append(np.diff(z), 0.0)
    empty[first + count - 1] = 0.0
    roof = np.maximum.reduceat(empty, first) >= CLEARANCE
    upright = z[first + count - 1] - z[first] >= CLEARANCE
    is_wall = np.zeros(len(occupied), dtype=bool)
    for step in _steps(1):
        is_wall |= np.isin(occupied, _key(_cell(occupied[roof]) + step))
    return _cell(occupied[roof | (upright & is_wall)])


def _filled(cell: Int64) -> Int64:
    """Return cells with at least half of their window occupied, so that holes are filled and isolated cells removed."""
    keys = [_key(cell + step) for step in _steps(_WINDOW)]
    if not len(cell):
        return cell
    key, count = np.unique(np.concatenate(keys), return_counts=True)
    return _cell(key[2 * count >= len(keys)])


def _depth(cell: Int64) -> Float:
    """Return the distance of cells from the edge of their area, in edges of a cell."""
    key = _key(cell)
    inside = np.ones(len(cell), dtype=bool)
    for step in _steps(1):
        inside &= np.isin(_key(cell + step), key, assume_unique=True)
    return np.asarray(cKDTree(cell[~inside]).query(cell)[0] + 0.5)


def _graph(middle: Float, edge: float) -> coo_array:
    """Return the graph of distances of cells from those near them."""
    pairs = cKDTree(middle).query_pairs(_CONNECTED_WITHIN * edge, output_type="ndarray")
    length = np.hypot(*(middle[pairs[:, 0]] - middle[pairs[:, 1]]).T) if len(pairs) else np.empty(0)
    return coo_array((length, (pairs[:, 0], pairs[:, 1])), shape=(len(middle), len(middle)))


def _dear_at_the_edge(graph: csr_array, depth: Float) -> csr_array:
    """Return the same graph, with steps weighted by the inverse square of their depth."""
    steps = graph.tocoo()
    weight = 0.5 * (depth[steps.row] ** -2.0 + depth[steps.col] ** -2.0)
    return coo_array((steps.data * weight, (steps.row, steps.col)), shape=steps.shape).tocsr()


def _steps(reach: int) -> Int64:
    side = np.arange(-reach, reach + 1)
    return np.stack(np.meshgrid(side, side, indexing="ij"), axis=-1).reshape(-1, 2)


def _key(cell: Int64) -> Int64:
    return np.asarray(cell[:, 0] * _CELL_OFFSET + cell[:, 1] + _CELL_OFFSET // 2)


def _cell(key: Int64) -> Int64:
    return np.column_stack([key // _CELL_OFFSET, key % _CELL_OFFSET - _CELL_OFFSET // 2])
