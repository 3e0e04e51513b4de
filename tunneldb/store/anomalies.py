"""Anomalies of a kilometre, and those over its ends, into the database: matched with those of earlier runs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import psycopg
import shapely
from psycopg.types.json import Jsonb
from shapely.geometry import Polygon

from tunneldb.anomalies.detect import Anomaly
from tunneldb.anomalies.evidence import EvidenceModel
from tunneldb.anomalies.geometries import anomaly_geometries
from tunneldb.anomalies.matching import match, match_parts
from tunneldb.anomalies.regions import Region
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.geometry.surface import Surface
from tunneldb.store.anomaly_parts import Border, Cluster, link, replace_parts
from tunneldb.store.findings import settle_findings
from tunneldb.store.learned import feature_list
from tunneldb.store.surface import load_surface
from tunneldb.store.survey import Survey


@dataclass(frozen=True)
class Matched:
    """What became of the anomalies of an earlier run and of those found now.

    Attributes
    ----------
    kinds : Counter of str
        How many of each kind were found, by what detection takes them for.
    new, again : int
        Leaks found for the first time, and those found again, as whatever: of what was found, leaks alone.
    kept, gone : int
        Anomalies not found again, kept for their review or taken away, that were or are leaks.
    over_ends : int
        Leaks of which a part lies in another kilometre.
    other_pixels : list of int
        Neighbours whose anomalies can't be put together with this kilometre's, for their pixels are of another size.
    """

    kinds: Counter[str]
    new: int
    again: int
    kept: int
    gone: int
    over_ends: int
    other_pixels: list[int]


@dataclass(frozen=True)
class _Earlier:
    """An anomaly of an earlier run, and whether it may be a part of one over an end of the kilometre or the other way round.

    Whatever an inspector says of it counts as a review; a leak is what he takes for one, else what detection took for one. One
    that a dry region takes away is not found again for that, and stays.
    """

    id: int
    km: int
    reviewed: bool
    leak: bool
    dry: bool
    outline: Polygon
    at_end: bool


def save_anomalies(
    conn: psycopg.Connection[Any],
    survey: Survey,
    km: int,
    surface: Surface,
    found: Sequence[Anomaly],
    cut: Sequence[Region],
    min_area: float,
    model: EvidenceModel | None = None,
) -> Matched:
    """Replace the anomalies of a kilometre and those over its ends; one that is found again keeps its id and its review.

    An anomaly is found again, be it of another kind now, when it and an earlier one overlap best with each other, by at least
    0.3 of their union; over an end of the kilometre, when it and an earlier one share 0.3 of the smaller, so that a leak of
    which only a part was known remains the same one. Of those not found again the reviewed ones stay, marked as not detected,
    and those that a dry region takes away. What people drew, redrew, split or merged is left alone; what is found of it counts
    with that once (tunnel_api.link_findings).

    Parameters
    ----------
    conn, survey, km
        Where.
    surface : Surface
        The tunnel about the kilometre.
    found : sequence of Anomaly
        Anomalies within the kilometre.
    cut : sequence of Region
        Dark regions that reach its ends.
    min_area : float
        Smaller leaks over its ends are left out, m².
    model : EvidenceModel, optional
        What judges those over its ends; by default the one that comes with the program.
    """
    # What takes time comes before the lock.
    order = feature_list(conn)
    rows = [_row(anomaly, surface, survey.srid, order) for anomaly in found]
    border = replace_parts(conn, survey, km, cut)
    over: list[tuple[Cluster, Anomaly]] = []
    for cluster in border.clusters:
        anomaly = Anomaly.of(cluster.region, min_area, model=model)
        if anomaly is None:
            link(conn, cluster, None)
        else:
            over.append((cluster, anomaly))
    earlier = _earlier(conn, survey, km, border)
    wholes = [anomaly.outline for _, anomaly in over]
    at_end = [k for k, anomaly in enumerate(earlier) if anomaly.at_end]
    pairs = match_parts([earlier[k].outline for k in at_end], [earlier[k].reviewed for k in at_end], wholes)
    taken = {number: earlier[at_end[k]] for number, k in pairs.items()}
    for number, (cluster, anomaly) in enumerate(over):
        values = _row(anomaly, _surface_of(conn, survey, km, surface, anomaly), survey.srid, order)
        link(conn, cluster, _write(conn, survey, values, taken.get(number)))
    left = [anomaly for anomaly in earlier if anomaly not in taken.values()]
    again = match([anomaly.outline for anomaly in left], [anomaly.outline for anomaly in found])
    for number, values in enumerate(rows):
        _write(conn, survey, values, left[again[number]] if number in again else None)
    # One of a neighbour that was given up before stays as it is.
    lost = [one for k, one in enumerate(left) if k not in again.values() and (one.km == km or one.id in border.anomalies)]
    lost = [one for one in lost if not one.dry]
    kept, gone = [one for one in lost if one.reviewed], [one for one in lost if not one.reviewed]
    conn.execute("UPDATE tunnel.anomaly SET detected = false WHERE id = ANY (%s)", ([one.id for one in kept],))
    conn.execute("DELETE FROM tunnel.anomaly WHERE id = ANY (%s)", ([one.id for one in gone],))
    settle_findings(conn, survey, km)
    known = [(anomaly, number in again) for number, anomaly in enumerate(found)]
    known += [(anomaly, number in taken) for number, (_, anomaly) in enumerate(over)]
    leaks = [before for anomaly, before in known if anomaly.verdict.kind == "leak"]
    return Matched(
        Counter(anomaly.verdict.kind for anomaly, _ in known),
        leaks.count(False),
        leaks.count(True),
        sum(one.leak for one in kept),
        sum(one.leak for one in gone),
        sum(len({p.km for p in cluster.parts}) > 1 for cluster, anomaly in over if anomaly.verdict.kind == "leak"),
        border.other_pixels,
    )


def _earlier(conn: psycopg.Connection[Any], survey: Survey, km: int, border: Border) -> list[_Earlier]:
    """Anomalies that may be found again: the kilometre's and those over its ends, among them what was given up before.

    Those that were written of parts elsewhere stay out.
    """
    rows = conn.execute(
        """
        SELECT l.id, l.km, l.review <> 'open' OR l.judged IS NOT NULL OR l.merged_into IS NOT NULL OR l.severity IS NOT NULL
                   OR l.remark IS NOT NULL OR EXISTS (SELECT FROM tunnel.photo p WHERE p.anomaly_id = l.id),
               l.wet, l.dry_region_id IS NOT NULL AND l.review = 'open', public.ST_AsBinary(l.unrolled), l.id = ANY (%(over)s)
          FROM tunnel.anomaly l
         WHERE l.survey_id = %(survey)s AND l.origin = 'detected'
           AND (l.id = ANY (%(over)s)
                OR (l.km BETWEEN %(first)s AND %(last)s AND (l.km = %(km)s OR NOT l.detected)
                    AND NOT EXISTS (SELECT FROM tunnel.anomaly_part p WHERE p.survey_id = l.survey_id AND p.anomaly_id = l.id)))
         ORDER BY l.id
           FOR UPDATE OF l
        """,
        {"survey": survey.id, "km": km, "first": border.first, "last": border.last, "over": sorted(border.anomalies)},
    ).fetchall()
    found = []
    for key, of, reviewed, leak, dry, wkb, over in rows:
        outline = shapely.from_wkb(bytes(wkb))
        found.append(_Earlier(key, of, reviewed, leak, dry, outline, over or _near_end(outline, km, border)))
    return found


def _near_end(outline: Polygon, km: int, border: Border) -> bool:
    """Tell whether an outline comes as near to an end of the kilometre as straightening can take it off."""
    pixel = max((cluster.region.pixel for cluster in border.clusters), default=0.0)
    west, _, east, _ = outline.bounds
    return any(west - pixel <= plane * KILOMETRE <= east + pixel for plane in (km, km + 1))


def _surface_of(conn: psycopg.Connection[Any], survey: Survey, km: int, surface: Surface, anomaly: Anomaly) -> Surface:
    """Surface under an anomaly: the kilometre's, or one that reaches on."""
    west, _, east, _ = anomaly.outline.bounds
    if km * KILOMETRE <= west and east <= (km + 1) * KILOMETRE:
        return surface
    return load_surface(conn, survey, west, east)


