"""Blocks of unrolled images, for tiles."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import psycopg

from tunneldb.raster.geotiff import IMPORTED, OVERVIEW, RGB, Raster, decode, imported_label

KINDS = {
    "corrected": ("Corrected intensity", "dB"),
    "raw": ("Raw intensity", "dB"),
    RGB: ("Colour", ""),
    "offset": ("Offset from the surface", "m"),
    "state": ("State of the pixels", ""),
    "deviation_lining": ("Deviation of the lining", "m"),
    "deviation_shotcrete": ("Deviation of the shotcrete", "m"),
    "deviation_excavation": ("Deviation of the excavation", "m"),
}
"""Kinds of images in the order of lists, with title and unit."""


@dataclass(frozen=True)
class Block:
    """A stored block of an image.

    Attributes
    ----------
    number : int
        Along the tunnel: floor(chainage / 50).
    version : int
        Changes if the block is written again.
    """

    number: int
    version: int


@dataclass(frozen=True)
class ImageKind:
    """Image of a survey as the desk shows it.

    Attributes
    ----------
    kind : str
        Its kind: one of :data:`KINDS`, or ``imported_NAME``.
    label, unit : str
        Title and unit.
    palette : str
        Kind by which it is coloured: the kind itself, or that of an imported image, as ``thermal``.
    colour : bool
        True if it has colours, not values.
    """

    kind: str
    label: str
    unit: str
    palette: str
    colour: bool


def image_kinds(conn: psycopg.Connection[Any], survey_id: int) -> list[str]:
    """Return the kinds of images of a survey in the order of :data:`KINDS`, without overviews; imported images come last."""
    return [image.kind for image in images(conn, survey_id)]


def images(conn: psycopg.Connection[Any], survey_id: int) -> list[ImageKind]:
    """Return the images of a survey in the order of :data:`KINDS`; imported images come last."""
    stored = {kind for (kind,) in conn.execute("SELECT k FROM tunnel_api.image_kinds(%s) AS k", [survey_id])}
    own = [_own(kind) for kind in KINDS if kind in stored]
    return [*own, *_imported(conn, survey_id)] if any(kind.startswith(IMPORTED) for kind in stored) else own


def find_image(conn: psycopg.Connection[Any], survey_id: int, kind: str) -> ImageKind | None:
    """Return the image of a kind, which may have no blocks; None if there is no such kind."""
    if kind in KINDS:
        return _own(kind)
    if not kind.startswith(IMPORTED):
        return None
    return next((image for image in _imported(conn, survey_id) if image.kind == kind), None)


def _own(kind: str) -> ImageKind:
    return ImageKind(kind, *KINDS[kind], kind, kind == RGB)


def _imported(conn: psycopg.Connection[Any], survey_id: int) -> list[ImageKind]:
    rows = conn.execute(
        "SELECT name, kind, unit, colour FROM tunnel_api.imported_image WHERE survey_id = %s ORDER BY name", [survey_id]
    )
    return [ImageKind(IMPORTED + name, imported_label(name, kind), unit, kind, colour) for name, kind, unit, colour in rows]


def blocks(conn: psycopg.Connection[Any], survey_id: int, kind: str, first: int, last: int) -> list[Block]:
    """Return the stored blocks of an image between two numbers, both included."""
    rows = conn.execute("SELECT block, version FROM tunnel_api.image_versions(%s, %s, %s, %s)", [survey_id, kind, first, last])
    return [Block(*row) for row in rows]


def load_blocks(
    conn: psycopg.Connection[Any], survey_id: int, kind: str, numbers: Sequence[int]
) -> Iterator[tuple[int, Raster]]:
    """Yield the number and the image of blocks, by their numbers; those that no longer exist are missing."""
    rows = conn.execute(
        "SELECT block, tiff FROM tunnel_api.image_tiffs(%s, %s, %s)", [survey_id, kind, list(numbers)], binary=True
    )
    for number, tiff in rows.fetchall():
        yield number, decode(tiff, kind)


def overview_of(kind: str) -> str:
    """Return the kind of the overview of an image."""
    return OVERVIEW + kind
