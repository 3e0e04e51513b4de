"""Features and reviews of findings, and adjustments learned from them: tables to arrays and back."""

from __future__ import annotations

import datetime as dt
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
import psycopg
from psycopg.rows import class_row
from psycopg.types.json import Jsonb

from tunneldb.anomalies.evidence import EvidenceModel, standard_model
from tunneldb.anomalies.features import NAMES
from tunneldb.anomalies.learning import Adjustment, Way
from tunneldb.arrays import Bool, Float, Int64

OUTLINE = "outline"
"""Name of the outline's reliability, stored behind the features."""

STORED = (*NAMES, OUTLINE)
"""Values that this version stores of each finding, in this order."""


@dataclass(frozen=True)
class Measured:
    """Anomalies and their features.

    Attributes
    ----------
    id, survey, tunnel : (n,) int arrays
        Keys.
    chainage : (n,) float array
        Chainages of their middles, m.
    detected : (n,) bool array
        True for those found by the last detection.
    crossed : (n,) bool array
        True for joints that profiles cross, identified by repetition, whatever the model.
    said : (n,) object array
        Inspectors' answers as sorts of review: "confirmed leak", "renamed to joint" …; empty without one.
    leak : (n,) bool array
        True if the inspector called it a leak.
    drawn : (n,) bool array
        True for outlines by people (drawn, redrawn, split, merged), which detection does not measure.
    covered : (n,) bool array
        True for those of them whose review applies to a detected finding, too.
    known : (n,) bool array
        True if all features of the model are stored.
    features : (n, len(FEATURES)) float array
    outline : (n,) float array
        Reliability of the outline, 0 to 1.
    """

    id: Int64
    survey: Int64
    tunnel: Int64
    chainage: Float
    detected: Bool
    crossed: Bool
    said: np.ndarray[Any, np.dtype[np.object_]]
    leak: Bool
    drawn: Bool
    covered: Bool
    known: Bool
    features: Float
    outline: Float


@dataclass(frozen=True)
class Learned:
    """A row of tunnel.learned_model, as the view of that name shows it."""

    id: int
    tunnel: str
    in_force: bool
    base: str
    way: str
    parameters: Mapping[str, Any]
    surveys: Sequence[str]
    reviews: Mapping[str, int]
    loss_base: float
    loss: float
    note: str | None
    applied_by: str
    active_from: dt.datetime
    undone_by: str | None
    undone_at: dt.datetime | None


@dataclass(frozen=True)
class InForce:
    """The model that classifies the findings of a tunnel.

    Attributes
    ----------
    id : int or None
        Number of the adjustment, if any.
    model : EvidenceModel
    note : str or None
        Reason why the adjustment is not used, if it is not.
    """

    id: int | None
    model: EvidenceModel
    note: str | None


def feature_list(conn: psycopg.Connection[Any]) -> int:
    """Return the key of the order in which this version stores features."""
    conn.execute("INSERT INTO tunnel.feature_list (names) VALUES (%s) ON CONFLICT DO NOTHING", [list(STORED)])
    row = conn.execute("SELECT id FROM tunnel.feature_list WHERE names = %s", [list(STORED)]).fetchone()
    assert row is not None
    return int(row[0])


def load_measured(conn: psycopg.Connection[Any], tunnels: Iterable[int]) -> Measured:
    """Read the findings of all surveys of some tunnels, in order of tunnel, survey and chainage.

    Reviews of a replacement, redrawn or merged, apply to the original. Drawn findings have no features.
    """
    orders = {key: _order(names) for key, names in conn.execute("SELECT id, names FROM tunnel.feature_list")}
    rows = conn.execute(
        """
        SELECT a.id, a.survey_id, s.tunnel_id, (a.chainage_from + a.chainage_to) / 2, a.detected,
               a.kind = 'joint' AND 'sparse' = ANY (a.reasons),
               CASE WHEN r.review = 'rejected' THEN 'rejected'
                    WHEN a.kind_override <> a.kind THEN 'renamed to ' || a.kind_override
                    WHEN r.review = 'confirmed' OR a.kind_override = a.kind THEN 'confirmed ' || a.kind ELSE '' END,
               r.review <> 'rejected' AND a.wet, a.feature_list_id, a.features, a.origin <> 'detected',
               EXISTS (SELECT FROM tunnel.finding d WHERE a.id IN (d.merged_into, d.same_as) AND d.origin = 'detected')
          FROM tunnel.finding a
          JOIN tunnel.survey s ON s.id = a.survey_id
          LEFT JOIN tunnel.finding h ON h.id = coalesce(a.merged_into, a.same_as) AND h.origin <> 'detected'
         CROSS JOIN LATERAL (SELECT CASE a.review WHEN 'open' THEN coalesce(h.review, a.review) ELSE a.review END AS review) r
         WHERE s.tunnel_id = ANY (%s)
         ORDER BY s.tunnel_id, s.id, a.chainage_from, a.id
        """,
        [list(tunnels)],
        binary=True,
    ).fetchall()
    values = np.full((len(rows), len(STORED)), np.nan)
    known = np.zeros(len(rows), np.bool_)
    for k, row in enumerate(rows):
        order = None if row[8] is None else orders[row[8]]
        if order is not None and row[9] is not None:
            values[k], known[k] = np.array(row[9])[order], True

    def column(number: int, kind: type) -> Any:
        return np.array([row[number] for row in rows], kind)

    return Measured(
        column(0, np.int64), column(1, np.int64), column(2, np.int64), column(3, np.float64), column(4, np.bool_),
        column(5, np.bool_), column(6, np.object_), column(7, np.bool_), column(10, np.bool_), column(11, np.bool_), known,
        values[:, :-1], values[:, -1],
    )  # fmt: skip


