"""PTX files: scans ray by ray, as the scanner recorded them, with their poses.

A scan has ten header lines, then one line per ray. The header has the numbers of columns and rows, position and axes of the
scanner, and the matrix that transforms the points (as row vectors). Rays without an echo are 0, 0, 0. The scanner position
is the image of 0, 0, 0 under the matrix; line 3 of the header should repeat it.

Source: Leica Geosystems, *Cyclone PTX export format*; P. Bourke, *ptx plain text data format*, 2015.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np

from tunneldb.arrays import Float
from tunneldb.errors import InputError
from tunneldb.numerals import parse_number
from tunneldb.pointcloud.formats.faults import decoding
from tunneldb.pointcloud.formats.scans import PosedScan, scan_number
from tunneldb.pointcloud.formats.text import CloudBuilder, TextCloud, TextScan
from tunneldb.pointcloud.formats.text_lines import TextLines, decimal_comma
from tunneldb.pointcloud.formats.xyz import LEICA

KIND = "a PTX"
_HEADER = (1, 1, 3, 3, 3, 3, 4, 4, 4, 4)  # numbers in each line
_MAX_SKEW = 1e-3  # greatest deviation from a rotation, for matrices written with few digits


def read_ptx(path: Path) -> TextCloud:
    """Read a PTX file.

    Raises
    ------
    InputError
        If it is missing, damaged or has no points; names file and line.
    """
    with decoding(path, KIND):
        status = path.stat()
    return _read_ptx(path, (status.st_size, status.st_mtime_ns))


def read_ptx_scans(path: Path) -> list[PosedScan]:
    """Return the scans of a PTX file, in its order."""
    return [scan.pose for scan in read_ptx(path).scans if scan.pose is not None]


@lru_cache(maxsize=64)
def _read_ptx(path: Path, version: tuple[int, int]) -> TextCloud:
    """Read a file, once for each version of it."""
    with decoding(path, KIND), TextLines(path) as lines:
        builder = CloudBuilder(path, lines)
        seen: dict[bytes, int] = {}
        while (head := _read_head(path, lines)) is not None:
            line, columns, rows, place, matrix = head
            first = lines.text()
            if first is None:
                raise InputError(f"{path}: truncated: no point follows the scan that begins in line {line}")
            lines.back()
            width = len(first.split())
            if width not in LEICA:
                raise InputError(f"{path}, line {lines.line}: {width} values; a line of PTX has {', '.join(map(str, LEICA))}")
            key = f"ptx {columns} {rows}".encode() + matrix.tobytes()
            seen[key] = seen.get(key, 0) + 1
            index = len(builder.scans)
            number = scan_number(f"{key.hex()} {seen[key]}", matrix[3, :3])
            pose = PosedScan(index, f"line {line}", number, matrix[3, :3], place)
            scan = TextScan(LEICA[width], None, pose, matrix[:3, :3].T, True)
            found = builder.add(scan, columns * rows)
            if found < columns * rows:
                raise InputError(f"{path}: truncated: line {line} states {columns} × {rows} points, but {found} follow")
        return builder.cloud()


def _read_head(path: Path, lines: TextLines) -> tuple[int, int, int, Float, Float] | None:
    """Return line, columns, rows, position (3,) and matrix (4, 4) of the next scan; None at the end of the file."""
    text = lines.text()
    while text == "":
        text = lines.text()
    if text is None:
        return None
    begin = lines.line - 1
    values: list[list[float]] = []
    for count in _HEADER:
        if text is None:
            raise InputError(f"{path}: truncated in the header of the scan that begins in line {begin}")
        try:
            numbers = list(map(parse_number, text.split()))
        except ValueError:
            numbers = []
        if len(numbers) != count or not np.isfinite(numbers).all():
            what = "a number" if count == 1 else f"{count} numbers"
            comma = "; write decimals with a point" if decimal_comma(text.split()) else ""
            raise InputError(f"{path}, line {lines.line - 1}: {text[:60]!r}, but the header of a scan has {what} here{comma}")
        values.append(numbers)
        if len(values) < len(_HEADER):
            text = lines.text()
    (columns,), (rows,) = values[:2]
    if min(columns, rows) < 1 or columns != int(columns) or rows != int(rows):
        raise InputError(f"{path}, line {begin}: invalid scan size {columns:g} × {rows:g}")
    matrix = np.array(values[6:])
    if not np.allclose(matrix[:3, :3] @ matrix[:3, :3].T, np.eye(3), atol=_MAX_SKEW):
        raise InputError(
            f"{path}, line {begin + 6}: the scan's matrix is not a rotation (is it scaled?); export it with its pose, in metres"
        )
    return begin, int(columns), int(rows), np.array(values[2]), matrix
