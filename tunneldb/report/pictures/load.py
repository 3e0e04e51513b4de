"""Pictures as small data URLs, by processes that are ended at their deadlines."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import time
from collections import deque
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any, Literal

import tunneldb
from tunneldb.report.pictures.addresses import is_web
from tunneldb.report.pictures.trouble import NO_IMAGE, OUT_OF_TIME, TOO_SLOW, UNREADABLE

FETCH_SECONDS, FETCH_TOGETHER = 10.0, 60.0
"""Maximum time for a picture from the web, with names, TLS and redirects, and for all of them, s."""

READ_SECONDS = 30.0
"""Maximum time for a file to be opened, and for a picture to be decoded, s; far more than either needs."""

TOGETHER = 900.0
"""Maximum time for all pictures, s."""

_PROCESSES = 4

Form = Literal["photo", "logo", "upload"]
"""Purpose of a picture."""


@dataclass(frozen=True)
class Source:
    """Place of pictures.

    Attributes
    ----------
    folder : Path
        Folder in which relative paths begin.
    servers : tuple of str
        Servers that may have an internal address and need no encryption, by `addresses.parse_server`.
    confined : bool
        True if files must be in ``folder``.
    """

    folder: Path = field(default_factory=Path)
    servers: tuple[str, ...] = ()
    confined: bool = True


@dataclass(frozen=True)
class Picture:
    """A picture as a data URL, or the reason why there is none; the other of both is empty."""

    url: str
    trouble: str


class _Process:
    """A process that reads and decodes, and what it is at."""

    def __init__(self) -> None:
        ours, theirs = socket.socketpair()
        with theirs:
            # -P and the path: neither a folder of another's files nor another installation is imported from
            root = str(Path(tunneldb.__file__).parents[1])
            path = os.pathsep.join(filter(None, (root, os.environ.get("PYTHONPATH"))))
            self.process = subprocess.Popen(
                [sys.executable, "-P", "-m", "tunneldb.report.pictures.child", str(theirs.fileno())],
                stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                pass_fds=[theirs.fileno()], env=os.environ | {"PYTHONPATH": path},
            )  # fmt: skip
        self.connection = Connection(ours.detach())
        self.path = ""
        self.work: Literal["read", "decode"] | None = None
        self.deadline = 0.0

    def ask(self, work: Literal["read", "decode"], seconds: float, **request: Any) -> None:
        """Send a request, to be answered within some seconds."""
        self.work, self.deadline = work, time.monotonic() + seconds
        with suppress(ConnectionError):  # of a process that has ended, which the missing answer shows
            self.connection.send_bytes(json.dumps({"work": work, "seconds": seconds, **request}).encode())

    def end(self) -> None:
        """End the process and close its connection."""
        self.connection.close()
        self.process.kill()
        self.process.wait()


class _Loader:
    """State of a loading: pictures that wait, processes, and results. Files are read in parallel, and decoded one at a time."""

    def __init__(self, paths: Iterable[str], source: Source, form: Form) -> None:
        self.waiting = deque(dict.fromkeys(paths))
        self.source, self.form = source, form
        self.idle: list[_Process] = []
        self.busy: list[_Process] = []
        self.read: deque[_Process] = deque()
        self.results: dict[str, Picture] = {}
        self.end = time.monotonic() + TOGETHER
        self.fetched_by = time.monotonic() + FETCH_TOGETHER

    def run(self) -> dict[str, Picture]:
        """Load all pictures; returns them by path."""
        try:
            while self.waiting or self.busy or self.read:
                self._start()
                self._receive()
        finally:
            for process in (*self.idle, *self.busy, *self.read):
                process.end()
        return self.results

    def _start(self) -> None:
        """Give work to idle processes."""
        while self.waiting and len(self.busy) + len(self.read) < _PROCESSES:
            path = self.waiting.popleft()
            web = is_web(path)
            seconds = min(self.end, self.fetched_by if web else self.end) - time.monotonic()
            if seconds <= 0.0:
                self.results[path] = Picture("", TOO_SLOW if web else OUT_OF_TIME)
                continue
            process = self.idle.pop() if self.idle else _Process()
            self.busy.append(process)
            process.path = path
            process.ask(
                "read", min(seconds, FETCH_SECONDS if web else READ_SECONDS), path=path, servers=self.source.servers,
                folder=str(self.source.folder.absolute()), confined=self.source.confined,
            )  # fmt: skip
        if self.read and not any(process.work == "decode" for process in self.busy):
            process = self.read.popleft()
            self.busy.append(process)
            process.ask("decode", READ_SECONDS, form=self.form)

    def _receive(self) -> None:
        """Wait for answers until the first deadline, and end processes that are late."""
        if not self.busy:
            return
        first = min(process.deadline for process in self.busy)
        ready = wait([process.connection for process in self.busy], max(0.0, first - time.monotonic()))
        for process in list(self.busy):
            if process.connection in ready:
                self._take(process)
            elif time.monotonic() >= process.deadline:
                self._lose(process, TOO_SLOW if is_web(process.path) and process.work == "read" else OUT_OF_TIME)

    def _take(self, process: _Process) -> None:
        """Take an answer."""
        try:
            answer = json.loads(process.connection.recv_bytes())
        except (EOFError, OSError):  # a decoder that crashed
            self._lose(process, UNREADABLE if process.work == "read" else NO_IMAGE)
            return
        self.busy.remove(process)
        if process.work == "read" and not answer["trouble"]:
            self.read.append(process)
            return
        self.results[process.path] = Picture(answer["url"], answer["trouble"])
        self.idle.append(process)

    def _lose(self, process: _Process, trouble: str) -> None:
        self.busy.remove(process)
        process.end()
        self.results[process.path] = Picture("", trouble)


def load_pictures(paths: Iterable[str], source: Source, form: Form = "photo") -> dict[str, Picture]:
    """Return versions of pictures by path, each read once.

    Parameters
    ----------
    paths : iterable of str
        Files, or web addresses.
    source : Source
    form : {'photo', 'logo', 'upload'}
        Photos are small upright JPEGs, logos PNGs with transparency, uploads large upright JPEGs (`upload.clean_photo`).
    """
    return _Loader(paths, source, form).run()
