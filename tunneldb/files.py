"""Files written completely or not at all, and common names of several files."""

from __future__ import annotations

import errno
import os
import re
import signal
import sqlite3
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from types import FrameType

from tunneldb.errors import UserError

MAX_JSON_MEGABYTES = 200
"""Maximum size of a GeoJSON file, which is read as a whole; GDAL has the same limit for an object."""

_PLAIN = re.compile(r"[^A-Za-z0-9_]+")


def require_regular(path: Path) -> None:
    """Refuse a path at which there is a device, a pipe, a socket or a file of the kernel instead of a file or a folder.

    Files in /proc and /sys have no size, and some never end.

    Raises
    ------
    UserError
        Names the path and its type.
    """
    try:
        there = path.exists()
    except OSError as error:  # name too long, or no access to the folder
        raise UserError(f"{path.name[:40]}{'…' if len(path.name) > 40 else ''}: {error.strerror}") from None
    if there and not path.is_file() and not path.is_dir():
        kinds = {"a pipe": path.is_fifo(), "a socket": path.is_socket()}
        kind = next((name for name, matches in kinds.items() if matches), "a device")
        raise UserError(f"{path} is {kind}, not a file")
    if there and path.resolve().parts[1:2] in (("proc",), ("sys",)):
        raise UserError(f"{path} is in a folder of the kernel, not a file on disk")


