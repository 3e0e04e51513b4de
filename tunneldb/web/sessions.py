"""Sessions of the desk: each has database connections of its own, with the role of the person signed in.

A password is used once, to open the connections, and not kept. So a session whose connections were cut, by a restart of
PostgreSQL, ends, and the person signs in again. The session of the embedded server needs no password and connects again.
"""

from __future__ import annotations

import queue
import secrets
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import psycopg
from psycopg.conninfo import make_conninfo

from tunneldb.database import open_connection
from tunneldb.errors import UserError

Connection = psycopg.Connection[Any]

CONNECTIONS = 3
"""Number of connections of a session: a browser asks for several tiles at once."""

PATIENCE = 20.0
"""Time in which a request waits for a connection of its session, s."""

STATEMENT_TIMEOUT, LOCK_TIMEOUT = "60s", "5s"
"""Limits of a statement of the desk."""

ROLES = ("operator", "inspector", "viewer")
"""Group roles from the one with the most rights."""


class SignedOutError(UserError):
    """Nobody is signed in, or the session has ended."""


class RefusedError(UserError):
    """User and password do not fit, or the role may not read."""


@dataclass
class Session:
    """A person at the desk.

    Attributes
    ----------
    key : str
        Value of the cookie.
    csrf : str
        Token that each request which writes must send.
    user, role : str
        Database role, and the group of ROLES that it is in.
    reopen : callable or None
        Opens a connection anew without a password; None where one is needed.
    used : float
        Time of the last request, by the monotonic clock, s.
    """

    key: str
    csrf: str
    user: str
    role: str
    reopen: Callable[[], Connection] | None
    used: float
    idle: queue.LifoQueue[Connection] = field(default_factory=queue.LifoQueue)

    @contextmanager
    def connection(self) -> Iterator[Connection]:
        """Lend a connection in autocommit mode; raise SignedOutError if it was cut and cannot be opened without a password."""
        try:
            conn = self.idle.get(timeout=PATIENCE)
        except queue.Empty:
            raise UserError("the server is busy: try again") from None
        try:
            if conn.closed:
                if self.reopen is None:
                    raise SignedOutError("the connection to the database was lost: sign in again")
                conn = self.reopen()
            yield conn
        finally:
            self.idle.put(conn)

    def close(self) -> None:
        """Close the connections that are not lent; those that are lent are closed with the process."""
        while True:
            try:
                self.idle.get_nowait().close()
            except queue.Empty:
                return


class Sessions:
    """Sessions by their keys.

    Parameters
    ----------
    idle_limit : float
        Time without a request after which a session ends, s.
    clock : callable
        Returns a time, s.
    """

    def __init__(self, idle_limit: float, clock: Callable[[], float] = time.monotonic) -> None:
        self._idle_limit = idle_limit
        self._clock = clock
        self._lock = threading.Lock()
        self._by_key: dict[str, Session] = {}

    def begin(self, connections: list[Connection], reopen: Callable[[], Connection] | None) -> Session:
        """Begin a session with open connections of one role.

        Raises
        ------
        RefusedError
            If the role may not read the views of tunnel_api.
        """
        user, role = _person(connections[0])
        session = Session(secrets.token_urlsafe(32), secrets.token_urlsafe(32), user, role, reopen, self._clock())
        for conn in connections:
            session.idle.put(conn)
        with self._lock:
            self._end_idle()
            self._by_key[session.key] = session
        return session

    def find(self, key: str | None) -> Session | None:
        """Return the session with a key, and note that it is used; None if there is none."""
        with self._lock:
            self._end_idle()
            session = self._by_key.get(key or "")
            if session is not None:
                session.used = self._clock()
            return session

    def end(self, session: Session) -> None:
        """End a session."""
        with self._lock:
            self._by_key.pop(session.key, None)
        session.close()

    def close(self) -> None:
        """End all sessions."""
        with self._lock:
            ended, self._by_key = list(self._by_key.values()), {}
        for session in ended:
            session.close()

    def _end_idle(self) -> None:
        now = self._clock()
        for key, session in list(self._by_key.items()):
            if now - session.used > self._idle_limit:
                del self._by_key[key]
                session.close()


def open_for(dsn: str, user: str, password: str) -> list[Connection]:
    """Open the connections of a person.

    Raises
    ------
    RefusedError
        If user and password do not fit, or the server does not ask for the password.
    UserError
        If the server cannot be reached.
    """
    if not user or not password or "\0" in user + password:
        raise RefusedError("enter user and password")
    connections: list[Connection] = []
    try:
        for _ in range(CONNECTIONS):
            connections.append(_prepared(_password_connection(dsn, user, password)))
            # A server that trusts its machine would let anybody in as anybody.
            if not connections[-1].pgconn.used_password:
                raise RefusedError(
                    "the database server does not ask for passwords (pg_hba.conf: trust or peer), so nobody can sign in"
                )
    except BaseException:
        for conn in connections:
            conn.close()
        raise
    return connections


def _password_connection(dsn: str, user: str, password: str) -> Connection:
    try:
        return open_connection(make_conninfo(dsn, user=user, password=password))
    except UserError as error:
        text = str(error)
        if any(
            mark in text
            for mark in ("authentication failed", "does not exist", "no pg_hba.conf entry", "not permitted to log in")
        ):
            raise RefusedError("user or password is wrong") from None
        raise


def open_own(dsn: str) -> Connection:
    """Open a connection with the server's own role."""
    return _prepared(open_connection(dsn))


def _prepared(conn: Connection) -> Connection:
    conn.autocommit = True
    conn.execute(
        "SELECT set_config('statement_timeout', %s, false), set_config('lock_timeout', %s, false),"
        " set_config('application_name', 'tunneldb serve', false)",
        [STATEMENT_TIMEOUT, LOCK_TIMEOUT],
    )
    return conn


def _person(conn: Connection) -> tuple[str, str]:
    """Return the name and the group of the role of a connection."""
    row = conn.execute(
        "SELECT session_user::text, array_agg(r ORDER BY n) FILTER (WHERE to_regrole('tunnel_' || r) IS NOT NULL"
        " AND pg_has_role(session_user, to_regrole('tunnel_' || r), 'USAGE')), has_schema_privilege('tunnel_api', 'USAGE')"
        " FROM unnest(%s::text[]) WITH ORDINALITY AS u (r, n)",
        [list(ROLES)],
    ).fetchone()
    assert row is not None
    user, groups, may_read = row
    if not may_read:
        raise RefusedError(f"{user} may not read this database: an operator must grant the role tunnel_viewer")
    return str(user), str(groups[0]) if groups else "viewer"
