"""Leaks, joints and other dry dark areas as CSV, GeoJSON or GeoPackage."""

from __future__ import annotations

import datetime as dt
import json
import warnings
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pyogrio.raw
import shapely
from numpy.typing import NDArray
from shapely.geometry import mapping

from tunneldb.csvfile import write_csv
from tunneldb.export.tables.cell import DECIMALS, plain
from tunneldb.export.tables.geopackage import UNDEFINED_CARTESIAN, write_gaps, write_remarks
from tunneldb.geometry.crs import LOCAL
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


def as_record(leak: Finding) -> dict[str, Any]:
    """Return a leak under the names of the files, with its geometry, for ``--json``."""
    return {**{column: getattr(leak, attribute) for column, attribute in COLUMNS.items()}, "geometry": leak.geometry}


def as_csv(leaks: LeakList) -> str:
    """Write leaks as CSV with a header; the last column, ``geometry``, is WKT.

    First come the stretches for which they can't be vouched for: their ``kind`` is the state of the stretch, ``reasons`` says
    why, and ``counted`` is False. Then notes and limitations, of the kind ``remark``, in ``reasons``.
    """
    rows: list[dict[str, Any]] = []
    for gap in leaks.coverage.gaps:
        place = {"chainage_from": plain(gap.chainage_from), "chainage_to": plain(gap.chainage_to), "label": gap.label_from}
        rows.append({**place, "kind": gap.state, "reasons": gap.reason, "counted": False})
    rows += [{"kind": "remark", "reasons": remark.said, "counted": False} for remark in leaks.remarks]
    for leak in leaks.rows:
        wkt = shapely.to_wkt(leak.geometry, rounding_precision=DECIMALS)
        rows.append({**_facts(leak), "geometry": wkt})
    names = [*COLUMNS, "geometry"]
    return write_csv(names, ([row.get(name) for name in names] for row in rows))


def _facts(leak: Finding) -> dict[str, Any]:
    """Return what a file states of a leak."""
    return {column: plain(getattr(leak, attribute)) for column, attribute in COLUMNS.items()}


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
    rows = leaks.rows
    data = {
        column: np.array([getattr(leak, attribute) for leak in rows], dtype=_GPKG_TYPE.get(column, object))
        for column, attribute in COLUMNS.items()
    }
    data["reasons"] = np.array([plain(leak.reasons) for leak in rows], dtype=object)
    moments = [leak.reviewed_at for leak in rows]
    data["reviewed_at"] = np.array([np.datetime64("NaT") if m is None else _utc(m) for m in moments], dtype="datetime64[ms]")
    said = ". ".join(filter(None, (leaks.coverage.statement, leaks.total, *(remark.said for remark in leaks.remarks))))
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "'crs' was not provided")  # the unrolled plane has none, nor have local coordinates
        _write_layer(path, rows, list(data.values()), geometry, srid, layer_name(geometry, leaks.kind), said)
    if leaks.coverage.gaps:
        write_gaps(path, leaks.coverage)
    if leaks.remarks:
        write_remarks(path, leaks.remarks)


def _write_layer(
    path: Path, leaks: Sequence[Finding], data: list[NDArray[Any]], geometry: Geometry, srid: int, layer: str, said: str
) -> None:
    bare = geometry == "unrolled" or srid == LOCAL
    pyogrio.raw.write(
        str(path),
        shapely.to_wkb(np.array([leak.geometry for leak in leaks], dtype=object)),
        data,
        np.array(list(COLUMNS)),
        geometry_type="Polygon Z" if geometry == "3d" else "Polygon",
        crs=None if bare else f"EPSG:{srid}",
        driver="GPKG",
        layer=layer,
        DESCRIPTION=said,
        **(UNDEFINED_CARTESIAN if bare else {}),
    )


_GPKG_TYPE: dict[str, Any] = {
    "id": np.int64,
    "km": np.int32,
    "detected": np.bool_,
    "counted": np.bool_,
    **dict.fromkeys(
        (
            "chainage_from",
            "chainage_to",
            "arc_from",
            "arc_to",
            "clock",
            "confidence",
            "contrast",
            "area",
            "drop_mean",
            "drop_max",
            "image_share",
        ),
        np.float64,
    ),
}


def layer_name(geometry: Geometry, kind: Kind) -> str:
    """Name of the layer in files."""
    return f"{'anomaly' if kind == 'all' else kind}_{geometry}"


def _utc(moment: dt.datetime) -> dt.datetime:
    """Drop the zone, which NumPy doesn't know, after turning to UTC."""
    return moment.astimezone(dt.UTC).replace(tzinfo=None)


def _rounded(shape: dict[str, Any]) -> dict[str, Any]:
    rings = [[[round(number, DECIMALS) for number in vertex] for vertex in ring] for ring in shape["coordinates"]]
    return {"type": shape["type"], "coordinates": rings}
