"""Graph of thinned pixels: edges between junctions and ends, joined to lines."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from tunneldb.arrays import Float, Int64

MAX_DEFLECTION = np.radians(60.0)
"""Maximum change of direction of a line at a junction with more than two edges."""

MIN_REACH = 5
"""Minimum number of pixels from which the direction of an edge at a junction is taken."""


@dataclass
class Edge:
    """Pixels between two nodes.

    Attributes
    ----------
    pixels : list of int
        Indices of the pixels in order, with those of the nodes.
    nodes : (int, int)
        Its first and last node; equal for a loop. A node is a junction (at least 0), or an end (-1).
    """

    pixels: list[int]
    nodes: tuple[int, int]


@dataclass
class PixelGraph:
    """Thinned pixels and their edges.

    Attributes
    ----------
    places : (n, 2) array
        Row and column of each pixel.
    edges : list of Edge
    """

    places: Int64
    edges: list[Edge] = field(default_factory=list)

    def length(self, edge: Edge) -> float:
        """Return the length of an edge, pixels."""
        return float(np.hypot(*np.diff(self.places[edge.pixels], axis=0).T).sum())

    def edges_at_junctions(self) -> Counter[int]:
        """Return the number of edges that end at each junction."""
        return Counter(node for edge in self.edges for node in edge.nodes if node >= 0)

    def free_ends(self) -> set[int]:
        """Return the pixels at which an edge ends alone."""
        many = self.edges_at_junctions()
        return {
            pixel
            for edge in self.edges
            for pixel, node in zip((edge.pixels[0], edge.pixels[-1]), edge.nodes, strict=True)
            if node < 0 or many[node] == 1
        }


def make_graph(places: Int64) -> PixelGraph:
    """Return the graph of pixels (n, 2), row and column.

    Pixels are connected to the four neighbours at their sides, and to a diagonal one if no pixel beside both connects them.
    """
    neighbours = _neighbours(places)
    degree = np.array([len(near) for near in neighbours], dtype=np.int64)
    junction = _junctions(neighbours, degree)
    graph = PixelGraph(places)
    begun: set[tuple[int, int]] = set()
    walked = np.zeros(len(places), dtype=bool)
    for start in np.flatnonzero((degree != 2) & (degree > 0)).tolist():
        for first in neighbours[start]:
            if (start, first) in begun or (junction[start] >= 0 and junction[start] == junction[first]):
                continue
            pixels = _walk(start, first, neighbours, degree)
            begun.add((pixels[-1], pixels[-2]))
            walked[pixels] = True
            graph.edges.append(Edge(pixels, (int(junction[start]), int(junction[pixels[-1]]))))
    for start in np.flatnonzero((degree == 2) & ~walked).tolist():
        if not walked[start]:
            pixels = _walk(start, neighbours[start][0], neighbours, degree)
            walked[pixels] = True
            graph.edges.append(Edge(pixels, (-1, -1)))
    return graph


def pixels_beside(places: Int64, steps: Sequence[tuple[int, int]]) -> list[Int64]:
    """Return for each step of (rows, columns) the index of the pixel that is so far from each pixel, -1 if there is none."""
    width = int(places[:, 1].max(initial=0)) + 3
    keys = (places[:, 0] + 1) * width + places[:, 1] + 1
    order = np.argsort(keys)
    ordered = keys[order]
    beside = []
    for rows, columns in steps:
        wanted = keys + rows * width + columns
        found = np.minimum(np.searchsorted(ordered, wanted), len(keys) - 1)
        beside.append(np.where(ordered[found] == wanted, order[found], -1))
    return beside


SIDES = ((-1, 0), (0, 1), (1, 0), (0, -1))
CORNERS = ((-1, 1), (1, 1), (1, -1), (-1, -1))
"""Steps to the neighbours above, right, below and left, and to those between them."""


def _neighbours(places: Int64) -> list[list[int]]:
    beside = pixels_beside(places, SIDES)
    for k, corner in enumerate(pixels_beside(places, CORNERS)):
        beside.append(np.where((beside[k] < 0) & (beside[(k + 1) % 4] < 0), corner, -1))
    return [[near for near in row if near >= 0] for row in np.stack(beside, axis=1).tolist()]


def _junctions(neighbours: list[list[int]], degree: Int64) -> Int64:
    """Return the number of the junction of each pixel, -1 for others; adjoining pixels are one junction."""
    at = np.flatnonzero(degree > 2)
    pairs = np.array([(pixel, near) for pixel in at.tolist() for near in neighbours[pixel] if degree[near] > 2], dtype=np.int64)
    pairs = pairs.reshape(-1, 2)
    size = len(degree)
    _, labels = connected_components(coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(size, size)), False)
    return np.where(degree > 2, labels, -1).astype(np.int64)


def _walk(start: int, first: int, neighbours: list[list[int]], degree: Int64) -> list[int]:
    """Return the pixels from one to the next node, or around a ring."""
    pixels = [start, first]
    while degree[pixels[-1]] == 2 and pixels[-1] != start:
        one, other = neighbours[pixels[-1]]
        pixels.append(other if one == pixels[-2] else one)
    return pixels


def remove_spurs(graph: PixelGraph, limits: Float) -> list[Edge]:
    """Remove short edges with a free end, which thinning adds at rough rims and blunt ends; return them.

    At a junction with spurs only, the two longest stay.

    Parameters
    ----------
    graph : PixelGraph
    limits : (n,) array
        Maximum length of a spur at each pixel, pixels.
    """
    many = graph.edges_at_junctions()
    spurs: dict[int, list[tuple[float, int]]] = defaultdict(list)
    for number, edge in enumerate(graph.edges):
        if min(edge.nodes) < 0 <= max(edge.nodes):
            at = edge.pixels[0] if edge.nodes[0] >= 0 else edge.pixels[-1]
            if (length := graph.length(edge)) <= limits[at]:
                spurs[max(edge.nodes)].append((length, number))
    removed = {
        number
        for node, there in spurs.items()
        for _, number in sorted(there)[: len(there) if len(there) < many[node] else len(there) - 2]
    }
    gone = [edge for number, edge in enumerate(graph.edges) if number in removed]
    graph.edges = [edge for number, edge in enumerate(graph.edges) if number not in removed]
    return gone


def join_edges(graph: PixelGraph, reach: int) -> list[list[int]]:
    """Return the pixels of lines: at a junction the two edges of the least change of direction continue each other.

    Parameters
    ----------
    graph : PixelGraph
    reach : int
        Number of pixels from which the direction of an edge at a junction is taken.
    """
    ends: dict[int, list[tuple[int, int]]] = defaultdict(list)
    for number, edge in enumerate(graph.edges):
        for side, node in enumerate(edge.nodes):
            if node >= 0:
                ends[node].append((number, side))
    follows: dict[tuple[int, int], tuple[int, int]] = {}
    for there in ends.values():
        for one, other in _pairs(graph, there, max(reach, MIN_REACH)):
            follows[one], follows[other] = other, one
    return _chains(graph, follows)


def _pairs(graph: PixelGraph, there: list[tuple[int, int]], reach: int) -> list[tuple[tuple[int, int], tuple[int, int]]]:
    """Return the pairs of edges at a junction that continue each other, the straightest first."""
    directions = []
    for number, side in there:
        pixels = graph.edges[number].pixels if side == 0 else graph.edges[number].pixels[::-1]
        away = graph.places[pixels[min(reach, len(pixels) - 1)]] - graph.places[pixels[0]]
        directions.append(away / max(float(np.hypot(*away)), 1e-9))
    limit = np.pi if len(there) == 2 else MAX_DEFLECTION
    found = []
    for k in range(len(there)):
        for j in range(k):
            turn = float(np.arccos(np.clip(-directions[k] @ directions[j], -1.0, 1.0)))
            if turn <= limit and there[k][0] != there[j][0]:
                found.append((turn, j, k))
    used: set[int] = set()
    pairs = []
    for _, j, k in sorted(found):
        if not {j, k} & used:
            used |= {j, k}
            pairs.append((there[j], there[k]))
    return pairs


def _chains(graph: PixelGraph, follows: dict[tuple[int, int], tuple[int, int]]) -> list[list[int]]:
    """Return the pixels of the edges that follow each other."""
    lines = []
    done: set[int] = set()
    begins = [(n, side) for n in range(len(graph.edges)) for side in (0, 1) if (n, side) not in follows]
    rings = [(n, 0) for n in range(len(graph.edges))]
    for number, side in begins + rings:
        if number in done:
            continue
        pixels: list[int] = []
        while number not in done:
            done.add(number)
            part = graph.edges[number].pixels if side == 0 else graph.edges[number].pixels[::-1]
            pixels += part[1:] if pixels and pixels[-1] == part[0] else part
            if (number, 1 - side) not in follows:
                break
            number, side = follows[number, 1 - side]
        lines.append(pixels)
    return lines
