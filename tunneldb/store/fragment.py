"""Fragments: what was read of a file and waits to be loaded into a kilometre, a table for each.

Rows lie packed in blocks as they lie in memory, in the order of chainage: writing and reading them is copying bytes.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
import psycopg
from psycopg import sql

from tunneldb.database.copy import copy_binary
from tunneldb.pointcloud.spool import BINS_PER_KM, ROW, Rows, Spool, windows
from tunneldb.store.survey import Survey

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
        conn.execute("SELECT tunnel_api.fragment_create(%s, %s, %s)", [survey.id, file_id, km])
        copy_binary(conn, _table(survey, file_id, km), ("number", "rows"), _blocks(spool, km), fresh=True)
    return held


def read_fragment(conn: psycopg.Connection[Any], survey: Survey, file_id: int, km: int, tag: int) -> Iterator[Rows]:
    """Rows of a fragment, block by block in the order of chainage, with this tag.

    The connection is busy until the last one has come.
    """
    query = sql.SQL("SELECT rows FROM {} ORDER BY number").format(_table(survey, file_id, km))
    with conn.cursor(binary=True) as cursor:
        for (block,) in cursor.stream(query):
            rows: Rows = np.frombuffer(block, ROW).copy()
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
