"""What may befall a healthy program, its connection or its disk, in one line."""

from __future__ import annotations

import errno

import psycopg

NO_ROOM = (errno.ENOSPC, errno.EDQUOT)
"""A disk that is full, or a quota that is used up."""


def describe_failure(error: Exception) -> str | None:
    """Return what happened, and what to do; None for what is a bug.

    Parameters
    ----------
    error : Exception
        Of the database, the disk, or any other. Where one is described, its transaction was rolled back, and none of those
        before.
    """
    said = first_line(error)
    match error:
        case psycopg.errors.DiskFull():
            return f"the database's disk is full, what was under way is undone: {said}"
        case psycopg.errors.OutOfMemory():
            mend = "; raise the server's max_locks_per_transaction" if "shared memory" in str(error) else ""
            return f"the database's memory is full, what was under way is undone: {said}{mend}"
        case psycopg.errors.InsufficientPrivilege():
            return f"the database refused: {said}; ask its owner for the role tunnel_operator"
        case psycopg.errors.QueryCanceled() | psycopg.errors.LockNotAvailable():
            return f"the database stopped the work, what was under way is undone: {said}"
        case psycopg.errors.DeadlockDetected() | psycopg.errors.SerializationFailure():
            return f"another program was at the same rows, what was under way is undone: {said}; run it again"
        case psycopg.OperationalError():
            return f"the connection to the database broke, what was under way is undone: {said}"
        case OSError() if error.errno in NO_ROOM:
            where = f"{error.filename}: " if error.filename else ""
            return f"{where}{error.strerror}; what was under way is undone: make room, and run it again"
    return None


def connection_lost(error: Exception) -> bool:
    """Whether an error is none that the server has answered: its side of the connection is gone."""
    return isinstance(error, psycopg.OperationalError) and (error.sqlstate is None or error.sqlstate in ("57P01", "57P02"))


def first_line(error: BaseException) -> str:
    """First line of an error's message, without what PostgreSQL appends about where it was."""
    return str(error).strip().split("\n", 1)[0]
