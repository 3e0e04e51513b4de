"""Reference leaks from a file, in the unrolled plane."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import psycopg
import pyogrio
import pyogrio.raw
import pyproj
import shapely
from numpy.typing import NDArray
from pyogrio.errors import DataLayerError, DataSourceError
from pyproj.exceptions import CRSError
from shapely.geometry import MultiPolygon, Polygon

from tunneldb.errors import InputError
from tunneldb.files import MAX_JSON_MEGABYTES, gdal_fault, require_at_most, vector_source
from tunneldb.geometry.local import LOCAL
from tunneldb.store.survey import Survey


@dataclass(frozen=True)
class Truth:
    """Reference leaks.

    Attributes
    ----------
    ids : list of str
        Identifiers in the file: its column ``id``, else the row number, from 1.
    shapes : list of Polygon or MultiPolygon
        Valid polygons in the unrolled plane, m.
    """

    ids: list[str]
    shapes: list[Polygon | MultiPolygon]


def read_truth(conn: psycopg.Connection[Any], survey: Survey, path: Path, layer: str | None = None) -> Truth:
    """Read reference leaks from a GeoPackage or GeoJSON file.

    Polygons without a coordinate system are in (chainage, arc); 3D polygons in the tunnel's system are unrolled.

    Parameters
    ----------
    conn, survey
        Database and survey, for the surface.
    path : Path
        File to read.
    layer : str, optional
        Layer to read; by default the only one, or ``leak``.

    Raises
    ------
    InputError
        If the file can't be read, has no such layer, no polygon or another coordinate system, or a geometry is not a valid
        polygon or is off the tunnel.
    """
    given = read_polygons(path, survey, layer, "leak")
    ids, shapes = given.ids, given.shapes
    if given.in_space:
        shapes = [_unrolled(conn, survey, shape, given.naming(key)) for key, shape in zip(ids, shapes, strict=True)]
    for key, shape in zip(ids, shapes, strict=True):
        if not shape.is_valid:
            why = shapely.is_valid_reason(shape)
            raise InputError(f"{given.naming(key)} is not a valid polygon ({why}); fix it (in QGIS: Fix geometries)")
    return Truth(ids, shapes)


@dataclass(frozen=True)
class Polygons:
    """Polygons of a layer.

    Attributes
    ----------
    where : str
        File and layer, for messages.
    noun : str
        Name of one polygon's kind.
    ids : list of str
    shapes : list of Polygon or MultiPolygon
    in_space : bool
        True if they are in the tunnel's system; else they have none.
    """

    where: str
    noun: str
    ids: list[str]
    shapes: list[Polygon | MultiPolygon]
    in_space: bool

    def naming(self, key: str) -> str:
        """Return the name of one of them for a message."""
        return f"{self.where}, {self.noun} {key}"


def read_polygons(path: Path, survey: Survey, layer: str | None, noun: str) -> Polygons:
    """Read the polygons of a layer, by default of the only one or of the one named ``noun``.

    Raises
    ------
    InputError
        As for `read_truth`.
    """
    chosen = _layer(path, layer, noun)
    where = f"{path}, layer {chosen}"
    try:
        meta, _, wkb, columns = pyogrio.raw.read(vector_source(path), layer=chosen)
    except (DataSourceError, DataLayerError, RuntimeError, UnicodeDecodeError) as error:
        raise InputError(f"{where}: cannot be read: {gdal_fault(error)}") from None
    if wkb is None or not len(wkb):
        raise InputError(f"{where} is empty; at least one {noun} is needed for a comparison")
    ids = _ids(meta, columns, len(wkb))
    return Polygons(where, noun, ids, _polygons(wkb, ids, where, noun), _in_space(path, meta["crs"], survey, where, noun))


def _layer(path: Path, wanted: str | None, noun: str) -> str:
    """Return the layer of a file to read."""
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    source = vector_source(path)
    try:
        layers = [str(name) for name, kind in pyogrio.list_layers(source) if kind is not None]  # not tables
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: a layer name is not UTF-8: {_line(error)}") from None
    except DataSourceError as error:
        raise InputError(f"{path} cannot be read: {gdal_fault(error)}") from None
    listed = ", ".join(layers) or "none"
    if wanted is not None:
        if wanted not in layers:
            raise InputError(f"{path} has no layer {wanted}; it has {listed}")
        return wanted
    if len(layers) != 1 and noun not in layers:
        raise InputError(f"{path} has the layers {listed}: choose the one with the true {noun}s by --layer")
    return noun if noun in layers else layers[0]


def _ids(meta: dict[str, Any], columns: list[NDArray[Any]], count: int) -> list[str]:
    names = list(meta["fields"])
    return [str(v) for v in columns[names.index("id")]] if "id" in names else [str(k + 1) for k in range(count)]


def _polygons(wkb: NDArray[np.object_], ids: list[str], where: str, noun: str) -> list[Polygon | MultiPolygon]:
    """Parse geometries, which must be polygons or multipolygons."""
    shapes = []
    for key, data in zip(ids, wkb, strict=True):
        try:
            shape = None if data is None else shapely.from_wkb(data, on_invalid="ignore")
        except shapely.errors.GEOSException as error:
            raise InputError(
                f"{where}, {noun} {key} is not a valid polygon ({_line(error)}); draw it again, or remove the row"
            ) from None
        if not isinstance(shape, Polygon | MultiPolygon) or shape.is_empty:
            kind = "has no geometry; remove the row" if shape is None or shape.is_empty else f"is {shape.geom_type}"
            raise InputError(f"{where}, {noun} {key} {kind}; each {noun} must be a polygon")
        if not np.isfinite(shapely.get_coordinates(shape)).all():
            raise InputError(f"{where}, {noun} {key} has an invalid coordinate; draw it again, or remove the row")
        shapes.append(shape)
    return shapes


def _in_space(path: Path, given: str | None, survey: Survey, where: str, noun: str) -> bool:
    """Return True if the polygons are in the tunnel's system, False if in the unrolled plane, which has none."""
    if given is None or _bare_geojson(path):
        return False
    try:
        crs = pyproj.CRS(given)
    except CRSError:
        crs = None
    if crs is not None and crs.is_engineering:
        return False
    flat = crs.sub_crs_list[0] if crs is not None and crs.is_compound else crs
    local = survey.srid == LOCAL
    if flat is not None and not local and flat.equals(pyproj.CRS.from_epsg(survey.srid), ignore_axis_order=True):
        return True
    name = crs.name if crs is not None else given
    if noun == "spot":
        system = "without a coordinate system" if local else f"in EPSG:{survey.srid}"
        raise InputError(f"{where} is in {name}; polygons of spots must be 3D, {system}")
    space = "" if local else f", or 3D in the tunnel's, EPSG:{survey.srid}"
    raise InputError(f"{where} is in {name}; polygons must be in the unrolled plane, without a coordinate system{space}")


