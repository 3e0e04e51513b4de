"""Scanner data of a survey: positions, and intensity over range."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import psycopg
from numpy.typing import NDArray
from psycopg import sql

from tunneldb.alignment.given import XYZ
from tunneldb.arrays import Float
from tunneldb.counted import counted
from tunneldb.csvfile import CsvTable, read_csv
from tunneldb.database.copy import PointZ, copy_binary, pack
from tunneldb.errors import UserError
from tunneldb.geometry.alignment import Alignment
from tunneldb.geometry.crs import outside_area
from tunneldb.geometry.misplacement import explain_misplacement
from tunneldb.geometry.units import IN_METRES, Units, unit_name
from tunneldb.pointcloud.formats.table import has_scans
from tunneldb.pointcloud.pose_checks import MAX_AXIS_DISTANCE, MAX_END_DISTANCE, far_from_axis, jumps
from tunneldb.pointcloud.poses import PoseModel, longest_interval
from tunneldb.pointcloud.station_fit import SAME_PLACE
from tunneldb.pointcloud.stations import Stations, read_stations
from tunneldb.pointcloud.trajectory_file import read_trajectory
from tunneldb.pointcloud.week_end import cover_week_end

FARTHEST_SCANNER = 50.0  # m from the axis; a scanner that was never nearer stood in another tunnel
MAX_NAMED = 10  # stations named in a message
MAX_WILD_SHARE = 0.05  # share of a trajectory's poses that may be left out as they cannot be

MISFIT = "the positions do not fit the loaded points: "
"""Beginning of a survey's note on positions that are in the database together with points that contradict them."""


@dataclass(frozen=True)
class Positions:
    """Scanner positions as they were read.

    Attributes
    ----------
    mobile : bool
        True for poses of a trajectory; else stations.
    keys : (n,) array
        Times, s, or numbers of the scans.
    xyz : (n, 3) float64 array
        m, in the tunnel's SRID.
    notes : tuple of str
        Remarks: poses that were left out, gaps, changes of their times.
    time_offset : float
        Seconds added to the times of the trajectory.
    """

    mobile: bool
    keys: NDArray[Any]
    xyz: Float
    notes: tuple[str, ...] = ()
    time_offset: float = 0.0

    def __len__(self) -> int:
        return len(self.keys)


def read_positions(
    paths: Sequence[Path] | None,
    alignment: Alignment | None,
    tunnel: str,
    srid: int,
    *,
    mobile: bool,
    backwards: bool,
    time_offset: float = 0.0,
    units: Units = IN_METRES,
) -> Positions:
    """Read the scanner's positions, and leave out poses of a trajectory that cannot be.

    Parameters
    ----------
    paths
        The only CSV of the trajectory (time,x,y,z) if `mobile`, else the files of the stations, see
        `tunneldb.pointcloud.stations.read_stations`; None for unknown scanner positions.
    alignment, tunnel, srid
        Given axis, None for a site, whose positions are not checked; the tunnel's name and SRID, for errors.
    backwards
        True if the trajectory runs towards decreasing chainage.
    time_offset
        Seconds to add to the times of the trajectory.
    units
        Units of the coordinates in the files.

    Raises
    ------
    UserError
        If a file cannot be read, the scanner was never near the axis, or a station, or too many poses, are at impossible
        places.
    """
    if paths is None:
        return Positions(False, np.empty(0, np.int32), np.empty((0, 3)))
    if not mobile:
        stations = read_stations(paths)
        places = stations.xyz * units.scales
        said = (*_stations_together(paths, stations), *stations.notes, *_conversion(units))
        if alignment is None:
            return Positions(False, stations.scan_id, places, said)
        _require_near(paths, places, alignment, tunnel, srid)
        far = far_from_axis(places, alignment)
        if far.any():
            worst, more = int(np.argmax(far)), np.count_nonzero(far) - 1
            others = f", and {more} more as far" if more else ""
            raise UserError(
                f"{', '.join(map(str, paths))}: the station of scan_id {stations.scan_id[worst]} is {far[worst]:.0f} m"
                f" from the axis of {tunnel!r}{others}; no scanner stands more than"
                f" {MAX_AXIS_DISTANCE:g} m beside it or {MAX_END_DISTANCE:g} m beyond its ends: fix the position, or remove"
                " the row, and the points of that scan are left out"
            )
        return Positions(False, stations.scan_id, places, said)
    table, ended = read_trajectory(paths[0])
    table.require_growing("time")
    time, xyz = table["time"], table.columns(XYZ) * units.scales
    if alignment is None:
        raise UserError(f"{tunnel!r} is a site; it takes the --stations of a static scanner")
    _require_near(paths, xyz, alignment, tunnel, srid)
    far = far_from_axis(xyz, alignment)
    wild = (far > 0.0) | jumps(time, xyz)
    if wild.mean() > MAX_WILD_SHARE:
        raise table.error(
            int(np.argmax(wild)),
            f"this pose and {counted(int(np.count_nonzero(wild)) - 1, 'other')} ({100 * wild.mean():.2g} %) lie more than"
            f" {MAX_AXIS_DISTANCE:g} m beside the axis of {tunnel!r}, {MAX_END_DISTANCE:g} m beyond its ends, or jump;"
            " remove these rows, or give the trajectory of this tunnel, in its coordinate system",
        )
    notes = [*([ended] if ended else []), *_conversion(units)]
    if wild.any():
        first = int(np.argmax(wild))
        notes.append(
            f"{np.count_nonzero(wild)} of {len(time)} poses left out, where no scanner can have been: the first in line"
            f" {table.lines[first]}, {f'{far[first]:.0f} m from the axis' if far[first] else 'a jump there and back'}"
        )
    time, xyz = time[~wild], xyz[~wild]
    notes += _direction(table.path, xyz, alignment, backwards=backwards)
    time = time + time_offset
    return Positions(True, time, xyz, (*notes, *time_notes(time, xyz, time_offset)), time_offset)


