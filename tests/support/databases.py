"""Databases of the tests: copies of a template, of which one that nothing was committed in serves the next test as well."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import psycopg
import pytest
from psycopg import sql
from psycopg.conninfo import make_conninfo

from tunneldb.database import connect

SETTINGS = {"track_commit_timestamp": "on", "autovacuum": "off"}
"""Settings by which the copies know of commits: nobody commits but the tests. Autovacuum does when it analyses a table."""

PATIENCE = 5.0
"""Longest wait for closed sessions to end, s: on a busy machine the server notices late that a client has gone."""

BY_FILES = 150_000
"""First version of the server that copies databases block by block, through its log, unless it is asked for files."""

Sequences = dict[tuple[str, str], tuple[int, bool]]

_numbers = itertools.count(1)


def create_database(server_dsn: str, name: str, template: str | None = None) -> None:
    command = sql.SQL("CREATE DATABASE {} TEMPLATE {}").format(sql.Identifier(name), sql.Identifier(template or "template0"))
    with psycopg.connect(server_dsn, autocommit=True) as connection:
        if connection.info.server_version >= BY_FILES:
            command += sql.SQL(" STRATEGY file_copy")
        connection.execute(command)


class Copies:
    """Hands out databases that are as their template is.

    Making and dropping one takes a third of a second. So it is kept if after the test no transaction was committed on the
    server since it was handed out, by whomever, and no session is left in it; sequences, which no rollback sets back, are.
    """

    def __init__(self, server_dsn: str) -> None:
        self.server_dsn = server_dsn
        self._kept: dict[int, str] = {}  # by the template's object id: it may be dropped, and made anew under the same name
        self._sequences: dict[int, Sequences] = {}

    @contextmanager
    def copy(self, template: str) -> Iterator[str]:
        """DSN of a copy for the length of a with block."""
        with psycopg.connect(self.server_dsn, autocommit=True) as server:
            row = server.execute("SELECT oid FROM pg_database WHERE datname = %s", [template]).fetchone()
            assert row is not None, template
            key = row[0]
            name = self._kept.pop(key, None) or self._create(template, key)
            before = _last_commit(server)
        try:
            yield self._dsn(name)
        finally:
            if not self._kept_for_another(name, key, before):
                self._drop(name)

    def _kept_for_another(self, name: str, key: int, before: int | None) -> bool:
        with psycopg.connect(self.server_dsn, autocommit=True) as server:
            untouched = before is not None and _last_commit(server) == before and _empty(server, name)
        if not untouched or key in self._kept:
            return False
        self._set_back(name, key)
        self._kept[key] = name
        return True

    @contextmanager
    def connected(self, template: str) -> Iterator[psycopg.Connection]:
        """Connection to a copy, whose DSN is in TUNNELDB_DSN for commands. What the block does not commit is rolled back."""
        with self.copy(template) as dsn, pytest.MonkeyPatch.context() as patch:
            patch.setenv("TUNNELDB_DSN", dsn)
            with connect(dsn) as connection:
                yield connection
                if not connection.closed:
                    connection.rollback()

    @contextmanager
    def prepared(self, template: str, fill: Callable[[], object]) -> Iterator[str]:
        """Name of a database to be copied: a copy of the template in which commands of ``fill`` were run."""
        name = f"prepared_{next(_numbers)}"
        create_database(self.server_dsn, name, template)
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("TUNNELDB_DSN", self._dsn(name))
            fill()
        yield name
        self._drop(name)

    def _drop(self, name: str) -> None:
        with psycopg.connect(self.server_dsn, autocommit=True) as server:
            server.execute(sql.SQL("DROP DATABASE IF EXISTS {} WITH (FORCE)").format(sql.Identifier(name)))

    def _dsn(self, name: str) -> str:
        return make_conninfo(self.server_dsn, dbname=name)

    def _create(self, template: str, key: int) -> str:
        name = f"test_{next(_numbers)}"
        create_database(self.server_dsn, name, template)
        if key not in self._sequences:
            with psycopg.connect(self._dsn(name), autocommit=True) as connection:
                self._sequences[key] = _sequences(connection)
        return name

    def _set_back(self, name: str, key: int) -> None:
        with psycopg.connect(self._dsn(name), autocommit=True) as connection:
            for sequence, state in _sequences(connection).items():
                if state != self._sequences[key][sequence]:
                    connection.execute(
                        "SELECT setval(format('%%I.%%I', %s::text, %s::text)::regclass, %s, %s)",
                        [*sequence, *self._sequences[key][sequence]],
                    )


def _last_commit(server: psycopg.Connection) -> int | None:
    """The transaction that was committed last in any database of the server; None if the server was started since."""
    row = server.execute("SELECT xid::text::bigint FROM pg_last_committed_xact()").fetchone()
    return row[0] if row else None


def _empty(server: psycopg.Connection, name: str) -> bool:
    """Return True if no session is in a database, within PATIENCE."""
    end = time.monotonic() + PATIENCE
    while server.execute("SELECT count(*) FROM pg_stat_activity WHERE datname = %s", [name]).fetchone() != (0,):
        if time.monotonic() > end:
            return False
        time.sleep(0.01)
    return True


def _sequences(connection: psycopg.Connection) -> Sequences:
    """Value of each sequence, and whether it was handed out."""
    rows = connection.execute(
        "SELECT schemaname, sequencename, coalesce(last_value, start_value), last_value IS NOT NULL FROM pg_sequences"
    )
    return {(schema, name): (value, called) for schema, name, value, called in rows}
