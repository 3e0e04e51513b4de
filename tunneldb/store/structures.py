"""Members, faces and spots of a survey into the database; spots matched with those of earlier runs and surveys."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import psycopg
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon

from tunneldb.anomalies.matching import match
from tunneldb.arrays import Float
from tunneldb.geometry.surface import Surface
from tunneldb.store.survey import Survey
from tunneldb.structures.models import ACROSS, AXIS, POINT, SIDE, unroll
from tunneldb.structures.results import Face, Member, Spot, Structures

NEAR = 0.05
"""An earlier spot lies on a face if no vertex of it is farther from it, m: registration of scans is better than that."""


@dataclass(frozen=True)
class SavedSpots:
    """What became of spots: found for the first time, found again, kept for their review, and taken away."""

    new: int
    again: int
    kept: int
    gone: int


@dataclass(frozen=True)
class _Earlier:
    """A spot of an earlier run of the survey, or of another survey of the same structure; id is None for the latter."""

    id: int | None
    number: int
    kind: Literal["dark", "bright"]
    reviewed: bool
    vertices: Float


def save_structures(conn: psycopg.Connection[Any], survey: Survey, found: Structures, surface: Surface | None) -> SavedSpots:
    """Replace the members, faces and spots of a survey; a spot that is found again keeps its id, number and review.

    A spot is found again when it and an earlier one of its kind overlap best with each other on the same face, by at least
    0.3 of their union. One that was found in another survey of the tunnel or site has that one's number. Of those not found
    again the reviewed ones stay, marked as not detected and on no face.

    Parameters
    ----------
    conn : Connection
        In a transaction.
    survey : Survey
    found : Structures
    surface : Surface or None
        By which chainage is told; None of a site, or before stage sections.
    """
    own, others = _earlier(conn, survey)
    conn.execute("DELETE FROM tunnel.member WHERE survey_id = %s", [survey.id])
    members = {member.number: _insert_member(conn, survey, member, surface) for member in found.members}
    by_number = {face.number: face for face in found.faces}
    faces = {face.number: _insert_face(conn, survey, face, members[face.member], surface) for face in found.faces}
    again = _matches(found.spots, by_number, own)
    known = _matches(found.spots, by_number, others)
    # What another spot has already, this survey's own or another's, is nobody else's number.
    taken = {one.number for one in own}
    last = max((one.number for one in [*own, *others]), default=0)
    for k, spot in enumerate(found.spots):
        row = _spot_row(spot, by_number[spot.face], surface, survey) | {"face_id": faces[spot.face], "survey_id": survey.id}
        if k in again:
            conn.execute(_UPDATE, {**row, "id": own[again[k]].id})
            continue
        number = others[known[k]].number if k in known else None
        if number is None or number in taken:
            last += 1
            number = last
        taken.add(number)
        conn.execute(_INSERT, {**row, "number": number})
    lost = [one for k, one in enumerate(own) if k not in again.values()]
    kept, gone = [one.id for one in lost if one.reviewed], [one.id for one in lost if not one.reviewed]
    conn.execute("UPDATE tunnel.spot SET detected = false WHERE id = ANY (%s)", [kept])
    conn.execute("DELETE FROM tunnel.spot WHERE id = ANY (%s)", [gone])
    return SavedSpots(len(found.spots) - len(again), len(again), len(kept), len(gone))


def _earlier(conn: psycopg.Connection[Any], survey: Survey) -> tuple[list[_Earlier], list[_Earlier]]:
    """Spots of the survey itself, and of each number in its other surveys the latest, in the order of their numbers."""
    # One at a time gives out numbers.
    conn.execute("SELECT FROM tunnel.tunnel WHERE id = %s FOR UPDATE", [survey.tunnel_id])
    rows = conn.execute(
        """
        SELECT DISTINCT ON (p.survey_id = %(survey)s, p.number)
               p.survey_id = %(survey)s, p.id, p.number, p.kind, p.review <> 'open' OR p.remark IS NOT NULL,
               public.ST_AsBinary(p.surface)
          FROM tunnel.spot p
          JOIN tunnel.survey s ON s.id = p.survey_id
         WHERE s.tunnel_id = %(tunnel)s
         ORDER BY p.survey_id = %(survey)s, p.number, s.date DESC, p.id
        """,
        {"survey": survey.id, "tunnel": survey.tunnel_id},
    ).fetchall()
    own: list[_Earlier] = []
    others: list[_Earlier] = []
    for mine, key, number, kind, reviewed, wkb in rows:
        vertices = shapely.get_coordinates(shapely.from_wkb(bytes(wkb)), include_z=True)
        (own if mine else others).append(_Earlier(key if mine else None, number, kind, reviewed, vertices))
    return own, others


def _matches(spots: Sequence[Spot], faces: dict[int, Face], earlier: Sequence[_Earlier]) -> dict[int, int]:
    """Index of a spot → index of the earlier one that it is."""
    found: dict[int, int] = {}
    if not earlier:
        return found
    of_face: dict[tuple[int, str], list[int]] = {}
    for k, spot in enumerate(spots):
        of_face.setdefault((spot.face, spot.kind), []).append(k)
    boxes = [(one.vertices.min(axis=0) - NEAR, one.vertices.max(axis=0) + NEAR) for one in earlier]
    for (number, kind), of in of_face.items():
        face = faces[number]
        low, high = _box(face)
        near = [
            k for k, one in enumerate(earlier)
            if one.kind == kind and k not in found.values() and (boxes[k][0] <= high).all() and (boxes[k][1] >= low).all()
        ]  # fmt: skip
        outlines = [(k, outline) for k in near if (outline := _on_face(face, earlier[k].vertices)) is not None]
        pairs = match([outline for _, outline in outlines], [spots[k].outline for k in of])
        found |= {of[now]: outlines[before][0] for now, before in pairs.items()}
    return found


def _box(face: Face) -> tuple[NDArray[Any], NDArray[Any]]:
    at = shapely.get_coordinates(face.in_space(face.outline), include_z=True)
    return at.min(axis=0), at.max(axis=0)


def _on_face(face: Face, vertices: Float) -> Polygon | None:
    """Outline in a face's unrolled coordinates of what has these vertices in space; None if it does not lie on it."""
    u, v, off = unroll(face.model, vertices - face.origin)
    if np.abs(off).max() > NEAR:
        return None
    outline = shapely.make_valid(Polygon(np.column_stack([u, v])))
    return outline if outline.area > 0.0 else None


