"""Why a file or a stage failed, in kinds, and what has to be done before it is worth while to try it again."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class Cause:
    """A kind of failure.

    Attributes
    ----------
    name : str
        What kind it is.
    marks : tuple of str
        Words of which one is in each message of the kind.
    first : str
        What has to be done before another attempt; empty where nothing but time has to pass.
    """

    name: str
    marks: tuple[str, ...]
    first: str


PASSING = Cause(
    "passing",
    (
        "the database stopped the work",
        "another program was at the same rows",
        "another process is at work",
        "the connection to the database broke",
        "it was changed while it was read",
    ),
    "",
)

CAUSES = (
    Cause("database full", ("the database's disk is full",), "make room on the database's disk (tunneldb check says how much)"),
    Cause("temporary folder full", ("set TMPDIR",), "set TMPDIR to a folder on a larger disk, where the workers are started"),
    Cause(
        "disk full",
        ("No space left on device", "Disk quota exceeded"),
        "make room on the disk that is named, or of the workers",
    ),
    Cause(
        "memory",
        ("the database's memory is full", "for want of memory", "MemoryError", "Cannot allocate memory"),
        "see to more memory, or take fewer --workers",
    ),
    Cause("rights", ("the database refused:",), "let its owner grant the role tunnel_operator"),
    Cause(
        "password",
        ("password authentication failed", "no password supplied", "no pg_hba.conf entry"),
        "put the password into PGPASSFILE, where the workers are started",
    ),
    Cause("file missing", ("no such file", "is a folder"), "put the file back, or name where it lies now"),
    Cause("file unreadable", ("cannot be read: Permission denied",), "let the workers read it (chmod)"),
    Cause("file of another tunnel", ("off the given axis", "no points near the axis"), "see whether it is of this tunnel"),
    Cause(
        "coordinate system",
        ("its coordinate system is",),
        "write the file in the tunnel's coordinate system",
    ),
    Cause(
        "poses",
        ("no station for scan_id", "has no pose", "gps_time of", "no dimension 'gps_time'"),
        "give the poses that fit: tunneldb survey set --stations or --trajectory",
    ),
    Cause("intensity", ("no dimension", "is no intensity"), "say which dimension it is: tunneldb survey set --intensity"),
    Cause(
        "file damaged",
        (
            "truncated",
            "corrupt",
            "damaged",
            "cannot be read",
            "could not be read",
            "holds no points",
            "is no LAS",
            "mend the file",
        ),
        "copy the file again, or export it anew",
    ),
    PASSING,
)
"""Kinds of failures, the first that fits taken; a message that fits none is of the data or the parameters."""

PROGRAM = Cause("program", (), "report this message: it is a fault of the program, which the same input will meet again")
"""An error that has a type of Python's before it (tunneldb.stages.ledger.describe)."""

_TYPED = re.compile(r"[A-Z]\w*(Error|Exception): ")

DATA = Cause("data", (), "see to the cause: another file, a vertex of the axis, or a parameter (--set NAME=VALUE)")


_LEADING = re.compile(r"/.*?(?=: |, line )")
"""The path that a message begins with."""


def cause_of(message: str | None, paths: Iterable[str] = ()) -> Cause:
    """Return the kind of a failure by its message, as the ledger keeps it.

    Files can be called anything, ``damaged.laz`` too: what kind it is is not looked for in the path that a message begins with,
    nor in these, wherever they or their names stand.
    """
    said = message or ""
    for path in paths:
        line = " ".join(path.split())  # as messages have it
        for name in (line, line.rsplit("/", 1)[-1]):
            said = re.sub(rf"(?<!\w){re.escape(name)}(?!\w)", "", said) if name else said
    said = _LEADING.sub("", said, count=1) if said.startswith("/") else said
    unknown = PROGRAM if _TYPED.match(said) else DATA
    return next((cause for cause in CAUSES if any(mark in said for mark in cause.marks)), unknown)
