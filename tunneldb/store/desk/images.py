"""Blocks of unrolled images, for tiles."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import psycopg

from tunneldb.raster.geotiff import RGB, Raster, decode
from tunneldb.raster.overview import PREFIX

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


def image_kinds(conn: psycopg.Connection[Any], survey_id: int) -> list[str]:
    """Return the kinds of images of a survey in the order of :data:`KINDS`, without overviews."""
    stored = {kind for (kind,) in conn.execute("SELECT k FROM tunnel_api.image_kinds(%s) AS k", [survey_id])}
    return [kind for kind in KINDS if kind in stored]


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
    return PREFIX + kind
