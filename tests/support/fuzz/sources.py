"""What may be in the place of a file and never ends, or never begins; and a server of photos that drips."""

from __future__ import annotations

import itertools
import os
import random
import socket
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

HUGE = 1 << 40
"""Bytes of a file that is nearly all hole."""

Maker = Callable[[Path, bytes], None]


def _silent_pipe(path: Path, data: bytes) -> None:
    os.mkfifo(path)


def _begun_pipe(path: Path, data: bytes) -> None:
    """Make a pipe that has the beginning of the file, and no end: the descriptor stays open in the case's process."""
    os.mkfifo(path)
    os.write(os.open(path, os.O_RDWR | os.O_NONBLOCK), data[:4096])


def _socket(path: Path, data: bytes) -> None:
    with socket.socket(socket.AF_UNIX) as made:
        here = Path.cwd()
        os.chdir(path.parent)  # a socket's path has at most 107 bytes
        made.bind(path.name)
        os.chdir(here)


def _hole(path: Path, data: bytes) -> None:
    path.write_bytes(data)
    os.truncate(path, HUGE)


def _hole_first(path: Path, data: bytes) -> None:
    path.touch()
    os.truncate(path, HUGE)


def _folder(path: Path, data: bytes) -> None:
    path.mkdir()


def _link(target: str) -> Maker:
    return lambda path, data: path.symlink_to(target)


SOURCES: dict[str, Maker] = {
    "pipe": _silent_pipe,
    "pipe with a beginning": _begun_pipe,
    "socket": _socket,
    "hole after it": _hole,
    "hole": _hole_first,
    "folder": _folder,
    **{
        target: _link(target)
        for target in (
            "/dev/zero", "/dev/urandom", "/dev/full", "/dev/stdin", "/proc/kcore", "/proc/kmsg", "/proc/self/mem",
            "/proc/self/environ", "/proc/self/maps", "/sys/kernel/notes", "/", "nowhere",
        )
    },
}  # fmt: skip


def make_source(chance: random.Random, path: Path, data: bytes) -> str:
    """Put a source in the place of a file with such data; return what it is."""
    name = chance.choice(list(SOURCES))
    SOURCES[name](path, data)
    return name


def serve_drips(listening: socket.socket) -> None:
    """Send to whoever connects a byte of an answer now and then, for good."""
    connections: list[tuple[socket.socket, itertools.cycle[int]]] = []
    listening.settimeout(0.1)
    for answer in itertools.cycle(ANSWERS):
        with suppress(TimeoutError):
            connections.append((listening.accept()[0], itertools.cycle(answer)))
        for connection, letters in connections:
            with suppress(OSError):
                connection.sendall(bytes([next(letters)]))


ANSWERS = (
    b"HTTP/1.1 200 OK\r\nContent-Length: 100000\r\n\r\n" + b"x" * 90_000,
    b"HTTP/1.1 200 OK\r\n" + b"A: x\r\n" * 10_000,
    b"HTTP/1.1 100 Continue\r\n\r\n",
)
