"""Databases of the tests: copies of a template, of which one that nothing was committed in serves the next test as well."""

from __future__ import annotations

import itertools
import time
from collections.abc import Iterator
from contextlib import contextmanager

import psycopg
from psycopg import sql
from psycopg.conninfo import make_conninfo

SETTINGS = {"track_commit_timestamp": "on"}
"""Settings of the server by which the copies know of commits."""

Sequences = dict[tuple[str, str], tuple[int, bool]]

_numbers = itertools.count(1)


def create_database(server_dsn: str, name: str, template: str | None = None) -> None:
    command = sql.SQL("CREATE DATABASE {} TEMPLATE {}").format(sql.Identifier(name), sql.Identifier(template or "template0"))
    with psycopg.connect(server_dsn, autocommit=True) as connection:
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
            with psycopg.connect(self.server_dsn, autocommit=True) as server:
                if before is not None and _last_commit(server) == before and _empty(server, name) and key not in self._kept:
                    self._set_back(name, key)
                    self._kept[key] = name
                else:
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
    """Whether nobody is in a database; a session that was just closed takes a moment to go."""
    for _ in range(10):
        if server.execute("SELECT count(*) FROM pg_stat_activity WHERE datname = %s", [name]).fetchone() == (0,):
            return True
        time.sleep(0.01)
    return False


def _sequences(connection: psycopg.Connection) -> Sequences:
    """Value of each sequence, and whether it was handed out."""
    rows = connection.execute(
        "SELECT schemaname, sequencename, coalesce(last_value, start_value), last_value IS NOT NULL FROM pg_sequences"
    )
    return {(schema, name): (value, called) for schema, name, value, called in rows}
