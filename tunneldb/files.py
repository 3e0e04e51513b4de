"""Files that are there whole or not at all, and what they are called together."""

from __future__ import annotations

import errno
import os
import re
import signal
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
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
        with tempfile.TemporaryDirectory(prefix=f".{path.stem[:60]}-", dir=path.parent) as folder, room_told(Path(folder)):
            temporary = Path(folder) / path.name
            yield temporary
            os.replace(temporary, path)  # noqa: PTH105 - the point is that it is atomic
    except OSError as error:
        raise UserError(f"{path}: cannot be written: {error.strerror or error}") from error


@contextmanager
def room_told(folder: Path) -> Iterator[None]:
    """Raise the system's own error where a library that writes into a folder fails because its disk is full.

    GDAL and SQLite have words of their own for it, and it depends on the format and the moment which.

    Raises
    ------
    OSError
        ENOSPC or EDQUOT.
    """
    try:
        yield
    except Exception as error:
        nameless = isinstance(error, OSError) and error.errno is None  # as NumPy's, of bytes that were not written
        if nameless or type(error).__module__.split(".", 1)[0] in _WRITERS:
            if any(word in str(error) for word in _FULL):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(folder)) from error
            _require_room(folder)
        raise


_WRITERS = {"lazrs", "pyogrio", "rasterio", "sqlite3"}
_FULL = ("disk is full", "No space left")
_ROOM = 1 << 20
"""Bytes for which there is no room where a file could not be written for want of it."""


def _require_room(folder: Path) -> None:
    """Write what is taken away again, for a disk, and a quota, too, show only so whether they are full."""
    with tempfile.TemporaryFile(dir=folder, buffering=0) as file:
        block = memoryview(bytes(_ROOM))
        while block:
            block = block[file.write(block) :]


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


@contextmanager
def made_folder(path: Path) -> Iterator[None]:
    """Make a folder and those above it, if they are not there; take those away again that are empty when the block fails.

    Raises
    ------
    UserError
        If it can't be made.
    """
    made = [folder for folder in (path, *path.parents) if not os.path.exists(folder)]  # noqa: PTH110 - fails for no name
    try:
        try:
            path.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise UserError(f"{path}: the folder cannot be made: {error.strerror}") from error
        yield
    except BaseException:
        for folder in made:
            with suppress(OSError):  # it was not made, or holds what was whole by then
                folder.rmdir()
        raise


def vector_source(path: Path) -> str:
    """Return what GDAL is to open for a file of shapes, as the format that its first bytes are of.

    GDAL goes by the content, whatever a file is called: in a.geojson there may be a VRT, or a pipeline of GDAL's own, which
    reads other files, and what lies on the web.

    Raises
    ------
    UserError
        If it cannot be read, or is none of GeoPackage, GeoJSON, Shapefile and FlatGeobuf.
    """
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD)
    except OSError as error:
        raise UserError(f"{path}: cannot be read: {error.strerror}") from None
    if head.removeprefix(b"\xef\xbb\xbf").lstrip().startswith(b"{"):
        return f"GeoJSON:{path}"
    if not head.startswith((b"SQLite format 3\0", b"fgb\x03", b"\0\0\x27\x0a")):
        raise UserError(f"{path}: cannot be read: by its content it is no GeoPackage, GeoJSON, Shapefile or FlatGeobuf")
    return str(path)


_HEAD = 1024


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
