"""Scan files, read in chunks of constant memory."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tunneldb.errors import InputError
from tunneldb.geometry.crs import (
    describe_crs,
    describe_srid,
    fits_srid,
    heights_differ,
    in_metres,
    is_local,
    srid_name,
)
from tunneldb.geometry.crs_equality import horizontal, lacks_datum
from tunneldb.geometry.local import LOCAL
from tunneldb.geometry.units import IN_METRES, Units
from tunneldb.pointcloud.file_sample import read_runs
from tunneldb.pointcloud.formats.faults import require_dimension
from tunneldb.pointcloud.formats.raw import read_raw
from tunneldb.pointcloud.formats.table import format_of, require_known
from tunneldb.pointcloud.points import CHUNK, Points, Ranges, ScanHeader
from tunneldb.pointcloud.units import conversion_note, require_metres

__all__ = ["CHUNK", "Points", "ScanHeader", "check_header", "read_chunks", "read_header"]

_DEGREES = 360.0  # of longitude; greater coordinates are lengths
_FROM_CENTRE = (6.33e6, 6.40e6)  # m from the Earth's centre to places on land or below it
_RUNS, _RUN_POINTS = 5, 100  # of a sample that shows whether coordinates are degrees


def read_header(path: Path) -> ScanHeader:
    """Read the header of a scan file; also the points of PLY, PTX and other text, once for each version of the file.

    Raises
    ------
    InputError
        If the file is missing, is not of its format, or holds no points.
    """
    require_known(path)
    return _without_wrong_crs(format_of(path).header(path))


def _without_wrong_crs(header: ScanHeader) -> ScanHeader:
    """Remove a geographic or geocentric system that the coordinates cannot have: exporters write a default system."""
    if header.crs is None or not (header.crs.is_geocentric or horizontal(header.crs).is_geographic):
        return header
    xyz = np.concatenate(list(read_runs(header.path, header.points, _RUNS, _RUN_POINTS)))[:, :3]  # its box may be wrong
    if not len(xyz):
        return header
    x, y, _ = xyz[0]
    if header.crs.is_geocentric:
        low, high = _FROM_CENTRE
        distance = np.linalg.norm(xyz, axis=1)
        possible = bool(((low < distance) & (distance < high)).all())
        reason = f"is geocentric, but x = {x:.0f}, y = {y:.0f} are not on the Earth's surface"
    else:
        possible = bool(np.abs(xyz[:, :2]).max() <= _DEGREES)
        reason = f"is in degrees, but x = {x:.0f}, y = {y:.0f} are not"
    if possible:
        return header
    return replace(header, stated=replace(header.stated, crs=None, unread=f"{describe_crs(header.crs)} {reason}"))


def check_header(header: ScanHeader, dimension: str | None, srid: int, needs_time: bool) -> None:
    """Check a file against its survey before reading its points.

    Parameters
    ----------
    header : ScanHeader
        From `read_header`.
    dimension : str or None
        The survey's intensity dimension.
    srid : int
        EPSG code of the tunnel, or LOCAL.
    needs_time : bool
        True if scanner positions come from a trajectory, by ``gps_time``.

    Raises
    ------
    InputError
        If the dimension or ``gps_time`` is missing, the horizontal coordinate system differs, or coordinates are not in metres.
    """
    require_dimension(header.path, dimension, header.dimensions, "the survey's intensity")
    require_dimension(header.path, "gps_time" if needs_time else None, header.dimensions, "the trajectory")
    if header.crs is not None and not fits_srid(in_metres(header.crs), srid):
        option = "with --srid local" if is_local(header.crs) else "with the file's SRID"
        raise InputError(
            f"{header.path}: its coordinate system is {describe_crs(header.crs)}, the tunnel's is {describe_srid(srid)}; "
            f"transform the file or add the tunnel {option}"
        )
    require_metres(header)


def crs_note(header: ScanHeader, srid: int) -> str | None:
    """Return assumptions about a file's coordinates in a tunnel of a system (EPSG code, LOCAL); None if there are none.

    Local coordinates need no note if the file states no system.
    """
    unstated = header.crs is None and not header.unread_crs and srid != LOCAL
    nothing = f"states no coordinate system; using the tunnel's, {srid_name(srid)}" if unstated else None
    return "; ".join(filter(None, (nothing, coordinate_note(header, srid)))) or None


def coordinate_note(header: ScanHeader, srid: int) -> str | None:
    """Return what results should say of a file's coordinates: unreadable or contradictory statements, conversions."""
    notes = list(header.stated.notes)
    if header.unread_crs:
        notes.append(
            f"states a coordinate system that cannot be read ({header.unread_crs}); using the tunnel's, {srid_name(srid)}"
        )
    if header.crs is not None and lacks_datum(header.crs):
        notes.append(f"states no geodetic datum ({header.crs.name}); using the tunnel's, {srid_name(srid)}")
    notes += filter(None, (heights_differ(header.stated.heights, srid), conversion_note(header), *header.notes))
    return "; ".join(notes) or None


def read_chunks(
    path: Path,
    dimension: str | None,
    size: int = CHUNK,
    ranges: Ranges | None = None,
    *,
    units: Units = IN_METRES,
    colours: bool = False,
) -> Iterator[Points]:
    """Read a scan file chunk by chunk.

    Parameters, order and errors are those of `pointcloud.formats.raw.read_raw`; without a dimension the intensity is 0.

    Yields
    ------
    Points
        In file order within a range; points without finite coordinates are skipped.
    """
    for raw in read_raw(path, dimension, size, ranges, units=units, colours=colours):
        yield Points.of(raw).located()


@dataclass(frozen=True)
class ScanSource:
    """Part of a scan file that a kilometre needs.

    Attributes
    ----------
    path : Path
        Path at the time of reading.
    ranges : list of (int, int)
        Half-open ranges of point indices, from 0, that contain all points of the kilometre and 18 m on both sides.
    dimension : str or None
        The survey's intensity dimension.
    units : Units
        Units of the file's coordinates.
    full_colour : int
        Value of full red, green or blue; 0 to read no colours.
    """

    path: Path
    ranges: list[tuple[int, int]]
    dimension: str | None
    units: Units = IN_METRES
    full_colour: int = 0

    @property
    def points(self) -> int:
        """Number of points to read."""
        return sum(end - begin for begin, end in self.ranges)
