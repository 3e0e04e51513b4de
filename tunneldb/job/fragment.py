"""Fragments: what was read of a file and waits to be loaded into a kilometre, a table for each.

Rows lie packed in blocks as they lie in memory, in the order of chainage: writing and reading them is copying bytes.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
import psycopg
from numpy.typing import NDArray
from psycopg import sql

from tunneldb.database.copy import copy_binary
from tunneldb.database.survey import Survey
from tunneldb.scan.spool import BINS_PER_KM, ROW, Rows, Spool, windows

BLOCK = 131_072  # rows in a block at most, so that none is larger than 8 MB

# What of a row is stored; its tag is in the table's name. The order of bytes is this machine's, stated for the others.
_STORED = np.dtype([(name, ROW[name].newbyteorder("<")) for name in ROW.names or () if name != "tag"])


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
    first, counts = spool.counts()
    held: dict[int, int] = {}
    for km in np.unique(np.floor_divide(first + np.flatnonzero(counts), BINS_PER_KM)).tolist():
        conn.execute("SELECT tunnel_api.fragment_create(%s, %s, %s)", [survey.id, file_id, km])
        begin = max(km * BINS_PER_KM - first, 0)
        part = counts[begin : max((km + 1) * BINS_PER_KM - first, 0)]
        copy_binary(conn, _table(survey, file_id, km), ("number", "rows"), _blocks(spool, first + begin, part), fresh=True)
        held[km] = int(part.sum())
    return held


def read_fragment(conn: psycopg.Connection[Any], survey: Survey, file_id: int, km: int, tag: int) -> Iterator[Rows]:
    """Rows of a fragment, block by block in the order of chainage, with this tag.

    The connection is busy until the last one has come.
    """
    query = sql.SQL("SELECT rows FROM {} ORDER BY number").format(_table(survey, file_id, km))
    with conn.cursor(binary=True) as cursor:
        for (block,) in cursor.stream(query):
            stored = np.frombuffer(block, _STORED)
            rows: Rows = np.empty(len(stored), ROW)
            for name in _STORED.names or ():
                rows[name] = stored[name]
            rows["tag"] = tag
            yield rows


def drop_fragments(conn: psycopg.Connection[Any], survey: Survey, file_ids: Iterable[int], kms: Iterable[int]) -> None:
    """Drop the fragments of files in kilometres, where there are any."""
    kms = list(kms)
    for file_id in file_ids:
        for km in kms:
            conn.execute(sql.SQL("DROP TABLE IF EXISTS {}").format(_table(survey, file_id, km)))


def _table(survey: Survey, file_id: int, km: int) -> sql.Identifier:
    return sql.Identifier("tunnel", f"fragment_s{survey.id}_f{file_id}_km{km}")


def _blocks(spool: Spool, first: int, counts: NDArray[np.int64]) -> Iterator[bytes]:
    number = 0
    for low, high in windows(first, counts, BLOCK // 2):
        rows = spool.read(low, high)
        for part in np.array_split(rows, max(1, math.ceil(len(rows) / BLOCK))):
            stored = np.empty(len(part), _STORED)
            for name in _STORED.names or ():
                stored[name] = part[name]
            yield struct.pack(">hiii", 2, 4, number, stored.nbytes) + stored.tobytes()
            number += 1
