"""Members, faces and spots of a survey to the database, and spots of earlier runs and surveys back."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import psycopg
import shapely

from tunneldb.store.survey import Survey
from tunneldb.structures.models import ACROSS, AXIS, POINT, SIDE
from tunneldb.structures.records import EarlierSpot, PlacedFace, PlacedSpot, PlacedStructures, SpotReconciliation
from tunneldb.structures.results import Face, Member, Spot


@dataclass(frozen=True)
class SavedSpots:
    """Numbers of spots: found for the first time, found again, kept for their review, and deleted."""

    new: int
    again: int
    kept: int
    gone: int


def save_structures(
    conn: psycopg.Connection[Any], survey: Survey, placed: PlacedStructures, changes: SpotReconciliation
) -> SavedSpots:
    """Replace the members and faces of a survey, and write the changes to its spots.

    Parameters
    ----------
    conn : Connection
        In a transaction.
    survey : Survey
    placed : PlacedStructures
        Result, and its places.
    changes : SpotReconciliation
        Updated spots keep their number and their review; kept ones are marked as not detected, and are on no face.
    """
    conn.execute("DELETE FROM tunnel.member WHERE survey_id = %s", [survey.id])
    found = placed.structures
    members = {
        member.number: _insert_member(conn, survey, member, chainage)
        for member, chainage in zip(found.members, placed.members, strict=True)
    }
    faces = {
        face.number: _insert_face(conn, survey, face, members[face.member], place)
        for face, place in zip(found.faces, placed.faces, strict=True)
    }
    for k, (spot, place) in enumerate(zip(found.spots, placed.spots, strict=True)):
        row = _spot_row(spot, place, survey) | {"face_id": faces[spot.face], "survey_id": survey.id}
        if k in changes.update:
            conn.execute(_UPDATE, {**row, "id": changes.update[k]})
        else:
            conn.execute(_INSERT, {**row, "number": changes.insert[k]})
    conn.execute("UPDATE tunnel.spot SET detected = false WHERE id = ANY (%s)", [changes.keep])
    conn.execute("DELETE FROM tunnel.spot WHERE id = ANY (%s)", [changes.delete])
    return SavedSpots(len(changes.insert), len(changes.update), len(changes.keep), len(changes.delete))


def load_earlier_spots(conn: psycopg.Connection[Any], survey: Survey) -> tuple[list[EarlierSpot], list[EarlierSpot]]:
    """Read the spots of the survey, and of each number in its other surveys the latest one, in the order of their numbers.

    Until the transaction ends, no other one can give out numbers in the tunnel or site.
    """
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
    own: list[EarlierSpot] = []
    others: list[EarlierSpot] = []
    for mine, key, number, kind, reviewed, wkb in rows:
        vertices = shapely.get_coordinates(shapely.from_wkb(bytes(wkb)), include_z=True)
        (own if mine else others).append(EarlierSpot(key, number, kind, reviewed, vertices))
    return own, others


def _insert_member(conn: psycopg.Connection[Any], survey: Survey, member: Member, chainage: float | None) -> int:
    row = conn.execute(
        """
        INSERT INTO tunnel.member (survey_id, number, kind, length, area, bimodal, chainage, line)
        VALUES (%s, %s, %s, %s, %s, %s, %s, public.ST_GeomFromWKB(%s, %s::int)) RETURNING id
        """,
        [
            survey.id, member.number, member.kind, member.length, member.area, member.bimodal,
            chainage, shapely.to_wkb(shapely.LineString(member.line)), survey.srid,
        ],
    ).fetchone()  # fmt: skip
    assert row is not None
    return int(row[0])


def _insert_face(conn: psycopg.Connection[Any], survey: Survey, face: Face, member: int, place: PlacedFace) -> int:
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
            place.chainage,
            shapely.to_wkb(face.outline), shapely.to_wkb(place.surface), survey.srid,
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


def _spot_row(spot: Spot, place: PlacedSpot, survey: Survey) -> dict[str, Any]:
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
        "chainage": place.chainage,
        "outline": shapely.to_wkb(spot.outline),
        "map": shapely.to_wkb(place.map),
        "surface": shapely.to_wkb(place.surface),
        "srid": survey.srid,
    }


def _number(value: float) -> float | None:
    """Return a number, NULL for None or NaN."""
    return float(value) if np.isfinite(value) else None
