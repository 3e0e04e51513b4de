"""HTTP connections that do not wait for ever."""

from __future__ import annotations

import asyncio
import resource
from typing import cast

from uvicorn.protocols.http.h11_impl import H11Protocol

FIRST_REQUEST = 10.0
"""Time within which the first request of a connection must arrive, s."""


class PunctualProtocol(H11Protocol):
    """Connection that is closed if its first request does not arrive in time: it would hold a file descriptor."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begin to wait for the first request."""
        super().connection_made(cast(asyncio.Transport, transport))
        self._deadline = self.loop.call_later(FIRST_REQUEST, self._check)

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop waiting."""
        self._deadline.cancel()
        super().connection_lost(exc)

    def _check(self) -> None:
        request = cast(object, self.cycle)  # None until the first one has arrived
        if request is None and not self.transport.is_closing():
            self.transport.close()


def raise_file_limit() -> None:
    """Permit as many open files and connections as the system does."""
    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))
