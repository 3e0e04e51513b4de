"""The axis of a tunnel in plan, and the way between site and national coordinates."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .arrays import Floats


@dataclass(frozen=True)
class Alignment:
    """Straight or circular axis of constant grade.

    In the site frame the axis leaves the origin along +X, heights Z; local coordinates are the chainage ``s``, ``u`` to the
    right and ``v`` above the floor.

    Attributes
    ----------
    origin : tuple of float
        Easting, northing and height of chainage 0 at the floor.
    azimuth : float
        Direction at chainage 0 in degrees, from north, clockwise.
    curvature : float
        1/m, left turns positive.
    grade : float
        Rise per metre.
    """

    origin: tuple[float, float, float]
    azimuth: float
    curvature: float = 0.0
    grade: float = 0.0

    def to_site(self, s: Floats, u: Floats, v: Floats) -> Floats:
        """Site coordinates (n × 3)."""
        k = self.curvature
        s, u, v = np.broadcast_arrays(s, u, v)
        z = v + self.grade * s
        if k == 0.0:
            return np.stack([s, -u, z], axis=-1)
        turn, reach = k * s, 1.0 / k + u
        return np.stack([reach * np.sin(turn), 1.0 / k - reach * np.cos(turn), z], axis=-1)

    def to_local(self, site: Floats) -> tuple[Floats, Floats, Floats]:
        """Chainage, offset and height."""
        k = self.curvature
        x, y, z = site[:, 0], site[:, 1], site[:, 2]
        if k == 0.0:
            return x, -y, z - self.grade * x
        across, ahead = 1.0 - k * y, k * x
        s = np.arctan2(ahead, across) / k
        return s, (np.hypot(ahead, across) - 1.0) / k, z - self.grade * s

    def direction_to_local(self, direction: Floats, s: Floats) -> tuple[Floats, Floats, Floats]:
        """Components of a direction along, to the right and up, where the chainage is ``s``."""
        turn = self.curvature * s
        c, n = np.cos(turn), np.sin(turn)
        along = direction[:, 0] * c + direction[:, 1] * n
        return along, direction[:, 0] * n - direction[:, 1] * c, direction[:, 2] - self.grade * along

    def direction_to_site(self, local: Floats, s: Floats) -> Floats:
        """The way back; the grade is part of the local height."""
        turn = self.curvature * s
        c, n = np.cos(turn), np.sin(turn)
        along, right = local[:, 0], local[:, 1]
        site = np.stack([along * c + right * n, along * n - right * c, local[:, 2] + self.grade * along], axis=1)
        return site / np.linalg.norm(site, axis=1)[:, None]

    def to_national(self, site: Floats) -> Floats:
        """Easting, northing and height."""
        turn = math.radians(90.0 - self.azimuth)
        c, n = math.cos(turn), math.sin(turn)
        x, y = site[..., 0], site[..., 1]
        return np.stack([x * c - y * n, x * n + y * c, site[..., 2]], axis=-1) + np.array(self.origin)
