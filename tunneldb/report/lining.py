"""Unrolled images of a survey as one picture, with any window at any pixel size; only a few blocks are in memory."""

from __future__ import annotations

import base64
import io
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import astuple, dataclass
from typing import Any, Literal

import numpy as np
import psycopg
from PIL import Image
from scipy import ndimage

from tunneldb.anomalies.threshold import filter_size, seen_lining
from tunneldb.anomalies.windows import on_lining
from tunneldb.arrays import Bool, Intp, Single, UInt8
from tunneldb.raster.gap_fill import MAX_FILL_DISTANCE, fill_gaps
from tunneldb.raster.geotiff import RGB, Raster, decode
from tunneldb.raster.grey import grey_range
from tunneldb.raster.grid import BLOCK
from tunneldb.raster.state import PixelState
from tunneldb.store.images import load_block
from tunneldb.store.survey import Survey

Form = Literal["WEBP", "JPEG"]
"""Format of pictures: WebP is smaller; JPEG goes into a PDF unchanged, while browsers unpack others to many times the size."""

CACHED_BLOCKS = 7
"""Number of blocks in memory: those of a strip of 250 m, the one before and the one after."""

NO_STATE = 255
"""Value without a state."""

FILLED = 0.14
"""Width of the square around a pixel without points whose mean it takes, m: about that of the median filter."""

CACHED_COLOURS = 2
"""Number of blocks in colour in memory: those of one leak."""

MIN_OFFSET_RANGE = 0.005
"""Minimum range of offsets from black to white, m."""

QUALITY = {"WEBP": 55, "JPEG": 70}
"""Quality of the pictures, 0 to 100."""

UNSEEN, COVERED, FLOOR, NOTHING = (216, 200, 230), (186, 208, 188), (236, 239, 242), (255, 255, 255)
"""Colours: lining not inspected; fixtures in front of it; floor, not inspected; no image."""


@dataclass(frozen=True)
class Window:
    """A rectangle of the unrolled plane: chainage from ``west`` to ``east``, arc from ``south`` to ``north``, m."""

    west: float
    east: float
    south: float
    north: float

    @property
    def width(self) -> float:
        """Length along the tunnel, m."""
        return self.east - self.west

    @property
    def height(self) -> float:
        """Length round the section, m."""
        return self.north - self.south

    def widened(self, side: float) -> Window:
        """Return the smallest window of whole pixels of that side, m, around it."""
        west, south = (float(np.floor(edge / side + 1e-6) * side) for edge in (self.west, self.south))
        east, north = (float(np.ceil(edge / side - 1e-6) * side) for edge in (self.east, self.north))
        return Window(west, east, south, north)


@dataclass(frozen=True)
class Picture:
    """Picture of a window, with pixels of a side, m: a file of an image."""

    window: Window
    side: float
    form: Form
    content: bytes

    @property
    def url(self) -> str:
        """Data URL of the image."""
        return f"data:image/{self.form.lower()};base64,{base64.b64encode(self.content).decode()}"


@dataclass(frozen=True)
class _Block:
    """A stored block.

    Attributes
    ----------
    shown : Raster
        Corrected intensity, dB, or offset from the surface, m.
    state : (rows, columns) uint8 array
        Values of :class:`PixelState` or NO_STATE.
    """

    shown: Raster
    state: UInt8

    def unseen(self, size: int) -> Bool:
        """Return the lining that detection did not inspect, by `seen_lining` and its filter's side, pixels."""
        about = size // 2
        # What lies beyond the block is not known here; as it lies within, so that no line runs along its edges.
        seen = [seen for _, seen in seen_lining(np.pad(self.state, about, "reflect"), size)]
        inner = slice(about, -about or None)
        return (self.state == PixelState.EMPTY) & ~np.concatenate(seen)[inner, inner]

    def lining(self) -> Single:
        """Return a sample of its lining, dB or m."""
        thin = (slice(None, None, 4), slice(None, None, 4))
        values = self.shown.values[thin]
        return values[np.isfinite(values) & np.isin(self.state[thin], (PixelState.LINING, PixelState.RECESS, PixelState.DARK))]


