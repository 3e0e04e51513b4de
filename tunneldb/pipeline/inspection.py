"""Inspection of a single scan file: contents, and their probable meaning."""

from __future__ import annotations

import datetime as dt
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from pyproj import CRS

from tunneldb.arrays import Bool, Float
from tunneldb.counted import counted
from tunneldb.errors import UserError
from tunneldb.geometry.crs import describe_crs, describe_heights, in_metres
from tunneldb.geometry.crs_equality import epsg_code, horizontal
from tunneldb.geometry.units import Units
from tunneldb.pipeline.inspected_axis import doubt_axis
from tunneldb.pipeline.inspected_poses import doubt_poses, file_beside
from tunneldb.pointcloud.colour_depth import colour_depth
from tunneldb.pointcloud.contents import Contents, read_contents, read_near, read_values
from tunneldb.pointcloud.form import WINDOW, TunnelForm, profile_spacing, surface_density, tunnel_form
from tunneldb.pointcloud.formats.e57 import is_e57
from tunneldb.pointcloud.formats.e57_pictures import read_pictures
from tunneldb.pointcloud.formats.las import read_las_facts
from tunneldb.pointcloud.formats.pose_contradictions import lost_positions, position_notes
from tunneldb.pointcloud.formats.scans import PosedScan
from tunneldb.pointcloud.formats.table import format_of, posed_scans
from tunneldb.pointcloud.header_box import describe_box_difference
from tunneldb.pointcloud.noise import noise_filter
from tunneldb.pointcloud.reader import ScanHeader, read_header
from tunneldb.pointcloud.unit_by_size import MIN_HEIGHT_RATIO, guess_unit, typical_spacing
from tunneldb.pointcloud.units import NOT_GIVEN, GivenUnits, conversion_note, in_units, suggested_options, unit_faults
from tunneldb.progress import StartProgress
from tunneldb.radiometry.intensity_kind import KindGuess, ValueRange, contradiction, guess_kind, value_range

MIN_LENGTH_RATIO = 1.5
"""Length over width below which a cloud is a room and not a stretch of a tunnel."""

MAX_SPACING = 3.0
"""Distance of neighbouring points of the sample from which they show no surface in metres."""

SEARCHED = 50_000_000
"""Maximum number of points for reading a file again to test whether its axis can be found."""

_PARTS = (0.25, 0.5, 0.75)  # of the tunnel's length, where profiles are looked for
_GPS_EPOCH = dt.datetime(1980, 1, 6)
_WEEK = 604_800.0  # s
_LATEST = 100 * 52 * _WEEK
_ADJUSTED = 1e9  # s that LAS takes off a GPS time

_NO_INTENSITY = {
    "x", "y", "z", "bit_fields", "raw_classification_flags", "return_number", "number_of_returns", "synthetic",
    "key_point", "withheld", "overlap", "scanner_channel", "scan_direction_flag", "edge_of_flight_line",
    "classification", "user_data", "scan_angle", "scan_angle_rank", "point_source_id", "scan_id", "gps_time", "red",
    "green", "blue", "nir", "alpha", "nx", "ny", "nz", "wavepacket_index", "wavepacket_offset", "wavepacket_size",
    "return_point_wave_location", "x_t", "y_t", "z_t",
}  # fmt: skip


@dataclass(frozen=True)
class IntensityLook:
    """Dimension that may be the intensity.

    Attributes
    ----------
    name, type : str
        Name in the file, and type of its numbers: ``uint16``, ``float32``, ….
    values : ValueRange or None
        Statistics of a sample; None if it cannot be read.
    guesses : list of KindGuess
        Possible kinds, the likeliest first.
    fault : str or None
        Why it cannot be read.
    """

    name: str
    type: str
    values: ValueRange | None
    guesses: list[KindGuess]
    fault: str | None = None

    @property
    def usable(self) -> list[KindGuess]:
        """Guesses of kinds that the values contradict in nothing."""
        if self.values is None:
            return []
        return [guess for guess in self.guesses if guess.kind != "none" and contradiction(guess.kind, self.values) is None]


