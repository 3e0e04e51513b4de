"""What a reader of a survey's results is to know: view `tunnel_api.remark`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import psycopg
from psycopg.rows import class_row

from tunneldb.store.survey import Survey


@dataclass(frozen=True)
class Remark:
    """What is to be known of a scan file, or of a stage of some kilometres.

    Attributes
    ----------
    file : str or None
        Name of the scan file.
    stage : str
        Stage that says so.
    kilometres : list of int
        Empty for a file.
    remark : str
    """

    file: str | None
    stage: str
    kilometres: list[int]
    remark: str


def read_remarks(conn: psycopg.Connection[Any], survey: Survey, first: int = -1_000_000, last: int = 1_000_000) -> list[Remark]:
    """Read what is to be known of all files of a survey and of the kilometres from first to last; files first."""
    with conn.cursor(row_factory=class_row(Remark)) as cursor:
        return cursor.execute(
            "SELECT file, stage, coalesce(array_agg(km ORDER BY km) FILTER (WHERE km IS NOT NULL), '{}') AS kilometres, remark"
            " FROM tunnel_api.remark WHERE survey_id = %s AND (km IS NULL OR km BETWEEN %s AND %s)"
            " GROUP BY file, stage, remark ORDER BY file NULLS LAST, min(km), stage, remark",
            [survey.id, first, last],
        ).fetchall()
