"""Request of a batch: files to read, kilometres, and the stage to which each is processed."""

from __future__ import annotations

import datetime as dt
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import psycopg
from psycopg.rows import class_row
from psycopg.types.json import Jsonb
from psycopg.types.range import Range

from tunneldb.errors import UserError
from tunneldb.geometry.units import Units
from tunneldb.pipeline.load import parameters_of, settings_of
from tunneldb.pointcloud.reader import check_header, read_header
from tunneldb.pointcloud.selection import FilterSettings
from tunneldb.pointcloud.units import NOT_GIVEN, GivenUnits, in_units
from tunneldb.queue.expected import damaged_kilometres, expected_kilometres, kilometres_near_damaged
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
    touched : tuple of int
        Kilometres to request: expected ones, or those with its points if it was already read. Empty if unknown.
    awaited : tuple of int
        Kilometres that wait for it, or fail with it if it is unreadable.
    error : str or None
        Reason why it can't be read.
    already_read : bool
        True if it was already read and is unchanged, by path, size and times.
    """

    name: str
    path: Path
    bytes: int
    points: int
    touched: tuple[int, ...] = ()
    awaited: tuple[int, ...] = ()
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
    only : range or None
        Kilometres to which it is restricted; None for all.
    skipped : tuple of str
        Files that it names and that lie outside these kilometres, by their headers and a sample of their points.
    """

    files: tuple[Incoming, ...]
    kilometres: tuple[int, ...]
    stage: str | None
    parameters: dict[str, Any] = field(default_factory=dict)
    reading: dict[str, Any] = field(default_factory=dict)
    only: range | None = None
    skipped: tuple[str, ...] = ()


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
    found = _headers(conn, survey, [*named, *again], settings_of(how), kilometres)
    files = [file for file in found if kilometres is None or file.error or _touches(file, kilometres)]
    requested = {km for file in files for km in file.touched}
    if not named:
        goals = _goals(conn, survey)
        options = kilometres is not None or stage is not None or parameters
        requested |= goals if goals and not options else goals | set(loaded_kilometres(conn, survey))
    chosen = {km for km in requested if kilometres is None or km in kilometres}
    if not chosen and all(file.already_read for file in files) and not _awaits(conn, survey):
        where = "" if kilometres is None else f" in kilometres {kilometres[0]}-{kilometres[-1]}"
        raise UserError(f"survey {survey.name} has nothing to do{where}; type tunneldb batch {survey.name} FILES")
    skipped = tuple(file.name for file in found if file not in files)
    return Plan(tuple(files), tuple(sorted(chosen)), stage, dict(parameters or {}), how, kilometres, skipped)


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


def _headers(
    conn: psycopg.Connection[Any], survey: Survey, paths: Sequence[Path], settings: FilterSettings, wanted: range | None
) -> list[Incoming]:
    if not paths:
        return []
    alignment, mobile, reach = load_alignment(conn, survey), is_mobile(conn, survey), settings.max_distance
    read = {
        row[0]: row[1:]
        for row in conn.execute(
            "SELECT f.name, f.path, f.bytes, f.loaded_at, f.unit, f.height_unit, ARRAY(SELECT k.km FROM tunnel.file_km k"
            " WHERE k.file_id = f.id AND k.rows > 0 ORDER BY k.km) FROM tunnel.scan_file f WHERE f.survey_id = %s",
            [survey.id],
        ).fetchall()
    }
    files = []
    for path in paths:
        size = path.stat().st_size
        points = 0
        try:
            known = read.get(path.name)
            same = known is not None and _untouched(path, size, *known[:3])
            units = GivenUnits(*known[3:5]) if known and same and settings.units == NOT_GIVEN else settings.units
            header = in_units(read_header(path), units)
            points = header.points
            check_header(header, survey.intensity_dimension, survey.srid, needs_time=mobile)
            if known and same and header.units == Units(*known[3:5]):
                files.append(Incoming(path.name, path, size, points, tuple(known[5]), already_read=True))
                continue
            expected = expected_kilometres(header, alignment, reach, wanted)
        except UserError as error:
            near = tuple(kilometres_near_damaged(path, alignment, reach))
            failing = tuple(damaged_kilometres(path, alignment, reach))
            files.append(Incoming(path.name, path, size, points, near, failing, str(error)))
            continue
        files.append(Incoming(path.name, path, size, points, tuple(expected or ()), tuple(expected or ())))
    return files


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
        damaged = damaged_kilometres(Path(row[0]), load_alignment(conn, survey), reach)
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


