"""Tiles of unrolled images as PNG."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from PIL import Image

from tunneldb.arrays import Float, Single, UInt8
from tunneldb.export.images.palette import BLUE, PALETTES, RAMPS, RED, WHITE, Colour


@dataclass(frozen=True)
class Stretch:
    """Values that get the darkest and the brightest colour, in the image's unit."""

    low: float
    high: float


SHOWN = (0.5, 99.5)
"""Percentiles of the values of an imported image with the first and the last colour."""

MIN_SHOWN = 0.2
"""If these are nearer to each other than this share of all values, as with few hot spots, the least and the greatest are."""


def imported_stretch(values: Single | Float) -> Stretch:
    """Return the values of an imported image with the first and the last colour, from a sample of finite values."""
    if not len(values):
        return Stretch(0.0, 1.0)
    least, low, high, greatest = (float(v) for v in np.percentile(values, (0.0, *SHOWN, 100.0)))
    if high - low < MIN_SHOWN * (greatest - least):
        low, high = least, greatest
    return Stretch(round(low, 6), round(max(high, low + 1e-6), 6))


def is_signed(kind: str) -> bool:
    """Return True if the values of a kind of image have a sign: offset and deviation, m."""
    return kind == "offset" or kind.startswith("deviation")


def tile_png(values: Single, kind: str, stretch: Stretch) -> bytes:
    """Return values (rows, columns), or colours (rows, columns, 3), as a PNG, transparent where they are NaN."""
    written = io.BytesIO()
    paint(values, kind, stretch).save(written, "PNG", compress_level=1)
    return written.getvalue()


def paint(values: Single, kind: str, stretch: Stretch) -> Image.Image:
    """Return values (rows, columns), or colours (rows, columns, 3), as a picture, transparent where they are NaN."""
    if values.ndim == 3:
        return Image.fromarray(opaque(values), "RGBA")
    if kind in PALETTES:
        return Image.fromarray(_painted(values, kind), "RGBA")
    if kind in RAMPS:
        return Image.fromarray(_ramped(values, RAMPS[kind], stretch), "RGBA")
    if is_signed(kind):
        return Image.fromarray(_signed(values, stretch), "RGBA")
    return Image.fromarray(_grey(values, stretch), "LA")


def opaque(colours: Single) -> UInt8:
    """Return colours (rows, columns, 3) with opacity, 0 where there is no colour."""
    shown = np.isfinite(colours[:, :, :1])
    return np.dstack([np.rint(np.where(shown, colours, 0.0)), np.where(shown, 255, 0)]).astype(np.uint8)


def _ramped(values: Single, ramp: Sequence[Colour], stretch: Stretch) -> UInt8:
    """Return colours between those of a ramp, which are at equal distances."""
    shown = np.isfinite(values)
    share = (np.where(shown, values, stretch.low) - stretch.low) / max(stretch.high - stretch.low, 1e-9)
    place = np.clip(share, 0.0, 1.0) * (len(ramp) - 1)
    bands = [np.interp(place, np.arange(len(ramp)), [colour[band] for colour in ramp]) for band in range(3)]
    return np.dstack([*bands, np.where(shown, 255, 0)]).astype(np.uint8)


def _grey(values: Single, stretch: Stretch) -> UInt8:
    shown = np.isfinite(values)
    share = (np.where(shown, values, stretch.low) - stretch.low) / max(stretch.high - stretch.low, 1e-9)
    return np.dstack([np.clip(255.0 * share, 0, 255), np.where(shown, 255, 0)]).astype(np.uint8)


def _signed(values: Single, stretch: Stretch) -> UInt8:
    shown = np.isfinite(values)
    share = np.clip(np.where(shown, values, 0.0) / max(stretch.high, 1e-9), -1.0, 1.0)[..., None]
    ends = np.where(share < 0, np.array(BLUE), np.array(RED))
    colour = np.array(WHITE) + np.abs(share) * (ends - np.array(WHITE))
    return np.dstack([colour, np.where(shown, 255, 0)]).astype(np.uint8)


def _painted(values: Single, kind: str) -> UInt8:
    table = np.zeros((256, 4), np.uint8)
    for code, (_, colour) in PALETTES[kind].entries.items():
        table[code] = (*colour, 255)
    codes = np.where(np.isfinite(values), values, PALETTES[kind].nodata).astype(np.uint8)
    return np.asarray(table[codes])
