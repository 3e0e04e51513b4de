"""Overviews: images with larger pixels, for displays that show more than a few blocks at once."""

from __future__ import annotations

import numpy as np
from affine import Affine

from tunneldb.arrays import Single, UInt8
from tunneldb.raster.geotiff import Raster
from tunneldb.raster.grid import BLOCK

PIXEL = 0.4
"""Maximum side of an overview's pixel, m; the image's pixel if that is larger."""


def shrink(values: Single, factor: int) -> Single:
    """Average blocks of ``factor`` × ``factor`` pixels, passing over NaNs; the image is filled up to whole blocks.

    Of an image in colour (rows, columns, 3) each band is averaged.
    """
    if values.ndim == 3:
        return np.dstack([shrink(values[:, :, band], factor) for band in range(values.shape[2])])
    rows, columns = (-(-n // factor) * factor for n in values.shape)
    padded = np.full((rows, columns), np.nan, np.float32)
    padded[: values.shape[0], : values.shape[1]] = values
    held = np.isfinite(padded)
    padded[~held] = 0.0
    # Whole rows are added first, then every factor-th column: that is many times as fast as adding blocks.
    bands = (rows // factor, factor, columns)
    total = _add_columns(padded.reshape(bands).sum(axis=1), factor)
    count = _add_columns(held.reshape(bands).sum(axis=1, dtype=np.float32), factor)
    return np.where(count > 0, total / np.maximum(count, 1.0), np.nan).astype(np.float32)


def _add_columns(values: Single, factor: int) -> Single:
    """Add ``factor`` neighbouring columns."""
    total = values[:, ::factor].copy()
    for k in range(1, factor):
        total += values[:, k::factor]
    return total


def shrink_codes(values: UInt8, factor: int) -> Single:
    """Return the most frequent code of ``factor`` × ``factor`` pixels, the greater of two; ignores 0, which becomes NaN."""
    rows, columns = (-(-n // factor) * factor for n in values.shape)
    padded = np.zeros((rows, columns), np.uint8)
    padded[: values.shape[0], : values.shape[1]] = values
    blocks = padded.reshape(rows // factor, factor, columns // factor, factor)
    out = np.full((rows // factor, columns // factor), np.nan, np.float32)
    most = np.ones(out.shape, np.int64)
    for code in np.flatnonzero(np.bincount(values.ravel(), minlength=256)[1:]) + 1:
        count = (blocks == code).sum(axis=(1, 3))
        out[count >= most] = code
        most = np.maximum(most, count)
    return out


def overview_factor(pixel: float) -> int:
    """Return the number of image pixels of a side, m, per overview pixel; a block has a whole number of overview pixels."""
    columns = round(BLOCK / pixel)
    return max(n for n in range(1, max(1, round(PIXEL / pixel)) + 1) if columns % n == 0)


class Overview:
    """Overview of a kilometre's image, collected block by block.

    Parameters
    ----------
    kind : str
        Kind of the image.
    """

    def __init__(self, kind: str) -> None:
        self.kind = kind
        self._parts: list[Raster] = []

    def add(self, block: Raster) -> None:
        """Add the next block along the tunnel; all have the same rows."""
        factor = overview_factor(block.transform.a)
        if self.kind == "state":
            codes = np.nan_to_num(block.values, nan=0.0).astype(np.uint8)
            values = shrink_codes(codes, factor)
        else:
            values = shrink(block.values, factor)
        self._parts.append(Raster(values, block.transform @ Affine.scale(factor)))

    def raster(self) -> Raster | None:
        """Return the whole image; None without a block."""
        if not self._parts:
            return None
        first, last = self._parts[0], self._parts[-1]
        pixel = first.transform.a
        columns = [round((part.transform.c - first.transform.c) / pixel) for part in self._parts]
        rows, width, *bands = last.values.shape
        values = np.full((rows, columns[-1] + width, *bands), np.nan, np.float32)
        for column, part in zip(columns, self._parts, strict=True):
            values[:, column : column + part.values.shape[1]] = part.values
        return Raster(values, first.transform)
