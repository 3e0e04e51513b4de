"""Replace the findings that detection made in a kilometre."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from itertools import count
from typing import Any

import psycopg

from tunneldb.anomalies.detect import classify_region
from tunneldb.anomalies.evidence import EvidenceModel
from tunneldb.anomalies.geometries import anomaly_geometries
from tunneldb.anomalies.reconcile import Summary, gather_boundary, reconcile
from tunneldb.anomalies.records import Anomaly
from tunneldb.anomalies.regions import Region
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.geometry.surface import Surface
from tunneldb.store.boundary_regions import link_boundary_regions, load_boundary_regions, replace_boundary_regions
from tunneldb.store.detected_findings import PlacedAnomaly, load_earlier_findings, lose_findings, save_finding
from tunneldb.store.drawn_findings import settle_findings
from tunneldb.store.learned import feature_list
from tunneldb.store.surface import load_surface
from tunneldb.store.survey import Survey


def replace_findings(
    conn: psycopg.Connection[Any],
    survey: Survey,
    km: int,
    surface: Surface,
    found: Sequence[Anomaly],
    cut: Sequence[Region],
    min_area: float,
    model: EvidenceModel | None = None,
) -> tuple[Summary, list[int]]:
    """Replace the findings of a kilometre and those across its ends; one found again keeps its number and review.

    :func:`tunneldb.anomalies.reconcile.reconcile` matches them. Findings that people drew, redrew, split or merged stay
    unchanged; detections of them are counted once, with them (``link_findings``).

    Parameters
    ----------
    conn, survey, km
        Place.
    surface : Surface
        The tunnel about the kilometre.
    found : sequence of Anomaly
        Anomalies within the kilometre.
    cut : sequence of Region
        Dark regions that reach its ends.
    min_area : float
        Smaller leaks across its ends are left out, m².
    model : EvidenceModel, optional
        Model that classifies those across its ends; by default the one that comes with the program.

    Returns
    -------
    summary : Summary
    other_pixels : list of int
        Neighbours whose regions cannot be merged with this kilometre's, because their pixels have another size.
    """
    # What takes time comes before the lock.
    features = feature_list(conn)
    inside = [PlacedAnomaly(anomaly, anomaly_geometries(anomaly.outline, surface)) for anomaly in found]
    replaced = replace_boundary_regions(conn, survey, km, cut)
    boundary = gather_boundary(km, partial(load_boundary_regions, conn, survey), replaced)
    across = [classify_region(cluster.region, min_area, model=model) for cluster in boundary.clusters]
    earlier = load_earlier_findings(conn, survey, km, (boundary.first, boundary.last), boundary.findings)
    changes = reconcile(found, across, boundary, earlier)
    replaces = map(changes.update.get, count())
    for cluster, anomaly in zip(boundary.clusters, across, strict=True):
        key = None
        if anomaly is not None:
            under = _surface_under(conn, survey, km, surface, anomaly)
            placed = PlacedAnomaly(anomaly, anomaly_geometries(anomaly.outline, under))
            key = save_finding(conn, survey, placed, features, next(replaces))
        link_boundary_regions(conn, cluster.parts, key)
    for placed in inside:
        save_finding(conn, survey, placed, features, next(replaces))
    lose_findings(conn, changes.keep, changes.delete)
    settle_findings(conn, survey, km)
    return changes.summary, boundary.other_pixels


def _surface_under(conn: psycopg.Connection[Any], survey: Survey, km: int, surface: Surface, anomaly: Anomaly) -> Surface:
    """Return the surface under an anomaly: the kilometre's, or a longer one."""
    west, _, east, _ = anomaly.outline.bounds
    if km * KILOMETRE <= west and east <= (km + 1) * KILOMETRE:
        return surface
    return load_surface(conn, survey, west, east)
