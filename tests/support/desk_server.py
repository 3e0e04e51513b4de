"""The desk as a server of its own: it stops and starts as one does, with the sessions of people gone."""

from __future__ import annotations

import socket
import threading
import time

import uvicorn

from tunneldb.web.app import create_app
from tunneldb.web.config import Desk
from tunneldb.web.protocol import PunctualProtocol

PATIENCE = 30.0


class DeskServer:
    """Server on a free port, which it keeps over a restart.

    Parameters
    ----------
    dsn : str
        Database.
    """

    def __init__(self, dsn: str) -> None:
        self._dsn = dsn
        with socket.create_server(("127.0.0.1", 0)) as listener:
            self._port = listener.getsockname()[1]
        self.start()

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self._port}"

    def start(self) -> None:
        app = create_app(Desk(self._dsn, None))
        config = uvicorn.Config(
            app, http=PunctualProtocol, port=self._port, log_level="warning", access_log=False, timeout_graceful_shutdown=1
        )
        self._server = uvicorn.Server(config)
        self._thread = threading.Thread(target=self._server.run, daemon=True)
        self._thread.start()
        end = time.monotonic() + PATIENCE
        while not self._server.started:
            assert time.monotonic() < end, "the desk does not start"
            time.sleep(0.02)

    def stop(self) -> None:
        self._server.should_exit = True
        self._thread.join(PATIENCE)
        assert not self._thread.is_alive()
