"""Points of a kilometre: its partition of tunnel.point, and fragments, points of a file that wait to be loaded there.

A partition is written as a whole, from existing and new rows. A fragment is a table of its own, with rows in blocks in their
memory format, in the order of chainage: writing and reading them is copying bytes.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import closing
from typing import Any

import numpy as np
import psycopg
from psycopg import sql

from tunneldb.arrays import Bool, Int32, Int64
from tunneldb.database.copy import copy_binary
from tunneldb.database.fetch import fetch_array
from tunneldb.geometry.alignment import Alignment
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.pointcloud.prefetch import prefetch
from tunneldb.pointcloud.selection import voxel_reach
from tunneldb.pointcloud.spool import BINS_PER_KM, BINS_PER_METRE, ROW, Rows, Spool, bin_of, windows
from tunneldb.pointcloud.thinning import first_of_voxels
from tunneldb.store.point_rows import COLUMNS, pack_rows
from tunneldb.store.survey import Survey

WINDOW = 250_000  # rows read and thinned at a time
AHEAD = 32  # blocks packed ahead of those that are sent: what is packed while the next rows are read


def partition(survey: Survey, km: int, suffix: str = "") -> sql.Identifier:
    """Name of the partition of a survey's kilometre."""
    return sql.Identifier("tunnel", f"point_s{survey.id}_km{km}{suffix}")


def partition_exists(conn: psycopg.Connection[Any], survey: Survey, km: int) -> bool:
    """Return True if a survey's kilometre has points."""
    row = conn.execute("SELECT to_regclass(%s)", [partition(survey, km).as_string(conn)]).fetchone()
    return row is not None and row[0] is not None


def rows_in(conn: psycopg.Connection[Any], survey: Survey, km: int) -> int:
    """Return the number of rows of a survey's kilometre, 0 without a partition."""
    if not partition_exists(conn, survey, km):
        return 0
    row = conn.execute(sql.SQL("SELECT count(*) FROM {}").format(partition(survey, km))).fetchone()
    assert row is not None
    return int(row[0])


def read_partition(conn: psycopg.Connection[Any], survey: Survey, km: int, alignment: Alignment) -> Iterator[Rows]:
    """Yield rows of a kilometre, some at a time, with the file's id as tag.

    Their chainage is that of the given axis again, as at loading, for the stage ``segments`` sets it by the axis found.
    """
    table = partition(survey, km)
    counts = conn.execute(
        sql.SQL("SELECT floor(chainage)::int AS metre, count(*) FROM {} GROUP BY metre ORDER BY metre").format(table)
    ).fetchall()
    fields: list[tuple[str, str, sql.Composable]] = [
        ("x", "f8", sql.SQL("ST_X(geom)")),
        ("y", "f8", sql.SQL("ST_Y(geom)")),
        ("z", "f8", sql.SQL("ST_Z(geom)")),
        *((name, kind, sql.Identifier(name)) for name, kind in (("gps_time", "f8"), ("intensity", "f4"), ("scan_id", "i4"))),
        *((name, kind, sql.Identifier(name)) for name, kind in (("file_id", "i4"), ("classification", "i2"))),
    ]
    source = sql.SQL("FROM {} WHERE chainage >= %(low)s AND chainage < %(high)s").format(table)
    for low, high in _ranges(counts):
        found = fetch_array(conn, fields, source, {"low": low, "high": high})
        rows: Rows = np.empty(len(found), ROW)
        for name in ("x", "y", "z", "intensity", "scan_id", "classification"):
            rows[name] = found[name]
        rows["time"], rows["tag"] = found["gps_time"], found["file_id"]
        chainage = alignment.chainage(np.column_stack([found["x"], found["y"], found["z"]]))
        rows["chainage"] = np.clip(chainage, km * KILOMETRE, np.nextafter((km + 1) * KILOMETRE, -np.inf))
        yield rows


def _ranges(counts: list[tuple[int, int]]) -> Iterator[tuple[float, float]]:
    """Return ranges of whole metres with about WINDOW rows each."""
    low, held = None, 0
    for metre, count in counts:
        low, held = metre if low is None else low, held + count
        if held >= WINDOW:
            yield float(low), metre + 1.0
            low, held = None, 0
    if low is not None:
        yield float(low), counts[-1][0] + 1.0


