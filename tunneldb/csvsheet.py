"""Opened CSV files: encoding, header, separator, comments, and the cells of each row."""

from __future__ import annotations

import codecs
import csv
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

from tunneldb.errors import InputError
from tunneldb.numerals import parse_number

if TYPE_CHECKING:
    import _csv

_SEPARATORS = (";", "\t", ",", " ")
_COMMENTS = ("#", "//")
_FOREIGN = "cp1252"
_BLOCK = 1 << 20  # bytes
_BINARY = re.compile("[\0-\x08\x0e-\x19\x1b-\x1f]")


@dataclass(frozen=True)
class Sheet:
    """Opened CSV file.

    Attributes
    ----------
    path : Path
    header : list of str
        Column names; empty if the file is.
    body : reader
        Rows below the header.
    skipped : int
        Lines above the first line of ``body``.
    decimal_comma : bool
        True if a comma may be the decimal point.
    foreign : bool
        True if the text is not Unicode, so that letters beyond ASCII may be wrong.
    """

    path: Path
    header: list[str]
    body: _csv.Reader
    skipped: int
    decimal_comma: bool
    foreign: bool

    def rows(self) -> Iterator[tuple[int, list[str]]]:
        """Yield line number and cells of each row that is not blank or a comment; it is as long as the header.

        Raises
        ------
        InputError
            If a row is longer or shorter.
        """
        width = len(self.header)
        for row in self.body:
            while len(row) > width and not row[-1].strip():
                row.pop()
            if not any(cell.strip(" \t\x1a") for cell in row):
                continue
            line = self.skipped + self.body.line_num
            if len(row) == width:
                yield line, row
            elif not row[0].lstrip().startswith(_COMMENTS):
                comma = "" if self.decimal_comma or len(row) < len(self.header) else "; write decimals with a point"
                raise InputError(
                    f"{self.path}, line {line}: {len(row)} values, but the header has {len(self.header)} columns{comma}"
                )

    def require_unicode(self, line: int, text: str) -> None:
        """Raise an InputError for a text whose letters may be wrong."""
        if self.foreign and not text.isascii():
            raise InputError(f"{self.path}, line {line}: {text!r} is not written in UTF-8; save the table as CSV UTF-8")


@contextmanager
def opened(path: Path) -> Iterator[Sheet]:
    """Open a CSV file; raise an error of one line if it cannot be read."""
    try:
        encoding = _encoding(path)
        with path.open(encoding=encoding, errors="replace", newline="") as file:
            yield _sheet(path, file, encoding == _FOREIGN)
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}") from None
    except csv.Error as error:
        raise InputError(f"{path} is not a CSV file: {error}") from None


def read_text(path: Path) -> str:
    """Return the text of a small file in UTF-8, UTF-16 with a byte order mark, or else Windows-1252.

    Raises
    ------
    InputError
        If it is not text.
    OSError
    """
    return path.read_text(_encoding(path), errors="replace")


def _encoding(path: Path) -> str:
    """Return the encoding of a text file, which is read once, in blocks."""
    with path.open("rb") as file:
        wide = file.read(2) in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
        for encoding in ("utf-16" if wide else "utf-8-sig", _FOREIGN):
            file.seek(0)
            decoder = codecs.getincrementaldecoder(encoding)("replace" if encoding == _FOREIGN else "strict")
            try:
                while block := file.read(_BLOCK):
                    if _BINARY.search(decoder.decode(block)):
                        raise InputError(f"{path} is not a text file; save the table as CSV UTF-8")
                decoder.decode(b"", final=True)
            except UnicodeDecodeError:
                continue
            break
    return encoding


def _sheet(path: Path, lines: Iterator[str], foreign: bool) -> Sheet:
    """Find the header and the separator of a table."""
    comment, header, skipped = "", "", 0
    for line in lines:
        bare = line.strip()
        if bare.startswith(_COMMENTS):
            comment = bare
        elif bare and not bare.lower().startswith("sep="):
            header = line
            break
        skipped += 1
    separator = next((one for one in _SEPARATORS if one in header.strip()), ",")

    def cells(content: str) -> list[str]:
        return [cell.strip() for cell in next(_reader([content], separator), [])]

    names, body = cells(header), chain([header] if header else [], lines)
    if comment and any(map(_is_number, names)):  # the header begins with #
        whole, without = cells(comment), cells(comment.lstrip("#/ "))
        names = without if len(without) == len(names) else whole
    else:
        next(body, None)
        skipped += 1
    while names and not names[-1]:
        names.pop()
    return Sheet(path, names, _reader(body, separator), skipped, separator != ",", foreign)


def _reader(lines: Iterable[str], separator: str) -> _csv.Reader:
    if separator == " ":  # several spaces may align columns
        lines = (" ".join(line.split()) for line in lines)
    return csv.reader(lines, delimiter=separator)


def _is_number(text: str) -> bool:
    try:
        parse_number(text.replace(",", "."))
    except ValueError:
        return False
    return True
