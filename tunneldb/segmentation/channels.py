"""What the segmentation network sees of lining: states and levels in pixels of 4 cm, relative to the ring and to levels nearby.

Only the darkness of lining relative to other lining counts: a common shift of the intensity changes nothing. All values of a
pixel come from lining within :data:`REACH`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from tunneldb.arrays import Bool, Float, Int16, Single, UInt8
from tunneldb.raster.geotiff import NODATA, STEP
from tunneldb.raster.state import PixelState
from tunneldb.segmentation.smoothing import count_states, enlarged, mean_about

PIXEL = 0.04
"""Side of the network's pixels, m."""

STRIDE = 16
"""Pixels are numbered from chainage and arc 0; the network's coarsest pixels have so many of them."""

FINE, LOCAL = 2.0, 5.0
"""Standard deviations of the levels nearest to a pixel, pixels: 0.08 and 0.2 m."""

COARSE = 4
"""Levels of larger areas are computed on pixels so many times larger."""

NEAR, FAR, ROUGH = 5.0, 18.75, 3.0
"""Standard deviations of the levels within 0.8 m and 3 m, and of the noise (0.5 m), large pixels."""

TRUNCATE = 3.0
"""Reach of a level, standard deviations."""

RING, EVERY, BRIGHT = 16, 6, 0.85
"""The brightest lining of a ring is the quantile BRIGHT of the large pixels up to RING columns away, every EVERY columns."""

REACH = (math.ceil(TRUNCATE * FAR) + COARSE) * COARSE
"""Distance up to which lining counts, pixels."""

CONTRAST, NOISE = 3.0, 0.3
"""Contrast that counts as 1, and noise that counts as 0, dB."""

MAX_CONTRAST, MIN_NOISE = 4.0, 0.03
"""Maximum contrast, in units of CONTRAST, and minimum noise, dB."""

HIGH, LOW = 10.0, 3.0
"""Distances from the crown, and from the floor, that count as 1, m."""

NAMES = (
    "level to the ring", "level of 0.08 m to the ring", "level to 0.2 m", "level of 0.08 m to 0.8 m", "level of 0.08 m to 3 m",
    "noise", "filled", "fixture", "recess", "floor", "downwards", "distance to the crown", "distance to the floor",
)  # fmt: skip
"""Channels."""

DOWNWARDS = NAMES.index("downwards")
"""The channel that changes its sign where a picture is turned upside down."""


@dataclass(frozen=True)
class Scale:
    """Relation of the pixels of an image to those of the network.

    Attributes
    ----------
    combined : int
        Number of image pixels side by side that make one pixel of the network.
    repeated : int
        Number of the network's pixels side by side that one image pixel makes.
    """

    combined: int
    repeated: int

    @classmethod
    def of(cls, pixel: float) -> Scale:
        """Return the scale for image pixels of this size, m."""
        return cls(max(round(PIXEL / pixel), 1), max(round(pixel / PIXEL), 1))

    @property
    def unit(self) -> int:
        """Number of image pixels side by side that make whole pixels of STRIDE."""
        return self.combined * STRIDE // math.gcd(STRIDE, self.repeated)

    @property
    def span(self) -> int:
        """Number of pixels of the network side by side in as many image pixels as `unit`."""
        return self.unit // self.combined * self.repeated


@dataclass(frozen=True)
class Margins:
    """Image pixels that are missing to whole pixels of STRIDE above, below, left and right of a picture."""

    above: int
    below: int
    left: int
    right: int

    @classmethod
    def of(cls, shape: tuple[int, ...], bottom: int, first_column: int, unit: int) -> Margins:
        """Return the margins of a picture by the numbers of its lowest row and first column."""
        rows, columns = shape
        return cls(-(bottom + rows) % unit, bottom % unit, first_column % unit, -(first_column + columns) % unit)

    def pad(self, image: NDArray[Any], value: int) -> NDArray[Any]:
        """Add the margins to an image."""
        return np.pad(image, ((self.above, self.below), (self.left, self.right)), constant_values=value)


