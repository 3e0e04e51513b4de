"""The tables of an inspection sheet: its leaks, and the other findings that people made."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass

from tunneldb.export.qgis.layer import SHEETS
from tunneldb.export.qgis.layout_items import CELL_MARGIN, FRAME, PAGE, ROW, Column, cut, item, key, label, table

LEAK_PAGES, FINDING_PAGES = 5, 3
"""Number of continuation pages of each table."""

MARGIN = 10.0
TOP = 24.0
"""Left edge of the strip, and top of tables on continuation pages, mm."""

FOOT = 196.0
"""Top of the foot, mm."""

CLOCK = (
    "with_variable('minutes', round(\"clock\" * 60) % 720, to_string(if(@minutes < 60, 12, floor(@minutes / 60))) || ':' "
    "|| lpad(to_string(@minutes % 60), 2, '0'))"
)
"""Clock position as in `tunneldb.export.tables.leaks.clock_label`, which QGIS cannot call; the styles have it too."""

ON_PAGE = "attribute(@atlas_feature, '{}')"
"""Column of the printed sheet."""

# As the sheet's sums count them: one that only touches its edge is not on it.
_ON_SHEET = f'"chainage_to" > {ON_PAGE.format("chainage_from")} and "chainage_from" < {ON_PAGE.format("chainage_to")}'
_LONG = "format_number(\"length\", 2) || ' m' || coalesce(', ' || format_number(\"width_mm\", 2) || ' mm', '')"  # a line
_SIZE = f'if("length" IS NOT NULL, {_LONG}, if("area" > 0, format_number("area", 2) || \' m²\', \'\'))'


@dataclass(frozen=True)
class _Words:
    """Column of text, with less space the more rows there are; omissions are marked.

    Attributes
    ----------
    heading, text : str
        Heading and expression.
    width : float
        Width, mm.
    one, more : int
        Number of letters on a single line, and on each of several lines, which break between words.
    """

    heading: str
    text: str
    width: float
    one: int
    more: int

    def column(self, lines: str) -> Column:
        """Return the column, with the expression `lines` for the number of lines of a row."""
        letters = f"if({lines} > 1, {self.more} * {lines}, {self.one})"
        return self.heading, cut(self.text, letters), self.width, 1


@dataclass(frozen=True)
class SheetTable:
    """A table of the sheets.

    Attributes
    ----------
    name : str
        Name of its rows.
    count : str
        Column of the sheets that has their number.
    columns : tuple
        Columns.
    order, condition : str
        Expressions for the order and the selection of rows.
    touching : bool
        True if only rows whose geometry touches the sheet's are listed.
    """

    name: str
    count: str
    columns: tuple[Column | _Words, ...]
    order: str
    condition: str
    touching: bool


LEAKS = SheetTable(
    "leaks", "leaks", (
        ("Leak", 'to_string("id")', 11, 2),
        ("Chainage", '"label"', 19, 2),
        ("Arc, m", 'format_number(("arc_from" + "arc_to") / 2, 1)', 10, 2),
        ("Clock", CLOCK, 9, 2),
        ("Area, m²", "if(\"area\" > 0, format_number(\"area\", 2), '')", 12.5, 2),
        ("Drop, dB", 'format_number("darkening_mean", 1)', 12.5, 2),
        ("Sure", "coalesce(round(100 * \"confidence\") || ' %', '')", 9, 2),
        ("Review", '"review"', 15, 1),
        _Words("Remark", '"note"', 23, 10, 12),
    ),
    '"chainage_from" + "chainage_to"', _ON_SHEET, True,
)  # fmt: skip

FINDINGS = SheetTable(
    "findings", "findings", (
        ("No.", 'to_string("id")', 11, 2),
        _Words("Kind", '"kind_label"', 19, 13, 13),
        ("Chainage", '"label"', 18, 2),
        ("Clock", CLOCK, 8.5, 2),
        ("Size", _SIZE, 24, 2),
        _Words("Severity", '"severity_label"', 13.4, 9, 9),
        ("State", '"state"', 13.5, 1),
        _Words("Remark", '"remark"', 17.5, 8, 10),
    ),
    '"position" * 1e7 + ("chainage_from" + "chainage_to") / 2',
    f'"listed" and {_ON_SHEET}', False,
)  # fmt: skip


@dataclass(frozen=True)
class Frames:
    """Position of a table: halves (0 left, 1 right) of pages, from the first on; on the first page it begins at `top`, mm."""

    halves: tuple[tuple[int, int], ...]
    top: float

    @classmethod
    def on(cls, first: Sequence[int], pages: Sequence[int], top: float) -> Frames:
        """Return some halves of the first page, and both of others."""
        return cls((*((0, half) for half in first), *((page, half) for page in pages for half in range(2))), top)

    def begins(self, page: int) -> float:
        """Return the top of the table on a page, mm."""
        return self.top if page == 0 else TOP

    @property
    def rows(self) -> int:
        """Rows of one line that there is room for."""
        return sum(int((FOOT - 1 - self.begins(page)) / ROW) - 1 for page, _ in self.halves)


def table_width(listed: SheetTable) -> float:
    """Return the width of a table, mm; two are side by side."""
    widths = (column.width if isinstance(column, _Words) else column[2] for column in listed.columns)
    return sum(width + 2 * CELL_MARGIN for width in widths)


def sheet_table(listed: SheetTable, source: tuple[str, str], place: Frames) -> list[ET.Element]:
    """Return a table and its frames, with a note on its last page if there are more rows than fit.

    Empty pages are not printed, except the first.

    Parameters
    ----------
    listed : SheetTable
        `LEAKS` or `FINDINGS`.
    source : (str, str)
        Id and data source of the layer whose rows it lists.
    place : Frames
        Its place.
    """
    count, width, own = ON_PAGE.format(listed.count), table_width(listed), key(SHEETS, listed.name)
    frames = []
    for page, half in place.halves:
        y, x = place.begins(page), MARGIN + half * (PAGE[0] - 2 * MARGIN - width)
        frames.append(
            item(
                SHEETS, FRAME, f"{listed.name} {2 * page + half + 1}", (x, y, width, FOOT - 1 - y), page, multiFrame=own,
                multiFrameTemplateUuid=own, hidePageIfEmpty=str(int(page > 0 and half == 0)), hideBackgroundIfEmpty="0",
            )
        )  # fmt: skip
    lines = f"floor({place.rows} / max({count}, 1))"
    columns = [column.column(lines) if isinstance(column, _Words) else column for column in listed.columns]
    rows = table(
        SHEETS, frames, source, columns, listed.order, place.rows, listed.condition, name=listed.name.capitalize(),
        touching=listed.touching, own=listed.name,
    )  # fmt: skip
    said = f"'… and ' || ({count} - {place.rows}) || ' more {listed.name}: table of the report'"
    text = f"[% if({count} > {place.rows}, {said}, '') %]"
    last = place.halves[-1][0]
    more = label(SHEETS, f"more {listed.name}", text, (MARGIN, FOOT + 1, 150, 6), 11, page=last, bold=True)
    return [*frames, rows, more]
