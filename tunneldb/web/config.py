"""Settings and state of a running desk."""

from __future__ import annotations

import secrets
from dataclasses import dataclass, field
from pathlib import Path

from tunneldb.web.basic import BasicSessions
from tunneldb.web.block_cache import BlockCache
from tunneldb.web.rate_limit import RateLimit
from tunneldb.web.sessions import Sessions

IDLE_LIMIT = 1800.0
"""Time without a request after which a session ends, s."""


@dataclass
class Desk:
    """State of the server.

    Attributes
    ----------
    dsn : str
        Database.
    token : str or None
        Token of one use that lets the person who started the server in; None where people sign in with a password.
    loopback : bool
        True if only this machine is served.
    secure : bool
        True if cookies are sent by TLS only.
    photos : Path or None
        Folder of uploaded photos; None if they are stored in the database.
    """

    dsn: str
    token: str | None
    loopback: bool = True
    secure: bool = False
    photos: Path | None = None
    sessions: Sessions = field(default_factory=lambda: Sessions(IDLE_LIMIT))
    limit: RateLimit = field(default_factory=RateLimit)
    blocks: BlockCache = field(default_factory=BlockCache)

    def __post_init__(self) -> None:
        self.basic = BasicSessions(self.sessions, self.limit)

    def take_token(self, offered: str) -> bool:
        """Return True if this is the token, which is then used up."""
        if self.token is None or not secrets.compare_digest(self.token.encode(), offered.encode()):
            return False
        self.token = ""
        return bool(offered)
