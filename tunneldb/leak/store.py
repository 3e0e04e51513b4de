"""Images, leaks and radiometry of a kilometre, to and from the database."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import psycopg
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon

from tunneldb.database import Survey
from tunneldb.geometry.surface import Surface
from tunneldb.intensity.dry import Dry
from tunneldb.intensity.reference import ReferenceCurve
from tunneldb.intensity.roughness import Roughness
from tunneldb.leak.detection import Detection, Found
from tunneldb.leak.geometries import shapes
from tunneldb.leak.image import Accumulator, Window
from tunneldb.leak.lining import block_columns
from tunneldb.leak.match import match
from tunneldb.leak.raster import Raster, encode


@dataclass(frozen=True)
class Matched:
    """What became of the leaks of an earlier run and of those found now."""

    new: int
    again: int
    kept: int
    gone: int


def load_reference(conn: psycopg.Connection[Any], survey: Survey) -> ReferenceCurve | None:
    """Read the reference curve of a survey, None when it has none."""
    rows = conn.execute(
        "SELECT range_m, intensity_db FROM tunnel.reference WHERE survey_id = %s ORDER BY range_m", (survey.id,)
    ).fetchall()
    if not rows:
        return None
    table = np.array(rows, dtype=np.float64)
    return ReferenceCurve.from_rows(table[:, 0], table[:, 1])


def load_regions(conn: psycopg.Connection[Any], survey: Survey, km: int, kind: str) -> list[Polygon]:
    """Read the polygons of a kind (homogeneous or dry) that the user drew in a kilometre, in the unrolled plane."""
    rows = conn.execute(
        "SELECT public.ST_AsBinary(geom) FROM tunnel.region WHERE survey_id = %s AND kind = %s"
        " AND public.ST_XMax(geom) > %s AND public.ST_XMin(geom) < %s ORDER BY id",
        (survey.id, kind, km * 1000.0, (km + 1) * 1000.0),
    ).fetchall()
    return [shapely.from_wkb(bytes(wkb)) for (wkb,) in rows]


def save_images(conn: psycopg.Connection[Any], survey: Survey, image: Accumulator, kinds: Sequence[str]) -> int:
    """Replace the images of a kilometre by blocks of 50 m; return how many pixels hold points."""
    grid, pixels = image.grid, 0
    conn.execute("DELETE FROM tunnel.image WHERE survey_id = %s AND km = %s", (survey.id, grid.km))
    for block in image.blocks():
        columns = block_columns(grid, block)
        window = image.window(columns.start, columns.stop)
        pixels += int(np.count_nonzero(window.count))
        for kind in kinds:
            raster = Raster(_values(window, kind), grid.transform(columns.start))
            conn.execute(
                "INSERT INTO tunnel.image (survey_id, km, kind, block, tiff) VALUES (%s, %s, %s, %s, %s)",
                (survey.id, grid.km, kind, grid.first_block + block, encode(raster, kind)),
            )
    return pixels


def _values(window: Window, kind: str) -> NDArray[np.float32]:
    values: NDArray[np.float32] = getattr(window, kind)
    return values


def save_leaks(conn: psycopg.Connection[Any], survey: Survey, km: int, surface: Surface, found: Sequence[Found]) -> Matched:
    """Replace the leaks of a kilometre; one that is found again keeps its id and its review.

    A leak is found again when it and an earlier one overlap best with each other, by at least 0.3 of their
    union. Of those not found again the reviewed ones stay, marked as not detected.
    """
    rows = conn.execute(
        "SELECT id, review, public.ST_AsBinary(unrolled) FROM tunnel.leak WHERE survey_id = %s AND km = %s"
        " ORDER BY id FOR UPDATE",
        (survey.id, km),
    ).fetchall()
    pairs = match([shapely.from_wkb(bytes(row[2])) for row in rows], [leak.outline for leak in found])
    for number, leak in enumerate(found):
        values = _row(leak, surface, survey.srid)
        if number in pairs:
            conn.execute(_UPDATE, {**values, "id": rows[pairs[number]][0]})
        else:
            conn.execute(_INSERT, {**values, "survey": survey.id, "km": km})
    again = set(pairs.values())
    lost = [row for k, row in enumerate(rows) if k not in again]
    kept = [row[0] for row in lost if row[1] != "open"]
    gone = [row[0] for row in lost if row[1] == "open"]
    conn.execute("UPDATE tunnel.leak SET detected = false WHERE id = ANY (%s)", (kept,))
    conn.execute("DELETE FROM tunnel.leak WHERE id = ANY (%s)", (gone,))
    return Matched(len(found) - len(again), len(again), len(kept), len(gone))


_INSERT = """
    INSERT INTO tunnel.leak (survey_id, km, chainage_from, chainage_to, arc_from, arc_to, clock, area, drop_mean, drop_max,
                             image_share, unrolled, map, surface)
    VALUES (%(survey)s, %(km)s, %(chainage_from)s, %(chainage_to)s, %(arc_from)s, %(arc_to)s, %(clock)s, %(area)s,
            %(drop_mean)s, %(drop_max)s, %(image_share)s, public.ST_GeomFromWKB(%(unrolled)s, 0),
            public.ST_GeomFromWKB(%(map)s, %(srid)s::int), public.ST_GeomFromWKB(%(surface)s, %(srid)s::int))
