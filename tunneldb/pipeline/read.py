"""Read a scan file: filtered, thinned, spooled by kilometre, completely or not at all."""

from __future__ import annotations

import math
import time
import zlib
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import psycopg

from tunneldb.arrays import Single
from tunneldb.database.locks import holder_text, wait_for_kilometre
from tunneldb.errors import BusyError, UserError
from tunneldb.geometry.alignment import Alignment
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.pipeline.load_settings import require_same_density
from tunneldb.pipeline.pose_check import PoseCheck
from tunneldb.pointcloud.formats.faults import require_dimension
from tunneldb.pointcloud.header_box import describe_box_difference
from tunneldb.pointcloud.pose_coverage import PoseCoverage
from tunneldb.pointcloud.reader import ScanHeader, check_header, coordinate_note, crs_note, read_header
from tunneldb.pointcloud.selection import MEMORY, CheckPoses, FilterCounts, FilterSettings, filter_file, voxel_reach
from tunneldb.pointcloud.spool import Spool
from tunneldb.pointcloud.units import GivenUnits, in_units
from tunneldb.progress import StartProgress, silent
from tunneldb.radiometry.intensity_kind import contradiction, doubt
from tunneldb.stages.parameters import PARAMETERS
from tunneldb.store.partition import drop_fragments, write_fragments
from tunneldb.store.poses import load_pose_coverage
from tunneldb.store.scan_files import (
    Content,
    Recorded,
    checksum,
    kilometres_of,
    record_file,
    record_kilometres,
    recorded_files,
    unchanged,
)
from tunneldb.store.surface import load_alignment
from tunneldb.store.survey import Survey

MIN_INTENSITIES = 20
"""Minimum number of values for a remark on their kind."""

Counts = dict[str, Any]


def read_file(conn: psycopg.Connection[Any], survey: Survey, path: Path, settings: FilterSettings) -> Counts:
    """Read a scan file and spool its points by kilometre, in the caller's transaction.

    A file is known by its name without the folder. One that was read before and is unchanged is left as it is, whether
    its kilometres are loaded yet or wait. One that replaces another of its name also has those read again that overlap
    the former one, and waits for runs of the kilometres that they touch.

    Returns
    -------
    dict
        ``file``, ``state`` (see `tunneldb.store.scan_files.Loaded`), ``points``, ``noise``, ``outside``, ``invalid`` and
        ``unposed`` if any, ``kilometres``, those that wait to be loaded with it, and ``note``, if there were assumptions.

    Raises
    ------
    UserError
        If the file is unreadable or does not fit the survey, another process reads it, or a file that has to be read
        again is gone.
    """
    require_same_density(conn, survey, settings)
    header = in_units(read_header(path), settings.units)
    reading = Reading.of(conn, survey, settings)
    reading.check(header)
    recorded = recorded_files(conn, survey).get(path.name)
    known = unchanged(conn, path, recorded, header.units)
    if recorded is not None and known is not None:
        files, state = [recorded.id], known.state
    else:
        read = reading.read([header], [])
        files, state = [file.id for file in read], read[0].state
    row = conn.execute(
        "SELECT points, noise, outside, invalid, unposed, header_note, ARRAY(SELECT DISTINCT km FROM tunnel.file_km"
        " WHERE file_id = ANY (%s) AND loaded_at IS NULL ORDER BY km) FROM tunnel.scan_file WHERE id = %s",
        [files, files[0]],
    ).fetchone()
    assert row is not None
    sparse = None if known is not None else read[0].note
    note = "; ".join(filter(None, (crs_note(header, survey.srid), row[5], sparse)))
    left_out = {name: count for name, count in (("invalid", row[3]), ("unposed", row[4])) if count}
    return {
        "file": path.name,
        "state": state,
        "points": row[0],
        "noise": row[1],
        "outside": row[2],
        **left_out,
        "kilometres": row[6],
        **({"note": note} if note else {}),
    }


def read_headers(paths: Sequence[Path], given: GivenUnits) -> list[ScanHeader]:
    """Read the headers of scan files, which must have different names and coordinates in the given units.

    Raises
    ------
    UserError
        If a file is unreadable, or two have one name.
    """
    names: dict[str, Path] = {}
    for path in paths:
        if path.name in names:
            raise UserError(f"{path} and {names[path.name]} have the same name: a survey's files are known by their names")
        names[path.name] = path
    return [in_units(read_header(path), given) for path in paths]


