"""HTTP connections that do not wait for ever."""

from __future__ import annotations

import asyncio
import resource
from typing import cast

from uvicorn.protocols.http.h11_impl import H11Protocol

FIRST_REQUEST = 10.0
"""Time within which the first request of a connection must arrive, s."""

READ_SECONDS, MIN_READ = 60.0, 50_000
"""Time within which the other side must take so many bytes of an answer that waits for it, s."""


class PunctualProtocol(H11Protocol):
    """Connection that is closed if its first request does not arrive in time, or its answers are not taken.

    It would hold a file descriptor, and the answers in memory.
    """

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begin to wait for the first request."""
        super().connection_made(cast(asyncio.Transport, transport))
        self._deadline = self.loop.call_later(FIRST_REQUEST, self._check)

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop waiting."""
        self._deadline.cancel()
        super().connection_lost(exc)

    def pause_writing(self) -> None:
        """Begin to wait for the other side to read."""
        super().pause_writing()
        self._expect_reader()

    def resume_writing(self) -> None:
        """Stop waiting for the other side."""
        self._deadline.cancel()
        super().resume_writing()

    def _expect_reader(self) -> None:
        self._deadline.cancel()
        self._deadline = self.loop.call_later(READ_SECONDS, self._check_reader, self.transport.get_write_buffer_size())

    def _check_reader(self, unsent: int) -> None:
        if self.transport.get_write_buffer_size() > unsent - MIN_READ:
            self.transport.abort()
        else:
            self._expect_reader()

    def _check(self) -> None:
        request = cast(object, self.cycle)  # None until the first one has arrived
        if request is None and not self.transport.is_closing():
            self.transport.close()


def raise_file_limit() -> None:
    """Permit as many open files and connections as the system does."""
    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))
