"""Preview of a batch: gaps between files, disk space and time.

The constants are measured; docs/howto-operate.md (Before it starts) states how.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import psycopg

from tunneldb.database.server import Server
from tunneldb.geometry.alignment import Alignment
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.geometry.units import IN_METRES, Units
from tunneldb.pipeline.load_settings import settings_of
from tunneldb.pointcloud.file_sample import BLOCK, read_runs
from tunneldb.pointcloud.reader import read_header
from tunneldb.pointcloud.row_estimate import FileSample, RowEstimate, estimate_rows
from tunneldb.pointcloud.selection import MEMORY
from tunneldb.pointcloud.units import NOT_GIVEN, in_units
from tunneldb.queue.batch import Incoming, Plan
from tunneldb.queue.expected import RUN_POINTS, RUNS
from tunneldb.raster.pixel_size import SMALLEST
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
"""Least length of a reported stretch without a file, m: a sample gives the ends of a file to about 30 m."""

EDGE = 35.0
"""Length at the ends of a file's stretch that does not count as covering a kilometre, m."""

TAIL = 0.01
"""Share of a file's points beyond each end of its stretch: a scan thins out."""

SAMPLED_FILES, SAMPLED_RUNS = 40, 40
"""Number of files and of runs of points from which rows are estimated."""

WAL_BYTES = (300.0, 600.0, 1000.0)
"""Low, likely and high bytes of write-ahead log per row."""

PLACE_BYTES = 24.0
"""Bytes in the temporary folder per point of a file that is being read."""

CANDIDATE_BYTES = 110.0
"""Bytes there per point that may get a row: while it is examined, and after."""


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
        Size of the write-ahead log, at most ``max_wal_size``: it stays in use.
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
class Span:
    """Low, likely and high value of an estimate."""

    low: float
    likely: float
    high: float


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
    rows : Span
        Estimated rows in the database, from a sample of the files.
    disk : Disk
        Likely disk space for the database.
    need : Span
        Total disk space for the database, bytes.
    temporary : Span
        Disk space for the temporary folder of the workers, bytes.
    free : int or None
        Free bytes on the database's disk; None if unknown.
    folder : Path or None
        Folder of the database.
    temporary_free : int
        Free bytes in the temporary folder of this machine.
    temporary_folder : Path
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
    rows: Span
    disk: Disk
    need: Span
    temporary: Span
    free: int | None
    folder: Path | None
    temporary_free: int
    temporary_folder: Path
    speeds: tuple[Speed, ...]
    seconds: float | None
    workers: int

    @property
    def fits(self) -> bool:
        """True if there is enough space, as far as known, for the high estimates."""
        return (self.free is None or self.need.high <= self.free) and self.temporary.high <= self.temporary_free


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
    alignment = load_alignment(conn, survey)
    of_files = {file.name: found for file in plan.files if file.error is None and (found := _stretch(file, plan, alignment))}
    stretches = sorted(of_files.values())
    covered = sorted({km for stretch in stretches for km in kilometres_of(stretch)})
    requested: Sequence[int] = kilometres or (range(covered[0], covered[-1] + 1) if covered else ())
    missing = tuple(km for km in requested if km not in covered) if stretches else ()
    new = [file for file in plan.files if not file.already_read and file.error is None]
    points = sum(file.points for file in new)
    length = sum(high - low for low, high in _union(sorted(of_files[file.name] for file in new if file.name in of_files)))
    estimate = estimate_rows(_samples(new, plan), alignment, settings_of(plan.reading))
    rows = Span(estimate.low, estimate.likely, estimate.high)
    area = estimate.area or GIRTH * (length or KILOMETRE * len(plan.kilometres))
    wal = conn.execute("SELECT pg_size_bytes(current_setting('max_wal_size'))").fetchone()
    assert wal is not None
    low, disk, high = (
        _disk(plan, count, area, length or KILOMETRE * len(plan.kilometres), workers, min(log * count, float(wal[0])))
        for count, log in zip((rows.low, rows.likely, rows.high), WAL_BYTES, strict=True)
    )
    folder = Server().home().cluster if embedded else None
    temporary_folder = Path(tempfile.gettempdir())
    speeds = _speeds(conn)
    return Preview(
        plan,
        of_files,
        tuple(covered),
        missing,
        tuple(gap for gap in _gaps(stretches) if not _whole(gap, missing)),
        points,
        rows,
        disk,
        Span(low.total, disk.total, high.total),
        _temporary(new, estimate, points, workers),
        shutil.disk_usage(folder).free if folder is not None else None,
        folder,
        shutil.disk_usage(temporary_folder).free,
        temporary_folder,
        speeds,
        _time(speeds, plan, points, workers),
        workers,
    )


