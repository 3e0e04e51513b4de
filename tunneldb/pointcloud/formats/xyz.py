"""Tables of points: PTS, and XYZ, TXT, ASC or CSV with named columns.

PTS has the columns of its format: coordinates, intensity, colour. All others need column names, in the first line or in a
file beside them; a file ``.xyz`` with exactly three columns has coordinates. Nothing else is guessed.

Source: Leica Geosystems, *Cyclone* (PTS: a line with the number of points, then x, y, z, intensity and red, green, blue).
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from tunneldb.errors import InputError
from tunneldb.pointcloud.formats.columns import COORDINATES, columns_of, given_names, names_file, own_names, split_names
from tunneldb.pointcloud.formats.faults import decoding
from tunneldb.pointcloud.formats.text import KIND, CloudBuilder, TextCloud, TextScan
from tunneldb.pointcloud.formats.text_lines import TextLines, are_numbers, divider_of

COLOURS = ("red", "green", "blue")
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
            builder.add(_layout(path, lines), None)
        return builder.cloud()


def _read_pts(builder: CloudBuilder) -> None:
    """Read the pieces of a PTS file, each after a line with its number of points; without such a line the file is one piece."""
    path, lines = builder.path, builder.lines
    while (text := lines.text()) is not None:
        if not text:
            continue
        at, count = lines.line - 1, None
        if text.isdigit():
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


def _layout(path: Path, lines: TextLines) -> TextScan:
    """Return the columns of a table, and consume the lines before its points."""
    given = given_names(path)
    remarks: list[str] = []
    header: str | None = None
    while (text := lines.text()) is not None:
        if not text:
            continue
        if text.startswith(("#", "//")) and len(remarks) < _MAX_COMMENTS:
            remarks.append(text)
        elif header is None and not are_numbers(text, () if given is None else given[0]):
            header = text
        else:
            break
    if text is None:
        raise InputError(f"{path}: the file holds no points")
    lines.back()
    divider = divider_of(text)
    width = len(text.split(divider))
    return TextScan(_columns(path, lines.line, width, text, given, header, remarks), divider)


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
        raise InputError(
            f"{path}: its {width} columns have no names (line {line}: {first[:60]}); name them: "
            f"echo 'x y z …' > {own_names(path)}"
        )
    if len(names) != width:
        raise InputError(f"{path}, line {line}: {width} values, but {source} names {len(names)} columns: {', '.join(names)}")
    return columns_of(path, names, source)
