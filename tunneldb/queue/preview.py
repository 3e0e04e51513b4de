"""Preview of a batch: gaps between files, disk space and time.

The constants are measured; docs/howto-operate.md (Before it starts) states how.
"""

from __future__ import annotations

import math
import shutil
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import psycopg

from tunneldb.database.server import Server
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.pointcloud.reader import read_header
from tunneldb.queue.batch import Plan, extent
from tunneldb.stages.parameters import PARAMETERS
from tunneldb.stages.registry import STAGE_NAMES
from tunneldb.store.surface import load_alignment
from tunneldb.store.survey import Survey

ROW_BYTES = 118.0
"""Bytes per row of the points' table, with its index."""

FRAGMENT_BYTES = 51.0
"""Bytes per row of points that were read but not yet loaded."""

PIXEL_BYTES = 3.5
"""Bytes per pixel of lining, for the three images."""

KILOMETRE_BYTES = 17e6
"""Bytes per kilometre for axis, segments, sections, ground, lining, clusters and leaks."""

GIRTH = 25.0
"""Assumed length around a cross-section of an unknown tunnel, m: 8 m in diameter."""

MIN_GAP = 100.0
"""Least length of a reported stretch without a file, m: the box of a file gives its ends to about 30 m."""


@dataclass(frozen=True)
class Disk:
    """Disk space for a batch, bytes.

    Attributes
    ----------
    points, images, others : float
        Permanent data: rows of points, images, and axis, segments, sections, ground, lining, clusters and leaks.
    passing : float
        Temporary data: points that were read but not yet loaded, and kilometres that are being rewritten.
    wal : float
        Greatest size of the write-ahead log.
    """

    points: float
    passing: float
    images: float
    others: float
    wal: float

    @property
    def total(self) -> float:
        """Total at the worst moment."""
        return self.points + self.passing + self.images + self.others + self.wal


@dataclass(frozen=True)
class Speed:
    """Speed of a stage in this database: mean time of a kilometre, or of a point of a file (``read``), s."""

    stage: str
    seconds: float
    runs: int


@dataclass(frozen=True)
class Preview:
    """Preview of a batch.

    Attributes
    ----------
    plan : Plan
    stretches : dict
        First and last chainage of each readable file, by its name, m.
    covered : tuple of int
        Kilometres with points of files.
    missing : tuple of int
        Kilometres without points between the first and the last one, or requested by number.
    gaps : tuple of (float, float)
        Stretches of covered kilometres without a file, chainages, m.
    points : int
        Number of points of the files to read.
    rows : float
        Expected rows in the database; an upper limit if ``kept`` is None.
    kept : float or None
        Share of points that this survey, or another of the same density, has kept so far; None if unknown.
    disk : Disk
    free : int or None
        Free bytes on the database's disk; None if unknown.
    folder : Path or None
        Folder of the database.
    speeds : tuple of Speed
        Speeds of the stages measured in this database.
    seconds : float or None
        Expected time with ``workers`` workers; None if a stage was never measured.
    workers : int
    """

    plan: Plan
    stretches: dict[str, tuple[float, float]]
    covered: tuple[int, ...]
    missing: tuple[int, ...]
    gaps: tuple[tuple[float, float], ...]
    points: int
    rows: float
    kept: float | None
    disk: Disk
    free: int | None
    folder: Path | None
    speeds: tuple[Speed, ...]
    seconds: float | None
    workers: int

    @property
    def fits(self) -> bool:
        """True if there is enough space, as far as known."""
        return self.free is None or self.disk.total <= self.free


def preview(
    conn: psycopg.Connection[Any], survey: Survey, plan: Plan, kilometres: range | None, embedded: bool, workers: int
) -> Preview:
    """Return a preview of a batch; this changes nothing.

    Parameters
    ----------
    plan : Plan
        Request of the batch.
    kilometres : range or None
        Kilometres requested by number.
    embedded : bool
        True for the embedded server's database.
    workers : int
        Number of workers to start.
    """
    of_files = _stretches(conn, survey, plan)
    stretches = sorted(of_files.values())
    covered = sorted({km for stretch in stretches for km in kilometres_of(stretch)})
    requested: Sequence[int] = kilometres or (range(covered[0], covered[-1] + 1) if covered else ())
    missing = tuple(km for km in requested if km not in covered) if stretches else ()
    new = [file for file in plan.files if not file.already_read and file.error is None]
    points = sum(file.points for file in new)
    length = sum(high - low for low, high in _union(sorted(of_files[file.name] for file in new if file.name in of_files)))
    kept = _kept(conn, survey, plan)
    rows = _rows(points, length, kept, plan)
    disk = _disk(conn, plan, rows, length or KILOMETRE * len(plan.kilometres), workers)
    folder = Server().home().cluster if embedded else None
    speeds = _speeds(conn)
    return Preview(
        plan,
        of_files,
        tuple(covered),
        missing,
        tuple(gap for gap in _gaps(stretches) if not _whole(gap, missing)),
        points,
        rows,
        kept,
        disk,
        shutil.disk_usage(folder).free if folder is not None else None,
        folder,
        speeds,
        _time(speeds, plan, points, workers),
        workers,
    )


