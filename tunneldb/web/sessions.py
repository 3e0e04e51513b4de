"""Sessions of the desk: each has database connections of its own, with the role of the person signed in.

A password is used once, to open the connections, and not kept. So a session whose connections were cut, by a restart of
PostgreSQL, ends, and the person signs in again. The session of the embedded server needs no password and connects again.
"""

from __future__ import annotations

import asyncio
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

MAX_AGE = 12 * 3600.0
"""Time after which a session ends although it is used, s: so a changed password or a locked login is noticed."""

MAX_OF_USER, MAX_SESSIONS = 5, 25
"""Maximum number of sessions of a user, and of all; the one that was not used longest ends. Each holds CONNECTIONS."""

MAX_WAITING = 30
"""Maximum number of requests of a session that wait for a connection; further ones are refused."""

PREPARED = 3
"""Number of times that a connection plans a statement before the plan is kept."""

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
    used, ends : float
        Time of the last request, and time at which the session ends at the latest, by the monotonic clock, s.
    idle : queue
        Connections that are not lent.
    closed : bool
        True if the session has ended.
    waiting : int
        Number of requests that wait for a connection.
    gate : asyncio.Semaphore
        Lets as many requests through as there are connections; the others wait without a thread.
    large_turn : asyncio.Semaphore
        Lets one large answer through, until it is sent.
    upload_turn : asyncio.Lock
        Held while a photo is received and stored.
    """

    key: str
    csrf: str
    user: str
    role: str
    reopen: Callable[[], Connection] | None
    used: float
    ends: float
    idle: queue.LifoQueue[Connection] = field(default_factory=queue.LifoQueue)
    closed: bool = False
    waiting: int = 0
    gate: asyncio.Semaphore = field(default_factory=lambda: asyncio.Semaphore(CONNECTIONS))
    large_turn: asyncio.Semaphore = field(default_factory=lambda: asyncio.Semaphore(1))
    upload_turn: asyncio.Lock = field(default_factory=asyncio.Lock)

    @contextmanager
    def connection(self) -> Iterator[Connection]:
        """Lend a connection in autocommit mode; raise SignedOutError if it was cut and cannot be opened without a password."""
        try:
            conn = self.idle.get(timeout=1.0)
        except queue.Empty:
            raise SignedOutError("sign in") from None
        try:
            if self.closed:
                raise SignedOutError("sign in")
            if conn.closed:
                if self.reopen is None:
                    raise SignedOutError("the connection to the database was lost: sign in again")
                conn = self.reopen()
            yield conn
        finally:
            if self.closed:
                conn.close()
            else:
                self.idle.put(conn)

    def close(self) -> None:
        """Close the connections; those that are lent are closed when they come back."""
        self.closed = True
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

    def begin(
        self, connections: list[Connection], reopen: Callable[[], Connection] | None, max_age: float = MAX_AGE
    ) -> Session:
        """Begin a session with open connections of one role; end the longest unused ones if there are too many.

        Raises
        ------
        RefusedError
            If the role may not read the views of tunnel_api.
        """
        try:
            user, role = _person(connections[0])
        except BaseException:
            for conn in connections:
                conn.close()
            raise
        now = self._clock()
        session = Session(secrets.token_urlsafe(32), secrets.token_urlsafe(32), user, role, reopen, now, now + max_age)
        for conn in connections:
            session.idle.put(conn)
        with self._lock:
            self._end_idle()
            others = sorted(self._by_key.values(), key=lambda other: other.used)
            own = [other for other in others if other.user == user]
            surplus = own[: max(len(own) - MAX_OF_USER + 1, 0)] or others[: max(len(others) - MAX_SESSIONS + 1, 0)]
            for old in surplus:
                del self._by_key[old.key]
                old.close()
            self._by_key[session.key] = session
        return session

    def end_idle(self) -> None:
        """End the sessions that are over."""
        with self._lock:
            self._end_idle()

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
            if now - session.used > self._idle_limit or now > session.ends:
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
    # Planning takes longer than most requests of the desk; its functions choose among the partitions of surveys themselves.
    conn.prepare_threshold = PREPARED
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
