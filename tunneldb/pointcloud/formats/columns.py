"""What the columns of a text file of points are: by its header, or by a file of column names beside it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from tunneldb.errors import InputError

COORDINATES = ("x", "y", "z")
SKIPPED = "-"
"""Name of a column that is left out, as it holds no numbers."""

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
    """Name that a column goes by: ``x``, ``y``, ``z``, ``gps_time``, ``scan_id``, ``classification``, or its own.

    Capitals, underscores, a unit ``[m]`` and the ``scalar_`` of CloudCompare make no difference to these; all others, which
    may hold an intensity, keep their name to the letter.
    """
    own = name.strip().strip('"').strip()
    bare = re.sub(r"[ _]", "", _METRES.sub("", own).lower())
    bare = bare.removeprefix("scalar") or bare
    return bare if bare in COORDINATES else _MEANINGS.get(bare, own)


def columns_of(path: Path, names: Sequence[str], source: str) -> tuple[str, ...]:
    """Meanings of a file's columns.

    Parameters
    ----------
    path : Path
    names : sequence of str
        As the header, or the file of column names, has them.
    source : str
        Where they stand, for the error's line.

    Raises
    ------
    InputError
        If one of x, y and z is missing, or a name stands twice.
    """
    columns = tuple(name if name == SKIPPED else meaning_of(name) for name in names)
    missing = [name for name in COORDINATES if name not in columns]
    if missing:
        raise InputError(
            f"{path}: no column {', '.join(missing)} by {source}, which names {', '.join(names)}; "
            f"name the columns, x, y and z among them, in {own_names(path)}"
        )
    repeated = [name for name in columns if name != SKIPPED and columns.count(name) > 1]
    if repeated:
        raise InputError(f"{path}: {source} names the column {repeated[0]} twice")
    return columns


def own_names(path: Path) -> Path:
    """File of column names beside a text file, for it alone."""
    return path.with_name(path.name + SUFFIX)


def names_file(path: Path) -> Path | None:
    """File that names the columns of a text file: its own, or that of all with its suffix in the folder; None if none is."""
    for found in (own_names(path), path.with_name(path.suffix.lower().lstrip(".") + SUFFIX)):
        if found.is_file():
            return found
    return None


def given_names(path: Path) -> tuple[list[str], str] | None:
    """Names by `names_file`, and that file's name; None if there is none.

    Raises
    ------
    InputError
        If it cannot be read or names nothing.
    """
    file = names_file(path)
    if file is None:
        return None
    try:
        text = file.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{file}: cannot be read as names of columns: {error}") from None
    names = split_names(text)
    if not names:
        raise InputError(f"{file}: names no column; write them in one line: x y z intensity")
    return names, str(file)


def split_names(text: str) -> list[str]:
    """Names in a line, divided by what divides columns: semicolon, comma, tab, else blanks."""
    line = text.strip().lstrip("#/").strip()
    for mark in (";", ",", "\t"):
        if mark in line:
            return [name.strip() for name in line.split(mark) if name.strip()]
    return line.split()
