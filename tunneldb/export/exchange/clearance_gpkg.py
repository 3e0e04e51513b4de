"""Clearance as a GeoPackage: the nearest point of each metre, infringements in space and on the unrolled plane."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import psycopg
import pyogrio.raw
from psycopg import sql

from tunneldb.export.tables.geopackage import UNDEFINED_CARTESIAN
from tunneldb.geometry.local import LOCAL
from tunneldb.store.catalog import crs_text
from tunneldb.store.survey import Survey

_SECTION = {
    "label": object, "track": object, "chainage_from": float, "chainage_to": float, "margin": float, "margin_se": float,
    "clock": float, "class": object, "seen_share": float, "inside": int, "stray": int, "passing": int, "ground": int,
    "cant": float, "radius": float,
}  # fmt: skip
_INFRINGEMENT = {
    "label": object, "track": object, "chainage_from": float, "chainage_to": float, "depth": float, "clock": float,
    "class": object, "counts": bool, "points": int,
}  # fmt: skip
_LAYERS: tuple[tuple[str, str, str, str, dict[str, type]], ...] = (
    ("clearance_section", "clearance_section", "geom", "Point Z", _SECTION),
    ("clearance_infringement", "clearance_infringement", "geom", "MultiPoint Z", _INFRINGEMENT),
    ("clearance_infringement_unrolled", "clearance_infringement", "unrolled", "MultiPolygon", _INFRINGEMENT),
)


def write_clearance(
    conn: psycopg.Connection[Any], survey: Survey, gauge: str, track: str, low: float, high: float, path: Path
) -> None:
    """Write the layers of a stretch; one without rows is left out."""
    crs = None if survey.srid == LOCAL else crs_text(conn, survey.srid)
    written = False
    for layer, view, column, kind, fields in _LAYERS:
        query = sql.SQL(
            "SELECT {}, public.ST_AsBinary({column}) FROM {} WHERE survey_id = %s AND gauge = %s AND track = %s"
            " AND chainage_to > %s AND chainage_from < %s AND {column} IS NOT NULL ORDER BY chainage_from"
        ).format(
            sql.SQL(", ").join(map(sql.Identifier, fields)), sql.Identifier("tunnel_api", view), column=sql.Identifier(column)
        )  # fmt: skip
        rows = conn.execute(query, [survey.id, gauge, track, low, high]).fetchall()
        if not rows:
            continue
        *values, shapes = zip(*rows, strict=True)
        plane = column == "unrolled"
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "'crs' was not provided")  # the unrolled plane has none
            pyogrio.raw.write(
                str(path), np.array([bytes(shape) for shape in shapes], dtype=object),
                [np.array(part, dtype=form) for part, form in zip(values, fields.values(), strict=True)],
                np.array(list(fields)),
                geometry_type=kind, crs=None if plane else crs, driver="GPKG", layer=layer, append=written,
                **(UNDEFINED_CARTESIAN if plane or crs is None else {}),
            )  # fmt: skip
        written = True
