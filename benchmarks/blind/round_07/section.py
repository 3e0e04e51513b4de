"""Cross-section and alignment of a tunnel.

A tunnel is made straight, in chainage ``u``, offset to the right ``y`` and height ``z``, and bent into its alignment
afterwards. Along the girth of the section runs ``s``, zero at the crown, negative on the right, positive on the left.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating[Any]]
Point = tuple[float, float]


def arc(centre: Point, radius: float, start: float, stop: float, spacing: float = 0.03) -> list[Point]:
    """Points of an arc of a circle.

    Parameters
    ----------
    centre : tuple of float
        Offset and height of its centre.
    radius : float
        In metres.
    start, stop : float
        Angles above the horizontal on the right, in degrees.
    spacing : float
        Length of the chords, in metres.

    Returns
    -------
    list of tuple of float
    """
    count = max(2, round(abs(np.radians(stop - start)) * radius / spacing))
    angles = np.radians(np.linspace(start, stop, count))
    return [(float(centre[0] + radius * np.cos(a)), float(centre[1] + radius * np.sin(a))) for a in angles]


class Section:
    """A closed cross-section.

    Parameters
    ----------
    floor : sequence of tuple of float
        Offset and height, from the middle of the floor to the foot of the right wall.
    wall : sequence of tuple of float
        From the foot of the right wall to the crown.
    left_floor, left_wall : sequence of tuple of float, optional
        The same for the left half, with its offsets as they are (negative); mirrored when left out.
    """

    def __init__(
        self,
        floor: Sequence[Point],
        wall: Sequence[Point],
        left_floor: Sequence[Point] | None = None,
        left_wall: Sequence[Point] | None = None,
    ) -> None:
        left_floor = left_floor or [(-y, z) for y, z in floor]
        left_wall = left_wall or [(-y, z) for y, z in wall]
        ring = [*floor, *list(wall)[1:], *list(left_wall)[-2::-1], *list(left_floor)[-2::-1]]
        self.points: Array = np.array(ring)
        steps = np.diff(self.points, axis=0)
        self.lengths: Array = np.hypot(steps[:, 0], steps[:, 1])
        self.tangents: Array = steps / self.lengths[:, None]
        self.normals: Array = np.column_stack([-self.tangents[:, 1], self.tangents[:, 0]])
        along = np.concatenate([[0.0], np.cumsum(self.lengths)])
        crown = len(floor) + len(wall) - 2
        self.s: Array = along - along[crown]
        self.foot_right = float(self.s[len(floor) - 1])
        self.foot_left = float(self.s[crown + len(left_wall) - 1])

    def locate(self, s: Array | float) -> Array:
        """Offset and height at places of the girth, as an array with a last axis of two."""
        return np.stack([np.interp(s, self.s, self.points[:, 0]), np.interp(s, self.s, self.points[:, 1])], axis=-1)

    def segment(self, s: Array | float) -> NDArray[np.intp]:
        """Index of the chord at places of the girth."""
        return np.clip(np.searchsorted(self.s, s, side="right") - 1, 0, len(self.lengths) - 1)

    def at_height(self, height: float, side: str) -> float:
        """Place on the wall at a height.

        Parameters
        ----------
        height : float
            Above the middle of the floor, in metres.
        side : {"left", "right"}
            Which wall.

        Returns
        -------
        float
        """
        low, high = (self.foot_right, 0.0) if side == "right" else (0.0, self.foot_left)
        s = np.linspace(low, high, 4000)
        z = self.locate(s)[:, 1]
        return float(s[np.argmin(np.abs(z - height))])

    def left(self, height: float) -> float:
        """Place on the left wall at a height."""
        return self.at_height(height, "left")

    def right(self, height: float) -> float:
        """Place on the right wall at a height."""
        return self.at_height(height, "right")

    def first_hits(self, origin: Point, count: int = 16000) -> tuple[Array, NDArray[np.intp]]:
        """Which chord is seen from a point of the section, by direction.

        Parameters
        ----------
        origin : tuple of float
            Offset and height.
        count : int
            Number of directions.

        Returns
        -------
        angles : ndarray
            ``atan2(z, y)`` of the directions, ascending.
        chords : ndarray
            Index of the nearest chord met.
        """
        angles = np.linspace(-np.pi, np.pi, count, endpoint=False)
        start = self.points[:-1] - np.asarray(origin)
        edge = np.diff(self.points, axis=0)
        chords = np.empty(count, dtype=np.intp)
        moment = start[:, 0] * edge[:, 1] - start[:, 1] * edge[:, 0]
        for part in np.array_split(np.arange(count), max(1, count // 1000)):
            dy, dz = np.cos(angles[part])[:, None], np.sin(angles[part])[:, None]
            with np.errstate(divide="ignore", invalid="ignore"):
                cross = dy * edge[:, 1] - dz * edge[:, 0]
                distance = moment / cross
                fraction = (start[:, 0] * dz - start[:, 1] * dy) / cross
            met = (distance > 1e-6) & (fraction > -1e-6) & (fraction < 1 + 1e-6)
            chords[part] = np.argmin(np.where(met, distance, np.inf), axis=1)
        return angles, chords


@dataclass(frozen=True)
class Alignment:
    """Where the tunnel lies.

    Attributes
    ----------
    east, north, height : float
        Middle of the floor at chainage zero, EPSG:25832.
    azimuth : float
        Direction at chainage zero, in degrees from north.
    curvature : float
        One over the radius, positive to the right.
    grade : float
        Rise per metre.
    """

    east: float
    north: float
    height: float
    azimuth: float
    curvature: float = 0.0
    grade: float = 0.0

    def _frame(self, u: Array) -> tuple[Array, Array, Array, Array]:
        heading = np.radians(self.azimuth) + self.curvature * u
        mean = np.radians(self.azimuth) + self.curvature * u / 2
        chord = u * np.sinc(self.curvature * u / 2 / np.pi)
        return self.east + chord * np.sin(mean), self.north + chord * np.cos(mean), np.sin(heading), np.cos(heading)

    def place(self, local: Array) -> Array:
        """Coordinates of points given as chainage, offset and height."""
        u, y, z = local[:, 0], local[:, 1], local[:, 2]
        east, north, sine, cosine = self._frame(u)
        return np.column_stack([east + y * cosine, north - y * sine, self.height + self.grade * u + z])

    def turn(self, u: Array, vectors: Array) -> Array:
        """Directions in space of local directions at chainages."""
        _, _, sine, cosine = self._frame(u)
        along, right, up = vectors.T
        turned = np.column_stack([along * sine + right * cosine, along * cosine - right * sine, up + self.grade * along])
        return turned / np.linalg.norm(turned, axis=1)[:, None]
