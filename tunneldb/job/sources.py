"""What a stage reads: the scan files of a kilometre, and its points of survey density."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import psycopg
from psycopg import sql

from tunneldb.database.fetch import fetch_array
from tunneldb.database.survey import Survey
from tunneldb.errors import UserError
from tunneldb.job.files import checksum
from tunneldb.job.partition import partition, rows_in
from tunneldb.scan.reader import Points

SAMPLE = 500_000
"""Points of survey density that are looked at, about."""

_FIELDS = (
    ("x", "f8", sql.SQL("public.ST_X(geom)")),
    ("y", "f8", sql.SQL("public.ST_Y(geom)")),
    ("z", "f8", sql.SQL("public.ST_Z(geom)")),
    ("time", "f8", sql.Identifier("gps_time")),
    ("scan", "i4", sql.Identifier("scan_id")),
    ("intensity", "f4", sql.Identifier("intensity")),
)


@dataclass(frozen=True)
class Source:
    """A scan file that was loaded.

    Attributes
    ----------
    path : Path
        Where it lay then.
    points : int
        Points in it.
    dimension : str or None
        The survey's intensity dimension.
    """

    path: Path
    points: int
    dimension: str | None


def sources(conn: psycopg.Connection[Any], survey: Survey, km: int) -> list[Source]:
    """Scan files of a survey that touch a kilometre, in order of chainage; each must be what was loaded.

    Raises
    ------
    UserError
        If there is none, or one is gone or has other contents than when it was loaded.
    """
    rows = conn.execute(
        "SELECT path, points, bytes, checksum FROM tunnel.scan_file"
        " WHERE survey_id = %s AND chainage_to >= %s AND chainage_from < %s ORDER BY chainage_from, name",
        (survey.id, km * 1000.0, (km + 1) * 1000.0),
    ).fetchall()
    if not rows:
        raise UserError(f"survey {survey.name} has no scan file in kilometre {km}: tunneldb load {survey.name} FILE")
    found = []
    for name, points, size, known in rows:
        path = Path(name)
        if not path.is_file():
            raise UserError(f"{path}: the scan file is gone since it was loaded; put it back or load it from elsewhere")
        if path.stat().st_size != size or checksum(path) != known:
            raise UserError(f"{path}: the scan file was changed since it was loaded; load it again")
        found.append(Source(path, points, survey.intensity_dimension))
    return found


def sample(conn: psycopg.Connection[Any], survey: Survey, km: int, count: int = SAMPLE) -> Points:
    """Read about ``count`` points of a kilometre at survey density, spread evenly; the same ones each time.

    Raises
    ------
    UserError
        If the kilometre holds no points.
    """
    # The partition by its name: no lock on its parent, whose other partitions may be swapped meanwhile.
    count_there = rows_in(conn, survey, km)
    if not count_there:
        raise UserError(f"survey {survey.name} has no points in kilometre {km}")
    rows = fetch_array(
        conn,
        _FIELDS,
        sql.SQL("FROM {} TABLESAMPLE BERNOULLI (%(share)s) REPEATABLE (1)").format(partition(survey, km)),
        {"share": min(100.0, 100.0 * count / count_there)},
    )
    return Points(
        np.column_stack([rows[axis] for axis in "xyz"]),
        rows["time"],
        rows["scan"],
        rows["intensity"],
        np.zeros(len(rows), np.uint8),
    )
