"""Columns of a text file of points, from its header or from a file of column names beside it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from tunneldb.csvfile import find_column
from tunneldb.csvsheet import read_text
from tunneldb.errors import InputError

COORDINATES = ("x", "y", "z")
SKIPPED = "-"
"""Name of a column that is skipped because it holds no numbers."""

SUFFIX = ".columns"

_MEANINGS = {
    "gpstime": "gps_time",
    "scanid": "scan_id",
    "pointsourceid": "scan_id",
    "classification": "classification",
    "intensity": "intensity",
}
_METRES = re.compile(r"\s*[\[(]m[\])]$", re.IGNORECASE)


def meaning_of(name: str) -> str:
    """Return the canonical name of a column: ``x``, ``y``, ``z``, ``gps_time``, ``scan_id``, ``classification`` or its own.

    Capitals, underscores, a unit ``[m]`` and CloudCompare's prefix ``scalar_`` are ignored for these names. Other columns,
    which may hold an intensity, keep their exact names.
    """
    own = name.strip().strip('"').strip()
    bare = re.sub(r"[ _]", "", _METRES.sub("", own).lower())
    bare = bare.removeprefix("scalar") or bare
    return bare if bare in COORDINATES else _MEANINGS.get(bare, own)


def columns_of(path: Path, names: Sequence[str], source: str) -> tuple[str, ...]:
    """Return the canonical names of a file's columns.

    Parameters
    ----------
    path : Path
    names : sequence of str
        Names in the header or in the file of column names.
    source : str
        Origin of the names, for the error message.

    Raises
    ------
    InputError
        If one of x, y and z is missing, or a name is repeated.
    """
    columns = tuple(name if name == SKIPPED else meaning_of(name) for name in names)
    if not set(COORDINATES) & set(columns):
        other_names = {find_column(path, names, name): name for name in COORDINATES}
        columns = tuple(other_names.get(name, meaning) for name, meaning in zip(names, columns, strict=True))
    missing = [name for name in COORDINATES if name not in columns]
    if missing:
        raise InputError(
            f"{path}: no column {', '.join(missing)}: {source} names {', '.join(names)}; "
            f"write the column names, with x, y and z, to {own_names(path)}"
        )
    repeated = [name for name in columns if name != SKIPPED and columns.count(name) > 1]
    if repeated:
        raise InputError(f"{path}: {source} names the column {repeated[0]} twice")
    return columns


def own_names(path: Path) -> Path:
    """Return the path of the file of column names for one text file."""
    return path.with_name(path.name + SUFFIX)


def names_file(path: Path) -> Path | None:
    """Return the file of column names of a text file: its own, or that for its suffix in the folder; None if there is none."""
    for found in (own_names(path), path.with_name(path.suffix.lower().lstrip(".") + SUFFIX)):
        if found.is_file():
            return found
    return None


def given_names(path: Path) -> tuple[list[str], str] | None:
    """Return the names in `names_file` and that file's name; None if there is none.

    Raises
    ------
    InputError
        If it cannot be read or is empty.
    """
    file = names_file(path)
    if file is None:
        return None
    try:
        text = read_text(file)
    except OSError as error:
        raise InputError(f"{file}: cannot be read as column names: {error.strerror}") from None
    names = split_names(text.strip().strip("'"))  # cmd.exe writes the quotes of echo
    if not names:
        raise InputError(f"{file}: contains no column names; write them on one line: x y z intensity")
    return names, str(file)


def split_names(text: str) -> list[str]:
    """Split a line of names at semicolons, commas or tabs, else at blanks."""
    line = text.strip().lstrip("#/").strip()
    for mark in (";", ",", "\t"):
        if mark in line:
            return [name.strip() for name in line.split(mark) if name.strip()]
    return line.split()
