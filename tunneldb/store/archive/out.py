"""Rows of a survey from the database, as streams of binary COPY: of one snapshot, while no stage works on the survey."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import psycopg
from psycopg import sql

from tunneldb.errors import BusyError, UserError
from tunneldb.store.archive.tables import BULK, Column, Table, archive_tables, belongs
from tunneldb.store.partition import partition, partition_exists
from tunneldb.store.survey import Survey

AUDIT = (
    Column("id", "bigint"),
    Column("at", "timestamp with time zone"),
    Column("who", "text"),
    Column("view", "text"),
    Column("row_id", "bigint"),
    Column("action", "text"),
    Column("before", "jsonb"),
    Column("after", "jsonb"),
    Column("undoes", "bigint"),
    Column("part_of", "bigint"),
    Column("kept", "jsonb"),
)
"""Audit entries of the survey in an archive."""

OTHER_SURVEY = (Column("id", "integer"), Column("name", "text"), Column("created_at", "timestamp with time zone"))
"""Surveys that this one was compared with, which are not in the archive."""

OTHER_FINDING = (
    Column("id", "bigint"),
    Column("survey_id", "integer"),
    Column("created_at", "timestamp with time zone"),
    Column("outline", "text"),
)
"""Their findings in comparisons, with natural keys: time of creation and checksum of the outline."""

OTHER_RUN = (
    Column("id", "bigint"),
    Column("survey_id", "integer"),
    Column("km", "integer"),
    Column("stage", "text"),
    Column("started_at", "timestamp with time zone"),
)
"""Their runs that comparisons depend on, with natural keys."""

OTHERS = {"other_survey": OTHER_SURVEY, "other_finding": OTHER_FINDING, "other_run": OTHER_RUN}


@dataclass(frozen=True)
class Stream:
    """Rows to be written as one member of an archive: its table, its kilometre if it is a `BULK` table's, and the statement."""

    table: str
    km: int | None
    columns: Sequence[Column]
    query: sql.Composable

    @property
    def member(self) -> str:
        """Name of the member."""
        return member_name(self.table, self.km)


def member_name(table: str, km: int | None) -> str:
    """Return the member's name for a table's rows, for a `BULK` table those of a kilometre."""
    return f"rows/{table}.zst" if km is None else f"{table}/km{km}.zst"


def without_survey(table: Table) -> tuple[Column, ...]:
    """Return the columns of a `BULK` table without the survey's, which is the same in all rows."""
    return tuple(column for column in table.columns if column.name != "survey_id")


@contextmanager
def still(conn: psycopg.Connection[Any], survey: Survey) -> Iterator[None]:
    """Lock the survey against stages, and use one snapshot of it; reviews go on, and are not seen.

    Raises
    ------
    BusyError
        If a stage is running on it.
    UserError
        If points of it were read, and wait to be loaded.
    """
    kms = [-1, *kilometres(conn, survey)]
    row = conn.execute(
        "SELECT array_agg(k) FROM unnest(%s::int[]) AS k WHERE NOT pg_try_advisory_lock(%s, k)", [kms, survey.id]
    ).fetchone()
    conn.commit()
    try:
        if row is not None and row[0]:
            raise BusyError(f"another process is at work on {survey.name}: wait until it has finished (tunneldb status)")
        conn.execute("SET TRANSACTION ISOLATION LEVEL REPEATABLE READ, READ ONLY")
        # else a table that others are reading is read from where they are, not from its beginning
        conn.execute("SET LOCAL synchronize_seqscans = off")
        _require_loaded(conn, survey)
        yield
    finally:
        if not conn.closed:
            conn.rollback()
            conn.execute("SELECT pg_advisory_unlock(%s, k) FROM unnest(%s::int[]) AS k", [survey.id, kms])
            conn.commit()


def kilometres(conn: psycopg.Connection[Any], survey: Survey) -> list[int]:
    """Return the kilometres with anything read, done or requested."""
    rows = conn.execute(
        """
        SELECT r.km FROM tunnel.run r WHERE r.survey_id = %(id)s AND r.km IS NOT NULL
         UNION SELECT g.km FROM tunnel.goal g WHERE g.survey_id = %(id)s
         UNION SELECT k.km FROM tunnel.file_km k JOIN tunnel.scan_file f ON f.id = k.file_id WHERE f.survey_id = %(id)s
         ORDER BY 1
        """,
        {"id": survey.id},
    )
    return [row[0] for row in rows]


