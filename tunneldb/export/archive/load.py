"""A survey out of an archive, in one transaction: nobody sees any of it before its end."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import psycopg
from psycopg import sql

from tunneldb.database.failures import first_line
from tunneldb.database.schema import HEAD
from tunneldb.errors import InputError
from tunneldb.export.archive.container import ArchiveReader, Manifest
from tunneldb.progress import StartProgress
from tunneldb.stages.ledger import stage_run
from tunneldb.store.archive.into import (
    attach_images,
    attach_points,
    insert_rows,
    load_audit,
    load_images,
    load_points,
    make_images,
    stage_rows,
)
from tunneldb.store.archive.numbers import (
    keeps_numbers,
    number_others,
    number_rows,
    number_shared,
    renumber_ledger,
)
from tunneldb.store.archive.out import AUDIT, OTHERS, member_name, without_survey
from tunneldb.store.archive.tables import BULK, Column, Table, archive_tables
from tunneldb.store.archive.tunnels import existing_tunnel, use_tunnel
from tunneldb.store.catalog import make_layers, require_new_survey, require_new_tunnel, survey_exists

_MISFITS = (
    psycopg.DataError,
    psycopg.IntegrityError,
    psycopg.errors.ProtocolViolation,  # a row that ends too early
    psycopg.errors.InternalError_,  # of PostGIS, for bytes that are no geometry
)
"""Errors of the server for rows that it cannot have written."""


@dataclass
class Loaded:
    """Result of an import.

    Attributes
    ----------
    survey, tunnel : str
    survey_id : int
        The survey's number here.
    new_tunnel : bool
        True if its tunnel was added.
    kept : bool
        True if all rows kept their numbers, as in the database that they came from.
    rows : dict
        Rows by table.
    left_out : dict
        Rows of comparisons with surveys that are not here, by table.
    kilometres : list of int
        Kilometres with points.
    notes : list of str
    """

    survey: str
    tunnel: str
    survey_id: int = 0
    new_tunnel: bool = True
    kept: bool = False
    rows: dict[str, int] = field(default_factory=dict)
    left_out: dict[str, int] = field(default_factory=dict)
    kilometres: list[int] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def load_survey(conn: psycopg.Connection[Any], path: Path, name: str | None, begin: StartProgress) -> Loaded:
    """Import a survey into the database, completely or not at all.

    Points and images go into tables that nobody else sees; shared tables are locked only at the end.

    Parameters
    ----------
    conn : Connection
        Idle.
    path : Path
        An archive that `save_survey` wrote.
    name : str or None
        New name of the survey; None for its own name.
    begin : callable
        Called with each member that begins; returns a function that takes its bytes.

    Raises
    ------
    InputError
        If the file is no archive, is damaged, has another schema, or does not fit this database. Nothing is changed then.
    """
    conn.rollback()
    with ArchiveReader(path) as archive:
        _require_schema(archive)
        try:
            with conn.transaction():
                loaded = _Loading(conn, archive, name or archive.manifest.survey, begin).run()
        except _MISFITS as error:
            if error.diag.constraint_name == "survey_name_key":  # another brought it in meanwhile
                raise survey_exists(name or archive.manifest.survey) from None
            raise archive.wrong(f"its rows are inconsistent: {first_line(error)}") from None
    conn.commit()
    _note(conn, loaded, archive)
    return loaded


def _note(conn: psycopg.Connection[Any], loaded: Loaded, archive: ArchiveReader) -> None:
    """Enter into the ledger that the survey was imported."""
    manifest = archive.manifest
    parameters = {
        "file": archive.path.name,
        "survey": manifest.survey,
        "exported_at": manifest.exported_at,
        "tunneldb": manifest.tunneldb,
    }
    with stage_run(conn, loaded.survey_id, None, "import", parameters) as run:
        run.counts["rows"] = sum(loaded.rows.values())


def _require_schema(archive: ArchiveReader) -> None:
    """Refuse rows of another schema: reading columns by name does not replace a migration."""
    manifest = archive.manifest
    if manifest.schema != HEAD:
        raise InputError(
            f"{archive.path} has schema {manifest.schema}, but this version of tunneldb needs {HEAD}: import the file"
            f" with tunneldb {manifest.tunneldb} into a separate database, upgrade that database with this version"
            " (tunneldb init), and export the survey again"
        )


class _Loading:
    """Steps of an import, which share the tables, the archive and the counts."""

    def __init__(self, conn: psycopg.Connection[Any], archive: ArchiveReader, name: str, begin: StartProgress) -> None:
        self.conn, self.archive, self.begin = conn, archive, begin
        self.manifest: Manifest = archive.manifest
        self.tables: Sequence[Table] = archive_tables(conn)
        self.by_name: Mapping[str, Table] = {table.name: table for table in self.tables}
        self.loaded = Loaded(name, self.manifest.tunnel)

    def run(self) -> Loaded:
        require_new_survey(self.conn, self.loaded.survey)
        bulk = self._members()
        self._stage()
        self._number()
        images = make_images(self.conn, self.loaded.survey_id)
        for table, km in bulk:
            self._load(table, km, images)
        self._insert()
        attach_images(self.conn, self.loaded.survey_id, images)
        self._settle()
        attach_points(self.conn, self.loaded.survey_id, self.loaded.kilometres)
        if self.loaded.new_tunnel:
            make_layers(self.conn)  # last, for others who add a tunnel wait for it
        return self.loaded

    def _members(self) -> list[tuple[str, int]]:
        """Return the kilometres with points and images; refuse members that are missing, unknown, or have other columns."""
        wanted: dict[str, Sequence[Column]] = {member_name(t.name, None): t.columns for t in self.tables if t.name not in BULK}
        wanted |= {member_name("audit", None): AUDIT}
        wanted |= {member_name(name, None): columns for name, columns in OTHERS.items()}
        bulk = []
        for member in self.manifest.members:
            if found := re.fullmatch(r"(point|image)/km(-?\d{1,6})\.zst", member):
                bulk.append((found[1], int(found[2])))
                wanted[member] = without_survey(self.by_name[found[1]])
        strange = sorted(set(wanted) ^ set(self.manifest.members))
        if strange:
            raise self.archive.wrong(f"{strange[0][:80]!r} is missing, or unknown in an archive")
        for member, columns in wanted.items():
            if self.manifest.members[member].columns != tuple((c.name, c.type) for c in columns):
                raise self.archive.wrong(f"{member} has other columns than schema {HEAD}")
        return sorted(bulk)

    def _chunks(self, member: str) -> Iterator[bytes]:
        progress = self.begin(member, self.manifest.members[member].bytes)
        for chunk in self.archive.chunks(member):
            progress(len(chunk))
            yield chunk

    def _counted(self, member: str, rows: int) -> int:
        if rows != self.manifest.members[member].rows:
            raise self.archive.wrong(f"{member} has {rows} rows, but the manifest says {self.manifest.members[member].rows}")
        return rows

    def _stage(self) -> None:
        small = [(t.name, t.columns) for t in self.tables if t.name not in BULK]
        for table, columns in (*small, ("audit", AUDIT), *OTHERS.items()):
            member = member_name(table, None)
            self._counted(member, stage_rows(self.conn, table, columns, self._chunks(member)))
        for table, key in (("survey", self.manifest.survey_id), ("tunnel", self.manifest.tunnel_id)):
            rows = self.conn.execute(
                sql.SQL("SELECT id FROM {}").format(sql.Identifier("pg_temp", f"archive_{table}"))
            ).fetchall()
            if rows != [(key,)]:
                raise self.archive.wrong(f"it does not have exactly one {table}")

    def _number(self) -> None:
        """Find or make the tunnel, and give all rows their numbers."""
        manifest = self.manifest
        self.conn.execute("UPDATE pg_temp.archive_survey SET name = %s", [self.loaded.survey])
        tunnels = [t for t in self.tables if t.role == "tunnel"]
        mine = [t for t in self.tables if t.role == "survey" and t.name not in BULK]
        there = existing_tunnel(self.conn, manifest.tunnel)
        self.loaded.new_tunnel = there is None
        if there is None:
            name = self.conn.execute("SELECT name, srid FROM pg_temp.archive_tunnel").fetchone()
            assert name is not None
            require_new_tunnel(self.conn, str(name[0]), int(name[1]))
            if name[0] != manifest.tunnel:
                raise self.archive.wrong("its tunnel has two names")
            mine = [*tunnels, *mine]
        else:
            self.loaded.notes += use_tunnel(self.conn, there, manifest.tunnel)
        keep = self.loaded.survey == manifest.survey and keeps_numbers(self.conn, mine, manifest.survey)
        number_rows(self.conn, mine, keep=keep)
        number_shared(self.conn, self.by_name)
        number_others(self.conn)
        renumber_ledger(self.conn, keep=keep)
        self.loaded.kept = keep
        row = self.conn.execute("SELECT new FROM pg_temp.map_survey").fetchone()
        assert row is not None
        self.loaded.survey_id = int(row[0])

    def _load(self, table: str, km: int, images: sql.Identifier) -> None:
        member, columns = member_name(table, km), without_survey(self.by_name[table])
        if table == "image":
            rows = load_images(self.conn, images, columns, self._chunks(member))
        else:
            rows = load_points(self.conn, self.loaded.survey_id, km, self.by_name[table], columns, self._chunks(member))
            self.loaded.kilometres.append(km)
        self.loaded.rows[table] = self.loaded.rows.get(table, 0) + self._counted(member, rows)

    def _insert(self) -> None:
        for table in self.tables:
            if table.name in BULK or table.role == "shared" or (table.role == "tunnel" and not self.loaded.new_tunnel):
                continue
            done, left = insert_rows(self.conn, table, self.manifest.survey_id, self.loaded.survey_id)
            self.loaded.rows[table.name] = done
            if left:
                self.loaded.left_out[table.name] = left
        if not self.loaded.kept:
            self.loaded.rows["audit"] = load_audit(self.conn, self.loaded.survey_id)

    def _settle(self) -> None:
        """Update what the triggers have only marked."""
        self.conn.execute(
            "SELECT tunnel_internal.keep_waterproof(%s, w.km)"
            " FROM (SELECT DISTINCT km FROM tunnel.waterproof WHERE survey_id = %s) w",
            [self.loaded.survey_id, self.loaded.survey_id],
        )