def require_at_most(path: Path, megabytes: int, noun: str) -> None:
    """Refuse a file that is too large to be read as a whole.

    Raises
    ------
    UserError
        Names the size and the limit.
    OSError
        If it cannot be looked at.
    """
    size = path.stat().st_size / 1e6
    if size > megabytes:
        raise UserError(f"{path} has {size:.0f} MB; {noun} has at most {megabytes} MB")


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary path beside ``path`` to write to; it replaces ``path`` when the block succeeds.

    The temporary path has the suffix of ``path`` and doesn't exist yet.

    Raises
    ------
    UserError
        If the folder doesn't exist or can't be written to, the disk is full, or ``path`` is not a regular file.
    """
    require_regular(path)
    try:
        with (
            tempfile.TemporaryDirectory(prefix=f".{path.stem[:60]}-", dir=path.parent) as folder,
            disk_full_as_oserror(Path(folder)),
        ):
            temporary = Path(folder) / path.name
            yield temporary
            os.replace(temporary, path)  # noqa: PTH105 - the point is that it is atomic
    except OSError as error:
        raise UserError(f"{path}: cannot be written: {error.strerror or error}") from error


@contextmanager
def disk_full_as_oserror(folder: Path) -> Iterator[None]:
    """Raise the system's own error if a library fails to write into a folder because the disk is full.

    GDAL and SQLite report a full disk with messages of their own, which depend on format and moment.

    Raises
    ------
    OSError
        ENOSPC or EDQUOT.
    """
    try:
        yield
    except Exception as error:
        nameless = isinstance(error, OSError) and error.errno is None  # for example NumPy's, about bytes that were not written
        if nameless or type(error).__module__.split(".", 1)[0] in _WRITERS:
            if any(word in str(error) for word in _FULL):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(folder)) from error
            _require_room(folder)
        raise


_WRITERS = {"lazrs", "pyogrio", "rasterio", "sqlite3", "zlib"}
_FULL = ("disk is full", "No space left")
_TEST_BYTES = 1 << 20
"""Bytes for the test of free space after a file could not be written."""


def _require_room(folder: Path) -> None:
    """Write and remove a test file, since only writing shows whether a disk or a quota is full."""
    with tempfile.TemporaryFile(dir=folder, buffering=0) as file:
        block = memoryview(bytes(_TEST_BYTES))
        while block:
            block = block[file.write(block) :]


@contextmanager
def exit_on_sigterm() -> Iterator[None]:
    """Exit by an exception on SIGTERM, as on Ctrl-C, so that incomplete files are removed."""

    def end(number: int, frame: FrameType | None) -> None:
        raise SystemExit(128 + number)

    before = signal.signal(signal.SIGTERM, end)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


@contextmanager
def made_folder(path: Path) -> Iterator[None]:
    """Make a folder and its parents if they do not exist; remove those that are empty if the block fails.

    Raises
    ------
    UserError
        If the folder cannot be made.
    """
    made = [folder for folder in (path, *path.parents) if not os.path.exists(folder)]  # noqa: PTH110 - never raises
    try:
        try:
            path.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise UserError(f"{path}: the folder cannot be made: {error.strerror}") from error
        yield
    except BaseException:
        for folder in made:
            with suppress(OSError):  # not made, or contains complete files
                folder.rmdir()
        raise


def vector_source(path: Path) -> str:
    """Return the source that GDAL is to open for a file of shapes, with the driver that its first bytes show.

    By default GDAL chooses the driver by content, whatever the file's name: a.geojson could contain a VRT or a GDAL pipeline,
    which reads other files or web addresses.

    Raises
    ------
    UserError
        If it cannot be read, or is not a GeoPackage, GeoJSON, Shapefile or FlatGeobuf; if a GeoPackage has views; or if a
        Shapefile is truncated or its .shx is missing.
    """
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD)
    except OSError as error:
        raise UserError(f"{path} cannot be read: {error.strerror}") from None
    if head.removeprefix(b"\xef\xbb\xbf").lstrip().startswith(b"{"):
        require_at_most(path, MAX_JSON_MEGABYTES, "a file of GeoJSON")
        return f"GeoJSON:{path}"
    if head.startswith(_SQLITE):
        _require_tables(path)
    elif not head.startswith((b"fgb\x03", _SHAPEFILE)):
        raise UserError(f"{path} cannot be read: its content is not a GeoPackage, GeoJSON, Shapefile or FlatGeobuf")
    if head.startswith(_SHAPEFILE):
        _require_whole_shapefile(path, head)
    return str(path)


_HEAD = 1024
_SHAPEFILE = b"\0\0\x27\x0a"
_SQLITE = b"SQLite format 3\0"


def _require_tables(path: Path) -> None:
    """Refuse a GeoPackage with views, also in place of its catalogue: a recursive one never ends."""
    try:
        with closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True)) as file:
            views = file.execute("SELECT name FROM sqlite_master WHERE type = 'view' ORDER BY name LIMIT 1").fetchall()
    except sqlite3.Error:
        return  # of which GDAL says more
    if views:
        raise UserError(
            f"{path}: {views[0][0]!r} is a view, which could run without end, so the file is not read; export its layer as a"
            " table (QGIS: Export > Save Features As)"
        )


def _require_whole_shapefile(path: Path, head: bytes) -> None:
    """Refuse a Shapefile that is shorter than its header states, or without its index."""
    stated, size = 2 * int.from_bytes(head[24:28], "big"), path.stat().st_size
    if size < stated:
        raise UserError(f"{path} is truncated: its header states {stated} bytes, it has {size}; copy it again")
    there = {file.suffix.lower() for file in path.parent.iterdir() if file.stem == path.stem}
    if missing := {".shp", ".shx"} - there:
        raise UserError(
            f"{path} is one file of a Shapefile; copy the files that belong to it to the same folder: {', '.join(missing)},"
            " also .dbf and .prj"
        )


def gdal_fault(error: Exception) -> str:
    """Return the first line of an error of GDAL, without advice about options of GDAL, which only programs can set."""
    line = str(error).strip().split("\n", 1)[0]
    return _GDAL_ADVICE.sub("", line).rstrip(" .;,") or type(error).__name__


_GDAL_ADVICE = re.compile(
    r"(?:\bYou (?:can|may|might)\b|\bConsider\b|\bTry\b|\bSet\b|\bSetting\b|\bUse\b)[^.]*[A-Z]+_[A-Z_]+.*"
)


def by_kilometre(path: Path, kilometres: Sequence[int]) -> list[Path]:
    """Return one file name for each kilometre: the path itself for a single one, else with the kilometre's number."""
    if len(kilometres) == 1:
        return [path]
    return [path.with_name(f"{path.stem}-km{km:03d}{path.suffix}") for km in kilometres]


def common_name(paths: Sequence[Path]) -> str:
    """Return the common beginning of file names, without counting numbers, in letters that a tunnel's name may have."""
    stems = [path.name.split(".", 1)[0] for path in paths]
    same = [len(set(letters)) == 1 for letters in zip(*stems, strict=False)]
    common = stems[0][: same.index(False) if False in same else len(same)]
    return _PLAIN.sub("-", common).strip("-_0123456789" if len(stems) > 1 else "-_") or "tunnel"
