"""Axis of a canal in plan, straight or an arc, and three frames.

tunnel
    Projected coordinates and heights, m.
local
    Origin in the middle of the axis on the water: x along the axis there, y to its left, z up, m.
stationed
    Station s along the axis (0 in the middle), offset o to its left, height z over the water, m.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Float
from tunneldb.compiled import inner
from tunneldb.simulate.canal.parameters import CanalParameters


@inner
def stationed(radius: float, x: float, y: float) -> tuple[float, float]:  # pragma: no cover - compiled
    """Return station and offset of a local position."""
    if radius == 0.0:
        return x, y
    sign = 1.0 if radius > 0.0 else -1.0
    return abs(radius) * math.atan2(x, sign * (radius - y)), radius - sign * math.hypot(x, y - radius)


@dataclass(frozen=True)
class Centreline:
    """Axis of a canal.

    Attributes
    ----------
    origin : (float, float, float)
        Origin of the local frame in the tunnel's frame.
    azimuth : float
        Grid azimuth of local x, degrees.
    radius : float
        Radius, m; positive: curves to the left; 0: straight.
    length : float
        Length, m, from station -length / 2 to length / 2.
    """

    origin: tuple[float, float, float]
    azimuth: float
    radius: float
    length: float

    @classmethod
    def of(cls, parameters: CanalParameters) -> Centreline:
        """Return the axis for some parameters."""
        p = parameters
        return cls((p.origin[0], p.origin[1], p.water_level), p.azimuth, p.radius, p.length)

    def rotation(self) -> Float:
        """Return the matrix (3, 3) that rotates local vectors into the tunnel's frame."""
        sine, cosine = math.sin(math.radians(self.azimuth)), math.cos(math.radians(self.azimuth))
        return np.array([[sine, -cosine, 0.0], [cosine, sine, 0.0], [0.0, 0.0, 1.0]])

    def to_tunnel(self, local: Float) -> Float:
        """Return local points in the tunnel's frame, (n, 3) or (3,)."""
        return np.asarray(local @ self.rotation().T + np.array(self.origin))

    def to_local(self, tunnel: Float) -> Float:
        """Return points of the tunnel's frame in the local frame, (n, 3) or (3,)."""
        return np.asarray((np.asarray(tunnel) - np.array(self.origin)) @ self.rotation())

    def local(self, soz: Float) -> Float:
        """Return local points (n, 3) of stations, offsets and heights (n, 3)."""
        soz = np.atleast_2d(np.asarray(soz, dtype=float))
        s, o = soz[:, 0], soz[:, 1]
        if self.radius == 0.0:
            return soz.copy()
        sign, size = math.copysign(1.0, self.radius), abs(self.radius)
        reach = size - sign * o
        return np.column_stack([reach * np.sin(s / size), self.radius - sign * reach * np.cos(s / size), soz[:, 2]])

    def stationed(self, local: Float) -> Float:
        """Return stations, offsets and heights (n, 3) of local points (n, 3)."""
        local = np.atleast_2d(np.asarray(local, dtype=float))
        if self.radius == 0.0:
            return local.copy()
        sign, size = math.copysign(1.0, self.radius), abs(self.radius)
        x, y = local[:, 0], local[:, 1]
        s = size * np.arctan2(x, sign * (self.radius - y))
        return np.column_stack([s, self.radius - sign * np.hypot(x, y - self.radius), local[:, 2]])

    def axes(self, station: float) -> Float:
        """Return unit vectors (3, 3) in the local frame at a station: along the axis, to its left, up."""
        angle = station / self.radius if self.radius != 0.0 else 0.0
        along = np.array([math.cos(angle), math.sin(angle), 0.0])
        return np.array([along, [-along[1], along[0], 0.0], [0.0, 0.0, 1.0]])

    def vertices(self, spacing: float) -> Float:
        """Return points (n, 3) of the axis in the tunnel's frame, at water level."""
        count = max(2, math.ceil(self.length / spacing) + 1)
        s = np.linspace(-0.5 * self.length, 0.5 * self.length, count)
        return self.to_tunnel(self.local(np.column_stack([s, np.zeros(count), np.zeros(count)])))
