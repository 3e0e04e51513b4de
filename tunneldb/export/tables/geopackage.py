"""Additional layers of a GeoPackage of leaks: gaps in the inspection, and notes on the results."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pyogrio.raw

from tunneldb.store.coverage import Coverage, CoverageGap
from tunneldb.store.remarks import Remark

UNDEFINED_CARTESIAN = {"SRID": "-1"}
"""Coordinate system of the unrolled plane, and of local coordinates, in a GeoPackage, by its standard."""


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
    data = [np.array(values, dtype=kind) for kind, values in columns.values()]
    pyogrio.raw.write(
        str(path), None, data, np.array(list(columns)), geometry_type=None, driver="GPKG", layer=name, DESCRIPTION=description,
        **options,
    )  # fmt: skip