def write_partition(
    conn: psycopg.Connection[Any],
    survey: Survey,
    km: int,
    parts: Sequence[tuple[Spool, int | None]],
    edge: float | None,
    file_ids: Int32,
    progress: Callable[[int], None],
    own: Callable[[Rows], Bool] | None = None,
) -> tuple[Int64, Int64]:
    """Build a kilometre's partition separately from all its rows, thinned as a whole; `swap_partition` puts it in place.

    The table is made and filled in the caller's transaction: the embedded server writes no WAL for its rows.

    Parameters
    ----------
    parts : sequence of (Spool, int or None)
        Rows of at least this kilometre, and the tag that those of a spool get; None leaves them theirs.
    edge : float or None
        Voxel edge of thinning, m; None for no thinning.
    file_ids : (k,) int32 array
        scan_file.id for each tag; tags are in the order of the files' names, which decides between points that are
        equal in all else.
    progress : callable
        Called with the number of rows looked at.
    own : callable or None
        Returns the rows in the tunnel; others are left out. None: all are.

    Returns
    -------
    two (k,) int64 arrays
        Rows written of each tag, and those left out.
    """
    begin, end = km * BINS_PER_KM, (km + 1) * BINS_PER_KM
    counts = sum((spool.counts_of(begin, end) for spool, _ in parts), np.zeros(BINS_PER_KM, np.int64))
    written, left_out = np.zeros(len(file_ids), np.int64), np.zeros(len(file_ids), np.int64)
    reach = 0 if edge is None else math.ceil(voxel_reach(edge) * BINS_PER_METRE)

    def chunks() -> Iterator[memoryview]:
        for low, high in windows(begin, counts, WINDOW):
            rows = _read(parts, max(low - reach, begin), min(high + reach, end))
            if own is not None:
                mine, bins = own(rows), bin_of(rows["chainage"])
                other = rows["tag"][~mine & (bins >= low) & (bins < high)]
                np.add(left_out, np.bincount(other, minlength=len(left_out)), out=left_out)
                rows = rows[mine]
            if edge is not None:
                stays, _ = first_of_voxels(rows, edge, np.ones(len(rows), np.bool_))
                bins = bin_of(rows["chainage"])
                rows = rows[stays & (bins >= low) & (bins < high)]
            np.add(written, np.bincount(rows["tag"], minlength=len(written)), out=written)
            yield from (block.data for block in pack_rows(survey, km, rows, file_ids))
            progress(int(counts[low - begin : high - begin].sum()))

    conn.execute("SELECT tunnel_internal.partition_new(%s, %s)", [survey.id, km])
    with closing(prefetch(chunks(), AHEAD)) as packed:
        copy_binary(conn, partition(survey, km, "_new"), COLUMNS, packed, fresh=True)
    return written, left_out


def parts_by_window(parts: Sequence[tuple[Spool, int | None]], km: int) -> Iterator[Rows]:
    """Yield rows of several spools in a kilometre, one window of chainage after the other."""
    begin, end = km * BINS_PER_KM, (km + 1) * BINS_PER_KM
    counts = sum((spool.counts_of(begin, end) for spool, _ in parts), np.zeros(BINS_PER_KM, np.int64))
    for low, high in windows(begin, counts, WINDOW):
        yield _read(parts, low, high)


def _read(parts: Sequence[tuple[Spool, int | None]], low: int, high: int) -> Rows:
    pieces = []
    for spool, tag in parts:
        rows = spool.read(low, high)
        if tag is not None:
            rows["tag"] = tag
        pieces.append(rows)
    return pieces[0] if len(pieces) == 1 else np.concatenate([*pieces, np.empty(0, ROW)])


def swap_partition(conn: psycopg.Connection[Any], survey: Survey, km: int, rows: int) -> None:
    """Replace a kilometre by the partition that `write_partition` has built; one without rows is removed.

    Call it late in a transaction: others see the old kilometre until its end, but wait for it from here on.

    Raises
    ------
    psycopg.errors.LockNotAvailable
        If others have read the survey for too long without a break.
    """
    if rows:
        conn.execute("SELECT tunnel_internal.partition_swap(%s, %s)", [survey.id, km])
        return
    conn.execute(sql.SQL("DROP TABLE {}").format(partition(survey, km, "_new")))
    if partition_exists(conn, survey, km):
        conn.execute("SELECT tunnel_internal.partition_lock(%s, %s)", [survey.id, km])
        conn.execute(sql.SQL("DROP TABLE {}").format(partition(survey, km)))


BLOCK = 131_072  # rows in a block at most, so that none is larger than 8 MB


def write_fragments(conn: psycopg.Connection[Any], survey: Survey, file_id: int, spool: Spool) -> dict[int, int]:
    """Write the rows of a file as fragments, in the caller's transaction.

    Parameters
    ----------
    spool : Spool
        Rows of the file alone.

    Returns
    -------
    dict of int to int
        Number of rows of each kilometre that has any.
    """
    held = spool.kilometres()
    for km in held:
        conn.execute("SELECT tunnel_internal.fragment_create(%s, %s, %s)", [survey.id, file_id, km])
        copy_binary(conn, _table(survey, file_id, km), ("number", "rows"), _blocks(spool, km), fresh=True)
    return held


def read_fragment(
    conn: psycopg.Connection[Any], survey: Survey, file_id: int, km: int, tag: int
) -> Generator[Rows, None, None]:
    """Yield rows of a fragment, block by block in the order of chainage, with this tag.

    The connection is busy until the last one has come, or the generator is closed.
    """
    query = sql.SQL("SELECT rows FROM {} ORDER BY number").format(_table(survey, file_id, km))
    with conn.cursor(binary=True) as cursor:
        for (block,) in cursor.stream(query):
            rows: Rows = np.frombuffer(block, ROW).copy()
            rows["tag"] = tag
            yield rows


def drop_fragments(conn: psycopg.Connection[Any], survey: Survey, file_ids: Iterable[int], kms: Iterable[int]) -> None:
    """Drop the fragments of files in kilometres, if there are any."""
    kms = list(kms)
    for file_id in file_ids:
        for km in kms:
            conn.execute(sql.SQL("DROP TABLE IF EXISTS {}").format(_table(survey, file_id, km)))


def _table(survey: Survey, file_id: int, km: int) -> sql.Identifier:
    return sql.Identifier("tunnel", f"fragment_s{survey.id}_f{file_id}_km{km}")


def _blocks(spool: Spool, km: int) -> Iterator[bytes | memoryview]:
    first = km * BINS_PER_KM
    number = 0
    for low, high in windows(first, spool.counts_of(first, first + BINS_PER_KM), BLOCK // 2):
        rows = spool.read(low, high)
        for at in range(0, len(rows), BLOCK):
            block = rows[at : at + BLOCK]
            yield struct.pack(">hiii", 2, 4, number, block.nbytes)
            yield block.view(np.uint8).data
            number += 1