def channels(state: UInt8, level: Int16, pixel: float, bottom: int, first_column: int) -> tuple[Single, Margins]:
    """Compute the channels of a picture.

    Parameters
    ----------
    state : (rows, columns) uint8 array
        Values of :class:`tunneldb.raster.state.PixelState`, the first row at the greatest arc.
    level : (rows, columns) int16 array
        Corrected intensity in steps of the stored image, NODATA without a point.
    pixel : float
        Side of a pixel, m.
    bottom : int
        Arc of the lower edge of the last row, pixels.
    first_column : int
        Number of the first column, counted from chainage 0.

    Returns
    -------
    images : (len(NAMES), network rows, network columns) float32 array
        Multiples of STRIDE pixels, with margins beyond the picture, which are no lining.
    margins : Margins
    """
    scale = Scale.of(pixel)
    margins = Margins.of(state.shape, bottom, first_column, scale.unit)
    state, level = margins.pad(state, PixelState.OFF), margins.pad(level, NODATA)
    filled, values, mostly = count_states(state, level, scale.combined)
    values *= np.float32(STEP["corrected"])
    filled, values = repeated(filled, scale), repeated(values, scale)
    off, recess, floor = (repeated(one, scale) for one in mostly)
    side = pixel * scale.combined / scale.repeated
    lowest = (bottom - margins.below) // scale.combined * scale.repeated
    arc = ((lowest + len(values) - np.arange(len(values)) - 0.5) * side).astype(np.float32)[:, None]
    column = (first_column - margins.left) // scale.combined * scale.repeated
    away = ndimage.distance_transform_edt(floor[::COARSE, ::COARSE] == 0) * (COARSE * side) if floor.any() else None
    images = np.empty((len(NAMES), *values.shape), np.float32)
    _contrasts(values, filled, column // COARSE, images[:6])
    images[6], images[7], images[8], images[9] = filled, off, recess, floor
    images[10], images[11] = np.clip(arc, -1.0, 1.0), np.clip(np.abs(arc) / HIGH, 0.0, 1.0)
    images[12] = 1.0 if away is None else enlarged(np.clip(away / LOW, 0.0, 1.0).astype(np.float32), COARSE)
    return images, margins


def repeated(image: NDArray[Any], scale: Scale) -> NDArray[Any]:
    """Repeat the pixels of an image by a scale."""
    return image.repeat(scale.repeated, axis=0).repeat(scale.repeated, axis=1) if scale.repeated > 1 else image


def _contrasts(values: Single, filled: Single, column: int, out: Single) -> None:
    """Write the levels relative to other levels (5) and the noise; the first large column has the number ``column``."""
    known = filled > 0
    weight = known.astype(np.float32)
    total = _sums(weight)
    coarse = _divided(_sums(values), total)
    ring = _ring(coarse, total > 0, column)
    far = _filled(mean_about(coarse, total, FAR, TRUNCATE), ring)
    near = _filled(mean_about(coarse, total, NEAR, TRUNCATE), far)
    ring, near, far = enlarged(ring, COARSE)[:1], enlarged(near, COARSE), enlarged(far, COARSE)
    local = _filled(mean_about(values, weight, LOCAL, TRUNCATE), near)
    fine = _filled(mean_about(values, weight, FINE, TRUNCATE), local)
    own = np.where(known, values, fine)
    rough = mean_about(_divided(_sums((own - fine) ** 2), total), total, ROUGH, TRUNCATE)
    noise = np.log(np.maximum(np.sqrt(np.nan_to_num(rough, nan=NOISE**2)), MIN_NOISE) / NOISE)
    for k, (one, other) in enumerate([(own, ring), (fine, ring), (own, local), (fine, near), (fine, far)]):
        np.subtract(one, other, out=out[k])
    out[:5] /= np.float32(CONTRAST)
    out[5] = enlarged(noise, COARSE)
    np.clip(out, -MAX_CONTRAST, MAX_CONTRAST, out=out)


def _divided(sums: Single, counts: Single) -> Single:
    """Return means, 0 where nothing was counted."""
    return np.divide(sums, counts, out=np.zeros_like(sums), where=counts > 0)


def _filled(values: Single, others: Single) -> Single:
    """Return values, and others where they are NaN."""
    return np.where(np.isnan(values), others, values)


def _sums(image: Single) -> Single:
    """Return the sums over large pixels."""
    rows, columns = (size // COARSE for size in image.shape)
    return np.asarray(image.reshape(rows, COARSE, columns, COARSE).sum(axis=(1, 3), dtype=np.float32))


def _ring(level: Single, known: Bool, column: int) -> Single:
    """Return the level of the brightest lining about each column, the same in all rows."""
    columns = level.shape[1]
    middles = np.arange(-column % EVERY, columns, EVERY)
    found: Float = np.full(len(middles), np.nan)
    for k, middle in enumerate(middles.tolist()):
        here = slice(max(middle - RING, 0), middle + RING + 1)
        some = level[:, here][known[:, here]]
        if len(some) > RING:
            found[k] = np.quantile(some, BRIGHT)
    good = np.isfinite(found)
    if not good.any():
        return np.zeros(level.shape, np.float32)
    ring = np.interp(np.arange(columns), middles[good], found[good]).astype(np.float32)
    return np.broadcast_to(ring, level.shape)
