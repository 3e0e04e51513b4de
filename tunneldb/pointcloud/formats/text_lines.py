"""Lines of numbers, read in blocks of constant memory, with the line in which something is wrong."""

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
LONGEST = 1 << 16  # bytes of a line; nothing that is text has longer ones


class TextLines:
    """Whole lines of a file, a block at a time, and where they stand.

    Attributes
    ----------
    line, offset : int
        Number, from 1, and place in the file, bytes, of the line that comes next.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.line, self.offset = 1, 0
        self._file = path.open("rb")
        self._held = b""
        self._ends = np.empty(0, np.int64)  # places behind the ends of the lines that are held
        self._at = 0  # lines of these that were taken

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._file.close()

    def take(self, count: int) -> tuple[bytes, int]:
        """Next lines, `count` at most, and how many they are; none at the end of the file."""
        if self._at == len(self._ends) and not self._fill():
            return b"", 0
        taken = min(count, len(self._ends) - self._at)
        begin = int(self._ends[self._at - 1]) if self._at else 0
        end = int(self._ends[self._at + taken - 1])
        self._at += taken
        self.line += taken
        self.offset += end - begin
        return self._held[begin:end], taken

    def text(self) -> str | None:
        """Next line, without its end; None at the end of the file.

        Raises
        ------
        InputError
            If it is no text.
        """
        data, count = self.take(1)
        if not count:
            return None
        if b"\0" in data:
            raise InputError(f"{self.path}, line {self.line - 1}: it is no text file")
        return data.decode("utf-8-sig", "replace").strip()

    def skip(self, count: int) -> None:
        """Pass over lines."""
        while count > 0:
            _, taken = self.take(count)
            count -= taken or count

    def back(self) -> None:
        """Give the line back that was taken last; once, and before anything else is taken."""
        begin = int(self._ends[self._at - 2]) if self._at > 1 else 0
        self.offset -= int(self._ends[self._at - 1]) - begin
        self._at -= 1
        self.line -= 1

    def _fill(self) -> bool:
        rest = self._held[int(self._ends[-1]) if len(self._ends) else 0 :]
        data = self._file.read(BLOCK_BYTES)
        if not data and rest:
            data = b"\n"
        self._held = rest + data
        self._ends = np.flatnonzero(np.frombuffer(self._held, np.uint8) == ord("\n")) + 1
        self._at = 0
        if self._held and (not len(self._ends) or self._ends[0] > LONGEST):
            raise InputError(f"{self.path}, line {self.line}: no line of text ends within {LONGEST} bytes: it is no text file")
        return bool(len(self._ends))


def divider_of(line: str) -> str | None:
    """What divides the values of a line: a semicolon, a comma, or None for blanks and tabs."""
    return next((mark for mark in (";", ",") if mark in line), None)


def are_numbers(line: str, columns: Sequence[str] = ()) -> bool:
    """Whether all values of a line are numbers, and there are some; those of columns that are left out may be words."""
    values = line.split(divider_of(line))
    if len(values) == len(columns):
        values = [value for value, name in zip(values, columns, strict=True) if name != SKIPPED]
    try:
        list(map(float, values))
    except ValueError:
        return False
    return bool(values)


def parse(path: Path, block: bytes, first: int, divider: str | None, width: int, used: tuple[int, ...]) -> Float:
    """Numbers of a block of lines; blank ones are left out.

    Parameters
    ----------
    path : Path
        For the error's line.
    block : bytes
        Whole lines.
    first : int
        Number of the first one in the file.
    divider : str or None
        See `divider_of`.
    width : int
        Values of a line.
    used : tuple of int
        Which of them are wanted.

    Returns
    -------
    (n, len(used)) float64 array

    Raises
    ------
    InputError
        If a line has more or fewer values, or one that is wanted is no number.
    """
    if not block.strip():
        return np.empty((0, len(used)))
    try:
        text = io.StringIO(block.decode("ascii"))
        # All columns are read where all are numbers, for then a line with more values is noticed, too.
        chosen = None if used == tuple(range(width)) else used
        values = np.loadtxt(text, np.float64, comments=None, delimiter=divider, ndmin=2, usecols=chosen)
    except (ValueError, UnicodeDecodeError) as error:
        raise _fault(path, block, first, divider, width, used) or InputError(f"{path}: {error}") from None
    if chosen is None and values.shape[1] != width:
        raise _fault(path, block, first, divider, width, used) or InputError(f"{path}: lines of {values.shape[1]} values")
    return values


def _fault(path: Path, block: bytes, first: int, divider: str | None, width: int, used: tuple[int, ...]) -> InputError | None:
    for number, line in enumerate(block.decode("utf-8", "replace").split("\n"), first):
        if not line.strip():
            continue
        values = line.split(divider)
        if len(values) != width:
            return InputError(f"{path}, line {number}: {len(values)} values where {width} are expected: {_short(line)!r}")
        for place in used:
            try:
                float(values[place])
            except ValueError:
                comma = "; write decimals with a point" if divider == ";" and "," in values[place] else ""
                return InputError(f"{path}, line {number}: {_short(values[place])!r} is not a number{comma}")
    return None


def _short(text: str) -> str:
    return text.strip() if len(text.strip()) <= 60 else text.strip()[:57] + "…"
