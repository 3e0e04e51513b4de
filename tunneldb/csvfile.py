"""CSV files: read small ones (axis, stations, control points) and write lists.

Columns of a file that is read are separated by commas, semicolons, tabs or spaces, as its header shows. Where the separator
is not a comma, a comma may be the decimal point.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

import numpy as np

from tunneldb.arrays import Float, Int64
from tunneldb.errors import InputError

if TYPE_CHECKING:
    import _csv

MAX_MEASUREMENT = 1e12
"""Greatest measured value that is accepted; seconds since 1970 and coordinates are smaller."""

_SEPARATORS = (";", "\t", ",", " ")
_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d*(?:[eE][+-]?\d+)?")
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
    """Return the column names of a CSV file with any separator, as written in its first line.

    Raises
    ------
    InputError
        If the file cannot be read or is empty.
    """
    with _opened(path) as file:
        header = next(_rows(file)[0], None)
    if header is None:
        raise InputError(f"{path} is empty; write a header with its column names, for example x,y,z")
    return [cell.strip() for cell in header]


def read_texts(path: Path, name: str) -> list[str]:
    """Read a column of a CSV file as text, stripped; the rows are those of `read_csv`.

    Raises
    ------
    InputError
        If the file cannot be read, has no such column, or a row is longer or shorter than the header; names file and line.
    """
    with _opened(path) as file:
        rows, _ = _rows(file)
        header = [cell.strip() for cell in next(rows, [])]
        index = _indices(path, header, [name], {}, {})[name]
        texts = []
        for row in rows:
            if not any(cell.strip() for cell in row):
                continue
            if len(row) != len(header):
                raise _uneven(path, rows.line_num, row, header)
            texts.append(_bare(row[index].strip()))
        return texts


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
    with _opened(path) as file:
        rows, lines = _read_rows(path, *_rows(file), names, default or {}, hint or {})
    values = np.array(rows, dtype=np.float64).reshape(len(rows), len(names))
    return CsvTable(path, tuple(names), values, np.array(lines, dtype=np.int64))


@contextmanager
def _opened(path: Path) -> Iterator[TextIO]:
    """Open a text file; raise an error of one line if it cannot be read as text."""
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            yield file
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise InputError(f"{path} is not a text file in UTF-8 (byte {error.start}); save it as CSV") from None
    except csv.Error as error:
        raise InputError(f"{path} is not a CSV file: {error}") from None


def _rows(file: Iterable[str]) -> tuple[_csv.Reader, bool]:
    """Return the rows of a CSV file, and whether a comma may be the decimal point."""
    lines = iter(file)
    header = next(lines, "")
    separator = next((one for one in _SEPARATORS if one in header.strip()), ",")
    whole: Iterable[str] = chain([header] if header else [], lines)
    if separator == " ":  # several spaces may align columns
        whole = (" ".join(line.split()) for line in whole)
    return csv.reader(whole, delimiter=separator), separator != ","


def _read_rows(
    path: Path,
    reader: _csv.Reader,
    decimal_comma: bool,
    names: Sequence[str],
    default: Mapping[str, float],
    hint: Mapping[str, str],
) -> tuple[list[list[float]], list[int]]:
    header = next(reader, None)
    if header is None:
        raise InputError(f"{path} is empty; write the header {','.join(names)}")
    indices = _indices(path, [cell.strip() for cell in header], names, default, hint)
    rows: list[list[float]] = []
    lines: list[int] = []
    for row in reader:
        if not any(cell.strip() for cell in row):
            continue
        if len(row) != len(header):
            raise _uneven(path, reader.line_num, row, header)
        numbers = {name: _number(path, reader.line_num, name, row[index], decimal_comma) for name, index in indices.items()}
        rows.append([numbers[name] if name in numbers else default[name] for name in names])
        lines.append(reader.line_num)
    return rows, lines


def _uneven(path: Path, line: int, row: Sequence[str], header: Sequence[str]) -> InputError:
    """Return an error about a row whose number of columns differs from the header's."""
    return InputError(f"{path}, line {line}: {len(row)} values, but the header has {len(header)} columns")


def _indices(
    path: Path, header: list[str], names: Sequence[str], default: Mapping[str, float], hint: Mapping[str, str]
) -> dict[str, int]:
    missing = [name for name in names if name not in header and name not in default]
    if missing:
        advice = ["separate columns by commas, semicolons, tabs or spaces"] if len(header) == 1 else []
        advice += [hint[name] for name in missing if name in hint]
        raise InputError("; ".join([f"{path} has no column {', '.join(missing)}: the header is {','.join(header)!r}", *advice]))
    repeated = [name for name in names if header.count(name) > 1]
    if repeated:
        raise InputError(f"{path} has the column {repeated[0]} twice")
    return {name: header.index(name) for name in names if name in header}


def _number(path: Path, line: int, name: str, text: str, decimal_comma: bool) -> float:
    comma = decimal_comma and _DECIMAL_COMMA.fullmatch(text.strip())
    try:
        value = float(text.replace(",", ".") if comma else text)
    except ValueError:
        raise InputError(f"{path}, line {line}: {name} is {text.strip()!r}, not a number") from None
    if not abs(value) <= MAX_MEASUREMENT:  # also true for NaN
        raise InputError(f"{path}, line {line}: {name} is {text.strip()}, not a plausible measurement; remove the line")
    return value