def time_notes(time: Float, xyz: Float, time_offset: float) -> list[str]:
    """Return remarks on the times of a trajectory (m,), s, with positions (m, 3): their offset, and gaps."""
    notes = [f"{time_offset:+.12g} s added to the times of the trajectory (--time-offset)"] if time_offset else []
    gaps = PoseModel.from_trajectory(time, xyz).gaps
    if len(gaps):
        longest = gaps[np.argmax(gaps[:, 1] - gaps[:, 0])]
        notes.append(
            f"the trajectory has {counted(len(gaps), 'gap')}, the longest of {longest[1] - longest[0]:.1f} s"
            f" from time {longest[0]:.3f}: points measured in {'them' if len(gaps) > 1 else 'it'} are left out"
        )
    return notes


def _stations_together(paths: Sequence[Path], stations: Stations) -> tuple[str, ...]:
    """Return a remark if all stations are at one place; refuse poses of files that were lost on export."""
    count = len(stations.xyz)
    if count < 2 or float(np.ptp(stations.xyz, axis=0).max()) > SAME_PLACE:
        return ()
    numbers = ", ".join(map(str, stations.scan_id[:MAX_NAMED].tolist())) + (", …" if count > MAX_NAMED else "")
    if np.abs(stations.xyz).max() < SAME_PLACE and all(path.is_dir() or has_scans(path) for path in paths):
        raise UserError(
            f"{', '.join(map(str, paths))}: all {count} scans have the position 0, 0, 0: their poses were lost on export;"
            f" export them with poses, or give them in a CSV file with scan_id,x,y,z: --stations FILE, scan_id {numbers}"
        )
    place = ", ".join(f"{value + 0.0:.3f}" for value in stations.xyz[0])
    return (f"all {count} stations are at one place ({place}), of scan_id {numbers}: check that the scanner stayed there",)


def _conversion(units: Units) -> tuple[str, ...]:
    """Return a note on the conversion of positions to metres; none if they are metres."""
    if units.metric:
        return ()
    heights = "" if units.plan == units.height else f", heights from {unit_name(units.height)}"
    return (f"positions are converted from {unit_name(units.plan)}{heights} to metres, as given",)


def save_positions(connection: psycopg.Connection[Any], survey: int, positions: Positions, srid: int) -> None:
    """Write the positions of a survey, by its key, that has none, and a note on them."""
    note = "; ".join(positions.notes) or None
    longest, gaps = None, None
    keys, xyz = positions.keys, positions.xyz
    if positions.mobile:
        longest = longest_interval(np.asarray(keys, np.float64))
        keys, xyz = cover_week_end(keys, xyz, longest)
        gaps = PoseModel.from_trajectory(keys, xyz, longest).gaps.ravel().tolist()
    connection.execute(
        "UPDATE tunnel.survey SET positions_note = %s, longest_interval = %s, trajectory_gaps = %s, time_offset = %s"
        " WHERE id = %s",
        [note, longest, gaps, positions.time_offset, survey],
    )
    if not len(positions):
        return
    table, key = ("pose", "time") if positions.mobile else ("station", "scan_id")
    columns = [np.full(len(keys), survey, dtype=np.int32), keys, PointZ(xyz, srid)]
    _insert(connection, table, ["survey_id", key, "geom"], columns)


