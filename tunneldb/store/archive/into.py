"""Rows of an archive into the database: staged in temporary tables, given their numbers, and put into place."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import psycopg
from psycopg import sql
from psycopg.types.json import Jsonb

from tunneldb.errors import UserError
from tunneldb.store.archive.numbers import number_of, staged
from tunneldb.store.archive.tables import Column, Table

_CHUNK = 1000  # entries of the audit at a time


def stage_rows(
    conn: psycopg.Connection[Any], table: str, columns: Sequence[Column], chunks: Iterable[bytes | memoryview]
) -> int:
    """Copy rows into a temporary table of their own, and return how many there are."""
    held = staged(table)
    # types are the catalogue's, or those of this program; an archive's are none but these
    conn.execute(sql.SQL("DROP TABLE IF EXISTS {}").format(held))
    listed = sql.SQL(", ").join(
        sql.SQL("{} {}").format(sql.Identifier(column.name), sql.SQL(column.type)) for column in columns
    )
    conn.execute(sql.SQL("CREATE TEMPORARY TABLE {} ({}) ON COMMIT DROP").format(sql.Identifier(f"archive_{table}"), listed))
    return _copy_in(conn, held, columns, chunks)


def _copy_in(
    conn: psycopg.Connection[Any], target: sql.Composable, columns: Sequence[Column], chunks: Iterable[bytes | memoryview]
) -> int:
    listed = sql.SQL(", ").join(sql.Identifier(column.name) for column in columns)
    with conn.cursor() as cursor:
        with cursor.copy(sql.SQL("COPY {} ({}) FROM STDIN (FORMAT binary)").format(target, listed)) as copy:
            for chunk in chunks:
                copy.write(chunk)
        return cursor.rowcount


def insert_rows(conn: psycopg.Connection[Any], table: Table, old: int, new: int) -> tuple[int, int]:
    """Insert a table's staged rows; return how many, and how many were left out.

    A row of two surveys is left out if one is not in this database, and so is one that names a finding of it that is
    not there.

    Parameters
    ----------
    old, new : int
        Number of the survey in the archive, and here.
    """
    surveys = [column for column, target in table.refers.items() if target == "survey"]
    values, conditions = [], []
    for column in table.names:
        value: sql.Composable = sql.Identifier("a", column)
        target = table.refers.get(column)
        if column == "id" and table.identity:
            value = number_of(table.name, value, others=False)
        elif target == "survey" and len(surveys) == 1:
            # a row that says it is of another survey than the archive's is none's
            value = sql.SQL("CASE WHEN {} = {} THEN {} END").format(value, sql.Literal(old), sql.Literal(new))
        elif target == "survey":
            value = number_of("survey", value, others=True)
            conditions.append(sql.SQL("{} IS NOT NULL").format(value))
        elif column in table.arrays() and target is not None:
            here = number_of(target, sql.SQL("u.id"), others=True)
            value = sql.SQL(
                "coalesce((SELECT array_agg(q.new ORDER BY q.n)"
                " FROM (SELECT {} AS new, u.n FROM unnest({}) WITH ORDINALITY u (id, n)) q), '{{}}')"
            ).format(here, value)
            conditions.append(sql.SQL("array_position({}, NULL) IS NULL").format(value))
        elif target is not None and target not in ("finding_kind", "severity"):
            value = number_of(target, value, others=False)
        values.append(value)
    if len(surveys) > 1:
        mine = sql.SQL(" OR ").join(sql.SQL("a.{} = {}").format(sql.Identifier(s), sql.Literal(old)) for s in surveys)
        conditions.append(sql.SQL("({})").format(mine))
    where = sql.SQL(" WHERE {}").format(sql.SQL(" AND ").join(conditions)) if conditions else sql.SQL("")
    done = conn.execute(
        sql.SQL("INSERT INTO {} ({}) OVERRIDING SYSTEM VALUE SELECT {} FROM {} AS a{}").format(
            table.sql,
            sql.SQL(", ").join(map(sql.Identifier, table.names)),
            sql.SQL(", ").join(values),
            staged(table.name),
            where,
        )
    ).rowcount
    held = conn.execute(sql.SQL("SELECT count(*) FROM {}").format(staged(table.name))).fetchone()
    assert held is not None
    left = int(held[0]) - done
    if left and len(surveys) < 2:
        raise UserError(f"{left} rows of {table.name} fit nothing")
    return done, left


def load_points(
    conn: psycopg.Connection[Any], survey: int, km: int, table: Table, columns: Sequence[Column], chunks: Iterable[bytes]
) -> int:
    """Write a kilometre's points into a table of their own, which `attach_points` puts into place; return how many."""
    count = stage_rows(conn, "point", columns, chunks)
    new = sql.Identifier("tunnel", f"point_s{survey}_km{km}_new")
    conn.execute("SELECT tunnel_internal.partition_new(%s, %s)", [survey, km])
    row = conn.execute(
        "SELECT array_agg(old::int ORDER BY old), array_agg(new::int ORDER BY old) FROM pg_temp.map_scan_file"
    ).fetchone()
    assert row is not None
    files = sql.SQL("({}::int[])[nullif(width_bucket(a.file_id, {}::int[]), 0)]").format(
        sql.Literal(row[1] or []), sql.Literal(row[0] or [])
    )
    values = [
        sql.Literal(survey) if name == "survey_id" else files if name == "file_id" else sql.Identifier("a", name)
        for name in table.names
    ]
    conn.execute(
        sql.SQL("INSERT INTO {} ({}) SELECT {} FROM {} AS a").format(
            new,
            sql.SQL(", ").join(map(sql.Identifier, table.names)),
            sql.SQL(", ").join(values),
            staged("point"),
        )
    )
    return count


