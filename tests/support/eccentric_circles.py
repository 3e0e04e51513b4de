"""Circles off the axis, as a scan of them is held against a design."""

from __future__ import annotations

import numpy as np

from tunneldb.arrays import Float
from tunneldb.measures.deviation.compute import section_deviation
from tunneldb.shape.outline import Outline
from tunneldb.shape.profile import Deviation, Stretch, deviation


def ray(angle: Float, radius: float, right: float, up: float) -> Float:
    """Distance from the axis to a circle, in directions clockwise from up."""
    along = right * np.sin(angle) + up * np.cos(angle)
    return along + np.sqrt(along**2 + radius**2 - right**2 - up**2)


def held_against(outline: Outline, radius: float, right: float, up: float, pixel: float = 0.02) -> Float:
    """Cells of a circle held against an outline, as from an image."""
    pixels = round(2.0 * np.pi * radius / pixel)
    angle = -np.pi + 2.0 * np.pi * (np.arange(pixels) + 0.5) / pixels
    far = ray(angle, radius, right, up)
    found = deviation(
        Stretch("", 0.0, 1.0, outline, outline), np.zeros(1), far[None] * np.sin(angle), far[None] * np.cos(angle)
    )
    whole = Deviation(*(np.tile(part, (3, 1)) for part in (found.distance, found.share, found.curvature)))
    return section_deviation(whole, outline, pixel).deviation
