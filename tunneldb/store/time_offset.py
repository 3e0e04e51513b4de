"""Change of the time offset of a survey's trajectory that is in the database."""

from __future__ import annotations

from typing import Any

import psycopg

from tunneldb.errors import UserError
from tunneldb.pointcloud.week_end import count_repeats
from tunneldb.store.poses import load_poses
from tunneldb.store.scanner import MISFIT, Positions, replace_positions, time_notes
from tunneldb.store.survey import Survey


def set_time_offset(connection: psycopg.Connection[Any], survey: Survey, seconds: float) -> tuple[str, ...]:
    """Set the seconds that are added to the times of a trajectory's file; return the remarks on the positions.

    Raises
    ------
    UserError
        If the survey has no trajectory.
    """
    if survey.platform != "mobile":
        raise UserError(f"--time-offset is about a trajectory; survey {survey.name} has none; omit it")
    row = connection.execute("SELECT time_offset, positions_note FROM tunnel.survey WHERE id = %s", [survey.id]).fetchone()
    assert row is not None
    former, note = row
    poses = load_poses(connection, survey)
    repeats = count_repeats(poses.time)
    time, xyz = poses.time[repeats:], poses.track[repeats:]
    own = time_notes(time, xyz, former)
    notes = [one for one in (note or "").split("; ") if one and one not in own and not one.startswith(MISFIT)]
    time = time - former + seconds
    notes += time_notes(time, xyz, seconds)
    replace_positions(connection, survey.id, Positions(True, time, xyz, tuple(notes), seconds), survey.srid)
    return tuple(notes)
