"""Members, faces and spots of a structure as a GeoPackage."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyogrio
import shapely
from pyproj import CRS

from tunneldb.export.exchange.gpkg import VERSION
from tunneldb.export.tables.geopackage import UNDEFINED_CARTESIAN
from tunneldb.structures.results import Face, Member, Spot, Structures

MEMBER = "Faces of one surface, joined over what stands before it; in space"
FACE = "Planes and parts of cylinders; in space. Of what was not seen (1 - seen_share) nothing is known"
SPOT = "What is darker or brighter than its own surface; in space"


def write_members(path: Path, found: Structures, crs: CRS | None) -> dict[str, int]:
    """Write the layers member, face and spot; how many of each.

    Parameters
    ----------
    path : Path
        File that isn't there yet.
    found : Structures
    crs : CRS or None
        Of the points, where it is known.
    """
    faces = {face.number: face for face in found.faces}
    shapes = {number: _solid(face.in_space(face.outline)) for number, face in faces.items()}
    members = [_together([shapes[number] for number in member.faces]) for member in found.members]
    spots = [_solid(faces[spot.face].in_space(spot.outline)) for spot in found.spots]
    _write(path, "member", [member_row(member) for member in found.members], members, crs, MEMBER)
    _write(path, "face", [face_row(face) for face in found.faces], list(shapes.values()), crs, FACE)
    _write(path, "spot", [spot_row(spot) for spot in found.spots], spots, crs, SPOT)
    return {"member": len(members), "face": len(shapes), "spot": len(spots)}


def member_row(member: Member) -> dict[str, Any]:
    """A member as a row; m, m²."""
    return {
        "member": member.number,
        "kind": member.kind,
        "faces": len(member.faces),
        "area": member.area,
        "length": member.length,
        "bimodal": member.bimodal,
    }


def face_row(face: Face) -> dict[str, Any]:
    """A face as a row; m, m², degrees, dB."""
    return {
        "face": face.number,
        "member": face.member,
        "kind": face.kind,
        "points": face.points,
        "area": face.area,
        "radius": face.radius,
        "rms": face.rms,
        "seen_share": face.seen_share,
        "incidence_from": face.incidence[0],
        "incidence_to": face.incidence[1],
        "level": face.level,
        "sigma": face.sigma,
        "bimodal": face.bimodal,
    }


def spot_row(spot: Spot) -> dict[str, Any]:
    """A spot as a row; m², dB."""
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
        "rgb": None if spot.rgb is None else ", ".join(map(str, spot.rgb)),
    }


def _solid(shape: shapely.Geometry) -> shapely.Geometry:
    return shape if isinstance(shape, shapely.MultiPolygon) else shapely.MultiPolygon([shape])


def _together(shapes: Sequence[shapely.Geometry]) -> shapely.Geometry:
    return shapely.MultiPolygon([part for shape in shapes for part in shapely.get_parts(shape)])


def _write(
    path: Path, name: str, rows: list[dict[str, Any]], shapes: Sequence[shapely.Geometry], crs: CRS | None, text: str
) -> None:
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
            geometry_type="MultiPolygon Z",
            crs=crs.to_wkt() if crs is not None else None,
            driver="GPKG",
            layer=name,
            DESCRIPTION=text,
            **({} if crs is not None else UNDEFINED_CARTESIAN),
            **VERSION,
        )
