"""Request of a batch: files to read, kilometres, and the stage to which each is processed."""

from __future__ import annotations

import datetime as dt
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import psycopg
from psycopg.rows import class_row
from psycopg.types.json import Jsonb

from tunneldb.errors import UserError
from tunneldb.geometry.alignment import Alignment
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.pipeline.load import chainages_near, header_kilometres, parameters_of, settings_of
from tunneldb.pointcloud.formats.las_bounds import header_box
from tunneldb.pointcloud.formats.table import format_of
from tunneldb.pointcloud.reader import ScanHeader, check_header, read_header
from tunneldb.stages.registry import STAGE_NAMES
from tunneldb.stages.run import loaded_kilometres
from tunneldb.store.poses import is_mobile
from tunneldb.store.surface import load_alignment
from tunneldb.store.survey import Survey


@dataclass(frozen=True)
class Incoming:
    """File named by a batch, with data from its header.

    Attributes
    ----------
    name : str
        Name without the folder, which identifies it in the survey.
    path : Path
        Absolute path.
    bytes, points : int
        Size, and number of points by the header; 0 points if it is unreadable.
    km_from, km_to : int or None
        First and last kilometre that it may touch; None if its box is unreadable, or it touches none.
    error : str or None
        Reason why it can't be read.
    already_read : bool
        True if it was already read and is unchanged, by path, size and times.
    """

    name: str
    path: Path
    bytes: int
    points: int
    km_from: int | None = None
    km_to: int | None = None
    error: str | None = None
    already_read: bool = False


@dataclass(frozen=True)
class Plan:
    """Request of a batch, before anything is done.

    Attributes
    ----------
    files : tuple of Incoming
        All files that it names, within its kilometres.
    kilometres : tuple of int
        Requested kilometres.
    stage : str or None
        Last stage to run; None for the stage requested before.
    parameters : dict
        Parameters that differ from the defaults, by name, including those of reading and loading.
    reading : dict
        All parameters of reading and loading.
    """

    files: tuple[Incoming, ...]
    kilometres: tuple[int, ...]
    stage: str | None
    parameters: dict[str, Any] = field(default_factory=dict)
    reading: dict[str, Any] = field(default_factory=dict)


def plan(
    conn: psycopg.Connection[Any],
    survey: Survey,
    paths: Sequence[Path] = (),
    *,
    kilometres: range | None = None,
    stage: str | None = None,
    reading: Mapping[str, Any] | None = None,
    parameters: Mapping[str, float] | None = None,
    retry: bool = False,
) -> Plan:
    """Read the headers of files, and find the requested kilometres; this changes nothing.

    Parameters
    ----------
    conn : Connection
    survey : Survey
    paths : sequence of Path
        Scan files; none to continue with the requested and loaded ones.
    kilometres : range, optional
        Kilometres to include.
    stage : str, optional
        Last stage to run; by default the last of all.
    reading : mapping, optional
        Parameters of reading and loading (for example ``load.density``) that differ from their defaults. If the survey has a
        density, it is used.
    parameters : mapping, optional
        Parameters of the stages.
    retry : bool
        True to read failed files again; a missing one stays failed.

    Raises
    ------
    UserError
        If a file is missing, two have the same name, or there is nothing to do.
    """
    named = [path.resolve() for path in paths]
    _require_files(named)
    again = _failed_paths(conn, survey, {path.name for path in named}) if retry else []
    how = parameters_of(settings_of({**_present_density(conn, survey), **(reading or {})}))
    files = _headers(conn, survey, [*named, *again], float(how["load.max_distance"]))
    if kilometres is not None:
        files = [file for file in files if file.error or _touches(file, kilometres)]
    requested = {km for file in files for km in _kilometres(file)}
    requested |= _near_damaged(conn, survey, files, float(how["load.max_distance"]))
    if not named:
        goals = _goals(conn, survey)
        options = kilometres is not None or stage is not None or parameters
        requested |= goals if goals and not options else goals | set(loaded_kilometres(conn, survey))
    chosen = {km for km in requested if kilometres is None or km in kilometres}
    if not chosen and not any(file.error for file in files) and not _awaits(conn, survey):
        where = "" if kilometres is None else f" in kilometres {kilometres[0]}-{kilometres[-1]}"
        raise UserError(f"survey {survey.name} has nothing to do{where}; type tunneldb batch {survey.name} FILES")
    return Plan(tuple(files), tuple(sorted(chosen)), stage, dict(parameters or {}), how)