def streams(conn: psycopg.Connection[Any], survey: Survey) -> list[Stream]:
    """Yield all rows of a survey and its tunnel, and references to other surveys, in the order of loading."""
    tables = archive_tables(conn)
    by_name = {table.name: table for table in tables}
    found = [
        Stream(t.name, None, t.columns, _select(t, belongs(t, by_name, survey.id, survey.tunnel_id)))
        for t in tables
        if t.name not in BULK
    ]
    found.append(
        Stream(
            "audit",
            None,
            AUDIT,
            sql.SQL(
                "SELECT {} FROM tunnel_api.audit e WHERE e.survey = {} AND e.at >="
                " (SELECT s.created_at FROM tunnel.survey s WHERE s.id = {}) ORDER BY e.id"
            ).format(_names(AUDIT), sql.Literal(survey.name), sql.Literal(survey.id)),
        )
    )
    found += [Stream(name, None, OTHERS[name], query) for name, query in _others(tables, survey)]
    image = without_survey(by_name["image"])
    for (km,) in conn.execute("SELECT DISTINCT km FROM tunnel.image WHERE survey_id = %s ORDER BY km", [survey.id]).fetchall():
        query = sql.SQL("SELECT {} FROM tunnel.image WHERE survey_id = {} AND km = {} ORDER BY kind, block").format(
            _names(image), sql.Literal(survey.id), sql.Literal(km)
        )
        found.append(Stream("image", km, image, query))
    point = without_survey(by_name["point"])
    for km in kilometres(conn, survey):
        if partition_exists(conn, survey, km):
            # the partition as it lies, in order of chainage: a query might be shared out
            name = sql.SQL("{} ({})").format(partition(survey, km), _names(point))
            found.append(Stream("point", km, point, name))
    return found


class Rows:
    """Rows of a stream as chunks of binary COPY; after `chunks`, ``count`` is how many rows they were."""

    def __init__(self, conn: psycopg.Connection[Any], stream: Stream) -> None:
        self._conn, self._stream = conn, stream
        self.count = 0

    @contextmanager
    def chunks(self) -> Iterator[Iterator[bytes | bytearray | memoryview]]:
        """Yield the chunks within a with block, after which the connection is free, also if they were not all taken."""
        source = self._stream.query if self._stream.table == "point" else sql.SQL("({})").format(self._stream.query)
        with self._conn.cursor() as cursor:
            with cursor.copy(sql.SQL("COPY {} TO STDOUT (FORMAT binary)").format(source)) as copy:
                yield iter(copy)
            self.count = cursor.rowcount


def _require_loaded(conn: psycopg.Connection[Any], survey: Survey) -> None:
    rows = conn.execute(
        "SELECT DISTINCT k.km FROM tunnel.file_km k JOIN tunnel.scan_file f ON f.id = k.file_id"
        " WHERE f.survey_id = %s AND k.loaded_at IS NULL ORDER BY 1",
        [survey.id],
    ).fetchall()
    if rows:
        kms = ", ".join(str(row[0]) for row in rows[:5])
        raise UserError(
            f"points of {survey.name} were read and wait to be loaded into kilometre {kms}:"
            f" tunneldb batch {survey.name} loads them"
        )


def _names(columns: Sequence[Column]) -> sql.Composed:
    return sql.SQL(", ").join(sql.Identifier(column.name) for column in columns)


def _select(table: Table, condition: sql.Composable) -> sql.Composed:
    order = sql.SQL(", ").join(map(sql.Identifier, table.key))
    return sql.SQL("SELECT {} FROM {} WHERE {} ORDER BY {}").format(_names(table.columns), table.sql, condition, order)


def _others(tables: Sequence[Table], survey: Survey) -> Iterator[tuple[str, sql.Composable]]:
    key = sql.Literal(survey.id)
    beside = [
        sql.SQL("SELECT {} AS id FROM {} WHERE {} = {}").format(sql.Identifier(one), table.sql, sql.Identifier(other), key)
        for table in tables
        for one, target in table.refers.items()
        for other, twin in table.refers.items()
        if target == twin == "survey" and one != other
    ]
    runs = sql.SQL(
        "SELECT (r.parameters ->> i.key)::int AS id FROM tunnel.run r JOIN tunnel.stage_input i USING (stage)"
        " WHERE r.survey_id = {} AND i.holds = 'survey'"
    ).format(key)
    others = sql.SQL(" UNION ").join([*beside, runs])
    yield (
        "other_survey",
        sql.SQL(
            "SELECT s.id, s.name, s.created_at FROM tunnel.survey s WHERE s.id <> {} AND s.id IN ({}) ORDER BY s.id"
        ).format(key, others),
    )
    yield (
        "other_finding",
        sql.SQL(
            "SELECT a.id, a.survey_id, a.created_at, {} FROM tunnel.finding a WHERE a.survey_id <> {} AND a.id IN"
            " (SELECT unnest(c.old_ids || c.new_ids) FROM tunnel.leak_change c WHERE c.survey_id = {} OR c.old_survey_id = {})"
            " ORDER BY a.id"
        ).format(outline_checksum("a"), key, key, key),
    )
    yield (
        "other_run",
        sql.SQL(
            "SELECT o.id, o.survey_id, o.km, o.stage, o.started_at FROM tunnel.run o WHERE o.survey_id <> {} AND o.id IN"
            " (SELECT unnest(tunnel_internal.run_inputs(r.stage, r.parameters)) FROM tunnel.run r WHERE r.survey_id = {})"
            " ORDER BY o.id"
        ).format(key, key),
    )


def outline_checksum(alias: str) -> sql.Composed:
    """Return the checksum of a finding's outline in the unrolled plane."""
    return sql.SQL("md5(public.ST_AsEWKB({}))").format(sql.Identifier(alias, "unrolled"))