@dataclass(frozen=True)
class FileLook:
    """Contents of a scan file.

    Attributes
    ----------
    path : Path
    format : str
    points, invalid : int
        Points, and how many more the file marks as invalid.
    misplaced : int
        Points with a coordinate that is NaN or infinite.
    crs, unread_crs : str or None
        Name of its coordinate system; or the reason why there is none.
    srid : int or None
        EPSG code of the coordinate system in plan, in metres.
    low, high : (3,) float64 array
        Box, in the file's unit, or converted from given units to metres.
    length, width, height : float or None
        Form of the tunnel, from `tunnel_form`.
    density : tuple of three floats
        Points per square unit of surface: 10th percentile, median, 90th; see `surface_density`.
    sampled : int
        Points that these were found on.
    foreign_unit : bool
        True if it states another unit than metres, or two different ones, or seems to have another, and none was given.
    unit_options, suggested_units : str
        Given units, as options of the next commands, and those that would convert the file; empty for none.
    heights : str or None
        System of its heights, and their unit; None if not stated.
    notes : list of str
        Contradictions in its header, and conversions.
    lost_positions : str
        Why the positions of its scans cannot be used; empty if they can.
    profile_spacing : float or None
        Distance of the profiles along the tunnel; None if unknown.
    unit : str or None
        Probable unit of length, if not the metre, and the reason.
    times : (float, float) or None
        First and last time, s.
    time_kind : str or None
        Kind of the times, from the file.
    untimed : int
        Points whose time is NaN or infinite.
    date : datetime.date or None
        Day of the first time, where the file says which times they are.
    scans : dict of int to int
        Points of each scan number.
    poses : list of PosedScan
        Scans that the file knows, with the positions that it gives them.
    intensities : list of IntensityLook
    time_offset : float or None
        Seconds to add to the times of the trajectory beside the file, so that it fits the points; None if it fits.
    pose_doubt : str or None
        Why the trajectory or the stations beside the file, or the positions of its scans, do not fit the points.
    axis_doubt : str or None
        Why the axis beside the file does not fit the points.
    colours : str or None
        Bits of the colours of its points; None if they have none.
    pictures : list of str
        Pictures in it: projection, size, and whether they have a pose.
    header_note : str or None
        Difference between its header and its points.
    only_noise : bool
        True if all points would be left out as noise, each too far from others; False if not all were examined.
    """

    path: Path
    format: str
    points: int
    invalid: int
    misplaced: int
    crs: str | None
    unread_crs: str | None
    srid: int | None
    low: Float
    high: Float
    length: float | None
    width: float | None
    height: float | None
    density: tuple[float, float, float]
    sampled: int
    profile_spacing: float | None
    unit: str | None
    times: tuple[float, float] | None
    time_kind: str | None
    untimed: int
    date: dt.date | None
    scans: dict[int, int]
    poses: list[PosedScan]
    intensities: list[IntensityLook]
    foreign_unit: bool = False
    header_note: str | None = None
    unit_options: str = ""
    suggested_units: str = ""
    heights: str | None = None
    notes: list[str] = field(default_factory=list)
    lost_positions: str = ""
    only_noise: bool = False
    time_offset: float | None = None
    pose_doubt: str | None = None
    axis_doubt: str | None = None
    colours: str | None = None
    pictures: list[str] = field(default_factory=list)

    @property
    def other_than_a_tunnel(self) -> str | None:
        """Return its probable nature by size; None if it can be a tunnel, perhaps in another unit."""
        if self.length is None or self.width is None or self.height is None:
            return None if self.unit else "no axis through it as through a tunnel"
        size = f"{self.length:.1f} long, {self.width:.1f} wide and {self.height:.1f} high"
        if self.height < MIN_HEIGHT_RATIO * self.width:
            return f"{size}: open country or a street rather than a tunnel"
        if self.length < MIN_LENGTH_RATIO * self.width:
            return f"{size}: a room or a single place rather than a tunnel"
        return None


def inspect_file(path: Path, begin: StartProgress, given: GivenUnits = NOT_GIVEN) -> FileLook:
    """Inspect a scan file, read in chunks with constant memory.

    Parameters
    ----------
    path : Path
    begin : callable
        Called with a text and a number of points before each step; returns a function that takes the points done.
    given : GivenUnits
        Units of its coordinates as given by the user.

    Raises
    ------
    UserError
        If it cannot be read.
    """
    header = in_units(read_header(path), given)
    contents = read_contents(path, begin(path.name, header.points), header.units)
    form = tunnel_form(contents.xyz) if typical_spacing(contents.xyz) <= MAX_SPACING else None
    names = [name for name in header.dimensions if name.lower() not in _NO_INTENSITY]
    kind, time_kind = _described(path, contents)
    scans = posed_scans(path)
    poses = [_converted(scan, header.units) for scan in scans]
    unit, unit_options = _unit_doubt(header, contents, form)
    axis = file_beside([path], "axis.csv")
    time_offset, pose_doubt = doubt_poses(path, contents, form, poses)
    depth = colour_depth(path)
    return FileLook(
        path,
        kind,
        contents.points,
        header.points - contents.points,
        contents.misplaced,
        None if header.crs is None else describe_crs(header.crs),
        header.unread_crs or None,
        None if header.crs is None else epsg_code(in_metres(header.crs) if header.unit_given else header.crs),
        contents.low,
        contents.high,
        None if form is None else form.length,
        None if form is None else form.width,
        None if form is None else form.height,
        surface_density(contents.xyz, contents.share),
        len(contents.xyz),
        None if form is None else _spacing(path, contents, form, header.units),
        unit,
        contents.times,
        time_kind,
        contents.untimed,
        _date(contents.times, time_kind),
        contents.scans,
        poses,
        [_look_at(path, name, contents.points) for name in names],
        unit_options is not None,
        describe_box_difference(header, np.concatenate([contents.low, contents.high])),
        "".join(f" {option} {unit}" for option, unit in (("--unit", given.plan), ("--height-unit", given.height)) if unit),
        unit_options or "",
        describe_heights(header.crs, header.stated.heights),
        [*header.stated.notes, *header.notes, *filter(None, [conversion_note(header)]), *position_notes(scans)],
        lost_positions(scans),
        contents.share == 1.0 and bool(noise_filter(contents.xyz).all()),
        time_offset,
        pose_doubt,
        None if axis is None else doubt_axis(axis, contents.xyz),
        None if depth is None else str(depth),
        _pictures(path),
    )


