"""Tables as an Excel workbook (.xlsx): typed cells, a fixed header, filters; text is never a formula."""

from __future__ import annotations

import datetime as dt
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tunneldb import __version__
from tunneldb.errors import UserError

if TYPE_CHECKING:
    from xlsxwriter.format import Format
    from xlsxwriter.worksheet import Worksheet

MAX_ROWS = 1_048_576
"""Maximum number of rows of a sheet, by ECMA-376."""

MAX_CELL_LENGTH = 32_767
"""Maximum number of characters of a cell."""

_MIN_WIDTH, _MAX_WIDTH = 8, 50  # columns, in characters


@dataclass(frozen=True)
class Column:
    """A column of a sheet: its heading, and for numbers Excel's format, such as ``0.00``."""

    heading: str
    form: str | None = None


@dataclass(frozen=True)
class Sheet:
    """A sheet of a workbook: its name, columns and rows; cells are texts, numbers, truths, days, moments or empty (None)."""

    name: str
    columns: Sequence[Column]
    rows: Sequence[Sequence[Any]]


def write_workbook(path: Path, sheets: Sequence[Sheet], title: str) -> None:
    """Write sheets as a workbook; moments are in UTC.

    Raises
    ------
    UserError
        If a sheet has more rows than Excel knows.
    """
    import xlsxwriter

    for sheet in sheets:
        if len(sheet.rows) >= MAX_ROWS:
            raise UserError(
                f"{path.name}: {len(sheet.rows)} rows, but an Excel sheet has {MAX_ROWS}: write .csv, or a shorter stretch"
            )
    options = {"strings_to_formulas": False, "strings_to_urls": False, "strings_to_numbers": False}
    # whole in memory first: on a full disk the library would leave a file half open, and complain when it is collected
    packed = io.BytesIO()
    with xlsxwriter.Workbook(packed, options | {"in_memory": True}) as book:
        book.set_properties({"title": title, "comments": f"tunneldb {__version__}"})
        forms = {form: book.add_format({"num_format": form}) for form in _forms(sheets)}
        head = book.add_format({"bold": True, "bottom": 1, "text_wrap": True, "valign": "top"})
        plain = book.add_format({"valign": "top"})
        moment = book.add_format({"num_format": "yyyy-mm-dd hh:mm"})
        for sheet in sheets:
            _write_sheet(book.add_worksheet(sheet.name), sheet, forms, head, plain, moment)
    path.write_bytes(packed.getbuffer())


def _forms(sheets: Sequence[Sheet]) -> set[str]:
    return {column.form for sheet in sheets for column in sheet.columns if column.form}


def _write_sheet(page: Worksheet, sheet: Sheet, forms: dict[str, Format], head: Format, plain: Format, moment: Format) -> None:
    page.freeze_panes(1, 0)
    page.set_landscape()
    page.set_paper(9)  # A4
    page.fit_to_pages(1, 0)
    page.repeat_rows(0)
    if sheet.rows:
        page.autofilter(0, 0, len(sheet.rows), len(sheet.columns) - 1)
    for n, column in enumerate(sheet.columns):
        page.write_string(0, n, column.heading, head)
        longest = max((len(_shown(row[n])) for row in sheet.rows[:1000]), default=0)
        page.set_column(n, n, min(max(longest, len(column.heading), _MIN_WIDTH) + 2, _MAX_WIDTH))
    for y, row in enumerate(sheet.rows, start=1):
        for x, (value, column) in enumerate(zip(row, sheet.columns, strict=True)):
            _write_cell(page, y, x, value, forms[column.form] if column.form else plain, moment)


def _write_cell(page: Worksheet, y: int, x: int, value: Any, form: Format, moment: Format) -> None:
    if value is None or value == "" or (isinstance(value, float) and not math.isfinite(value)):
        return
    if isinstance(value, bool):
        page.write_boolean(y, x, value)
    elif isinstance(value, dt.datetime):  # Excel knows no zones
        page.write_datetime(y, x, value.astimezone(dt.UTC).replace(tzinfo=None, microsecond=0), moment)
    elif isinstance(value, dt.date):
        page.write_datetime(y, x, value, form)
    elif isinstance(value, (int, float, Decimal)):
        page.write_number(y, x, value, form)
    else:
        text = str(value)
        page.write_string(y, x, text if len(text) <= MAX_CELL_LENGTH else f"{text[: MAX_CELL_LENGTH - 1]}…", form)


def _shown(value: Any) -> str:
    """Return the approximate displayed text of a cell."""
    if value is None:
        return ""
    if isinstance(value, dt.datetime):
        return "2024-05-04 12:00"
    return f"{value:.3f}" if isinstance(value, float) else str(value).partition("\n")[0]
