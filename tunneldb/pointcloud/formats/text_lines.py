"""Lines of numbers, read in blocks of constant memory; errors state the line."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from tunneldb.arrays import Float
from tunneldb.errors import InputError
from tunneldb.pointcloud.formats.columns import SKIPPED

BLOCK_BYTES = 1 << 24
MAX_LINE_BYTES = 1 << 16  # bytes of a line; text files do not have longer ones


class TextLines:
    """Whole lines of a file, block by block, with their place in the file.

    Attributes
    ----------
    line, offset : int
        Number, from 1, and offset (bytes) of the next line.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.line, self.offset = 1, 0
        self._file = path.open("rb")
        self._buffer = b""
        self._ends = np.empty(0, np.int64)  # offsets after the ends of the lines in memory
        self._at = 0  # number of these lines already taken

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._file.close()

    def take(self, count: int) -> tuple[bytes, int]:
        """Return the next lines, `count` at most, and their number; none at the end of the file."""
        if self._at == len(self._ends) and not self._fill():
            return b"", 0
        taken = min(count, len(self._ends) - self._at)
        begin = int(self._ends[self._at - 1]) if self._at else 0
        end = int(self._ends[self._at + taken - 1])
        self._at += taken
        self.line += taken
        self.offset += end - begin
        return self._buffer[begin:end], taken

    def text(self) -> str | None:
        """Return the next line, without its end; None at the end of the file.

        Raises
        ------
        InputError
            If it is not text.
        """
        data, count = self.take(1)
        if not count:
            return None
        if b"\0" in data:
            raise InputError(f"{self.path}, line {self.line - 1}: not a text file")
        return data.decode("utf-8-sig", "replace").strip()

    def skip(self, count: int) -> None:
        """Skip lines."""
        while count > 0:
            _, taken = self.take(count)
            count -= taken or count

    def back(self) -> None:
        """Put back the line that was taken last; only once, and before another line is taken."""
        begin = int(self._ends[self._at - 2]) if self._at > 1 else 0
        self.offset -= int(self._ends[self._at - 1]) - begin
        self._at -= 1
        self.line -= 1

    def _fill(self) -> bool:
        rest = self._buffer[int(self._ends[-1]) if len(self._ends) else 0 :]
        data = self._file.read(BLOCK_BYTES)
        if not data and rest:
            data = b"\n"
        self._buffer = rest + data
        self._ends = np.flatnonzero(np.frombuffer(self._buffer, np.uint8) == ord("\n")) + 1
        self._at = 0
        if self._buffer and (not len(self._ends) or self._ends[0] > MAX_LINE_BYTES):
            raise InputError(f"{self.path}, line {self.line}: no line end within {MAX_LINE_BYTES} bytes: not a text file")
        return bool(len(self._ends))


def divider_of(line: str) -> str | None:
    """Return the separator of the values of a line: semicolon, comma, or None for blanks and tabs."""
    return next((mark for mark in (";", ",") if mark in line), None)


def are_numbers(line: str, columns: Sequence[str] = ()) -> bool:
    """Return True if a line has values and all are numbers; values of skipped columns may be words."""
    values = line.split(divider_of(line))
    if len(values) == len(columns):
        values = [value for value, name in zip(values, columns, strict=True) if name != SKIPPED]
    try:
        list(map(float, values))
    except ValueError:
        return False
    return bool(values)


def parse(path: Path, block: bytes, first: int, divider: str | None, width: int, used: tuple[int, ...]) -> Float:
    """Parse the numbers of a block of lines; blank lines are ignored.

    Parameters
    ----------
    path : Path
        File name for error messages.
    block : bytes
        Whole lines.
    first : int
        Number of the first line in the file.
    divider : str or None
        See `divider_of`.
    width : int
        Number of values in a line.
    used : tuple of int
        Indices of the values to return.

    Returns
    -------
    (n, len(used)) float64 array

    Raises
    ------
    InputError
        If a line has more or fewer values, or a requested value is not a number.
    """
    if not block.strip():
        return np.empty((0, len(used)))
    try:
        text = io.StringIO(block.decode("ascii"))
        # If all columns are numbers, all are read, so that lines with more values are detected.
        chosen = None if used == tuple(range(width)) else used
        values = np.loadtxt(text, np.float64, comments=None, delimiter=divider, ndmin=2, usecols=chosen)
    except (ValueError, UnicodeDecodeError) as error:
        raise _fault(path, block, first, divider, width, used) or InputError(f"{path}: {error}") from None
    if chosen is None and values.shape[1] != width:
        raise _fault(path, block, first, divider, width, used) or InputError(f"{path}: lines have {values.shape[1]} values")
    return values


def _fault(path: Path, block: bytes, first: int, divider: str | None, width: int, used: tuple[int, ...]) -> InputError | None:
    for number, line in enumerate(block.decode("utf-8", "replace").split("\n"), first):
        if not line.strip():
            continue
        values = line.split(divider)
        if len(values) != width:
            return InputError(f"{path}, line {number}: {len(values)} values, expected {width}: {_short(line)!r}")
        for place in used:
            try:
                float(values[place])
            except ValueError:
                comma = "; write decimals with a point" if divider == ";" and "," in values[place] else ""
                return InputError(f"{path}, line {number}: {_short(values[place])!r} is not a number{comma}")
    return None


def _short(text: str) -> str:
    return text.strip() if len(text.strip()) <= 60 else text.strip()[:57] + "…"
