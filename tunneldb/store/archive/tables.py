"""Tables of a survey, from the catalogue: a new table is found by its foreign keys."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from graphlib import TopologicalSorter
from typing import Any

import psycopg
from psycopg import sql

BULK = ("point", "image")
"""Tables that are partitioned by survey: their rows are transferred by kilometre."""

EXCLUDED = {
    "alembic_version": "the schema's own",
    "as_of": "always empty",
    "stage": "made anew by tunneldb init",
    "stage_input": "made anew by tunneldb init",
    "worker": "who serves the queue at the moment",
    "incoming": "files that wait to be read, which a batch asks for again",
    "segmentation_network": "files of owners, which have the same numbers in every database",
    "finding_sum": "sums that triggers keep",
    "alarm_limit": "the owner's for a tunnel in this database, added by command",
    "rating_scheme": "the owner's for all surveys, added from a file",
    "rating_rule": "the owner's for all surveys, added from a file",
    "waterproof": "statistics of kilometres, worked out anew",
}
"""Tables of schema tunnel that are not archived, with the reason."""

SHARED: Mapping[str, tuple[str, ...]] = {"feature_list": ("names",), "finding_kind": ("code",), "severity": ("id",)}
"""Tables of all surveys that rows refer to, and the columns of their natural keys."""

UNDECLARED: Mapping[tuple[str, str], str] = {
    ("clearance_section", "cluster_id"): "cluster",
    ("clearance_infringement", "cluster_id"): "cluster",
    ("leak_change", "old_ids"): "finding",
    ("leak_change", "new_ids"): "finding",
}
"""Columns with ids of a table without a foreign key: the ids may be gone, or are arrays."""

_PIECE = re.compile(r"(point|image)_s\d+(_.*)?|fragment_s\d+_.*")


@dataclass(frozen=True)
class Column:
    """A column that is stored, not generated: its name, and its type as PostgreSQL writes it."""

    name: str
    type: str


@dataclass(frozen=True)
class Table:
    """Table of schema tunnel with archived rows.

    Attributes
    ----------
    name : str
    role : str
        ``survey``: rows of the survey; ``tunnel``: rows of its tunnel; ``shared``: see `SHARED`.
    columns : tuple of Column
    identity : bool
        True if its column ``id`` is numbered by the database.
    key : tuple of str
        Columns of its primary key; of all, where it has none.
    refers : mapping
        Columns with ids of another table, or arrays of them, and that table.
    """

    name: str
    role: str
    columns: tuple[Column, ...]
    identity: bool
    key: tuple[str, ...]
    refers: Mapping[str, str]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns."""
        return tuple(column.name for column in self.columns)

    @property
    def sql(self) -> sql.Identifier:
        """Its name in a statement."""
        return sql.Identifier("tunnel", self.name)

    def arrays(self) -> frozenset[str]:
        """Return the columns with several ids."""
        return frozenset(c.name for c in self.columns if c.name in self.refers and c.type.endswith("[]"))


def archive_tables(conn: psycopg.Connection[Any]) -> list[Table]:
    """Return the tables with archived rows, each after those that it refers to.

    A table is the survey's when a foreign key leads from it to `survey`, directly or through another; its tunnel's in the same
    way. `BULK` tables, which are partitioned and so have none, come last.
    """
    columns = _columns(conn)
    keys = _foreign_keys(conn)
    own = _below(keys, "survey") | set(BULK)
    tunnel = _below(keys, "tunnel") - own
    roles = {**dict.fromkeys(tunnel, "tunnel"), **dict.fromkeys(own, "survey")}
    wanted = [name for name in roles if name not in EXCLUDED]
    roles |= {target: "shared" for name in wanted for _, target in keys.get(name, ()) if target not in roles}
    primary = _primary_keys(conn)
    found = {
        name: Table(
            name,
            role,
            tuple(Column(*c[:2]) for c in columns[name]),
            any(c[0] == "id" and c[2] for c in columns[name]),
            primary.get(name) or tuple(c[0] for c in columns[name]),
            {
                **dict(keys.get(name, ())),
                **{column: target for (table, column), target in UNDECLARED.items() if table == name},
                **({"survey_id": "survey", "file_id": "scan_file"} if name == "point" else {}),
                **({"survey_id": "survey"} if name == "image" else {}),
            },
        )
        for name, role in roles.items()
        if name not in EXCLUDED
    }
    order = TopologicalSorter(
        {name: {t for t in table.refers.values() if t in found and t != name} for name, table in sorted(found.items())}
    ).static_order()
    return sorted((found[name] for name in order), key=lambda table: table.name in BULK)


