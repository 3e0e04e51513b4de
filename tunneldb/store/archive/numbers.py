"""Numbers of an archive's rows in the target database: the same if possible, else new ones.

They are kept in temporary tables, ``map_<table>`` with ``old`` and ``new``; those of other surveys' rows in ``others_<table>``.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import psycopg
from psycopg import sql

from tunneldb.store.archive.out import OTHERS, outline_checksum
from tunneldb.store.archive.tables import SHARED, Table

_AUDITED = ("finding", "spot", "axis_vertex", "region", "photo", "action", "learned_model")


def staged(table: str) -> sql.Identifier:
    """Return the name of the temporary table with an archive's rows of a table."""
    return sql.Identifier("pg_temp", f"archive_{table}")


def keeps_numbers(conn: psycopg.Connection[Any], tables: Sequence[Table], name: str) -> bool:
    """Return True if all rows can keep their numbers, in the database that they came from.

    This requires that each number was assigned here and is free, and that the audit has the archive's entries, and none of
    another survey on any of these rows.
    """
    for table in tables:
        if not table.identity:
            continue
        row = conn.execute(
            sql.SQL(
                "SELECT NOT EXISTS (SELECT FROM {held} a JOIN {table} t ON t.id = a.id)"
                " AND coalesce((SELECT max(a.id) FROM {held} a), 0) <= coalesce(pg_sequence_last_value(%s::regclass), 0)"
            ).format(held=staged(table.name), table=table.sql),
            [_sequence(conn, table.name)],
        ).fetchone()
        assert row is not None
        if not row[0]:
            return False
    row = conn.execute(
        "SELECT NOT EXISTS (SELECT id, at, who, view, row_id, action FROM pg_temp.archive_audit"
        " EXCEPT SELECT id, at, who, view, row_id, action FROM tunnel_api.audit WHERE survey = %s)",
        [name],
    ).fetchone()
    assert row is not None
    return bool(row[0]) and not any(_audited_elsewhere(conn, table.name, name) for table in tables if table.name in _AUDITED)


def _audited_elsewhere(conn: psycopg.Connection[Any], table: str, name: str) -> bool:
    row = conn.execute(
        sql.SQL(
            "SELECT EXISTS (SELECT FROM tunnel_api.audit e JOIN {} a ON a.id = e.row_id WHERE e.view = %s AND e.survey <> %s)"
        ).format(staged(table)),
        [table, name],
    ).fetchone()
    return row is not None and bool(row[0])


def number_rows(conn: psycopg.Connection[Any], tables: Iterable[Table], *, keep: bool) -> None:
    """Deal out the numbers of tables' rows, and of rows that are gone and that the audit speaks of; in their former order."""
    for table in tables:
        if not table.identity:
            continue
        audited = sql.SQL(" UNION SELECT row_id FROM pg_temp.archive_audit WHERE view = {}").format(sql.Literal(table.name))
        new = sql.SQL("q.id") if keep else sql.SQL("nextval({}::regclass)").format(sql.Literal(_sequence(conn, table.name)))
        conn.execute(
            sql.SQL(
                "CREATE TEMPORARY TABLE {map} ON COMMIT DROP AS SELECT q.id::bigint AS old, {new}::bigint AS new"
                " FROM (SELECT id FROM {held}{audited} ORDER BY 1) q"
            ).format(
                map=sql.Identifier(f"map_{table.name}"),
                new=new,
                held=staged(table.name),
                audited=audited if table.name in _AUDITED else sql.SQL(""),
            )
        )
        _index(conn, f"map_{table.name}")


def number_shared(conn: psycopg.Connection[Any], tables: Mapping[str, Table]) -> None:
    """Add rows of the tables of all surveys that are missing here and needed, and find the numbers of the others."""
    needed = {
        "feature_list": "SELECT feature_list_id FROM pg_temp.archive_finding",
        "finding_kind": "SELECT kind FROM pg_temp.archive_finding UNION SELECT kind_override FROM pg_temp.archive_finding",
        "severity": "SELECT severity FROM pg_temp.archive_finding",
    }
    for name, key in SHARED.items():
        table = tables[name]
        columns = [c for c in table.names if c != "id" or "id" in key]
        listed = sql.SQL(", ").join(map(sql.Identifier, columns))
        match = sql.SQL(" AND ").join(sql.SQL("t.{0} = a.{0}").format(sql.Identifier(column)) for column in key)
        by = sql.Identifier("code" if name == "finding_kind" else "id")
        conn.execute(
            sql.SQL(
                "INSERT INTO {table} ({listed}) SELECT {listed} FROM {held} a WHERE a.{by} IN ({needed})"
                " AND NOT EXISTS (SELECT FROM {table} t WHERE {match})"
            ).format(table=table.sql, listed=listed, held=staged(name), by=by, needed=sql.SQL(needed[name]), match=match)
        )
        if name == "feature_list":
            conn.execute(
                sql.SQL(
                    "CREATE TEMPORARY TABLE map_feature_list ON COMMIT DROP AS"
                    " SELECT a.id::bigint AS old, min(t.id)::bigint AS new FROM {} a JOIN {} t ON {} GROUP BY a.id"
                ).format(staged(name), table.sql, match)
            )
            _index(conn, "map_feature_list")


