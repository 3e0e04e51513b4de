"""Darkening of outlines that people drew, relative to dry lining."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import Polygon

from tunneldb.anomalies.background.contrast import ContrastImage
from tunneldb.raster.geotiff import NODATA, STEP


@dataclass(frozen=True)
class Measurement:
    """Image measurements of an outline.

    Attributes
    ----------
    darkening_mean, darkening_max, contrast : float or None
        Mean and greatest darkening relative to dry lining, dB, and the mean in its standard deviations; None if not measured.
    image_share : float
        Share of its pixels that have points; pixels outside the image have none.
    """

    darkening_mean: float | None
    darkening_max: float | None
    contrast: float | None
    image_share: float


def measure_outline(contrast: ContrastImage, outline: Polygon) -> Measurement:
    """Measure the pixels whose centres are within an outline, or, if it is narrower than they are, those at its vertices.

    Parameters
    ----------
    contrast : ContrastImage
        Darkening of each pixel.
    outline : Polygon
        (chainage, arc), m.
    """
    pixel = contrast.grid.pixel
    west, south, east, north = outline.bounds
    x = (np.arange(np.floor(west / pixel), np.ceil(east / pixel)) + 0.5) * pixel
    y = (np.arange(np.floor(south / pixel), np.ceil(north / pixel)) + 0.5) * pixel
    chainage, arc = (axis.ravel() for axis in np.meshgrid(x, y))
    shapely.prepare(outline)
    inside = shapely.contains_xy(outline, chainage, arc)
    if inside.any():
        chainage, arc = chainage[inside], arc[inside]
    else:
        chainage, arc = shapely.get_coordinates(shapely.segmentize(outline, pixel)).T
    row, column = contrast.grid.place(chainage, arc)
    row, column = row[column >= 0], column[column >= 0]
    drop = contrast.drop[row, column]
    selected = drop != NODATA
    share = float(np.count_nonzero(selected)) / len(chainage)
    if not selected.any():
        return Measurement(None, None, None, share)
    decibels = STEP["corrected"] * drop[selected].astype(np.float64)
    sigma = contrast.sigma[row[selected] // contrast.tile, column[selected] // contrast.tile].astype(np.float64)
    known = sigma > 0
    relative = float(decibels[known].sum() / sigma[known].sum()) if known.any() else None
    return Measurement(float(decibels.mean()), float(decibels.max()), relative, share)