def belongs(table: Table, tables: Mapping[str, Table], survey: int, tunnel: int) -> sql.Composable:
    """Return the condition for a table's rows of the survey or its tunnel; with two surveys either may be this one."""
    if table.role == "shared":
        return sql.SQL("true")
    root, key = ("survey", survey) if table.role == "survey" else ("tunnel", tunnel)
    if table.name == root:
        return sql.SQL("id = {}").format(sql.Literal(key))
    direct = [column for column, target in table.refers.items() if target == root]
    if direct:
        parts = [sql.SQL("{} = {}").format(sql.Identifier(column), sql.Literal(key)) for column in direct]
        return sql.SQL("({})").format(sql.SQL(" OR ").join(parts))
    column, parent = next((c, t) for c, t in table.refers.items() if t in tables and tables[t].role == table.role)
    return sql.SQL("{} IN (SELECT id FROM {} WHERE {})").format(
        sql.Identifier(column), tables[parent].sql, belongs(tables[parent], tables, survey, tunnel)
    )


def stored_tables(conn: psycopg.Connection[Any]) -> set[str]:
    """Return all tables of schema tunnel, without the partitions of `BULK` tables and their waiting rows."""
    return set(_columns(conn))


def _below(keys: Mapping[str, list[tuple[str, str]]], root: str) -> set[str]:
    """Return the root and all tables with foreign keys that lead to it."""
    found = {root}
    while more := {name for name, held in keys.items() if name not in found and any(t in found for _, t in held)}:
        found |= more
    return found


def _columns(conn: psycopg.Connection[Any]) -> dict[str, list[tuple[str, str, bool]]]:
    rows = conn.execute(
        """
        SELECT c.relname, a.attname, format_type(a.atttypid, a.atttypmod), a.attidentity <> ''
          FROM pg_class c
          JOIN pg_attribute a ON a.attrelid = c.oid AND a.attnum > 0 AND NOT a.attisdropped AND a.attgenerated = ''
         WHERE c.relnamespace = 'tunnel'::regnamespace AND c.relkind IN ('r', 'p') AND NOT c.relispartition
         ORDER BY c.relname, a.attnum
        """
    ).fetchall()
    found: dict[str, list[tuple[str, str, bool]]] = {}
    for table, *column in rows:
        if not _PIECE.fullmatch(table):
            found.setdefault(table, []).append((column[0], column[1], column[2]))
    return found


def _foreign_keys(conn: psycopg.Connection[Any]) -> dict[str, list[tuple[str, str]]]:
    """Return column and target table of each table's foreign keys, which have one column each."""
    rows = conn.execute(
        """
        SELECT c.conrelid::regclass::text, a.attname, t.relname
          FROM pg_constraint c
          JOIN pg_attribute a ON a.attrelid = c.conrelid AND a.attnum = c.conkey[1]
          JOIN pg_class t ON t.oid = c.confrelid
         WHERE c.connamespace = 'tunnel'::regnamespace AND c.contype = 'f'
         ORDER BY 1, c.conname
        """
    ).fetchall()
    found: dict[str, list[tuple[str, str]]] = {}
    for table, column, target in rows:
        found.setdefault(table.removeprefix("tunnel."), []).append((column, target))
    return found


def _primary_keys(conn: psycopg.Connection[Any]) -> dict[str, tuple[str, ...]]:
    rows = conn.execute(
        """
        SELECT t.relname, array_agg(a.attname::text ORDER BY k.n)
          FROM pg_constraint c
          JOIN pg_class t ON t.oid = c.conrelid
         CROSS JOIN LATERAL unnest(c.conkey) WITH ORDINALITY AS k (attnum, n)
          JOIN pg_attribute a ON a.attrelid = c.conrelid AND a.attnum = k.attnum
         WHERE c.connamespace = 'tunnel'::regnamespace AND c.contype = 'p'
         GROUP BY t.relname
        """
    ).fetchall()
    return {name: tuple(columns) for name, columns in rows}
