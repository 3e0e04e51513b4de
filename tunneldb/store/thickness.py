"""Thickness between two surveys, to and from the database."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import psycopg

from tunneldb.arrays import Float
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.shape.thickness import SectionThickness
from tunneldb.store.survey import Survey


@dataclass(frozen=True)
class Pair:
    """Sections of two surveys that lie at the same place.

    Attributes
    ----------
    low, high : float
        Chainage that both hold, m.
    before, after : (n,), (m,) float arrays
        Mean deviation in cells along the profile, m; NaN unseen.
    noise_area : float
        Standard deviation of the area between them by the scatter of pixels, m².
    """

    low: float
    high: float
    before: Float
    after: Float
    noise_area: float


@dataclass(frozen=True)
class Step:
    """A step of chainage with what lies between two surveys."""

    low: float
    high: float
    noise_area: float
    figures: SectionThickness


def stale_kilometres(
    conn: psycopg.Connection[Any], before: Survey, after: Survey, layer: str, low: float, high: float
) -> dict[int, str | None]:
    """Kilometres of a stretch in which both surveys have sections of a layer, and why what is stored is out of date."""
    rows = conn.execute(
        "SELECT km, reason FROM tunnel_api.thickness_state(%s, %s) WHERE layer = %s"
        " AND (km + 1) * %s::float8 > %s AND km * %s::float8 < %s ORDER BY km",
        [before.id, after.id, layer, KILOMETRE, low, KILOMETRE, high],
    ).fetchall()
    return dict(rows)


def thickness_inputs(conn: psycopg.Connection[Any], before: Survey, after: Survey, km: int, layer: str) -> dict[str, Any]:
    """What the thickness in a kilometre is made from, as the ledger keeps it."""
    row = conn.execute("SELECT tunnel_api.thickness_inputs(%s, %s, %s, %s)", [before.id, after.id, km, layer]).fetchone()
    assert row is not None
    return {"before": before.id, "layer": layer, **row[0]}


def load_pairs(conn: psycopg.Connection[Any], before: Survey, after: Survey, km: int, layer: str) -> list[Pair]:
    """Sections of a kilometre that both surveys have, in order of chainage."""
    rows = conn.execute(
        "SELECT greatest(b.chainage_from, a.chainage_from), least(b.chainage_to, a.chainage_to), b.deviation, a.deviation,"
        " sqrt(b.noise_area ^ 2 + a.noise_area ^ 2)"
        "  FROM tunnel.deviation_section b JOIN tunnel.deviation_section a"
        "    ON a.survey_id = %s AND a.layer = b.layer AND a.km = b.km"
        "   AND a.chainage_from < b.chainage_to AND a.chainage_to > b.chainage_from"
        " WHERE b.survey_id = %s AND b.km = %s AND b.layer = %s"
        "   AND least(b.chainage_to, a.chainage_to) - greatest(b.chainage_from, a.chainage_from) > 1e-6 ORDER BY 1",
        [after.id, before.id, km, layer],
        binary=True,
    ).fetchall()
    return [Pair(low, high, np.array(b, float), np.array(a, float), noise) for low, high, b, a, noise in rows]


def save_thickness(
    conn: psycopg.Connection[Any], before: Survey, after: Survey, km: int, layer: str, steps: Sequence[Step]
) -> None:
    """Replace what lies between two surveys in a kilometre."""
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
            told = [float(value) if np.isfinite(value) else None for value in (one.mean, *one.least)]
            copy.write_row(
                (
                    after.id, before.id, km, layer, step.low, step.high, one.design_length, one.compared_length, one.area,
                    step.noise_area, *one.area_by.tolist(), *told, one.thickness.tolist(),
                )
            )  # fmt: skip
