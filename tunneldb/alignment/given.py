"""Given axis of a tunnel: a table of points, lines of a drawing or a map, or a design alignment."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from tunneldb.alignment.design import Design
from tunneldb.alignment.drawing import read_vector
from tunneldb.alignment.dxf import read_dxf
from tunneldb.alignment.units import UNITS
from tunneldb.arrays import Float
from tunneldb.csvfile import find_column, read_csv, read_header
from tunneldb.errors import InputError, UserError

XYZ = ("x", "y", "z")
MAX_STEP = 1e5
"""Greatest distance between two vertices of a given axis, m; longer than any tunnel."""

MAX_GRADE = 2.0
"""Greatest grade of a given axis, m of height per m in plan, beyond the first metre of height; chainage is length in plan."""

MIN_TRAJECTORY_STEP = 5.0
"""Least distance between points of a trajectory that become vertices of the axis, m."""

_SNIFFED = 1024  # bytes
_GIS = (b"SQLite format 3\0", b"\0\0\x27\x0a", b"fgb\x03fgb", b"{")  # GeoPackage, Shapefile, FlatGeobuf, GeoJSON
_UTF16 = (b"\xff\xfe", b"\xfe\xff")
_OTHER_FORMATS = {
    b"LASF": "is a scan, not an axis; --axis auto FILE... finds the axis in scans",
    b"ASTM-E57": "is a scan, not an axis; --axis auto FILE... finds the axis in scans",
    b"AC10": "is a DWG drawing; save it as DXF",
    b"\x08\x09\xfe": "is a DGN drawing; save it as DXF",
    b"\xd0\xcf\x11\xe0": "is an Excel workbook or a DGN drawing; save the table as CSV, the drawing as DXF",
    b"%PDF": "is a PDF; export its drawing as DXF, or its table as CSV",
    b"PK\x03\x04": "is a ZIP archive or a spreadsheet; unpack it, or save the table as CSV",
}

Kind = Literal["landxml", "ifc", "dxf", "gis", "csv"]


@dataclass(frozen=True)
class GivenAxis:
    """Given axis.

    Attributes
    ----------
    xyz : (n, 3) float array
        Vertices in ascending chainage, m; heights are NaN if it has none.
    start : float
        Chainage of the first vertex, m.
    design : Design or None
        Alignment of the vertices, if there is one.
    source : str or None
        File and alignment of its origin.
    notes : tuple of str
        Notes for the user about the import.
    """

    xyz: Float
    start: float
    design: Design | None = None
    source: str | None = None
    notes: tuple[str, ...] = ()

    @property
    def has_heights(self) -> bool:
        """True if it is a line in space, not only in plan."""
        return bool(np.isfinite(self.xyz[:, 2]).all())


def read_given(
    path: Path,
    start: float | None = None,
    alignment: str | None = None,
    profile: str | None = None,
    *,
    layer: str | None = None,
    unit: str | None = None,
    srid: int | None = None,
    reverse: bool = False,
) -> GivenAxis:
    """Read the axis of a tunnel.

    Parameters
    ----------
    path
        CSV with x,y,z; GeoPackage, Shapefile, GeoJSON, FlatGeobuf or DXF with lines; LandXML or IFC. The format is detected
        from the content.
    start
        Chainage of its start, m; by default 0, or the alignment's own for a design.
    alignment, profile
        Names of a design's alignment and of its profile; required if there are several. For separate lines, the number of
        the line.
    layer
        Layer of a drawing or a map.
    unit
        Unit of lengths in a LandXML file or a drawing, a name in `tunneldb.alignment.units.UNITS`; None: as in the file.
    srid
        EPSG code with which the file's coordinate system is compared, if it states one; None: not checked.
    reverse
        True to reverse the direction of chainage.

    Raises
    ------
    InputError
        If the file can't be read, has no such alignment or several to choose from, or does not contain a line.
    """
    kind = _kind(path)
    _refuse_options(path, kind, {"--alignment": alignment, "--profile": profile, "--axis-layer": layer, "--axis-unit": unit})
    if kind in ("landxml", "ifc"):
        if reverse:
            raise InputError(
                f"{path} is a design alignment, whose chainage has its own direction; for stations that decrease "
                "along the alignment use --stationing"
            )
        return _given_design(path, kind, start, alignment, profile, unit)
    if kind == "csv":
        given = _read_points(path)
    else:
        drawn = read_dxf(path, layer, UNITS[unit] if unit else None) if kind == "dxf" else read_vector(path, layer, srid)
        line = drawn.choose(path, alignment)
        _require_forward(line, lambda row, text: InputError(f"{path}: at {line[row, 0]:.2f},{line[row, 1]:.2f} {text}"))
        given = GivenAxis(line, 0.0, source=f"{path.name}: {drawn.layer}", notes=drawn.notes)
    return replace(given, xyz=given.xyz[::-1] if reverse else given.xyz, start=start or 0.0)


def _kind(path: Path) -> Kind:
    try:
        with path.open("rb") as file:
            head = file.read(_SNIFFED)
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}") from None
    for magic, why in _OTHER_FORMATS.items():
        if head.startswith(magic):
            raise InputError(f"{path} {why}")
    if path.suffix.lower() in (".dbf", ".prj", ".cpg") and (whole := path.with_suffix(".shp")).is_file():
        raise InputError(f"{path} is one file of a Shapefile; pass {whole}")
    wide = head.startswith(_UTF16)
    # A null is every second byte of UTF-16.
    bare = head.removeprefix(b"\xef\xbb\xbf").lstrip(b" \t\r\n")
    letters = head.replace(b"\0", b"").lstrip(b"\xef\xbb\xbf\xff\xfe \t\r\n")
    if letters.startswith(b"<"):
        return "landxml"
    kind: Kind = "csv"
    if head.startswith(b"AutoCAD Binary DXF") or re.match(rb"999\s|0\s+SECTION\s", letters if wide else bare):
        kind = "dxf"
    elif bare.startswith(_GIS) or (wide and letters.startswith(b"{")):
        kind = "gis"
    elif letters.startswith(b"ISO-10303-21"):
        kind = "ifc"
    if wide and kind != "csv":
        raise InputError(f"{path}: its text is UTF-16; save it as UTF-8")
    return kind


def _refuse_options(path: Path, kind: Kind, given: dict[str, str | None]) -> None:
    """Refuse options that do not apply to a kind of file."""
    meant = {
        "csv": ("a table of points", ()),
        "gis": ("a map", ("--alignment", "--axis-layer")),
        "dxf": ("a drawing", ("--alignment", "--axis-layer", "--axis-unit")),
        "landxml": ("a LandXML", ("--alignment", "--profile", "--axis-unit")),
        "ifc": ("an IFC", ("--alignment", "--profile")),
    }
    what, allowed = meant[kind]
    wrong = [option for option, value in given.items() if value is not None and option not in allowed]
    if wrong:
        raise InputError(f"{path} is {what}, for which {wrong[0]} does not apply; omit it")


def _given_design(
    path: Path, kind: Kind, start: float | None, alignment: str | None, profile: str | None, unit: str | None
) -> GivenAxis:
    design = _read_design(path, kind, alignment, profile, unit).renumbered(start)
    try:
        design.check()
    except UserError as error:
        raise InputError(f"{path}: {error}") from None
    source = f"{path.name}: {design.name}" if design.name else path.name
    xyz = design.polyline()
    row, plan, rise = _leap(xyz)
    if row is not None:
        along = design.chainages[0] + float(plan[:row].sum())
        raise InputError(
            f"{path}: at chainage {along:.0f} its profile rises or falls by {rise[row]:.6g} m within {plan[row]:.6g} m;"
            " is a decimal point missing?"
        )
    return GivenAxis(xyz, design.chainages[0], design, source, design.notes)


def _read_design(path: Path, kind: Kind, alignment: str | None, profile: str | None, unit: str | None) -> Design:
    from tunneldb.alignment.ifc import Ifc
    from tunneldb.alignment.landxml import LandXml

    file = LandXml(path, unit) if kind == "landxml" else Ifc(path)
    number = _choose(path, "alignment", file.names, alignment)
    if not file.profiles[number]:
        raise InputError(
            f"{path}: alignment {file.names[number]!r} has no profile, but a tunnel's axis needs heights; export both together"
        )
    return file.design(number, _choose(path, "profile", file.profiles[number], profile))


def _choose(path: Path, what: str, names: list[str], wanted: str | None) -> int:
    """Return the index of the wanted element, or of the only one."""
    if not names:
        raise InputError(f"{path} holds no {what}; export the design alignment, with plan and profile")
    names = [f"{name or 'unnamed'} ({k})" if names.count(name) > 1 else name for k, name in enumerate(names, start=1)]
    listed = ", ".join(repr(name) for name in names)
    if wanted is None:
        if len(names) > 1:
            raise InputError(f"{path} holds {len(names)} {what}s: {listed}; choose one by --{what} NAME")
        return 0
    if wanted not in names:
        raise InputError(f"{path} holds no {what} {wanted!r}; it has {listed}")
    return names.index(wanted)


def _read_points(path: Path) -> GivenAxis:
    """Read the vertices of an axis file, or a trajectory; it must not reverse its direction."""
    header = read_header(path)
    columns = [_column(path, header, name) for name in XYZ]
    names = [column for column in columns if column is not None]
    table = read_csv(path, names)
    if len(table) < 2:
        raise InputError(f"{path}: an axis needs at least 2 points, this one has {len(table)}")
    xyz = np.full((len(table), 3), np.nan)
    xyz[:, : len(names)] = table.columns(names)
    if "time" in (name.lower() for name in header):
        rows = _thinned(xyz)
        _require_forward(xyz[rows], lambda row, text: table.error(int(rows[row]), text))
        note = f"a trajectory: {len(rows)} of its {len(xyz)} points, at least {MIN_TRAJECTORY_STEP:g} m apart, are the axis"
        return GivenAxis(xyz[rows], 0.0, notes=(note,))
    _require_forward(xyz, table.error)
    return GivenAxis(xyz, 0.0)


def _column(path: Path, header: list[str], name: str) -> str | None:
    """Return the column of a coordinate, by its usual names; None if there is no height."""
    found = find_column(path, header, name)
    if found is not None:
        return found
    if name == "z" and len(header) > 1:
        return None
    numbers = sum(re.fullmatch(r"[+-]?[\d.,]+", column) is not None for column in header)
    hint = "; the first line must contain column names, for example x,y,z" if numbers > 1 else ""
    raise InputError(f"{path} has no column {name}: the header is {','.join(header)!r}{hint}")


def _thinned(xyz: Float) -> np.ndarray:
    """Return rows of a trajectory at least one step apart in plan; the last of them is the last that moved."""
    rows = [0]
    for row in range(1, len(xyz)):
        if np.hypot(*(xyz[row, :2] - xyz[rows[-1], :2])) >= MIN_TRAJECTORY_STEP:
            rows.append(row)
    last = len(xyz) - 1
    if len(rows) > 1 and rows[-1] != last and np.hypot(*(xyz[last, :2] - xyz[rows[-1], :2])) > 0.0:
        rows[-1 if len(rows) > 2 else len(rows) :] = [last]
    return np.array(rows)


def _leap(xyz: Float) -> tuple[int | None, Float, Float]:
    """Return the first implausible step in height (None: none), and length in plan and rise of each step, m."""
    plan, rise = np.hypot(*np.diff(xyz[:, :2], axis=0).T), np.abs(np.diff(xyz[:, 2]))
    steep = np.flatnonzero(rise > MAX_GRADE * plan + MAX_GRADE)
    return int(steep[0]) if len(steep) else None, plan, rise


def _require_forward(xyz: Float, error: Callable[[int, str], InputError]) -> None:
    """Raise an error for a row at which a line does not advance or reverses in plan, or has an implausible step."""
    steps = np.diff(xyz[:, :2], axis=0)
    plan = np.hypot(*steps.T)
    if np.any(far := ~(plan <= MAX_STEP)):
        row = int(np.argmax(far))
        raise error(row + 1, f"it is {plan[row] / 1000.0:.6g} km from the previous point; is a decimal point missing?")
    standing = np.flatnonzero(~steps.any(axis=1))
    if len(standing):
        raise error(int(standing[0]) + 1, "the same x,y as the previous point; remove one of them")
    leap, _, rise = _leap(xyz)
    if leap is not None:
        raise error(leap + 1, f"{plan[leap]:.6g} m after the previous point its z differs by {rise[leap]:.6g} m; correct z")
    turns = np.flatnonzero(np.einsum("ij,ij->i", steps[1:], steps[:-1]) <= 0)
    if len(turns):
        raise error(int(turns[0]) + 2, "the axis reverses here; sort its points by ascending chainage")
