"""Formats of scan files, by file suffix."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from tunneldb.errors import InputError
from tunneldb.pointcloud.formats.e57 import read_e57, read_e57_header, read_e57_scans
from tunneldb.pointcloud.formats.las import has_las_colours, read_las, read_las_header
from tunneldb.pointcloud.formats.las_header import SIGNATURE
from tunneldb.pointcloud.formats.ply import has_ply_colours, read_ply, read_ply_header
from tunneldb.pointcloud.formats.ptx import read_ptx, read_ptx_scans
from tunneldb.pointcloud.formats.scans import PosedScan
from tunneldb.pointcloud.formats.text import TextCloud, read_cloud
from tunneldb.pointcloud.formats.xyz import read_table
from tunneldb.pointcloud.points import Raw, ScanHeader


@dataclass(frozen=True)
class Format:
    """Format of scan files.

    Attributes
    ----------
    name : str
        Name for users.
    header : callable
        See `tunneldb.pointcloud.reader.read_header`.
    read : callable
        See `tunneldb.pointcloud.formats.raw.read_raw`.
    has_colours : callable
        Function that returns True if the points of a file have colours.
    scans : callable or None
        Function that returns the scans of a file with their positions; None if the format has no scans.
    is_las : bool
        True for LAS and LAZ.
    """

    name: str
    header: Callable[[Path], ScanHeader]
    read: Callable[..., Iterator[Raw]]
    has_colours: Callable[[Path], bool]
    scans: Callable[[Path], Sequence[PosedScan]] | None = None
    is_las: bool = False


def format_of(path: Path) -> Format:
    """Return the format of a file by its suffix; LAS or LAZ if no other format has that suffix."""
    return _FORMATS.get(path.suffix.lower(), _LAS)


def require_known(path: Path) -> None:
    """Refuse a file whose suffix is of no format and that is not LAS.

    Raises
    ------
    InputError
    """
    if path.suffix.lower() in scan_suffixes() or not path.is_file():
        return
    with path.open("rb") as file:
        if file.read(len(SIGNATURE)) != SIGNATURE:
            known = ", ".join(scan_suffixes())
            raise InputError(f"{path}: unknown suffix; files of points end with {known}")


def scan_suffixes() -> tuple[str, ...]:
    """Return the suffixes of scan files, lower-case."""
    return (*_SUFFIXES_OF_LAS, *_FORMATS)


def has_scans(path: Path) -> bool:
    """Return True if a file's suffix is of a format whose scans have poses."""
    return format_of(path).scans is not None


def posed_scans(path: Path) -> list[PosedScan]:
    """Return the scans of a file with their positions; none for a format without scans.

    Raises
    ------
    InputError
        If the file cannot be read or contains no points.
    """
    scans = format_of(path).scans
    return [] if scans is None else list(scans(path))


def has_colours(path: Path) -> bool:
    """Return True if the points of a file have colours that can be read.

    Raises
    ------
    InputError
        If the file cannot be read or contains no points.
    """
    return format_of(path).has_colours(path)


def _scans_of_e57(path: Path) -> list[PosedScan]:
    return [PosedScan(scan.index, scan.name, scan.number, scan.position) for scan in read_e57_scans(path)]


def _of_text(
    name: str, look: Callable[[Path], TextCloud], scans: Callable[[Path], Sequence[PosedScan]] | None = None
) -> Format:
    return Format(
        name,
        lambda path: look(path).header(),
        lambda path, dimension, size, ranges, colours=False: read_cloud(look(path), dimension, size, ranges, colours),
        lambda path: look(path).has_colours,
        scans,
    )


_SUFFIXES_OF_LAS = (".las", ".laz")
_LAS = Format(
    "LAS or LAZ",
    read_las_header,
    read_las,
    has_las_colours,
    is_las=True,
)
_TABLE = _of_text("table of points", read_table)
_FORMATS = {
    ".e57": Format(
        "E57",
        read_e57_header,
        read_e57,
        lambda path: any(scan.has_colours for scan in read_e57_scans(path)),
        _scans_of_e57,
    ),
    ".ptx": _of_text("PTX", read_ptx, read_ptx_scans),
    ".pts": _of_text("PTS", read_table),
    ".ply": Format("PLY", read_ply_header, read_ply, has_ply_colours),
    **dict.fromkeys((".xyz", ".txt", ".asc", ".csv"), _TABLE),
}