def replace_positions(connection: psycopg.Connection[Any], survey: int, positions: Positions, srid: int) -> None:
    """Write the positions of a survey, by its key, in place of the former ones."""
    connection.execute("DELETE FROM tunnel.pose WHERE survey_id = %s", [survey])
    connection.execute("DELETE FROM tunnel.station WHERE survey_id = %s", [survey])
    save_positions(connection, survey, positions, srid)


def read_reference(path: Path) -> CsvTable:
    """Read a reference curve: range_m, growing, and intensity_db."""
    table = read_csv(path, ("range_m", "intensity_db"))
    if len(table) < 2:
        raise UserError(f"{path}: a reference curve needs at least 2 rows, this one has {len(table)}")
    if table["range_m"][0] <= 0:
        raise table.error(0, f"range_m {table['range_m'][0]:g} is not positive")
    table.require_growing("range_m")
    return table


def save_reference(connection: psycopg.Connection[Any], survey: int, curve: CsvTable) -> None:
    """Write the reference curve of a survey, by its key, that has none."""
    columns = [np.full(len(curve), survey, dtype=np.int32), curve["range_m"], curve["intensity_db"]]
    _insert(connection, "reference", ["survey_id", "range_m", "intensity_db"], columns)


def require_range(kind: str) -> None:
    """Refuse --reference auto for intensity that does not fall with range."""
    if kind == "none":
        raise UserError("--reference auto estimates the range curve from the intensity, but intensity of kind none is not read")
    if kind == "reflectance":
        raise UserError("--reference auto is not needed: the maker already corrects intensity of kind reflectance for range")


def require_no_range(kind: str) -> None:
    """Refuse intensity that needs range correction without scanner positions."""
    if kind not in ("reflectance", "none"):
        raise UserError(
            f"intensity of kind {kind} falls with range, which cannot be corrected without scanner positions: --no-poses needs"
            " --intensity-kind reflectance, which the maker has corrected for range, or none"
        )


def _insert(connection: psycopg.Connection[Any], table: str, names: list[str], columns: list[Any]) -> None:
    copy_binary(connection, sql.Identifier("tunnel", table), names, [pack(columns)])


def _require_near(paths: Sequence[Path], xyz: Float, alignment: Alignment, tunnel: str, srid: int) -> None:
    """Require that the scanner was near the axis at least once."""
    distance = alignment.distance(xyz)
    beyond = np.isnan(distance)
    distance[beyond] = np.linalg.norm(xyz[beyond, None] - alignment.vertices[[0, -1]], axis=2).min(axis=1)
    nearest = int(np.argmin(distance))
    if distance[nearest] > FARTHEST_SCANNER:
        guess = explain_misplacement(xyz, alignment.vertices, FARTHEST_SCANNER) or outside_area(srid, xyz[:, :2])
        raise UserError(
            f"{', '.join(map(str, paths))}: the scanner was never within {FARTHEST_SCANNER:g} m of the axis of {tunnel!r} "
            f"({distance[nearest]:.0f} m at the nearest{', beyond its ends' if beyond[nearest] else ''}); "
            f"{guess or 'give the positions in this tunnel, in its coordinate system'}"
        )


def _direction(path: Path, xyz: Float, alignment: Alignment, *, backwards: bool) -> list[str]:
    """Return a note on a trajectory that runs down the axis without a statement; refuse one that is stated to, but does not."""
    chainage = alignment.chainage(xyz)
    within = chainage[np.isfinite(chainage)]
    if not len(within):
        raise UserError(f"{path}: no pose is between the ends of the axis; give the trajectory of this tunnel")
    run = within[-1] - within[0]
    if run > 0 and backwards:
        raise UserError(f"{path}: the trajectory runs {run:.0f} m up the axis, so --backwards is wrong")
    if run < 0 and not backwards:
        return [
            f"the trajectory runs {-run:.0f} m down the axis (--backwards confirms that): if chainage should increase along"
            " the drive, add the tunnel with --reverse"
        ]
    return []
