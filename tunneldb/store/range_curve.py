"""Range curves of kilometres, to and from the database."""

from __future__ import annotations

from typing import Any

import psycopg

from tunneldb.radiometry.range_curve import RangeCurve
from tunneldb.store.survey import Survey


def save_range_curve(conn: psycopg.Connection[Any], survey: Survey, km: int, found: RangeCurve | None) -> None:
    """Replace the range curve that was found on the lining of a kilometre; None takes it away.

    Its deviation is NULL beyond the ranges present, where it goes on by its slope.
    """
    conn.execute("DELETE FROM tunnel.range_curve WHERE survey_id = %s AND km = %s", (survey.id, km))
    if found is not None:
        sigma = [s if there else None for s, there in zip(found.sigma_db.tolist(), found.present.tolist(), strict=True)]
        conn.execute(
            "INSERT INTO tunnel.range_curve (survey_id, km, range_m, intensity_db, sigma_db) VALUES (%s, %s, %s, %s, %s)",
            (survey.id, km, found.curve.range_m.tolist(), found.curve.intensity_db.tolist(), sigma),
        )
