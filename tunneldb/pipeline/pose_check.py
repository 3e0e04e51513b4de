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
from tunneldb.pointcloud.pose_faults_text import trajectory_fault
from tunneldb.pointcloud.pose_sample import MAX_POINTS, SampledPoints
from tunneldb.pointcloud.selection import FilterSettings
from tunneldb.pointcloud.station_doubt import doubt_stations
from tunneldb.pointcloud.trajectory_fit import Track, fit_trajectory
from tunneldb.store.partition import rows_in
from tunneldb.store.poses import load_coarse_trajectory, load_poses
from tunneldb.store.scanner import MISFIT
from tunneldb.store.sources import sample
from tunneldb.store.surface import load_alignment
from tunneldb.store.survey import Survey

MAX_KILOMETRES = 20
"""Greatest number of kilometres whose loaded points are compared with new positions."""


@dataclass(frozen=True)
class PoseDoubt:
    """Doubt about the positions of a file's points: whether results would be wrong, and too many points have no position."""

    text: str
    refused: bool
    unposed: bool = False


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
    accepted : bool
        True if the user accepts positions that do not fit.
    """

    line: PlanLine
    track: Track | None
    scans: Int64
    stations: Float
    survey: str
    time_offset: float
    accepted: bool

    @classmethod
    def of(cls, conn: psycopg.Connection[Any], survey: Survey, alignment: Alignment) -> PoseCheck | None:
        """Read the scanner positions of a survey; None if they are unknown."""
        if survey.platform == "unknown":
            return None
        row = conn.execute("SELECT time_offset, poses_accepted FROM tunnel.survey WHERE id = %s", [survey.id]).fetchone()
        assert row is not None
        line = PlanLine.of(alignment.vertices, alignment.number * alignment.spacing)
        if survey.platform == "static":
            poses = load_poses(conn, survey)
            return cls(line, None, poses.scan_id, places(line, poses.station), survey.name, 0.0, row[1])
        poses = load_coarse_trajectory(conn, survey)
        track = Track(poses.time, places(line, poses.track), poses.longest)
        return cls(line, track, np.empty(0, np.int64), np.empty((0, 3)), survey.name, *row)

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
            If results from these positions would be wrong, and the user does not accept them.
        """
        doubt = self.doubt(points, max_left_out)
        if doubt is None or not doubt.refused:
            return None if doubt is None else doubt.text
        if not self.accepted:
            accept = "" if doubt.unposed else f"; or load it as it is: tunneldb survey set {self.survey} --accept-poses"
            raise UserError(f"{path}: {doubt.text}{accept}")
        return f"{doubt.text}; loaded as it is (--accept-poses)"

    def doubt(self, points: SampledPoints, max_left_out: float) -> PoseDoubt | None:
        """Return a doubt about the positions of points; None if they fit. Parameters as for `check`."""
        place = places(self.line, points.xyz)
        if self.track is None:
            return self._doubt_stations(place, points.scan_id.astype(np.int64))
        return self._doubt_trajectory(points.time, place, max_left_out)

    def _doubt_trajectory(self, time: Float, place: Float, max_left_out: float) -> PoseDoubt | None:
        assert self.track is not None
        fit = fit_trajectory(time, place, self.track)
        if fit is None:
            return None
        unposed = 1.0 - fit.known > max_left_out and (fit.offset is not None)
        if not (fit.refused or fit.doubtful or unposed):
            return None
        said = trajectory_fault(fit, self.time_offset, f"tunneldb survey set {self.survey} --time-offset")
        return PoseDoubt(said, fit.refused or unposed, unposed)

    def _doubt_stations(self, place: Float, scan_id: Int64) -> PoseDoubt | None:
        doubt = doubt_stations(place, scan_id, self.scans, self.stations)
        if doubt is None:
            return None
        text, refused = doubt
        return PoseDoubt(f"{text}; fix the stations, then: tunneldb survey set {self.survey} --stations FILE", refused)


def check_loaded_points(conn: psycopg.Connection[Any], survey: Survey) -> str | None:
    """Compare new scanner positions of a survey with its loaded points; a doubt becomes a note on the positions.

    Raises
    ------
    UserError
        If results from these positions would be wrong, and the user does not accept them.
    """
    conn.execute("UPDATE tunnel.scan_file SET pose_note = NULL WHERE survey_id = %s", [survey.id])
    check = None if survey.site else PoseCheck.of(conn, survey, load_alignment(conn, survey))
    kms = _some_kilometres(conn, survey)
    if check is None or not kms:
        return None
    parts = [sample(conn, survey, km, MAX_POINTS // len(kms)) for km in kms]
    points = SampledPoints(*(np.concatenate([getattr(part, name) for part in parts]) for name in ("xyz", "time", "scan_id")))
    doubt = check.doubt(points, FilterSettings().max_left_out)
    if doubt is None:
        return None
    if doubt.refused and not check.accepted:
        raise UserError(f"{MISFIT}{doubt.text}; or set them as they are: add --accept-poses")
    note = f"{MISFIT}{doubt.text.replace('; ', ', ')}" + (", set as they are (--accept-poses)" if doubt.refused else "")
    conn.execute(
        "UPDATE tunnel.survey SET positions_note = concat_ws('; ', positions_note, %s::text) WHERE id = %s", [note, survey.id]
    )
    return note


def _some_kilometres(conn: psycopg.Connection[Any], survey: Survey) -> list[int]:
    """Return kilometres with points, at most MAX_KILOMETRES, spread evenly."""
    rows = conn.execute(
        "SELECT DISTINCT k.km FROM tunnel.file_km k JOIN tunnel.scan_file f ON f.id = k.file_id"
        " WHERE f.survey_id = %s ORDER BY 1",
        [survey.id],
    ).fetchall()
    kms = [km for (km,) in rows if rows_in(conn, survey, km)]
    return [kms[k] for k in np.unique(np.linspace(0, len(kms) - 1, min(len(kms), MAX_KILOMETRES)).astype(int))]


def places(line: PlanLine, xyz: Float) -> Float:
    """Return distance along a line, to its right, and height of points (n, 3), m."""
    return np.column_stack([*line.place(xyz), xyz[:, 2]]) if len(xyz) else np.empty((0, 3))
