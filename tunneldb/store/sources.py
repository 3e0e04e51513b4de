"""Input of a stage: the scan files of a kilometre, and its points of survey density."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import psycopg
from psycopg import sql

from tunneldb.arrays import Float
from tunneldb.database.fetch import fetch_array
from tunneldb.errors import UserError
from tunneldb.geometry.units import Units
from tunneldb.pointcloud.reader import Points, ScanSource
from tunneldb.store.partition import partition, partition_exists, rows_in
from tunneldb.store.scan_files import checksum
from tunneldb.store.survey import Survey

SAMPLE = 500_000
"""Approximate number of points in a sample of survey density."""

_FIELDS = (
    ("x", "f8", sql.SQL("public.ST_X(geom)")),
    ("y", "f8", sql.SQL("public.ST_Y(geom)")),
    ("z", "f8", sql.SQL("public.ST_Z(geom)")),
    ("time", "f8", sql.Identifier("gps_time")),
    ("scan", "i4", sql.Identifier("scan_id")),
    ("intensity", "f4", sql.Identifier("intensity")),
)


def sources(conn: psycopg.Connection[Any], survey: Survey, km: int) -> list[ScanSource]:
    """Return the scan files of a survey that touch a kilometre, in order of chainage; they must be unchanged.

    A file's checksum is read once in the life of a process, and once more whenever its size or time of change is another.

    Raises
    ------
    UserError
        If there is none, or one is gone or has other content than at loading.
    """
    rows = conn.execute(
        "SELECT f.path, f.bytes, f.checksum, k.points, f.unit, f.height_unit FROM tunnel.scan_file f"
        " JOIN tunnel.file_km k ON k.file_id = f.id"
        " WHERE f.survey_id = %s AND k.km = %s AND k.loaded_at IS NOT NULL AND NOT isempty(k.points)"
        " ORDER BY f.chainage_from, f.name",
        (survey.id, km),
    ).fetchall()
    if not rows:
        raise UserError(f"survey {survey.name} has no scan file in kilometre {km}: tunneldb load {survey.name} FILE")
    found = []
    for name, size, known, ranges, unit, height_unit in rows:
        path = unchanged_file(name, size, known)
        parts = [(part.lower, part.upper) for part in ranges]
        found.append(ScanSource(path, parts, survey.intensity_dimension, Units(unit, height_unit)))
    return found


def unchanged_file(name: str, size: int, known: str) -> Path:
    """Return the path of a scan file, after checking the size and the checksum with which it was loaded.

    Raises
    ------
    UserError
        If it is gone or has other contents.
    """
    path = Path(name)
    if not path.is_file():
        raise UserError(f"{path}: the scan file is gone since it was loaded; put it back or load it from elsewhere")
    status = path.stat()
    if status.st_size != size or _checksum(path, status.st_mtime_ns, size) != known:
        raise UserError(f"{path}: the scan file was changed since it was loaded; load it again")
    return path


@cache
def _checksum(path: Path, changed: int, size: int) -> str:
    """Return the checksum of a file with this modification time and size."""
    return checksum(path)


def sample(conn: psycopg.Connection[Any], survey: Survey, km: int, count: int = SAMPLE) -> Points:
    """Read about ``count`` points of a kilometre at survey density, spread evenly; the same ones each time.

    Raises
    ------
    UserError
        If the kilometre has no points.
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


def load_points(conn: psycopg.Connection[Any], survey: Survey, km: int, begin: float, end: float) -> tuple[Float, int]:
    """Read the points of a kilometre, in the order of its rows, and after them those of its neighbours between two chainages.

    Returns
    -------
    points : (n, 3) float array
        m.
    own : int
        Number of the kilometre's own points.

    Raises
    ------
    UserError
        If it has none.
    """
    limits = {km: "true", km - 1: "chainage >= %(begin)s", km + 1: "chainage < %(end)s"}
    parts = []
    # Rolled back for the sake of its locks: of two neighbours that held each other's points none could swap in its own.
    with conn.transaction(force_rollback=True):
        conn.execute("SET LOCAL synchronize_seqscans = off")  # row by row, from the first one
        conn.execute("SET LOCAL max_parallel_workers_per_gather = 0")
        for part, limit in limits.items():
            if partition_exists(conn, survey, part):
                source = sql.SQL("FROM {} WHERE ").format(partition(survey, part)) + sql.SQL(limit)
                rows = fetch_array(conn, _FIELDS[:3], source, {"begin": begin, "end": end})
                parts.append(np.column_stack([rows[axis] for axis in "xyz"]))
            elif part == km:
                raise UserError(f"survey {survey.name} has no points in kilometre {km}")
    return np.concatenate(parts), len(parts[0])
