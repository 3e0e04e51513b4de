"""Lists of actions that were edited in a spreadsheet, back into the database: whole, or not at all."""

from __future__ import annotations

import datetime as dt
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from pathlib import Path
from typing import Any

import openpyxl
import psycopg
from openpyxl.utils.exceptions import InvalidFileException

from tunneldb.csvfile import read_header, read_rows, row_lines
from tunneldb.errors import InputError, did_you_mean
from tunneldb.numerals import parse_number
from tunneldb.store.actions import EDITABLE, READ, add_action, change_action, list_actions

COLUMNS = READ
"""Columns of a written list, in its order; those that people cannot give are not read, except id, survey and changed_at."""

_NUMBERS = ("chainage_from", "chainage_to")
_WHOLE = ("id", "finding_id")


@dataclass(frozen=True)
class Changes:
    """Result of reading a list: numbers of added, changed and unchanged actions."""

    added: int
    changed: int
    unchanged: int


def read_actions(conn: psycopg.Connection[Any], tunnel_id: int, path: Path) -> Changes:
    """Read an edited list of actions of a tunnel into the database.

    A row without id is a new action, and needs a survey. A row of an action whose values differ changes it. An action without
    a row stays.

    Raises
    ------
    InputError
        If the file cannot be read, a value is wrong, there is no such action, or it was changed by someone else since the file
        was written; with the line. Nothing is then written.
    """
    known = {row["id"]: row for row in list_actions(conn, tunnel_id)}
    added = changed = unchanged = 0
    seen: dict[int, int] = {}
    for line, cells in _rows(path):
        try:
            row = {
                name: _value(name, cell) for name, cell in cells.items() if name in (*EDITABLE, "id", "survey", "changed_at")
            }
            key = row["id"]
            if key is None:
                if not row.get("survey"):
                    raise InputError("survey: a new action needs the survey that demands it")
                add_action(conn, row["survey"], row)
                added += 1
                continue
            if key not in known:
                raise InputError(f"id: the tunnel has no action {key}; a new action has no id")
            if key in seen:
                raise InputError(f"id: action {key} is already in line {seen[key]}")
            seen[key] = line
            values = _changed(known[key], row)
            if values:
                change_action(conn, key, values)
                changed += 1
            else:
                unchanged += 1
        except InputError as error:
            raise InputError(f"{path}, line {line}: {error}") from None
    return Changes(added, changed, unchanged)


def _changed(current: dict[str, Any], row: dict[str, Any]) -> dict[str, Any]:
    """Return the values that differ from the database; refuse them if somebody changed the action since."""
    values = {name: row[name] for name in EDITABLE if name in row and not _same(row[name], current[name])}
    if not values:
        return {}
    if "changed_at" not in row:
        raise InputError("changed_at: the column is needed, because it shows whether somebody changed the action since")
    if row["changed_at"] != _stamp(current["changed_at"]):
        name, value = next(iter(values.items()))
        raise InputError(
            f"{name}: action {current['id']} was changed by {current['changed_by']} since this file was written;"
            f" it has {_shown(current[name])}, and the file {_shown(value)}: export the list again"
        )
    return values


def _same(value: Any, current: Any) -> bool:
    if isinstance(value, float) and isinstance(current, float):
        return abs(value - current) < 1e-6  # workbooks have 15 digits
    return bool(value == current)


def _shown(value: Any) -> str:
    return "no value" if value is None else str(value)


def stamped(row: dict[str, Any]) -> dict[str, Any]:
    """Return a row of a list as it is written: times in UTC, to the microsecond, as text; lengths to the micrometre."""
    lengths = {name: None if row[name] is None else round(row[name], 6) for name in (*_NUMBERS, "arc")}
    return row | lengths | {name: _stamp(row[name]) for name in ("added_at", "changed_at")}


def _stamp(moment: dt.datetime | None) -> str | None:
    return None if moment is None else moment.astimezone(dt.UTC).isoformat(timespec="microseconds")


def _rows(path: Path) -> Iterator[tuple[int, dict[str, Any]]]:
    """Return line and cells by column of each row of a CSV or a workbook's first sheet."""
    if path.suffix.lower() == ".csv":
        header = read_header(path)
        lines = list(zip(row_lines(path), read_rows(path), strict=True))
    else:
        header, lines = _sheet(path)
    for name in header:
        if name and name not in COLUMNS:
            raise InputError(
                f"{path}: there is no column {name!r}{did_you_mean(name, COLUMNS)}; there are {', '.join(COLUMNS)}"
            )
    if "id" not in header:
        raise InputError(f"{path}: the column id is missing; it is empty for a new action")
    for line, cells in lines:
        yield line, {name: cell for name, cell in zip(header, cells, strict=True) if name}


def _sheet(path: Path) -> tuple[list[str], list[tuple[int, list[Any]]]]:
    try:
        book = openpyxl.load_workbook(path, read_only=True, data_only=True)
        rows = list(book.worksheets[0].iter_rows(values_only=True)) if book.worksheets else []
        book.close()
    except (OSError, InvalidFileException, zipfile.BadZipFile, KeyError, ValueError) as error:
        raise InputError(f"{path} cannot be read as a workbook (.xlsx): {error}") from None
    if not rows:
        raise InputError(f"{path} has no row")
    header = ["" if cell is None else str(cell).strip() for cell in rows[0]]
    filled = [(line, list(cells)) for line, cells in enumerate(rows[1:], start=2) if any(cell is not None for cell in cells)]
    return header, filled


def _value(name: str, cell: Any) -> Any:
    """Return a cell as the database has it; None if it is empty."""
    if isinstance(cell, str):
        cell = cell.strip()
        # text that a spreadsheet would take as a formula was written with an apostrophe
        cell = cell[1:] if cell[:1] == "'" and cell[1:2] in "=+-@" else cell
    if cell is None or cell == "":
        return None
    if name == "due":
        return _day(cell)
    try:
        if name in (*_WHOLE, *_NUMBERS):
            value = parse_number(cell) if isinstance(cell, str) else cell + 0.0
            if name in _NUMBERS:
                return value
            if not value.is_integer():
                raise ValueError
            return round(value)
        if name == "cost":
            return Decimal(str(cell)).quantize(Decimal("0.01"))
    except (ValueError, TypeError, OverflowError, InvalidOperation):
        raise InputError(f"{name}: {cell!r} is no {'whole number' if name in _WHOLE else 'number'}") from None
    return str(cell)


def _day(cell: Any) -> dt.date:
    if isinstance(cell, dt.datetime):
        return cell.date()
    try:
        return dt.date.fromisoformat(str(cell))
    except ValueError:
        raise InputError(f"due: {cell!r} is no day; write it as 2027-03-31") from None
