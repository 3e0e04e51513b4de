"""Scan files of a simulated tunnel, painted by the true places of their points."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import laspy
import numpy as np

from tunneldb.arrays import Float

Painter = Callable[[Float, Float], Float]
"""Function of chainages and arcs (n,), m, that returns colours (n, 3), 0 to 1; NaN for points without a colour."""


def paint(folder: Path, painter: Painter, *, full: int = 65535, point_format: int = 7) -> Path:
    """Give the points of the only LAZ file of a folder colours, of 8 or 16 bits, in a LAS point format."""
    (path,) = folder.glob("*.laz")
    (truth,) = folder.glob("*.truth.npz")
    places = np.load(truth)
    las = laspy.convert(laspy.read(path), point_format_id=point_format)
    assert len(las.points) == len(places["chainage"])
    colours = np.nan_to_num(np.rint(painter(places["chainage"], places["arc"]) * full)).astype(np.uint16)
    las.red, las.green, las.blue = colours.T
    las.write(path)
    return path


def stripes(chainage: Float, arc: Float) -> Float:
    """Return four colours in turn, 2 m of the tunnel each, darker below the springline; none from arc 3 m on."""
    table = np.array([[200, 60, 40], [40, 160, 90], [50, 80, 220], [230, 220, 40]], np.float64) / 255
    colours = table[np.floor(chainage / 2.0).astype(np.int64) % len(table)].copy()
    colours[arc < 0.0] *= 0.5
    colours[arc > 3.0] = np.nan
    return colours
