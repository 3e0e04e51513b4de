"""Leaks, joints and other dry dark areas as CSV, GeoJSON or GeoPackage."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import shapely
from shapely.geometry import mapping

from tunneldb.csvfile import write_csv
from tunneldb.export.tables.cell import DECIMALS, plain
from tunneldb.export.tables.geopackage import write_gaps, write_layer, write_remarks
from tunneldb.export.tables.notes import note_rows
from tunneldb.geometry.local import LOCAL
from tunneldb.store.findings import Finding, Geometry
from tunneldb.store.leaks import Kind, LeakList

COLUMNS = {
    **{name: name for name in ("id", "km", "chainage_from", "chainage_to", "label", "arc_from", "arc_to", "clock", "kind")},
    "confidence": "confidence_in_kind",
    **{name: name for name in ("reasons", "contrast", "area")},
    "drop_mean": "darkening_mean",
    "drop_max": "darkening_max",
    **{name: name for name in ("image_share", "review", "reviewed_by", "reviewed_at", "detected", "counted")},
}
"""Columns of the files and keys of JSON, and the attribute of a finding that each has: programs rely on these names."""

ADDED = ("severity", "severity_label", "remark", "easting", "northing", "height", "other_images", "other_contrast")
"""Further columns, after the geometry, so that the position of the others stays."""

_ATTRIBUTE = COLUMNS | {name: name for name in ADDED}


def as_record(leak: Finding) -> dict[str, Any]:
    """Return a leak under the names of the files, with its geometry, for ``--json``."""
    first = {column: getattr(leak, attribute) for column, attribute in COLUMNS.items()}
    return {**first, "geometry": leak.geometry, **{name: getattr(leak, name) for name in ADDED}}


def as_csv(leaks: LeakList) -> str:
    """Write leaks as CSV with a header; ``geometry`` is WKT, and columns that were added later follow it.

    First come the stretches for which they can't be vouched for: their ``kind`` is the state of the stretch, ``reasons`` says
    why, and ``counted`` is False. Then notes and limitations, of the kind ``remark``, in ``reasons``.
    """
    rows = [
        {column: plain(value) for column, value in row.items()} for row in note_rows(leaks.coverage, leaks.remarks, "reasons")
    ]
    for leak in leaks.rows:
        wkt = shapely.to_wkt(leak.geometry, rounding_precision=DECIMALS)
        rows.append({**_facts(leak), "geometry": wkt})
    names = [*COLUMNS, "geometry", *ADDED]
    return write_csv(names, ([row.get(name) for name in names] for row in rows))


def _facts(leak: Finding) -> dict[str, Any]:
    """Return what a file states of a leak."""
    return {column: plain(getattr(leak, attribute)) for column, attribute in _ATTRIBUTE.items()}


def as_geojson(leaks: LeakList, geometry: Geometry, srid: int) -> str:
    """Write leaks as a GeoJSON FeatureCollection in the coordinates of the chosen geometry.

    Map and space have the tunnel's coordinate system in a ``crs`` member, as GDAL and QGIS read it; the unrolled plane and
    local coordinates have none. Further members as in ``--json``: ``statement`` and ``gaps`` for stretches in which leaks could
    be missed, ``remarks`` for notes and limitations, ``count`` and ``area`` as totals.
    """
    collection: dict[str, Any] = {"type": "FeatureCollection", "name": layer_name(geometry, leaks.kind)}
    if geometry != "unrolled" and srid != LOCAL:
        collection["crs"] = {"type": "name", "properties": {"name": f"urn:ogc:def:crs:EPSG::{srid}"}}
    collection["statement"] = leaks.coverage.statement
    collection["gaps"] = [asdict(gap) for gap in leaks.coverage.gaps]
    collection["remarks"] = [asdict(remark) for remark in leaks.remarks]
    collection |= {"count": leaks.count, "area": round(leaks.area, DECIMALS)}
    collection["features"] = [
        {
            "type": "Feature",
            "id": leak.id,
            "geometry": _rounded(mapping(leak.geometry)),
            "properties": _facts(leak),
        }
        for leak in leaks.rows
    ]
    return json.dumps(collection, ensure_ascii=False, allow_nan=False) + "\n"


def write_gpkg(path: Path, leaks: LeakList, geometry: Geometry, srid: int) -> None:
    """Write leaks as a GeoPackage with one layer; the unrolled plane and local coordinates are undefined Cartesian there.

    Stretches in which leaks could be missed are in a table ``coverage_gap``, if there are any, and notes and limitations in a
    table ``remark``; both are also in the description of the layer.
    """
    said = ". ".join(filter(None, (leaks.coverage.statement, leaks.total, *(remark.said for remark in leaks.remarks))))
    values = {column: [getattr(leak, attribute) for leak in leaks.rows] for column, attribute in _ATTRIBUTE.items()}
    write_layer(
        path, layer_name(geometry, leaks.kind), [leak.geometry for leak in leaks.rows], values,
        geometry_type="Polygon Z" if geometry == "3d" else "Polygon", srid=LOCAL if geometry == "unrolled" else srid,
        description=said,
    )  # fmt: skip
    if leaks.coverage.gaps:
        write_gaps(path, leaks.coverage)
    if leaks.remarks:
        write_remarks(path, leaks.remarks)


def layer_name(geometry: Geometry, kind: Kind) -> str:
    """Name of the layer in files."""
    return f"{'anomaly' if kind == 'all' else kind}_{geometry}"


def _rounded(shape: dict[str, Any]) -> dict[str, Any]:
    rings = [[[round(number, DECIMALS) for number in vertex] for vertex in ring] for ring in shape["coordinates"]]
    return {"type": shape["type"], "coordinates": rings}
