"""Sonar scans: points in the instrument's own axes, as exported by the maker's software."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tunneldb.arrays import Float
from tunneldb.errors import InputError
from tunneldb.pointcloud.formats.text_lines import TextLines, are_numbers, divider_of, parse
from tunneldb.pointcloud.reader import read_chunks, read_header

TEXT = (".xyz", ".txt", ".csv")
RAW = (".all", ".kmall", ".xtf", ".gsf", ".s7k", ".son")
MAX_RANGE = 100.0  # m; greatest range of an echo
POINTER = "version https://git-lfs"
MAX_INVALID_SHARE = 0.01  # share
_LINES = 1 << 20


def read_sonar(path: Path) -> tuple[Float, int]:
    """Read the points (n, 3) of a sonar scan, m, in its file's axes; also return the number of invalid points left out.

    Text has ``x y z`` first in each line, with or without a header; LAS, LAZ, E57 and PLY are read like laser scans.

    Raises
    ------
    InputError
        If the file is of another kind, or its coordinates are not in a scanner's own axes in metres.
    """
    points, invalid = read_soundings(path)
    far = float(np.percentile(np.linalg.norm(points, axis=1), 50))
    if far > MAX_RANGE:
        raise InputError(
            f"{path}: its points are {far:.0f} m from the origin, but a sonar scan has its origin at the sonar;"
            " is it in the tunnel's system (then load it with --medium water), or in feet or millimetres?"
        )
    return points, invalid


def read_soundings(path: Path) -> tuple[Float, int]:
    """Read the points of a sonar in the axes of its file; see `read_sonar`."""
    suffix = path.suffix.lower()
    if suffix in RAW:
        raise InputError(f"{path}: {suffix} is raw data; export it from the maker's software as .xyz, .las or .off")
    if not path.is_file():
        raise InputError(f"{path}: there is no such file")
    if suffix == ".off":
        points = _read_off(path)
    elif suffix in TEXT:
        points = _read_text(path)
    else:
        read_header(path)
        points = np.vstack([np.zeros((0, 3)), *(chunk.xyz for chunk in read_chunks(path, None))])
    finite = np.isfinite(points).all(axis=1)
    invalid = int((~finite).sum())
    if invalid > MAX_INVALID_SHARE * len(points):
        raise InputError(f"{path}: {invalid} of its {len(points)} points have invalid coordinates; export it again")
    points = points[finite]
    if len(points) == 0:
        raise InputError(f"{path}: the file holds no points")
    return points, invalid


def _read_text(path: Path) -> Float:
    with TextLines(path) as lines:
        while (text := lines.text()) is not None and not _is_place(text):
            if text.startswith(POINTER):
                raise InputError(f"{path}: it is a Git LFS pointer, not the file itself; type git lfs pull")
            if lines.line > 100:
                raise InputError(f"{path}, line {lines.line - 1}: no line of numbers so far; not a table of points")
        if text is None:
            raise InputError(f"{path}: the file holds no points: no line begins with x, y and z (decimal point, not comma)")
        lines.back()
        divider = divider_of(text)
        width = len(text.split(divider))
        if width < 3:
            comma = " (decimal commas?)" if divider == "," else ""
            raise InputError(f"{path}, line {lines.line}: {width} values, expected x, y and z{comma}")
        parts: list[Float] = []
        while True:
            first = lines.line
            block, count = lines.take(_LINES)
            if not count:
                return np.vstack(parts)
            parts.append(parse(path, block, first, divider, width, (0, 1, 2)))


def _is_place(text: str) -> bool:
    """Return True if a line begins with x, y and z, or all its numbers if fewer; text such as a time may follow."""
    divider = divider_of(text)
    return are_numbers((divider or " ").join(text.split(divider)[:3]))


def _read_off(path: Path) -> Float:
    """Read the vertices of an OFF file."""
    with TextLines(path) as lines:
        if (lines.text() or "").upper() != "OFF":
            raise InputError(f"{path}, line 1: an OFF file begins with OFF")
        counts = (lines.text() or "").split()
        if not counts or not (counts[0].isascii() and counts[0].isdigit()):
            raise InputError(f"{path}, line 2: expected the numbers of vertices, faces and edges")
        wanted, parts, found = int(counts[0]), [np.zeros((0, 3))], 0
        while found < wanted:
            first = lines.line
            block, count = lines.take(min(_LINES, wanted - found))
            if not count:
                raise InputError(f"{path}: truncated: line 2 states {wanted} vertices, but {found} follow")
            width = len(block.split(b"\n", 1)[0].split())
            if width < 3:
                raise InputError(f"{path}, line {first}: {width} values, expected x, y and z")
            parts.append(parse(path, block, first, None, width, (0, 1, 2)))
            found += count
        return np.vstack(parts)
