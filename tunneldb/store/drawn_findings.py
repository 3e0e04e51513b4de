"""Drawn findings: their outlines for measuring by detection, and updates after a new surface."""

from __future__ import annotations

import datetime as dt
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import psycopg
import shapely
from shapely.geometry import Polygon

from tunneldb.errors import UserError
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.store.survey import Survey

if TYPE_CHECKING:
    from tunneldb.anomalies.measure import Measurement


@dataclass(frozen=True)
class Drawn:
    """Finding with a drawn outline.

    Attributes
    ----------
    id : int
        Key.
    drawn_at : datetime
        Time of the last drawing: measurements of an outline are valid only for that.
    outline : Polygon
        (chainage, arc), m.
    """

    id: int
    drawn_at: dt.datetime
    outline: Polygon


def load_drawn(conn: psycopg.Connection[Any], survey: Survey, km: int) -> list[Drawn]:
    """Read the findings with drawn outlines in a kilometre, by their middles."""
    rows = conn.execute(
        "SELECT id, drawn_at, public.ST_AsBinary(unrolled) FROM tunnel.finding"
        " WHERE survey_id = %s AND km = %s AND origin <> 'detected' AND merged_into IS NULL ORDER BY id",
        (survey.id, km),
    ).fetchall()
    return [Drawn(key, at, shapely.from_wkb(bytes(wkb))) for key, at, wkb in rows]


def save_measured(conn: psycopg.Connection[Any], drawn: Sequence[Drawn], measured: Sequence[Measurement]) -> None:
    """Write the measurements of outlines, except those redrawn in the meantime."""
    with conn.cursor() as cursor:
        cursor.executemany(
            "UPDATE tunnel.finding SET darkening_mean = %s, darkening_max = %s, contrast = %s, image_share = %s"
            " WHERE id = %s AND drawn_at = %s",
            [
                (found.darkening_mean, found.darkening_max, found.contrast, found.image_share, finding.id, finding.drawn_at)
                for finding, found in zip(drawn, measured, strict=True)
            ],
        )


def settle_findings(conn: psycopg.Connection[Any], survey: Survey, km: int) -> None:
    """Reconcile drawn findings in a kilometre with those of detection.

    Outlines in the unrolled plane stay; their places on the map and in space follow the current surface. Duplicates count once,
    and findings in dry regions are marked.
    """
    place = (km * KILOMETRE, (km + 1) * KILOMETRE)
    conn.execute("SELECT tunnel_internal.renew_findings(%s, %s)", (survey.id, km))
    conn.execute("SELECT tunnel_internal.settle_findings(%s, public.ST_MakeEnvelope(%s, -1e4, %s, 1e4))", (survey.id, *place))
    conn.execute("SELECT tunnel_internal.pack_sums(%s)", (survey.id,))


def undo_finding(conn: psycopg.Connection[Any], number: int) -> str:
    """Undo the last change of a finding, and return what was undone.

    Raises
    ------
    UserError
        If there is nothing to undo, or this user may not undo it.
    """
    try:
        row = conn.execute("SELECT tunnel_api.finding_undo(%s)", [number]).fetchone()
    except (psycopg.errors.FeatureNotSupported, psycopg.errors.InvalidParameterValue) as error:
        raise UserError(error.diag.message_primary or str(error)) from error
    assert row is not None
    return str(row[0])
