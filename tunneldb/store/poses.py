"""Scanner positions: the stations of a survey, or its trajectory, whole or as far as a kilometre needs it."""

from __future__ import annotations

from typing import Any

import numpy as np
import psycopg
from psycopg import sql

from tunneldb.arrays import Float
from tunneldb.database.fetch import fetch_array
from tunneldb.errors import UserError
from tunneldb.pointcloud.pose_coverage import PoseCoverage
from tunneldb.pointcloud.poses import PoseModel
from tunneldb.store.survey import Survey

_PLACE = (
    ("x", "f8", sql.SQL("public.ST_X(geom)")),
    ("y", "f8", sql.SQL("public.ST_Y(geom)")),
    ("z", "f8", sql.SQL("public.ST_Z(geom)")),
)

_ALWAYS = [(-np.inf, np.inf)]
_ENDS = [(-np.inf, -np.inf), (np.inf, np.inf)]
"""Time spans, s: of the whole trajectory, and from its first pose to its last."""

# Of each span its poses, the last one before it and the first one after, by the primary key.
_ABOUT = sql.SQL(
    """
    FROM unnest(%(low)s::float8[], %(high)s::float8[]) AS s (low, high)
    CROSS JOIN LATERAL (
        SELECT p.time, p.geom
          FROM tunnel.pose p
         WHERE p.survey_id = %(survey)s
           AND p.time >= coalesce((SELECT max(b.time) FROM tunnel.pose b
                                    WHERE b.survey_id = %(survey)s AND b.time <= s.low), s.low)
           AND p.time <= coalesce((SELECT min(a.time) FROM tunnel.pose a
                                    WHERE a.survey_id = %(survey)s AND a.time >= s.high), s.high)
        OFFSET 0) q
    """
)

_FIRST_AFTER = sql.SQL(
    """
    FROM unnest(%(wanted)s::float8[]) AS s (wanted)
    CROSS JOIN LATERAL (
        SELECT p.time, p.geom FROM tunnel.pose p
         WHERE p.survey_id = %(survey)s AND p.time >= s.wanted ORDER BY p.time LIMIT 1) q
    """
)


def is_mobile(conn: psycopg.Connection[Any], survey: Survey) -> bool:
    """Return True if a survey's scanner positions come from a trajectory; raise an error if it has none of its kind.

    Raises
    ------
    UserError
        If it is to have a trajectory or stations, and has none.
    """
    if survey.platform == "unknown":
        return False
    table = sql.Identifier("tunnel", "pose" if survey.platform == "mobile" else "station")
    query = sql.SQL("SELECT FROM {} WHERE survey_id = %s LIMIT 1").format(table)
    if conn.execute(query, [survey.id]).fetchone() is None:
        raise _no_positions(survey)
    return survey.platform == "mobile"


def load_pose_coverage(conn: psycopg.Connection[Any], survey: Survey) -> PoseCoverage:
    """Read the scanner positions of a survey, of a trajectory only its ends and gaps.

    Raises
    ------
    UserError
        If it is to have a trajectory or stations, and has none.
    """
    if survey.platform != "mobile":
        return load_poses(conn, survey).coverage
    row = conn.execute(
        """
        SELECT (SELECT min(p.time) FROM tunnel.pose p WHERE p.survey_id = s.id),
               (SELECT max(p.time) FROM tunnel.pose p WHERE p.survey_id = s.id), s.trajectory_gaps
          FROM tunnel.survey s WHERE s.id = %s AND s.longest_interval IS NOT NULL
        """,
        [survey.id],
    ).fetchone()
    if row is None:
        raise _no_positions(survey)
    begin, end, gaps = row
    return PoseCoverage(np.empty(0, np.int64), (begin, end), np.array(gaps, np.float64).reshape(-1, 2))