def _require_files(paths: Sequence[Path]) -> None:
    names: dict[str, Path] = {}
    for path in paths:
        if not path.is_file():
            what = "is a folder; pass the files in it" if path.is_dir() else "there is no such file"
            raise UserError(f"{path}: {what}; nothing was registered")
        if path.name in names:
            raise UserError(f"{path} and {names[path.name]} have the same name; names must be unique in a survey: rename one")
        names[path.name] = path


def _failed_paths(conn: psycopg.Connection[Any], survey: Survey, others: set[str]) -> list[Path]:
    rows = conn.execute(
        "SELECT name, path FROM tunnel.incoming WHERE survey_id = %s AND failed_at IS NOT NULL ORDER BY km_from, name",
        [survey.id],
    ).fetchall()
    return [Path(path) for name, path in rows if name not in others and Path(path).is_file()]


def _present_density(conn: psycopg.Connection[Any], survey: Survey) -> dict[str, Any]:
    row = conn.execute(
        "SELECT r.parameters -> 'load.density' FROM tunnel.run r WHERE r.survey_id = %s AND r.stage IN ('read', 'load')"
        " AND r.outcome = 'done' AND r.parameters ? 'load.density' ORDER BY r.id DESC LIMIT 1",
        [survey.id],
    ).fetchone()
    return {} if row is None else {"load.density": row[0]}


def _headers(conn: psycopg.Connection[Any], survey: Survey, paths: Sequence[Path], reach: float) -> list[Incoming]:
    if not paths:
        return []
    alignment, mobile = load_alignment(conn, survey), is_mobile(conn, survey)
    read = {
        row[0]: row[1:]
        for row in conn.execute(
            "SELECT name, path, bytes, loaded_at FROM tunnel.scan_file WHERE survey_id = %s", [survey.id]
        ).fetchall()
    }
    files = []
    for path in paths:
        size = path.stat().st_size
        points = 0
        try:
            header = read_header(path)
            points = header.points
            check_header(header, survey.intensity_dimension, survey.srid, needs_time=mobile)
        except UserError as error:
            touched = _damaged_kilometres(path, alignment, reach)
            first, last = (touched[0], touched[-1]) if touched else (None, None)
            files.append(Incoming(path.name, path, size, points, first, last, str(error)))
            continue
        touched = header_kilometres(header, alignment, reach)
        if not touched:
            off = f"{path}: its points lie off the given axis of tunnel {survey.tunnel}; does the file belong to this tunnel?"
            files.append(Incoming(path.name, path, size, points, error=off))
            continue
        already_read = path.name in read and _untouched(path, size, *read[path.name])
        files.append(Incoming(path.name, path, size, points, touched[0], touched[-1], None, already_read))
    return files


def _near_damaged(conn: psycopg.Connection[Any], survey: Survey, files: Sequence[Incoming], reach: float) -> set[int]:
    """Return the kilometres that unreadable files may touch; they are requested like those of readable files."""
    damaged = [header for file in files if file.error and (header := _damaged_header(file.path)) is not None]
    if not damaged:
        return set()
    alignment = load_alignment(conn, survey)
    return {km for header in damaged for km in header_kilometres(header, alignment, reach)}


def _damaged_header(path: Path) -> ScanHeader | None:
    """Return the header of an unreadable file with its box, if that is readable."""
    box = header_box(path) if format_of(path).is_las else None
    return None if box is None else ScanHeader(path, 0, (), None, np.array(box[0]), np.array(box[1]))


def _damaged_kilometres(path: Path, alignment: Alignment, reach: float) -> range:
    """Return the kilometres that fail with an unreadable file: those of its box, if that is readable."""
    header = _damaged_header(path)
    return range(0) if header is None else _inner_kilometres(header, alignment, reach)


