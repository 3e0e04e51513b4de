"""Workbook of the findings of a stretch that count, as ``tunneldb findings SURVEY -o FILE.xlsx`` writes it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import psycopg

from tunneldb.export.tables.finding_counts import count_findings, sum_groups
from tunneldb.export.tables.findings import FindingList
from tunneldb.export.tables.workbooks import write_findings
from tunneldb.store.coverage import read_coverage
from tunneldb.store.dry_regions import read_dry_regions
from tunneldb.store.finding_kinds import read_kinds, read_severities, read_wet_kinds
from tunneldb.store.findings import COUNTED, Chosen, read_findings
from tunneldb.store.remarks import read_remarks
from tunneldb.store.survey import Survey


def write_stretch_workbook(conn: psycopg.Connection[Any], survey: Survey, low: float, high: float, path: Path) -> None:
    """Write the findings between two chainages, m, with the statements on the stretch."""
    fitting = read_findings(conn, survey, "unrolled", Chosen((), (), (), low, high, None, 0.0, 0))
    listed = [row for row in fitting if row.state in COUNTED]
    others = [row for row in fitting if row.state not in COUNTED]
    statements = read_coverage(conn, survey, low, high), read_remarks(conn, survey, low, high)
    counts = sum_groups(count_findings(fitting, read_kinds(conn)), read_wet_kinds(conn))
    regions = read_dry_regions(conn, survey, low, high)
    write_findings(path, survey.name, FindingList(listed, *statements), others, counts, read_severities(conn), regions)
