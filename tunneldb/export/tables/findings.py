"""Findings of all kinds, detected and drawn, written as CSV, GeoJSON or GeoPackage."""

from __future__ import annotations

import datetime as dt
import json
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyogrio.raw
import shapely
from shapely.geometry import mapping

from tunneldb.csvfile import write_csv
from tunneldb.export.tables.cell import DECIMALS, plain
from tunneldb.export.tables.geopackage import UNDEFINED_CARTESIAN
from tunneldb.geometry.crs import LOCAL
from tunneldb.store.findings import Finding, Geometry

COLUMNS = (
    "id", "km", "label", "chainage_from", "chainage_to", "arc_from", "arc_to", "clock", "kind", "kind_label", "origin",
    "severity", "severity_label", "area", "length", "width", "darkening_mean", "confidence", "review", "state", "counted",
    "also_detected", "merged_into", "same_as", "parent_id", "dry_region_id", "drawn_by", "drawn_at", "reviewed_by",
    "reviewed_at", "remark", "photos",
)  # fmt: skip
"""Columns of the files: attributes of a finding."""


def as_csv(findings: Sequence[Finding]) -> str:
    """Write findings as CSV with a header; the last column, ``geometry``, is WKT."""
    return write_csv(
        [*COLUMNS, "geometry"],
        (
            [*(plain(getattr(one, name)) for name in COLUMNS), shapely.to_wkt(one.geometry, rounding_precision=DECIMALS)]
            for one in findings
        ),
    )


def as_geojson(findings: Sequence[Finding], geometry: Geometry, srid: int) -> str:
    """Write findings as a GeoJSON FeatureCollection; on the map and in space it names the tunnel's coordinate system."""
    collection: dict[str, Any] = {"type": "FeatureCollection", "name": f"finding_{geometry}"}
    if geometry != "unrolled" and srid != LOCAL:
        collection["crs"] = {"type": "name", "properties": {"name": f"urn:ogc:def:crs:EPSG::{srid}"}}
    collection["features"] = [
        {
            "type": "Feature",
            "id": finding.id,
            "geometry": mapping(shapely.set_precision(finding.geometry, 10.0**-DECIMALS, mode="pointwise")),
            "properties": {name: plain(getattr(finding, name)) for name in COLUMNS},
        }
        for finding in findings
    ]
    return json.dumps(collection, ensure_ascii=False, allow_nan=False) + "\n"


def write_gpkg(path: Path, findings: Sequence[Finding], geometry: Geometry, srid: int) -> None:
    """Write findings as a GeoPackage with one layer of polygons, lines and points; numbers that are not known are empty."""
    bare = geometry == "unrolled" or srid == LOCAL
    columns, masks = [], []
    for name in COLUMNS:
        values = [getattr(finding, name) for finding in findings]
        unknown = np.array([value is None for value in values], np.bool_)
        kind = _TYPE.get(name, object)
        if kind == "datetime64[ms]":
            values = [np.datetime64("NaT") if v is None else v.astimezone(dt.UTC).replace(tzinfo=None) for v in values]
        elif kind is not object:
            values = [kind(0) if value is None else value for value in values]
        columns.append(np.array(values, dtype=kind))
        masks.append(unknown if unknown.any() and kind not in (object, "datetime64[ms]") else None)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "'crs' was not provided")
        pyogrio.raw.write(
            str(path),
            shapely.to_wkb(np.array([finding.geometry for finding in findings], dtype=object)),
            columns,
            np.array(COLUMNS),
            field_mask=masks,
            geometry_type="Unknown",
            crs=None if bare else f"EPSG:{srid}",
            driver="GPKG",
            layer=f"finding_{geometry}",
            **(UNDEFINED_CARTESIAN if bare else {}),
        )


_TYPE: dict[str, Any] = {
    **dict.fromkeys(("id", "merged_into", "same_as", "parent_id", "dry_region_id"), np.int64),
    **dict.fromkeys(("km", "severity", "photos"), np.int32),
    **dict.fromkeys(("counted", "also_detected"), np.bool_),
    **dict.fromkeys(("drawn_at", "reviewed_at"), "datetime64[ms]"),
    **dict.fromkeys(
        (
            "chainage_from",
            "chainage_to",
            "arc_from",
            "arc_to",
            "clock",
            "area",
            "length",
            "width",
            "darkening_mean",
            "confidence",
        ),
        np.float64,
    ),
}