def load_poses(conn: psycopg.Connection[Any], survey: Survey, km: int | None = None) -> PoseModel:
    """Read the stations of a static survey, or the trajectory of a mobile one; nothing of one without.

    Of the trajectory, a kilometre needs the ends, and the parts around the times of its points: positions from these are the
    same as from the whole.

    Raises
    ------
    UserError
        If the survey has none.
    """
    if survey.platform == "unknown":
        return PoseModel.unknown()
    if survey.platform == "mobile":
        return _trajectory(conn, survey, _ALWAYS if km is None else _spans(conn, survey, km))
    fields = (("scan_id", "i4", sql.Identifier("scan_id")), *_PLACE)
    rows = fetch_array(conn, fields, sql.SQL("FROM tunnel.station WHERE survey_id = %(survey)s"), {"survey": survey.id})
    if len(rows) == 0:
        raise _no_positions(survey)
    return PoseModel.from_stations(rows["scan_id"].astype(np.int64), _xyz(rows))


def load_coarse_trajectory(conn: psycopg.Connection[Any], survey: Survey, count: int = 5000) -> PoseModel:
    """Read about ``count`` poses of a trajectory, evenly spread over the time outside its gaps, and those at the gaps."""
    coverage = load_pose_coverage(conn, survey)
    assert coverage.ends is not None
    begins, ends = [coverage.ends[0], *coverage.gaps[:, 1]], [*coverage.gaps[:, 0], coverage.ends[1]]
    step = max(sum(end - begin for begin, end in zip(begins, ends, strict=True)) / count, 1e-3)
    wanted = np.concatenate([np.append(np.arange(begin, end, step), end) for begin, end in zip(begins, ends, strict=True)])
    fields = (("time", "f8", sql.Identifier("time")), *_PLACE)
    rows = fetch_array(conn, fields, _FIRST_AFTER, {"survey": survey.id, "wanted": wanted.tolist()})
    time, first = np.unique(rows["time"], return_index=True)
    row = conn.execute("SELECT longest_interval FROM tunnel.survey WHERE id = %s", [survey.id]).fetchone()
    assert row is not None
    return PoseModel.from_trajectory(time, _xyz(rows[first]), max(float(row[0]), 2.0 * step))


def _trajectory(conn: psycopg.Connection[Any], survey: Survey, spans: list[tuple[float, float]]) -> PoseModel:
    """Read the trajectory about spans of time."""
    row = conn.execute("SELECT longest_interval FROM tunnel.survey WHERE id = %s", [survey.id]).fetchone()
    if row is None or row[0] is None:
        raise _no_positions(survey)
    low, high = zip(*spans, strict=True)
    fields = (("time", "f8", sql.Identifier("time")), *_PLACE)
    rows = fetch_array(conn, fields, _ABOUT, {"survey": survey.id, "low": list(low), "high": list(high)})
    time, first = np.unique(rows["time"], return_index=True)
    return PoseModel.from_trajectory(time, _xyz(rows[first]), row[0])


def _spans(conn: psycopg.Connection[Any], survey: Survey, km: int) -> list[tuple[float, float]]:
    """Return the measuring times of a kilometre's points; all times, if unknown for a file, or one waits to be loaded."""
    row = conn.execute(
        """
        SELECT bool_and(k.seconds IS NOT NULL AND k.loaded_at IS NOT NULL),
               (SELECT range_agg(r) FROM tunnel.scan_file g JOIN tunnel.file_km o ON o.file_id = g.id
                 CROSS JOIN LATERAL unnest(o.seconds) AS r WHERE g.survey_id = %(survey)s AND o.km = %(km)s)
          FROM tunnel.scan_file f JOIN tunnel.file_km k ON k.file_id = f.id
         WHERE f.survey_id = %(survey)s AND k.km = %(km)s
        """,
        {"survey": survey.id, "km": km},
    ).fetchone()
    if row is None or not row[0]:
        return _ALWAYS
    return [*_ENDS, *((float(part.lower), float(part.upper)) for part in row[1] or ())]


def _xyz(rows: Any) -> Float:
    return np.column_stack([rows["x"], rows["y"], rows["z"]])


def _no_positions(survey: Survey) -> UserError:
    kind = "trajectory" if survey.platform == "mobile" else "stations"
    return UserError(f"survey {survey.name} has no {kind}: tunneldb survey set {survey.name} --{kind} FILE")
