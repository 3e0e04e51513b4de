"""Rings of a survey's lining, to and from the database."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import psycopg
from psycopg import sql

from tunneldb.arrays import Float, known
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.measures.rings.compute.joint_steps import Steps
from tunneldb.measures.rings.compute.lining_ring import LiningRing
from tunneldb.store.survey import Survey


@dataclass(frozen=True)
class RingBounds:
    """Definition of a ring.

    Attributes
    ----------
    number : int
        Number of the ring.
    low, high : float
        Chainage of its joints, m.
    joint : str
        Source of the joint at its beginning: given, seen, or missing.
    """

    number: int
    low: float
    high: float
    joint: str = "given"


@dataclass(frozen=True)
class MeasuredRing:
    """Ring with its measures, the step at its beginning, and the diameter that ovality refers to.

    ``circle_centre`` is that of its best-fit circle, in the tunnel's SRID (3,), m; None without a shape.
    """

    bounds: RingBounds
    ring: LiningRing
    steps: Steps
    diameter: float | None
    diameter_from: str
    circle_centre: Float | None = None


def save_definition(conn: psycopg.Connection[Any], survey: Survey, rings: Sequence[RingBounds], origin: str) -> int:
    """Replace the rings of a survey that differ from the stored ones; return the number of new ones.

    Unchanged rings keep their measures.
    """
    conn.execute("CREATE TEMP TABLE ring_given (number int, low float8, high float8, joint text) ON COMMIT DROP")
    with conn.cursor() as cursor, cursor.copy("COPY ring_given FROM STDIN") as copy:
        for ring in rings:
            copy.write_row((ring.number, round(ring.low, 4), round(ring.high, 4), ring.joint))
    conn.execute(
        "DELETE FROM tunnel.ring r WHERE r.survey_id = %s AND (r.origin <> %s OR NOT EXISTS ("
        "SELECT FROM ring_given g"
        " WHERE (g.number, g.low, g.high, g.joint) = (r.number, r.chainage_from, r.chainage_to, r.joint)))",
        [survey.id, origin],
    )
    made = conn.execute(
        "INSERT INTO tunnel.ring (survey_id, km, number, chainage_from, chainage_to, origin, joint)"
        " SELECT %s, floor((low + high) / 2 / %s::float8)::int, number, low, high, %s, joint FROM ring_given g"
        " ON CONFLICT (survey_id, number) DO NOTHING",
        [survey.id, KILOMETRE, origin],
    ).rowcount
    conn.execute("DROP TABLE ring_given")
    return made


def has_rings(conn: psycopg.Connection[Any], survey: Survey) -> bool:
    """Return True if rings of a survey are defined."""
    row = conn.execute("SELECT EXISTS (SELECT FROM tunnel.ring WHERE survey_id = %s)", [survey.id]).fetchone()
    return row is not None and bool(row[0])


def load_bounds(conn: psycopg.Connection[Any], survey: Survey, km: int) -> list[RingBounds]:
    """Load the rings with their middle in a kilometre, in order."""
    rows = conn.execute(
        "SELECT number, chainage_from, chainage_to, joint FROM tunnel.ring"
        " WHERE survey_id = %s AND km = %s ORDER BY chainage_from",
        [survey.id, km],
    ).fetchall()
    return [RingBounds(*row) for row in rows]


def length_before(conn: psycopg.Connection[Any], survey: Survey, joint: float) -> float:
    """Return the length of the ring that ends at a joint, m; 0 without one."""
    row = conn.execute(
        "SELECT chainage_to - chainage_from FROM tunnel.ring"
        " WHERE survey_id = %s AND chainage_from < %s AND abs(chainage_to - %s) < 0.001 ORDER BY chainage_from DESC LIMIT 1",
        [survey.id, joint, joint],
    ).fetchone()
    return row[0] if row else 0.0


def save_rings(conn: psycopg.Connection[Any], survey: Survey, rings: Sequence[MeasuredRing]) -> None:
    """Replace the measures of rings, and their chords."""
    for measured in rings:
        values = {name: _plain(value) for name, value in _columns(measured).items()}
        query = sql.SQL("UPDATE tunnel.ring SET {} WHERE survey_id = {} AND number = {} RETURNING id").format(
            sql.SQL(", ").join(sql.SQL("{} = {}").format(sql.Identifier(name), sql.Placeholder(name)) for name in values),
            sql.Placeholder("survey_id"),
            sql.Placeholder("number"),
        )
        row = conn.execute(query, {**values, "survey_id": survey.id, "number": measured.bounds.number}).fetchone()
        assert row is not None
        conn.execute("DELETE FROM tunnel.ring_chord WHERE ring_id = %s", row)
        for chord in measured.ring.chords:
            conn.execute(
                "INSERT INTO tunnel.ring_chord (ring_id, clock_from, clock_to, length, length_se) VALUES (%s, %s, %s, %s, %s)",
                [row[0], chord.clock_from, chord.clock_to, known(chord.length), known(chord.se)],
            )


def _columns(measured: MeasuredRing) -> dict[str, Any]:
    """Return all measures of a ring by column; None for those that it lacks."""
    one, steps = measured.ring, measured.steps
    greatest, lip = steps.greatest, one.lip
    values: dict[str, Any] = {
        "seen_share": one.seen_share, "remark": one.remark or None, "step": _reals(steps.step), "step_se": _reals(steps.se),
        "step_arc": _reals(steps.arc),
    }  # fmt: skip
    values |= dict(zip(_GREATEST, greatest or (None, None, None), strict=True))
    values |= {"lip": lip and lip.size, "lip_se": lip and lip.se, "lip_arc": lip and lip.arc}
    return values | _shape_columns(measured)


_GREATEST = ("step_greatest", "step_greatest_se", "step_greatest_arc")
_SHAPE = (
    "centre_right", "centre_right_se", "centre_up", "centre_up_se", "radius", "radius_se", "inward", "inward_se",
    "inward_clock", "outward", "outward_se", "outward_clock", "sigma",
)  # fmt: skip
_ELLIPSE = (
    "diameter_largest", "diameter_largest_se", "diameter_smallest", "diameter_smallest_se", "largest_clock",
    "largest_clock_se", "ovality", "ovality_se", "design_diameter", "diameter_from",
    "harmonic", "harmonic_se", "harmonic_clock",
)  # fmt: skip


_CIRCLE = ("circle_x", "circle_y", "circle_z", "circle_radius")


def _shape_columns(measured: MeasuredRing) -> dict[str, Any]:
    ring = measured.ring.ring
    values: dict[str, Any] = dict.fromkeys((*_SHAPE, *_ELLIPSE, *_CIRCLE))
    if ring is None:
        return values | {"shape": "none"}
    ellipse = ring.adjustment.ellipse
    se = np.sqrt(np.diag(ellipse.covariance))
    inward, outward = ring.inward, ring.outward
    shape = (
        ellipse.centre[0], se[0], ellipse.centre[1], se[1], ellipse.radius, se[2], inward.size, inward.size_se, inward.clock,
        outward.size, outward.size_se, outward.clock, ring.adjustment.sigma,
    )  # fmt: skip
    values |= dict(zip(_SHAPE, shape, strict=True))
    if measured.circle_centre is not None:
        values |= dict(zip(_CIRCLE, (*measured.circle_centre, ring.circle[2]), strict=True))
    if not ring.is_ellipse:
        return values | {"shape": "circle"}
    diameter = measured.diameter or 2.0 * ellipse.radius
    harmonics = np.array([ring.harmonics.amplitude(order) for order in range(2, ring.harmonics.orders + 1)]).reshape(-1, 3)
    oval = (
        2.0 * ellipse.axes[0], 2.0 * ellipse.axes_se[0], 2.0 * ellipse.axes[1], 2.0 * ellipse.axes_se[1], ellipse.direction,
        ellipse.direction_se, 4.0 * ellipse.flattening / diameter, 4.0 * ellipse.flattening_se / diameter, diameter,
        measured.diameter_from, *(_reals(column) for column in harmonics.T),
    )  # fmt: skip
    return values | dict(zip(_ELLIPSE, oval, strict=True)) | {"shape": "ellipse"}


def _plain(value: Any) -> Any:
    """Return a value for psycopg; None for NaN."""
    if isinstance(value, (float, np.floating)):
        return known(float(value))
    return value


def _reals(values: Any) -> list[float]:
    return [float(value) for value in values]
