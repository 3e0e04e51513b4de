"""Comparison of a scan file's points with the survey's scanner positions, while the file is read."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import psycopg

from tunneldb.arrays import Float, Int64
from tunneldb.errors import UserError
from tunneldb.geometry.alignment import Alignment
from tunneldb.geometry.plan_line import PlanLine
from tunneldb.pointcloud.pose_faults_text import stations_fault, trajectory_fault
from tunneldb.pointcloud.pose_sample import SampledPoints
from tunneldb.pointcloud.station_fit import find_misfits
from tunneldb.pointcloud.trajectory_fit import Track, fit_trajectory, outside_section
from tunneldb.store.poses import load_coarse_trajectory, load_poses
from tunneldb.store.survey import Survey

MAX_MISFIT_SHARE = 0.1
"""Share of the points of scans with wrong stations from which a file is refused."""

_NEAR = 10.0  # m along the tunnel within which the points of a station show the section about it


@dataclass(frozen=True)
class PoseCheck:
    """Scanner positions of a survey, for comparison with points.

    Attributes
    ----------
    line : PlanLine
        The tunnel's given axis.
    track : Track or None
        Trajectory; None for stations.
    scans, stations : (k,) int64 and (k, 3) float64 arrays
        Stations relative to the line; empty for a trajectory.
    survey : str
        Name of the survey.
    time_offset : float
        Seconds that were added to the times of the trajectory.
    """

    line: PlanLine
    track: Track | None
    scans: Int64
    stations: Float
    survey: str
    time_offset: float

    @classmethod
    def of(cls, conn: psycopg.Connection[Any], survey: Survey, alignment: Alignment) -> PoseCheck | None:
        """Read the scanner positions of a survey; None if they are unknown."""
        if survey.platform == "unknown":
            return None
        line = PlanLine.of(alignment.vertices, alignment.number * alignment.spacing)
        if survey.platform == "static":
            poses = load_poses(conn, survey)
            return cls(line, None, poses.scan_id, places(line, poses.station), survey.name, 0.0)
        poses = load_coarse_trajectory(conn, survey)
        row = conn.execute("SELECT time_offset FROM tunnel.survey WHERE id = %s", [survey.id]).fetchone()
        track = Track(poses.time, places(line, poses.track), poses.longest)
        return cls(line, track, np.empty(0, np.int64), np.empty((0, 3)), survey.name, float(row[0]) if row else 0.0)

    def check(self, path: Path, points: SampledPoints, max_left_out: float) -> str | None:
        """Return a doubt about the scanner positions of a file's points; None if they fit.

        Parameters
        ----------
        path : Path
            The file, for messages.
        points : SampledPoints
            Sample of its points near the axis.
        max_left_out : float
            Share of the points that may be without a position.

        Raises
        ------
        UserError
            If results from these positions would be wrong.
        """
        place = places(self.line, points.xyz)
        if self.track is None:
            return self._check_stations(path, place, points.scan_id.astype(np.int64))
        fit = fit_trajectory(points.time, place, self.track)
        if fit is None:
            return None
        unposed = 1.0 - fit.known > max_left_out and (fit.offset is not None)
        if not (fit.refused or fit.doubtful or unposed):
            return None
        said = trajectory_fault(fit, self.time_offset, f"tunneldb survey set {self.survey} --time-offset")
        if fit.refused or unposed:
            raise UserError(f"{path}: {said}")
        return said

    def _check_stations(self, path: Path, place: Float, scan_id: Int64) -> str | None:
        if not len(self.scans) or not len(place):
            return None
        at = np.minimum(np.searchsorted(self.scans, scan_id), len(self.scans) - 1)
        scanner = np.where((self.scans[at] == scan_id)[:, None], self.stations[at], np.nan)
        near = np.abs(scanner[:, 0] - place[:, 0]) < _NEAR
        scanner[~near] = np.nan
        outside = outside_section(place, scanner)
        if outside > 0.0:
            raise UserError(
                f"{path}: the stations lie {outside:.0f} m outside the tunnel's section, which its points show: they are of"
                f" another tunnel, or in another system; {self._again}"
            )
        misfits = find_misfits(place, scan_id, self.scans, self.stations)
        if not misfits:
            return None
        said = f"{stations_fault(misfits)}; {self._again}"
        if sum(one.share for one in misfits) > MAX_MISFIT_SHARE:
            raise UserError(f"{path}: {said}")
        return said

    @property
    def _again(self) -> str:
        return f"fix the stations, then: tunneldb survey set {self.survey} --stations FILE"


def places(line: PlanLine, xyz: Float) -> Float:
    """Return distance along a line, to its right, and height of points (n, 3), m."""
    return np.column_stack([*line.place(xyz), xyz[:, 2]]) if len(xyz) else np.empty((0, 3))