def _touches(file: Incoming, kilometres: range) -> bool:
    """Return True if a file may have points in some kilometres; a file of unknown place may."""
    return not file.touched or any(km in kilometres for km in file.touched)


def _goals(conn: psycopg.Connection[Any], survey: Survey) -> set[int]:
    return {row[0] for row in conn.execute("SELECT km FROM tunnel.goal WHERE survey_id = %s", [survey.id]).fetchall()}


def _awaits(conn: psycopg.Connection[Any], survey: Survey) -> bool:
    return conn.execute("SELECT FROM tunnel.incoming WHERE survey_id = %s LIMIT 1", [survey.id]).fetchone() is not None


def register(conn: psycopg.Connection[Any], survey: Survey, asked: Plan, *, retry: bool = False) -> int:
    """Record the request of a batch, and defer the jobs that are ready, in one transaction; return their number.

    Earlier requests stay: a kilometre is processed to the later one of two stages, and parameters that are not set keep their
    values. The files keep the request, too: it is for the kilometres that their points turn out to lie in.

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
        conn.execute(_REQUEST, _request(survey, asked))
        if retry:
            conn.execute("UPDATE tunnel.goal SET retry_after = clock_timestamp() WHERE survey_id = %s", [survey.id])
        row = conn.execute("SELECT tunnel_internal.queue_plan(%s)", [survey.id]).fetchone()
    assert row is not None
    return int(row[0])


_INCOMING = """
INSERT INTO tunnel.incoming AS i (survey_id, name, path, bytes, points, km_from, km_to, parameters, kilometres,
                                  failed_at, message)
VALUES (%(survey)s, %(name)s, %(path)s, %(bytes)s, %(points)s, %(km_from)s, %(km_to)s, %(parameters)s, 'empty',
        CASE WHEN %(error)s::text IS NOT NULL THEN clock_timestamp() END, %(error)s)
ON CONFLICT (survey_id, name) DO UPDATE
   SET path = excluded.path, bytes = excluded.bytes, points = excluded.points, km_from = excluded.km_from,
       km_to = excluded.km_to, parameters = excluded.parameters, requested_at = excluded.requested_at,
       failed_at = excluded.failed_at, message = excluded.message
 WHERE i.failed_at IS NOT NULL OR excluded.failed_at IS NOT NULL
    OR (i.path, i.bytes, i.parameters) IS DISTINCT FROM (excluded.path, excluded.bytes, excluded.parameters)
"""

_REQUEST = """
UPDATE tunnel.incoming i
   SET stage = (SELECT s.name FROM tunnel.stage s WHERE s.name IN (i.stage, %(stage)s) ORDER BY s.step DESC LIMIT 1),
       stage_parameters = i.stage_parameters || %(parameters)s,
       kilometres = range_merge(i.kilometres, %(kilometres)s::int4range)
 WHERE i.survey_id = %(survey)s AND (%(names)s::text[] IS NULL OR i.name = ANY (%(names)s))
"""
"""The files of a request, or all that wait if it names none; a restriction that one of two requests lacks is dropped."""

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
        "km_from": min(file.awaited, default=None),
        "km_to": max(file.awaited, default=None),
        "parameters": Jsonb(asked.reading),
        "error": file.error,
    }


def _request(survey: Survey, asked: Plan) -> dict[str, Any]:
    named = bool(asked.files or asked.skipped)
    return {
        "survey": survey.id,
        "stage": asked.stage or (STAGE_NAMES[-1] if named else None),
        "parameters": Jsonb(asked.parameters),
        "kilometres": None if asked.only is None else Range(asked.only[0], asked.only[-1] + 1),
        "names": [file.name for file in asked.files] if named else None,
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


def only_loaded(conn: psycopg.Connection[Any], survey: Survey, asked: Plan, since: dt.datetime) -> list[int]:
    """Return the kilometres that got points of files since a moment, and are not run because the batch is restricted."""
    if asked.only is None or asked.stage == "load":
        return []
    rows = conn.execute(
        """
        SELECT DISTINCT k.km FROM tunnel.file_km k
          JOIN tunnel.scan_file f ON f.id = k.file_id
          JOIN tunnel.goal g ON g.survey_id = f.survey_id AND g.km = k.km AND g.stage = 'load'
         WHERE f.survey_id = %s AND k.rows > 0 AND k.loaded_at >= %s AND k.km <> ALL (%s) ORDER BY k.km
        """,
        [survey.id, since, list(asked.only)],
    ).fetchall()
    return [row[0] for row in rows]


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