def attach_points(conn: psycopg.Connection[Any], survey: int, kms: Iterable[int]) -> None:
    """Insert the points of kilometres."""
    for km in kms:
        conn.execute("SELECT tunnel_internal.partition_swap(%s, %s)", [survey, km])


def make_images(conn: psycopg.Connection[Any], survey: int) -> sql.Identifier:
    """Make the table of a survey's images, which `attach_images` puts into place; a new survey's row makes none then."""
    name = sql.Identifier("tunnel", f"image_s{survey}")
    conn.execute(sql.SQL("CREATE TABLE {} (LIKE tunnel.image INCLUDING ALL)").format(name))
    conn.execute(sql.SQL("ALTER TABLE {} ALTER survey_id SET DEFAULT {}").format(name, sql.Literal(survey)))
    conn.execute(sql.SQL("ALTER TABLE {} ADD CONSTRAINT part CHECK (survey_id = {})").format(name, sql.Literal(survey)))
    return name


def load_images(
    conn: psycopg.Connection[Any], images: sql.Identifier, columns: Sequence[Column], chunks: Iterable[bytes]
) -> int:
    """Copy the images of a kilometre; return how many."""
    return _copy_in(conn, images, columns, chunks)


def attach_images(conn: psycopg.Connection[Any], survey: int, images: sql.Identifier) -> None:
    """Insert a survey's images. Their table belongs to the owner of the others, as if the survey had been added."""
    row = conn.execute(
        "SELECT r.rolname FROM pg_class c JOIN pg_roles r ON r.oid = c.relowner WHERE c.oid = 'tunnel.image'::regclass"
    ).fetchone()
    assert row is not None
    conn.execute(sql.SQL("ALTER TABLE {} ALTER survey_id DROP DEFAULT").format(images))
    conn.execute(sql.SQL("ALTER TABLE tunnel.image ATTACH PARTITION {} FOR VALUES IN ({})").format(images, sql.Literal(survey)))
    conn.execute(sql.SQL("ALTER TABLE {} DROP CONSTRAINT part").format(images))
    conn.execute(sql.SQL("ALTER TABLE {} OWNER TO {}").format(images, sql.Identifier(row[0])))
    conn.execute(sql.SQL("ANALYZE {}").format(images))