def kilometres_of(stretch: tuple[float, float]) -> range:
    """Return the kilometres of a stretch from one chainage to another, m."""
    return range(int(stretch[0] // KILOMETRE), math.ceil(stretch[1] / KILOMETRE))


def _stretches(conn: psycopg.Connection[Any], survey: Survey, plan: Plan) -> dict[str, tuple[float, float]]:
    alignment = load_alignment(conn, survey)
    reach = float(plan.reading["load.max_distance"])
    found = {file.name: extent(read_header(file.path), alignment, reach) for file in plan.files if file.error is None}
    return {name: stretch for name, stretch in found.items() if stretch is not None}


def _union(stretches: Iterable[tuple[float, float]]) -> list[tuple[float, float]]:
    joined: list[tuple[float, float]] = []
    for low, high in stretches:
        if joined and low <= joined[-1][1] + MIN_GAP:
            joined[-1] = (joined[-1][0], max(joined[-1][1], high))
        else:
            joined.append((low, high))
    return joined


def _gaps(stretches: list[tuple[float, float]]) -> list[tuple[float, float]]:
    joined = _union(stretches)
    return [(before[1], after[0]) for before, after in pairwise(joined)]


def _whole(gap: tuple[float, float], missing: Sequence[int]) -> bool:
    """Return True if a gap is already reported as missing kilometres: it extends little beyond them."""
    inside = [km for km in missing if gap[0] <= 1000 * km + MIN_GAP and gap[1] >= 1000 * (km + 1) - MIN_GAP]
    return bool(inside) and gap[1] - gap[0] <= 1000 * len(inside) + 2 * MIN_GAP


def _kept(conn: psycopg.Connection[Any], survey: Survey, plan: Plan) -> float | None:
    """Return the share of points kept of files loaded at this density: of this survey, else of all."""
    row = conn.execute(
        """
        WITH file AS (
            SELECT f.survey_id, f.kept, f.points
              FROM tunnel.scan_file f
             WHERE f.kept > 0 AND (SELECT r.parameters -> 'load.density' FROM tunnel.run r
                                    WHERE r.survey_id = f.survey_id AND r.outcome = 'done' AND r.stage IN ('read', 'load')
                                      AND r.parameters ? 'load.density' ORDER BY r.id DESC LIMIT 1) = to_jsonb(%(density)s)
        )
        SELECT coalesce(sum(kept) FILTER (WHERE survey_id = %(survey)s) / sum(points) FILTER (WHERE survey_id = %(survey)s),
                        sum(kept) / sum(points))::float8
          FROM file
        """,
        {"survey": survey.id, "density": plan.reading["load.density"]},
    ).fetchone()
    return None if row is None else row[0]


def _rows(points: int, length: float, kept: float | None, plan: Plan) -> float:
    if kept is not None:
        return kept * points
    density = plan.reading["load.density"]
    return float(points) if density == "all" else min(float(points), float(density) * GIRTH * length)


def _disk(conn: psycopg.Connection[Any], plan: Plan, rows: float, length: float, workers: int) -> Disk:
    row = conn.execute("SELECT pg_size_bytes(current_setting('max_wal_size'))").fetchone()
    assert row is not None
    pixel = float(plan.parameters.get("image.pixel", PARAMETERS["image.pixel"].default))
    detects = plan.stage in (None, STAGE_NAMES[-1])
    return Disk(
        ROW_BYTES * rows,
        FRAGMENT_BYTES * rows + ROW_BYTES * rows * min(workers / max(len(plan.kilometres), 1), 1.0),
        PIXEL_BYTES * GIRTH * length / pixel**2 if detects else 0.0,
        KILOMETRE_BYTES * length / KILOMETRE,
        float(row[0]),
    )


def _speeds(conn: psycopg.Connection[Any]) -> tuple[Speed, ...]:
    """Return the mean times of the stages, over all surveys of the database."""
    rows = conn.execute(
        """
        SELECT stage,
               (CASE stage WHEN 'read' THEN sum(s.seconds) / nullif(sum((s.counts ->> 'points')::bigint), 0)
                           ELSE avg(s.seconds) END)::float8, count(*)
          FROM (SELECT r.stage, r.counts, extract(epoch FROM r.finished_at - r.started_at) AS seconds
                  FROM tunnel.run r
                 WHERE r.outcome = 'done' AND r.job_id IS NOT NULL) s
         GROUP BY stage
        """
    ).fetchall()
    found = {stage: Speed(stage, seconds, runs) for stage, seconds, runs in rows if seconds is not None}
    return tuple(found[stage] for stage in ("read", *STAGE_NAMES) if stage in found)


def _time(speeds: Sequence[Speed], plan: Plan, points: int, workers: int) -> float | None:
    """Return the time of all work, shared by the workers; None if one of the stages was never measured."""
    steps = STAGE_NAMES[: STAGE_NAMES.index(plan.stage or STAGE_NAMES[-1]) + 1]
    mean = {speed.stage: speed.seconds for speed in speeds}
    if not {*steps, *(("read",) if points else ())} <= mean.keys():
        return None
    return (points * mean.get("read", 0.0) + len(plan.kilometres) * sum(mean[step] for step in steps)) / workers
