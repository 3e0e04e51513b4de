"""Projection of polygons in space onto faces, and of all faces onto one plane for comparison, without input or output."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.affinity import translate
from shapely.geometry import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from tunneldb.arrays import Float
from tunneldb.structures.models import RADIUS, to_space, unroll
from tunneldb.structures.reconcile import MAX_VERTEX_DISTANCE

MAX_FACE_DISTANCE = 0.005
"""Distance behind the nearest face up to which a polygon is on a face, too, m."""

_MIN_AREA = 1e-6  # m²; smaller areas are rounding errors
_FACE_SPACING = 1.0  # m between faces on the plane


@dataclass(frozen=True)
class FoundFace:
    """Detected face.

    Attributes
    ----------
    number, member : int
        Numbers in the survey.
    model : (11,) float array
        Model as in `structures.models`, m.
    outline : MultiPolygon
        Unrolled outline, m.
    """

    number: int
    member: int
    model: Float
    outline: BaseGeometry


@dataclass(frozen=True)
class ProjectedPolygon:
    """Polygon projected onto faces.

    Attributes
    ----------
    parts : list of (int or None, geometry)
        Index of the face, and the part on it in unrolled coordinates, m; None for a plane of its own.
    on_faces : float
        Area within the outlines of faces, m².
    """

    parts: list[tuple[int | None, BaseGeometry]]
    on_faces: float


def project_on_face(shape: BaseGeometry, face: FoundFace) -> BaseGeometry:
    """Unroll a polygon in space on a face, at any distance from it; m."""
    return shapely.union_all([_unrolled(part, face.model) for part in shapely.get_parts(shape)])


def project_on_faces(shape: BaseGeometry, faces: Sequence[FoundFace]) -> ProjectedPolygon:
    """Project a polygon in space onto the faces whose outlines it overlaps.

    A part outside all faces stays with the face that shares most of the polygon; a polygon on no face gets its own plane.

    Parameters
    ----------
    shape : Polygon or MultiPolygon
        Polygon with Z, m, in the models' coordinates.
    faces : sequence of FoundFace
    """
    at = shapely.get_coordinates(shape, include_z=True)
    near: list[tuple[float, int, BaseGeometry, BaseGeometry]] = []
    for k, face in enumerate(faces):
        off = np.abs(unroll(face.model, at)[2])
        if off.max() > MAX_VERTEX_DISTANCE:
            continue
        flat = project_on_face(shape, face)
        shared = shapely.intersection(flat, face.outline)
        if shared.area > _MIN_AREA:
            near.append((float(np.median(off)), k, flat, shared))
    if not near:
        return ProjectedPolygon([(None, _own_plane(shape))], 0.0)
    near.sort(key=lambda one: one[:2])
    near = [one for one in near if one[0] <= near[0][0] + MAX_FACE_DISTANCE]
    home = max(near, key=lambda one: one[3].area)
    parts: dict[int, BaseGeometry] = {}
    covered: BaseGeometry = Polygon()
    for _, k, _, shared in near:
        own = shared if covered.is_empty else shapely.difference(shared, _moved(covered, faces[home[1]], faces[k]))
        if own.area > _MIN_AREA:
            parts[k] = own
            covered = shapely.union(covered, _moved(own, faces[k], faces[home[1]]))
    on_faces = float(sum(part.area for part in parts.values()))
    rest = shapely.difference(home[2], covered)
    if rest.area > _MIN_AREA:
        parts[home[1]] = shapely.union(parts.get(home[1], Polygon()), rest)
    return ProjectedPolygon(list(parts.items()), on_faces)


def on_one_plane(projected: Sequence[Sequence[tuple[int | None, BaseGeometry]]]) -> list[BaseGeometry]:
    """Return polygons from their parts on faces, with the faces side by side on one plane; areas are preserved."""
    bounds: dict[int | tuple[int, int], list[tuple[float, ...]]] = {}
    for n, parts in enumerate(projected):
        for k, part in parts:
            bounds.setdefault((n, -1) if k is None else k, []).append(part.bounds)
    shift: dict[int | tuple[int, int], float] = {}
    end = 0.0
    for key, boxes in bounds.items():
        low, high = min(box[0] for box in boxes), max(box[2] for box in boxes)
        shift[key] = end - low
        end += high - low + _FACE_SPACING
    return [
        _polygons(shapely.union_all([translate(part, shift[(n, -1) if k is None else k]) for k, part in parts]))
        for n, parts in enumerate(projected)
    ]


def place_of(parts: Sequence[tuple[int | None, BaseGeometry]], faces: Sequence[FoundFace], shape: BaseGeometry) -> Float:
    """Return a point in space inside the largest part of a polygon; m."""
    k, part = max(parts, key=lambda one: one[1].area)
    if k is None:
        return np.asarray(shapely.get_coordinates(shape, include_z=True).mean(axis=0))
    inside = shapely.point_on_surface(part)
    return np.asarray(to_space(faces[k].model, np.array([inside.x]), np.array([inside.y]))[0, :3])


def _moved(shape: BaseGeometry, face: FoundFace, to: FoundFace) -> BaseGeometry:
    """Return a shape unrolled on a face, unrolled on another face."""
    if face is to:
        return shape

    def raised(flat: Float) -> Float:
        return to_space(face.model, flat[:, 0], flat[:, 1])[:, :3]

    lifted = shapely.force_3d(shape)
    return project_on_face(shapely.set_coordinates(lifted, raised(shapely.get_coordinates(shape))), to)


def _unrolled(part: Polygon, model: Float) -> BaseGeometry:
    """Return an unrolled polygon; on a cylinder also across the cut."""
    radius = float(model[RADIUS])
    turn = 2.0 * math.pi * radius

    def flat(ring: Float, start: float | None) -> Float:
        u, v, _ = unroll(model, ring)
        if radius > 0.0:
            v = radius * np.unwrap(v / radius)
            if start is not None:  # a hole is in the same turn as its outline
                v += turn * np.round((start - v[0]) / turn)
        return np.column_stack([u, v])

    rings = [shapely.get_coordinates(ring, include_z=True) for ring in (part.exterior, *part.interiors)]
    shell = flat(rings[0], None)
    shape = shapely.make_valid(Polygon(shell, [flat(ring, float(shell[0, 1])) for ring in rings[1:]]))
    if radius == 0.0:
        return shape
    low, high = shape.bounds[0] - 1.0, shape.bounds[2] + 1.0
    cut = shapely.box(low, -0.5 * turn, high, 0.5 * turn)
    return shapely.union_all([shapely.intersection(translate(shape, 0.0, k * turn), cut) for k in (-1, 0, 1)])


def _own_plane(shape: BaseGeometry) -> BaseGeometry:
    """Return a polygon in the plane that best fits its vertices."""
    at = shapely.get_coordinates(shape, include_z=True)
    middle = at.mean(axis=0)
    directions = np.linalg.svd(at - middle, full_matrices=False)[2]
    flat = shapely.transform(shape, lambda xyz: (xyz - middle) @ directions.T, include_z=True)
    return shapely.make_valid(shapely.force_2d(flat))


def _polygons(shape: BaseGeometry) -> Polygon | MultiPolygon:
    parts = [part for part in shapely.get_parts(shapely.get_parts(shape)) if isinstance(part, Polygon)]
    return parts[0] if len(parts) == 1 else MultiPolygon(parts)