def kilometres_of(stretch: tuple[float, float]) -> range:
    """Return the kilometres of a stretch from one chainage to another, m, less EDGE at its ends."""
    edge = min(EDGE, 0.5 * (stretch[1] - stretch[0]))
    return range(int((stretch[0] + edge) // KILOMETRE), int((stretch[1] - edge) // KILOMETRE) + 1)


def _stretch(file: Incoming, plan: Plan, alignment: Alignment) -> tuple[float, float] | None:
    """Return the first and last chainage of a file, m, by a sample of its points; None if none is near the axis."""
    xyz = np.concatenate(list(read_runs(file.path, file.points, RUNS, RUN_POINTS, _units(file, plan))))
    chainage, distance = alignment.locate(xyz)
    near = chainage[distance <= float(plan.reading["load.max_distance"])]
    return (float(np.quantile(near, TAIL)), float(np.quantile(near, 1.0 - TAIL))) if len(near) else None


def _units(file: Incoming, plan: Plan) -> Units:
    given = settings_of(plan.reading).units
    return IN_METRES if given == NOT_GIVEN else in_units(read_header(file.path), given).units


def _samples(files: Sequence[Incoming], plan: Plan) -> list[FileSample]:
    """Read runs of points of some files, spread evenly; together they stand for all."""
    if not files:
        return []
    chosen = [files[k] for k in np.unique(np.linspace(0, len(files) - 1, min(SAMPLED_FILES, len(files))).astype(int))]
    points, share = sum(file.points for file in chosen), sum(file.points for file in files)
    samples = []
    for file in chosen:
        runs = max(round(SAMPLED_RUNS * file.points / points), 1)
        stands_for = round(file.points * share / points)
        samples.append(FileSample(stands_for, list(read_runs(file.path, file.points, runs, BLOCK, _units(file, plan)))))
    return samples


def _temporary(files: Sequence[Incoming], estimate: RowEstimate, points: int, workers: int) -> Span:
    """Return the space in temporary folders for the largest files, one a worker; little of it is used for dense scans."""
    largest = sum(sorted((file.points for file in files), reverse=True)[:workers])
    share = largest / points if points else 0.0
    places = PLACE_BYTES * estimate.near * share
    low, likely, high = (places + CANDIDATE_BYTES * count * share for count in (estimate.low, estimate.likely, estimate.near))
    return Span(max(low - workers * MEMORY, 0.0), likely, high)


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


def _disk(plan: Plan, rows: float, area: float, length: float, workers: int, wal: float) -> Disk:
    pixel = float(plan.parameters.get("image.pixel", 0.0)) or SMALLEST  # of larger pixels there are fewer
    detects = plan.stage in (None, STAGE_NAMES[-1])
    return Disk(
        ROW_BYTES * rows,
        FRAGMENT_BYTES * rows + ROW_BYTES * rows * min(workers / max(len(plan.kilometres), 1), 1.0),
        PIXEL_BYTES * area / pixel**2 if detects else 0.0,
        KILOMETRE_BYTES * length / KILOMETRE,
        wal,
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
