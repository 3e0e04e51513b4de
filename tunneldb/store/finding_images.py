"""Values of other images under findings, to the database, with the outlines that they are of."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import psycopg
import shapely
from shapely.geometry import Polygon

from tunneldb.raster.geotiff import RGB
from tunneldb.store.survey import Survey


@dataclass(frozen=True)
class Outline:
    """Outline of a finding in the unrolled plane, m, and the key by which the database knows that it has not changed since."""

    finding: int
    key: str
    polygon: Polygon


@dataclass(frozen=True)
class Row:
    """Values of an image under a finding; the fields are those of the table ``tunnel.finding_image``."""

    finding_id: int
    outline_key: str
    mean: float
    surroundings: float
    spread: float
    share: float


def load_outlines(conn: psycopg.Connection[Any], survey: Survey, low: float, high: float) -> list[Outline]:
    """Read the outlines of the findings of a survey that overlap a stretch, m, without lines and points, by chainage."""
    rows = conn.execute(
        "SELECT f.id, tunnel_internal.outline_key(f.unrolled), public.ST_AsBinary(f.unrolled) FROM tunnel.finding f"
        " WHERE f.survey_id = %s AND f.chainage_to >= %s AND f.chainage_from <= %s AND f.shape IS NULL"
        " ORDER BY f.chainage_from, f.id",
        [survey.id, low, high],
    ).fetchall()
    return [Outline(number, key, shapely.from_wkb(bytes(wkb))) for number, key, wkb in rows]


def measurable_images(conn: psycopg.Connection[Any], survey: Survey) -> dict[str, int | None]:
    """Return the kinds of the images of a survey under findings, with the number of each imported one: None is the scan's."""
    rows = conn.execute(
        "SELECT 'imported_' || i.name, i.id FROM tunnel.imported_image i WHERE i.survey_id = %s ORDER BY i.name", [survey.id]
    ).fetchall()
    return {RGB: None, **dict(rows)}


def replace_rows(conn: psycopg.Connection[Any], image_id: int | None, outlines: Sequence[Outline], rows: Iterable[Row]) -> None:
    """Replace the values of an image under findings; those of other findings stay."""
    conn.execute(
        "DELETE FROM tunnel.finding_image WHERE finding_id = ANY(%s) AND imported_image_id IS NOT DISTINCT FROM %s",
        [[outline.finding for outline in outlines], image_id],
    )
    with conn.cursor() as cursor:
        cursor.executemany(
            "INSERT INTO tunnel.finding_image (finding_id, imported_image_id, outline_key, mean, surroundings, spread, share)"
            " VALUES (%s, %s, %s, %s, %s, %s, %s)",
            [(row.finding_id, image_id, row.outline_key, row.mean, row.surroundings, row.spread, row.share) for row in rows],
        )
