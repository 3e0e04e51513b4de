"""Causes why a file or a stage failed, and what to do before another attempt."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class Cause:
    """Kind of failure.

    Attributes
    ----------
    name : str
        Name of the kind.
    marks : tuple of str
        Phrases; each message of the kind contains one of them.
    first : str
        Action before another attempt; empty if only time has to pass.
    """

    name: str
    marks: tuple[str, ...]
    first: str


PASSING = Cause(
    "passing",
    (
        "the database cancelled the current work",
        "another program was changing the same rows",
        "another process is at work",
        "the connection to the database broke",
        "changed while it was read",
    ),
    "",
)

CAUSES = (
    Cause(
        "database full", ("the database's disk is full",), "free space on the database's disk (tunneldb check says how much)"
    ),
    Cause("temporary folder full", ("set TMPDIR",), "set TMPDIR to a folder on a larger disk, where the workers are started"),
    Cause(
        "disk full",
        ("No space left on device", "Disk quota exceeded"),
        "free space on the named disk, or on that of the workers",
    ),
    Cause(
        "memory",
        ("the database's memory is full", "for lack of memory", "MemoryError", "Cannot allocate memory"),
        "provide more memory, or use fewer --workers",
    ),
    Cause("rights", ("the database refused:",), "ask its owner to grant the role tunnel_operator"),
    Cause(
        "password",
        ("password authentication failed", "no password supplied", "no pg_hba.conf entry"),
        "put the password into PGPASSFILE, where the workers are started",
    ),
    Cause("file missing", ("no such file", "is a folder"), "restore the file, or pass its present path"),
    Cause("file unreadable", ("cannot be read: Permission denied",), "make it readable for the workers (chmod)"),
    Cause(
        "file of another tunnel",
        ("off the given axis", "no points near the axis"),
        "pass only files of this tunnel, in its coordinate system",
    ),
    Cause(
        "coordinate system",
        ("its coordinate system is",),
        "write the file in the tunnel's coordinate system",
    ),
    Cause(
        "poses",
        ("no station for scan_id", "has no pose", "gps_time of", "no dimension 'gps_time'"),
        "pass the matching poses: tunneldb survey set SURVEY --stations FILE, or --trajectory FILE",
    ),
    Cause(
        "intensity",
        ("no dimension", "is no intensity", "cannot be the intensity"),
        "name the dimension: tunneldb survey set SURVEY --intensity DIMENSION",
    ),
    Cause(
        "file damaged",
        (
            "truncated",
            "corrupt",
            "damaged",
            "cannot be read",
            "could not be read",
            "holds no points",
            "is not LAS",
            "is NaN or infinite",
            "invalid pose",
            "export the file again",
            "are not numbers",
        ),
        "copy the file again, or export it again",
    ),
    PASSING,
)
"""Kinds of failures; the first match is used. A message without a match is about the data or the parameters."""

PROGRAM = Cause("program", (), "report this message; it is a bug of the program, and will occur again with the same input")
"""Error whose message begins with a Python type (tunneldb.stages.ledger.describe)."""

_TYPED = re.compile(r"[A-Z]\w*(Error|Exception): ")

DATA = Cause("data", (), "fix the cause: another file, a vertex of the axis, or a parameter (--set NAME=VALUE)")


_LEADING = re.compile(r"/.*?(?=: |, line )")
"""Path at the beginning of a message."""


def cause_of(message: str | None, paths: Iterable[str] = ()) -> Cause:
    """Return the kind of a failure from its message, as stored in the ledger.

    Files can have any name, even ``damaged.laz``. So the phrases are not searched in the path at the beginning of the
    message, nor in ``paths`` or their names elsewhere.
    """
    text = message or ""
    for path in paths:
        line = " ".join(path.split())  # as in messages
        for name in (line, line.rsplit("/", 1)[-1]):
            text = re.sub(rf"(?<!\w){re.escape(name)}(?!\w)", "", text) if name else text
    text = _LEADING.sub("", text, count=1) if text.startswith("/") else text
    unknown = PROGRAM if _TYPED.match(text) else DATA
    return next((cause for cause in CAUSES if any(mark in text for mark in cause.marks)), unknown)
