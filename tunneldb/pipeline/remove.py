"""Remove files from a survey: the rest is as if they had never been loaded."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import psycopg

from tunneldb.counted import counted
from tunneldb.database.locks import wait_for_kilometre
from tunneldb.errors import UserError
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.pipeline.load import load_kilometre
from tunneldb.pipeline.load_settings import parameters_of, settings_of
from tunneldb.pipeline.read import Reading
from tunneldb.pointcloud.selection import FilterSettings
from tunneldb.progress import StartProgress, silent
from tunneldb.stages.ledger import stage_run
from tunneldb.store.clearing import Work, clear_kilometre, has_results, work_in
from tunneldb.store.partition import partition_exists
from tunneldb.store.scan_files import Recorded, kilometres_of, recorded_files, withdraw_file
from tunneldb.store.survey import Survey

_MAX_NAMED = 10


@dataclass
class Removed:
    """Result of removing files from a survey.

    Attributes
    ----------
    reread : list of str
        Files that overlap the removed ones, and were read again.
    kilometres : list of int
        Kilometres that were loaded anew.
    emptied : list of int
        Kilometres without points, whose results are gone.
    lost : Work
        Manual edits lost with these results.
    """

    reread: list[str] = field(default_factory=list)
    kilometres: list[int] = field(default_factory=list)
    emptied: list[int] = field(default_factory=list)
    lost: Work = field(default_factory=lambda: Work(0, 0, 0))


def known_names(conn: psycopg.Connection[Any], survey: Survey, names: Sequence[str]) -> None:
    """Require that a survey has files of these names, or that a batch must read them.

    Raises
    ------
    UserError
        If a name is neither's; with the existing names.
    """
    rows = conn.execute(
        "SELECT name FROM tunnel.scan_file WHERE survey_id = %(survey)s"
        " UNION SELECT name FROM tunnel.incoming WHERE survey_id = %(survey)s ORDER BY 1",
        {"survey": survey.id},
    ).fetchall()
    there = [row[0] for row in rows]
    unknown = [name for name in names if name not in there]
    if unknown:
        more = f" and {len(there) - _MAX_NAMED} more" if len(there) > _MAX_NAMED else ""
        listed = f"{', '.join(there[:_MAX_NAMED])}{more}" if there else "none"
        raise UserError(f"survey {survey.name} has no file {', '.join(unknown)}; nothing was removed. Its files: {listed}")


def work_at_stake(conn: psycopg.Connection[Any], survey: Survey, names: Sequence[str]) -> tuple[list[int], Work]:
    """Return the kilometres that would have no points without these files, and the results lost with them."""
    recorded = recorded_files(conn, survey)
    kms = _spans([recorded[name] for name in names if name in recorded])
    rows = conn.execute(
        "SELECT DISTINCT k.km FROM tunnel.file_km k JOIN tunnel.scan_file f ON f.id = k.file_id"
        " WHERE f.survey_id = %s AND k.rows > 0 AND f.name <> ALL (%s)",
        [survey.id, list(names)],
    ).fetchall()
    emptied = sorted(kms - {row[0] for row in rows})
    return emptied, work_in(conn, survey, emptied)


def remove_files(conn: psycopg.Connection[Any], survey: Survey, names: Sequence[str], begin: StartProgress = silent) -> Removed:
    """Remove files from a survey, and from the list of those that a batch must read.

    Thinning looks at all files of a kilometre together, so files that overlap a removed one are read again. That is one
    transaction, each kilometre that is loaded anew without the files another. One that is left without points loses its
    partition and all that was made of it. After an interruption, the next call completes the removal.

    Parameters
    ----------
    conn : Connection
        Idle.
    survey : Survey
    names : sequence of str
        Names of files, see `known_names`.
    begin : callable
        Called with each step that begins; returns a function that takes its progress.

    Raises
    ------
    UserError
        If a name is unknown in the survey, a file that must be read again is not where it was, or another process works on the
        survey.
    """
    known_names(conn, survey, names)
    former = [file for name, file in recorded_files(conn, survey).items() if name in names]
    conn.rollback()
    result = Removed()
    if former:
        _reload(conn, survey, former, result, begin)
    with conn.transaction():
        conn.execute("SELECT tunnel_internal.queue_lock(%s)", [survey.id])
        conn.execute(
            "DELETE FROM tunnel.scan_file f WHERE f.id = ANY (%s) AND f.bytes = 0"
            " AND NOT EXISTS (SELECT FROM tunnel.file_km k WHERE k.file_id = f.id)",
            [[file.id for file in former]],
        )
        conn.execute("DELETE FROM tunnel.incoming WHERE survey_id = %s AND name = ANY (%s)", [survey.id, list(names)])
        # kilometres that failed with a file, or waited for it, can go on
        conn.execute("SELECT tunnel_internal.queue_plan(%s)", [survey.id])
    conn.commit()
    return result


def _reload(
    conn: psycopg.Connection[Any], survey: Survey, former: Sequence[Recorded], result: Removed, begin: StartProgress
) -> None:
    names = [file.name for file in former]
    settings = _settings(conn, survey, None)
    conn.rollback()
    if any(file.bytes for file in former):
        with stage_run(conn, survey.id, None, "read", {**parameters_of(settings), "removed": names}) as run:
            result.reread = _withdraw(conn, survey, former, settings, begin)
            run.counts["reread"] = result.reread
    waiting = conn.execute(
        "SELECT DISTINCT k.km FROM tunnel.file_km k JOIN tunnel.scan_file f ON f.id = k.file_id"
        " WHERE f.survey_id = %s AND k.loaded_at IS NULL",
        [survey.id],
    ).fetchall()
    waits = {row[0] for row in waiting}
    # of a run that was cut off there may be kilometres without points, whose results still stand
    bare = {km for km in _spans(former) if not partition_exists(conn, survey, km) and has_results(conn, survey, km)}
    conn.rollback()
    for km in sorted(waits | bare):
        with stage_run(conn, survey.id, km, "load", parameters_of(settings)) as run:
            run.counts.update(load_kilometre(conn, survey, km, settings))
            result.kilometres.append(km)
            if run.counts["kept"] == 0:
                lost = clear_kilometre(conn, survey, km)
                run.counts["note"] = _farewell(names, lost)
                result.emptied.append(km)
                so_far = result.lost
                result.lost = Work(
                    so_far.anomalies + lost.anomalies,
                    so_far.reviewed + lost.reviewed,
                    so_far.edited + lost.edited,
                    so_far.drawn + lost.drawn,
                )


def _withdraw(
    conn: psycopg.Connection[Any], survey: Survey, former: Sequence[Recorded], settings: FilterSettings, begin: StartProgress
) -> list[str]:
    """Read overlapping files again, and mark that the removed ones left their kilometres; all or nothing."""
    reading = Reading.of(conn, survey, settings)
    present = [file for file in former if file.bytes]
    others = [
        file for file in recorded_files(conn, survey).values() if file.bytes and file.name not in {f.name for f in former}
    ]
    again = reading.overlapped(present, others)
    why = f"{', '.join(file.name for file in present)} overlaps"
    remedy = f"give its current path (tunneldb load {survey.name} FILE), then remove again; nothing was removed"
    headers = [(reading.find(file, (), why, remedy), file) for file in again]
    for file in former:
        reading.claim(file.name)
    for km in kilometres_of(conn, [file.id for file in [*present, *again]]):
        wait_for_kilometre(conn, survey.id, km)
    for header, file in headers:
        own = replace(reading, settings=_settings(conn, survey, file.name))
        own.reread(header, file, begin)
    for file in present:
        withdraw_file(conn, file.id, reading.leave(file))
    return [file.name for file in again]


def _settings(conn: psycopg.Connection[Any], survey: Survey, name: str | None) -> FilterSettings:
    """Return how a file was read, from the ledger; missing settings, and with None all, are those of the last file."""
    row = conn.execute(
        """
        SELECT r.parameters FROM tunnel.run r
         WHERE r.survey_id = %(survey)s AND r.stage IN ('read', 'load') AND r.outcome = 'done'
           AND r.parameters ? 'load.density'
         ORDER BY (r.parameters ->> 'file' = %(name)s OR r.parameters -> 'files' ? %(name)s) DESC NULLS LAST, r.id DESC
         LIMIT 1
        """,
        {"survey": survey.id, "name": name},
    ).fetchone()
    return settings_of({} if row is None else row[0])


def _spans(files: Sequence[Recorded]) -> set[int]:
    """Return the kilometres from the first to the last point of each file."""
    return {km for file in files for km in range(math.floor(file.low / KILOMETRE), math.floor(file.high / KILOMETRE) + 1)}


def _farewell(names: Sequence[str], lost: Work) -> str:
    """Return a note on a kilometre that was removed with its files."""
    said = f"no points since {', '.join(names)} was removed"
    if lost.drawn:
        said += f"; {counted(lost.drawn, 'finding drawn by hand is', 'findings drawn by hand are')} kept"
    if not (lost.anomalies or lost.edited):
        return said
    gone = f", {lost.reviewed} of them reviewed" if lost.reviewed else ""
    edited = f", and {counted(lost.edited, 'axis vertex', 'axis vertices')} moved by hand" if lost.edited else ""
    areas = counted(lost.anomalies, "leak or dry dark area", "leaks and dry dark areas")
    return f"{said}; {areas}{gone}{edited} removed with them"
