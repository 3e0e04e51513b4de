"""Pieces of a line, joined end to end."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from tunneldb.arrays import Float, Int32, Intp

SNAP = 0.01
"""Ends of pieces that lie as near to each other as this are one place, m: files are rounded to millimetres."""


def join_pieces(pieces: Sequence[Float]) -> list[Float]:
    """Join pieces whose ends meet, whichever way each of them was drawn.

    A joined line runs the way of most of its length. Where three ends meet or more, lines end.

    Parameters
    ----------
    pieces : sequence of (n, 3) float arrays
        Vertices, m; heights are NaN where there are none.

    Returns
    -------
    The lines, (n, 3) each, the longest in plan first; a closed one ends where it begins.
    """
    cleaned = [piece for piece in map(_without_repeats, pieces) if len(piece) > 1]
    if not cleaned:
        return []
    nodes = _nodes(cleaned)
    degree = np.bincount(nodes.ravel())
    ends: dict[int, list[int]] = {}
    for number, pair in enumerate(nodes.tolist()):
        for node in pair:
            ends.setdefault(node, []).append(number)
    left = set(range(len(cleaned)))
    lines = []
    # first from where lines end, then round what is closed
    order = [n for n in range(len(cleaned)) if (degree[nodes[n]] != 2).any()]
    for first in [*order, *range(len(cleaned))]:
        if first in left:
            start = int(nodes[first][0] if degree[nodes[first][0]] != 2 or degree[nodes[first][1]] == 2 else nodes[first][1])
            lines.append(_follow(cleaned, nodes, degree, ends, left, first, start))
    return sorted(lines, key=_length, reverse=True)


def _follow(
    pieces: Sequence[Float],
    nodes: Int32,
    degree: Intp,
    ends: dict[int, list[int]],
    left: set[int],
    first: int,
    start: int,
) -> Float:
    """Take pieces from those that are left, from a node on, as long as there is one way to go."""
    parts: list[Float] = []
    forth = 0.0
    number: int | None = first
    node = start
    while number is not None:
        left.discard(number)
        a, b = nodes[number].tolist()
        ahead = a == node
        piece = pieces[number] if ahead else pieces[number][::-1]
        forth += _length(piece) if ahead else -_length(piece)
        parts.append(piece if not parts else piece[1:])
        node = b if ahead else a
        number = next((n for n in ends[node] if n in left), None) if degree[node] == 2 else None
    line = np.vstack(parts)
    return line if forth >= 0.0 else line[::-1]


def _nodes(pieces: Sequence[Float]) -> Int32:
    """Number of the place at which each piece begins and ends, (n, 2)."""
    places = np.nan_to_num(np.array([place for piece in pieces for place in (piece[0], piece[-1])]))
    pairs = cKDTree(places).query_pairs(SNAP, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(places), len(places)))
    return np.asarray(connected_components(graph, directed=False)[1].reshape(-1, 2))


def _without_repeats(piece: Float) -> Float:
    """Leave out vertices at the place in plan of the one before."""
    return piece[np.append(True, np.any(np.diff(piece[:, :2], axis=0) != 0.0, axis=1))]


def _length(line: Float) -> float:
    return float(np.hypot(*np.diff(line[:, :2], axis=0).T).sum())
