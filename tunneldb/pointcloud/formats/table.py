"""The formats of scan files, by the suffix of their names."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from tunneldb.errors import InputError
from tunneldb.pointcloud.formats.e57 import read_e57, read_e57_header, read_e57_scans
from tunneldb.pointcloud.formats.las import read_las, read_las_header
from tunneldb.pointcloud.formats.las_header import SIGNATURE
from tunneldb.pointcloud.formats.ply import read_ply, read_ply_header
from tunneldb.pointcloud.formats.ptx import read_ptx, read_ptx_scans
from tunneldb.pointcloud.formats.scans import PosedScan
from tunneldb.pointcloud.formats.text import TextCloud, read_cloud
from tunneldb.pointcloud.formats.xyz import read_table
from tunneldb.pointcloud.points import Raw, ScanHeader


@dataclass(frozen=True)
class Format:
    """A format of scan files.

    Attributes
    ----------
    name : str
        As users know it.
    header : callable
        See `tunneldb.pointcloud.reader.read_header`.
    read : callable
        See `tunneldb.pointcloud.formats.raw.read_raw`.
    scans : callable or None
        Gives the scans of a file with their positions; None where the format has none.
    is_las : bool
        Whether it is LAS or LAZ.
    has_colours : callable or None
        Tells whether the points of a file have colours; ``read`` then takes as one more argument whether they are wanted. None
        where they are not read.
    """

    name: str
    header: Callable[[Path], ScanHeader]
    read: Callable[..., Iterator[Raw]]
    scans: Callable[[Path], Sequence[PosedScan]] | None = None
    is_las: bool = False
    has_colours: Callable[[Path], bool] | None = None


def format_of(path: Path) -> Format:
    """Format of a file, by the suffix of its name; LAS or LAZ where that is no other's."""
    return _FORMATS.get(path.suffix.lower(), _LAS)


def require_known(path: Path) -> None:
    """Refuse a file whose suffix is that of no format, and that is no LAS either.

    Raises
    ------
    InputError
    """
    if path.suffix.lower() in scan_suffixes() or not path.is_file():
        return
    with path.open("rb") as file:
        if file.read(len(SIGNATURE)) != SIGNATURE:
            known = ", ".join(scan_suffixes())
            raise InputError(f"{path}: a file of points is known by how its name ends: {known}")


def scan_suffixes() -> tuple[str, ...]:
    """How names of scan files end, lower-case."""
    return (*_SUFFIXES_OF_LAS, *_FORMATS)


def has_scans(path: Path) -> bool:
    """Whether a file is of a format whose scans bring their poses, by its name."""
    return format_of(path).scans is not None


def posed_scans(path: Path) -> list[PosedScan]:
    """Scans of a file with the positions that it gives them; none of a format that has no scans.

    Raises
    ------
    InputError
        If the file cannot be read or holds no points.
    """
    scans = format_of(path).scans
    return [] if scans is None else list(scans(path))


def has_colours(path: Path) -> bool:
    """Whether the points of a file have colours that are read.

    Raises
    ------
    InputError
        If the file cannot be read or holds no points.
    """
    told = format_of(path).has_colours
    return told is not None and told(path)


def _scans_of_e57(path: Path) -> list[PosedScan]:
    return [PosedScan(scan.index, scan.name, scan.number, scan.position) for scan in read_e57_scans(path)]


def _of_text(
    name: str, look: Callable[[Path], TextCloud], scans: Callable[[Path], Sequence[PosedScan]] | None = None
) -> Format:
    return Format(
        name,
        lambda path: look(path).header(),
        lambda path, dimension, size, ranges: read_cloud(look(path), dimension, size, ranges),
        scans,
    )


_SUFFIXES_OF_LAS = (".las", ".laz")
_LAS = Format(
    "LAS or LAZ",
    read_las_header,
    read_las,
    is_las=True,
    has_colours=lambda path: "red" in read_las_header(path).dimensions,
)
_TABLE = _of_text("table of points", read_table)
_FORMATS = {
    ".e57": Format(
        "E57",
        read_e57_header,
        read_e57,
        _scans_of_e57,
        has_colours=lambda path: any(scan.has_colours for scan in read_e57_scans(path)),
    ),
    ".ptx": _of_text("PTX", read_ptx, read_ptx_scans),
    ".pts": _of_text("PTS", read_table),
    ".ply": Format("PLY", read_ply_header, read_ply),
    **dict.fromkeys((".xyz", ".txt", ".asc", ".csv"), _TABLE),
}