_INSERT = """
    INSERT INTO tunnel.anomaly (survey_id, km, kind, reasons, confidence, contrast, chainage_from, chainage_to, arc_from,
                                arc_to, clock, area, drop_mean, drop_max, image_share, feature_list_id, features, evidence,
                                model, unrolled, map, surface)
    VALUES (%(survey)s, %(km)s, %(kind)s, %(reasons)s, %(confidence)s, %(contrast)s, %(chainage_from)s, %(chainage_to)s,
            %(arc_from)s, %(arc_to)s, %(clock)s, %(area)s, %(drop_mean)s, %(drop_max)s, %(image_share)s,
            %(feature_list)s, %(features)s, %(evidence)s, %(model)s,
            public.ST_GeomFromWKB(%(unrolled)s, 0), public.ST_GeomFromWKB(%(map)s, %(srid)s::int),
            public.ST_GeomFromWKB(%(surface)s, %(srid)s::int))
    RETURNING id
"""
# What an inspector has confirmed it to be it remains when detection now takes it for something else.
_UPDATE = """
    UPDATE tunnel.anomaly
       SET km = %(km)s, kind = %(kind)s, reasons = %(reasons)s, confidence = %(confidence)s, contrast = %(contrast)s,
           chainage_from = %(chainage_from)s, chainage_to = %(chainage_to)s, arc_from = %(arc_from)s,
           arc_to = %(arc_to)s, clock = %(clock)s, area = %(area)s, drop_mean = %(drop_mean)s, drop_max = %(drop_max)s,
           image_share = %(image_share)s, feature_list_id = %(feature_list)s, features = %(features)s,
           evidence = %(evidence)s, model = %(model)s,
           judged = CASE WHEN review = 'confirmed' AND judged IS NULL AND kind <> %(kind)s THEN kind ELSE judged END,
           unrolled = public.ST_GeomFromWKB(%(unrolled)s, 0),
           map = public.ST_GeomFromWKB(%(map)s, %(srid)s::int),
           surface = public.ST_GeomFromWKB(%(surface)s, %(srid)s::int), detected = true, detected_at = now()
     WHERE id = %(id)s
"""


def _write(conn: psycopg.Connection[Any], survey: Survey, values: dict[str, Any], before: _Earlier | None) -> int:
    """Write an anomaly in the place of an earlier one, or as a new one; return its key."""
    if before is not None:
        conn.execute(_UPDATE, {**values, "id": before.id})
        return before.id
    row = conn.execute(_INSERT, {**values, "survey": survey.id}).fetchone()
    assert row is not None
    return int(row[0])


def _row(anomaly: Anomaly, surface: Surface, srid: int, order: int) -> dict[str, Any]:
    west, south, east, north = anomaly.outline.bounds
    geometries = anomaly_geometries(anomaly.outline, surface)
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
        "drop_mean": anomaly.drop_mean,
        "drop_max": anomaly.drop_max,
        "image_share": anomaly.image_share,
        "feature_list": order,
        "features": [*anomaly.verdict.features.tolist(), anomaly.verdict.outline],
        "evidence": Jsonb({reason: round(value, 4) for reason, value in anomaly.verdict.evidence.items()}),
        "model": anomaly.verdict.model,
        "unrolled": shapely.to_wkb(anomaly.outline),
        "map": shapely.to_wkb(geometries.map),
        "surface": shapely.to_wkb(geometries.surface),
        "srid": srid,
    }
