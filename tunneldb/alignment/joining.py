"""Joining of pieces of a line end to end."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from tunneldb.arrays import Float, Int32, Intp

SNAP = 0.01
"""Distance up to which ends of pieces are the same place, m; files are rounded to millimetres."""


def join_pieces(pieces: Sequence[Float]) -> list[Float]:
    """Join pieces whose ends meet, in either direction.

    A joined line has the direction of most of its length. Lines end where three or more ends meet.

    Parameters
    ----------
    pieces : sequence of (n, 3) float arrays
        Vertices, m; heights are NaN where there are none.

    Returns
    -------
    Lines, (n, 3) each, the longest in plan first; a closed one ends at its start.
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
    # first from ends of lines, then along closed lines
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
    """Return a line of the remaining pieces, from a node on, up to an end or a junction."""
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
    """Return the number of the node at which each piece begins and ends, (n, 2)."""
    places = np.nan_to_num(np.array([place for piece in pieces for place in (piece[0], piece[-1])]))
    pairs = cKDTree(places).query_pairs(SNAP, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(places), len(places)))
    return np.asarray(connected_components(graph, directed=False)[1].reshape(-1, 2))


def _without_repeats(piece: Float) -> Float:
    """Remove vertices with the same position in plan as the previous one."""
    return piece[np.append(True, np.any(np.diff(piece[:, :2], axis=0) != 0.0, axis=1))]


def _length(line: Float) -> float:
    return float(np.hypot(*np.diff(line[:, :2], axis=0).T).sum())
