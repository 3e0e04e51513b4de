"""The files of a survey, as tunnel.scan_file and tunnel.file_km record them."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import psycopg
from psycopg.types.multirange import Multirange
from psycopg.types.range import Range

from tunneldb.errors import UserError
from tunneldb.geometry.units import Units
from tunneldb.pointcloud.formats.columns import names_file
from tunneldb.pointcloud.selection import FilterCounts
from tunneldb.store.survey import Survey

COUNTED = ("points", "noise", "outside", "invalid", "unposed", "thinned", "kept")


@dataclass(frozen=True)
class Loaded:
    """Result of loading a file.

    Attributes
    ----------
    name : str
    state : str
        ``loaded``, ``replaced`` (a file of this name had other content), ``reread`` (because of a replaced file),
        ``unchanged``, ``moved`` (unchanged, with a new path, which was recorded) or ``a copy`` (of another file, left out).
    points, noise, outside, invalid, unposed, thinned, kept : int
        Counts of its points, see `tunneldb.pointcloud.selection.FilterCounts`; points is the sum of the others once all its
        kilometres are loaded.
    seconds : float
        Time, with its share of the work for several files; 0 if unchanged.
    note : str or None
        Assumptions about it.
    """

    name: str
    state: str
    points: int
    noise: int
    outside: int
    invalid: int
    unposed: int
    thinned: int
    kept: int
    seconds: float = 0.0
    note: str | None = None


@dataclass(frozen=True)
class Recorded:
    """A row of tunnel.scan_file; low and high are the ends of its chainage, m, units those of the file's coordinates."""

    id: int
    name: str
    path: str
    checksum: str
    bytes: int
    low: float
    high: float
    units: Units


@dataclass(frozen=True)
class Content:
    """A file that was read, as it is to be recorded; srid is that of the tunnel, if the file states one.

    header_note states a difference between its header and its points, intensity_note a doubt about its intensity,
    coordinate_note conversions of its coordinates and contradictions in what the file states of them; units are those of the
    file's coordinates.
    """

    path: Path
    checksum: str
    bytes: int
    srid: int | None
    header_note: str | None
    intensity_note: str | None
    counts: FilterCounts
    units: Units
    coordinate_note: str | None


def checksum(path: Path) -> str:
    """Return the SHA-256 of a file, hexadecimal; including its column names, if these are in a file beside it."""
    try:
        with path.open("rb") as file:
            digest = hashlib.file_digest(file, "sha256")
        beside = names_file(path)
        if beside is not None:
            digest.update(beside.read_bytes())
        return digest.hexdigest()
    except OSError as error:
        raise UserError(f"{path}: cannot be read: {error.strerror}") from error


def recorded_files(conn: psycopg.Connection[Any], survey: Survey) -> dict[str, Recorded]:
    """Return the files of a survey, by name."""
    rows = conn.execute(
        "SELECT id, name, path, checksum, bytes, chainage_from, chainage_to, unit, height_unit FROM tunnel.scan_file"
        " WHERE survey_id = %s",
        [survey.id],
    ).fetchall()
    return {
        name: Recorded(key, name, path, digest, size, low, high, Units(unit, height_unit))
        for key, name, path, digest, size, low, high, unit, height_unit in rows
    }


def sonar_among(conn: psycopg.Connection[Any], survey: Survey, paths: Sequence[Path]) -> list[Path]:
    """Return those of some files that were registered as sonar scans of the survey, by their names."""
    known = conn.execute("SELECT name FROM tunnel.sonar_scan WHERE survey_id = %s", [survey.id]).fetchall()
    return [path for path in paths if (path.name,) in known]


