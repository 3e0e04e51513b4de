"""What stands in the example survey: its floor, and things of every class, as boxes beside the axis."""

from __future__ import annotations

import numpy as np

from tunneldb.classification.classes import PointClass
from tunneldb.geometry.surface import Surface

FLOOR, HALF_FLOOR = 2.5, float(np.sqrt(4.0**2 - 2.5**2))
"""Depth of the floor below the axis, and half its width, m."""

CORNER = 4.0 * float(np.arccos(-FLOOR / 4.0))
"""Arc at which the wall meets the floor, m."""

THINGS = (
    # class, chainage, m right of the axis, length, width, height from, to
    (PointClass.OBJECT, 12352.0, 1.2, 0.4, 0.6, 0.0, 1.8),
    (PointClass.OBJECT, 12388.0, -1.5, 2.0, 1.0, 0.0, 1.1),
    (PointClass.RAIL, 12400.0, 0.72, 180.0, 0.1, 0.0, 0.17),
    (PointClass.APPENDAGE, 12450.0, -3.6, 60.0, 0.1, 1.0, 1.1),
)
SPHERES = ((12313.0, -2.0, 1.4), (12344.0, 2.2, 1.5), (12373.0, -2.4, 1.3), (12406.0, 2.0, 1.6), (12441.0, -2.2, 1.5))
"""Chainage, m right of the axis, and height above the floor."""


def beside(surface: Surface, chainage: float, across: np.ndarray, height: float) -> np.ndarray:
    """Points (n, 3) beside the axis, at a height above the floor."""
    origin, _, right, _ = surface.frames(np.array([chainage]))[0]
    points = origin + np.asarray(across, dtype=float)[:, None] * right
    points[:, 2] += height - FLOOR
    return points


def relief(chainage: np.ndarray, arc: np.ndarray) -> np.ndarray:
    """Return the offset of the lining from the surface of the sections, m."""
    return np.asarray(0.03 * np.sin(arc) * np.cos(chainage / 15))


def boxed(surface: Surface, thing: tuple[float, ...], step: float) -> np.ndarray:
    """Points (n, 3) that fill the box of a thing."""
    _, chainage, across, length, width, low, high = thing
    sides = np.arange(across - width / 2, across + width / 2, step) + step / 2
    heights = np.arange(low, high, step) + step / 2
    along = np.arange(chainage - length / 2, chainage + length / 2, step) + step / 2
    origin, _, right, _ = surface.frames(along).transpose(1, 0, 2)
    points = (origin[:, None] + sides[:, None] * right[:, None])[:, None].repeat(len(heights), axis=1)
    points[..., 2] += (heights - FLOOR)[:, None]
    return points.reshape(-1, 3)
