"""Chapter on images of other instruments: accuracy of their placement, and strips with the outlines of the leaks."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from PIL import Image

from tunneldb.arrays import Single
from tunneldb.export.images.palette import ramp_colours
from tunneldb.export.images.tile_png import Stretch, imported_stretch, paint
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.raster.geotiff import OVERVIEW, Raster
from tunneldb.raster.grid import BLOCK, BLOCKS
from tunneldb.raster.tiles import reduce
from tunneldb.report import text
from tunneldb.report.drawing import outline_path, ticks
from tunneldb.report.facts import Facts
from tunneldb.report.lining import NOTHING, QUALITY, Picture, Window
from tunneldb.report.strip import STRIP_PIXELS
from tunneldb.store.images import image_blocks, load_block, load_kinds
from tunneldb.store.imported_images import StoredImage, read_imported


@dataclass(frozen=True)
class ImageStrip:
    """A stretch of an imported image.

    Attributes
    ----------
    number : int
        Its number in the chapter.
    low, high : float
        Chainage at which it begins and ends, m.
    title : str
        Both, in the tunnel's stationing.
    picture : Picture
    ticks : list of (float, str)
        Distance from its beginning, m, and label.
    leaks : list of (int, str, str)
        Number, review and path of the outline of leaks that count.
    """

    number: int
    low: float
    high: float
    title: str
    picture: Picture
    ticks: list[tuple[float, str]]
    leaks: list[tuple[int, str, str]]


class ShownImage:
    """An imported image in a report.

    Parameters
    ----------
    facts : Facts
    row : StoredImage

    Attributes
    ----------
    stretch : Stretch
        Values with the first and the last colour.
    """

    def __init__(self, facts: Facts, row: StoredImage) -> None:
        self._facts, self.row = facts, row
        self.stretch = self._stretch()

    @property
    def colours(self) -> str:
        """Colours from the least to the greatest value, for CSS."""
        return ", ".join(ramp_colours(self.row.kind))

    def strips(self) -> Iterator[ImageStrip]:
        """Draw the strips of the report's stretch that have values of the image."""
        facts, number = self._facts, 0
        strips = facts.strips
        for start in strips.starts:
            low, high = max(start, facts.low), min(start + strips.length, facts.high)
            picture = self._picture(Window(low, high, strips.south, strips.north), strips.length / STRIP_PIXELS)
            if picture is None:
                continue
            number += 1
            places = ticks(low, high, strips.length / 10)
            names = [text.short(label) for label in facts.labels([low, high, *places])]
            leaks = [leak for leak in facts.leaks if leak.counts and leak.chainage_to > low and leak.chainage_from < high]
            yield ImageStrip(
                number, low, high, facts.request.owner.words("{low} to {high}", low=names[0], high=names[1]), picture,
                [(place - low, name) for place, name in zip(places, names[2:], strict=True)],
                [(leak.id, leak.review, outline_path(leak.outline, low, strips.north, strips.length / 2000)) for leak in leaks],
            )  # fmt: skip

    def _stretch(self) -> Stretch:
        if self.row.colour:
            return Stretch(0.0, 255.0)
        kind = OVERVIEW + self.row.image_kind
        sample = [np.empty(0, np.float32)]
        for km in _kilometres(self._facts.low, self._facts.high):
            raster = load_kinds(self._facts.conn, self._facts.survey, km, km * BLOCKS, [kind]).get(kind)
            if raster is not None:
                sample.append(raster.values[np.isfinite(raster.values)])
        values = np.concatenate(sample)
        return imported_stretch(values)

    def _picture(self, window: Window, pixel: float) -> Picture | None:
        """Draw a window; None without a value in it."""
        kind = self.row.image_kind
        size = max(1, round(window.height / pixel)), max(1, round(window.width / pixel))
        values = np.full((*size, 3) if self.row.colour else size, np.nan, np.float32)
        for km in _kilometres(window.west, window.east):
            blocks = image_blocks(self._facts.conn, self._facts.survey, km, kind)
            for block in (b for b in blocks if window.west < (b + 1) * BLOCK and window.east > b * BLOCK):
                raster = load_block(self._facts.conn, self._facts.survey, km, kind, block)
                _draw(values, reduce(raster, pixel, codes=False), window)
        if not np.isfinite(values).any():
            return None
        shown = paint(values, self.row.kind, self.stretch).convert("RGBA")
        canvas = Image.new("RGBA", shown.size, (*NOTHING, 255))
        canvas.alpha_composite(shown)
        out = io.BytesIO()
        form = self._facts.request.form
        canvas.convert("RGB").save(out, form, quality=QUALITY[form])
        return Picture(window, pixel, form, out.getvalue())


def read_images(facts: Facts) -> list[ShownImage]:
    """Return the imported images of a report's stretch; of a past moment those that had been imported by then."""
    rows = read_imported(facts.conn, facts.survey)
    return [
        ShownImage(facts, row)
        for row in rows
        if row.chainage_to > facts.low and row.chainage_from < facts.high and row.imported_at <= facts.request.at
    ]


def _kilometres(low: float, high: float) -> Sequence[int]:
    return range(int(np.floor(low / KILOMETRE)), int(np.ceil(high / KILOMETRE)))


def _draw(canvas: Single, raster: Raster, window: Window) -> None:
    """Write the nearest pixels of an image into those of a window."""
    rows, columns = canvas.shape[:2]
    chainage = window.west + (np.arange(columns) + 0.5) * window.width / columns
    arc = window.north - (np.arange(rows) + 0.5) * window.height / rows
    column = np.floor((chainage - raster.transform.c) / raster.transform.a).astype(np.int64)
    row = np.floor((raster.transform.f - arc) / raster.transform.a).astype(np.int64)
    across, along = (row >= 0) & (row < raster.values.shape[0]), (column >= 0) & (column < raster.values.shape[1])
    canvas[np.ix_(across, along)] = raster.values[np.ix_(row[across], column[along])]
