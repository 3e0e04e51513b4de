"""Detected findings of a kilometre to the database and back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import psycopg
import shapely
from psycopg.types.json import Jsonb

from tunneldb.anomalies.geometries import Geometries
from tunneldb.anomalies.records import Anomaly, EarlierFinding
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.store.survey import Survey


@dataclass(frozen=True)
class PlacedAnomaly:
    """An anomaly with its geometries on the map and in space."""

    anomaly: Anomaly
    geometries: Geometries


def load_earlier_findings(
    conn: psycopg.Connection[Any], survey: Survey, km: int, reach: tuple[int, int], across: set[int]
) -> list[EarlierFinding]:
    """Read and lock the findings that detection in a kilometre may find again.

    These are the kilometre's, those across its ends, and those of the kilometres that these reach which an earlier run lost.
    Findings that are merged from boundary regions elsewhere, and outlines that people drew, are not among them.

    Parameters
    ----------
    conn, survey, km
        Place.
    reach : (int, int)
        First and last kilometre that the regions across its ends reach.
    across : set of int
        Keys of the findings across its ends.
    """
    rows = conn.execute(
        """
        SELECT l.id, l.km, l.review <> 'open' OR l.kind_override IS NOT NULL OR l.merged_into IS NOT NULL OR l.severity IS
        NOT NULL
                   OR l.remark IS NOT NULL OR EXISTS (SELECT FROM tunnel.photo p WHERE p.finding_id = l.id),
               l.wet, l.dry_region_id IS NOT NULL AND l.review = 'open', public.ST_AsBinary(l.unrolled)
          FROM tunnel.finding l
         WHERE l.survey_id = %(survey)s AND l.origin = 'detected'
           AND (l.id = ANY (%(across)s)
                OR (l.km BETWEEN %(first)s AND %(last)s AND (l.km = %(km)s OR NOT l.detected)
                    AND NOT EXISTS (SELECT FROM tunnel.boundary_region p WHERE p.survey_id = l.survey_id AND p.finding_id =
                    l.id)))
         ORDER BY l.id
           FOR UPDATE OF l
        """,
        {"survey": survey.id, "km": km, "first": reach[0], "last": reach[1], "across": sorted(across)},
    ).fetchall()
    return [
        EarlierFinding(key, at, reviewed, wet, dry, shapely.from_wkb(bytes(wkb))) for key, at, reviewed, wet, dry, wkb in rows
    ]


_INSERT = """
    INSERT INTO tunnel.finding (survey_id, km, kind, reasons, confidence, contrast, chainage_from, chainage_to, arc_from,
                                arc_to, clock, area, darkening_mean, darkening_max, image_share, feature_list_id, features,
                                evidence,
                                model, unrolled, map, surface)
    VALUES (%(survey)s, %(km)s, %(kind)s, %(reasons)s, %(confidence)s, %(contrast)s, %(chainage_from)s, %(chainage_to)s,
            %(arc_from)s, %(arc_to)s, %(clock)s, %(area)s, %(darkening_mean)s, %(darkening_max)s, %(image_share)s,
            %(feature_list)s, %(features)s, %(evidence)s, %(model)s,
            public.ST_GeomFromWKB(%(unrolled)s, 0), public.ST_GeomFromWKB(%(map)s, %(srid)s::int),
            public.ST_GeomFromWKB(%(surface)s, %(srid)s::int))
    RETURNING id
"""
# What an inspector has confirmed it to be it remains when detection now takes it for something else.
_UPDATE = """
    UPDATE tunnel.finding
       SET km = %(km)s, kind = %(kind)s, reasons = %(reasons)s, confidence = %(confidence)s, contrast = %(contrast)s,
           chainage_from = %(chainage_from)s, chainage_to = %(chainage_to)s, arc_from = %(arc_from)s,
           arc_to = %(arc_to)s, clock = %(clock)s, area = %(area)s, darkening_mean = %(darkening_mean)s,
           darkening_max = %(darkening_max)s,
           image_share = %(image_share)s, feature_list_id = %(feature_list)s, features = %(features)s,
           evidence = %(evidence)s, model = %(model)s,
           kind_override = CASE WHEN review = 'confirmed' AND kind_override IS NULL AND kind <> %(kind)s THEN kind ELSE
           kind_override END,
           unrolled = public.ST_GeomFromWKB(%(unrolled)s, 0),
           map = public.ST_GeomFromWKB(%(map)s, %(srid)s::int),
           surface = public.ST_GeomFromWKB(%(surface)s, %(srid)s::int), detected = true, detected_at = now()
     WHERE id = %(id)s
"""


def save_finding(
    conn: psycopg.Connection[Any], survey: Survey, found: PlacedAnomaly, features: int, replaces: int | None = None
) -> int:
    """Write a finding, in the place of an earlier one or as a new one; return its key.

    Parameters
    ----------
    conn, survey
        Place.
    found : PlacedAnomaly
    features : int
        Key of the order of its features (:func:`tunneldb.store.learned.feature_list`).
    replaces : int, optional
        Key of the earlier finding, which keeps its number and its review.
    """
    values = _row(found, survey.srid, features)
    if replaces is not None:
        conn.execute(_UPDATE, {**values, "id": replaces})
        return replaces
    row = conn.execute(_INSERT, {**values, "survey": survey.id}).fetchone()
    assert row is not None
    return int(row[0])


def lose_findings(conn: psycopg.Connection[Any], keep: Sequence[int], delete: Sequence[int]) -> None:
    """Mark findings as not detected any more, and delete others."""
    conn.execute("UPDATE tunnel.finding SET detected = false WHERE id = ANY (%s)", (list(keep),))
    conn.execute("DELETE FROM tunnel.finding WHERE id = ANY (%s)", (list(delete),))


def _row(found: PlacedAnomaly, srid: int, features: int) -> dict[str, Any]:
    anomaly, geometries = found.anomaly, found.geometries
    west, south, east, north = anomaly.outline.bounds
    return {
        "km": int((west + east) / 2 // KILOMETRE),
        "kind": anomaly.verdict.kind,
        "reasons": list(anomaly.verdict.reasons),
        "confidence": anomaly.verdict.confidence,
        "contrast": anomaly.contrast,
        "chainage_from": west,
        "chainage_to": east,
        "arc_from": south,
        "arc_to": north,
        "clock": geometries.clock,
        "area": geometries.area,
        "darkening_mean": anomaly.darkening_mean,
        "darkening_max": anomaly.darkening_max,
        "image_share": anomaly.image_share,
        "feature_list": features,
        "features": [*anomaly.verdict.features.tolist(), anomaly.verdict.outline],
        "evidence": Jsonb({reason: round(value, 4) for reason, value in anomaly.verdict.evidence.items()}),
        "model": anomaly.verdict.model,
        "unrolled": shapely.to_wkb(anomaly.outline),
        "map": shapely.to_wkb(geometries.map),
        "surface": shapely.to_wkb(geometries.surface),
        "srid": srid,
    }
