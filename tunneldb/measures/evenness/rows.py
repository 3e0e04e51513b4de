"""Evenness of linings, to and from the database."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import psycopg
import shapely
from psycopg import sql

from tunneldb.arrays import Float
from tunneldb.measures.evenness.compute.sections import EvennessStep, UnevenPolygon
from tunneldb.store.survey import Survey


def save_evenness(
    conn: psycopg.Connection[Any],
    survey: Survey,
    km: int,
    layer: str,
    straightedge: tuple[float, float],
    steps: Sequence[EvennessStep],
    areas: Iterable[UnevenPolygon],
) -> None:
    """Replace the evenness of a kilometre; of the straightedge length and limit are given, m."""
    for table in ("evenness_section", "evenness_area"):
        conn.execute(
            sql.SQL("DELETE FROM {} WHERE survey_id = %s AND km = %s AND layer = %s").format(sql.Identifier("tunnel", table)),
            [survey.id, km, layer],
        )
    query = (
        "COPY tunnel.evenness_section (survey_id, km, layer, straightedge, gap_limit, chainage_from, chainage_to, arc_from,"
        " cell, lining_area, measured_area, over_area, gap_along, gap_along_at, gap_around, gap_around_at, waviness, sigma,"
        " along, around) FROM STDIN"
    )
    with conn.cursor() as cursor, cursor.copy(query) as copy:
        for step in steps:
            one, side = step.figures, step.cell**2
            copy.write_row(
                (
                    survey.id, km, layer, *straightedge, step.low, step.high, step.arc_from, step.cell, one.seen * side,
                    one.measured * side, one.over * side, *_greatest(one.along, step), *_greatest(one.around, step),
                    *(value if np.isfinite(value) else None for value in (one.waviness, one.sigma)),
                    one.along.tolist(), one.around.tolist(),
                )
            )  # fmt: skip
    with (
        conn.cursor() as cursor,
        cursor.copy("COPY tunnel.evenness_area (survey_id, km, layer, area, gap, direction, geom) FROM STDIN") as copy,
    ):
        for area in areas:
            copy.write_row((survey.id, km, layer, area.area, area.gap, area.direction, shapely.to_wkb(area.outline, hex=True)))


def _greatest(gaps: Float, step: EvennessStep) -> tuple[float | None, float | None]:
    """Return the greatest gap of a step, and the arc of its cell's middle, m."""
    if not np.isfinite(gaps).any():
        return None, None
    k = int(np.nanargmax(gaps))
    return float(gaps[k]), step.arc_from + (k + 0.5) * step.cell
