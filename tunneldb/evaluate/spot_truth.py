"""Reference spots of a structure from a file: polygons in space, or the output of ``simulate-structure``."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from tunneldb.arrays import Bool
from tunneldb.errors import InputError
from tunneldb.evaluate.truth import read_polygons
from tunneldb.files import MAX_JSON_MEGABYTES, require_at_most
from tunneldb.geometry.crs import srid_name
from tunneldb.geometry.local import LOCAL
from tunneldb.store.survey import Survey

MIN_POINTS, MAX_INCIDENCE = 100, 75.0
"""Limits for required simulated spots: least number of points, and greatest median angle of incidence, degrees."""


@dataclass(frozen=True)
class SpotTruth:
    """Reference spots.

    Attributes
    ----------
    ids : list of str
    shapes : list of Polygon or MultiPolygon
        Polygons with Z, in the survey's system, m.
    asked : (n,) bool array
        True for spots that can be required; for simulated ones the visibility is known.
    """

    ids: list[str]
    shapes: list[BaseGeometry]
    asked: Bool


def read_spot_truth(survey: Survey, path: Path, layer: str | None = None) -> SpotTruth:
    """Read reference spots from a ``.truth.json`` of ``simulate-structure``, or 3D polygons from GeoPackage or GeoJSON.

    Parameters
    ----------
    survey : Survey
        Survey whose coordinate system they must have.
    path : Path
    layer : str, optional
        Layer to read; by default the only one, or ``spot``.

    Raises
    ------
    InputError
        If the file can't be read or has no polygon, or polygons are in another coordinate system or have no heights.
    """
    simulated = _simulated(path)
    if simulated is not None:
        try:
            return _of_simulation(survey, path, simulated)
        except (LookupError, TypeError, ValueError, AttributeError, shapely.errors.ShapelyError) as error:
            raise InputError(f"{path} is not a truth file of simulate-structure: {error!r}") from error
    given = read_polygons(path, survey, layer, "spot")
    if not given.in_space and survey.srid != LOCAL:
        raise InputError(f"{given.where} has no coordinate system; polygons of spots must be 3D, in {srid_name(survey.srid)}")
    for key, shape in zip(given.ids, given.shapes, strict=True):
        if not shape.has_z:
            raise InputError(f"{given.naming(key)} has no heights; polygons of spots must be 3D, on their surface")
    return SpotTruth(given.ids, list(given.shapes), np.ones(len(given.ids), np.bool_))


def _simulated(path: Path) -> dict[str, Any] | None:
    """Return the content of a truth file of ``simulate-structure``; None for other files."""
    if path.suffix.lower() != ".json" or not path.is_file():
        return None
    try:
        require_at_most(path, MAX_JSON_MEGABYTES, "a file of JSON")
        content = json.loads(path.read_text("utf-8-sig"))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path} is not JSON: {error}") from None
    return content if isinstance(content, dict) and "anomalies" in content and "parameters" in content else None


def _of_simulation(survey: Survey, path: Path, content: dict[str, Any]) -> SpotTruth:
    srid = content["parameters"]["srid"]
    if survey.srid not in (srid, LOCAL):
        raise InputError(f"{path} is in EPSG:{srid}, but survey {survey.name} in {srid_name(survey.srid)}")
    rows = [row for row in content["anomalies"] if row["points"]]
    if not rows:
        raise InputError(f"{path} has no anomaly visible to the scanner; there is nothing to compare with")
    asked = [row["points"] >= MIN_POINTS and row["incidence"][1] <= MAX_INCIDENCE for row in rows]
    shapes = [shapely.force_3d(Polygon(row["outline_3d"])) for row in rows]
    return SpotTruth([str(row["id"]) for row in rows], list(shapes), np.array(asked, np.bool_))
