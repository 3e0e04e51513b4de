"""Files of a survey of a site: checked and recorded; their points stay in the files."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import psycopg

from tunneldb.arrays import Float
from tunneldb.errors import UserError
from tunneldb.geometry.crs import outside_area
from tunneldb.pipeline.read import read_headers, require_kind
from tunneldb.pointcloud.formats.raw import read_raw
from tunneldb.pointcloud.header_box import describe_box_difference
from tunneldb.pointcloud.points import Points
from tunneldb.pointcloud.pose_coverage import PoseCoverage, PoseFaults
from tunneldb.pointcloud.reader import CHUNK, ScanHeader, check_header, coordinate_note, crs_note
from tunneldb.pointcloud.selection import SAMPLE_STEP, FilterCounts, FilterSettings
from tunneldb.progress import StartProgress, silent
from tunneldb.radiometry.intensity_kind import doubt
from tunneldb.stages.ledger import stage_run
from tunneldb.store.poses import load_pose_coverage
from tunneldb.store.scan_files import (
    COUNTED,
    Content,
    Loaded,
    checksum,
    copies_of,
    outcome,
    record_file,
    recorded_files,
    unchanged,
)
from tunneldb.store.survey import Survey


def register_files(
    conn: psycopg.Connection[Any],
    survey: Survey,
    paths: Sequence[Path],
    settings: FilterSettings,
    begin: StartProgress = silent,
) -> Iterator[Loaded]:
    """Record scan files of a site, each in a transaction of its own.

    There is no axis for filtering, thinning and sorting points, and no stage would read them: results of a site come from the
    files.

    Parameters
    ----------
    conn : Connection
        Idle.
    survey : Survey
        Survey of a site.
    paths : sequence of Path
        Known by their names, as with `tunneldb.pipeline.load.load_files`.
    settings : FilterSettings
        Settings of loading. Two are used: the units, and the greatest share of points that may be invalid or without a scanner
        position.
    begin : callable
        Called with each file that begins; returns a function that takes its progress.

    Yields
    ------
    Loaded
        One a file, as soon as it is committed.

    Raises
    ------
    UserError
        If a file is unreadable or does not fit the survey. The headers of all are checked before the first is read.
    """
    poses = load_pose_coverage(conn, survey)
    headers = read_headers(paths, settings.units)
    for header in headers:
        check_header(header, survey.intensity_dimension, survey.srid, needs_time=poses.mobile)
    copies = copies_of(conn, survey, [header.path for header in headers])
    conn.rollback()
    yield from copies.values()
    headers = [header for header in headers if header.path not in copies]
    for header in headers:
        recorded = recorded_files(conn, survey).get(header.path.name)
        there = unchanged(conn, header.path, recorded, header.units)
        conn.commit()
        if there is None:
            there = _register(conn, survey, header, poses, settings.max_left_out, begin, replaces=recorded is not None)
        place = outside_area(survey.srid, _corners(conn, survey, header.path.name))
        notes = (crs_note(header, survey.srid), place, there.note)
        yield replace(there, note="; ".join(filter(None, notes)) or None)


def _corners(conn: psycopg.Connection[Any], survey: Survey, name: str) -> Float:
    """Return two corners of the box of a file's points in plan (2, 2), m."""
    row = conn.execute("SELECT extent FROM tunnel.scan_file WHERE survey_id = %s AND name = %s", [survey.id, name]).fetchone()
    conn.rollback()
    assert row is not None
    return np.array(row[0]).reshape(2, 3)[:, :2]


def remove_site_files(conn: psycopg.Connection[Any], survey: Survey, names: Sequence[str]) -> None:
    """Remove files of a site, by their names; results from them stay until members are found again."""
    with stage_run(conn, survey.id, None, "load", {"removed": list(names)}):
        conn.execute("DELETE FROM tunnel.scan_file WHERE survey_id = %s AND name = ANY (%s)", [survey.id, list(names)])


def _register(
    conn: psycopg.Connection[Any],
    survey: Survey,
    header: ScanHeader,
    poses: PoseCoverage,
    max_left_out: float,
    begin: StartProgress,
    *,
    replaces: bool,
) -> Loaded:
    path, started = header.path, time.monotonic()
    with stage_run(conn, survey.id, None, "load", {"files": [path.name]}) as run:
        with ThreadPoolExecutor(1, "checksum") as pool:
            digest = pool.submit(checksum, path)
            counts = _look_through(survey, header, poses, max_left_out, begin)
            doubtful = doubt(survey.intensity_kind, counts.intensity_sample)
            stated = survey.srid if header.crs else None
            differs = describe_box_difference(header, counts.box)
            noted = coordinate_note(header, survey.srid)
            content = Content(
                path, digest.result(), path.stat().st_size, stated, differs, doubtful, counts, header.units, noted
            )
        file_id = record_file(conn, survey, content)
        loaded = outcome(conn, file_id, "replaced" if replaces else "loaded", time.monotonic() - started)
        loaded = replace(loaded, note=doubtful)
        run.counts.update({name: getattr(loaded, name) for name in COUNTED})
    return loaded


def _look_through(
    survey: Survey, header: ScanHeader, poses: PoseCoverage, max_left_out: float, begin: StartProgress
) -> FilterCounts:
    """Count unusable points of a file, and its extent; refuse it if there are too many."""
    counts, faults = FilterCounts(), PoseFaults()
    low, high = counts.extent[:3], counts.extent[3:]
    progress = begin(header.path.name, header.points)
    for points in map(Points.of, read_raw(header.path, survey.intensity_dimension, CHUNK, units=header.units)):
        counts.points += len(points)
        counts.enclose(points.xyz)
        progress(len(points))
        finite = points.finite(time=poses.mobile, intensity=survey.intensity_dimension is not None)
        if finite is not None:
            counts.invalid += int(np.count_nonzero(~finite))
            points = points.some(finite)
        if len(points):
            faults += poses.faults(points)
            np.minimum(low, points.xyz.min(axis=0), out=low)
            np.maximum(high, points.xyz.max(axis=0), out=high)
            counts.intensities.append(points.intensity[::SAMPLE_STEP].copy())
    counts.unposed = faults.points
    invalid = "coordinates, times or intensities that are not numbers; remove these points"
    for count, reason in ((counts.invalid, invalid), (counts.unposed, faults.text())):
        if count > max_left_out * counts.points or count == counts.points:
            raise UserError(
                f"{header.path}: {reason} ({100.0 * count / max(counts.points, 1):.2g} % of its points; "
                f"--max-left-out {100.0 * max_left_out:g} allows less)"
            )
    require_kind(survey, header.path, counts.intensity_sample)
    return counts