def load_audit(conn: psycopg.Connection[Any], survey: int) -> int:
    """Enter the staged entries of the audit, as imported, with the numbers of here; return how many."""
    count = conn.execute("SELECT count(*) FROM pg_temp.archive_audit").fetchone()
    assert count is not None
    conn.execute(
        "CREATE TEMPORARY TABLE map_audit ON COMMIT DROP AS SELECT a.old, n.new"
        " FROM (SELECT id AS old, row_number() OVER (ORDER BY id) AS n FROM pg_temp.archive_audit) a"
        " JOIN tunnel_internal.audit_reserve(%s) WITH ORDINALITY AS n (new, n) USING (n)",
        [count[0]],
    )
    conn.execute("CREATE UNIQUE INDEX ON pg_temp.map_audit (old)")
    rows = sql.SQL(
        "SELECT to_jsonb(a) || jsonb_build_object('id', {id}, 'undoes', {undoes}, 'part_of', {part}, 'row_id', {row},"
        " 'before', {before}, 'after', {after}, 'kept', {kept}) FROM pg_temp.archive_audit a ORDER BY a.id"
    ).format(
        id=number_of("audit", sql.SQL("a.id"), others=False),
        undoes=number_of("audit", sql.SQL("a.undoes"), others=False),
        part=number_of("audit", sql.SQL("a.part_of"), others=False),
        row=sql.SQL("CASE a.view {} END").format(
            sql.SQL(" ").join(
                sql.SQL("WHEN {} THEN {}").format(sql.Literal(view), number_of(view, sql.SQL("a.row_id"), others=False))
                for view in ("finding", "spot", "axis_vertex", "region", "photo", "action", "learned_model")
            )
        ),
        before=_state("before"),
        after=_state("after"),
        kept=_numbers(sql.SQL("a.kept"), {"feature_list_id": "feature_list"}),
    )
    with conn.cursor("audit_rows") as cursor:
        cursor.execute(rows)
        while chunk := cursor.fetchmany(_CHUNK):
            conn.execute("SELECT tunnel_internal.audit_import(%s, %s)", [survey, Jsonb([entry for (entry,) in chunk])])
    return int(count[0])


def _state(column: str) -> sql.Composable:
    """Return an earlier version of a finding or a photo, with its references renumbered: parent, merged into, finding."""
    value = sql.Identifier("a", column)
    changed = _numbers(value, dict.fromkeys(("parent_id", "merged_into", "finding_id"), "finding"))
    here = number_of("finding", sql.SQL("(e.v)::text::bigint"), others=False)
    merged = sql.SQL(
        "CASE WHEN jsonb_typeof({value} -> 'merged') = 'array' THEN jsonb_build_object('merged',"
        " (SELECT jsonb_agg({here} ORDER BY e.n) FROM jsonb_array_elements({value} -> 'merged') WITH ORDINALITY e (v, n)))"
        " ELSE '{{}}' END"
    ).format(value=value, here=here)
    return sql.SQL("{} || {}").format(changed, merged)


def _numbers(value: sql.Composable, keys: Mapping[str, str]) -> sql.Composable:
    parts = [
        sql.SQL(
            "CASE WHEN jsonb_typeof({value} -> {key}) = 'number' THEN jsonb_build_object({key}, {here}) ELSE '{{}}' END"
        ).format(
            value=value,
            key=sql.Literal(key),
            here=number_of(target, sql.SQL("({} ->> {})::bigint").format(value, sql.Literal(key)), others=False),
        )
        for key, target in keys.items()
    ]
    return sql.SQL("({} || {})").format(value, sql.SQL(" || ").join(parts))
