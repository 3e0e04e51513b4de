"""Comparison of scanner positions that are in a scan file, or beside it, with its points; needs no axis."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tunneldb.alignment.given import XYZ
from tunneldb.arrays import Float, Int64
from tunneldb.errors import UserError
from tunneldb.pipeline.pose_check import places
from tunneldb.pointcloud.contents import Contents
from tunneldb.pointcloud.form import TunnelForm
from tunneldb.pointcloud.formats.scans import PosedScan
from tunneldb.pointcloud.merged_scans import find_merged
from tunneldb.pointcloud.pose_faults_text import merged_fault, trajectory_fault
from tunneldb.pointcloud.pose_sample import MAX_POINTS
from tunneldb.pointcloud.poses import longest_interval
from tunneldb.pointcloud.station_doubt import doubt_stations
from tunneldb.pointcloud.stations import read_stations
from tunneldb.pointcloud.trajectory_file import read_trajectory
from tunneldb.pointcloud.trajectory_fit import Track, fit_trajectory
from tunneldb.pointcloud.week_end import cover_week_end


def file_beside(paths: Sequence[Path], ending: str) -> Path | None:
    """Return the file beside scans with the same name but another extension; None if there is none, or several."""
    found = set()
    for scan in paths:
        stem = scan.name.split(".", 1)[0]
        for path in scan.parent.glob(f"*.{ending}"):
            if stem == path.name[: -len(ending) - 1] or stem.startswith(f"{path.name[: -len(ending) - 1]}-"):
                found.add(path)
    return found.pop() if len(found) == 1 else None


def doubt_poses(
    path: Path, contents: Contents, form: TunnelForm | None, poses: Sequence[PosedScan]
) -> tuple[float | None, str | None]:
    """Return the time offset and the doubt of `tunneldb.pipeline.inspection.FileLook`."""
    if form is None:
        return None, None
    some = slice(None, None, -(-len(contents.xyz) // MAX_POINTS))
    place = places(form.line, contents.xyz[some])
    scan_id = contents.sample.scan_id[some].astype(np.int64)
    try:
        known = _stations(path, form, poses)
    except UserError as error:
        return None, str(error)
    if known is not None:
        doubt = doubt_stations(place, scan_id, *known)
        return None, doubt[0] if doubt else None
    beside = file_beside([path], "trajectory.csv")
    if beside is None or contents.times is None:
        merged = find_merged(place[:, 0], scan_id)
        return None, f"if the scanner stood on tripods: {merged_fault(merged)}" if merged else None
    try:
        track = _track(beside, form)
    except UserError as error:
        return None, str(error)
    fit = None if track is None else fit_trajectory(contents.sample.time[some], place, track)
    if fit is None or not (fit.refused or fit.doubtful or fit.offset is not None):
        return None, None
    return None if fit.scale else fit.offset, trajectory_fault(
        fit, 0.0, f"survey add … --trajectory {beside.name} --time-offset"
    )


def _stations(path: Path, form: TunnelForm, poses: Sequence[PosedScan]) -> tuple[Int64, Float] | None:
    """Return scan numbers and stations, of the file or the table beside it, relative to the tunnel's line; None without."""
    posed = [scan for scan in poses if scan.position is not None]
    if posed:
        numbers, xyz = [scan.number for scan in posed], np.array([scan.position for scan in posed], np.float64)
    else:
        beside = file_beside([path], "stations.csv")
        if beside is None:
            return None
        table = read_stations([beside])
        numbers, xyz = table.scan_id.tolist(), table.xyz
    order = np.argsort(numbers, kind="stable")
    return np.array(numbers, np.int64)[order], places(form.line, xyz)[order]


def _track(path: Path, form: TunnelForm) -> Track | None:
    table, _ = read_trajectory(path)
    order = np.argsort(table["time"], kind="stable")
    time, xyz = table["time"][order], table.columns(XYZ)[order]
    if np.any(np.diff(time) <= 0.0):
        return None
    longest = longest_interval(time)
    time, xyz = cover_week_end(time, xyz, longest)
    return Track(time, places(form.line, xyz), longest)
