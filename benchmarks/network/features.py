"""What the network sees of lining: images of 4 cm a pixel, relative to levels of several reaches and to the ring."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from benchmarks.network.sample import LIMIT, NONE, OTHER, WET, Sample

PIXEL = 0.04
"""Side of the network's pixels, m."""

LINING, RECESS, OFF, FLOOR, SUBMERGED = 1, 2, 3, 4, 6
"""States of pixels; those of :class:`tunneldb.raster.pixel_state.PixelState`, which an environment for training lacks."""

SMOOTH = (2.0, 5.0, 20.0, 75.0)
"""Standard deviations of the levels that lining is compared with, pixels: 0.08 to 3 m."""

TRUNCATE = 3.0
"""Reach of those, standard deviations."""

RING, EVERY, BRIGHT = 63, 25, 0.85
"""The brightest lining of a ring is the quantile BRIGHT of the columns up to RING pixels away, every EVERY columns."""

DEPTH, CONTRAST = 0.02, 3.0
"""Offset (m) and contrast (dB) that count as 1."""

NAMES = (
    "level to the ring", "smoothed level to the ring", "level to 0.2 m", "smoothed level to 0.8 m", "smoothed level to 3 m",
    "noise", "offset to 0.8 m", "filled", "fixture", "recess", "floor", "downwards", "height", "distance to the floor",
)  # fmt: skip
DOWN = NAMES.index("downwards")
"""The channel that changes its sign where a picture is turned upside down."""

Image = NDArray[np.float32]


@dataclass(frozen=True)
class Seen:
    """Input and truth at the network's resolution.

    Attributes
    ----------
    images : (rows, columns, len(NAMES)) float32 array
    label : (rows, columns) uint8 array
        DRY, WET, LIMIT or OTHER of :mod:`benchmarks.network.sample`.
    lining : (rows, columns) bool array
        Pixels that can be lining, with points or without.
    """

    images: Image
    label: NDArray[np.uint8]
    lining: NDArray[np.bool_]


def see(sample: Sample) -> Seen:
    """Bring a sample to the network's resolution."""
    by = round(PIXEL / sample.pixel)
    rows, columns = (n // by * by for n in sample.state.shape)
    top = sample.state.shape[0] - rows

    def blocks(image: NDArray) -> NDArray:
        return image[top:, :columns].reshape(rows // by, by, columns // by, by).swapaxes(1, 2).reshape(rows // by, -1, by * by)

    state = blocks(sample.state)
    level, count = _mean(blocks(sample.level), (state == LINING) | (state == RECESS), 0.01)
    offset, points = _mean(blocks(sample.offset), state != FLOOR, 0.001)
    off, recess, floor = ((np.isin(state, values).mean(-1) > 0.5) for values in (OFF, RECESS, (FLOOR, SUBMERGED)))
    labels = blocks(sample.label)
    label = np.where((labels == OTHER).mean(-1) >= 0.5, OTHER, 0)
    label = np.where((labels == WET).mean(-1) >= 0.5, WET, label)
    label = np.where((labels == LIMIT).any(-1), LIMIT, label).astype(np.uint8)
    arc = (sample.bottom * sample.pixel + (rows // by - np.arange(rows // by) - 0.5) * PIXEL)[:, None]
    images = _images(level, count / by**2, offset, points, off, recess, floor, arc)
    return Seen(images, label, ~off & ~floor)


def _mean(values: NDArray, use: NDArray, step: float) -> tuple[Image, Image]:
    use = use & (values != NONE)
    count = use.sum(-1).astype(np.float32)
    total = np.where(use, values, 0).sum(-1, dtype=np.float32) * np.float32(step)
    return total / np.maximum(count, 1.0), count


def _images(
    level: Image, filled: Image, offset: Image, points: Image, off: NDArray, recess: NDArray, floor: NDArray, arc: NDArray
) -> Image:
    """Stack the channels NAMES."""
    known = filled > 0
    smooth = {s: _level(level, filled, s) for s in SMOOTH}
    fine = smooth[2.0]
    ring = _ring(fine, known)
    for coarser in (smooth[5.0], smooth[20.0], smooth[75.0], np.broadcast_to(ring, fine.shape)):
        fine = np.where(np.isnan(fine), coarser, fine)
    own = np.where(known, level, fine)
    local, near, far = (np.where(np.isnan(smooth[s]), fine, smooth[s]) for s in SMOOTH[1:])
    rough = np.sqrt(_level(np.where(known, (own - fine) ** 2, 0.0).astype(np.float32), known.astype(np.float32), 12.0))
    noise = np.log(np.maximum(np.nan_to_num(rough, nan=0.3), 0.03) / 0.3)
    depth = offset - np.nan_to_num(_level(offset, points, 20.0))
    half = float(np.abs(arc).max())
    away = ndimage.distance_transform_edt(~floor) * PIXEL if floor.any() else np.full(floor.shape, 3.0)
    contrast = [np.clip(c / CONTRAST, -4.0, 4.0) for c in (own - ring, fine - ring, own - local, fine - near, fine - far)]
    channels = [
        *contrast, noise, np.clip(np.where(points > 0, depth, 0.0) / DEPTH, -3.0, 3.0), filled, off, recess, floor,
        np.broadcast_to(np.clip(arc, -1.0, 1.0), off.shape), np.broadcast_to(np.abs(arc) / half, off.shape),
        np.clip(away / 3.0, 0.0, 1.0),
    ]  # fmt: skip
    return np.stack([np.asarray(c, np.float32) for c in channels], axis=-1)


def _level(values: Image, weight: Image, sigma: float) -> Image:
    """Mean over the weighted pixels about each, NaN where there are hardly any."""
    total = ndimage.gaussian_filter(weight, sigma, truncate=TRUNCATE, mode="constant")
    mean = ndimage.gaussian_filter(values * weight, sigma, truncate=TRUNCATE, mode="constant")
    return np.where(total > 1e-3, mean / np.maximum(total, 1e-3), np.nan).astype(np.float32)


def _ring(level: Image, known: NDArray) -> Image:
    """Level (1, columns) of the brightest comparable lining about each column."""
    columns = level.shape[1]
    middles = np.arange(0, columns + EVERY, EVERY)
    values = np.full(len(middles), np.nan)
    for k, middle in enumerate(middles):
        here = slice(max(middle - RING, 0), middle + RING + 1)
        some = level[:, here][known[:, here]]
        if len(some) > 50:
            values[k] = np.quantile(some, BRIGHT)
    good = np.isfinite(values)
    if not good.any():
        return np.zeros((1, columns), np.float32)
    return np.interp(np.arange(columns), middles[good], values[good]).astype(np.float32)[None]