def unchanged(conn: psycopg.Connection[Any], path: Path, recorded: Recorded | None, units: Units) -> Loaded | None:
    """Keep a file with unchanged content and units, but record its current path, for reading it at full density."""
    if (
        recorded is None
        or recorded.units != units
        or path.stat().st_size != recorded.bytes
        or checksum(path) != recorded.checksum
    ):
        return None
    if conn.execute("SELECT FROM tunnel.scan_file WHERE id = %s FOR KEY SHARE", [recorded.id]).fetchone() is None:
        return None  # removed meanwhile
    place = str(path.resolve())
    state = "unchanged" if recorded.path == place else "moved"
    if state == "moved":
        conn.execute("UPDATE tunnel.scan_file SET path = %s WHERE id = %s", [place, recorded.id])
    return outcome(conn, recorded.id, state)


def copies_of(conn: psycopg.Connection[Any], survey: Survey, paths: Sequence[Path]) -> dict[Path, Loaded]:
    """Return files with the content of one given before them, or of one in the survey under another name.

    Their points would count twice. Only files of the same size are read for it.
    """
    given = {path.name: path for path in paths}
    held = {name: file for name, file in recorded_files(conn, survey).items() if name not in given}
    sizes = Counter(path.stat().st_size for path in given.values()) + Counter(file.bytes for file in held.values())
    known = {file.checksum: f"{name}, which is in the survey" for name, file in held.items()}
    copies = {}
    for name, path in given.items():
        if sizes[path.stat().st_size] == 1:
            continue
        digest = checksum(path)
        if digest in known:
            note = f"has the same content as {known[digest]}: left out, because all its points would count twice"
            copies[path] = Loaded(name, "a copy", 0, 0, 0, 0, 0, 0, 0, note=note)
        else:
            known[digest] = name
    return copies


def outcome(conn: psycopg.Connection[Any], file_id: int, state: str, seconds: float = 0.0) -> Loaded:
    """Return the current counts of a file's points."""
    row = conn.execute(
        "SELECT name, points, noise, outside, invalid, unposed, thinned, kept FROM tunnel.scan_file WHERE id = %s", [file_id]
    ).fetchone()
    assert row is not None
    name, points, noise, outside, invalid, unposed, thinned, kept = row
    return Loaded(name, state, points, noise, outside, invalid, unposed, thinned, kept, seconds)


def record_file(conn: psycopg.Connection[Any], survey: Survey, content: Content) -> int:
    """Enter a file, in the place of one of the same name, with none of its points loaded yet; returns its id."""
    counts = content.counts
    chainage = counts.chainage if counts.kept else (None, None)
    row = conn.execute(
        """
        INSERT INTO tunnel.scan_file (survey_id, name, path, checksum, bytes, points, noise, outside, invalid, unposed,
                                      thinned, kept, chainage_from, chainage_to, extent, srid, header_note,
                                      intensity_note, pose_note, beyond_before, beyond_after, reach_before, reach_after,
                                      unit, height_unit, coordinate_note)
        VALUES (%s, %s, %s, %s, %s, %s, %s, %s, %s, %s, %s, 0, %s, %s, %s, %s, %s, %s, %s, %s, %s, %s, %s, %s, %s, %s)
        ON CONFLICT (survey_id, name) DO UPDATE
           SET path = excluded.path, checksum = excluded.checksum, bytes = excluded.bytes, points = excluded.points,
               noise = excluded.noise, outside = excluded.outside, invalid = excluded.invalid, unposed = excluded.unposed,
               thinned = excluded.thinned, kept = 0,
               chainage_from = excluded.chainage_from, chainage_to = excluded.chainage_to, extent = excluded.extent,
               srid = excluded.srid, header_note = excluded.header_note, intensity_note = excluded.intensity_note,
               pose_note = excluded.pose_note,
               beyond_before = excluded.beyond_before, beyond_after = excluded.beyond_after,
               reach_before = excluded.reach_before, reach_after = excluded.reach_after,
               unit = excluded.unit, height_unit = excluded.height_unit, coordinate_note = excluded.coordinate_note
        RETURNING id
        """,
        [
            survey.id,
            content.path.name,
            str(content.path.resolve()),
            content.checksum,
            content.bytes,
            counts.points,
            counts.noise,
            counts.outside,
            counts.invalid,
            counts.unposed,
            counts.thinned,
            *chainage,
            counts.extent.tolist(),
            content.srid,
            content.header_note,
            content.intensity_note,
            counts.pose_note,
            *counts.beyond,
            *counts.beyond_reach,
            content.units.plan,
            content.units.height,
            content.coordinate_note,
        ],
    ).fetchone()
    assert row is not None
    return int(row[0])


