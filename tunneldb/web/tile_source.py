"""Image blocks for tiles: read with the rights of a person, decoded once, and kept."""

from __future__ import annotations

import hashlib
from collections.abc import Hashable, Mapping

import numpy as np

from tunneldb.export.images.preview import OFFSET_SPANS
from tunneldb.export.images.tile_png import Stretch, imported_stretch, is_signed
from tunneldb.raster.colour_sums import FULL
from tunneldb.raster.geotiff import IMPORTED, Raster
from tunneldb.raster.grid import BLOCK, BLOCKS
from tunneldb.raster.overview import PIXEL
from tunneldb.raster.tiles import Tile, reduce
from tunneldb.store.desk.images import blocks, load_blocks, overview_of
from tunneldb.store.desk.surveys import Place
from tunneldb.web.block_cache import BlockCache
from tunneldb.web.sessions import Connection

PERCENTILES = (2.0, 98.0)
"""Shares of the pixels of an image that are darker than the darkest colour and than the brightest one, %."""

POINT_PIXEL = Tile(22, 0, 0).pixel
"""Side of the pixels from which points are coloured, m."""

SAMPLE = 200_000
"""Number of pixels, about, from which the colours are chosen."""


def tile_images(cache: BlockCache, conn: Connection, survey: Place, kind: str, tile: Tile) -> tuple[list[Raster], str]:
    """Return the images that a tile shows, with pixels of about its size, and a tag that changes if one of them does."""
    far = tile.pixel > PIXEL
    stored = overview_of(kind) if far else kind
    first, last = int(np.floor(tile.west / BLOCK)), int(np.ceil(tile.east / BLOCK)) - 1
    if far:
        first = first // BLOCKS * BLOCKS
    return _images(cache, conn, survey.id, kind, stored, (first, last), tile.pixel)


def stretch_images(cache: BlockCache, conn: Connection, survey: Place, kind: str, ends: tuple[float, float]) -> list[Raster]:
    """Return the images of a stretch, m, with pixels of POINT_PIXEL."""
    first, last = (int(np.floor(end / BLOCK)) for end in ends)
    return _images(cache, conn, survey.id, kind, kind, (first, last), POINT_PIXEL)[0]


def _images(
    cache: BlockCache, conn: Connection, survey_id: int, kind: str, stored: str, ends: tuple[int, int], pixel: float
) -> tuple[list[Raster], str]:
    # Zooms with pixels of nearly one size share an image.
    size = round(np.log2(pixel))
    there = blocks(conn, survey_id, stored, *ends)
    keys = {block.number: (survey_id, stored, block.number, block.version, size) for block in there}
    found = _kept(cache, keys)
    if len(found) < len(keys):
        with cache.loading:
            found = _kept(cache, keys)  # another request may have read them in the meantime
            missing = [number for number in keys if number not in found]
            for number, raster in load_blocks(conn, survey_id, stored, missing):
                found[number] = reduce(raster, pixel, kind == "state")
                cache.keep(keys[number], found[number])
    tag = hashlib.sha256(repr((size, sorted(keys.values()))).encode()).hexdigest()[:20]
    return [found[number] for number in sorted(found)], tag


def _kept(cache: BlockCache, keys: Mapping[int, Hashable]) -> dict[int, Raster]:
    return {number: image for number, key in keys.items() if (image := cache.find(key)) is not None}


def survey_stretch(cache: BlockCache, conn: Connection, survey: Place, kind: str) -> Stretch:
    """Return the values of the darkest and the brightest colour of a survey's image, from its overviews."""
    whole = (int(np.floor((survey.low or 0.0) / BLOCK)) - BLOCKS, int(np.ceil((survey.high or 0.0) / BLOCK)))
    images, tag = _images(cache, conn, survey.id, kind, overview_of(kind), whole, PIXEL)
    known = cache.stretches.get(tag)
    if known is None:
        known = cache.stretches[tag] = _stretch(images, kind)
    return known


def _stretch(images: list[Raster], kind: str) -> Stretch:
    if any(image.values.ndim == 3 for image in images):
        return Stretch(0.0, FULL)
    step = max(1, sum(image.values.size for image in images) // SAMPLE)
    values = np.concatenate([np.empty(0, np.float32), *(image.values.ravel()[::step] for image in images)])
    shown = values[np.isfinite(values)]
    if not len(shown):
        return Stretch(0.0, 1.0)
    if kind.startswith(IMPORTED):
        return imported_stretch(shown)
    if is_signed(kind):
        reach = float(np.percentile(np.abs(shown), 90.0))
        span = next((s for s in OFFSET_SPANS if s >= reach), OFFSET_SPANS[-1])
        return Stretch(-span, span)
    low, high = (float(v) for v in np.percentile(shown, PERCENTILES))
    return Stretch(round(low, 3), round(max(high, low + 1e-3), 3))
