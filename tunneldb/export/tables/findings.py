"""Findings of all kinds, detected and drawn, written as CSV, GeoJSON or GeoPackage."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import shapely
from shapely.geometry import mapping

from tunneldb.csvfile import write_csv
from tunneldb.export.tables.cell import DECIMALS, plain
from tunneldb.export.tables.geopackage import write_gaps, write_layer, write_remarks
from tunneldb.export.tables.notes import note_rows
from tunneldb.geometry.local import LOCAL
from tunneldb.store.coverage import Coverage
from tunneldb.store.findings import Finding, Geometry
from tunneldb.store.remarks import Remark

COLUMNS = (
    "id", "km", "label", "chainage_from", "chainage_to", "arc_from", "arc_to", "clock", "kind", "kind_label", "origin",
    "severity", "severity_label", "area", "length", "width_mm", "orientation", "orientation_class", "darkening_mean",
    "confidence", "review", "state", "counted", "also_detected", "merged_into", "same_as", "parent_id",
    "dry_region_id", "drawn_by", "drawn_at", "reviewed_by",
    "reviewed_at", "remark", "photos", "easting", "northing", "height",
)  # fmt: skip
"""Columns of the files: attributes of a finding."""


@dataclass(frozen=True)
class FindingList:
    """Findings of a stretch, with the statements on it.

    Attributes
    ----------
    rows : list of Finding
        In order of chainage.
    coverage : Coverage
        Statement on the search.
    remarks : list of Remark
        Notes and limitations.
    """

    rows: list[Finding]
    coverage: Coverage
    remarks: list[Remark]


def as_csv(findings: FindingList) -> str:
    """Write findings as CSV with a header; the last column, ``geometry``, is WKT.

    First come the gaps in the search and the notes, as in the CSV of leaks, with their texts in ``remark``.
    """
    notes = [[plain(row.get(name)) for name in COLUMNS] for row in note_rows(findings.coverage, findings.remarks, "remark")]
    rows = [
        [*(plain(getattr(one, name)) for name in COLUMNS), shapely.to_wkt(one.geometry, rounding_precision=DECIMALS)]
        for one in findings.rows
    ]
    return write_csv([*COLUMNS, "geometry"], [*([*note, None] for note in notes), *rows])


def as_geojson(findings: FindingList, geometry: Geometry, srid: int) -> str:
    """Write findings as a GeoJSON FeatureCollection; on the map and in space it names the tunnel's coordinate system.

    Members ``statement``, ``gaps`` and ``remarks`` are those of leaks.
    """
    collection: dict[str, Any] = {"type": "FeatureCollection", "name": f"finding_{geometry}"}
    if geometry != "unrolled" and srid != LOCAL:
        collection["crs"] = {"type": "name", "properties": {"name": f"urn:ogc:def:crs:EPSG::{srid}"}}
    collection["statement"] = findings.coverage.statement
    collection["gaps"] = [asdict(gap) for gap in findings.coverage.gaps]
    collection["remarks"] = [asdict(remark) for remark in findings.remarks]
    collection["features"] = [
        {
            "type": "Feature",
            "id": finding.id,
            "geometry": mapping(shapely.set_precision(finding.geometry, 10.0**-DECIMALS, mode="pointwise")),
            "properties": {name: plain(getattr(finding, name)) for name in COLUMNS},
        }
        for finding in findings.rows
    ]
    return json.dumps(collection, ensure_ascii=False, allow_nan=False) + "\n"


def write_gpkg(path: Path, findings: FindingList, geometry: Geometry, srid: int) -> None:
    """Write findings as a GeoPackage with one layer of polygons, lines and points, and tables of gaps and notes."""
    said = ". ".join(filter(None, (findings.coverage.statement, *(remark.said for remark in findings.remarks))))
    write_layer(
        path, f"finding_{geometry}", [finding.geometry for finding in findings.rows],
        {name: [getattr(finding, name) for finding in findings.rows] for name in COLUMNS},
        geometry_type="Unknown", srid=LOCAL if geometry == "unrolled" else srid, description=said,
    )  # fmt: skip
    if findings.coverage.gaps:
        write_gaps(path, findings.coverage)
    if findings.remarks:
        write_remarks(path, findings.remarks)
