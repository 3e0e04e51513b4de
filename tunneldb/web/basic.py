"""Sign in by HTTP Basic, for programs that read tiles and features, such as QGIS."""

from __future__ import annotations

import base64
import binascii
import hashlib
import hmac
import secrets
import threading

from tunneldb.web.rate_limit import RateLimit
from tunneldb.web.sessions import RefusedError, Session, Sessions, open_for

MAX_AGE = 600.0
"""Time after which a password is checked again, s."""


class BasicSessions:
    """Sessions of programs: user and password, which come with each request, find the session that they began.

    Of a password only a keyed hash is kept.

    Parameters
    ----------
    sessions : Sessions
    limit : RateLimit
    """

    def __init__(self, sessions: Sessions, limit: RateLimit) -> None:
        self._sessions = sessions
        self._limit = limit
        self._secret = secrets.token_bytes(32)
        self._lock = threading.Lock()
        self._keys: dict[str, str] = {}

    def session(self, dsn: str, header: str, address: str) -> Session:
        """Return the session of an Authorization header.

        Raises
        ------
        RefusedError
            If user and password do not fit, or there were too many failures.
        """
        user, password = _credentials(header)
        digest = hmac.new(self._secret, f"{user}\0{password}".encode(), hashlib.sha256).hexdigest()
        with self._lock:  # one sign-in at a time: a program asks for many tiles at once
            session = self._sessions.find(self._keys.get(digest))
            if session is not None:
                return session
            if not self._limit.attempt(user, address):
                raise RefusedError("too many failed attempts: wait a minute")
            session = self._sessions.begin(open_for(dsn, user, password), None, MAX_AGE)
            self._limit.succeeded(user, address)
            self._keys = {known: key for known, key in self._keys.items() if self._sessions.find(key) is not None}
            self._keys[digest] = session.key
            return session


def _credentials(header: str) -> tuple[str, str]:
    scheme, _, value = header.partition(" ")
    try:
        user, colon, password = base64.b64decode(value, validate=True).decode().partition(":")
    except (binascii.Error, UnicodeDecodeError):
        scheme = colon = ""
    if scheme.lower() != "basic" or not colon:
        raise RefusedError("the header Authorization is not one of HTTP Basic")
    return user, password
