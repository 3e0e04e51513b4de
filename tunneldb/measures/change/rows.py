"""Change between two surveys, to and from the database."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import psycopg
import shapely
from psycopg import sql

from tunneldb.anomalies.geometries import Geometries
from tunneldb.arrays import Single, known
from tunneldb.finding_kind import DETECTED
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.measures.change.compute.leaks import Leak
from tunneldb.measures.change.compute.sections import Section
from tunneldb.raster.geotiff import Raster, decode, encode
from tunneldb.raster.grid import BLOCK
from tunneldb.store.images import load_kinds
from tunneldb.store.survey import Survey, get_survey


@dataclass(frozen=True)
class StoredRegion:
    """Region of change with its geometries."""

    outline: shapely.Polygon
    shaped: Geometries
    area: float
    mean: float
    lod: float
    extreme: float


@dataclass(frozen=True)
class StoredGroup:
    """Leaks of one place with their change of state, and multi-part geometries."""

    state: str
    old: Sequence[Leak]
    new: Sequence[Leak]
    areas: tuple[float, float, float, float]
    seen: tuple[float, float]
    clock: float
    unrolled: shapely.MultiPolygon
    map: shapely.MultiPolygon
    surface: shapely.MultiPolygon


def load_blocks(
    conn: psycopg.Connection[Any], survey: Survey, low: float, high: float
) -> Iterator[tuple[Raster, Single | None]]:
    """Load the blocks of the offset image between two chainages (m), also partial ones, with the state of pixels, if stored."""
    blocks = conn.execute(
        "SELECT km, block FROM tunnel.image WHERE survey_id = %s AND kind = 'offset' AND km BETWEEN %s AND %s"
        " ORDER BY km, block",
        [survey.id, int(low // KILOMETRE), int(high // KILOMETRE)],
    ).fetchall()
    for km, block in blocks:
        images = load_kinds(conn, survey, km, block, ("offset", "state"))
        offset = images["offset"]
        if offset.transform.c < high and offset.transform.c + BLOCK > low:
            yield offset, images["state"].values if "state" in images else None


def load_leaks(conn: psycopg.Connection[Any], survey: Survey, low: float, high: float) -> list[Leak]:
    """Load the findings that count between two chainages (m), also partly: leaks, joints, other dry dark areas."""
    rows = conn.execute(
        "SELECT id, coalesce(kind_override, kind), wet, area, contrast, public.ST_AsBinary(unrolled) FROM tunnel.finding"
        " WHERE survey_id = %s AND chainage_to > %s AND chainage_from < %s AND detected AND review <> 'rejected'"
        " AND NOT superseded AND (wet OR kind = ANY (%s)) ORDER BY id",
        [survey.id, low, high, list(map(str, DETECTED))],
    ).fetchall()
    return [
        Leak(id, kind, wet, area, contrast, shapely.make_valid(shapely.from_wkb(bytes(outline))))
        for id, kind, wet, area, contrast, outline in rows
    ]


def older_compared(
    conn: psycopg.Connection[Any], survey: Survey, low: float = -math.inf, high: float = math.inf
) -> Survey | None:
    """Return the last earlier survey that one was compared with between two chainages (m); None without any."""
    row = conn.execute(
        "SELECT o.name FROM tunnel.change_section c JOIN tunnel.survey o ON o.id = c.old_survey_id"
        " WHERE c.survey_id = %s AND c.chainage_to > %s AND c.chainage_from < %s AND o.date <= %s"
        " ORDER BY o.date DESC, o.name LIMIT 1",
        [survey.id, low, high, survey.date],
    ).fetchone()
    return None if row is None else get_survey(conn, row[0])


def clear_change(conn: psycopg.Connection[Any], old: Survey, new: Survey, km: int) -> None:
    """Delete the stored change of a kilometre."""
    for table in ("change_section", "change_image", "change_region", "leak_change"):
        query = sql.SQL("DELETE FROM {} WHERE survey_id = %s AND old_survey_id = %s AND km = %s").format(
            sql.Identifier("tunnel", table)
        )
        conn.execute(query, [new.id, old.id, km])


def save_sections(conn: psycopg.Connection[Any], old: Survey, new: Survey, km: int, sections: Sequence[Section]) -> None:
    """Save the sections of a kilometre."""
    query = (
        "COPY tunnel.change_section (survey_id, old_survey_id, km, chainage_from, chainage_to, seen_old, seen_new, seen_both,"
        " shift_right, shift_right_se, shift_up, shift_up_se, shift_along, shift_along_se, roll, roll_se, yaw, yaw_se, pitch,"
        " pitch_se, change_rms, change_least, change_greatest, lod, cell, arc_from,"
        " change) FROM STDIN"
    )
    with conn.cursor() as cursor, cursor.copy(query) as copy:
        for one in sections:
            motion = np.column_stack([one.motion.values, one.motion.errors]).ravel()
            figures = (known(value) for value in (*motion, one.rms, one.least, one.greatest, one.lod))
            copy.write_row(
                (new.id, old.id, km, one.low, one.high, one.seen_old, one.seen_new, one.seen_both, *figures, one.cell,
                 one.arc_from, one.change.tolist())
            )  # fmt: skip


def save_images(conn: psycopg.Connection[Any], old: Survey, new: Survey, km: int, change: Raster, lod: Raster) -> None:
    """Save the images of a kilometre."""
    for kind, raster in (("change", change), ("lod", lod)):
        conn.execute(
            "INSERT INTO tunnel.change_image (survey_id, old_survey_id, km, kind, tiff) VALUES (%s, %s, %s, %s, %b)",
            [new.id, old.id, km, kind, encode(raster, kind)],
        )


def load_images(conn: psycopg.Connection[Any], old: Survey, new: Survey, km: int) -> dict[str, Raster]:
    """Load the images of a kilometre by kind; empty if it was not compared."""
    rows = conn.execute(
        "SELECT kind, tiff FROM tunnel.change_image WHERE survey_id = %s AND old_survey_id = %s AND km = %s",
        [new.id, old.id, km],
        binary=True,
    ).fetchall()
    return {kind: decode(tiff) for kind, tiff in rows}


def save_regions(conn: psycopg.Connection[Any], old: Survey, new: Survey, km: int, regions: Sequence[StoredRegion]) -> None:
    """Save the regions of a kilometre."""
    with conn.cursor() as cursor:
        cursor.executemany(
            "INSERT INTO tunnel.change_region (survey_id, old_survey_id, km, chainage_from, chainage_to, arc_from, arc_to,"
            " clock, area, change_mean, lod, change_extreme, unrolled, map, surface)"
            " VALUES (%s, %s, %s, %s, %s, %s, %s, %s, %s, %s, %s, %s, public.ST_GeomFromWKB(%s, 0),"
            " public.ST_GeomFromWKB(%s, %s), public.ST_GeomFromWKB(%s, %s))",
            [
                (
                    new.id, old.id, km, one.outline.bounds[0], one.outline.bounds[2], one.outline.bounds[1],
                    one.outline.bounds[3], one.shaped.clock, one.area, one.mean, one.lod, one.extreme,
                    shapely.to_wkb(one.outline), shapely.to_wkb(one.shaped.map), old.srid,
                    shapely.to_wkb(one.shaped.surface), old.srid,
                )
                for one in regions
            ],
        )  # fmt: skip


def save_leaks(conn: psycopg.Connection[Any], old: Survey, new: Survey, km: int, found: Sequence[StoredGroup]) -> None:
    """Save the states of the leaks of a kilometre."""
    with conn.cursor() as cursor:
        cursor.executemany(
            "INSERT INTO tunnel.leak_change (survey_id, old_survey_id, km, state, old_ids, new_ids, old_kinds, new_kinds,"
            " area_old, area_old_se, area_new, area_new_se, seen_old, seen_new, chainage_from, chainage_to, clock, unrolled,"
            " map, surface) VALUES (%s, %s, %s, %s, %s::bigint[], %s::bigint[], %s::text[], %s::text[], %s, %s, %s, %s, %s, %s,"
            " %s, %s, %s, public.ST_GeomFromWKB(%s, 0), public.ST_GeomFromWKB(%s, %s), public.ST_GeomFromWKB(%s, %s))",
            [
                (
                    new.id, old.id, km, one.state, [leak.id for leak in one.old], [leak.id for leak in one.new],
                    [leak.kind for leak in one.old], [leak.kind for leak in one.new], *one.areas, *one.seen,
                    one.unrolled.bounds[0], one.unrolled.bounds[2], one.clock, shapely.to_wkb(one.unrolled),
                    shapely.to_wkb(one.map), old.srid, shapely.to_wkb(one.surface), old.srid,
                )
                for one in found
            ],
        )  # fmt: skip
