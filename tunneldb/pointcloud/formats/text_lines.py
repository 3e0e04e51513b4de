"""Lines of numbers, read in blocks of constant memory; errors state the line."""

from __future__ import annotations

import codecs
import io
import re
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from tunneldb.arrays import Float
from tunneldb.csvfile import NO_NUMBER, number_advice
from tunneldb.errors import InputError
from tunneldb.numerals import parse_number
from tunneldb.pointcloud.formats.columns import SKIPPED

BLOCK_BYTES = 1 << 24
MAX_LINE_BYTES = 1 << 16  # bytes of a line; text files do not have longer ones
COMMENTS = ("#", "//")

_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+(?:[eE][+-]?\d+)?")
_TIDIED = (
    (re.compile(rb"(?m)^[ \t]*(?:#|//)[^\n]*"), b""),
    (re.compile(rb'["\x1a\r]'), b""),
    (re.compile(rb"\xc2\xa0"), b" "),
    (re.compile(rb"(?i)(?<![^\s;,])([+-]?)1\.#inf0*(?![^\s;,])"), rb"\1inf"),
    (re.compile(rb"(?i)(?<![^\s;,])" + NO_NUMBER.pattern.encode() + rb"(?![^\s;,])"), b"nan"),
)
"""Replacements in lines that are not plain numbers: comments, quotes, Windows' end mark, no-break spaces, missing numbers."""

_EMPTY = re.compile(rb"(?m)(?:^|(?<=[;,]))[ \t]*(?=[;,]|(?<=[;,])$)")
"""Empty values between separators."""


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
        if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
            raise InputError(f"{self.path}: its text is UTF-16; save it as UTF-8")
        if b"\0" in data:
            raise InputError(f"{self.path}, line {self.line - 1}: not a text file")
        try:
            return data.decode("utf-8-sig").strip()
        except UnicodeDecodeError:
            return data.decode("cp1252", "replace").strip()

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
            if b"\r" in self._buffer and b"\0" not in self._buffer:
                raise InputError(f"{self.path}: its lines end with CR only; save it with line ends LF or CR LF")
            raise InputError(f"{self.path}, line {self.line}: no line end within {MAX_LINE_BYTES} bytes: not a text file")
        return bool(len(self._ends))


def divider_of(line: str) -> str | None:
    """Return the separator of the values of a line: semicolon, comma, or None for blanks and tabs.

    Commas inside numbers that are separated by blanks or tabs are decimal commas.
    """
    if ";" in line or "," not in line:
        return ";" if ";" in line else None
    values = line.split()
    return None if len(values) > 1 and decimal_comma(values) else ","


def decimal_comma(values: Sequence[str]) -> str | None:
    """Return the first value with a decimal comma; None if there is none, or one is not a number."""
    commas = [value for value in values if _DECIMAL_COMMA.fullmatch(value.strip())]
    return commas[0] if commas and all(value in commas or _is_number(value) for value in values) else None


def split_values(line: str) -> tuple[list[str], str | None]:
    """Return the values of a line, stripped and without quotes, and their separator; without an empty one at the end."""
    divider = divider_of(line)
    values = [value.strip().strip('"') for value in line.split(divider)]
    return values[:-1] if divider and len(values) > 1 and not values[-1] else values, divider


def are_numbers(line: str, columns: Sequence[str] = ()) -> bool:
    """Return True if a line has values and all are numbers; values of skipped columns may be words."""
    values, _ = split_values(line)
    if len(values) == len(columns):
        values = [value for value, name in zip(values, columns, strict=True) if name != SKIPPED]
    return bool(values) and all(map(_is_number, values))


def _is_number(text: str) -> bool:
    try:
        parse_number(text)
    except ValueError:
        return NO_NUMBER.fullmatch(text) is not None
    return True


def parse(path: Path, block: bytes, first: int, divider: str | None, width: int, used: tuple[int, ...]) -> Float:
    """Parse the numbers of a block of lines; blank lines and comments are ignored, and missing numbers are NaN.

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
    # If all columns are numbers, all are read, so that lines with more values are detected.
    chosen = None if used == tuple(range(width)) else used
    try:
        values = _numbers(block, divider, chosen)
    except (ValueError, UnicodeDecodeError):
        block = _tidied(block, divider)
        if not block.strip():
            return np.empty((0, len(used)))
        try:
            values = _numbers(block, divider, chosen)
        except (ValueError, UnicodeDecodeError) as error:
            raise _fault(path, block, first, divider, width, used) or InputError(f"{path}: {error}") from None
    if chosen is None and values.shape[1] != width:
        raise _fault(path, block, first, divider, width, used) or InputError(f"{path}: lines have {values.shape[1]} values")
    return values


def _numbers(block: bytes, divider: str | None, columns: tuple[int, ...] | None) -> Float:
    text = io.StringIO(block.decode("ascii"))
    return np.loadtxt(text, np.float64, comments=None, delimiter=divider, ndmin=2, usecols=columns)


def _tidied(block: bytes, divider: str | None) -> bytes:
    """Return lines without a byte order mark, comments and quotes, and with nan for missing numbers; as many lines."""
    block = block.removeprefix(codecs.BOM_UTF8)
    for pattern, replacement in _TIDIED:
        block = pattern.sub(replacement, block)
    return block if divider is None else _EMPTY.sub(b"nan", block)


def _fault(path: Path, block: bytes, first: int, divider: str | None, width: int, used: tuple[int, ...]) -> InputError | None:
    for number, line in enumerate(block.decode("utf-8", "replace").split("\n"), first):
        if not line.strip():
            continue
        values = line.split(divider)
        if len(values) != width:
            return InputError(f"{path}, line {number}: {len(values)} values, expected {width}: {_short(line)!r}")
        for place in used:
            try:
                parse_number(values[place])
            except ValueError:
                advice = number_advice(values[place].strip())
                return InputError(f"{path}, line {number}: {_short(values[place])!r} is not a number{advice}")
    return None


def _short(text: str) -> str:
    return text.strip() if len(text.strip()) <= 60 else text.strip()[:57] + "…"
