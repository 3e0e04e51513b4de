"""Lines of drawings and maps: DXF by ezdxf; GeoPackage, Shapefile, GeoJSON and FlatGeobuf by GDAL."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pyproj import CRS
from pyproj.exceptions import CRSError

from tunneldb.alignment.joining import join_pieces
from tunneldb.arrays import Float
from tunneldb.errors import InputError
from tunneldb.files import vector_source
from tunneldb.geometry.crs import LOCAL, describe_crs, describe_srid, fits_srid, is_local

CHORD_ERROR = 0.0005  # m, of arcs and splines
MAX_STEP = 1.0  # m between vertices of a drawing with arcs, so that the spline through them keeps straights straight
_MAX_LISTED = 8
_ENTITIES = {"LINE", "ARC", "LWPOLYLINE", "POLYLINE", "SPLINE"}


@dataclass(frozen=True)
class Drawn:
    """Lines of a layer, joined end to end.

    Attributes
    ----------
    lines : list of (n, 3) float arrays
        Lines, the longest first, m; heights are NaN if the layer has none, or 0 throughout.
    layer : str
        Name of the layer.
    notes : tuple of str
        Notes for the user about the import.
    """

    lines: list[Float]
    layer: str
    notes: tuple[str, ...] = ()

    def choose(self, path: Path, number: str | None) -> Float:
        """Return the only line, or the one with a number in the list, from 1."""
        if number is None and len(self.lines) == 1:
            return self.lines[0]
        listed = "; ".join(f"{n} ({describe_line(line)})" for n, line in enumerate(self.lines[:_MAX_LISTED], start=1))
        more = len(self.lines) - _MAX_LISTED
        listed += f"; and {more} shorter ones" if more > 0 else ""
        count = "1 line" if len(self.lines) == 1 else f"{len(self.lines)} separate lines"
        if number is None:
            raise InputError(f"{path}: layer {self.layer!r} holds {count}: {listed}; choose one by --alignment NUMBER")
        if not number.isdecimal() or not 1 <= int(number) <= len(self.lines):
            raise InputError(f"{path}: layer {self.layer!r} has no line {number!r}; it holds {count}: {listed}")
        return self.lines[int(number) - 1]


def describe_line(line: Float) -> str:
    """Return length and ends of a line, for a message."""
    length = float(np.hypot(*np.diff(line[:, :2], axis=0).T).sum())
    (x1, y1), (x2, y2) = line[0, :2], line[-1, :2]
    return f"{length:.1f} m from {x1:.1f},{y1:.1f} to {x2:.1f},{y2:.1f}"


def read_dxf(path: Path, layer: str | None, unit: float | None) -> Drawn:
    """Read the lines of a DXF file's model space: LINE, ARC, LWPOLYLINE, POLYLINE and SPLINE.

    Parameters
    ----------
    layer
        Name of the layer; required if several contain lines.
    unit
        Metres per drawing unit; None for the file's own unit.

    Raises
    ------
    InputError
        If it can't be read, has no lines, has several layers to choose from, or its unit isn't the metre.
    """
    drawing = open_drawing(path)
    entities = [entity for entity in drawing.modelspace() if entity.dxftype() in _ENTITIES and not _is_mesh(entity)]
    names = sorted({entity.dxf.layer for entity in entities})
    chosen = choose_layer(path, names, layer)
    scale, note = _dxf_unit(path, drawing.header.get("$INSUNITS", 0), unit)
    parts = [part for entity in entities if entity.dxf.layer == chosen for part in _simple(entity)]
    curved = any(part.dxftype() != "LINE" for part in parts)
    pieces = [scale * _vertices(part, CHORD_ERROR / scale) for part in parts]
    lines = [_densified(line) if curved else line for line in join_pieces(pieces)]
    return _drawn(path, lines, chosen, (note,) if note else ())


def open_drawing(path: Path) -> Any:
    """Open a DXF file.

    Raises
    ------
    InputError
        If it can't be read.
    """
    from ezdxf import filemanagement

    try:
        return filemanagement.readfile(str(path))
    except Exception as error:  # for damaged files ezdxf raises StopIteration, OverflowError and others
        message = str(error).strip().splitlines() or [f"it is damaged ({type(error).__name__})"]
        raise InputError(f"{path} cannot be read as DXF: {message[0]}") from None


def read_vector(path: Path, layer: str | None, srid: int | None) -> Drawn:
    """Read the lines of a GeoPackage, Shapefile, GeoJSON or FlatGeobuf.

    Parameters
    ----------
    layer
        Name of the layer; required if several contain lines.
    srid
        Required coordinate system, an EPSG code or LOCAL; None: not checked.

    Raises
    ------
    InputError
        If it can't be read, has no lines, has several layers to choose from, or is in another coordinate system.
    """
    import pyogrio
    import shapely

    source = vector_source(path)
    try:
        layers = [(str(name), str(kind)) for name, kind in pyogrio.list_layers(source) if kind is not None]
        linear = [name for name, kind in layers if not any(other in kind for other in ("Point", "Polygon", "Surface"))]
        chosen = choose_layer(path, linear, layer, [name for name, _ in layers])
        meta, _, wkb, _ = pyogrio.raw.read(source, layer=chosen, columns=[])
    except (pyogrio.errors.DataSourceError, UnicodeDecodeError) as error:
        raise InputError(f"{path} cannot be read: {str(error).strip().splitlines()[0]}") from None
    notes = _check_crs(path, meta["crs"], srid)
    try:
        geometries = shapely.get_parts(shapely.get_parts(shapely.from_wkb(wkb, on_invalid="ignore")))
    except shapely.errors.GEOSException as error:
        raise InputError(
            f"{path}: a geometry of layer {chosen!r} is damaged ({str(error).strip().splitlines()[0]}); fix it (in QGIS: Fix "
            "geometries)"
        ) from None
    geometries = geometries[np.isin(shapely.get_type_id(geometries), (1, 2))]  # lines and rings
    pieces = [shapely.get_coordinates(line, include_z=True) for line in geometries]
    broken = sum(not np.isfinite(piece[:, :2]).all() for piece in pieces)
    if broken:
        raise InputError(f"{path}: {broken} lines of layer {chosen!r} have invalid coordinates")
    return _drawn(path, join_pieces(pieces), chosen, notes)


def choose_layer(path: Path, names: list[str], wanted: str | None, others: list[str] | None = None) -> str:
    """Return the name of the wanted layer, or of the only one with lines."""
    listed = ", ".join(repr(name) for name in names)
    if wanted is not None:
        if wanted not in names:
            available = (
                f"it has {listed}" if names else f"there are none; its layers: {', '.join(map(repr, others or [])) or 'none'}"
            )
            raise InputError(f"{path} has no layer {wanted!r} of lines; {available}")
        return wanted
    if not names:
        other_layers = f"; its layers: {', '.join(map(repr, others))}" if others else ""
        raise InputError(f"{path} holds no lines{other_layers}; draw the axis as a line")
    if len(names) > 1:
        raise InputError(f"{path} holds {len(names)} layers of lines: {listed}; choose one by --axis-layer NAME")
    return names[0]


def _drawn(path: Path, lines: list[Float], layer: str, notes: tuple[str, ...]) -> Drawn:
    if not lines:
        raise InputError(f"{path}: layer {layer!r} holds no line with a length")
    for line in lines:
        if not np.isfinite(line[:, 2]).all() or not line[:, 2].any():
            line[:, 2] = np.nan
    return Drawn(lines, layer, notes)


def _check_crs(path: Path, stated: str | None, srid: int | None) -> tuple[str, ...]:
    if srid is None:
        return ()
    if stated is None:
        return () if srid == LOCAL else (f"states no coordinate system; using the tunnel's, EPSG:{srid}",)
    try:
        own = CRS.from_user_input(stated)
        fits, tunnel_crs = fits_srid(own, srid), describe_srid(srid)
    except CRSError as error:
        raise InputError(f"{path}: SRID {srid} or the file's coordinate system is unknown: {error}") from None
    if not fits:
        target = "in the scan's own coordinates" if srid == LOCAL else f"in EPSG:{srid}"
        srid_option = "--srid local" if is_local(own) else "the line's SRID"
        raise InputError(
            f"{path}: its coordinate system is {describe_crs(own)}, the tunnel's is {tunnel_crs}; save the line {target} (in "
            f"QGIS: Export, Save Features As), or add the tunnel with {srid_option}"
        )
    return ()


def _dxf_unit(path: Path, code: int, unit: float | None) -> tuple[float, str]:
    """Return the metres per drawing unit, and a note about it."""
    from ezdxf import units

    if unit is not None:
        stated = f"; the file states {units.decode(code)}" if code else ""
        return unit, f"unit: {unit:.9g} m, as given{stated}"
    if code == units.M:
        return 1.0, ""
    if code == 0:
        return 1.0, "states no unit; using metres, the unit of the SRID"
    raise InputError(
        f"{path}: its unit is {units.decode(code)} ($INSUNITS {code}); give the unit of its lengths, for "
        "example --axis-unit meter"
    )


def _simple(entity: Any) -> list[Any]:
    """Return the lines and arcs of a polyline, else the entity itself."""
    return list(entity.virtual_entities()) if entity.dxftype() in ("LWPOLYLINE", "POLYLINE") else [entity]


def _vertices(entity: Any, chord_error: float) -> Float:
    """Return vertices (n, 3) along a LINE, an ARC or a SPLINE, in its drawing's unit."""
    line = entity.dxftype() == "LINE"
    vertices = (entity.dxf.start, entity.dxf.end) if line else entity.flattening(chord_error)
    return np.array([tuple(vertex) for vertex in vertices], dtype=np.float64).reshape(-1, 3)


def _is_mesh(entity: Any) -> bool:
    return entity.dxftype() == "POLYLINE" and (entity.is_poly_face_mesh or entity.is_polygon_mesh)


def _densified(line: Float) -> Float:
    """Return the same line with vertices at most 1 m apart."""
    length = np.hypot(*np.diff(line[:, :2], axis=0).T)
    parts = np.maximum(np.ceil(length / MAX_STEP), 1.0).astype(int)
    within = np.arange(parts.sum()) - np.repeat(np.cumsum(parts) - parts, parts)
    at = np.append(np.repeat(np.arange(len(parts)), parts) + within / np.repeat(parts, parts), float(len(parts)))
    return np.column_stack([np.interp(at, np.arange(len(line)), column) for column in line.T])
