"""Rows of a list that state where findings could be missed, and notes and limitations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from tunneldb.store.coverage import Coverage
from tunneldb.store.remarks import REMARK, Remark


def note_rows(coverage: Coverage, remarks: Sequence[Remark], text: str) -> list[dict[str, Any]]:
    """Return the rows before a list: gaps in the search, then notes.

    Parameters
    ----------
    coverage, remarks
        Statements on the stretch of the list.
    text : str
        Column with the reason of a gap, or the note.

    Returns
    -------
    list of dict
        Values by column. ``kind`` is the state of the gap or ``remark``, and ``counted`` is False.
    """
    rows: list[dict[str, Any]] = [
        {
            "chainage_from": gap.chainage_from, "chainage_to": gap.chainage_to, "label": gap.label_from, "kind": gap.state,
            text: gap.reason, "counted": False,
        }
        for gap in coverage.gaps
    ]  # fmt: skip
    return rows + [{"kind": REMARK, text: remark.said, "counted": False} for remark in remarks]
