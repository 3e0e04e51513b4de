"""Images of other instruments in the unrolled plane, to and from the database."""

from __future__ import annotations

import datetime as dt
from dataclasses import dataclass, fields
from typing import Any, NamedTuple

import psycopg
from psycopg.rows import class_row

from tunneldb.errors import InputError, NotReadyError, did_you_mean
from tunneldb.raster.geotiff import IMPORTED, OVERVIEW, Raster, encode_imported
from tunneldb.raster.grid import BLOCKS
from tunneldb.raster.overview import Overview
from tunneldb.store.images import insert_image
from tunneldb.store.survey import Survey


class Extent(NamedTuple):
    """Extent of a survey's sections in the unrolled plane, m."""

    chainage_from: float
    chainage_to: float
    arc_from: float
    arc_to: float


@dataclass(frozen=True)
class ImportedImage:
    """Image of another instrument; see the table ``tunnel.imported_image`` for its fields."""

    name: str
    kind: str
    colour: bool
    unit: str
    value_from: float
    value_to: float
    step: float
    pixel: float
    placement: str
    model: str | None
    frames: int
    points: int | None
    outliers: int | None
    residual: float | None
    predicted: float | None
    chainage_from: float
    chainage_to: float
    arc_from: float
    arc_to: float
    source: str
    warnings: list[str]

    @property
    def image_kind(self) -> str:
        """Kind of its blocks in the table of images."""
        return IMPORTED + self.name


@dataclass(frozen=True)
class StoredImage(ImportedImage):
    """Stored image, with its import."""

    imported_by: str
    imported_at: dt.datetime


def section_extent(conn: psycopg.Connection[Any], survey: Survey) -> Extent:
    """Return the extent of the sections of a survey.

    Raises
    ------
    NotReadyError
        If it has none.
    """
    row = conn.execute(
        "SELECT min(s.chainage), max(s.chainage), min(s.arc[1]), max(s.arc[cardinality(s.arc)])"
        " FROM tunnel.section s WHERE s.survey_id = %s",
        [survey.id],
    ).fetchone()
    if row is None or row[0] is None:
        raise NotReadyError(
            f"survey {survey.name} has no sections, by which its lining is unrolled; run first: tunneldb run {survey.name}"
        )
    half = survey.spacing / 2.0  # a section extends so far beyond the last one
    return Extent(row[0] - half, row[1] + half, row[2], row[3])


def read_imported(conn: psycopg.Connection[Any], survey: Survey) -> list[StoredImage]:
    """Return the imported images of a survey by name."""
    names = ", ".join(field.name for field in fields(StoredImage))
    with conn.cursor(row_factory=class_row(StoredImage)) as cursor:
        query = f"SELECT {names} FROM tunnel.imported_image WHERE survey_id = %s ORDER BY name"
        return cursor.execute(query.encode(), [survey.id]).fetchall()


def replace_imported(conn: psycopg.Connection[Any], survey: Survey, image: ImportedImage) -> bool:
    """Write the row of an image and delete the pixels of a former one of that name; return True if there was one.

    The row is locked until the end of the transaction, so that two imports of one name do not mix.
    """
    names = [field.name for field in fields(ImportedImage)]
    values = [getattr(image, name) for name in names]
    changed = ", ".join(f"{name} = EXCLUDED.{name}" for name in names[1:])
    query = (
        f"INSERT INTO tunnel.imported_image (survey_id, {', '.join(names)}) VALUES ({', '.join(['%s'] * (len(names) + 1))})"
        f" ON CONFLICT (survey_id, name) DO UPDATE SET {changed}, imported_by = CURRENT_USER, imported_at = now()"
    )
    former = conn.execute(
        "SELECT FROM tunnel.imported_image WHERE survey_id = %s AND name = %s", [survey.id, image.name]
    ).fetchone()
    conn.execute(query.encode(), [survey.id, *values])
    _delete_pixels(conn, survey, image.name)
    return former is not None


def insert_pixels(
    conn: psycopg.Connection[Any],
    survey: Survey,
    km: int,
    image: ImportedImage,
    overview: Overview,
    block: int,
    raster: Raster,
) -> None:
    """Add a block of an imported image to the database, and to the overview of its kilometre."""
    overview.add(raster)
    insert_image(conn, survey, km, image.image_kind, block, encode_imported(raster, image.name, image.step, image.unit))


def insert_overview(conn: psycopg.Connection[Any], survey: Survey, km: int, image: ImportedImage, overview: Overview) -> None:
    """Add the overview of a kilometre of an imported image."""
    raster = overview.raster()
    if raster is not None:
        tiff = encode_imported(raster, image.name, image.step, image.unit)
        insert_image(conn, survey, km, OVERVIEW + image.image_kind, km * BLOCKS, tiff)


def remove_imported(conn: psycopg.Connection[Any], survey: Survey, name: str) -> None:
    """Delete an imported image.

    Raises
    ------
    InputError
        If there is none of that name.
    """
    done = conn.execute("DELETE FROM tunnel.imported_image WHERE survey_id = %s AND name = %s", [survey.id, name])
    if not done.rowcount:
        names = [image.name for image in read_imported(conn, survey)]
        known = f"it has {', '.join(names)}" if names else "it has none"
        raise InputError(f"survey {survey.name} has no imported image {name!r}: {known}.{did_you_mean(name, names)}")
    _delete_pixels(conn, survey, name)


def _delete_pixels(conn: psycopg.Connection[Any], survey: Survey, name: str) -> None:
    kinds = [IMPORTED + name, OVERVIEW + IMPORTED + name]
    conn.execute("DELETE FROM tunnel.image WHERE survey_id = %s AND kind = ANY(%s)", [survey.id, kinds])
