"""The peer: the five stages of Gonçalves et al. (2012) in plain SQL, as their wording suggests them.

Rows are loaded one by one as text, the points lie in one table with a GiST index, each stage is one file of
SQL. It is written to be fair: statistics are up to date, and nothing is slower than the wording makes it.

There are two of them, which differ in stage 1. The plain one joins buffers and points as one would write it
down, and goes on until no vertex moves any more. The careful one knows the planner: it has each buffer made
once, not once for every point, and is content when the vertices rest on average.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import laspy
import numpy as np
import psycopg

SRID = 25830  # as in the SQL
TOLERANCE = 0.01  # m, of the axis
MOST_PASSES = 10
FOLDER = Path(__file__).parent


@dataclass
class PeerResult:
    """Seconds of each stage, and what came out."""

    seconds: dict[str, float] = field(default_factory=dict)
    points: int = 0
    projected: int = 0
    axis_passes: int = 0

    @property
    def total(self) -> float:
        return sum(self.seconds.values())


def run(dsn: str, files: list[Path], axis: Path, *, careful: bool) -> PeerResult:
    """Load files and run stages 1, 3, 4 and 5; the schema ``peer`` of the database is replaced.

    The pass of stage 1 is repeated until the vertices move by no more than `TOLERANCE` metres: each between the
    first and the last (these two see half a buffer and are never still), or, with `careful`, all on average. It is
    given up after `MOST_PASSES`: the mean of the points runs into each niche that comes by, and some never rest.
    """
    result = PeerResult()
    with psycopg.connect(dsn) as connection:
        _script(connection, "0_tables")
        _insert_axis(connection, axis)
        with _timed(result, "load"):
            result.points = sum(_load(connection, file) for file in files)
        with _timed(result, "index"):
            _script(connection, "0_index")
        with _timed(result, "axis"):
            _script(connection, "1_axis_start")
            while result.axis_passes < MOST_PASSES:
                _axis_pass(connection, careful)
                result.axis_passes += 1
                if _moved(connection, careful) <= TOLERANCE:
                    break
        for number, stage in ((3, "segments"), (4, "sections"), (5, "projection")):
            with _timed(result, stage):
                _script(connection, f"{number}_{stage}")
        result.projected = _one(connection, b"SELECT count(*) FROM peer.projected")
    return result


@contextmanager
def _timed(result: PeerResult, stage: str) -> Iterator[None]:
    """Add the seconds of a block to a result."""
    start = time.perf_counter()
    yield
    result.seconds[stage] = time.perf_counter() - start


def _script(connection: psycopg.Connection, name: str) -> None:
    connection.execute((FOLDER / f"{name}.sql").read_bytes())
    connection.commit()


def _one(connection: psycopg.Connection, query: bytes) -> int:
    row = connection.execute(query).fetchone()
    assert row is not None
    return int(row[0])


def _axis_pass(connection: psycopg.Connection, careful: bool) -> None:
    statement = (FOLDER / "1_axis_pass.sql").read_bytes()
    if careful:
        statement = statement.replace(b"buffer AS (", b"buffer AS MATERIALIZED (")
    connection.execute(statement)
    connection.commit()


def _moved(connection: psycopg.Connection, careful: bool) -> float:
    inner = b"SELECT max(moved) FROM peer.axis WHERE n > 0 AND n < (SELECT max(n) FROM peer.axis)"
    row = connection.execute(b"SELECT avg(moved) FROM peer.axis" if careful else inner).fetchone()
    assert row is not None
    return float(row[0])


def _insert_axis(connection: psycopg.Connection, axis: Path) -> None:
    vertices = np.loadtxt(axis, delimiter=",", skiprows=1)
    line = ", ".join(f"{x:.4f} {y:.4f} {z:.4f}" for x, y, z in vertices)
    connection.execute("INSERT INTO peer.given_axis VALUES (%s)", (f"SRID={SRID};LINESTRING Z ({line})",))
    connection.commit()


def _load(connection: psycopg.Connection, file: Path) -> int:
    """Load one LAZ file, row by row, as text; return its number of points."""
    las = laspy.read(file)
    columns = ("x", "y", "z", "intensity", "gps_time", "point_source_id")
    rows = zip(*(np.asarray(las[name]).tolist() for name in columns), strict=True)
    statement = "COPY peer.point (geom, intensity, gps_time, scan_id) FROM STDIN"
    with connection.cursor() as cursor, cursor.copy(statement) as copy:
        for x, y, z, intensity, gps_time, scan_id in rows:
            copy.write_row((f"SRID={SRID};POINT Z ({x:.4f} {y:.4f} {z:.4f})", intensity, gps_time, scan_id))
    connection.commit()
    return len(las.points)
