"""Spots of structures written as CSV, GeoJSON or GeoPackage, with what of the members could be judged."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from shapely.geometry import mapping

from tunneldb.csvfile import write_csv
from tunneldb.export.tables.cell import DECIMALS, plain
from tunneldb.export.tables.geopackage import UNDEFINED_CARTESIAN
from tunneldb.geometry.local import LOCAL
from tunneldb.store.spots import COLUMNS, Geometry, SpotList


def as_csv(spots: SpotList) -> str:
    """Write spots as CSV with a header; the last column, ``geometry``, is WKT.

    If the inspection has gaps, the first row says so: ``kind`` is unseen, ``remark`` the reason, ``counted`` is False.
    """
    rows: list[dict[str, Any]] = []
    if spots.statement:
        rows.append({"kind": "unseen", "remark": spots.statement, "counted": False})
    for spot in spots.rows:
        wkt = shapely.to_wkt(spot.geometry, rounding_precision=DECIMALS)
        rows.append({**{name: plain(getattr(spot, name)) for name in COLUMNS}, "geometry": wkt})
    names = [*COLUMNS, "geometry"]
    return write_csv(names, ([row.get(name) for name in names] for row in rows))


def as_geojson(spots: SpotList, geometry: Geometry, srid: int) -> str:
    """Write spots as a GeoJSON FeatureCollection; ``statement``, ``count`` and ``area`` are further members of it."""
    collection: dict[str, Any] = {"type": "FeatureCollection", "name": f"spot_{geometry}"}
    if geometry != "face" and srid != LOCAL:
        collection["crs"] = {"type": "name", "properties": {"name": f"urn:ogc:def:crs:EPSG::{srid}"}}
    collection |= {"statement": spots.statement, "count": spots.count, "area": round(spots.area, DECIMALS)}
    collection["features"] = [
        {
            "type": "Feature",
            "id": spot.id,
            "geometry": mapping(shapely.set_precision(spot.geometry, 10.0**-DECIMALS)),
            "properties": {name: plain(getattr(spot, name)) for name in COLUMNS},
        }
        for spot in spots.rows
    ]
    return json.dumps(collection, ensure_ascii=False, allow_nan=False) + "\n"


def write_gpkg(path: Path, spots: SpotList, geometry: Geometry, srid: int) -> None:
    """Write spots as a GeoPackage with one layer, whose description says for what they can't be vouched."""
    import pyogrio.raw

    data = [_column(spots, name) for name in COLUMNS]
    said = f"{spots.statement}. {spots.total}" if spots.statement else spots.total
    bare = geometry == "face" or srid == LOCAL
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "'crs' was not provided")  # a face's own plane has none, nor have local coordinates
        pyogrio.raw.write(
            str(path),
            shapely.to_wkb(np.array([spot.geometry for spot in spots.rows], dtype=object)),
            data,
            np.array(COLUMNS),
            geometry_type="Polygon Z" if geometry == "3d" else "Polygon",
            crs=None if bare else f"EPSG:{srid}",
            driver="GPKG",
            layer=f"spot_{geometry}",
            DESCRIPTION=said,
            **(UNDEFINED_CARTESIAN if bare else {}),
        )


def _column(spots: SpotList, name: str) -> np.ndarray[Any, Any]:
    values = [getattr(spot, name) for spot in spots.rows]
    if name in ("id", "number", "points", "scans"):
        return np.array(values, dtype=np.int64)
    if name in ("member", "face", "chainage", "confidence", "contrast", "difference", "area"):
        return np.array([np.nan if value is None else value for value in values], dtype=np.float64)
    if name in ("detected", "counted"):
        return np.array(values, dtype=np.bool_)
    return np.array([plain(value) for value in values], dtype=object)
