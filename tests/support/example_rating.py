"""Elements and a rating scheme of the example survey, row by row."""

from __future__ import annotations

import psycopg

BLOCKS = 4
"""Number of blocks of 50 m, from 12+300."""


def add_rating(conn: psycopg.Connection, survey_id: int) -> None:
    """Blocks of 50 m, each with crown, walls and invert, and a scheme with rules on leaks and cracks."""
    conn.execute(
        "WITH d AS (INSERT INTO tunnel.element_set (tunnel_id, name, source) SELECT tunnel_id, 'blocks', 'length'"
        " FROM tunnel.survey WHERE id = %s RETURNING id)"
        " INSERT INTO tunnel.element (element_set_id, number, name, chainage_from, chainage_to)"
        " SELECT d.id, n, 'block ' || n, 12250 + 50 * n, 12300 + 50 * n FROM d, generate_series(1, %s) AS n",
        [survey_id, BLOCKS],
    )
    conn.execute(
        "WITH d AS (INSERT INTO tunnel.element_set (tunnel_id, name, source) SELECT tunnel_id, 'zones', 'file'"
        " FROM tunnel.survey WHERE id = %s RETURNING id)"
        " INSERT INTO tunnel.element (element_set_id, number, name, chainage_from, chainage_to, clock_from, clock_to)"
        " SELECT d.id, 4 * (n - 1) + z.k, 'block ' || n || ' ' || z.name, 12250 + 50 * n, 12300 + 50 * n, z.a, z.b"
        " FROM d, generate_series(1, %s) AS n, (VALUES (1, 'crown', 10, 2), (2, 'right', 2, 5), (3, 'invert', 5, 7),"
        " (4, 'left', 7, 10)) AS z (k, name, a, b)",
        [survey_id, BLOCKS],
    )
    conn.execute(
        "WITH s AS (INSERT INTO tunnel.rating_scheme (name, version, source, valid_from, results)"
        " VALUES ('example', '1', 'example of the tests', '2024-01-01', '{A,B,C,D}') RETURNING id)"
        " INSERT INTO tunnel.rating_rule (scheme_id, number, text, kinds, measure, inclusive, limits, results)"
        " SELECT s.id, r.* FROM s, (VALUES"
        " (1, 'share of wet lining', '{}'::text[], 'share', false, '{0.0005,0.002}'::float8[], '{B,C}'::text[]),"
        " (2, 'severity', '{leak,crack,spall}', 'severity', true, '{2,3,4}', '{B,C,D}')) AS r"
    )
