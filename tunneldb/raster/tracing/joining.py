"""Traced lines in the unrolled plane: their width, and their continuation in the next image."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from tunneldb.arrays import Float

MAX_TURN = np.radians(45.0)
"""Maximum change of direction between a line and its continuation in the next image."""

REACH = 0.1
"""Length at an end that gives its direction, m."""


@dataclass(frozen=True)
class TracedLine:
    """Line in the unrolled plane.

    Attributes
    ----------
    points : (n, 2) array
        Chainage and arc of its vertices, m.
    area : float
        Area of the mask that belongs to it, m².
    image : int
        Number of its image.
    """

    points: Float
    area: float
    image: int

    @property
    def length(self) -> float:
        """Length, m."""
        return float(np.hypot(*np.diff(self.points, axis=0).T).sum())

    @property
    def width_mm(self) -> float:
        """Mean width of the mask, mm."""
        return 1000.0 * self.area / self.length


def join_images(lines: Sequence[TracedLine], tolerance: float) -> list[TracedLine]:
    """Join lines that end where a line of another image begins, in about the same direction.

    Parameters
    ----------
    lines : sequence of TracedLine
    tolerance : float
        Maximum distance between the ends, m.
    """
    if not lines:
        return []
    ends = np.array([line.points[side] for line in lines for side in (0, -1)])
    away = np.array([_direction(line.points, side) for line in lines for side in (0, -1)])
    near = KDTree(ends).query_pairs(tolerance, output_type="ndarray")
    distance = np.hypot(*(ends[near[:, 0]] - ends[near[:, 1]]).T)
    follows: dict[int, int] = {}
    for k in np.argsort(distance).tolist():
        one, other = near[k].tolist()
        straight = float(-away[one] @ away[other]) >= np.cos(MAX_TURN)
        if straight and lines[one // 2].image != lines[other // 2].image and one not in follows and other not in follows:
            follows[one], follows[other] = other, one
    return _chains(lines, follows)


def _direction(points: Float, side: int) -> Float:
    """Return the direction in which a line leaves its first (0) or last (-1) point, as a unit vector."""
    along = points if side == 0 else points[::-1]
    distance = np.hypot(*(along - along[0]).T)
    step = along[int(np.argmax(distance >= min(REACH, float(distance.max()))))] - along[0]
    return np.asarray(step / max(float(np.hypot(*step)), 1e-12))


def _chains(lines: Sequence[TracedLine], follows: dict[int, int]) -> list[TracedLine]:
    """Return the lines, those that follow each other as one; end 2 n is the first point of line n, end 2 n + 1 the last."""
    joined = []
    done: set[int] = set()
    for begin in [end for end in range(2 * len(lines)) if end not in follows] + list(range(0, 2 * len(lines), 2)):
        points, area, end = [], 0.0, begin
        while end // 2 not in done:
            done.add(end // 2)
            line = lines[end // 2]
            points.append(line.points if end % 2 == 0 else line.points[::-1])
            area += line.area
            end = follows.get(end ^ 1, end)
        if points:
            joined.append(TracedLine(np.concatenate(points), area, lines[begin // 2].image))
    return joined
