"""What goes when a kilometre loses its points."""

from __future__ import annotations

import psycopg

OTHERWISE = {"point", "fragment", "goal", "run", "waterproof"} | {"bed", "sonar_point", "water_level"}
"""Points, what is wanted of a kilometre and the ledger; and what sonar gave, which laser points have no part in."""


def test_every_table_of_results_by_kilometre_is_cleared(conn: psycopg.Connection) -> None:
    tables = conn.execute(
        "SELECT c.table_name"
        "  FROM information_schema.columns c JOIN information_schema.tables t USING (table_schema, table_name)"
        " WHERE c.table_schema = 'tunnel' AND t.table_type = 'BASE TABLE' AND c.column_name IN ('survey_id', 'km')"
        " GROUP BY 1 HAVING count(*) = 2"
    ).fetchall()
    results = conn.execute("SELECT unnest(tables) FROM tunnel.stage").fetchall()
    assert {name for (name,) in tables} - {name for (name,) in results} - OTHERWISE == set()
