"""A round lining on a curve and a grade, whose measured axis lies off the given one, as surface, axis and offset image."""

from __future__ import annotations

import numpy as np
from affine import Affine

from tunneldb.arrays import Float
from tunneldb.geometry.alignment import Alignment
from tunneldb.geometry.frame import segment_rows, tangents
from tunneldb.geometry.surface import Surface
from tunneldb.measures.deviation.compute import STATIONS
from tunneldb.raster.geotiff import Raster
from tunneldb.raster.grid import BLOCK
from tunneldb.shape.outline import Outline

RADIUS, GRADE = 300.0, 0.02
"""Of the curve, m, and rise by metre."""


def arc(angle: float) -> float:
    """Bulge of an arc that turns clockwise through an angle, °."""
    return float(-np.tan(np.radians(angle) / 4.0))


def circle(radius: float, right: float = 0.0, up: float = 0.0) -> Outline:
    vertices = np.array([[right - radius, up], [right + radius, up]])
    return Outline.of(vertices, np.full(2, arc(180.0)), closed=True)


def helix(length: float, step: float, right: float = 0.0, up: float = 0.0) -> Float:
    """Vertices of an axis that curves to the right and climbs, moved to the right and up at right angles to it."""
    angle = np.arange(0.0, length + step / 2.0, step) / RADIUS
    tilt = np.arctan(GRADE)
    away = np.column_stack([np.cos(angle), -np.sin(angle)])
    flat = RADIUS * np.column_stack([1.0 - np.cos(angle), np.sin(angle)]) + right * away
    along = np.column_stack([np.sin(angle), np.cos(angle)])
    flat = flat - up * np.sin(tilt) * along
    return np.column_stack([5e5 + flat[:, 0], 4.6e6 + flat[:, 1], 600.0 + GRADE * RADIUS * angle + up * np.cos(tilt)])


def made(radius: float, length: float, right: float, up: float) -> tuple[Surface, Alignment]:
    """A round lining about the given axis, whose measured axis lies off the given one; and the given axis."""
    vertices = helix(length, 10.0, right, up)
    rows = segment_rows(vertices, tangents(vertices))
    starts = np.arange(len(rows)) * 10.0
    at = np.sort(np.concatenate([starts + 2.5, starts + 7.5]))
    angle = np.radians(np.arange(361) - 180.0)
    along = -(right * np.sin(angle) + up * np.cos(angle))
    ray = along + np.sqrt(along**2 + radius**2 - right**2 - up**2)
    u, w = ray * np.sin(angle), ray * np.cos(angle)
    arcs = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(u), np.diff(w)))])
    arcs -= arcs[180]
    surface = Surface(
        np.arange(len(rows)), rows, np.column_stack([starts, starts + 10.0]), at,
        np.tile(ray, (len(at), 1)), np.tile(arcs, (len(at), 1)), 10.0,
    )  # fmt: skip
    return surface, Alignment.from_polyline(helix(length, 1.0), 0.0, STATIONS)


def block(surface: Surface, west: float, pixel: float, length: float = BLOCK) -> Raster:
    """An offset image that shows the surface itself."""
    low, high = np.floor(surface.arcs.min() / pixel), np.ceil(surface.arcs.max() / pixel)
    values = np.zeros((int(high - low), round(length / pixel)), np.float32)
    return Raster(values, Affine(pixel, 0.0, west, 0.0, -pixel, high * pixel))