def _insert_member(conn: psycopg.Connection[Any], survey: Survey, member: Member, surface: Surface | None) -> int:
    row = conn.execute(
        """
        INSERT INTO tunnel.member (survey_id, number, kind, length, area, bimodal, chainage, line)
        VALUES (%s, %s, %s, %s, %s, %s, %s, public.ST_GeomFromWKB(%s, %s::int)) RETURNING id
        """,
        [
            survey.id, member.number, member.kind, member.length, member.area, member.bimodal,
            _chainage(member.line.mean(axis=0), surface), shapely.to_wkb(shapely.LineString(member.line)), survey.srid,
        ],
    ).fetchone()  # fmt: skip
    assert row is not None
    return int(row[0])


def _insert_face(conn: psycopg.Connection[Any], survey: Survey, face: Face, member: int, surface: Surface | None) -> int:
    solid = face.in_space(face.outline)
    row = conn.execute(
        """
        INSERT INTO tunnel.face (survey_id, member_id, number, side, kind, origin, axis, across, radius, inside, rms, points,
                                 area, seen_share, incidence_from, incidence_to, level, sigma, bimodal, chainage, outline,
                                 surface)
        VALUES (%s, %s, %s, %s, %s, %s, %s, %s, %s, %s, %s, %s, %s, %s, %s, %s, %s, %s, %s, %s, public.ST_GeomFromWKB(%s, 0),
                public.ST_GeomFromWKB(%s, %s::int)) RETURNING id
        """,
        [
            survey.id, member, face.number, face.side, face.kind, (face.origin + face.model[POINT]).tolist(),
            face.model[AXIS].tolist(), face.model[ACROSS].tolist(), face.radius or None, bool(face.model[SIDE] < 0.0), face.rms,
            face.points, face.area, face.seen_share, *map(_number, face.incidence), _number(face.level), _number(face.sigma),
            face.bimodal,
            _chainage(shapely.get_coordinates(solid, include_z=True).mean(axis=0), surface),
            shapely.to_wkb(face.outline), shapely.to_wkb(solid), survey.srid,
        ],
    ).fetchone()  # fmt: skip
    assert row is not None
    return int(row[0])


_INSERT = """
    INSERT INTO tunnel.spot (survey_id, number, face_id, kind, reasons, confidence, contrast, difference, area, points, scans,
                             rgb, chainage, outline, map, surface)
    VALUES (%(survey_id)s, %(number)s, %(face_id)s, %(kind)s, %(reasons)s, %(confidence)s, %(contrast)s, %(difference)s,
            %(area)s, %(points)s, %(scans)s, %(rgb)s, %(chainage)s, public.ST_GeomFromWKB(%(outline)s, 0),
            public.ST_GeomFromWKB(%(map)s, %(srid)s::int), public.ST_GeomFromWKB(%(surface)s, %(srid)s::int))
"""
_UPDATE = """
    UPDATE tunnel.spot
       SET face_id = %(face_id)s, reasons = %(reasons)s, confidence = %(confidence)s, contrast = %(contrast)s,
           difference = %(difference)s, area = %(area)s, points = %(points)s, scans = %(scans)s, rgb = %(rgb)s,
           chainage = %(chainage)s, outline = public.ST_GeomFromWKB(%(outline)s, 0),
           map = public.ST_GeomFromWKB(%(map)s, %(srid)s::int), surface = public.ST_GeomFromWKB(%(surface)s, %(srid)s::int),
           detected = true, detected_at = now()
     WHERE id = %(id)s
"""


def _spot_row(spot: Spot, face: Face, surface: Surface | None, survey: Survey) -> dict[str, Any]:
    solid = face.in_space(spot.outline)
    return {
        "kind": spot.kind,
        "reasons": list(spot.reasons),
        "confidence": spot.confidence,
        "contrast": spot.contrast,
        "difference": spot.difference,
        "area": spot.area,
        "points": spot.points,
        "scans": spot.scans,
        "rgb": None if spot.rgb is None else list(spot.rgb),
        "chainage": _chainage(shapely.get_coordinates(solid, include_z=True).mean(axis=0), surface),
        "outline": shapely.to_wkb(spot.outline),
        "map": shapely.to_wkb(face.on_map(spot.outline)),
        "surface": shapely.to_wkb(solid),
        "srid": survey.srid,
    }


def _chainage(place: Float, surface: Surface | None) -> float | None:
    return None if surface is None else _number(float(surface.unroll(place[None]).chainage[0]))


def _number(value: float) -> float | None:
    """A number, NULL where there is none."""
    return float(value) if np.isfinite(value) else None
