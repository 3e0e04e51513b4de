"""PNG previews of a kilometre's image: a strip for each 100 m or its used part, with a grid, ticks and a scale.

Gaps between profiles are filled in it, see :mod:`tunneldb.raster.gap_fill`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont
from shapely.geometry import Polygon

from tunneldb.arrays import Single, UInt8
from tunneldb.classification.classes import PointClass
from tunneldb.export.images.palette import BLUE, PALETTES, RED, WHITE
from tunneldb.finding_kind import REVIEW_COLOURS, rgb
from tunneldb.geometry.stationing import Stationing
from tunneldb.raster.gap_fill import MAX_FILL_DISTANCE, fill_gaps
from tunneldb.raster.geotiff import DEVIATION_KINDS, RGB

STRIP = 100.0
"""Length of a strip, m."""

PIXEL = 0.05
"""Minimum side of a preview's pixel, m; the image's pixel if that is larger."""

OFFSET_SPANS = (0.02, 0.05, 0.1, 0.2, 0.5)
"""Offsets of the full colour, m: the first within which nine tenths of the image are."""

_SIGNED = ("offset", *DEVIATION_KINDS.values())
"""Kinds of image with signed values."""

_MARGIN, _HEAD, _GAP = 84, 40, 26
_TICK = 10  # of chainage, m
_BACK, _INK, _GRID, _EMPTY = (255, 255, 255), (40, 40, 40), (150, 170, 200), (226, 229, 233)
_BLUE, _WHITE, _RED = (np.array(colour, np.float64) for colour in (BLUE, WHITE, RED))


@dataclass(frozen=True)
class Strip:
    """A hectometre of an image, or a part of one, at the preview's pixel.

    Attributes
    ----------
    start : float
        Chainage of its beginning, m.
    values : (rows, columns) float32 array
        From the greatest arc downwards, NaN without data.
    """

    start: float
    values: Single


def _filled(kind: str, values: Single, reach: float) -> Single:
    """Fill the gaps of an image; fixtures in them do not colour their surroundings. Gaps between states are shown."""
    if kind == "state":
        return values
    if kind != "class":
        return fill_gaps(values, reach)
    floating = values == PointClass.NOISE
    return np.where(floating, values, fill_gaps(np.where(floating, np.float32(np.nan), values), reach))


def draw(
    path: Path,
    title: str,
    kind: str,
    strips: Sequence[Strip],
    stationing: Stationing,
    top: float,
    pixel: float,
    leaks: Sequence[tuple[Polygon, str]] = (),
) -> None:
    """Draw strips below one another and write them as PNG.

    Parameters
    ----------
    path : Path
        File to write.
    title : str
        Heading.
    kind : str
        'raw', 'corrected', 'offset', 'rgb', 'state', 'class', or one of deviation. Intensities are drawn in grey between their
        2nd and 98th percentile, offsets and deviations in blue (outside) to red (inside), states and classes in their colours.
    strips : sequence of Strip
        In order of chainage.
    stationing : Stationing
        Labels of their ticks, every 10 m of chainage. Parts without any content before the first tick or behind the last are
        left out.
    top : float
        Arc of the upper edge, m.
    pixel : float
        Side of a pixel, m.
    leaks : sequence of (Polygon, str)
        Outlines to draw, (chainage, arc), m, in the colour of their review with a white rim.
    """
    strips = _held(strips, pixel)
    height, width = (max(s.values.shape[side] for s in strips) for side in (0, 1))
    low, high = _span(kind, strips)
    large, small = ImageFont.load_default(18), ImageFont.load_default(13)
    head = _head(ImageDraw.Draw(Image.new("RGB", (1, 1))), title, kind, strips, (low, high), large)
    sheet = Image.new("RGB", (max(width + _MARGIN, head) + 20, _HEAD + len(strips) * (height + _GAP) + 10), _BACK)
    pen = ImageDraw.Draw(sheet)
    _head(pen, title, kind, strips, (low, high), large)
    for number, strip in enumerate(strips):
        y = _HEAD + number * (height + _GAP)
        colours = _colours(kind, _filled(kind, strip.values, MAX_FILL_DISTANCE / pixel), low, high)
        sheet.paste(Image.fromarray(colours), (_MARGIN, y))
        _ticks(pen, strip, stationing, (_MARGIN, y), (width, height), top, pixel, small)
        for leak, review in leaks:
            if leak.bounds[0] < strip.start + width * pixel and leak.bounds[2] > strip.start:
                for ring in (leak.exterior, *leak.interiors):
                    line = [(_MARGIN + (c - strip.start) / pixel, y + (top - a) / pixel) for c, a in ring.coords]
                    for colour, wide in ((_BACK, 4), (rgb(REVIEW_COLOURS[review]), 2)):
                        pen.line(_clip(line, _MARGIN, _MARGIN + width), colour, wide)
    sheet.save(path, "PNG")


def _held(strips: Sequence[Strip], pixel: float) -> list[Strip]:
    """Return the strips from the first tick before any content to the last behind it."""
    there = np.zeros(max(s.values.shape[1] for s in strips), dtype=bool)
    for strip in strips:
        there[: strip.values.shape[1]] |= np.isfinite(strip.values).any(axis=(0, *range(2, strip.values.ndim)))
    at = np.flatnonzero(there)
    if len(at) == 0:
        return list(strips)
    # An edge may stand in the middle of a pixel.
    first = int((at[0] + 0.5) * pixel / _TICK) * _TICK
    last = int(np.ceil((at[-1] + 0.5) * pixel / _TICK)) * _TICK
    columns = slice(round(first / pixel), round(last / pixel))
    return [replace(strip, start=strip.start + first, values=strip.values[:, columns]) for strip in strips]


def _head(
    pen: ImageDraw.ImageDraw,
    title: str,
    kind: str,
    strips: Sequence[Strip],
    span: tuple[float, float],
    font: ImageFont.ImageFont | ImageFont.FreeTypeFont,
) -> int:
    """Write the title and the meaning of the colours, and return where it ends, pixels."""
    if kind in PALETTES:
        pen.text((_MARGIN, 8), f"{title}:", _INK, font)
        return _legend(pen, _MARGIN + int(pen.textlength(f"{title}:  ", font)), kind, strips, font)
    if kind == RGB:
        pen.text((_MARGIN, 8), title, _INK, font)
        return _MARGIN + int(pen.textlength(title, font))
    low, high = span
    scale = (
        f"blue {1e3 * low:+.0f} mm (outside) to red {1e3 * high:+.0f} mm (inside)"
        if kind in _SIGNED
        else f"black {low:.2f} dB to white {high:.2f} dB"
    )
    pen.text((_MARGIN, 8), f"{title}:  {scale}", _INK, font)
    return _MARGIN + int(pen.textlength(f"{title}:  {scale}", font))


def _clip(line: list[tuple[float, float]], left: float, right: float) -> list[tuple[float, float]]:
    return [(min(max(x, left), right), y) for x, y in line]


def _legend(
    pen: ImageDraw.ImageDraw,
    x: int,
    kind: str,
    strips: Sequence[Strip],
    font: ImageFont.ImageFont | ImageFont.FreeTypeFont,
) -> int:
    """Draw colour and name of each code present, and return where they end, pixels."""
    there = np.unique(np.concatenate([np.nan_to_num(s.values) for s in strips]))
    for code, (name, colour) in PALETTES[kind].entries.items():
        if code in there:
            pen.rectangle([(x, 11), (x + 14, 25)], colour, _INK)
            pen.text((x + 20, 8), name, _INK, font)
            x += 40 + int(pen.textlength(name, font))
    return x


def _span(kind: str, strips: Sequence[Strip]) -> tuple[float, float]:
    held = np.concatenate([s.values[np.isfinite(s.values)] for s in strips])
    if len(held) == 0 or kind in PALETTES or kind == RGB:
        return 0.0, 1.0
    if kind in _SIGNED:
        usual = float(np.percentile(np.abs(held), 90))
        span = next((s for s in OFFSET_SPANS if s >= usual), OFFSET_SPANS[-1])
        return -span, span
    low, high = (float(v) for v in np.percentile(held, [2, 98]))
    return low, max(high, low + 0.1)


def _colours(kind: str, values: Single, low: float, high: float) -> UInt8:
    """Return the colours (rows, columns, 3) of values; places without one are pale grey."""
    if kind in PALETTES:
        table = np.full((256, 3), _EMPTY, np.uint8)
        for code, (_, colour_of_code) in PALETTES[kind].entries.items():
            table[code] = colour_of_code
        return np.asarray(table[np.nan_to_num(values).astype(np.uint8)])
    if kind == RGB:
        return np.where(np.isnan(values), np.array(_EMPTY, np.float32), values).astype(np.uint8)
    with np.errstate(invalid="ignore"):
        share = np.clip((values - low) / (high - low), 0.0, 1.0)[..., None]
    if kind in _SIGNED:
        colour = np.where(share < 0.5, _BLUE + (_WHITE - _BLUE) * 2 * share, _WHITE + (_RED - _WHITE) * (2 * share - 1))
    else:
        colour = np.repeat(255.0 * share, 3, axis=2)
    colour[np.isnan(values)] = _EMPTY
    return np.asarray(colour, dtype=np.uint8)


def _ticks(
    pen: ImageDraw.ImageDraw,
    strip: Strip,
    stationing: Stationing,
    corner: tuple[int, int],
    size: tuple[int, int],
    top: float,
    pixel: float,
    font: ImageFont.ImageFont | ImageFont.FreeTypeFont,
) -> None:
    """Draw a grid every 10 m along the tunnel and every 5 m across, with labels; right and left are as seen up-chainage."""
    (x0, y0), (width, height) = corner, size
    length = round(width * pixel)
    for metre in range(0, length + 1, _TICK):
        x = x0 + round(metre / pixel)
        pen.line([(x, y0), (x, y0 + height)], _GRID, 1)
        if metre < length:
            pen.text((x + 2, y0 + height + 4), stationing.label(strip.start + metre, 0), _INK, font)
    bottom = top - height * pixel
    for arc in range(int(np.ceil(bottom / 5)) * 5, int(np.floor(top)) + 1, 5):
        y = y0 + round((top - arc) / pixel)
        pen.line([(x0, y), (x0 + width, y)], _GRID, 1)
        pen.text((6, y - 8), f"{'right' if arc > 0 else 'left'} {abs(arc)} m" if arc else "crown", _INK, font)
