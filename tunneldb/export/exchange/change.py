"""Change between two surveys as GeoPackage and as workbook."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import psycopg
import pyogrio.raw
from psycopg import sql

from tunneldb.export.tables.geopackage import UNDEFINED_CARTESIAN
from tunneldb.export.tables.workbook import Column, Sheet, write_workbook
from tunneldb.geometry.local import LOCAL
from tunneldb.measures.change.tables import COLUMNS, Row
from tunneldb.store.catalog import crs_text
from tunneldb.store.survey import Survey

_LAYERS = (
    ("change_region_map", "change_region", "map", "Polygon", "Lining that changed significantly, on the map strip"),
    ("change_region_unrolled", "change_region", "unrolled", "Polygon", "Lining that changed significantly (chainage, arc)"),
    ("change_region_3d", "change_region", "surface", "Polygon Z", "Lining that changed significantly, in space"),
    ("leak_change_map", "leak_change", "map", "MultiPolygon", "What became of leaks, on the map strip beside the axis"),
    ("leak_change_unrolled", "leak_change", "unrolled", "MultiPolygon", "What became of leaks (chainage, arc)"),
    ("leak_change_3d", "leak_change", "surface", "MultiPolygon Z", "What became of leaks, in space"),
    ("change_section", "change_section", None, None, "Rigid motion of sections, and what remains of their change"),
)  # fmt: skip
"""Layers: name, view, geometry, its type, description."""


def write_change_gpkg(conn: psycopg.Connection[Any], old: Survey, new: Survey, low: float, high: float, path: Path) -> None:
    """Write regions of change, leaks and sections of a stretch; the unrolled plane is an undefined Cartesian system."""
    crs = None if old.srid == LOCAL else crs_text(conn, old.srid)
    for place, (layer, view, column, kind, text) in enumerate(_LAYERS):
        shape = sql.SQL("NULL") if column is None else sql.SQL("public.ST_AsBinary({})").format(sql.Identifier(column))
        query = sql.SQL(
            "SELECT {}, {} FROM {} WHERE survey_id = %s AND old_survey_id = %s AND chainage_to > %s AND chainage_from < %s"
            " ORDER BY chainage_from, id"
        ).format(sql.SQL(", ").join(map(sql.Identifier, COLUMNS[view])), shape, sql.Identifier("tunnel_api", view))
        rows = conn.execute(query, [new.id, old.id, low, high]).fetchall()
        data = [_column([row[k] for row in rows]) for k in range(len(COLUMNS[view]))]
        geometry = None if column is None else np.array([bytes(row[-1]) for row in rows], dtype=object)
        given = None if column in (None, "unrolled") else crs
        options = {} if given or column is None else UNDEFINED_CARTESIAN
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "'crs' was not provided")
            pyogrio.raw.write(
                str(path), geometry, data, np.array(COLUMNS[view], dtype=object), layer=layer, driver="GPKG",
                geometry_type=kind, crs=given, append=place > 0, DESCRIPTION=text, **options,
            )  # fmt: skip


def write_change_xlsx(rows: dict[str, list[Row]], path: Path) -> None:
    """Write leaks, regions and sections as sheets of a workbook."""
    sheets = []
    for view, name in (("leak_change", "Leaks"), ("change_region", "Regions"), ("change_section", "Sections")):
        columns = [Column(heading) for heading in COLUMNS[view]]
        sheets.append(Sheet(name, columns, [[_cell(row[heading]) for heading in COLUMNS[view]] for row in rows[view]]))
    write_workbook(path, sheets, "Change between two surveys")


def _cell(value: Any) -> Any:
    return " ".join(map(str, value)) if isinstance(value, list) else value


def _column(values: list[Any]) -> Any:
    """Convert a column for a GeoPackage: numbers, with NaN for missing ones, or text."""
    cells = [_cell(value) for value in values]
    if any(isinstance(cell, str) for cell in cells):
        return np.array(cells, dtype=object)
    if cells and all(isinstance(cell, int) for cell in cells):
        return np.array(cells, dtype=np.int64)
    return np.array([np.nan if cell is None else cell for cell in cells], dtype=np.float64)
