"""Scan files of a survey, written again at full density with the classes that stage ``ground`` has found."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

import psycopg

from tunneldb.arrays import Float, Int64, UInt8
from tunneldb.classification.classes import PointClass
from tunneldb.classification.scene import Scene
from tunneldb.database import snapshot
from tunneldb.errors import NotReadyError, UserError
from tunneldb.files import replacing
from tunneldb.geometry.units import IN_METRES, Units
from tunneldb.pointcloud.rewrite import rewrite
from tunneldb.progress import StartProgress
from tunneldb.stages.run import loaded_kilometres
from tunneldb.store.scene import load_scene
from tunneldb.store.sources import unchanged_file
from tunneldb.store.survey import Survey

CLASS_NAMES = {int(klass): klass.name.lower() for klass in PointClass}
"""Names of the classes, as written to the files."""

_STAGE = "ground"


@dataclass(frozen=True)
class ScanFile:
    """A file of a survey that is to be written again.

    Attributes
    ----------
    name, path, checksum : str
    bytes, points : int
        Files as loaded.
    kilometres : tuple of int
        Kilometres with points of it that are in the database.
    touched : tuple of int
        Kilometres with points of it, without noise, in the database or not yet.
    units : Units
        Units of its coordinates.
    """

    name: str
    path: str
    checksum: str
    bytes: int
    points: int
    kilometres: tuple[int, ...]
    touched: tuple[int, ...]
    units: Units


@dataclass(frozen=True)
class Written:
    """A file that was written: its points by class (256,), how long it took, s, and the units of its coordinates."""

    path: Path
    counts: Int64
    seconds: float
    units: Units = IN_METRES


def export_classified(
    conn: psycopg.Connection[Any],
    survey: Survey,
    folder: Path,
    kilometres: Collection[int],
    begin: StartProgress,
) -> Iterator[Written]:
    """Write the files that touch some kilometres into a folder, each whole and once, under its own name as ``.laz``.

    All files are checked before the first one is written. A file appears when it is complete. Its coordinates are those of the
    scan file, in the same units.

    Parameters
    ----------
    conn : Connection
        Idle; no transaction is open while files are written.
    folder : Path
        It exists.
    kilometres : collection of int
    begin : callable
        Called with a text and the number of points before each file; returns a function that takes the points written.

    Raises
    ------
    UserError
        If a kilometre that a file touches has no ground, or one that is out of date; if a file is gone or was changed; if
        one would be written over a file of the survey; if one cannot be written.
    """
    every = survey_files(conn, survey)
    wanted = [file for file in every if set(file.kilometres) & set(kilometres)]
    targets = _targets(conn, wanted, every, folder)
    require_ground(conn, survey, {km for file in wanted for km in file.kilometres})
    conn.rollback()
    for number, (file, target) in enumerate(zip(wanted, targets, strict=True), start=1):
        started = perf_counter()
        source = unchanged_file(file.path, file.bytes, file.checksum)
        with snapshot(conn):
            require_ground(conn, survey, file.kilometres)
            scene = load_scene(conn, survey, min(file.kilometres), max(file.kilometres))
        progress = begin(f"[{number}|{len(wanted)}] {file.name}", file.points)
        with replacing(target) as temporary:
            counts = rewrite(source, temporary, _classes_of(scene, file.units), CLASS_NAMES, progress)
        yield Written(target, counts, perf_counter() - started, file.units)


def _classes_of(scene: Scene, units: Units) -> Callable[[Float], UInt8]:
    """Return the function of the classes of points (n, 3) in some units."""
    return scene.classes if units.metric else lambda xyz: scene.classes(xyz * units.scales)


def survey_files(conn: psycopg.Connection[Any], survey: Survey) -> list[ScanFile]:
    """Return the files of a survey in the order of chainage."""
    there = set(loaded_kilometres(conn, survey))
    rows = conn.execute(
        "SELECT f.name, f.path, f.checksum, f.bytes, f.points,"
        " array(SELECT k.km FROM tunnel.file_km k WHERE k.file_id = f.id AND NOT isempty(k.points) ORDER BY k.km),"
        " array(SELECT k.km FROM tunnel.file_km k WHERE k.file_id = f.id AND k.rows > 0 ORDER BY k.km),"
        " f.unit, f.height_unit"
        " FROM tunnel.scan_file f WHERE f.survey_id = %s ORDER BY f.chainage_from, f.name",
        [survey.id],
    ).fetchall()
    return [
        ScanFile(name, path, checksum, size, points, tuple(km for km in near if km in there), tuple(touched), Units(*units))
        for name, path, checksum, size, points, near, touched, *units in rows
    ]


def _targets(conn: psycopg.Connection[Any], files: Sequence[ScanFile], every: Sequence[ScanFile], folder: Path) -> list[Path]:
    """Return the output paths; files that differ only in their extension keep it."""
    stems = Counter(Path(file.name).stem for file in every)
    targets = []
    for file in files:
        stem = Path(file.name).stem
        targets.append(folder / f"{stem if stems[stem] == 1 else file.name}.laz")
    require_no_scans(conn, targets)
    return targets


def require_no_scans(conn: psycopg.Connection[Any], targets: Sequence[Path]) -> None:
    """Refuse to write over a scan file of any survey."""
    rows = conn.execute("SELECT DISTINCT path FROM tunnel.scan_file").fetchall()
    scans = {_identity(Path(path)) for (path,) in rows} - {None}
    for target in targets:
        if _identity(target) in scans:
            raise UserError(f"{target} is a loaded scan file; choose another folder with -o")


def _identity(path: Path) -> tuple[int, int] | None:
    """Return the identity of a file, independent of the path; None if there is none."""
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_dev, status.st_ino


def same_file(one: Path, other: Path) -> bool:
    """Return True if two paths lead to one existing file."""
    return _identity(one) is not None and _identity(one) == _identity(other)


def require_ground(conn: psycopg.Connection[Any], survey: Survey, kilometres: Collection[int]) -> None:
    """Refuse kilometres without ground, or with outdated ground: its models do not match the current data."""
    rows = conn.execute(
        "SELECT s.km, s.stage, s.done_at IS NULL, s.reason FROM tunnel_api.stage_status s"
        " WHERE s.survey_id = %(survey)s AND s.km = ANY (%(km)s) AND (s.done_at IS NULL OR s.stale)"
        "   AND s.step <= (SELECT g.step FROM tunnel_api.stage_status g"
        "                   WHERE g.survey_id = s.survey_id AND g.km = s.km AND g.stage = %(stage)s)"
        " ORDER BY s.step, s.km",
        {"survey": survey.id, "km": list(kilometres), "stage": _STAGE},
    ).fetchall()
    if not rows:
        return
    missing = sorted({km for km, stage, never, _ in rows if never and stage == _STAGE})
    stale = sorted({km for km, *_ in rows} - set(missing))
    parts = [f"{_named_kilometres(missing)} without ground" if missing else ""]
    if stale:
        reason = next(reason for km, _, _, reason in rows if km in stale)
        parts.append(f"{_named_kilometres(stale)} with one that is out of date ({reason})")
    first, last = min(missing + stale), max(missing + stale)
    stages = [stage for _, stage, _, _ in rows if stage != "load"]
    begin = stages[0] if stages else _STAGE
    raise NotReadyError(
        f"survey {survey.name} has {' and '.join(filter(None, parts))}: tunneldb run {survey.name}"
        f" --km {first if first == last else f'{first}-{last}'} --from {begin} --to {_STAGE}"
    )


def _named_kilometres(numbers: Sequence[int]) -> str:
    word = "kilometre" if len(numbers) == 1 else "kilometres"
    return f"{word} {', '.join(map(str, numbers))}"
