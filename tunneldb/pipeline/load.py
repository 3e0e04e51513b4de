"""Load spooled points into a survey's kilometres: thinned as a whole, in chainage order."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import psycopg
from psycopg.types.json import Jsonb

from tunneldb.arrays import Float
from tunneldb.geometry.alignment import Alignment
from tunneldb.geometry.crs import outside_area
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.pipeline.load_settings import parameters_of, require_same_density, settings_of
from tunneldb.pipeline.read import Counts, Reading, read_headers
from tunneldb.pointcloud.reader import ScanHeader, crs_note
from tunneldb.pointcloud.second_tube import find_second_tubes
from tunneldb.pointcloud.selection import MEMORY, FilterSettings
from tunneldb.pointcloud.spool import Spool
from tunneldb.progress import StartProgress, silent
from tunneldb.stages.ledger import Run, lock, stage_run
from tunneldb.store.partition import (
    drop_fragments,
    partition_exists,
    parts_by_window,
    read_fragment,
    read_partition,
    rows_in,
    swap_partition,
    write_partition,
)
from tunneldb.store.scan_files import (
    COUNTED,
    Loaded,
    change_counts,
    copies_of,
    outcome,
    record_loaded,
    recorded_files,
    unchanged,
)
from tunneldb.store.surface import load_alignment
from tunneldb.store.survey import Survey

__all__ = ["chainages_near", "header_kilometres", "load_files", "load_kilometre", "parameters_of", "settings_of"]

BATCH = 20_000_000  # points of files of the same kilometre that are loaded in one go


def load_kilometre(conn: psycopg.Connection[Any], survey: Survey, km: int, settings: FilterSettings) -> Counts:
    """Load the points that wait for a kilometre, in the caller's transaction.

    Rows that were read of files and wait there, and existing rows of other files, are thinned as a whole, written separately
    and swapped in. The resulting rows of a kilometre do not depend on the order in which its files are read or loaded.

    Returns
    -------
    dict
        ``files``, those that waited, ``kept``, the rows that the kilometre has now, and ``second_tube`` and ``note``, if
        rows of a tube beside it were left out.

    Raises
    ------
    UserError
        If another process is at work on the kilometre, or the survey is loaded with another density.
    """
    require_same_density(conn, survey, settings)
    merged = merge(conn, survey, km, settings)
    finish(conn, survey, [merged])
    return {"files": merged.files, "kept": merged.kept, **merged.note}


@dataclass(frozen=True)
class Merged:
    """Kilometre built beside the current one.

    Attributes
    ----------
    km, files, kept : int
        Number of the kilometre; files that waited for it; its current number of rows.
    changes : dict of int to (int, int, int)
        Changes of the rows kept, thinned and outside, by file id.
    note : dict
        Remarks for the ledger: ``second_tube``, the rows left out, and ``note``; may be empty.
    """

    km: int
    files: int
    kept: int
    changes: dict[int, tuple[int, int, int]]
    note: Counts


def merge(
    conn: psycopg.Connection[Any],
    survey: Survey,
    km: int,
    settings: FilterSettings,
    begin: StartProgress = silent,
    memory: int = MEMORY,
    held: Mapping[int, Spool] | None = None,
) -> Merged:
    """Build a kilometre with the points that wait for it; `finish` puts it in place.

    Rows of the files in `held`, by id, are in the kilometre and not in fragments.
    """
    held = held or {}
    lock(conn, survey.id, km)
    waiting = dict(
        conn.execute(
            "SELECT k.file_id, k.rows FROM tunnel.file_km k JOIN tunnel.scan_file f ON f.id = k.file_id"
            " WHERE f.survey_id = %s AND k.km = %s AND k.loaded_at IS NULL ORDER BY k.file_id FOR UPDATE OF k",
            [survey.id, km],
        ).fetchall()
    )
    files = sorted(recorded_files(conn, survey).values(), key=lambda file: file.name)
    file_ids = np.array([file.id for file in files], np.int32)
    tags = {file.id: tag for tag, file in enumerate(files)}
    before = np.zeros(len(files), np.int64)
    with Spool(memory) as spool:
        if waiting and len(waiting) < len(files) and partition_exists(conn, survey, km):
            order = np.argsort(file_ids)
            for rows in read_partition(conn, survey, km, load_alignment(conn, survey)):
                rows = rows[~np.isin(rows["tag"], list(waiting))]
                rows["tag"] = order[np.searchsorted(file_ids, rows["tag"], sorter=order)]
                before += np.bincount(rows["tag"], minlength=len(files))
                spool.add(rows)
        total = int(before.sum()) + sum(waiting.values())
        advance = begin(f"kilometre {km}", max(total, 1))
        if not waiting:
            advance(1)
            return Merged(km, 0, rows_in(conn, survey, km), {}, _told(conn, survey, km))
        stored = [file_id for file_id, count in waiting.items() if count and file_id not in held]
        for file_id in stored:
            with closing(read_fragment(conn, survey, file_id, km, tags[file_id])) as blocks:
                for rows in blocks:
                    spool.add(rows)
        parts: list[tuple[Spool, int | None]] = [(spool, None)]
        parts += [(held[file_id], tags[file_id]) for file_id in waiting if file_id in held]
        # A file by itself is thinned already.
        edge = None if len(waiting) == 1 and not before.any() else settings.edge
        alignment = load_alignment(conn, survey)
        tubes = find_second_tubes(parts_by_window(parts, km), alignment, km)
        own = (lambda rows: tubes.own(rows, alignment)) if tubes.any else None
        written, beside = write_partition(conn, survey, km, parts, edge, file_ids, advance, own)
    drop_fragments(conn, survey, stored, [km])
    record_loaded(conn, km, list(waiting))
    changes = {}
    for file_id, tag in tags.items():
        change, other = int(written[tag] - before[tag]), int(beside[tag])
        # of a file that waited all points were counted as neither kept nor thinned there
        changes[file_id] = (change, waiting.get(file_id, 0) - change - other, other)
    # what was left out before is not in the rows that were there
    note = _told(conn, survey, km) if before.any() else {}
    if tubes.any:
        points = int(beside.sum()) + int(note.get("second_tube", 0))
        note = {"second_tube": points, "note": tubes.note(points)}
    if place := outside_area(survey.srid, alignment.vertices[:, :2]):
        note = {**note, "place": place}
    return Merged(km, len(waiting), int(written.sum()), changes, note)


def _told(conn: psycopg.Connection[Any], survey: Survey, km: int) -> Counts:
    """Return the ledger's entry of a second tube that was left out of a kilometre at its last load, and its place."""
    row = conn.execute(
        "SELECT counts FROM tunnel.run WHERE survey_id = %s AND km = %s AND stage = 'load' AND outcome = 'done'"
        " ORDER BY started_at DESC, id DESC LIMIT 1",
        [survey.id, km],
    ).fetchone()
    return {} if row is None else {name: row[0][name] for name in ("second_tube", "note", "place") if name in row[0]}


