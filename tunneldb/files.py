"""Files that are there whole or not at all, and what they are called together."""

from __future__ import annotations

import os
import re
import signal
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

from tunneldb.errors import UserError

_PLAIN = re.compile(r"[^A-Za-z0-9_]+")


def require_regular(path: Path) -> None:
    """Refuse a path at which there is something other than a file or a folder: a device, a pipe, a socket.

    Raises
    ------
    UserError
        Which says what it is.
    """
    try:
        there = path.exists()
    except OSError as error:  # its name is too long, its folder closed
        raise UserError(f"{path.name[:40]}{'…' if len(path.name) > 40 else ''}: {error.strerror}") from None
    if there and not path.is_file() and not path.is_dir():
        kinds = {"a pipe": path.is_fifo(), "a socket": path.is_socket()}
        kind = next((name for name, held in kinds.items() if held), "a device")
        raise UserError(f"{path} is {kind}, not a file")


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a temporary path beside ``path`` to write to; it takes the place of ``path`` when the block succeeds.

    The temporary path has the suffix of ``path`` and doesn't exist yet.

    Raises
    ------
    UserError
        If the folder doesn't exist or can't be written to, the disk is full, or there is something that is no file.
    """
    require_regular(path)
    try:
        with tempfile.TemporaryDirectory(prefix=f".{path.stem}-", dir=path.parent) as folder:
            temporary = Path(folder) / path.name
            yield temporary
            os.replace(temporary, path)  # noqa: PTH105 - the point is that it is atomic
    except OSError as error:
        raise UserError(f"{path}: cannot be written: {error.strerror or error}") from error


@contextmanager
def told_to_end() -> Iterator[None]:
    """Leave by an exception at SIGTERM, as at Ctrl-C, so that what is half-written is removed."""

    def end(number: int, frame: FrameType | None) -> None:
        raise SystemExit(128 + number)

    before = signal.signal(signal.SIGTERM, end)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def make_folder(path: Path) -> None:
    """Make a folder and those above it, if they are not there.

    Raises
    ------
    UserError
        If it can't be made.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"{path}: the folder cannot be made: {error.strerror}") from error


def by_kilometre(path: Path, kilometres: Sequence[int]) -> list[Path]:
    """Names of files that there is one of for each kilometre: the path itself for a single one, else with its number."""
    if len(kilometres) == 1:
        return [path]
    return [path.with_name(f"{path.stem}-km{km:03d}{path.suffix}") for km in kilometres]


def common_name(paths: Sequence[Path]) -> str:
    """What the names of files begin with, without numbers that tell them apart, in letters that a tunnel's name may have."""
    stems = [path.name.split(".", 1)[0] for path in paths]
    same = [len(set(letters)) == 1 for letters in zip(*stems, strict=False)]
    common = stems[0][: same.index(False) if False in same else len(same)]
    return _PLAIN.sub("-", common).strip("-_0123456789" if len(stems) > 1 else "-_") or "tunnel"
