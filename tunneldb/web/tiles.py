"""Tiles: images of the unrolled lining as PNG, findings as vector tiles."""

from __future__ import annotations

import re

from starlette.responses import Response

from tunneldb.errors import UserError
from tunneldb.export.images.tile_png import tile_png
from tunneldb.raster.tiles import Tile, display
from tunneldb.store.desk.findings import finding_tile
from tunneldb.store.desk.images import find_image
from tunneldb.web.route import Call, NotFoundError
from tunneldb.web.surveys import no_kind, survey_of
from tunneldb.web.tile_source import survey_stretch, tile_images

OUTLINE_ZOOM = 16
"""First zoom at which findings have outlines."""

REVALIDATE = "private, no-cache"
"""A browser keeps tiles, but asks each time whether they hold: what is seen is never older than the database."""


def image_tile(call: Call) -> Response:
    """Return a tile of an image; 304 if the browser has it."""
    kind, tile = call.path["kind"], tile_of(call, "png")
    with call.session.connection() as conn:
        survey = survey_of(conn, call.path["survey"])
        image = find_image(conn, survey.id, kind)
        if image is None:
            raise no_kind(kind)
        images, tag = tile_images(call.desk.blocks, conn, survey, kind, tile)
        headers = {"ETag": f'"{tag}"', "Cache-Control": REVALIDATE}
        if call.headers.get("if-none-match") == headers["ETag"]:
            return Response(status_code=304, headers=headers)
        if not images:
            return Response(status_code=204, headers=headers)
        stretch = survey_stretch(call.desk.blocks, conn, survey, kind)
    content = tile_png(display(tile, images, kind == "state"), image.palette, stretch)
    return Response(content, media_type="image/png", headers=headers)


def vector_tile(call: Call) -> Response:
    """Return a tile of findings."""
    tile = tile_of(call, "mvt")
    with call.session.connection() as conn:
        survey = survey_of(conn, call.path["survey"])
        bounds = (tile.west, tile.south, tile.east, tile.north)
        content = finding_tile(conn, survey.id, bounds, tile.zoom >= OUTLINE_ZOOM)
    return Response(content, media_type="application/vnd.mapbox-vector-tile", headers={"Cache-Control": "no-store"})


def tile_of(call: Call, suffix: str) -> Tile:
    """Return the tile of a path.

    Raises
    ------
    UserError
        If its numbers are none.
    NotFoundError
        If the grid has no such tile.
    """
    words = call.path["z"], call.path["x"], call.path["y"].removesuffix(f".{suffix}")
    if not all(re.fullmatch(r"\d{1,8}", word) for word in words):
        raise UserError("zoom, column and row of a tile are whole numbers")
    tile = Tile(*map(int, words))
    if not tile.exists:
        raise NotFoundError("the grid has no such tile")
    return tile
