"""Projection of points into pictures: pinhole, spherical and cylindrical cameras.

A pixel coordinate counts from the left and from the upper edge of the picture: the middle of the first pixel is at (0.5, 0.5).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from tunneldb.arrays import Float
from tunneldb.compiled import point_inner, point_kernel

Projection = Literal["pinhole", "spherical", "cylindrical"]
PROJECTIONS: tuple[Projection, ...] = ("pinhole", "spherical", "cylindrical")


@dataclass(frozen=True)
class Camera:
    """A camera with its place.

    Attributes
    ----------
    projection : str
        Pinhole: x to the right, y upwards, looking along -z. Spherical and cylindrical: z upwards; the middle column looks
        along x, and columns to the right look to the right.
    columns, rows : int
        Size of its pictures.
    pixel_width, pixel_height : float
        Size of a pixel: rad (spherical; width of cylindrical ones) or m.
    focal : float
        Focal length of a pinhole camera, or radius of a cylinder, m.
    principal : (float, float)
        Column and row of the principal point; of cylindrical pictures only its row is used.
    rotation : (3, 3) float64 array
        Rotation from its frame to the tunnel's.
    position : (3,) float64 array
        Its place, m.
    """

    projection: Projection
    columns: int
    rows: int
    pixel_width: float
    pixel_height: float
    focal: float
    principal: tuple[float, float]
    rotation: Float
    position: Float

    @property
    def pixel_angle(self) -> float:
        """Angle of a pixel in the middle of a picture, rad."""
        return self.pixel_width / self.focal if self.projection == "pinhole" else self.pixel_width

    @property
    def numbers(self) -> Float:
        """Code of the projection, columns, rows, size of a pixel, focal length, and principal point, for compiled loops."""
        code = float(PROJECTIONS.index(self.projection))
        size = self.columns, self.rows, self.pixel_width, self.pixel_height
        return np.array([code, *size, self.focal, *self.principal], np.float64)

    def project(self, points: Float) -> tuple[Float, Float]:
        """Return column and row of points (n, 3), m; NaN where a picture does not show them."""
        own = np.ascontiguousarray((points - self.position) @ self.rotation)
        pixels = np.empty((len(own), 2))
        _project(self.numbers, own, pixels)
        return pixels[:, 0], pixels[:, 1]


@point_inner
def pixel_of(numbers: Float, x: float, y: float, z: float) -> tuple[float, float]:  # pragma: no cover - compiled
    """Return column and row of a point in the frame of a camera; NaN where a picture does not show it.

    Source: ASTM E2807-11, on the representations of images.

    Parameters
    ----------
    numbers : (8,) float array
        `Camera.numbers`.
    x, y, z : float
        The point, m.
    """
    columns, rows, width, height, focal = numbers[1], numbers[2], numbers[3], numbers[4], numbers[5]
    if numbers[0] == 0.0:
        column = row = np.nan
        if z < 0.0:
            column = numbers[6] - x / z * (focal / width)
            row = numbers[7] + y / z * (focal / height)
    else:
        plan = np.sqrt(x * x + y * y)
        column = 0.5 * columns - np.arctan2(y, x) / width
        row = numbers[7] - z / plan * (focal / height)
        if numbers[0] == 1.0:
            row = 0.5 * rows - np.arctan2(z, plan) / height
    if column >= 0.0 and column <= columns and row >= 0.0 and row <= rows:
        return column, row
    return np.nan, np.nan


@point_kernel
def _project(numbers: Float, points: Float, pixels: Float) -> None:  # pragma: no cover - compiled
    for k in range(points.shape[0]):
        pixels[k, 0], pixels[k, 1] = pixel_of(numbers, points[k, 0], points[k, 1], points[k, 2])
