"""The files of a survey, as tunnel.scan_file records them."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import psycopg

from tunneldb.database.survey import Survey
from tunneldb.errors import UserError
from tunneldb.scan.filter import FilterCounts
from tunneldb.scan.reader import ScanHeader


@dataclass(frozen=True)
class Loaded:
    """What became of a file that was to be loaded.

    Attributes
    ----------
    name : str
    state : str
        ``loaded``, ``replaced`` (there was a file of this name with other content), ``reread`` (because of a file that
        was replaced), ``unchanged`` or ``moved`` (unchanged, but it lies elsewhere now, which was noted).
    points, noise, outside, thinned, kept : int
        Its points, and what they came to; points = noise + outside + thinned + kept.
    seconds : float
        Time that it took, its share of what was done for several files at once included; 0 when unchanged.
    """

    name: str
    state: str
    points: int
    noise: int
    outside: int
    thinned: int
    kept: int
    seconds: float = 0.0


@dataclass(frozen=True)
class Recorded:
    """A row of tunnel.scan_file; low and high are the ends of its chainage, m."""

    id: int
    name: str
    path: str
    checksum: str
    low: float
    high: float


@dataclass
class Source:
    """A file to be loaded, and what came of it so far."""

    path: Path
    checksum: str
    size: int
    srid: int | None
    state: str
    counts: FilterCounts
    seconds: float = 0.0

    @property
    def name(self) -> str:
        """Name by which the survey knows it."""
        return self.path.name

    @classmethod
    def of(cls, header: ScanHeader, srid: int, state: str = "loaded") -> Source:
        """Read a file's checksum; srid is the tunnel's, with which the file's own agrees where it states one."""
        path = header.path.resolve()
        stated = None if header.crs is None else srid
        return cls(path, checksum(path), path.stat().st_size, stated, state, FilterCounts())


def checksum(path: Path) -> str:
    """SHA-256 of a file, hexadecimal."""
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise UserError(f"{path}: cannot be read: {error.strerror}") from error


def recorded_files(conn: psycopg.Connection[Any], survey: Survey) -> dict[str, Recorded]:
    """Files that a survey holds, by name."""
    rows = conn.execute(
        "SELECT id, name, path, checksum, chainage_from, chainage_to FROM tunnel.scan_file WHERE survey_id = %s",
        [survey.id],
    ).fetchall()
    return {row[1]: Recorded(*row) for row in rows}


def already_loaded(conn: psycopg.Connection[Any], source: Source, recorded: Recorded) -> Loaded:
    """Leave a file of the same content as it is, but note where it lies now, for what reads it at full density."""
    path = str(source.path)
    state = "unchanged" if recorded.path == path else "moved"
    if state == "moved":
        conn.execute("UPDATE tunnel.scan_file SET path = %s WHERE id = %s", [path, recorded.id])
    row = conn.execute(
        "SELECT points, noise, outside, thinned, kept FROM tunnel.scan_file WHERE id = %s", [recorded.id]
    ).fetchone()
    assert row is not None
    return Loaded(source.name, state, *row)


def record_file(conn: psycopg.Connection[Any], survey: Survey, source: Source) -> int:
    """Enter a file, in the place of one of the same name; returns its id. `finish_file` gives it its final counts."""
    counts = source.counts
    row = conn.execute(
        """
        INSERT INTO tunnel.scan_file (survey_id, name, path, checksum, bytes, points, noise, outside, thinned, kept,
                                      chainage_from, chainage_to, extent, srid)
        VALUES (%s, %s, %s, %s, %s, %s, %s, %s, 0, 0, %s, %s, %s, %s)
        ON CONFLICT (survey_id, name) DO UPDATE
           SET path = excluded.path, checksum = excluded.checksum, bytes = excluded.bytes, points = excluded.points,
               noise = excluded.noise, outside = excluded.outside, chainage_from = excluded.chainage_from,
               chainage_to = excluded.chainage_to, extent = excluded.extent, srid = excluded.srid
        RETURNING id
        """,
        [
            survey.id,
            source.name,
            str(source.path),
            source.checksum,
            source.size,
            counts.points,
            counts.noise,
            counts.outside,
            *counts.chainage,
            counts.extent.tolist(),
            source.srid,
        ],
    ).fetchone()
    assert row is not None
    return int(row[0])


def finish_file(conn: psycopg.Connection[Any], source: Source, file_id: int, kept: int) -> Loaded:
    """Enter how many rows a file has in the end."""
    counts = source.counts
    thinned = counts.points - counts.noise - counts.outside - kept
    conn.execute(
        "UPDATE tunnel.scan_file SET kept = %s, thinned = %s, loaded_at = clock_timestamp() WHERE id = %s",
        [kept, thinned, file_id],
    )
    return Loaded(source.name, source.state, counts.points, counts.noise, counts.outside, thinned, kept, source.seconds)


def change_kept(conn: psycopg.Connection[Any], file_id: int, change: int) -> None:
    """Enter that another file has displaced points of this one, or that some came back."""
    conn.execute(
        "UPDATE tunnel.scan_file SET kept = kept + %s, thinned = thinned - %s WHERE id = %s", [change, change, file_id]
    )
