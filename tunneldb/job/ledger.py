"""The ledger: a row of tunnel.run for every stage of every kilometre that was tried."""

from __future__ import annotations

import platform
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib.metadata import version
from typing import Any

import psycopg
from psycopg.types.json import Jsonb

from tunneldb import __version__
from tunneldb.errors import UserError

_LIBRARIES = ("numpy", "scipy", "numba", "laspy", "lazrs", "shapely", "rasterio", "psycopg")


@dataclass
class Run:
    """A run under way; what is put into ``counts`` is written with its end."""

    id: int
    counts: dict[str, Any] = field(default_factory=dict)


@contextmanager
def stage_run(
    conn: psycopg.Connection[Any], survey_id: int, km: int | None, stage: str, parameters: Mapping[str, Any]
) -> Iterator[Run]:
    """Record a stage, and do it in one transaction.

    That it runs is committed first. What is done inside is committed together with its end, or rolled back, and then
    the failure is recorded. A run that is killed stays "running" with the backend that it ran in, which is gone.
    An advisory lock keeps two runs of the same survey and kilometre apart.

    Parameters
    ----------
    conn : Connection
        Idle; no transaction may be open.
    survey_id : int
    km : int or None
        The kilometre; None for a stage of the whole survey.
    stage : str
    parameters : mapping
        What the stage depends on, as it will be recorded.

    Raises
    ------
    UserError
        When another process is at work on the same survey and kilometre.
    """
    run = Run(_begin(conn, survey_id, km, stage, parameters))
    try:
        with conn.transaction():
            lock(conn, survey_id, km)
            yield run
            conn.execute(
                "UPDATE tunnel.run SET outcome = 'done', finished_at = clock_timestamp(), counts = %s WHERE id = %s",
                [Jsonb(run.counts), run.id],
            )
    except BaseException as error:
        _fail(conn, run, error)
        raise
    conn.commit()


def _begin(conn: psycopg.Connection[Any], survey_id: int, km: int | None, stage: str, parameters: Mapping[str, Any]) -> int:
    row = conn.execute(
        """
        INSERT INTO tunnel.run (survey_id, km, stage, parameters, versions, counts, backend_pid, backend_start,
                                started_at, outcome)
        SELECT %s, %s, %s, %s, %s, '{}', a.pid, a.backend_start, clock_timestamp(), 'running'
        FROM pg_stat_activity a WHERE a.pid = pg_backend_pid()
        RETURNING id
        """,
        [survey_id, km, stage, Jsonb(dict(parameters)), Jsonb(versions(conn))],
    ).fetchone()
    conn.commit()
    assert row is not None
    return int(row[0])


def lock(conn: psycopg.Connection[Any], survey_id: int, km: int | None) -> None:
    """Keep other runs off a survey's kilometre, or with None off its stages of the whole, until the transaction ends.

    Raises
    ------
    UserError
        When another process is at work on it.
    """
    taken = conn.execute("SELECT pg_try_advisory_xact_lock(%s, %s)", [survey_id, -1 if km is None else km]).fetchone()
    if taken is None or not taken[0]:
        where = "the survey" if km is None else f"kilometre {km}"
        raise UserError(f"another process is at work on {where}: wait until it has finished (tunneldb status)")


def _fail(conn: psycopg.Connection[Any], run: Run, error: BaseException) -> None:
    if conn.closed or conn.broken:
        return
    text = str(error).strip() or type(error).__name__
    message = text if isinstance(error, UserError) else f"{type(error).__name__}: {text}"
    try:
        conn.rollback()
        conn.execute(
            "UPDATE tunnel.run SET outcome = 'failed', finished_at = clock_timestamp(), counts = %s, message = %s"
            " WHERE id = %s",
            [Jsonb(run.counts), message, run.id],
        )
        conn.commit()
    except psycopg.OperationalError:
        return  # the server went away: the run stays "running" with a backend that is gone


def versions(conn: psycopg.Connection[Any]) -> dict[str, str]:
    """Versions of the program, the server and the libraries that results depend on."""
    row = conn.execute("SELECT current_setting('server_version'), PostGIS_Lib_Version()").fetchone()
    assert row is not None
    return {
        "tunneldb": __version__,
        "python": platform.python_version(),
        "postgresql": row[0],
        "postgis": row[1],
        **{name: version(name) for name in _LIBRARIES},
    }
