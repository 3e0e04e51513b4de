"""Rings of a survey as a file."""

from __future__ import annotations

from pathlib import Path

from tunneldb.csvfile import write_csv
from tunneldb.measures.rings.tables import CIRCLE_COLUMNS, Row


def write_rings(rows: list[Row], path: Path, ending: str, title: str) -> None:
    """Write rings as .csv or .xlsx; unknown values are empty."""
    named = dict.fromkeys(name for row in rows for name in row)
    header = [*(name for name in named if name not in CIRCLE_COLUMNS), *CIRCLE_COLUMNS]
    if ending == ".xlsx":
        from tunneldb.export.tables.workbook import Column, Sheet, write_workbook

        cells = [[row.get(name) for name in header] for row in rows]
        write_workbook(path, [Sheet("rings", [Column(name) for name in header], cells)], title)
        return
    path.write_text(write_csv(header, ([row.get(name) for name in header] for row in rows)), encoding="utf-8")
