"""A survey into an archive."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import psycopg

from tunneldb import __version__
from tunneldb.database.schema import HEAD
from tunneldb.export.archive.container import FORMAT, ArchiveWriter, Manifest
from tunneldb.files import replacing
from tunneldb.progress import StartProgress
from tunneldb.store.archive.out import Rows, still, streams
from tunneldb.store.survey import Survey


@dataclass(frozen=True)
class Saved:
    """Content of an archive: its bytes, rows of each table, and the kilometres with points."""

    bytes: int
    rows: dict[str, int]
    kilometres: list[int]


def save_survey(conn: psycopg.Connection[Any], survey: Survey, path: Path, begin: StartProgress) -> Saved:
    """Write a survey with all that belongs to it into one file, as it is at one moment.

    Parameters
    ----------
    conn : Connection
        Idle.
    survey : Survey
    path : Path
        There whole when this returns, or not at all.
    begin : callable
        Called with each member that begins; returns a function that takes its bytes.

    Raises
    ------
    BusyError
        If a stage is running on it.
    InputError
        If points wait to be loaded, or the file cannot be written.
    """
    conn.rollback()
    rows: dict[str, int] = {}
    kms: list[int] = []
    with replacing(path) as temporary, still(conn, survey), ArchiveWriter(temporary) as archive:
        for stream in streams(conn, survey):
            held = Rows(conn, stream)
            columns = [(column.name, column.type) for column in stream.columns]
            with held.chunks() as chunks:
                archive.add(stream.member, columns, _told(chunks, begin(stream.member, None)))
            archive.counted(stream.member, held.count)
            rows[stream.table] = rows.get(stream.table, 0) + held.count
            if stream.table == "point" and stream.km is not None:
                kms.append(stream.km)
        archive.finish(
            Manifest(
                FORMAT, __version__, HEAD, dt.datetime.now(dt.UTC).isoformat(timespec="seconds"), survey.name, survey.id,
                survey.tunnel, survey.tunnel_id, survey.srid, {},
            )
        )  # fmt: skip
    return Saved(path.stat().st_size, rows, kms)


def _told(
    chunks: Iterator[bytes | bytearray | memoryview], progress: Callable[[float], None]
) -> Iterator[bytes | bytearray | memoryview]:
    for chunk in chunks:
        progress(len(chunk))
        yield chunk
