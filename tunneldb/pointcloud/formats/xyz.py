"""Tables of points: PTS, and XYZ, TXT, ASC or CSV with named columns.

PTS has the columns of its format: coordinates, intensity, colour. All others need column names, in the first line or in a
file beside them; a file ``.xyz`` with exactly three columns has coordinates. Nothing else is guessed.

Source: Leica Geosystems, *Cyclone* (PTS: a line with the number of points, then x, y, z, intensity and red, green, blue).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from tunneldb.errors import InputError
from tunneldb.pointcloud.formats.columns import (
    COORDINATES,
    SKIPPED,
    columns_of,
    given_names,
    names_file,
    own_names,
    split_names,
)
from tunneldb.pointcloud.formats.faults import decoding
from tunneldb.pointcloud.formats.text import KIND, CloudBuilder, TextCloud, TextScan
from tunneldb.pointcloud.formats.text_lines import COMMENTS, TextLines, are_numbers, decimal_comma, divider_of, split_values
from tunneldb.pointcloud.points import COLOURS

LEICA = {
    3: COORDINATES,
    4: (*COORDINATES, "intensity"),
    6: (*COORDINATES, *COLOURS),
    7: (*COORDINATES, "intensity", *COLOURS),
}
"""Columns of PTS and PTX, by their number."""

_MAX_COMMENTS = 1000


def read_table(path: Path) -> TextCloud:
    """Read a text file of points.

    Raises
    ------
    InputError
        If it is missing or damaged, has no points, or its columns have no names; names file and line.
    """
    with decoding(path, KIND):
        status = path.stat()
        names = names_file(path)
        named = None if names is None else (names, names.stat().st_mtime_ns)
    return _read_table(path, (status.st_size, status.st_mtime_ns), named)


@lru_cache(maxsize=64)
def _read_table(path: Path, version: tuple[int, int], named: tuple[Path, int] | None) -> TextCloud:
    """Read a file, once for each version of it and of its column names."""
    with decoding(path, KIND), TextLines(path) as lines:
        builder = CloudBuilder(path, lines)
        if path.suffix.lower() == ".pts":
            _read_pts(builder)
        else:
            scan, count = _layout(path, lines)
            builder.add(scan, None)
            if count is not None and builder.points != count.points:
                raise InputError(
                    f"{path}: line {count.line} states {count.points} points, but {builder.points} follow; if the file is "
                    "complete, remove that line"
                )
        return builder.cloud()


@dataclass(frozen=True)
class _Count:
    """Number of points that a line states."""

    line: int
    points: int


def _read_pts(builder: CloudBuilder) -> None:
    """Read the pieces of a PTS file, each after a line with its number of points; without such a line the file is one piece."""
    path, lines = builder.path, builder.lines
    while (text := lines.text()) is not None:
        if not text:
            continue
        at, count = lines.line - 1, None
        if text.isascii() and text.isdigit():
            count = int(text)
            text = lines.text() if count else ""
            if not text:
                continue
        lines.back()
        width = len(text.split())
        if width not in LEICA:
            raise InputError(f"{path}, line {lines.line}: {width} values; a line of PTS has {', '.join(map(str, LEICA))}")
        found = builder.add(TextScan(LEICA[width], None), count)
        if count is not None and found < count:
            raise InputError(f"{path}: truncated: line {at} states {count} points, but {found} follow")


def _layout(path: Path, lines: TextLines) -> tuple[TextScan, _Count | None]:
    """Return the columns of a table and the number of points that it states, and consume the lines before its points."""
    given = given_names(path)
    remarks: list[str] = []
    header: str | None = None
    count: _Count | None = None
    while (text := lines.text()) is not None:
        if not text:
            continue
        if text.startswith(COMMENTS) and len(remarks) < _MAX_COMMENTS:
            remarks.append(text)
        elif text.isascii() and text.isdecimal() and count is None:
            count = _Count(lines.line - 1, int(text))
        elif comma := decimal_comma(text.split(divider_of(text))):
            raise InputError(f"{path}, line {lines.line - 1}: {comma!r} is not a number; write decimals with a point")
        elif header is None and not are_numbers(text, () if given is None else given[0]):
            header = text
        else:
            break
    if text is None:
        raise InputError(f"{path}: the file holds no points")
    lines.back()
    values, divider = split_values(text)
    columns = _columns(path, lines.line, len(values), text, given, header, remarks)
    empty_end = len(text.split(divider)) - len(values)
    return TextScan((*columns, *[SKIPPED] * empty_end), divider), count


def _columns(
    path: Path,
    line: int,
    width: int,
    first: str,
    given: tuple[list[str], str] | None,
    header: str | None,
    remarks: list[str],
) -> tuple[str, ...]:
    if given is not None:
        names, source = given
    elif header is not None:
        names, source = split_names(header), "its header"
    else:
        found = [split_names(remark) for remark in reversed(remarks)]
        names = next((names for names in found if len(names) == width and set("xyz") <= {n.lower() for n in names}), [])
        source = "its header"
    if not names and path.suffix.lower() == ".xyz" and width == len(COORDINATES):
        return COORDINATES
    if not names:
        names = [*COORDINATES, *(f"column{number}" for number in range(len(COORDINATES) + 1, width + 1))]
        raise InputError(
            f"{path}: its {width} columns have no names (line {line}: {first[:60]}); name them: "
            f"echo '{' '.join(names)}' > {own_names(path)}"
        )
    if len(names) != width:
        comma = "write decimals with a point; or " if divider_of(first) == "," and width > len(names) else ""
        raise InputError(
            f"{path}, line {line}: {width} values, but {source} names {len(names)} columns: {', '.join(names)}; {comma}"
            f"write {width} names, - for a column to leave out, to {own_names(path)}"
        )
    return columns_of(path, names, source)
