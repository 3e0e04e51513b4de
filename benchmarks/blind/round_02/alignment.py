"""Line of the tunnel: straight or an arc in plan, with a grade."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .arrays import FloatArray


@dataclass(frozen=True)
class Alignment:
    """A line in plan that starts in `origin`.

    Tunnel coordinates are the chainage s, the offset u to the left and the height v above the floor; local ones are
    metres from `origin`, east, north and up.

    Attributes
    ----------
    origin : tuple
        Easting, northing and height of the floor where s = 0.
    heading : float
        Direction at s = 0, radians from east to the left.
    curvature : float
        One over the radius, positive to the left.
    grade : float
        Rise per metre.
    """

    origin: tuple[float, float, float]
    heading: float
    curvature: float = 0.0
    grade: float = 0.0

    def local(self, s: FloatArray, u: FloatArray, v: FloatArray) -> FloatArray:
        """Local coordinates of points given in tunnel coordinates."""
        if self.curvature:
            arm = 1 / self.curvature - u
            x = np.sin(self.curvature * s) * arm
            y = 1 / self.curvature - np.cos(self.curvature * s) * arm
        else:
            x, y = s + 0 * u, u + 0 * s
        c, k = np.cos(self.heading), np.sin(self.heading)
        return np.stack([c * x - k * y, k * x + c * y, v + self.grade * s], axis=-1)

    def tunnel(self, xyz: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Tunnel coordinates s, u, v of points given in local coordinates."""
        c, k = np.cos(self.heading), np.sin(self.heading)
        x = c * xyz[:, 0] + k * xyz[:, 1]
        y = c * xyz[:, 1] - k * xyz[:, 0]
        s, u = x, y
        if self.curvature:
            sign = np.sign(self.curvature)
            arm = 1 / self.curvature - y
            s = np.arctan2(sign * x, sign * arm) / self.curvature
            u = 1 / self.curvature - sign * np.hypot(x, arm)
        return s, u, xyz[:, 2] - self.grade * s

    def turn(self, s: FloatArray, vectors: FloatArray) -> FloatArray:
        """Components along s, u and v of local vectors at chainages `s`."""
        angle = self.heading + self.curvature * s
        c, k = np.cos(angle), np.sin(angle)
        along = c * vectors[:, 0] + k * vectors[:, 1]
        left = c * vectors[:, 1] - k * vectors[:, 0]
        return np.stack([along, left, vectors[:, 2] - self.grade * along], axis=-1)

    def unturn(self, s: FloatArray, vectors: FloatArray) -> FloatArray:
        """Local components of vectors given along s, u and v."""
        angle = self.heading + self.curvature * s
        c, k = np.cos(angle), np.sin(angle)
        x = c * vectors[:, 0] - k * vectors[:, 1]
        y = k * vectors[:, 0] + c * vectors[:, 1]
        return np.stack([x, y, vectors[:, 2] + self.grade * vectors[:, 0]], axis=-1)