def finish(conn: psycopg.Connection[Any], survey: Survey, merged: Sequence[Merged]) -> None:
    """Put kilometres in place, and record the counts of their files: last in a transaction, because others wait then."""
    changes: dict[int, tuple[int, int, int]] = {}
    for one in merged:
        if one.files:
            swap_partition(conn, survey, one.km, one.kept)
        for file_id, change in one.changes.items():
            kept, thinned, outside = changes.get(file_id, (0, 0, 0))
            changes[file_id] = (kept + change[0], thinned + change[1], outside + change[2])
    change_counts(conn, changes)


def load_files(
    conn: psycopg.Connection[Any],
    survey: Survey,
    paths: Sequence[Path],
    settings: FilterSettings,
    begin: StartProgress = silent,
    memory: int = MEMORY,
) -> Iterator[Loaded]:
    """Read scan files and load the kilometres that they touch.

    Files of the same kilometre are loaded together, up to BATCH points; each such batch is one transaction. The points of a
    survey do not depend on the order in which its files are loaded.

    Parameters
    ----------
    conn : Connection
        Idle.
    survey : Survey
    paths : sequence of Path
        Scan files. A file is known by its name without the folder; one of the same name and other content that was
        loaded before is replaced, one of the same content is left as it is; a copy of another file is left out.
    settings : FilterSettings
    begin : callable
        Called with each step that begins; returns a function that takes its progress.
    memory : int
        Bytes of points in the memory of each of two spools.

    Yields
    ------
    Loaded
        One a file, as soon as it is committed.

    Raises
    ------
    UserError
        If a file is unreadable or does not fit the survey. All are checked before the first one is read; files that were
        yielded stay loaded, of the others nothing is.
    """
    require_same_density(conn, survey, settings)
    reading = Reading.of(conn, survey, settings, memory)
    conn.rollback()
    headers = read_headers(paths, settings.units)
    for header in headers:
        reading.check(header)
    copies = copies_of(conn, survey, [header.path for header in headers])
    conn.rollback()
    yield from copies.values()
    headers = [header for header in headers if header.path not in copies]
    place = outside_area(survey.srid, reading.alignment.vertices[:, :2])
    notes = {header.path.name: "; ".join(filter(None, (crs_note(header, survey.srid), place))) for header in headers}
    for batch in _batches(headers, reading.alignment, settings.max_distance):
        recorded = recorded_files(conn, survey)
        there = {header.path: unchanged(conn, header.path, recorded.get(header.path.name), header.units) for header in batch}
        _withdraw(conn, survey, [path.name for path, loaded in there.items() if loaded is not None])
        conn.commit()
        yield from (replace(loaded, note=notes[loaded.name] or None) for loaded in there.values() if loaded is not None)
        changed = [header for header in batch if there[header.path] is None]
        if changed:
            for loaded in _load_batch(reading, changed, paths, begin):
                said = "; ".join(filter(None, (notes.get(loaded.name), loaded.note)))
                yield replace(loaded, note=said or None)


