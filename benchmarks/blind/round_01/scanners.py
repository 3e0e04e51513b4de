"""Rays of a scanner: from a tripod over azimuth and elevation, or profile by profile from a trolley."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from .frames import Array, Tunnel

Index = NDArray[np.int64]


class Grid(Protocol):
    """Rays in rows and columns."""

    source: int

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of rows and columns."""

    def rays(self, rows: Index, columns: Index) -> tuple[Array, Array]:
        """Origins and unit directions, in site coordinates, of the rays where rows and columns cross."""

    def window(self, points: Array) -> tuple[Index, Index]:
        """Rows and columns whose rays may meet a convex body that these points span."""

    def times(self) -> Array:
        """Time of each ray."""

    def share(self, reach: Array) -> Array:
        """Area, square to the beam, that each ray stands for at ranges given for the whole grid."""


def _arc(angles: Array, first: float, step: float, count: int) -> Index:
    """Indices of a regular series of angles that cover some angles, which span less than half a turn."""
    middle = np.arctan2(np.sin(angles).mean(), np.cos(angles).mean())
    aside = (angles - middle + np.pi) % (2 * np.pi) - np.pi
    low = int(np.floor((middle + aside.min() - 0.01 - first) / step))
    high = int(np.ceil((middle + aside.max() + 0.01 - first) / step))
    index = np.arange(low, high + 1)
    turn = round(2 * np.pi / step)
    index = np.unique(index % turn)
    return index[index < count]


@dataclass
class Tripod:
    """A scanner on a tripod; it sees no floor close to its feet.

    Attributes
    ----------
    source : int
        Number of the station.
    place : Array
        Its site coordinates.
    step : float
        Angle between rays, radians.
    start : float
        Time at which it starts, s.
    lowest : float
        Lowest elevation, degrees.
    """

    source: int
    place: Array
    step: float
    start: float
    lowest: float = -62.0
    phase: float = 0.0

    @property
    def shape(self) -> tuple[int, int]:
        return int((90.0 - self.lowest) / np.degrees(self.step)), int(2 * np.pi / self.step)

    def rays(self, rows: Index, columns: Index) -> tuple[Array, Array]:
        up = np.radians(self.lowest) + (rows + 0.5) * self.step
        turn = self.phase + columns * self.step
        flat, rise = np.cos(up)[:, None], np.sin(up)[:, None]
        ray = np.stack(np.broadcast_arrays(flat * np.cos(turn), flat * np.sin(turn), rise), axis=-1)
        return self.place, ray

    def window(self, points: Array) -> tuple[Index, Index]:
        x, y, z = (points - self.place).T
        flat = np.hypot(x, y)
        up = np.arctan2(z, flat)
        height, width = self.shape
        near = np.clip((np.array([up.min() - 0.04, up.max() + 0.04]) - np.radians(self.lowest)) / self.step, 0, height)
        rows = np.arange(int(near[0]), int(near[1]))
        if up.max() > 1.3:
            return np.arange(int(near[0]), height), np.arange(width)
        return rows, _arc(np.arctan2(y, x), self.phase, self.step, width)

    def times(self) -> Array:
        height, width = self.shape
        return self.start + np.arange(width)[None, :] * 0.06 + np.arange(height)[:, None] * (0.05 / height)

    def share(self, reach: Array) -> Array:
        up = np.radians(self.lowest) + (np.arange(len(reach)) + 0.5) * self.step
        area: Array = (np.cos(up) * self.step**2)[:, None] * reach**2
        return area


