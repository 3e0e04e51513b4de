"""Lines of maps: GeoPackage, Shapefile, GeoJSON and FlatGeobuf by GDAL; layers of drawings and maps."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pyproj import CRS
from pyproj.exceptions import CRSError

from tunneldb.alignment.joining import join_pieces
from tunneldb.arrays import Bool, Float
from tunneldb.counted import counted
from tunneldb.errors import InputError
from tunneldb.files import gdal_fault, vector_source
from tunneldb.geometry.crs import describe_crs, describe_srid, fits_srid, is_local, srid_name
from tunneldb.geometry.local import LOCAL

MAX_COORDINATE = 1e9
"""Greatest coordinate of a line, m; greater ones are damage."""

_MAX_LISTED = 8
_LOWEST = -9000.0  # m; lower heights are numbers for no height, as -9999
_MAX_DROP = 0.2  # greatest grade beside a vertex at height 0; a steeper one has no height
_MIN_DROP = 5.0  # m


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
        if not (number.isascii() and number.isdecimal()) or not 1 <= int(number) <= len(self.lines):
            raise InputError(f"{path}: layer {self.layer!r} has no line {number!r}; it holds {count}: {listed}")
        return self.lines[int(number) - 1]


def describe_line(line: Float) -> str:
    """Return length and ends of a line, for a message."""
    length = float(np.hypot(*np.diff(line[:, :2], axis=0).T).sum())
    (x1, y1), (x2, y2) = line[0, :2], line[-1, :2]
    return f"{length:.1f} m from {x1:.1f},{y1:.1f} to {x2:.1f},{y2:.1f}"


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
    except (RuntimeError, ValueError) as error:  # those of pyogrio, and names that are not UTF-8
        raise InputError(f"{path} cannot be read: {gdal_fault(error)}") from None
    notes = _check_crs(path, meta["crs"], srid)
    try:
        rows = shapely.from_wkb(np.empty(0, object) if wkb is None else wkb, on_invalid="ignore")
    except shapely.errors.GEOSException as error:
        raise InputError(
            f"{path}: a geometry of layer {chosen!r} is damaged ({str(error).strip().splitlines()[0]}); fix it (in QGIS: Fix "
            "geometries)"
        ) from None
    whole = rows[~shapely.is_missing(rows) & ~shapely.is_empty(rows)]
    if len(whole) < len(rows):
        notes += (f"rows without geometry in layer {chosen!r}: {len(rows) - len(whole)} of {len(rows)}; left out",)
    geometries = shapely.get_parts(shapely.get_parts(whole))
    geometries = geometries[np.isin(shapely.get_type_id(geometries), (1, 2))]  # lines and rings
    pieces = [shapely.get_coordinates(line, include_z=True) for line in geometries]
    broken = sum(not (np.abs(piece[:, :2]) <= MAX_COORDINATE).all() for piece in pieces)
    if broken:
        raise InputError(f"{path}: {counted(broken, 'line')} of layer {chosen!r} with invalid coordinates; draw them again")
    return drawn_lines(path, join_pieces(pieces), chosen, notes)


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


def drawn_lines(path: Path, lines: list[Float], layer: str, notes: tuple[str, ...]) -> Drawn:
    """Return joined lines of a layer, with heights for all vertices or none.

    Raises
    ------
    InputError
        If there are none.
    """
    if not lines:
        raise InputError(f"{path}: layer {layer!r} holds no line with a length; draw the axis as a line")
    heightless = 0
    for line in lines:
        missing = _without_height(line)
        if missing.all():
            line[:, 2] = np.nan
        elif missing.any():
            heightless += int(missing.sum())
            along = np.append(0.0, np.hypot(*np.diff(line[:, :2], axis=0).T).cumsum())
            line[missing, 2] = np.interp(along[missing], along[~missing], line[~missing, 2])
    if heightless:
        notes += (f"vertices without height in layer {layer!r}: {heightless}; interpolated between their neighbours",)
    return Drawn(lines, layer, notes)


def _without_height(line: Float) -> Bool:
    """Return True for the vertices (n,) of a line without height: not a number, below any land, or a sudden 0."""
    z = line[:, 2]
    missing = ~(z > _LOWEST)
    if not z[~missing].any():
        return np.ones(len(z), bool)
    plan, rise = np.hypot(*np.diff(line[:, :2], axis=0).T), np.abs(np.diff(z))
    steep = (rise > _MAX_DROP * plan + _MIN_DROP) & (np.minimum(np.abs(z[1:]), np.abs(z[:-1])) == 0.0)
    zero = z == 0.0
    # a run of zeros has no heights if a step at one of its ends is steep
    run = np.cumsum(np.append(True, zero[1:] != zero[:-1]))
    wrong = np.union1d(run[1:][steep & zero[1:]], run[:-1][steep & zero[:-1]])
    return np.asarray(missing | (zero & np.isin(run, wrong)))


def _check_crs(path: Path, stated: str | None, srid: int | None) -> tuple[str, ...]:
    if srid is None:
        return ()
    if stated is None:
        unread = path.with_suffix(".prj").is_file()
        system = f"a coordinate system that cannot be read ({path.stem}.prj)" if unread else "no coordinate system"
        return () if srid == LOCAL and not unread else (f"states {system}; using the tunnel's, {srid_name(srid)}",)
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