def _inner_kilometres(header: ScanHeader, alignment: Alignment, reach: float) -> range:
    """Return the kilometres in which the axis crosses the box of a file, not just near its ends; empty if none."""
    ends = extent(header, alignment, reach)
    return range(0) if ends is None else range(int(ends[0] // KILOMETRE), int(ends[1] // KILOMETRE) + 1)


def extent(header: ScanHeader, alignment: Alignment, reach: float) -> tuple[float, float] | None:
    """Return the first and last chainage of a file, by its box; rather too short than too long.

    The part of the axis within the reach of the box is shortened at both ends by 1.5 times the reach, since the box may be
    oblique to the axis, and by one step of the axis.

    Parameters
    ----------
    header : ScanHeader
    alignment : Alignment
        Given axis.
    reach : float
        Greatest distance of the tunnel from the axis, m.

    Returns
    -------
    tuple or None
        Two chainages, m; None if the file is not near the axis.
    """
    chainage = chainages_near(header, alignment, reach)
    if not len(chainage):
        return None
    margin = min(1.5 * reach + alignment.spacing, float(np.ptp(chainage)) / 2.0)
    return float(chainage.min()) + margin, float(chainage.max()) - margin


def restrict_failed_file(conn: psycopg.Connection[Any], survey: Survey, name: str) -> None:
    """Restrict the effect of a failed file to the kilometres that contain its points, without those that it just touches.

    Does nothing for a file that has not finally failed, or whose box is unreadable.
    """
    with conn.transaction():
        conn.execute("SELECT tunnel_internal.queue_lock(%s)", [survey.id])
        row = conn.execute(
            "SELECT path, parameters FROM tunnel.incoming WHERE survey_id = %s AND name = %s AND failed_at IS NOT NULL",
            [survey.id, name],
        ).fetchone()
        if row is None or not Path(row[0]).is_file():
            return
        reach = settings_of(row[1]).max_distance
        damaged = _damaged_kilometres(Path(row[0]), load_alignment(conn, survey), reach)
        if damaged:
            conn.execute(
                "UPDATE tunnel.incoming SET km_from = %s, km_to = %s WHERE survey_id = %s AND name = %s",
                [damaged[0], damaged[-1], survey.id, name],
            )
            conn.execute("SELECT tunnel_internal.queue_plan(%s)", [survey.id])


def _untouched(path: Path, size: int, known_path: str, known_size: int, read_at: dt.datetime) -> bool:
    """Return True if a file is the one that was read; its checksum is computed only if path, size or times differ."""
    stat = path.stat()
    return str(path) == known_path and size == known_size and max(stat.st_mtime, stat.st_ctime) < read_at.timestamp()


def _kilometres(file: Incoming) -> range:
    return range(0) if file.km_from is None or file.km_to is None else range(file.km_from, file.km_to + 1)


def _touches(file: Incoming, kilometres: range) -> bool:
    return any(km in kilometres for km in _kilometres(file))


def _goals(conn: psycopg.Connection[Any], survey: Survey) -> set[int]:
    return {row[0] for row in conn.execute("SELECT km FROM tunnel.goal WHERE survey_id = %s", [survey.id]).fetchall()}


def _awaits(conn: psycopg.Connection[Any], survey: Survey) -> bool:
    return conn.execute("SELECT FROM tunnel.incoming WHERE survey_id = %s LIMIT 1", [survey.id]).fetchone() is not None


def register(conn: psycopg.Connection[Any], survey: Survey, asked: Plan, *, retry: bool = False) -> int:
    """Record the request of a batch, and defer the jobs that are ready, in one transaction; return their number.

    Earlier requests stay: a kilometre is processed to the later one of two stages, and parameters that are not set keep their
    values.
    set keep their values.

    Parameters
    ----------
    retry : bool
        True to run failed stages again; the failed files are those of the plan.
    """
    with conn.transaction():
        conn.execute("SELECT tunnel_internal.queue_lock(%s)", [survey.id])
        with conn.cursor() as cursor:
            cursor.executemany(_INCOMING, [_row(survey, file, asked) for file in asked.files if not file.already_read])
            cursor.executemany(_GOAL, [_goal(survey, km, asked) for km in asked.kilometres])
        if retry:
            conn.execute("UPDATE tunnel.goal SET retry_after = clock_timestamp() WHERE survey_id = %s", [survey.id])
        row = conn.execute("SELECT tunnel_internal.queue_plan(%s)", [survey.id]).fetchone()
    assert row is not None
    return int(row[0])


_INCOMING = """
INSERT INTO tunnel.incoming AS i (survey_id, name, path, bytes, points, km_from, km_to, parameters, failed_at, message)
VALUES (%(survey)s, %(name)s, %(path)s, %(bytes)s, %(points)s, %(km_from)s, %(km_to)s, %(parameters)s,
        CASE WHEN %(error)s::text IS NOT NULL THEN clock_timestamp() END, %(error)s)
ON CONFLICT (survey_id, name) DO UPDATE
   SET path = excluded.path, bytes = excluded.bytes, points = excluded.points, km_from = excluded.km_from,
       km_to = excluded.km_to, parameters = excluded.parameters, requested_at = excluded.requested_at,
       failed_at = excluded.failed_at, message = excluded.message
 WHERE i.failed_at IS NOT NULL OR excluded.failed_at IS NOT NULL
    OR (i.path, i.bytes, i.parameters) IS DISTINCT FROM (excluded.path, excluded.bytes, excluded.parameters)
"""

_GOAL = """
INSERT INTO tunnel.goal AS g (survey_id, km, stage, parameters)
VALUES (%(survey)s, %(km)s, coalesce(%(stage)s, %(last)s), %(reading)s || %(parameters)s)
ON CONFLICT (survey_id, km) DO UPDATE
   SET stage = CASE WHEN (%(stage)s IS NOT NULL OR %(new)s)
                     AND (SELECT s.step FROM tunnel.stage s WHERE s.name = excluded.stage)
                         > (SELECT s.step FROM tunnel.stage s WHERE s.name = g.stage)
                    THEN excluded.stage ELSE g.stage END,
       parameters = g.parameters || %(parameters)s, requested_at = excluded.requested_at
"""


def _row(survey: Survey, file: Incoming, asked: Plan) -> dict[str, Any]:
    return {
        "survey": survey.id,
        "name": file.name,
        "path": str(file.path),
        "bytes": file.bytes,
        "points": file.points,
        "km_from": file.km_from,
        "km_to": file.km_to,
        "parameters": Jsonb(asked.reading),
        "error": file.error,
    }


def _goal(survey: Survey, km: int, asked: Plan) -> dict[str, Any]:
    return {
        "survey": survey.id,
        "km": km,
        "stage": asked.stage,
        "last": STAGE_NAMES[-1],
        "reading": Jsonb(asked.reading),
        "parameters": Jsonb(asked.parameters),
        "new": bool(asked.files),
    }


@dataclass(frozen=True)
class Result:
    """Result of a kilometre: ``state`` of its first stage that is not done, or ``done``."""

    km: int
    stage: str
    state: str
    message: str | None


def results(conn: psycopg.Connection[Any], survey: Survey) -> list[Result]:
    """Return the result of each requested kilometre, in order; those without points are omitted."""
    with conn.cursor(row_factory=class_row(Result)) as cursor:
        cursor.execute(
            """
            SELECT DISTINCT ON (km) km, stage, state, message FROM tunnel_internal.queue_state(%s)
             WHERE state <> 'empty' ORDER BY km, state = 'done', CASE WHEN state = 'done' THEN -step ELSE step END
            """,
            [survey.id],
        )
        return list(cursor)


def failed_files(conn: psycopg.Connection[Any], survey: Survey) -> list[tuple[str, str]]:
    """Return the files that could not be read, with the reasons."""
    return conn.execute(
        "SELECT name, message FROM tunnel.incoming WHERE survey_id = %s AND failed_at IS NOT NULL ORDER BY km_from, name",
        [survey.id],
    ).fetchall()


def notes_of_files(conn: psycopg.Connection[Any], survey: Survey, since: dt.datetime) -> list[tuple[str, str]]:
    """Return notes about files read since a moment, for example about assumptions: name and note."""
    return conn.execute(
        """
        SELECT DISTINCT ON (r.counts ->> 'file') r.counts ->> 'file', r.counts ->> 'note'
          FROM tunnel.run r
         WHERE r.survey_id = %s AND r.stage = 'read' AND r.outcome = 'done' AND r.started_at >= %s AND r.counts ? 'note'
         ORDER BY r.counts ->> 'file', r.id DESC
        """,
        [survey.id, since],
    ).fetchall()
