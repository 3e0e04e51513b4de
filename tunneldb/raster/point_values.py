"""Values of images at points of the unrolled plane."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tunneldb.arrays import Float, Single
from tunneldb.raster.geotiff import Raster


def values_at(images: Sequence[Raster], chainage: Float, arc: Float) -> Single:
    """Return the values of the pixels in which points lie.

    Parameters
    ----------
    images : sequence of Raster
        Blocks of one image; where they overlap, the last one counts.
    chainage, arc : (n,) float arrays
        Points, m; NaN off the tunnel.

    Returns
    -------
    (n,) float32 array
        NaN outside the images, and at pixels without a value.
    """
    values = np.full(len(chainage), np.nan, np.float32)
    for image in images:
        rows, columns = image.values.shape
        place = image.transform
        with np.errstate(invalid="ignore"):
            column, row = np.floor((chainage - place.c) / place.a), np.floor((arc - place.f) / place.e)
            inside = np.flatnonzero((column >= 0) & (column < columns) & (row >= 0) & (row < rows))
        values[inside] = image.values[row[inside].astype(np.intp), column[inside].astype(np.intp)]
    return values