def _pictures(path: Path) -> list[str]:
    """Return the kinds of pictures in an E57 file, with their number and those without a pose."""
    if not is_e57(path):
        return []
    try:
        every = read_pictures(path)
    except UserError as error:
        return [str(error).removeprefix(f"{path}: ")]
    found = []
    for projection, columns, rows in dict.fromkeys((one.projection, one.columns, one.rows) for one in every):
        same = [one for one in every if (one.projection, one.columns, one.rows) == (projection, columns, rows)]
        lost = sum(not one.placed for one in same)
        what = "without a projection" if projection == "none" else projection
        place = "" if projection == "none" else " with poses" if not lost else f", {lost} without a pose"
        found.append(f"{counted(len(same), 'picture')} {what}{place}, {columns} × {rows} pixels")
    return found


def _converted(scan: PosedScan, units: Units) -> PosedScan:
    return scan if scan.position is None else replace(scan, position=scan.position * units.scales)


def find_axis_fault(looks: Sequence[FileLook], begin: StartProgress, given: GivenUnits = NOT_GIVEN) -> str | None:
    """Return why ``--axis auto`` would be refused for files; None if not, or if they have more than SEARCHED points."""
    from tunneldb.pipeline.axis_search import search_axis

    if sum(look.points for look in looks) > SEARCHED:
        return None
    try:
        search_axis([look.path for look in looks], None, begin, given=given)
    except UserError as error:
        return str(error)
    return None


def _described(path: Path, contents: Contents) -> tuple[str, str | None]:
    """Return the format, and the kind of the times."""
    found = format_of(path)
    if found.is_las:
        name, kind = read_las_facts(path)
        return name, kind if contents.times else None
    return found.name, "GPS seconds since 1980" if found.name == "E57" and contents.times else None


def _date(times: tuple[float, float] | None, kind: str | None) -> dt.date | None:
    """Return the day of the first time; to a few seconds, because GPS time has no leap seconds."""
    if times is None or kind is None or kind.startswith("seconds of the GPS week"):
        return None
    seconds = times[0] + (_ADJUSTED if "adjusted" in kind else 0.0)
    # What is less than a week after the epoch is no date, but time from a beginning of its own.
    if times[0] < _WEEK or seconds > _LATEST:
        return None
    return (_GPS_EPOCH + dt.timedelta(seconds=seconds)).date()


def _look_at(path: Path, name: str, points: int) -> IntensityLook:
    try:
        values = read_values(path, name, points)
    except UserError as error:
        return IntensityLook(name, "", None, [], str(error).removeprefix(f"{path}: "))
    found = value_range(values)
    return IntensityLook(name, str(values.dtype.newbyteorder("=")), found, guess_kind(found, name))


def _spacing(path: Path, contents: Contents, form: TunnelForm, units: Units) -> float | None:
    """Return the median of three short windows of the tunnel."""
    along, _ = form.line.place(contents.xyz)
    first = float(np.percentile(along, 0.1))
    found = []
    for part in _PARTS:
        middle = first + part * form.length
        near: Bool = np.abs(along - middle) < WINDOW / 2.0
        if not near.any():
            continue
        xyz = read_near(path, contents, near, units)
        at, across = form.line.place(xyz)
        inside = np.abs(at - middle) < WINDOW / 2.0
        spacing = profile_spacing(at[inside], across[inside], xyz[inside, 2])
        if spacing is not None:
            found.append(spacing)
    return float(np.median(found)) if 2 * len(found) > len(_PARTS) else None


def _unit_doubt(header: ScanHeader, contents: Contents, form: TunnelForm | None) -> tuple[str | None, str | None]:
    """Return why the coordinates may not be in metres, and the options that convert them, empty if none does; or two None."""
    faults = unit_faults(header)
    if faults:
        return "; ".join(faults), suggested_options(header)
    if header.crs is not None and _is_angular(header.crs):
        return "not metres in plan, by its coordinate system: transform it to a projected system in metres", ""
    if header.crs is not None or header.unit_given:
        return None, None
    low, high = contents.low, contents.high
    inside = bool(np.all(np.abs([low[0], high[0]]) <= 180.0) and np.all(np.abs([low[1], high[1]]) <= 90.0))
    if inside and float(np.max(high[:2] - low[:2])) < 0.1 < float(high[2] - low[2]):
        return "looks like degrees (longitude and latitude): transform it to a projected system in metres", ""
    guess = guess_unit(contents.xyz, contents.share, form)
    return (guess.text, guess.option) if guess else (None, None)


def _is_angular(crs: CRS) -> bool:
    """Return True for longitude and latitude, and for geocentric coordinates; neither is possible for a tunnel."""
    return bool(horizontal(crs).is_geographic or horizontal(crs).is_geocentric)
