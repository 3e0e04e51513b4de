"""Leaks that detection would find in a kilometre: stored by blocks of its lining."""

from __future__ import annotations

from typing import Any

import numpy as np
import psycopg

from tunneldb.anomalies.detectability.blocks import Detectability
from tunneldb.arrays import Float
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.store.survey import Survey


def save_detectability(
    conn: psycopg.Connection[Any], survey: Survey, km: int, found: Detectability, area: float, drop: float
) -> None:
    """Replace the detectability of a kilometre; unknown values are stored as NULL.

    Parameters
    ----------
    conn, survey, km
        Place.
    found : Detectability
    area, drop : float
        Demand: area, m², and darkening, dB.
    """
    drop_detectability(conn, survey, km)
    columns = found.chainage_from, found.chainage_to, found.arc_from, found.arc_to, found.lining, found.probability
    conn.execute(
        """
        INSERT INTO tunnel.detectability (survey_id, km, trials, demand_area, demand_drop, chainage_from, chainage_to, arc_from,
                                          arc_to, lining_area, probability, smallest_1_5_db, smallest_3_db, smallest_6_db)
        SELECT %s, %s, %s, %s, %s, q.* FROM unnest(%s::float8[], %s::float8[], %s::float8[], %s::float8[], %s::float8[],
                                                   %s::float8[], %s::float8[], %s::float8[], %s::float8[]) q
        """,
        (survey.id, km, found.trials, area, drop, *(_nullable(values) for values in (*columns, *found.smallest))),
    )


def drop_detectability(conn: psycopg.Connection[Any], survey: Survey, km: int) -> None:
    """Delete the detectability of a kilometre."""
    conn.execute("DELETE FROM tunnel.detectability WHERE survey_id = %s AND km = %s", (survey.id, km))


def detectability_statement(conn: psycopg.Connection[Any], survey: Survey, km: int) -> str | None:
    """State where leaks of the demanded size may be missed in a kilometre, or it is unknown; None if hardly anywhere."""
    row = conn.execute(
        "SELECT tunnel_internal.detectability_statement(%s, %s, %s)", [survey.id, km * KILOMETRE, (km + 1) * KILOMETRE]
    ).fetchone()
    assert row is not None
    return None if row[0] is None else str(row[0])


def _nullable(values: Float) -> list[float | None]:
    return [value if there else None for value, there in zip(values.tolist(), np.isfinite(values).tolist(), strict=True)]