def number_others(conn: psycopg.Connection[Any]) -> None:
    """Find the other surveys that rows refer to, with their findings and runs, by their natural keys."""
    conn.execute(
        "CREATE TEMPORARY TABLE others_survey ON COMMIT DROP AS SELECT a.id::bigint AS old, s.id::bigint AS new"
        " FROM pg_temp.archive_other_survey a JOIN tunnel.survey s ON s.name = a.name AND s.created_at = a.created_at"
        " JOIN pg_temp.map_tunnel t ON t.new = s.tunnel_id"
    )
    conn.execute(
        sql.SQL(
            "CREATE TEMPORARY TABLE others_finding ON COMMIT DROP AS SELECT DISTINCT ON (a.id) a.id AS old, x.id AS new"
            " FROM pg_temp.archive_other_finding a JOIN pg_temp.others_survey o ON o.old = a.survey_id"
            " JOIN tunnel.finding x ON x.survey_id = o.new AND x.created_at = a.created_at AND {} = a.outline"
            " ORDER BY a.id, x.id <> a.id"
        ).format(outline_checksum("x"))
    )
    conn.execute(
        "CREATE TEMPORARY TABLE others_run ON COMMIT DROP AS SELECT DISTINCT ON (a.id) a.id AS old, r.id AS new"
        " FROM pg_temp.archive_other_run a JOIN pg_temp.others_survey o ON o.old = a.survey_id"
        " JOIN tunnel.run r ON r.survey_id = o.new AND r.km IS NOT DISTINCT FROM a.km AND r.stage = a.stage"
        " AND r.started_at = a.started_at ORDER BY a.id, r.id <> a.id"
    )
    for name in OTHERS:
        _index(conn, name.replace("other_", "others_"))


def number_of(target: str, value: sql.Composable, *, others: bool) -> sql.Composed:
    """Return an expression for the number of a table's row in this database; NULL if there is none."""
    source = sql.SQL("pg_temp.{}").format(sql.Identifier(f"map_{target}"))
    if others:
        source = sql.SQL("(SELECT old, new FROM {} UNION ALL SELECT old, new FROM pg_temp.{})").format(
            source, sql.Identifier(f"others_{target}")
        )
    return sql.SQL("(SELECT m.new FROM {} AS m WHERE m.old = {})").format(source, value)


def ledger_numbers(conn: psycopg.Connection[Any]) -> list[tuple[str, str, str]]:
    """Return stage and name of the ledger's parameters that hold numbers of rows, or arrays of them, and whose: run, survey."""
    return conn.execute(
        "SELECT stage, key, holds FROM tunnel.stage_input WHERE holds IN ('run', 'survey') ORDER BY stage, number"
    ).fetchall()


def renumber_ledger(conn: psycopg.Connection[Any], *, keep: bool) -> None:
    """Renumber the ledger's parameters and counts; no interrupted run counts as running."""
    # no server process has this number
    conn.execute("UPDATE pg_temp.archive_run SET backend_pid = 0 WHERE outcome = 'running'")
    if keep:
        return
    conn.execute("UPDATE pg_temp.archive_run SET job_id = NULL")
    for stage, key, target in ledger_numbers(conn):
        number = sql.SQL("CASE jsonb_typeof(e.v) WHEN 'number' THEN e.v::text::numeric::bigint END")
        here = number_of(target, number, others=True)
        conn.execute(
            sql.SQL(
                """
                UPDATE pg_temp.archive_run r
                   SET parameters = jsonb_set(r.parameters, ARRAY[{key}], (
                        SELECT CASE jsonb_typeof(r.parameters -> {key})
                                    WHEN 'array' THEN coalesce(jsonb_agg(q.new ORDER BY q.n), '[]')
                                    ELSE coalesce((array_agg(q.new))[1], 'null') END
                          FROM (SELECT to_jsonb({here}) AS new, e.n
                                  FROM jsonb_array_elements(CASE jsonb_typeof(r.parameters -> {key}) WHEN 'array'
                                       THEN r.parameters -> {key} ELSE jsonb_build_array(r.parameters -> {key}) END)
                                       WITH ORDINALITY AS e (v, n)) q))
                 WHERE r.stage = {stage} AND r.parameters ? {key}
                """
            ).format(key=sql.Literal(key), stage=sql.Literal(stage), here=here)
        )
    # a model that is not there is none of those that are
    learned = number_of("learned_model", sql.SQL("(r.counts ->> 'learned')::bigint"), others=False)
    conn.execute(
        sql.SQL(
            "UPDATE pg_temp.archive_run r SET counts = jsonb_set(r.counts, '{{learned}}', to_jsonb(coalesce({}, 0)))"
            " WHERE jsonb_typeof(r.counts -> 'learned') = 'number'"
        ).format(learned)
    )


def _sequence(conn: psycopg.Connection[Any], table: str) -> str:
    row = conn.execute("SELECT pg_get_serial_sequence(format('tunnel.%%I', %s::text), 'id')", [table]).fetchone()
    assert row is not None
    return str(row[0])


def _index(conn: psycopg.Connection[Any], name: str) -> None:
    conn.execute(sql.SQL("CREATE UNIQUE INDEX ON pg_temp.{} (old)").format(sql.Identifier(name)))
    conn.execute(sql.SQL("ANALYZE pg_temp.{}").format(sql.Identifier(name)))
