"""Worker: a process that runs jobs of the queue, one after the other, until it is asked to exit.

`tunneldb.queue.pool` starts ``python -m tunneldb.queue.worker``; it ends with its parent.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import os
import platform
import random
import signal
import sys
import threading
import time
from collections.abc import AsyncIterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import psycopg

from tunneldb.database.failures import first_line
from tunneldb.errors import UserError
from tunneldb.log import VARIABLE, logging_to
from tunneldb.threads import use_threads

if TYPE_CHECKING:
    from procrastinate.worker import Worker

HEARTBEAT = 5.0
"""Interval between two heartbeats, and between two searches for lost workers, s."""

STALLED = 25.0
"""Time without a heartbeat after which a worker is lost, s."""

GIVE_UP = 900.0
"""Time for which a worker waits for an unavailable server, s."""

log = logging.getLogger("tunneldb.worker")


@dataclass(frozen=True)
class Orders:
    """Orders for a worker.

    Attributes
    ----------
    dsn : str or None
        Database; None for the embedded server.
    threads : int
        Number of threads to compute with.
    survey : int or None
        Survey after whose completion the worker exits; None to run on.
    """

    dsn: str | None
    threads: int = 1
    survey: int | None = None


class _ExitRequest:
    """Request to exit, and the worker of the queue to stop."""

    def __init__(self) -> None:
        self._wanted = asyncio.Event()
        self.worker: Worker | None = None

    def wanted(self) -> bool:
        return self._wanted.is_set()

    def now(self) -> None:
        self._wanted.set()
        self.pause()

    async def wait(self, seconds: float) -> None:
        """Wait, or return early if it is time to exit."""
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(self._wanted.wait(), seconds)

    def pause(self) -> None:
        """End the present connection to the queue after the current job."""
        if self.worker is not None:
            self.worker.stop()  # type: ignore[no-untyped-call]


def work(orders: Orders) -> None:
    """Serve the queue until asked to exit; wait for an unavailable server.

    Raises
    ------
    UserError
        If the server stays unavailable, or its schema is of another version.
    """
    use_threads(orders.threads)
    asyncio.run(_work(orders))


async def _work(orders: Orders) -> None:
    leave = _ExitRequest()
    loop = asyncio.get_running_loop()
    for name in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(name, leave.now)
    away_since: float | None = None
    wait = 0.5
    while not leave.wanted():
        try:
            async with _connected(orders) as (dsn, presence):
                if away_since is not None:
                    log.warning("the database is available again")
                away_since, wait = None, 0.5
                await _serve(orders, leave, dsn, presence)
        except _AWAY as error:
            if leave.wanted():
                return
            if away_since is None:
                away_since = time.monotonic()
                log.warning("the database is unavailable, waiting for it: %s", _line(error))
            if time.monotonic() - away_since > GIVE_UP:
                raise UserError(f"the database has been unavailable for {GIVE_UP / 60:.0f} minutes: {_line(error)}") from None
        await leave.wait(wait * random.uniform(0.7, 1.3))
        wait = min(2 * wait, 15.0)


@contextlib.asynccontextmanager
async def _connected(orders: Orders) -> AsyncIterator[tuple[str, psycopg.AsyncConnection[Any]]]:
    """Yield the DSN of the queue, and the session for the worker's heartbeat."""
    from tunneldb.database.connection import SESSION, resolve_dsn
    from tunneldb.database.schema import require_current_schema
    from tunneldb.database.session import CONNECT, SETTINGS

    def prepare() -> str:
        try:
            dsn = resolve_dsn(orders.dsn)
        except UserError as error:  # the embedded server does not start, perhaps not yet
            raise psycopg.OperationalError(str(error)) from error
        with psycopg.connect(dsn, **CONNECT) as conn:
            require_current_schema(conn)
        return dsn

    dsn = await asyncio.to_thread(prepare)
    async with await psycopg.AsyncConnection.connect(dsn, autocommit=True, **CONNECT) as presence:
        await presence.execute(SESSION)
        await presence.execute(SETTINGS)
        yield dsn, presence


