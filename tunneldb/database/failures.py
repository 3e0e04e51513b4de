"""Failures of the database, its connection or the disk, which are not bugs, each as one line."""

from __future__ import annotations

import errno

import psycopg

NO_ROOM = (errno.ENOSPC, errno.EDQUOT)
"""Error numbers of a full disk, and of an exhausted quota."""

_REPLACED = ("cache lookup failed", "relation with OID")
"""Messages of statements whose functions or views another session dropped while they ran."""

_REMOVED = ("there is no survey ", "there is no tunnel ")
"""Messages of statements about what another session removed after the command had found it."""


def describe_failure(error: Exception) -> str | None:
    """Return what happened and what to do; None for a bug.

    Parameters
    ----------
    error : Exception
        Error of the database, the disk, or any other. If it is described, its own transaction was rolled back, or, if the
        connection broke, saved or rolled back; no earlier one was.
    """
    message = first_line(error)
    match error:
        case psycopg.errors.DiskFull():
            return f"the database's disk is full, the current work was rolled back: {message}"
        case psycopg.errors.OutOfMemory():
            advice = "; raise the server's max_locks_per_transaction" if "shared memory" in str(error) else ""
            return f"the database's memory is full, the current work was rolled back: {message}{advice}"
        case psycopg.errors.InsufficientPrivilege():
            return f"the database refused: {message}; ask its owner for the role tunnel_operator"
        case psycopg.errors.QueryCanceled() | psycopg.errors.LockNotAvailable():
            return f"the database cancelled the current work, which was rolled back: {message}"
        case psycopg.errors.DeadlockDetected() | psycopg.errors.SerializationFailure():
            return f"another program was changing the same rows, the current work was rolled back: {message}; run it again"
        case psycopg.errors.InternalError_() | psycopg.errors.UndefinedTable() if any(word in message for word in _REPLACED):
            return f"tunneldb init replaced the functions, the current work was rolled back: {message}; run it again"
        case psycopg.errors.RaiseException() if message.startswith(_REMOVED):
            return f"another program removed it, the current work was rolled back: {message}"
        case psycopg.OperationalError():
            # also within COMMIT, after which nobody can tell which of both it is
            return (
                f"the connection to the database broke: {message}; the current work was saved whole or not at all:"
                " tunneldb status shows what is there"
            )
        case OSError() if error.errno in NO_ROOM:
            where = f"{error.filename}: " if error.filename else ""
            return f"{where}{error.strerror}; the current work was rolled back: free some space, and run it again"
    return None


def connection_lost(error: Exception) -> bool:
    """Return True if the server did not send the error: its side of the connection is gone."""
    return isinstance(error, psycopg.OperationalError) and (error.sqlstate is None or error.sqlstate in ("57P01", "57P02"))


def first_line(error: BaseException) -> str:
    """Return the first line of an error's message, without the position that PostgreSQL appends."""
    return str(error).strip().split("\n", 1)[0]
