"""Remarks on a survey's results, from function `tunnel_api.remarks`, the same for every document."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import psycopg
from psycopg.rows import class_row

from tunneldb.store.survey import Survey

REMARK = "remark"
"""Kind of the rows of a list of findings that are notes."""


@dataclass(frozen=True)
class Remark:
    """Remark on a scan file, or on a stage of some kilometres.

    Attributes
    ----------
    file : str or None
        Name of the scan file.
    stage : str
        Stage that says so.
    kilometres : list of int
        Empty for a file.
    remark : str
        Text of the remark.
    said : str
        The same, after the file or the kilometres and stage that it is about.
    """

    file: str | None
    stage: str
    kilometres: list[int]
    remark: str
    said: str


def read_remarks(conn: psycopg.Connection[Any], survey: Survey, low: float = -math.inf, high: float = math.inf) -> list[Remark]:
    """Read the remarks on the results between two chainages, m: of files first, then of kilometres."""
    with conn.cursor(row_factory=class_row(Remark)) as cursor:
        return cursor.execute(
            "SELECT file, stage, kilometres, remark, said FROM tunnel_api.remarks(%s, %s, %s)", [survey.id, low, high]
        ).fetchall()
