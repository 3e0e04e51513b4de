"""How even the linings of surveys are, to and from the database."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import psycopg
import shapely
from psycopg import sql
from shapely.geometry import Polygon

from tunneldb.arrays import Float
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.measures.evenness.compute.evenness import StepEvenness
from tunneldb.store.survey import Survey


@dataclass(frozen=True)
class EvennessStep:
    """A step of chainage, whose rows of cells begin at an arc, m, and go up."""

    low: float
    high: float
    arc_from: float
    cell: float
    figures: StepEvenness


@dataclass(frozen=True)
class UnevenPolygon:
    """Where the gap is too large, in the unrolled plane, with its area, m², greatest gap, m, and how the straightedge lay."""

    outline: Polygon
    area: float
    gap: float
    direction: str


def evenness_kilometres(
    conn: psycopg.Connection[Any], survey: Survey, layer: str, length: float, limit: float, low: float, high: float
) -> dict[int, str | None]:
    """Kilometres of a stretch that were held against a layer, and why what is stored of their evenness is out of date."""
    rows = conn.execute(
        "SELECT km, reason, straightedge, gap_limit FROM tunnel_internal.evenness_state(%s)"
        " WHERE layer = %s AND (km + 1) * %s::float8 > %s AND km * %s::float8 < %s ORDER BY km",
        [survey.id, layer, KILOMETRE, low, KILOMETRE, high],
    ).fetchall()
    other = "another straightedge or limit is asked for"
    return {km: why if why is not None or asked == [length, limit] else other for km, why, *asked in rows}


def evenness_inputs(conn: psycopg.Connection[Any], survey: Survey, km: int, layer: str) -> dict[str, Any]:
    """What the evenness of a kilometre is made from, as the ledger keeps it."""
    row = conn.execute("SELECT tunnel_internal.evenness_inputs(%s, %s, %s)", [survey.id, km, layer]).fetchone()
    assert row is not None
    inputs: dict[str, Any] = row[0]
    return inputs


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
    """Greatest gap of a step, and the arc of its cell's middle, m."""
    if not np.isfinite(gaps).any():
        return None, None
    k = int(np.nanargmax(gaps))
    return float(gaps[k]), step.arc_from + (k + 0.5) * step.cell
