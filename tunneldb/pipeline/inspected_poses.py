"""Comparison of scanner positions that are in a scan file, or beside it, with its points; needs no axis."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tunneldb.alignment.given import XYZ
from tunneldb.errors import UserError
from tunneldb.pipeline.pose_check import places
from tunneldb.pointcloud.contents import Contents
from tunneldb.pointcloud.form import TunnelForm
from tunneldb.pointcloud.formats.scans import PosedScan
from tunneldb.pointcloud.pose_faults_text import stations_fault, trajectory_fault
from tunneldb.pointcloud.pose_sample import MAX_POINTS
from tunneldb.pointcloud.poses import longest_interval
from tunneldb.pointcloud.station_fit import find_misfits
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
    posed = [scan for scan in poses if scan.position is not None]
    if posed:
        numbers = np.array([scan.number for scan in posed], np.int64)
        stations = places(form.line, np.array([scan.position for scan in posed], np.float64))
        misfits = find_misfits(place, contents.sample.scan_id[some].astype(np.int64), numbers, stations)
        return None, stations_fault(misfits) if misfits else None
    beside = file_beside([path], "trajectory.csv")
    if beside is None or contents.times is None:
        return None, None
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


def _track(path: Path, form: TunnelForm) -> Track | None:
    table, _ = read_trajectory(path)
    order = np.argsort(table["time"], kind="stable")
    time, xyz = table["time"][order], table.columns(XYZ)[order]
    if np.any(np.diff(time) <= 0.0):
        return None
    longest = longest_interval(time)
    time, xyz = cover_week_end(time, xyz, longest)
    return Track(time, places(form.line, xyz), longest)
