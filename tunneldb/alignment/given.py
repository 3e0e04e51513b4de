"""The axis that a tunnel is given: a table of points, or a design alignment in LandXML or IFC."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from tunneldb.alignment.design import Design
from tunneldb.arrays import Float
from tunneldb.csvfile import read_csv
from tunneldb.errors import UserError

XYZ = ("x", "y", "z")
_SNIFFED = 1024  # bytes


@dataclass(frozen=True)
class GivenAxis:
    """An axis as it was given.

    Attributes
    ----------
    xyz : (n, 3) float array
        Vertices in growing chainage, m.
    start : float
        Chainage of the first one, m.
    design : Design or None
        The alignment that they lie on, where there is one.
    source : str or None
        File and alignment that it was read from.
    """

    xyz: Float
    start: float
    design: Design | None = None
    source: str | None = None


def read_given(path: Path, start: float | None = None, alignment: str | None = None, profile: str | None = None) -> GivenAxis:
    """Read the axis of a tunnel.

    Parameters
    ----------
    path
        CSV with x,y,z, LandXML or IFC; told apart by their content.
    start
        Chainage of its beginning, m; by default 0 of a CSV, the alignment's own of a design.
    alignment, profile
        Which of a design's alignments and of its profiles, by name; needed where there are several.

    Raises
    ------
    UserError
        When the file can't be read, holds no such alignment or several to choose from, or is no line.
    """
    kind = _kind(path)
    if kind == "csv":
        if alignment is not None or profile is not None:
            raise UserError(f"{path} is a table of points; --alignment and --profile are for LandXML and IFC")
        return GivenAxis(_read_points(path), start or 0.0)
    design = _read_design(path, kind, alignment, profile).renumbered(start)
    try:
        design.check()
    except UserError as error:
        raise UserError(f"{path}: {error}") from None
    return GivenAxis(
        design.polyline(), design.chainages[0], design, f"{path.name}: {design.name}" if design.name else path.name
    )


def _kind(path: Path) -> Literal["landxml", "ifc", "csv"]:
    try:
        with path.open("rb") as file:
            # A null is every second byte of UTF-16.
            head = file.read(_SNIFFED).replace(b"\0", b"").lstrip(b"\xef\xbb\xbf\xff\xfe \t\r\n")
    except OSError as error:
        raise UserError(f"{path}: {error.strerror}") from None
    if head.startswith(b"ISO-10303-21"):
        return "ifc"
    return "landxml" if head.startswith(b"<") else "csv"


def _read_design(path: Path, kind: Literal["landxml", "ifc"], alignment: str | None, profile: str | None) -> Design:
    from tunneldb.alignment.ifc import Ifc
    from tunneldb.alignment.landxml import LandXml

    file = LandXml(path) if kind == "landxml" else Ifc(path)
    number = _choose(path, "alignment", file.names, alignment)
    if not file.profiles[number]:
        raise UserError(
            f"{path}: alignment {file.names[number]!r} has no profile, and a tunnel's axis needs heights: export both together"
        )
    return file.design(number, _choose(path, "profile", file.profiles[number], profile))


def _choose(path: Path, what: str, names: list[str], wanted: str | None) -> int:
    """Place of the one that is wanted, or of the only one there is."""
    if not names:
        raise UserError(f"{path} holds no {what}")
    listed = ", ".join(repr(name) for name in names)
    if wanted is None:
        if len(names) > 1:
            raise UserError(f"{path} holds {len(names)} {what}s: {listed}; choose one by --{what} NAME")
        return 0
    if names.count(wanted) != 1:
        problem = "several" if wanted in names else "no"
        raise UserError(f"{path} holds {problem} {what} {wanted!r}; it has {listed}")
    return names.index(wanted)


def _read_points(path: Path) -> Float:
    """Return the vertices of an axis file; it must not turn back on itself."""
    table = read_csv(path, XYZ)
    if len(table) < 2:
        raise UserError(f"{path}: an axis needs at least 2 points, this one has {len(table)}")
    xyz = table.columns(XYZ)
    steps = np.diff(xyz[:, :2], axis=0)
    standing = np.flatnonzero(~steps.any(axis=1))
    if len(standing):
        raise table.error(int(standing[0]) + 1, "the same x,y as the point before; remove one of them")
    turns = np.flatnonzero(np.einsum("ij,ij->i", steps[1:], steps[:-1]) <= 0)
    if len(turns):
        raise table.error(int(turns[0]) + 2, "the axis turns back here; its points must be in growing chainage")
    return xyz
