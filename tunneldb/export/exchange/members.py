"""Members, faces and spots of a structure as a GeoPackage."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pyogrio
import shapely
from pyproj import CRS

from tunneldb.export.exchange.gpkg import VERSION
from tunneldb.export.tables.geopackage import UNDEFINED_CARTESIAN
from tunneldb.structures.models import AXIS, POINT, SIDE
from tunneldb.structures.results import Face, Member, Spot, Structures

Geometry = Literal["face", "map", "3d"]
"""Geometries: each face's own plane, unrolled for a pipe; the map; in space."""

_WHERE = {"face": "in each face's own plane", "map": "on the map", "3d": "in space"}
_MEMBER = "Faces of one surface, joined across objects in front of it; {}"
_FACE = "Planes and parts of cylinders; {}. The share 1 - seen_share was not inspected"
_SPOT = "Areas darker or brighter than their own surface; {}"


def write_members(path: Path, found: Structures, crs: CRS | None, geometry: Geometry = "3d") -> dict[str, int]:
    """Write the layers member, face and spot; how many of each.

    Parameters
    ----------
    path : Path
        File that isn't there yet.
    found : Structures
    crs : CRS or None
        Coordinate system of the points, if known; a face's own plane has none.
    geometry : {'face', 'map', '3d'}
        Members have no plane of their own: with ``face`` their layer has the faces' outlines, each in its own plane.
    """
    faces = {face.number: face for face in found.faces}
    shapes = {number: _placed(face, face.outline, geometry) for number, face in faces.items()}
    members = [_together([shapes[number] for number in member.faces]) for member in found.members]
    spots = [_placed(faces[spot.face], spot.outline, geometry) for spot in found.spots]
    crs, where = None if geometry == "face" else crs, _WHERE[geometry]
    form = "MultiPolygon Z" if geometry == "3d" else "MultiPolygon"
    _write(path, "member", [member_row(member) for member in found.members], members, crs, _MEMBER.format(where), form)
    _write(path, "face", [face_row(face) for face in found.faces], list(shapes.values()), crs, _FACE.format(where), form)
    note = ". ".join(filter(None, [_SPOT.format(where), found.left_out.statement]))
    _write(path, "spot", [spot_row(spot) for spot in found.spots], spots, crs, note, form)
    return {"member": len(members), "face": len(shapes), "spot": len(spots)}


def _placed(face: Face, shape: shapely.Geometry, geometry: Geometry) -> shapely.Geometry:
    """Return an outline on a face, in the requested coordinates."""
    if geometry == "map":
        return _solid(shapely.union_all([face.on_map(part) for part in shapely.get_parts(shape)]))
    return _solid(face.in_space(shape) if geometry == "3d" else shape)


def member_row(member: Member) -> dict[str, Any]:
    """Return a member as a row; m, m²."""
    return {
        "member": member.number,
        "kind": member.kind,
        "faces": len(member.faces),
        "area": member.area,
        "length": member.length,
        "bimodal": member.bimodal,
    }


def face_row(face: Face) -> dict[str, Any]:
    """Return a face as a row; m, m², degrees, dB. A pipe has a point and the direction of its axis, a plane of its normal."""
    return {
        "face": face.number,
        "member": face.member,
        "side": face.side,
        "kind": face.kind,
        "points": face.points,
        "area": face.area,
        "radius": face.radius,
        "origin": (face.origin + face.model[POINT]).tolist(),
        "axis": face.model[AXIS].tolist(),
        "inside": bool(face.model[SIDE] < 0.0),
        "rms": face.rms,
        "seen_share": face.seen_share,
        "incidence_from": face.incidence[0],
        "incidence_to": face.incidence[1],
        "level": face.level,
        "sigma": face.sigma,
        "bimodal": face.bimodal,
    }


def spot_row(spot: Spot) -> dict[str, Any]:
    """Return a spot as a row; m², dB."""
    return {
        "spot": spot.number,
        "face": spot.face,
        "member": spot.member,
        "kind": spot.kind,
        "reasons": ", ".join(spot.reasons),
        "confidence": spot.confidence,
        "contrast": spot.contrast,
        "difference": spot.difference,
        "area": spot.area,
        "points": spot.points,
        "scans": spot.scans,
        "rgb": None if spot.rgb is None else list(spot.rgb),
    }


def _solid(shape: shapely.Geometry) -> shapely.Geometry:
    return shape if isinstance(shape, shapely.MultiPolygon) else shapely.MultiPolygon([shape])


def _together(shapes: Sequence[shapely.Geometry]) -> shapely.Geometry:
    return shapely.MultiPolygon([part for shape in shapes for part in shapely.get_parts(shape)])


def _flat(row: dict[str, Any]) -> dict[str, Any]:
    """Return a row with a column for each coordinate, and colours for QGIS."""
    out: dict[str, Any] = {}
    for name, value in row.items():
        if name == "rgb":
            out[name] = None if value is None else ", ".join(map(str, value))
        elif isinstance(value, list):
            out |= {f"{name}_{axis}": part for axis, part in zip("xyz", value, strict=True)}
        else:
            out[name] = value
    return out


def _write(
    path: Path, name: str, rows: list[dict[str, Any]], shapes: Sequence[shapely.Geometry], crs: CRS | None, text: str,
    form: str,
) -> None:  # fmt: skip
    rows = [_flat(row) for row in rows]
    names = list(rows[0]) if rows else [name]
    columns = [np.array([row[column] for row in rows]) for column in names] if rows else [np.empty(0, np.int64)]
    columns = [column.astype(object) if column.dtype.kind == "U" else column for column in columns]
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "'crs' was not provided")
        pyogrio.raw.write(
            str(path),
            np.array(shapely.to_wkb(np.array(shapes, dtype=object), flavor="iso"), dtype=object).reshape(-1),
            columns,
            np.array(names),
            field_mask=[None] * len(columns),
            geometry_type=form,
            crs=crs.to_wkt() if crs is not None else None,
            driver="GPKG",
            layer=name,
            DESCRIPTION=text,
            **({} if crs is not None else UNDEFINED_CARTESIAN),
            **VERSION,
        )
