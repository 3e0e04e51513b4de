"""Series over surveys, drawn: wet area by date, and the ovality of rings before and after."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import psycopg

from tunneldb.arrays import Float
from tunneldb.measures.change.tables import Row
from tunneldb.report.rings import WIDTH, Curve, curve
from tunneldb.store.survey import Survey


def wet_curve(series: Sequence[Row]) -> Curve | None:
    """Return the wet area, m², over the dates of surveys; None with fewer than two of them."""
    days = np.array([row["date"].toordinal() for row in series], dtype=np.float64)
    areas = np.array([np.nan if row["area"] is None else row["area"] for row in series], dtype=np.float64)
    if len(np.unique(days[np.isfinite(areas)])) < 2:
        return None
    first, last = float(days[0]), float(days[-1])
    drawn = curve("wet", [("wet", days, areas)], "m²", first, last)
    dates = {row["date"] for row in series}
    return replace(
        drawn,
        places=[((date.toordinal() - first) * WIDTH / (last - first), date.isoformat()) for date in sorted(dates)],
    )


def ovality_curve(conn: psycopg.Connection[Any], old: Survey, new: Survey, low: float, high: float) -> Curve | None:
    """Return the ovality of rings along a stretch in both surveys, ‰; None if one of them has none there."""
    lines = [(name, *_ovality(conn, survey, low, high)) for name, survey in (("before", old), ("after", new))]
    if any(np.isfinite(values).sum() < 2 for _, _, values in lines):
        return None
    middles = np.concatenate([middle for _, middle, _ in lines])
    return curve("ovality", lines, "‰", float(middles.min()), float(middles.max()))


def _ovality(conn: psycopg.Connection[Any], survey: Survey, low: float, high: float) -> tuple[Float, Float]:
    """Return the middles of the rings of a stretch, m, and their ovality, ‰, NaN if unknown."""
    rows = conn.execute(
        "SELECT (chainage_from + chainage_to) / 2, 1000 * ovality FROM tunnel.ring"
        " WHERE survey_id = %s AND (chainage_from + chainage_to) / 2 BETWEEN %s AND %s ORDER BY chainage_from",
        [survey.id, low, high],
    ).fetchall()
    middle, ovality = np.array(rows, dtype=np.float64).reshape(-1, 2).T
    return middle, ovality