def _order(names: Sequence[str]) -> list[int] | None:
    """Return the places of this version's values in an order of features; None if some are missing."""
    return [names.index(name) for name in STORED] if set(STORED) <= set(names) else None


def model_in_force(conn: psycopg.Connection[Any], tunnel: int) -> InForce:
    """Return the evidence model of a tunnel: the program's, with the adjustments learned for it."""
    row = conn.execute(
        "SELECT id, base, way, parameters FROM tunnel.learned_model WHERE id = tunnel_internal.learned_in_force(%s)", [tunnel]
    ).fetchone()
    model = standard_model()
    if row is None:
        return InForce(None, model, None)
    number, base, way, parameters = row
    if base != model.version:
        note = f"what was learned from reviews (learned {number}) adjusts model {base}, and this version has {model.version}: "
        return InForce(number, model, note + "it is not used; tunneldb learn again")
    return InForce(number, Adjustment.from_json(cast(Way, way), parameters).apply(model, f"learned {number}"), None)


def apply_learned(
    conn: psycopg.Connection[Any],
    tunnel: int,
    adjustment: Adjustment,
    surveys: Sequence[str],
    reviews: Mapping[str, int],
    losses: tuple[float, float],
    note: str | None,
) -> int:
    """Activate an adjustment of the program's model for a tunnel; return its number.

    Parameters
    ----------
    losses : (float, float)
        Losses of the unchanged and the adjusted model on held-out reviews.
    """
    row = conn.execute(
        "SELECT tunnel_internal.learned_apply(%s, %s, %s, %s, %s, %s, %s, %s, %s)",
        [
            tunnel, standard_model().version, adjustment.way, Jsonb(adjustment.to_json()), list(surveys), Jsonb(dict(reviews)),
            *losses, note,
        ],
    ).fetchone()  # fmt: skip
    assert row is not None
    return int(row[0])


def undo_learned(conn: psycopg.Connection[Any], tunnel: int) -> int | None:
    """Undo the last adjustment of a tunnel; return its number, None if there is none."""
    row = conn.execute("SELECT tunnel_internal.learned_undo(%s)", [tunnel]).fetchone()
    assert row is not None
    return None if row[0] is None else int(row[0])


def list_learned(conn: psycopg.Connection[Any], tunnels: Iterable[int]) -> list[Learned]:
    """Return the adjustments of some tunnels, the last first."""
    with conn.cursor(row_factory=class_row(Learned)) as cursor:
        return cursor.execute(
            """
            SELECT id, tunnel, in_force, base, way, parameters, surveys, reviews, loss_base, loss, note, applied_by,
                   active_from, undone_by, undone_at
              FROM tunnel_api.learned_model WHERE tunnel_id = ANY (%s) ORDER BY id DESC
            """,
            [list(tunnels)],
        ).fetchall()


def places_of(conn: psycopg.Connection[Any], findings: Sequence[int]) -> dict[int, tuple[str, str]]:
    """Return survey and station of the middle of findings, by their keys."""
    rows = conn.execute("SELECT id, survey, label FROM tunnel_api.finding WHERE id = ANY (%s)", [list(findings)])
    return {key: (survey, label) for key, survey, label in rows}


def surveys_of(conn: psycopg.Connection[Any], tunnels: Iterable[int]) -> dict[int, str]:
    """Return the names of all surveys of some tunnels, by their keys, in order of date."""
    rows = conn.execute("SELECT id, name FROM tunnel.survey WHERE tunnel_id = ANY (%s) ORDER BY date, id", [list(tunnels)])
    return dict(rows.fetchall())
