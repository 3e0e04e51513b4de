"""Space of deleted and replaced rows, and VACUUM."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import psycopg
from psycopg import sql
from psycopg.rows import class_row

from tunneldb.errors import UserError
from tunneldb.progress import StartProgress

_LOCKED = psycopg.errors.LockNotAvailable.sqlstate
_MAINTAIN = 170000  # first version of PostgreSQL in which others than the owner can have the right


@dataclass(frozen=True)
class DeadRows:
    """Table with dead rows, or without statistics.

    Attributes
    ----------
    schema, table : str
    live, dead : int
        Numbers of rows, by the server's statistics; dead ones include those of long values.
    dead_bytes : int
        Size of the dead rows, at the mean length of the table's rows.
    bytes : int
        Size of the whole table on disk, with indexes and long values.
    analyzed : bool
        True if it has statistics for the planner.
    allowed : bool
        True if the current user may vacuum it.
    """

    schema: str
    table: str
    live: int
    dead: int
    dead_bytes: int
    bytes: int
    analyzed: bool
    allowed: bool


def tables_to_vacuum(conn: psycopg.Connection[Any]) -> list[DeadRows]:
    """Return tables of the schemas with dead rows, or non-empty ones never analyzed; the largest amounts first."""
    maintain = " OR has_table_privilege(c.oid, 'MAINTAIN')" if conn.info.server_version >= _MAINTAIN else ""
    query = sql.SQL(
        """
        SELECT n.nspname AS schema, c.relname AS table, s.live, s.dead + s.dead_long AS dead,
               (pg_relation_size(c.oid) * (s.dead / greatest(s.live + s.dead, 1)::float8)
                + CASE WHEN s.dead_long > 0
                       THEN pg_relation_size(c.reltoastrelid) * (s.dead_long / (s.live_long + s.dead_long)::float8)
                       ELSE 0 END)::bigint AS dead_bytes,
               pg_total_relation_size(c.oid) AS bytes, c.reltuples >= 0 AS analyzed,
               pg_has_role(c.relowner, 'USAGE') OR pg_has_role(d.datdba, 'USAGE'){maintain} AS allowed
          FROM pg_class c
          JOIN pg_namespace n ON n.oid = c.relnamespace
          JOIN pg_database d ON d.datname = current_database()
         CROSS JOIN LATERAL (
                SELECT pg_stat_get_live_tuples(c.oid) AS live, pg_stat_get_dead_tuples(c.oid) AS dead,
                       coalesce(pg_stat_get_live_tuples(nullif(c.reltoastrelid, 0)), 0) AS live_long,
                       coalesce(pg_stat_get_dead_tuples(nullif(c.reltoastrelid, 0)), 0) AS dead_long) s
         WHERE n.nspname IN ('tunnel', 'tunnel_queue') AND c.relkind = 'r' AND c.relpersistence = 'p'
           AND c.relname !~ '^fragment_s'  -- waits to be loaded, and is dropped then
           AND (s.dead + s.dead_long > 0 OR c.reltuples < 0 AND pg_relation_size(c.oid) > 0)
         ORDER BY dead_bytes DESC, n.nspname, c.relname
        """
    ).format(maintain=sql.SQL(maintain))
    with conn.cursor(row_factory=class_row(DeadRows)) as cursor:
        return cursor.execute(query).fetchall()


def vacuum(conn: psycopg.Connection[Any], tables: Sequence[DeadRows], begin: StartProgress) -> list[DeadRows]:
    """VACUUM (ANALYZE) tables one by one; return those locked by others, which are left unchanged.

    Parameters
    ----------
    conn : Connection
        Idle connection; VACUUM runs outside transactions, so the connection is in autocommit mode from now on.
    tables : sequence of DeadRows
        Tables; those that are not allowed are skipped.
    begin : callable
        Function of a text and the bytes of all tables; it returns a function of the bytes of each completed table.

    Raises
    ------
    UserError
        If none of them may be vacuumed.
    """
    own = [table for table in tables if table.allowed]
    if tables and not own:
        raise UserError(
            f"{conn.info.user} owns none of the {len(tables)} tables, and only owners may vacuum; ask the database's owner, or"
            " for the role tunnel_operator"
        )
    conn.autocommit = True
    notices: list[str | None] = []
    skipped = []
    conn.add_notice_handler(lambda notice: notices.append(notice.sqlstate))
    advance = begin("vacuum", float(sum(table.bytes for table in own)))
    for table in own:
        notices.clear()
        with suppress(psycopg.errors.UndefinedTable):  # dropped since
            conn.execute(sql.SQL("VACUUM (ANALYZE, SKIP_LOCKED) {}").format(sql.Identifier(table.schema, table.table)))
        if _LOCKED in notices:
            skipped.append(table)
        advance(float(table.bytes))
    return skipped