def kilometres_of(conn: psycopg.Connection[Any], file_ids: Iterable[int]) -> list[int]:
    """Return the kilometres that files touch, or touched before and have not been removed from yet."""
    rows = conn.execute("SELECT DISTINCT km FROM tunnel.file_km WHERE file_id = ANY (%s) ORDER BY km", [list(file_ids)])
    return [row[0] for row in rows.fetchall()]


def record_kilometres(
    conn: psycopg.Connection[Any],
    file_id: int,
    held: Mapping[int, int],
    counts: FilterCounts,
    left: Iterable[int],
) -> None:
    """Enter which kilometres a file touches.

    Parameters
    ----------
    held : mapping of int to int
        Rows that wait to be loaded, by kilometre.
    counts : FilterCounts
        Places in the file of the points of each kilometre and its surroundings, and their times.
    left : iterable of int
        Kilometres that may have rows of the file's former content, which must be removed.
    """
    conn.execute("DELETE FROM tunnel.file_km WHERE file_id = %s", [file_id])
    left = set(left)
    with conn.cursor() as cursor:
        cursor.executemany(
            "INSERT INTO tunnel.file_km (file_id, km, rows, points, seconds, loaded_at)"
            " VALUES (%s, %s, %s, %s, %s, CASE WHEN %s THEN NULL ELSE clock_timestamp() END)",
            [
                (
                    file_id,
                    km,
                    held.get(km, 0),
                    _multirange(counts.ranges.get(km, ())),
                    _multirange(counts.seconds.get(km, ())),
                    km in held or km in left,
                )
                for km in sorted({*held, *counts.ranges, *left})
            ],
        )


def _multirange(ranges: Sequence[tuple[int, int]]) -> Multirange[int]:
    return Multirange([Range(begin, end) for begin, end in ranges])


def withdraw_file(conn: psycopg.Connection[Any], file_id: int, left: Iterable[int]) -> None:
    """Mark a file for removal from the kilometres that may have rows of it; a file of no bytes has been removed."""
    record_kilometres(conn, file_id, {}, FilterCounts(), left)
    conn.execute(
        "UPDATE tunnel.scan_file SET checksum = '', bytes = 0, points = 0, noise = 0, outside = 0, invalid = 0, unposed = 0,"
        " thinned = 0, kept = 0 WHERE id = %s",
        [file_id],
    )


def record_loaded(conn: psycopg.Connection[Any], km: int, file_ids: list[int]) -> None:
    """Enter that files are loaded into a kilometre; those that have left it are forgotten there."""
    conn.execute(
        "DELETE FROM tunnel.file_km WHERE file_id = ANY (%s) AND km = %s AND isempty(points) AND rows = 0", [file_ids, km]
    )
    conn.execute("UPDATE tunnel.file_km SET loaded_at = clock_timestamp() WHERE file_id = ANY (%s) AND km = %s", [file_ids, km])


def change_counts(conn: psycopg.Connection[Any], changes: Mapping[int, tuple[int, int, int]]) -> None:
    """Add to the rows that files have (by id), to those thinned and to those outside, as of a second tube.

    To be called last in a transaction: rows are locked in the order of their ids, so that two that load kilometres
    with the same files wait for each other's end and never for each other.
    """
    for file_id in sorted(changes):
        kept, thinned, outside = changes[file_id]
        if kept or thinned or outside:
            conn.execute(
                "UPDATE tunnel.scan_file SET kept = kept + %s, thinned = thinned + %s, outside = outside + %s,"
                " loaded_at = clock_timestamp() WHERE id = %s",
                [kept, thinned, outside, file_id],
            )