"""
_UPDATE = """
    UPDATE tunnel.leak
       SET chainage_from = %(chainage_from)s, chainage_to = %(chainage_to)s, arc_from = %(arc_from)s,
           arc_to = %(arc_to)s, clock = %(clock)s, area = %(area)s, drop_mean = %(drop_mean)s, drop_max = %(drop_max)s,
           image_share = %(image_share)s, unrolled = public.ST_GeomFromWKB(%(unrolled)s, 0),
           map = public.ST_GeomFromWKB(%(map)s, %(srid)s::int),
           surface = public.ST_GeomFromWKB(%(surface)s, %(srid)s::int), detected = true, detected_at = now()
     WHERE id = %(id)s
"""


def _row(leak: Found, surface: Surface, srid: int) -> dict[str, Any]:
    west, south, east, north = leak.outline.bounds
    shaped = shapes(leak.outline, surface)
    return {
        "chainage_from": west,
        "chainage_to": east,
        "arc_from": south,
        "arc_to": north,
        "clock": shaped.clock,
        "area": shaped.area,
        "drop_mean": leak.drop_mean,
        "drop_max": leak.drop_max,
        "image_share": leak.image_share,
        "unrolled": shapely.to_wkb(leak.outline),
        "map": shapely.to_wkb(shaped.strip),
        "surface": shapely.to_wkb(shaped.surface),
        "srid": srid,
    }


def save_radiometry(
    conn: psycopg.Connection[Any],
    survey: Survey,
    km: int,
    roughness: Roughness,
    found: Detection,
    sigma: tuple[Dry, Dry, Dry],
) -> None:
    """Replace the radiometry of a kilometre.

    Parameters
    ----------
    conn, survey, km
        Where.
    roughness : Roughness
        Stored as NULL where the incidence angles don't determine it.
    found : Detection
        Dry lining's statistics, threshold and pixel counts.
    sigma : three Dry
        Dry lining points raw, corrected by Lambert's law and by Oren–Nayar (Table 1 of Xu et al., 2018).
    """
    drop_radiometry(conn, survey, km)
    conn.execute(
        "INSERT INTO tunnel.radiometry (survey_id, km, roughness, dry_mean, dry_sigma, threshold, sigma_raw,"
        " sigma_lambert, sigma_oren_nayar, regions, pixels, wet_pixels)"
        " VALUES (%s, %s, %s, %s, %s, %s, %s, %s, %s, %s, %s, %s)",
        (
            survey.id,
            km,
            roughness.sigma if roughness.determined else None,
            *(_null(v) for v in (found.dry.mean, found.dry.sigma, found.dry.threshold)),
            *(_null(s.sigma) for s in sigma),
            roughness.regions,
            found.pixels,
            found.wet_pixels,
        ),
    )


def drop_radiometry(conn: psycopg.Connection[Any], survey: Survey, km: int) -> None:
    """Take away the radiometry of a kilometre."""
    conn.execute("DELETE FROM tunnel.radiometry WHERE survey_id = %s AND km = %s", (survey.id, km))


def _null(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
