"""Comparison of the spots of a survey with reference spots."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import psycopg
import shapely
from shapely.affinity import translate
from shapely.geometry.base import BaseGeometry

from tunneldb.arrays import Float
from tunneldb.errors import NotReadyError
from tunneldb.evaluate.measure import compare
from tunneldb.evaluate.report import SPOTS, Report, make_report
from tunneldb.evaluate.spot_truth import read_spot_truth
from tunneldb.evaluate.surfaces import FoundFace, ProjectedPolygon, on_one_plane, place_of, project_on_face, project_on_faces
from tunneldb.evaluate.survey import distance_from_scanner
from tunneldb.store.poses import load_poses
from tunneldb.store.spots import ListedSpot, read_spots
from tunneldb.store.survey import Survey


@dataclass(frozen=True)
class SpotEvaluation:
    """Comparison of the spots of a survey with reference spots.

    Attributes
    ----------
    report : Report
    not_asked : int
        Number of true spots that were not visible enough to be required.
    true_area, on_faces : float
        Area of all true spots, and of their part on detected faces, m².
    statement : str or None
        Limitation of the list of spots.
    """

    report: Report
    not_asked: int
    true_area: float
    on_faces: float
    statement: str | None


def evaluate_spots(
    conn: psycopg.Connection[Any], survey: Survey, path: Path, layer: str | None, min_area: float
) -> SpotEvaluation:
    """Compare spots of the last run, or confirmed ones, that are not rejected with those of a file.

    All are projected onto the detected faces, and compared there.

    Parameters
    ----------
    conn, survey
        Database and survey.
    path, layer
        Reference data; see `read_spot_truth`.
    min_area : float
        Least area of a required spot; smaller ones are ignored, m².

    Raises
    ------
    UserError
        If spots were not searched for, or the reference data can't be used.
    """
    truth = read_spot_truth(survey, path, layer)
    listed = read_spots(conn, survey, "3d")
    if not listed.searched and not listed.face_area:
        raise NotReadyError(f"spots were not searched for in survey {survey.name}; type tunneldb members {survey.name}")
    rows = [row for row in listed.rows if row.review != "rejected"]
    origin = np.floor(shapely.get_coordinates(truth.shapes, include_z=True).mean(axis=0))
    faces = _read_faces(conn, survey, origin)
    shapes = [_shifted(shape, origin) for shape in truth.shapes]
    true = [project_on_faces(shape, faces) for shape in shapes]
    found = _project_found(rows, faces, origin)
    flat = on_one_plane([one.parts for one in [*true, *found]])
    comparison = compare(flat[: len(true)], flat[len(true) :], min_area, asked=truth.asked)
    poses = load_poses(conn, survey)
    seen_shapes = [_shifted(row.geometry, origin) for row in rows]
    kept = [(k, true[k], shapes[k]) for k in comparison.true], [(k, found[k], seen_shapes[k]) for k in comparison.found]
    places: list[list[dict[str, Any]]] = [[], []]
    distances: list[Float] = []
    for side, of in enumerate(kept):
        at = np.array([place_of(projected.parts, faces, shape) for _, projected, shape in of]).reshape(-1, 3) + origin
        distances.append(distance_from_scanner(at, poses))
        places[side] = [_place(projected, faces, xyz) for (_, projected, _), xyz in zip(of, at, strict=True)]
    report = make_report(
        comparison, truth.ids, [str(row.number) for row in rows], (distances[0], distances[1]), min_area, listed.seen_area,
        SPOTS, (places[0], places[1]),
    )  # fmt: skip
    areas = [sum(part.area for _, part in one.parts) for one in true]
    return SpotEvaluation(
        report, int(np.count_nonzero(~truth.asked)), float(sum(areas)), float(sum(one.on_faces for one in true)),
        listed.statement,
    )  # fmt: skip


def _read_faces(conn: psycopg.Connection[Any], survey: Survey, origin: Float) -> list[FoundFace]:
    """Read the faces of a survey, with models relative to an origin."""
    rows = conn.execute(
        "SELECT number, member, origin, axis, radius, inside, across, public.ST_AsBinary(outline) FROM tunnel_api.face"
        " WHERE survey_id = %s ORDER BY number",
        [survey.id],
    ).fetchall()
    faces = []
    for number, member, at, axis, radius, inside, across, outline in rows:
        model = np.array([*(np.array(at) - origin), *axis, radius or 0.0, -1.0 if inside else 1.0, *across])
        faces.append(FoundFace(number, member, model, shapely.from_wkb(bytes(outline))))
    return faces


def _project_found(rows: list[ListedSpot], faces: list[FoundFace], origin: Float) -> list[ProjectedPolygon]:
    """Project found spots onto their faces; a confirmed one that the last run did not find again keeps its place."""
    at = {face.number: k for k, face in enumerate(faces)}
    out = []
    for row in rows:
        shape = _shifted(row.geometry, origin)
        if row.face is None:
            out.append(project_on_faces(shape, faces))
        else:
            flat = project_on_face(shape, faces[at[row.face]])
            out.append(ProjectedPolygon([(at[row.face], flat)], flat.area))
    return out


def _place(projected: ProjectedPolygon, faces: list[FoundFace], xyz: Float) -> dict[str, Any]:
    """Return member, face and coordinates of a spot."""
    k = max(projected.parts, key=lambda one: one[1].area)[0]
    face = None if k is None else faces[k]
    x, y, z = (round(float(value), 3) for value in xyz)
    return {"member": face and face.member, "face": face and face.number, "x": x, "y": y, "z": z}


def _shifted(shape: BaseGeometry, origin: Float) -> BaseGeometry:
    return translate(shape, *(-origin))