async def _serve(orders: Orders, leave: _ExitRequest, dsn: str, presence: psycopg.AsyncConnection[Any]) -> None:
    """Run jobs until asked to exit, or until the connection to the queue is lost."""
    from procrastinate.worker import Worker

    from tunneldb.queue.jobs import QUEUE, make_app

    tending: list[asyncio.Task[None]] = []

    async def registered(worker: int) -> None:
        await presence.execute("SELECT tunnel_internal.queue_register(%s, %s, %s)", [worker, platform.node(), os.getpid()])
        tending.append(asyncio.create_task(_heartbeat(orders, leave, worker, presence)))

    app = make_app(dsn, orders.dsn, registered, leave.pause)
    async with app.open_async():
        leave.worker = Worker(
            app,
            queues=[QUEUE],
            fetch_job_polling_interval=2.0,
            abort_job_polling_interval=60.0,
            install_signal_handlers=False,
            update_heartbeat_interval=HEARTBEAT,
            stalled_worker_timeout=STALLED,
        )
        try:
            if not leave.wanted():
                await leave.worker.run()  # type: ignore[no-untyped-call]
        finally:
            leave.worker = None
            for task in tending:
                task.cancel()
            await asyncio.gather(*tending, return_exceptions=True)
            with contextlib.suppress(psycopg.OperationalError):
                await presence.execute("SELECT tunnel_internal.queue_rescue()")


async def _heartbeat(orders: Orders, leave: _ExitRequest, worker: int, presence: psycopg.AsyncConnection[Any]) -> None:
    """Send heartbeats, also during the last job; take over jobs of lost workers; check for requests to exit."""
    beat = 0.0
    try:
        while True:
            if time.monotonic() - beat >= HEARTBEAT:
                beat = time.monotonic()
                await presence.execute("SELECT tunnel_queue.procrastinate_update_heartbeat_v1(%s)", [worker])
                await presence.execute("SELECT tunnel_internal.queue_rescue()")
            row = await (
                await presence.execute(
                    "SELECT coalesce((SELECT w.stop FROM tunnel.worker w WHERE w.id = %(worker)s), false),"
                    "       coalesce(NOT tunnel_internal.queue_busy(%(survey)s), false),"
                    "       NOT EXISTS (SELECT FROM tunnel_queue.procrastinate_workers w WHERE w.id = %(worker)s)",
                    {"worker": worker, "survey": orders.survey},
                )
            ).fetchone()
            assert row is not None
            stopped, idle, forgotten = row
            if stopped or idle:
                leave.now()
            elif forgotten:  # it was silent for too long; register again
                leave.pause()
            await asyncio.sleep(1.0)
    except psycopg.OperationalError:
        leave.pause()


def _line(error: BaseException) -> str:
    return first_line(error) or type(error).__name__


def _away() -> tuple[type[Exception], ...]:
    from procrastinate.exceptions import ConnectorException

    return (psycopg.OperationalError, ConnectorException)


_AWAY = _away()


def _end_with_parent() -> None:
    """Exit at once with the parent, whose end closes its side of the pipe on our standard input."""

    def watch() -> None:
        while os.read(0, 1):
            pass
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def main() -> int:
    """Run as a separate process; orders are JSON in the first argument, the DSN is in TUNNELDB_DSN."""
    orders = json.loads(sys.argv[1])
    _end_with_parent()
    logging.basicConfig(format="%(asctime)s worker %(process)d: %(message)s", datefmt="%H:%M:%S")
    logging.getLogger().handlers[0].setLevel(logging.WARNING)  # a log file also gets messages of lower levels
    logging.getLogger("procrastinate").setLevel(logging.CRITICAL + 1)
    logging.getLogger("psycopg.pool").setLevel(logging.CRITICAL + 1)
    file = os.environ.get(VARIABLE)
    try:
        with logging_to(Path(file) if file else None):
            work(Orders(os.environ.get("TUNNELDB_DSN") or None, orders["threads"], orders["survey"]))
    except UserError as error:
        log.error("%s", error)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
