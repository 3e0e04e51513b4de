"""Scanner positions of a survey, from the database."""

from __future__ import annotations

from typing import Any

import numpy as np
import psycopg
from psycopg import sql

from tunneldb.database.fetch import fetch_array
from tunneldb.errors import UserError
from tunneldb.pointcloud.poses import PoseModel
from tunneldb.store.survey import Survey


def load_poses(conn: psycopg.Connection[Any], survey: Survey) -> PoseModel:
    """Read the trajectory of a mobile survey, or the stations of a static one.

    Raises
    ------
    UserError
        If the survey has none.
    """
    table, key = ("pose", "time") if survey.platform == "mobile" else ("station", "scan_id")
    fields: list[tuple[str, str, sql.Composable]] = [(key, "f8", sql.SQL("{}::float8").format(sql.Identifier(key)))]
    fields += [("x", "f8", sql.SQL("ST_X(geom)")), ("y", "f8", sql.SQL("ST_Y(geom)")), ("z", "f8", sql.SQL("ST_Z(geom)"))]
    source = sql.SQL("FROM {} WHERE survey_id = %(survey)s").format(sql.Identifier("tunnel", table))
    rows = fetch_array(conn, fields, source, {"survey": survey.id})
    if len(rows) == 0:
        kind = "trajectory" if survey.platform == "mobile" else "stations"
        raise UserError(f"survey {survey.name} has no {kind}: add the survey again with --{kind}")
    xyz = np.column_stack([rows["x"], rows["y"], rows["z"]])
    if survey.platform == "mobile":
        return PoseModel.from_trajectory(rows["time"], xyz)
    return PoseModel.from_stations(rows["scan_id"].astype(np.int64), xyz)
