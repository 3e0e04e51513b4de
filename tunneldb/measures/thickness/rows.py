"""Thickness between the linings of two surveys, to and from the database."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import psycopg

from tunneldb.measures.thickness.compute import DeviationCells, ThicknessStep
from tunneldb.store.survey import Survey


def load_cells(conn: psycopg.Connection[Any], survey: Survey, km: int, layer: str) -> list[DeviationCells]:
    """Load the steps of a kilometre that were compared with a layer, in order of chainage."""
    rows = conn.execute(
        "SELECT profile, chainage_from, chainage_to, noise_area, deviation FROM tunnel.deviation_section"
        " WHERE survey_id = %s AND km = %s AND layer = %s ORDER BY chainage_from",
        [survey.id, km, layer],
        binary=True,
    ).fetchall()
    return [DeviationCells(name, low, high, noise, np.array(cells, np.float64)) for name, low, high, noise, cells in rows]


def save_thickness(
    conn: psycopg.Connection[Any], before: Survey, after: Survey, km: int, layer: str, steps: Sequence[ThicknessStep]
) -> None:
    """Replace the thickness of a layer in a kilometre."""
    conn.execute(
        "DELETE FROM tunnel.thickness_section WHERE survey_id = %s AND before_id = %s AND km = %s AND layer = %s",
        [after.id, before.id, km, layer],
    )
    query = (
        "COPY tunnel.thickness_section (survey_id, before_id, km, layer, chainage_from, chainage_to, design_length,"
        " compared_length, area, noise_area, by_right, by_up, thickness_mean, thickness_least, least_at, thickness) FROM STDIN"
    )
    with conn.cursor() as cursor, cursor.copy(query) as copy:
        for step in steps:
            one = step.figures
            copy.write_row(
                (
                    after.id, before.id, km, layer, step.low, step.high, one.design_length, one.compared_length, one.area,
                    step.noise_area, *one.area_by.tolist(),
                    *(value if np.isfinite(value) else None for value in (one.mean, *one.least)), one.thickness.tolist(),
                )
            )  # fmt: skip
