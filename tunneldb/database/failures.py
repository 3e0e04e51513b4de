"""What may befall a healthy program's connection, in one line."""

from __future__ import annotations

import psycopg


def describe_failure(error: Exception) -> str | None:
    """Return what happened, and what to do; None for what is a bug.

    Parameters
    ----------
    error : Exception
        Of the database, or any other. Where one is described, its transaction was rolled back, and none of those before.
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
    return None


def first_line(error: BaseException) -> str:
    """First line of an error's message, without what PostgreSQL appends about where it was."""
    return str(error).strip().split("\n", 1)[0]