def require_kind(survey: Survey, path: Path, sample: Single) -> None:
    """Refuse a file whose intensity values contradict the declared kind."""
    kind = survey.intensity_kind
    if kind == "none" or len(sample) < MIN_INTENSITIES:
        return
    reason = contradiction(kind, sample)
    if reason is not None:
        raise UserError(
            f"{path}: {survey.intensity_dimension} is no intensity of kind {kind}: {reason}"
            f" (tunneldb inspect {path.name}; tunneldb survey set {survey.name} --intensity-kind KIND)"
        )


@dataclass(frozen=True)
class Read:
    """A file that was read.

    Attributes
    ----------
    id : int
        Its row.
    state : str
        Result, see `tunneldb.store.scan_files.Loaded`.
    seconds : float
        Time that it took.
    note : str or None
        Remarks on its points.
    """

    id: int
    state: str
    seconds: float
    note: str | None = None


@dataclass(frozen=True)
class Reading:
    """Survey data for reading files.

    Attributes
    ----------
    held : dict of int to Spool, or None
        Gets the rows of each file by its id, for who loads them in the same transaction; None writes them as fragments.
    share : int
        Number of files that share the memory for these rows.
    """

    conn: psycopg.Connection[Any]
    survey: Survey
    settings: FilterSettings
    alignment: Alignment
    poses: PoseCoverage
    pose_check: PoseCheck | None
    memory: int
    held: dict[int, Spool] | None = None
    share: int = 1

    @classmethod
    def of(cls, conn: psycopg.Connection[Any], survey: Survey, settings: FilterSettings, memory: int = MEMORY) -> Reading:
        """Read the axis of the survey, and its scanner positions."""
        alignment, poses = load_alignment(conn, survey), load_pose_coverage(conn, survey)
        return cls(conn, survey, settings, alignment, poses, PoseCheck.of(conn, survey, alignment), memory)

    def check(self, header: ScanHeader) -> None:
        """Check a file against its survey."""
        dimension, remedy = self.survey.intensity_dimension, f"tunneldb survey set {self.survey.name} --intensity"
        require_dimension(header.path, dimension, header.dimensions, "the survey's intensity", remedy)
        check_header(header, dimension, self.survey.srid, needs_time=self.poses.mobile)

    def read(self, headers: Sequence[ScanHeader], given: Sequence[Path], begin: StartProgress = silent) -> list[Read]:
        """Read new or changed files, then those that must be read again because of them.

        Parameters
        ----------
        headers : sequence of ScanHeader
            At least one.
        given : sequence of Path
            Possible current places of files that must be read again.
        begin : callable
            Called with each file that begins; returns a function that takes its progress.
        """
        for header in headers:
            self.claim(header.path.name)
        recorded = recorded_files(self.conn, self.survey)
        names = {header.path.name for header in headers}
        former = [recorded[name] for name in names if name in recorded]
        again = self.overlapped(former, [file for file in recorded.values() if file.name not in names])
        why = f"{', '.join(old.name for old in former)} replaces a file that overlaps"
        others = [self.find(file, given, why, "give its place in the same command") for file in again]
        # Their kilometres change under nobody's hands; in this order, so that two never wait for each other.
        for km in kilometres_of(self.conn, [file.id for file in [*former, *again]]):
            wait_for_kilometre(self.conn, self.survey.id, km)
        found = []
        for header, again_ in [*((header, False) for header in headers), *((header, True) for header in others)]:
            old = recorded.get(header.path.name)
            state = "reread" if again_ else "loaded" if old is None else "replaced"
            found.append(self._one(header, old, state, begin))
        return found

    def claim(self, name: str) -> None:
        """Lock the name of a file against other readers; numbers far below those of kilometres represent names."""
        key = -(1 << 30) - (zlib.crc32(name.encode()) >> 2)
        row = self.conn.execute("SELECT pg_try_advisory_xact_lock(%s, %s)", [self.survey.id, key]).fetchone()
        if row is None or not row[0]:
            raise BusyError(
                f"another process is reading {name}: wait until it has finished (tunneldb status)"
                f"{holder_text(self.conn, self.survey.id, key)}"
            )

    def overlapped(self, former: Sequence[Recorded], rest: Iterable[Recorded]) -> list[Recorded]:
        """Return files that overlap a replaced one: their points may return where it was nearer to the centre."""
        if self.settings.edge is None:
            return []
        reach = voxel_reach(self.settings.edge)
        return [file for file in rest if any(file.low <= old.high + reach and file.high >= old.low - reach for old in former)]

    def find(self, file: Recorded, given: Sequence[Path], why: str, remedy: str) -> ScanHeader:
        """Return the header of a file that must be read again, from its given current place.

        Raises
        ------
        UserError
            If it is not there as it was loaded; with the reason for reading it and the command to type.
        """
        path = next((path for path in given if path.name == file.name), Path(file.path))
        if not path.is_file() or checksum(path) != file.checksum:
            raise UserError(f"{why} {file.name}, which has to be read again and is not at {path} as it was loaded: {remedy}")
        header = in_units(read_header(path), GivenUnits(file.units.plan, file.units.height))
        self.check(header)
        return header

    def reread(self, header: ScanHeader, former: Recorded, begin: StartProgress = silent) -> Read:
        """Read a file again that is there."""
        return self._one(header, former, "reread", begin)

    def _one(self, header: ScanHeader, former: Recorded | None, state: str, begin: StartProgress) -> Read:
        path, started = header.path, time.monotonic()
        survivors = Spool(self.memory // self.share)
        try:
            counts, digest = self._filter(header, survivors, begin(path.name, 2 * header.points))
            doubtful = doubt(self.survey.intensity_kind, counts.intensity_sample)
            stated = None if header.crs is None else self.survey.srid
            left = [] if former is None else self.leave(former)
            differs = describe_box_difference(header, counts.box)
            noted = coordinate_note(header, self.survey.srid)
            content = Content(path, digest, path.stat().st_size, stated, differs, doubtful, counts, header.units, noted)
            file_id = record_file(self.conn, self.survey, content)
            record_kilometres(self.conn, file_id, survivors.kilometres(), counts, left)
            if self.held is None:
                write_fragments(self.conn, self.survey, file_id, survivors)
            else:
                self.held[file_id] = survivors
        finally:
            if self.held is None or survivors not in self.held.values():
                survivors.close()
        return Read(file_id, state, time.monotonic() - started, self._density_note(counts))

    def _density_note(self, counts: FilterCounts) -> str | None:
        """Warn that most of a file's points are where their density is too low for finding leaks."""
        least = PARAMETERS["image.min_density"].default
        if self.survey.intensity_kind == "none" or counts.density >= least:
            return None
        return (
            f"half of its points are where there are {counts.density:.0f} points/m² or fewer; lining with fewer than {least:g}"
            " is not searched for leaks, and counts as not inspected (image.min_density)"
        )

    def _filter(self, header: ScanHeader, survivors: Spool, progress: Callable[[int], None]) -> tuple[FilterCounts, str]:
        """Filter a file; returns its counts and its checksum, which another thread makes meanwhile."""
        with ThreadPoolExecutor(1, "checksum") as pool:
            digest = pool.submit(checksum, header.path)
            dimension = self.survey.intensity_dimension
            counts = filter_file(
                header.path, dimension, self.alignment, self.poses, self.settings, survivors, 0, progress, self.memory,
                units=header.units, check_poses=self._pose_checker(header.path),
            )  # fmt: skip
            require_kind(self.survey, header.path, counts.intensity_sample)
            return counts, digest.result()

    def _pose_checker(self, path: Path) -> CheckPoses | None:
        """Return the function that compares a sample of a file's points with the scanner positions."""
        check = self.pose_check
        return None if check is None else lambda points: check.check(path, points, self.settings.max_left_out)

    def leave(self, former: Recorded) -> list[int]:
        """Drop the waiting points of a file's former content; return the kilometres that may have rows of it."""
        drop_fragments(self.conn, self.survey, [former.id], kilometres_of(self.conn, [former.id]))
        waiting = self.conn.execute("SELECT km FROM tunnel.file_km WHERE file_id = %s AND loaded_at IS NULL", [former.id])
        held = range(math.floor(former.low / KILOMETRE), math.floor(former.high / KILOMETRE) + 1)
        return sorted({*held, *(row[0] for row in waiting.fetchall())})
