"""A survey of 500 anomalies to review: those that detection found in the demonstration, and copies of them about its lining."""

from __future__ import annotations

import psycopg
from psycopg import sql

SURVEY, COUNT = "demo-2024", 500
CELL, GAP = (2.3, 1.2), 0.3
"""A cell of the lining for each copy, along and around, m, and what lies between two."""

LINING = 9.0
"""Arc from the crown to either side that is filled, m."""

_COPIED = (
    "survey_id", "darkening_mean", "darkening_max", "image_share", "kind", "reasons", "confidence", "contrast",
    "feature_list_id",
    "features", "evidence", "model",
)  # fmt: skip
_FIGURES = ("km", "chainage_from", "chainage_to", "arc_from", "arc_to", "clock", "area", "unrolled", "map", "surface")

_REPEAT = """
    WITH found AS (
        SELECT a.*, row_number() OVER (ORDER BY a.id) - 1 AS n, count(*) OVER () AS of
          FROM tunnel.finding a JOIN tunnel.survey s ON s.id = a.survey_id WHERE s.name = %(survey)s
    ), cell AS (
        SELECT row_number() OVER (ORDER BY md5(c.chainage::text || c.arc::text)) - 1 AS n, c.chainage, c.arc
          FROM (SELECT x::float8 AS chainage, y::float8 AS arc
                  FROM generate_series(%(from)s::numeric + 2, %(to)s::numeric - 2, %(along)s::numeric) x
                 CROSS JOIN generate_series(-%(lining)s::numeric, %(lining)s::numeric, %(around)s::numeric) y) c
         WHERE NOT EXISTS (SELECT FROM found f
                            WHERE f.unrolled && ST_MakeEnvelope(c.chainage - %(width)s / 2, c.arc - %(height)s / 2,
                                                                c.chainage + %(width)s / 2, c.arc + %(height)s / 2))
    ), fitted AS (
        SELECT f.*, ST_Translate(ST_Scale(f.unrolled, g.scale, g.scale),
                                 c.chainage - g.scale * g.x, c.arc - g.scale * g.y) AS outline
          FROM cell c
          JOIN found f ON f.n = c.n %% f.of
         CROSS JOIN LATERAL (
               SELECT least(1, %(width)s / (f.chainage_to - f.chainage_from),
                            %(height)s / (f.arc_to - f.arc_from))::float8 AS scale,
                      (f.chainage_from + f.chainage_to) / 2 AS x, (f.arc_from + f.arc_to) / 2 AS y) g
         WHERE c.n < %(count)s - f.of
    )
    INSERT INTO tunnel.finding ({copied}, {figures})
    SELECT {copies}, {worked_out}
      FROM fitted f CROSS JOIN LATERAL tunnel_internal.drawn_figures(f.survey_id, f.outline, NULL) w
"""


def repeat(conn: psycopg.Connection) -> int:
    """Add copies, each scaled into a free cell of its own, until there are COUNT; commits, and returns how many there are."""
    (start, end) = conn.execute(  # type: ignore[misc]
        "SELECT min(g.chainage_from), max(g.chainage_to) FROM tunnel_api.segment g WHERE g.survey = %s", [SURVEY]
    ).fetchone()
    names = {
        "copied": _names(_COPIED), "figures": _names(_FIGURES),
        "copies": _names(_COPIED, "f"), "worked_out": _names(_FIGURES, "w"),
    }  # fmt: skip
    conn.execute(
        sql.SQL(_REPEAT).format(**names),
        {"survey": SURVEY, "from": start, "to": end, "lining": LINING, "width": CELL[0], "height": CELL[1], "count": COUNT,
         "along": CELL[0] + GAP, "around": CELL[1] + GAP},
    )  # fmt: skip
    (made,) = conn.execute(  # type: ignore[misc]
        "SELECT count(*) FROM tunnel_api.finding f WHERE f.survey = %s AND f.state = 'open'", [SURVEY]
    ).fetchone()
    conn.commit()
    return int(made)


def _names(columns: tuple[str, ...], *of: str) -> sql.Composed:
    return sql.SQL(", ").join(sql.Identifier(*of, column) for column in columns)


def reopen(conn: psycopg.Connection) -> None:
    """Take all reviews away, as if nobody had looked; commits."""
    conn.execute(
        "UPDATE tunnel.finding a SET review = 'open', remark = NULL, kind_override = NULL, reviewed_by = NULL,"
        " reviewed_at = NULL"
        " FROM tunnel.survey s WHERE s.id = a.survey_id AND s.name = %s", [SURVEY],
    )  # fmt: skip
    conn.commit()
