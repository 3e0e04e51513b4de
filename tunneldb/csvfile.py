"""CSV files: read small ones (axis, stations, control points) and write lists.

Columns of a file that is read are separated by commas, semicolons, tabs or spaces, as its header shows. Where the separator
is not a comma, a comma may be the decimal point. Text is UTF-8, UTF-16 with a byte order mark, or Windows-1252. Lines before
the header that are blank or begin with # or // are skipped; a header may begin with # itself.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tunneldb.arrays import Float, Int64
from tunneldb.csvsheet import Sheet, opened
from tunneldb.errors import InputError
from tunneldb.numerals import MAX_MEASUREMENT, parse_number

NO_NUMBER = re.compile(r"[+-]?(?:nan(?:\(\w*\))?|1\.#(?:[QS]NAN|IND)0*|null|none|n/?a)", re.IGNORECASE)
"""Texts that programs write for a missing number, also those of C on Windows."""

_ALIASES = {
    "x": ("e", "east", "easting", "rechtswert", "ost", "est", "este"),
    "y": ("n", "north", "northing", "hochwert", "nord", "norte"),
    "z": ("h", "height", "elevation", "altitude", "höhe", "hoehe", "quota", "cota"),
    "time": ("gpstime",),
    "scanid": ("pointsourceid",),
}
"""Other names of columns, normalised."""

_UNIT = re.compile(r"[\[(](?:m|s|db)[\])]$")
_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d*(?:[eE][+-]?\d+)?")
_THOUSANDS = re.compile(r"[+-]?\d{1,3}(?:[ '’.,_\u00a0\u202f]\d{3})+(?:[.,]\d+)?")
_FORMULA = re.compile(r"'*(?:[=@\t\r]|[+-](?![\d.+-]*$))")  # also with apostrophes, so that guarding can be undone
_GUARD = "'"


@dataclass(frozen=True)
class CsvTable:
    """Numeric columns of a CSV file.

    Attributes
    ----------
    path
        File that was read.
    names
        Names of the columns, in the order requested.
    values
        (rows, columns), float64, all finite.
    lines
        (rows,), line number of each row in the file, from 1.
    """

    path: Path
    names: tuple[str, ...]
    values: Float
    lines: Int64

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.values)

    def __getitem__(self, name: str) -> Float:
        """Return a column."""
        return self.values[:, self.names.index(name)]

    def columns(self, names: Sequence[str]) -> Float:
        """Return several columns, (rows, len(names))."""
        return np.ascontiguousarray(self.values[:, [self.names.index(name) for name in names]])

    def error(self, row: int, text: str) -> InputError:
        """Return an error about a row, with file and line."""
        return InputError(f"{self.path}, line {self.lines[row]}: {text}")

    def require_growing(self, name: str) -> None:
        """Raise an InputError unless a column grows strictly from row to row."""
        column = self[name]
        wrong = np.flatnonzero(np.diff(column) <= 0)
        if len(wrong):
            row = int(wrong[0]) + 1
            how = "repeats" if column[row] == column[row - 1] else "is less than"
            raise self.error(row, f"{name} {column[row]:.15g} {how} that of the row before; sort by {name}, without repeats")


def write_csv(names: Sequence[str], rows: Iterable[Iterable[object]]) -> str:
    """Return rows as CSV with a header; None becomes an empty cell.

    Text that a spreadsheet would evaluate as a formula gets a leading apostrophe, which marks it as text; `read_texts` removes
    it again.
    """
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(names)
    writer.writerows([_guarded(value) for value in row] for row in rows)
    return out.getvalue()


def _guarded(value: object) -> object:
    return _GUARD + value if isinstance(value, str) and _FORMULA.match(value) else value


def _bare(text: str) -> str:
    """Return a cell without the apostrophe that `write_csv` added."""
    return text[1:] if text.startswith(_GUARD) and _FORMULA.match(text[1:]) else text


def read_header(path: Path) -> list[str]:
    """Return the column names of a CSV file with any separator, as written in its header.

    Raises
    ------
    InputError
        If the file cannot be read or is empty.
    """
    with opened(path) as sheet:
        if not sheet.header:
            raise InputError(f"{path} is empty; write a header with its column names, for example x,y,z")
        return sheet.header


def find_column(path: Path, header: Sequence[str], name: str) -> str | None:
    """Return the column of a header with a name; None if there is none.

    Capitals, blanks, underscores and a unit ``[m]``, ``[s]`` or ``[dB]`` are ignored; x, y, z, time and scan_id have other
    usual names, for example easting. An exact name precedes.

    Raises
    ------
    InputError
        If several columns may be the one.
    """
    if name in header:
        return name
    wanted = _normalised(name)
    meanings = {column: _normalised(column) for column in header}
    found = [column for column, meaning in meanings.items() if meaning == wanted] or [
        column for column, meaning in meanings.items() if meaning in _ALIASES.get(wanted, ())
    ]
    if len(found) > 1:
        raise InputError(f"{path}: {' and '.join(found)} may both be {name}; rename one of them to {name}")
    return found[0] if found else None


def _normalised(name: str) -> str:
    """Return a column name without capitals, blanks, underscores and a unit."""
    return _UNIT.sub("", re.sub(r"[\s_]", "", name.casefold()))


def read_texts(path: Path, name: str) -> list[str]:
    """Read a column of a CSV file as text, stripped; the rows are those of `read_csv`.

    Raises
    ------
    InputError
        If the file cannot be read, has no such column, or a row is longer or shorter than the header; names file and line.
    """
    with opened(path) as sheet:
        index = _indices(path, sheet.header, [name], {}, {})[name]
        texts = []
        for line, row in sheet.rows():
            text = _bare(row[index].strip())
            sheet.require_unicode(line, text)
            texts.append(text)
        return texts


def row_lines(path: Path) -> list[int]:
    """Return the line number of each row, from 1; the rows are those of `read_csv`."""
    with opened(path) as sheet:
        return [line for line, _ in sheet.rows()]


def read_rows(path: Path) -> list[list[str]]:
    """Return the cells of each row, as many as in the header; the rows are those of `read_csv`.

    Raises
    ------
    InputError
        If the file cannot be read; names file and line.
    """
    with opened(path) as sheet:
        rows = []
        for line, row in sheet.rows():
            for text in row:
                sheet.require_unicode(line, text)
            rows.append(row)
        return rows


def read_csv(
    path: Path, names: Sequence[str], default: Mapping[str, float] | None = None, hint: Mapping[str, str] | None = None
) -> CsvTable:
    """Read numeric columns of a CSV file with a header; other columns are ignored.

    Parameters
    ----------
    path, names
        File and columns.
    default
        Columns that may be missing, with the value for all rows.
    hint
        Text for the message about a missing column, where its name does not explain it.

    Raises
    ------
    InputError
        If the file cannot be read, a column is missing, or a value is not a finite number; names file, line and
        value.
    """
    with opened(path) as sheet:
        rows, lines = _read_rows(sheet, names, default or {}, hint or {})
    values = np.array(rows, dtype=np.float64).reshape(len(rows), len(names))
    return CsvTable(path, tuple(names), values, np.array(lines, dtype=np.int64))


def _read_rows(
    sheet: Sheet, names: Sequence[str], default: Mapping[str, float], hint: Mapping[str, str]
) -> tuple[list[list[float]], list[int]]:
    if not sheet.header:
        raise InputError(f"{sheet.path} is empty; write the header {','.join(names)}")
    indices = _indices(sheet.path, sheet.header, names, default, hint)
    rows: list[list[float]] = []
    lines: list[int] = []
    for line, row in sheet.rows():
        numbers = {name: _number(sheet.path, line, name, row[index], sheet.decimal_comma) for name, index in indices.items()}
        rows.append([numbers[name] if name in numbers else default[name] for name in names])
        lines.append(line)
    return rows, lines


def _indices(
    path: Path, header: list[str], names: Sequence[str], default: Mapping[str, float], hint: Mapping[str, str]
) -> dict[str, int]:
    columns = {name: find_column(path, header, name) for name in names}
    missing = [name for name, column in columns.items() if column is None and name not in default]
    if missing:
        advice = [hint[name] for name in missing if name in hint] or [f"the first line must name the columns {','.join(names)}"]
        if len(header) == 1 and len(names) > 1:
            advice.insert(0, "separate columns by commas, semicolons, tabs or spaces")
        raise InputError("; ".join([f"{path} has no column {', '.join(missing)}: the header is {','.join(header)!r}", *advice]))
    repeated = [column for column in columns.values() if column is not None and header.count(column) > 1]
    if repeated:
        raise InputError(f"{path} has the column {repeated[0]} twice")
    return {name: header.index(column) for name, column in columns.items() if column is not None}


def _number(path: Path, line: int, name: str, text: str, decimal_comma: bool) -> float:
    try:
        value = parse_number(text)
    except ValueError:
        text = text.strip()
        if decimal_comma and _DECIMAL_COMMA.fullmatch(text):
            return _number(path, line, name, text.replace(",", "."), False)
        if not NO_NUMBER.fullmatch(text):
            raise InputError(f"{path}, line {line}: {_not_a_number(name, text)}") from None
        value = float("nan")
    if not abs(value) <= MAX_MEASUREMENT:  # also true for NaN
        nanoseconds = name == "time" and abs(value) > MAX_MEASUREMENT
        scaled = ", or divide the column by 1000000000 if it is in nanoseconds" if nanoseconds else ""
        raise InputError(f"{path}, line {line}: {name} is {text.strip()}, not a plausible measurement; remove the line{scaled}")
    return value


def _not_a_number(name: str, text: str) -> str:
    """Return what is wrong with a value, and how to write it."""
    if not text:
        return f"{name} is empty; fill it in, or remove the line"
    return f"{name} is {text!r}, not a number{number_advice(text)}"


def number_advice(text: str) -> str:
    """Return how to write a number, as the end of a message; empty if unknown."""
    if _DECIMAL_COMMA.fullmatch(text):
        return "; write decimals with a point"
    if _THOUSANDS.fullmatch(text):
        return "; write it without separators of thousands"
    return "; write it with the digits 0 to 9" if re.search(r"[^\D0-9]", text) else ""
