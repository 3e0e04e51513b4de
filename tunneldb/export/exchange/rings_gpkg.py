"""Rings of a survey as a GeoPackage: on the map, on the unrolled lining, and their steps in cells of arc."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import psycopg
import pyogrio.raw
import shapely
from psycopg import sql

from tunneldb.export.tables.geopackage import UNDEFINED_CARTESIAN
from tunneldb.geometry.local import LOCAL
from tunneldb.measures.rings.tables import CIRCLE_COLUMNS, Row
from tunneldb.store.catalog import crs_text
from tunneldb.store.survey import Survey

_LAYERS = (
    ("ring_map", True, "Rings of the lining, on the map strip beside the axis; m, degrees, ovality as a share"),
    ("ring_unrolled", False, "Rings of the lining (chainage, arc); m, degrees, ovality as a share"),
)
"""Layers of polygons: name, which is that of the view, whether on the map, description."""

_STEPS = ("ring_step", "Steps from each ring to the next, in cells of arc, at the joint (chainage, arc), m")
_STEP_FIELDS = {"number": np.int64, "chainage": np.float64, "arc": np.float64, "step": np.float64, "step_se": np.float64}
_HARMONICS = ("harmonic", "harmonic_se", "harmonic_clock")
_TEXT = ("label", "joint", "shape", "diameter_from", "remark", *_HARMONICS)


def write_rings_gpkg(conn: psycopg.Connection[Any], survey: Survey, rows: list[Row], path: Path) -> None:
    """Write rings as `ring_rows` lists them, with the harmonics of their radius and the steps at their beginning."""
    crs = None if survey.srid == LOCAL else crs_text(conn, survey.srid)
    numbers = [row["number"] for row in rows]
    harmonics = {
        number: dict(zip(_HARMONICS, map(_listed, values), strict=True))
        for number, *values in conn.execute(
            "SELECT number, harmonic, harmonic_se, harmonic_clock FROM tunnel_api.ring"
            " WHERE survey_id = %s AND number = ANY (%s)",
            [survey.id, numbers],
        ).fetchall()
    }
    whole = [row | harmonics[row["number"]] for row in rows]
    named = dict.fromkeys(name for row in whole for name in row)
    names = [*(name for name in named if name not in CIRCLE_COLUMNS), *CIRCLE_COLUMNS]
    written = False
    for layer, on_map, text in _LAYERS:
        query = sql.SQL("SELECT number, public.ST_AsBinary(geom) FROM {} WHERE survey_id = %s AND number = ANY (%s)").format(
            sql.Identifier("tunnel_api", layer)
        )
        shapes = dict(conn.execute(query, [survey.id, numbers]).fetchall())
        placed = [row for row in whole if row["number"] in shapes]
        if not placed:  # off the map, where there is none
            continue
        geometry = np.array([bytes(shapes[row["number"]]) for row in placed], dtype=object)
        data = [_column(name, [row.get(name) for row in placed]) for name in names]
        _write(path, layer, text, geometry, "Polygon", names, data, crs if on_map else None, written)
        written = True
    steps = conn.execute(
        "SELECT number, chainage, arc, step, step_se FROM tunnel_api.ring_step"
        " WHERE survey_id = %s AND number = ANY (%s) ORDER BY number, cell",
        [survey.id, numbers],
    ).fetchall()
    if steps:
        data = [
            np.array(values, dtype=form) for values, form in zip(zip(*steps, strict=True), _STEP_FIELDS.values(), strict=True)
        ]
        points = np.array(shapely.to_wkb(shapely.points(data[1], data[2])), dtype=object)
        _write(path, *_STEPS, points, "Point", list(_STEP_FIELDS), data, None, written)


def _write(
    path: Path,
    layer: str,
    text: str,
    geometry: Any,
    kind: str,
    names: list[str],
    data: list[Any],
    crs: str | None,
    append: bool,
) -> None:
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "'crs' was not provided")  # the unrolled plane has none
        pyogrio.raw.write(
            str(path), geometry, data, np.array(names, dtype=object), geometry_type=kind, crs=crs, driver="GPKG", layer=layer,
            append=append, DESCRIPTION=text, **({} if crs else UNDEFINED_CARTESIAN),
        )  # fmt: skip


def _column(name: str, values: list[Any]) -> Any:
    """Convert a column for a GeoPackage: text, whole numbers, or numbers with NaN for missing ones."""
    if name in _TEXT:
        return np.array(values, dtype=object)
    if name == "number":
        return np.array(values, dtype=np.int64)
    return np.array([np.nan if value is None else value for value in values], dtype=np.float64)


def _listed(values: list[float] | None) -> str | None:
    return None if values is None else " ".join(f"{value:.6g}" for value in values)
