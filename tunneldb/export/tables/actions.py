"""List of actions as CSV or as a workbook, whose columns are read again by ``tunneldb actions import``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tunneldb.csvfile import write_csv
from tunneldb.export.tables.workbook import Column, Sheet, write_workbook

_FORMS = {
    "id": "0", "finding_id": "0", "chainage_from": "0.000", "chainage_to": "0.000", "arc": "0.000", "cost": "0.00",
    "photos": "0", "due": "yyyy-mm-dd",
}  # fmt: skip
"""Formats of Excel for numbers and days."""


def write_actions(path: Path, title: str, columns: Sequence[str], rows: Sequence[dict[str, Any]]) -> None:
    """Write a list of actions: .csv, or a workbook."""
    cells = [[row[name] for name in columns] for row in rows]
    if path.suffix.lower() == ".csv":
        path.write_text(write_csv(columns, cells), encoding="utf-8")
        return
    write_workbook(path, [Sheet("Actions", [Column(name, _FORMS.get(name)) for name in columns], cells)], title)