def _bare_geojson(path: Path) -> bool:
    """Return True for GeoJSON without a ``crs`` member, which GDAL reads as longitude and latitude."""
    if path.suffix.lower() not in (".geojson", ".json"):
        return False
    try:
        require_at_most(path, MAX_JSON_MEGABYTES, "a file of JSON")
        content = json.loads(path.read_text("utf-8-sig"))
    except (ValueError, RecursionError):
        return False
    return isinstance(content, dict) and content.get("crs") is None


def _unrolled(
    conn: psycopg.Connection[Any], survey: Survey, shape: Polygon | MultiPolygon, where: str
) -> Polygon | MultiPolygon:
    """Return a leak in space, unrolled."""
    if not shape.has_z:
        raise InputError(f"{where} has no heights; polygons in EPSG:{survey.srid} must be 3D, on the lining")
    parts = []
    for part in shapely.get_parts(shape):
        row = conn.execute(
            "SELECT public.ST_AsBinary(tunnel_api.unroll_shape(%s, public.ST_GeomFromWKB(%s, %s)))",
            (survey.id, shapely.to_wkb(part), survey.srid),
        ).fetchone()
        if row is None or row[0] is None:
            raise InputError(f"{where} is off the tunnel of survey {survey.name}, or where it has no sections")
        parts.append(shapely.from_wkb(bytes(row[0])))
    return parts[0] if len(parts) == 1 else MultiPolygon(parts)


def _line(error: Exception) -> str:
    return str(error).strip().split("\n", 1)[0]