def _batches(headers: Sequence[ScanHeader], alignment: Alignment, reach: float) -> Iterator[list[ScanHeader]]:
    """Group consecutive files that share a kilometre, by the boxes in their headers."""
    batch: list[ScanHeader] = []
    kilometres: set[int] = set()
    for header in headers:
        touched = set(header_kilometres(header, alignment, reach))
        points = header.points + sum(other.points for other in batch)
        if batch and (points > BATCH or not kilometres & touched):
            yield batch
            batch, kilometres = [], set()
        batch.append(header)
        kilometres |= touched
    if batch:
        yield batch


def header_kilometres(header: ScanHeader, alignment: Alignment, reach: float) -> range:
    """Return the kilometres that a file may touch by the box in its header, from the first to the last; may be empty.

    Parameters
    ----------
    header : ScanHeader
    alignment : Alignment
        The given axis.
    reach : float
        Maximum distance of the tunnel from the axis, m.
    """
    touched = np.floor(chainages_near(header, alignment, reach) / KILOMETRE).astype(int)
    return range(int(touched.min()), int(touched.max()) + 1) if len(touched) else range(0)


def chainages_near(header: ScanHeader, alignment: Alignment, reach: float) -> Float:
    """Return the chainages of the given axis' stations within reach of the box in a file's header, in plan, m."""
    low, high = header.low[:2] - reach, header.high[:2] + reach
    inside = np.all((alignment.vertices[:, :2] >= low) & (alignment.vertices[:, :2] <= high), axis=1)
    return np.asarray(alignment.number[inside] * alignment.spacing, dtype=np.float64)


def _load_batch(reading: Reading, headers: Sequence[ScanHeader], given: Sequence[Path], begin: StartProgress) -> list[Loaded]:
    """Read files and load their kilometres in one transaction."""
    conn, survey, settings = reading.conn, reading.survey, reading.settings
    parameters = {**parameters_of(settings), "files": [header.path.name for header in headers]}
    held: dict[int, Spool] = {}
    reading = replace(reading, held=held, share=len(headers))
    with ExitStack() as stack, stage_run(conn, survey.id, None, "load", parameters) as run:
        stack.callback(_close, held)
        read = reading.read(headers, given, begin)
        started = time.monotonic()
        waiting = _waiting(conn, [file.id for file in read])
        merged = [merge(conn, survey, km, settings, begin, reading.memory, held) for km in waiting]
        finish(conn, survey, merged)
        for one in merged:
            _enter(conn, run, one)
        _withdraw(conn, survey, [header.path.name for header in headers])
        share = (time.monotonic() - started) / len(read)
        loaded = [replace(outcome(conn, file.id, file.state, file.seconds + share), note=file.note) for file in read]
        for name in COUNTED:
            run.counts[name] = sum(getattr(file, name) for file in loaded)
    return loaded


def _withdraw(conn: psycopg.Connection[Any], survey: Survey, names: list[str]) -> None:
    """Remove files from the list of those that a batch must read or could not read: they are loaded."""
    conn.execute("DELETE FROM tunnel.incoming WHERE survey_id = %s AND name = ANY (%s)", [survey.id, names])


def _close(held: Mapping[int, Spool]) -> None:
    for spool in held.values():
        spool.close()


def _waiting(conn: psycopg.Connection[Any], file_ids: list[int]) -> list[int]:
    rows = conn.execute(
        "SELECT DISTINCT km FROM tunnel.file_km WHERE file_id = ANY (%s) AND loaded_at IS NULL ORDER BY km", [file_ids]
    )
    return [row[0] for row in rows.fetchall()]


def _enter(conn: psycopg.Connection[Any], run: Run, one: Merged) -> None:
    """Record the kilometre in the ledger, for stages that depend on its points."""
    conn.execute(
        """
        INSERT INTO tunnel.run (survey_id, km, stage, parameters, versions, counts, backend_pid, backend_start,
                                started_at, finished_at, outcome)
        SELECT survey_id, %s, stage, parameters, versions, %s, backend_pid,
               backend_start, started_at, clock_timestamp(), 'done'
          FROM tunnel.run WHERE id = %s
        """,
        [one.km, Jsonb({"kept": one.kept, **one.note}), run.id],
    )