@dataclass(frozen=True)
class _Kilometre:
    """Rendering of a kilometre.

    Side of its pixels, m, and of the median filter, pixels; values shown black and white, dB or m.
    """

    pixel: float
    size: int
    low: float
    high: float


class Lining:
    """Reader of windows of a survey's images: corrected intensity, or offset without intensity.

    Parameters
    ----------
    conn, survey
        Source.
    form : {'WEBP', 'JPEG'}
        Format of the pictures.
    """

    def __init__(self, conn: psycopg.Connection[Any], survey: Survey, form: Form) -> None:
        self._conn, self._survey, self._form = conn, survey, form
        self._kind = "offset" if survey.intensity_kind == "none" else "corrected"
        rows = conn.execute(
            "SELECT block, min(km) FROM tunnel.image WHERE survey_id = %s AND kind = %s GROUP BY block", [survey.id, self._kind]
        ).fetchall()
        self._km: dict[int, int] = dict(rows)
        self._kept: OrderedDict[int, _Block] = OrderedDict()
        self._known: dict[int, _Kilometre] = {}
        self._unseen: OrderedDict[int, Bool] = OrderedDict()
        coloured = conn.execute(
            "SELECT DISTINCT block FROM tunnel.image WHERE survey_id = %s AND kind = %s", [survey.id, RGB]
        ).fetchall()
        self._coloured: set[int] = {block for (block,) in coloured}
        self._colours: OrderedDict[int, Raster] = OrderedDict()

    def picture(self, window: Window, pixel: float) -> Picture | None:
        """Draw a window; return None without an image.

        A pixel of the picture is about so large, m: a whole number of the image's own, which bounds the window anew.
        """
        there = {number: self._kilometre(self._km[number]) for number in _blocks(window) if number in self._km}
        if not there:
            return None
        native = max(kilometre.pixel for kilometre in there.values())
        side = native * max(1, round(pixel / native))
        window = window.widened(side)
        canvas = np.full((round(window.height / side), round(window.width / side), 3), NOTHING, np.uint8)
        offset = self._offset(window, side) if self._kind == "offset" else None
        for number, kilometre in there.items():
            place = _Place.of(self._block(number), self._hidden(number, kilometre.size), window, side)
            if place is not None:
                canvas[place.there] = _seen(place, side, kilometre) if offset is None else _grey(offset[place.there], kilometre)
        return self._written(canvas, window, side)

    def colours(self, like: Picture) -> Picture | None:
        """Draw the window of a picture in colour; return None without colours."""
        window, pixel = like.window, like.side
        there = [number for number in _blocks(window) if number in self._coloured]
        shape = round(window.height / pixel), round(window.width / pixel)
        sums = np.zeros((4, *shape), np.float32)
        for number in there:
            raster = self._rgb(number)
            unused = np.zeros(raster.values.shape[:2], np.uint8)
            place = _Place.of(_Block(raster, unused), unused.view(np.bool_), window, pixel)
            if place is not None:
                known = np.isfinite(place.values[:, :, 0])
                bands = (np.where(known, place.values[:, :, band], np.float32(0.0)) for band in range(3))
                sums[:, *place.there] += _sums((known, *bands), place.row, place.column)
        if not sums[0].any():
            return None
        means = np.dstack([_ratio(part, sums[0]) for part in sums[1:]])
        filled = fill_gaps(means, FILLED / pixel)
        canvas = np.where(np.isnan(filled), np.array(NOTHING, np.float32), filled).astype(np.uint8)
        return self._written(canvas, window, pixel)

    def _rgb(self, number: int) -> Raster:
        """Read a block in colour; the last two are kept."""
        if number not in self._colours:
            self._colours[number] = load_block(self._conn, self._survey, self._km[number], RGB, number)
            while len(self._colours) > CACHED_COLOURS:
                self._colours.popitem(last=False)
        self._colours.move_to_end(number)
        return self._colours[number]

    def _written(self, canvas: UInt8, window: Window, side: float) -> Picture:
        out = io.BytesIO()
        Image.fromarray(canvas).save(out, self._form, quality=QUALITY[self._form])
        return Picture(window, side, self._form, out.getvalue())

    def _offset(self, window: Window, side: float) -> Single:
        """Return the offset of a window, m, NaN for none, with gaps filled from its surroundings."""
        edge = int(np.ceil(MAX_FILL_DISTANCE / side))
        about = Window(*(end + way * edge * side for end, way in zip(astuple(window), (-1, 1, -1, 1), strict=True)))
        sums = np.zeros((2, round(about.height / side), round(about.width / side)), np.float32)
        for number in _blocks(about):
            if number not in self._km:
                continue
            block = self._block(number)
            place = _Place.of(block, np.zeros(block.state.shape, np.bool_), about, side)
            if place is not None:
                sums[:, *place.there] += place.sums()[:2]
        return fill_gaps(_ratio(sums[1], sums[0]), MAX_FILL_DISTANCE / side)[edge:-edge, edge:-edge]

    def _block(self, number: int) -> _Block:
        if number in self._kept:
            self._kept.move_to_end(number)
            return self._kept[number]
        rows: dict[str, bytes] = dict(
            self._conn.execute(
                "SELECT kind, tiff FROM tunnel.image WHERE survey_id = %s AND km = %s AND block = %s AND kind IN (%s, 'state')",
                [self._survey.id, self._km[number], number, self._kind],
                binary=True,
            ).fetchall()
        )
        shown = decode(rows[self._kind])
        if "state" in rows:
            state = np.nan_to_num(decode(rows["state"]).values, nan=NO_STATE)
        else:  # without intensity, and from before there were states
            state = np.where(np.isfinite(shown.values), np.float32(PixelState.LINING), np.float32(PixelState.EMPTY))
        self._kept[number] = block = _Block(shown, state.astype(np.uint8))
        while len(self._kept) > CACHED_BLOCKS:
            self._kept.popitem(last=False)
        return block

    def _hidden(self, number: int, size: int) -> Bool:
        """Return the lining of a block that was not inspected; none without intensity."""
        if self._kind == "offset":
            return np.zeros(self._block(number).state.shape, np.bool_)
        if number not in self._unseen:
            self._unseen[number] = self._block(number).unseen(size)
            while len(self._unseen) > CACHED_BLOCKS:
                self._unseen.popitem(last=False)
        self._unseen.move_to_end(number)
        return self._unseen[number]

    def _kilometre(self, km: int) -> _Kilometre:
        """Find the values for black and white, from up to three of the kilometre's blocks."""
        if km not in self._known:
            numbers = sorted(number for number, where in self._km.items() if where == km)
            blocks = [self._block(numbers[n]) for n in sorted({0, len(numbers) // 2, len(numbers) - 1})]
            values = np.concatenate([block.lining() for block in blocks])
            low, high = grey_range(values) if self._kind == "corrected" else _offset_range(values)
            pixel = blocks[0].shown.transform.a
            empty = sum(int(np.count_nonzero(block.state == PixelState.EMPTY)) for block in blocks)
            filled = sum(int(np.count_nonzero(on_lining(block.state))) for block in blocks)
            size = filter_size(max(filled, 1) / max(filled + empty, 1))
            self._known[km] = _Kilometre(pixel, size, low, high)
        return self._known[km]


@dataclass(frozen=True)
class _Place:
    """Part of a block in a window, and its place.

    Attributes
    ----------
    there : (slice, slice)
        Rows and columns of the window's picture.
    values, state, hidden : (rows, columns) arrays
        Of the block's pixels in it; hidden are those of lining not inspected.
    row, column : (rows,), (columns,) arrays
        Row and column of the picture that they fall into, from the first of these on; both grow without gaps.
    """

    there: tuple[slice, slice]
    values: Single
    state: UInt8
    hidden: Bool
    row: Intp
    column: Intp

    @classmethod
    def of(cls, block: _Block, hidden: Bool, window: Window, side: float) -> _Place | None:
        """Find the place of a block in a window with pixels of that side, m; None if it has none."""
        transform, (height, width) = block.shown.transform, block.shown.values.shape[:2]
        column = np.floor((transform.c + transform.a * (np.arange(width) + 0.5) - window.west) / side).astype(np.intp)
        row = np.floor((window.north - transform.f - transform.e * (np.arange(height) + 0.5)) / side).astype(np.intp)
        part = _inside(row, round(window.height / side)), _inside(column, round(window.width / side))
        row, column = row[part[0]], column[part[1]]
        if not len(row) or not len(column):
            return None
        there = slice(row[0], row[-1] + 1), slice(column[0], column[-1] + 1)
        return cls(there, block.shown.values[part], block.state[part], hidden[part], row - row[0], column - column[0])

    def sums(self) -> Single:
        """Sum up the block's pixels, see :func:`_accumulate`."""
        return _accumulate(self.values, self.state, self.hidden, self.row, self.column)


def _blocks(window: Window) -> range:
    """Return the numbers of the blocks that a window touches."""
    return range(int(np.floor(window.west / BLOCK)), int(np.ceil(window.east / BLOCK)))


def _inside(place: Intp, count: int) -> slice:
    """Return those of increasing places from 0 to ``count`` - 1."""
    return slice(int(np.searchsorted(place, 0)), int(np.searchsorted(place, count)))


def _offset_range(values: Single) -> tuple[float, float]:
    """Return the offsets, m, for black and white: the 1st and the 98th percentile."""
    low, high = (float(v) for v in np.percentile(values, [1, 98])) if len(values) else (0.0, 1.0)
    return low, max(high, low + MIN_OFFSET_RANGE)


def _grey(values: Single, kilometre: _Kilometre) -> UInt8:
    """Return values scaled from black to white, and empty ones without a value."""
    shade = np.clip((values - kilometre.low) / (kilometre.high - kilometre.low), 0.0, 1.0)
    grey = np.repeat(255.0 * np.nan_to_num(shade), 3).reshape(*shade.shape, 3).astype(np.uint8)
    grey[np.isnan(values)] = NOTHING
    return grey


def _seen(place: _Place, side: float, kilometre: _Kilometre) -> UInt8:
    """Return colours of corrected intensity and of lining not inspected, hidden or outside."""
    known, level, lining, unseen, off, floor = place.sums()
    about = 2 * round(max(FILLED, kilometre.size * kilometre.pixel) / side / 2) + 1

    def smooth(what: Single) -> Single:
        return ndimage.uniform_filter(what, about, mode="nearest") if about > 1 else what

    mean = np.where(known > 0, _ratio(level, known), _ratio(smooth(level), smooth(known)))
    shade = np.clip((mean - kilometre.low) / (kilometre.high - kilometre.low), 0.0, 1.0)
    grey = np.repeat(255.0 * np.nan_to_num(shade, nan=0.75), 3).reshape(*shade.shape, 3)
    other = lining + off + floor
    tints = ((unseen, UNSEEN, 1.0), (off, COVERED, 0.55), (floor, FLOOR, 0.92))
    for part, colour, opaque in tints:
        mask = part > other / 2
        grey[mask] = (1 - opaque) * grey[mask] + opaque * np.array(colour, np.float32)
    return grey.astype(np.uint8)


def _accumulate(values: Single, state: UInt8, hidden: Bool, row: Intp, column: Intp) -> Single:
    """Sum up the pixels that fall into each coarser one.

    Number with points, sum of their intensities, number of lining, of lining not inspected, of fixtures, floor or
    water. (6, rows, columns).
    """
    floor = (state == PixelState.FLOOR) | (state == PixelState.SUBMERGED) | (state == NO_STATE)
    off = state == PixelState.OFF
    known = np.isfinite(values)
    return _sums((known, np.where(known, values, 0.0), ~(floor | off), hidden, off, floor), row, column)


def _sums(layers: Sequence[Bool | Single], row: Intp, column: Intp) -> Single:
    """Sum up the pixels of layers (rows, columns) that fall into each coarser one."""
    first = [np.flatnonzero(np.diff(place, prepend=-1)) for place in (row, column)]
    sums = np.empty((len(layers), len(first[0]), len(first[1])), np.float32)
    for k, layer in enumerate(layers):
        kind = np.float64 if layer.dtype == np.float32 else np.float32  # whole numbers are exact in both
        for axis, starts in enumerate(first):
            if len(starts) < layer.shape[axis]:
                layer = np.add.reduceat(layer, starts, axis, kind)
        sums[k] = layer
    return sums


def _ratio(part: Single, whole: Single) -> Single:
    """Return the quotient, NaN if the divisor is 0."""
    return np.divide(part, whole, out=np.full(part.shape, np.nan, np.float32), where=whole > 1e-3)
