"""Layers of a GeoPackage of findings: the findings, gaps in the inspection, and notes on the results."""

from __future__ import annotations

import datetime as dt
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from tunneldb.export.tables.cell import plain
from tunneldb.geometry.local import LOCAL
from tunneldb.store.coverage import Coverage, CoverageGap
from tunneldb.store.remarks import Remark

UNDEFINED_CARTESIAN = {"SRID": "-1"}
"""Coordinate system of the unrolled plane, and of local coordinates, in a GeoPackage, by its standard."""


def write_layer(
    path: Path,
    name: str,
    geometries: Sequence[BaseGeometry],
    values: Mapping[str, Sequence[Any]],
    *,
    geometry_type: str,
    srid: int,
    description: str,
) -> None:
    """Write a layer of findings; numbers that are not known are empty.

    Parameters
    ----------
    path, name
        GeoPackage and layer.
    geometries : sequence of geometry
        A geometry for each finding.
    values : mapping of str to sequence
        Values of each column; the type of a column follows from its name.
    geometry_type : str
        Type by OGR, such as ``Polygon Z``.
    srid : int
        Coordinate system; `LOCAL` for the unrolled plane and for local coordinates.
    description : str
        Description of the layer.
    """
    import pyogrio.raw

    columns, masks = [], []
    for column, held in values.items():
        kind = _TYPE.get(column, object)
        unknown = np.array([value is None for value in held], np.bool_)
        columns.append(np.array([_cell(value, kind) for value in held], dtype=kind))
        masks.append(unknown if unknown.any() and kind not in (object, _MOMENT) else None)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "'crs' was not provided")  # the unrolled plane has none, nor have local coordinates
        pyogrio.raw.write(
            str(path), shapely.to_wkb(np.array(geometries, dtype=object)), columns, np.array(list(values)), field_mask=masks,
            geometry_type=geometry_type, crs=None if srid == LOCAL else f"EPSG:{srid}", driver="GPKG", layer=name,
            DESCRIPTION=description, **(UNDEFINED_CARTESIAN if srid == LOCAL else {}),
        )  # fmt: skip


def _cell(value: Any, kind: Any) -> Any:
    """Return a value as it is in a column of a type; a placeholder if it is not known."""
    if kind == _MOMENT:
        return np.datetime64("NaT") if value is None else value.astimezone(dt.UTC).replace(tzinfo=None)
    return plain(value) if kind is object else kind(0) if value is None else value


_MOMENT = "datetime64[ms]"
_TYPE: dict[str, Any] = {
    **dict.fromkeys(("id", "merged_into", "same_as", "parent_id", "dry_region_id"), np.int64),
    **dict.fromkeys(("km", "severity", "photos"), np.int32),
    **dict.fromkeys(("detected", "counted", "also_detected"), np.bool_),
    **dict.fromkeys(("drawn_at", "reviewed_at"), _MOMENT),
    **dict.fromkeys(
        (
            "chainage_from", "chainage_to", "arc_from", "arc_to", "clock", "confidence", "contrast", "area", "length",
            "width_mm", "drop_mean", "drop_max", "darkening_mean", "image_share", "easting", "northing", "height",
        ),
        np.float64,
    ),
}  # fmt: skip
"""Types of the columns of findings; others are text."""


def write_gaps(path: Path, coverage: Coverage) -> None:
    """Add the table ``coverage_gap``; there is a gap."""
    columns: dict[str, tuple[Any, list[Any]]] = {
        field.name: (
            {"searched": bool, "state": object, "reason": object, "label_from": object, "label_to": object}.get(
                field.name, float
            ),
            [getattr(gap, field.name) for gap in coverage.gaps],
        )
        for field in fields(CoverageGap)
    }
    _write_table(path, "coverage_gap", columns, coverage.statement or "")


def write_remarks(path: Path, remarks: Sequence[Remark], **options: str) -> None:
    """Add the table ``remark``: file, or stage and kilometres, the note, and both in one text.

    Parameters
    ----------
    path : Path
        GeoPackage.
    remarks : sequence of Remark
        Remarks, may be empty.
    **options : str
        Options of the driver.
    """
    columns: dict[str, tuple[Any, list[Any]]] = {
        "file": (object, [remark.file for remark in remarks]),
        "stage": (object, [remark.stage for remark in remarks]),
        "kilometres": (object, [", ".join(map(str, remark.kilometres)) or None for remark in remarks]),
        "remark": (object, [remark.remark for remark in remarks]),
        "said": (object, [remark.said for remark in remarks]),
    }
    _write_table(path, "remark", columns, "Notes and limitations", **options)


def _write_table(path: Path, name: str, columns: dict[str, tuple[Any, list[Any]]], description: str, **options: str) -> None:
    import pyogrio.raw

    data = [np.array(values, dtype=kind) for kind, values in columns.values()]
    pyogrio.raw.write(
        str(path), None, data, np.array(list(columns)), geometry_type=None, driver="GPKG", layer=name, DESCRIPTION=description,
        **options,
    )  # fmt: skip
