"""What lies between the linings of two surveys, to and from the database."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import psycopg

from tunneldb.arrays import Float
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.measures.thickness.compute import SectionThickness
from tunneldb.store.survey import Survey


@dataclass(frozen=True)
class DeviationCells:
    """A step of chainage of a survey with the deviation of its cells."""

    profile: str
    low: float
    high: float
    noise_area: float
    cells: Float


@dataclass(frozen=True)
class ThicknessStep:
    """A step of chainage that two surveys have, with what lies between them."""

    low: float
    high: float
    noise_area: float
    figures: SectionThickness


def load_cells(conn: psycopg.Connection[Any], survey: Survey, km: int, layer: str) -> list[DeviationCells]:
    """Steps of a kilometre that were held against a layer, in order of chainage."""
    rows = conn.execute(
        "SELECT profile, chainage_from, chainage_to, noise_area, deviation FROM tunnel.deviation_section"
        " WHERE survey_id = %s AND km = %s AND layer = %s ORDER BY chainage_from",
        [survey.id, km, layer],
        binary=True,
    ).fetchall()
    return [DeviationCells(name, low, high, noise, np.array(cells, np.float64)) for name, low, high, noise, cells in rows]


def stale_thickness(
    conn: psycopg.Connection[Any], before: Survey, after: Survey, layer: str, low: float, high: float
) -> dict[int, str | None]:
    """Kilometres of a stretch in which both surveys were held against a layer, and why what is stored is out of date."""
    rows = conn.execute(
        "SELECT km, reason FROM tunnel_internal.thickness_state(%s, %s, %s)"
        " WHERE (km + 1) * %s::float8 > %s AND km * %s::float8 < %s ORDER BY km",
        [before.id, after.id, layer, KILOMETRE, low, KILOMETRE, high],
    ).fetchall()
    return dict(rows)


def thickness_inputs(conn: psycopg.Connection[Any], before: Survey, after: Survey, km: int, layer: str) -> dict[str, Any]:
    """What the thickness of a kilometre is made from, as the ledger keeps it."""
    row = conn.execute("SELECT tunnel_internal.thickness_inputs(%s, %s, %s, %s)", [before.id, after.id, km, layer]).fetchone()
    assert row is not None
    inputs: dict[str, Any] = row[0]
    return inputs


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
