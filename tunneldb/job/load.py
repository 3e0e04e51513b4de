"""Loading scan files into a survey: filtered, thinned, in chainage order, each file whole or not at all."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import psycopg
from numpy.typing import NDArray

from tunneldb.database.survey import Survey
from tunneldb.errors import UserError
from tunneldb.geometry.alignment import Alignment
from tunneldb.geometry.store import load_alignment
from tunneldb.job.files import (
    Loaded,
    Recorded,
    Source,
    already_loaded,
    change_kept,
    checksum,
    finish_file,
    record_file,
    recorded_files,
)
from tunneldb.job.ledger import Run, lock, stage_run
from tunneldb.job.partition import KILOMETRE, partition_exists, read_partition, voxel_reach, write_partition
from tunneldb.scan.filter import MEMORY, FilterSettings, filter_file
from tunneldb.scan.pose import PoseModel, load_poses
from tunneldb.scan.reader import ScanHeader, check_header, read_header
from tunneldb.scan.spool import BINS_PER_KM, Spool

BATCH = 20_000_000  # points of files of the same kilometre that are loaded in one go

Begin = Callable[[str, int], Callable[[int], None]]
"""Takes what begins and how much it is; returns what takes how much of it is done."""


def load_files(
    conn: psycopg.Connection[Any],
    survey: Survey,
    paths: Sequence[Path],
    settings: FilterSettings,
    begin: Begin = lambda text, total: lambda done: None,
    memory: int = MEMORY,
) -> Iterator[Loaded]:
    """Load scan files.

    Files of the same kilometre are loaded together, as long as they have no more than BATCH points; each such batch is
    one transaction. Which points a survey holds does not depend on the order in which its files are loaded.

    Parameters
    ----------
    conn : Connection
        Idle.
    survey : Survey
    paths : sequence of Path
        LAS or LAZ files. A file is known by its name without the folder; one of the same name and other content that
        was loaded before is replaced, one of the same content is left as it is.
    settings : FilterSettings
    begin : callable
        Told of each step that begins; returns what is told of its progress.
    memory : int
        Bytes of points held in memory by each of two spools.

    Yields
    ------
    Loaded
        One a file, as soon as it is committed.

    Raises
    ------
    UserError
        For a file that is unreadable or does not fit the survey. All are looked at before the first one is read; files
        that were yielded stay loaded, of the others nothing is.
    """
    alignment, poses = load_alignment(conn, survey), load_poses(conn, survey)
    _require_same_density(conn, survey, settings)
    conn.rollback()
    headers = _check_files(survey, paths, poses)
    for batch in _batches(headers, alignment, settings.max_distance):
        yield from _Batch(conn, survey, alignment, poses, settings, begin, memory, paths).load(batch)


def _check_files(survey: Survey, paths: Sequence[Path], poses: PoseModel) -> list[ScanHeader]:
    names: dict[str, Path] = {}
    for path in paths:
        if path.name in names:
            raise UserError(f"{path} and {names[path.name]} have the same name: a survey's files are known by their names")
        names[path.name] = path
    headers = [read_header(path) for path in paths]
    for header in headers:
        check_header(header, survey.intensity_dimension, survey.srid, needs_time=poses.mobile)
    return headers


def _batches(headers: Sequence[ScanHeader], alignment: Alignment, reach: float) -> Iterator[list[ScanHeader]]:
    """Consecutive files that share a kilometre, judged by the boxes in their headers."""
    batch: list[ScanHeader] = []
    kilometres: set[int] = set()
    for header in headers:
        touched = _kilometres(header, alignment, reach)
        points = header.points + sum(other.points for other in batch)
        if batch and (points > BATCH or not kilometres & touched):
            yield batch
            batch, kilometres = [], set()
        batch.append(header)
        kilometres |= touched
    if batch:
        yield batch


def _kilometres(header: ScanHeader, alignment: Alignment, reach: float) -> set[int]:
    inside = np.all(
        (alignment.vertices[:, :2] >= header.low[:2] - reach) & (alignment.vertices[:, :2] <= header.high[:2] + reach), axis=1
    )
    return set(np.floor(alignment.number[inside] * alignment.spacing / KILOMETRE).astype(int).tolist())


def _require_same_density(conn: psycopg.Connection[Any], survey: Survey, settings: FilterSettings) -> None:
    """A survey has one density: another one would thin what is there, or leave it thinner than what comes."""
    row = conn.execute(
        """
        SELECT r.parameters ->> 'load.density' FROM tunnel.run r
         WHERE r.survey_id = %(survey)s AND r.stage = 'load' AND r.outcome = 'done' AND r.parameters ? 'load.density'
           AND EXISTS (SELECT FROM tunnel.scan_file f WHERE f.survey_id = %(survey)s)
         ORDER BY r.id DESC LIMIT 1
        """,
        {"survey": survey.id},
    ).fetchone()
    if row is not None and row[0] != _density(settings):
        raise UserError(
            f"survey {survey.name} is loaded with density {row[0]}: load with --density {row[0]}, or remove the survey "
            "and load all its files anew"
        )


def _density(settings: FilterSettings) -> str:
    return "all" if settings.density is None else f"{settings.density:g}"


@dataclass
class _Batch:
    """Files that are loaded in one transaction."""

    conn: psycopg.Connection[Any]
    survey: Survey
    alignment: Alignment
    poses: PoseModel
    settings: FilterSettings
    begin: Begin
    memory: int
    given: Sequence[Path]

    def load(self, headers: Sequence[ScanHeader]) -> Iterator[Loaded]:
        sources = [Source.of(header, self.survey.srid) for header in headers]
        recorded = recorded_files(self.conn, self.survey)
        same = [source for source in sources if source.name in recorded and recorded[source.name].checksum == source.checksum]
        there = [already_loaded(self.conn, source, recorded[source.name]) for source in same]
        self.conn.commit()
        yield from there
        sources = [source for source in sources if source not in same]
        if not sources:
            return
        parameters = {
            "load.density": _density(self.settings),
            "load.noise_points": self.settings.noise_points,
            "load.noise_diameter": self.settings.noise_diameter,
            "load.max_distance": self.settings.max_distance,
            "files": [source.name for source in sources],
        }
        with stage_run(self.conn, self.survey.id, None, "load", parameters) as run, Spool(self.memory) as spool:
            recorded = recorded_files(self.conn, self.survey)
            sources += self._to_reread(sources, recorded)
            for tag, source in enumerate(sources):
                self._filter(source, spool, tag)
            loaded = self._write(run, sources, spool, recorded)
        yield from loaded

    def _to_reread(self, sources: Sequence[Source], recorded: dict[str, Recorded]) -> list[Source]:
        """Files that overlap one that is replaced: points of theirs may come back where it was nearer to the centre."""
        again: dict[str, Source] = {}
        names = {source.name for source in sources}
        for source in sources:
            old = recorded.get(source.name)
            if old is None:
                continue
            source.state = "replaced"
            if self.settings.edge is None:
                continue
            reach = voxel_reach(self.settings.edge)
            for other in recorded.values():
                if other.name in names or other.low > old.high + reach or other.high < old.low - reach:
                    continue
                again[other.name] = self._reread(source, other)
        return list(again.values())

    def _reread(self, source: Source, other: Recorded) -> Source:
        path = next((path for path in self.given if path.name == other.name), Path(other.path))
        if not path.is_file() or checksum(path) != other.checksum:
            raise UserError(
                f"{source.path} replaces a file that overlaps {other.name}, which has to be read again and is not at {path}"
                " as it was loaded: give its place in the same command"
            )
        header = read_header(path)
        check_header(header, self.survey.intensity_dimension, self.survey.srid, needs_time=self.poses.mobile)
        return Source.of(header, self.survey.srid, "reread")

    def _filter(self, source: Source, spool: Spool, tag: int) -> None:
        started = time.monotonic()
        header = read_header(source.path)
        source.counts = filter_file(
            source.path,
            self.survey.intensity_dimension,
            self.alignment,
            self.poses,
            self.settings,
            spool,
            tag,
            self.begin(source.name, 2 * header.points),
            self.memory,
        )
        source.seconds = time.monotonic() - started

    def _write(self, run: Run, sources: Sequence[Source], spool: Spool, recorded: dict[str, Recorded]) -> list[Loaded]:
        """Write the kilometres that the files touch, or touched before, and the files' own rows."""
        started = time.monotonic()
        files = [(source.name, record_file(self.conn, self.survey, source)) for source in sources]
        gone = {recorded[source.name].id for source in sources if source.name in recorded}
        files += [(other.name, other.id) for other in recorded.values() if other.id not in gone]
        file_ids = np.array([number for _, number in files], np.int32)
        rank = np.argsort(np.argsort([name for name, _ in files]))
        kept = np.zeros(len(files), np.int64)
        for km in self._touched(sources, spool, recorded):
            lock(self.conn, self.survey.id, km)
            before = self._add_existing(km, spool, file_ids, gone)
            advance = self.begin(f"kilometre {km}", self._rows(spool, km))
            written = write_partition(self.conn, self.survey, km, spool, self.settings.edge, file_ids, rank, advance)
            kept += written - before
            self._enter(run, km, int(written.sum()))
        for file_id, change in zip(file_ids[len(sources) :].tolist(), kept[len(sources) :].tolist(), strict=True):
            change_kept(self.conn, file_id, change)
        share = (time.monotonic() - started) / len(sources)
        loaded = []
        for source, file_id, count in zip(sources, file_ids.tolist(), kept.tolist(), strict=False):
            source.seconds += share
            loaded.append(finish_file(self.conn, source, file_id, count))
        for name in ("points", "noise", "outside", "thinned", "kept"):
            run.counts[name] = sum(getattr(file, name) for file in loaded)
        return loaded

    def _touched(self, sources: Sequence[Source], spool: Spool, recorded: dict[str, Recorded]) -> list[int]:
        first, counts = spool.counts()
        touched = set(np.unique(np.floor_divide(first + np.flatnonzero(counts), BINS_PER_KM)).tolist())
        for source in sources:
            if source.name in recorded:
                old = recorded[source.name]
                touched |= set(range(math.floor(old.low / KILOMETRE), math.floor(old.high / KILOMETRE) + 1))
        return sorted(touched)

    def _add_existing(self, km: int, spool: Spool, file_ids: NDArray[np.int32], gone: set[int]) -> NDArray[np.int64]:
        """Add the rows that a kilometre has of other files; returns how many of each tag."""
        before = np.zeros(len(file_ids), np.int64)
        if not partition_exists(self.conn, self.survey, km):
            return before
        order = np.argsort(file_ids)
        for rows in read_partition(self.conn, self.survey, km, self.alignment):
            rows = rows[~np.isin(rows["tag"], list(gone))]
            rows["tag"] = order[np.searchsorted(file_ids, rows["tag"], sorter=order)]
            before += np.bincount(rows["tag"], minlength=len(file_ids))
            spool.add(rows)
        return before

    @staticmethod
    def _rows(spool: Spool, km: int) -> int:
        first, counts = spool.counts()
        return int(counts[max(km * BINS_PER_KM - first, 0) : max((km + 1) * BINS_PER_KM - first, 0)].sum())

    def _enter(self, run: Run, km: int, kept: int) -> None:
        """Enter the kilometre into the ledger, for what rests on its points."""
        self.conn.execute(
            """
            INSERT INTO tunnel.run (survey_id, km, stage, parameters, versions, counts, backend_pid, backend_start,
                                    started_at, finished_at, outcome)
            SELECT survey_id, %s, stage, parameters, versions, jsonb_build_object('kept', %s::int8), backend_pid,
                   backend_start, started_at, clock_timestamp(), 'done'
              FROM tunnel.run WHERE id = %s
            """,
            [km, kept, run.id],
        )