@dataclass
class Profiler:
    """Part of a ride with a scanner whose mirror turns about the tunnel's axis.

    Attributes
    ----------
    tunnel : Tunnel
        For the axis that the ride follows.
    u, y, z : Array
        Chainage, offset and height at the start of each profile.
    time : Array
        Time of each profile, s.
    step : float
        Angle between rays, radians.
    yaw : float
        Angle between the profiles' plane and the square to the axis, radians.
    blind : float
        Angle below that the trolley hides, radians.
    """

    tunnel: Tunnel
    u: Array
    y: Array
    z: Array
    time: Array
    step: float
    yaw: float
    blind: float
    source: int = 1
    advance: float = field(init=False)
    period: float = field(init=False)

    def __post_init__(self) -> None:
        self.advance = float(np.diff(self.u).mean())
        self.period = float(np.diff(self.time).mean())

    @property
    def shape(self) -> tuple[int, int]:
        return len(self.u), int((2 * np.pi - self.blind) / self.step)

    def _first(self) -> float:
        return -np.pi + self.blind / 2

    def rays(self, rows: Index, columns: Index) -> tuple[Array, Array]:
        turn = self._first() + columns * self.step
        axis = self.tunnel.axis
        along, across = axis.along(self.u[rows]), axis.across(self.u[rows])
        sideways = np.cos(self.yaw) * across + np.sin(self.yaw) * along
        up = np.array([0.0, 0.0, 1.0])
        ray = np.sin(turn)[None, :, None] * sideways[:, None, :] + np.cos(turn)[None, :, None] * up
        moved = self.advance * turn[None, :, None] / (2 * np.pi) * along[:, None, :]
        origin = axis.to_site(self.u[rows], self.y[rows], self.z[rows])[:, None, :] + moved
        return origin, ray

    def window(self, points: Array) -> tuple[Index, Index]:
        u, y, z = self.tunnel.axis.to_local(points)
        slack = 0.15 + 4.0 * abs(np.tan(self.yaw))
        rows = np.flatnonzero((self.u > u.min() - slack) & (self.u < u.max() + slack))
        if len(rows) == 0:
            return rows, rows
        spread = np.array([[y - side * 0.1 - self.y[rows].mean(), z - self.z[rows].mean()] for side in (-1, 1)])
        turn = np.arctan2(spread[:, 0], spread[:, 1]).ravel()
        return rows, _arc(turn, self._first(), self.step, self.shape[1])

    def times(self) -> Array:
        turn = np.arange(self.shape[1]) * (self.step / (2 * np.pi) * self.period)
        return self.time[:, None] + turn[None, :]

    def share(self, reach: Array) -> Array:
        return self.step * self.advance * reach


def ride(
    tunnel: Tunnel, rng: np.random.Generator, spacing: float, step: float, place: tuple[float, float], yaw: float, blind: float
) -> tuple[list[Profiler], Array]:
    """A ride through a tunnel, in parts, and its trajectory as rows of time and site coordinates.

    Parameters
    ----------
    tunnel : Tunnel
        Where to.
    rng : numpy.random.Generator
        For how evenly it goes.
    spacing : float
        Mean distance between profiles, m.
    step : float
        Angle between rays, radians.
    place : tuple of float
        Offset to the left and height above the axis of the scanner.
    yaw, blind : float
        As in `Profiler`.
    """
    count = int((tunnel.axis.length - 0.1) / spacing)
    index = np.arange(count)
    pace = 1 + 0.08 * np.sin(index / 310.0 + rng.uniform(0, 6)) + 0.03 * np.sin(index / 47.0 + rng.uniform(0, 6))
    u = 0.05 + np.concatenate([[0.0], np.cumsum(pace[:-1])]) * spacing
    u = u[u < tunnel.axis.length - 0.05]
    time: Array = 311040.0 + np.arange(len(u), dtype=np.float64) * 0.02
    y = place[0] + 0.012 * np.sin(u / 3.1) + 0.004 * np.sin(u / 0.7)
    z = place[1] + 0.003 * np.sin(u / 1.3 + 1.0)
    parts = [
        Profiler(tunnel, u[rows], y[rows], z[rows], time[rows], step, yaw, blind)
        for rows in (slice(first, first + 250) for first in range(0, len(u) - 1, 250))
        if len(u[rows]) > 1
    ]
    track = np.column_stack([time, tunnel.axis.to_site(u, y, z)])
    after = 2 * track[-1] - track[-2]
    return parts, np.vstack([track[:-1:5], track[-1:], after])
