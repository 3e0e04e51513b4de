"""Health of the desk: whether its database answers."""

from __future__ import annotations

import asyncio
import time

import numpy as np
import psycopg
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response

from tunneldb.errors import UserError
from tunneldb.web.sessions import open_own

HEALTH_KEPT = 2.0
"""Time for which the answer to a question for the health is kept, s."""


async def answer(request: Request) -> Response:
    """Return 200 if the database answers, else 503."""
    healthy = await request.app.state.health.ask()
    return PlainTextResponse("ok") if healthy else PlainTextResponse("no database", 503)


class Health:
    """Health of the database. One request at a time asks it; the answer is kept for HEALTH_KEPT.

    Parameters
    ----------
    dsn : str
        Database.
    """

    def __init__(self, dsn: str) -> None:
        self._dsn = dsn
        self._lock = asyncio.Lock()
        self._asked = -np.inf
        self._healthy = False

    async def ask(self) -> bool:
        """Return True if the database answers, or did so within HEALTH_KEPT."""
        async with self._lock:
            if time.monotonic() - self._asked > HEALTH_KEPT:
                self._healthy = await run_in_threadpool(self._answers)
                self._asked = time.monotonic()
            return self._healthy

    def _answers(self) -> bool:
        try:
            with open_own(self._dsn) as conn:
                return conn.execute("SELECT 1").fetchone() == (1,)
        except (UserError, psycopg.Error):
            return False
