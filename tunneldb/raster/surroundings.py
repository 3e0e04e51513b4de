"""The values of an image under an outline, compared with those of the lining around it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Polygon

from tunneldb.arrays import Bool, Float, Single
from tunneldb.raster.geotiff import Raster

GAP = 0.05
"""Distance from the outline within which pixels belong neither to it nor to its surroundings, m; at least two pixels."""

REACH = 0.35
"""Distance from the outline to which its surroundings extend, m; at least ten pixels."""

MIN_INSIDE, MIN_AROUND = 4, 20
"""Minimum numbers of pixels with values under the outline, and around it."""

MIN_SHARE = 0.5
"""Minimum share of the pixels under the outline that have values."""


@dataclass(frozen=True)
class Comparison:
    """Values of an image under an outline, and around it.

    Attributes
    ----------
    mean : float
        Mean under the outline, in the image's unit; of an image in colour, CIE lightness L*, 0 to 100.
    surroundings : float
        Median around it.
    spread : float
        Standard deviation around it, from the median absolute deviation.
    share : float
        Share of the pixels under the outline that have values, 0 to 1.
    """

    mean: float
    surroundings: float
    spread: float
    share: float


def compare(outline: Polygon, others: Sequence[Polygon], blocks: Sequence[Raster]) -> Comparison | None:
    """Compare the values of an image under an outline with those around it.

    Parameters
    ----------
    outline : Polygon
        In the unrolled plane, m.
    others : sequence of Polygon
        Outlines of other findings, which are no surroundings.
    blocks : sequence of Raster
        Blocks of the image, whose pixels do not overlap.

    Returns
    -------
    Comparison or None
        None if the image shows too little of the outline or of its surroundings.
    """
    if not blocks:
        return None
    pixel = blocks[0].transform.a
    gap, reach = max(GAP, 2.0 * pixel), max(REACH, 10.0 * pixel)
    about = shapely.buffer(outline, reach)
    ring = shapely.difference(about, shapely.union_all([outline, *others]).buffer(gap))
    inside, around = [], []
    for block in blocks:
        values, x, y = _window(block, about)
        inside.append(values[_within(outline, x, y)])
        around.append(values[_within(ring, x, y)])
    return _compared(np.concatenate(inside), np.concatenate(around))


def _compared(inside: Float, around: Float) -> Comparison | None:
    shown, beside = inside[np.isfinite(inside)], around[np.isfinite(around)]
    if len(shown) < max(MIN_INSIDE, MIN_SHARE * len(inside)) or len(beside) < MIN_AROUND:
        return None
    middle = float(np.median(beside))
    spread = 1.4826 * float(np.median(np.abs(beside - middle)))
    return Comparison(float(shown.mean()), middle, spread, len(shown) / len(inside))


def _window(block: Raster, about: Polygon) -> tuple[Float, Float, Float]:
    """Return the values of a block, the chainages of the columns and the arcs of the rows, within the box of a polygon."""
    west, low, east, high = about.bounds
    chainage, arc = block.places()
    columns, rows = _between(chainage, west, east), _between(arc, low, high)
    return brightness(block.values[rows, columns]), chainage[columns], arc[rows]


def _between(places: Float, low: float, high: float) -> slice:
    (found,) = np.nonzero((places >= low) & (places <= high))
    return slice(int(found[0]), int(found[-1]) + 1) if len(found) else slice(0, 0)


def _within(area: Polygon | MultiPolygon, x: Float, y: Float) -> Bool:
    """Return which places of a grid (rows, columns) lie in an area."""
    shapely.prepare(area)
    return np.asarray(shapely.contains_xy(area, *np.meshgrid(x, y)), np.bool_)


def brightness(values: Single) -> Float:
    """Return values (rows, columns) as they are, and colours (rows, columns, 3), 0 to 255 in sRGB, as CIE lightness L*.

    Source: IEC 61966-2-1 (1999) for sRGB, and CIE 15 (2004), section 8.2.1.1, for L*.
    """
    if values.ndim == 2:
        return values.astype(np.float64)
    share = values.astype(np.float64) / 255.0
    linear = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    luminance = linear @ np.array([0.2126, 0.7152, 0.0722])
    root = np.where(luminance > (6.0 / 29.0) ** 3, np.cbrt(luminance), luminance * (29.0 / 6.0) ** 2 / 3.0 + 4.0 / 29.0)
    return np.asarray(116.0 * root - 16.0, np.float64)
