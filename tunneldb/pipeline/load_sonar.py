"""Loading registered sonar scans: their points into the tunnel, classed, thinned, and the bed of the kilometres they touch."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import psycopg

from tunneldb.arrays import Bool, Float
from tunneldb.classification.underwater import WaterClass, classify, spacing_of_rays, spacing_of_soundings
from tunneldb.errors import UserError
from tunneldb.geometry.alignment import Alignment
from tunneldb.pointcloud.sonar import read_sonar, read_soundings
from tunneldb.progress import StartProgress, silent
from tunneldb.registration.underwater import GIVEN, SonarPose
from tunneldb.stages.ledger import stage_run
from tunneldb.store.scan_files import Loaded, checksum
from tunneldb.store.sonar import SonarRows, StoredScan, save_bed, save_points, save_scans, stored_scans
from tunneldb.store.surface import load_alignment
from tunneldb.store.survey import Survey

MAX_SONAR_RANGE = 15.0  # m from the sonar: beyond, its rays graze bed and walls, and lie too far apart to tell false echoes
VOXEL = 0.05  # of which one point is kept, m: a beam is as wide a few metres off


def record_soundings(conn: psycopg.Connection[Any], survey: Survey, paths: Sequence[Path], water_level: float) -> None:
    """Record files of soundings in the tunnel's system, for `load_sonar`; already recorded ones stay.

    Parameters
    ----------
    conn : Connection
        Idle.
    water_level : float
        m, in the tunnel's system.

    Raises
    ------
    UserError
        If there is no such file, or a scan of its name was registered.
    """
    with conn.transaction():
        known = stored_scans(conn, survey)
        for path in paths:
            if not path.is_file():
                raise UserError(f"{path}: no such file")
            before = known.get(path.name)
            if before is not None and before.state != GIVEN:
                raise UserError(f"{path}: a sonar scan {path.name} has been registered: load it without --medium, or rename it")
            if before is None or (before.checksum, before.water_level) != (checksum(path), water_level):
                nothing = np.full((7, 7), np.nan)
                scan = SonarPose(path, np.full((3, 3), np.nan), np.full(3, np.nan), np.nan, nothing, GIVEN, (), ())
                save_scans(conn, survey, [scan], water_level, 1)


def load_sonar(
    conn: psycopg.Connection[Any], survey: Survey, paths: Sequence[Path], begin: StartProgress = silent
) -> Iterator[Loaded]:
    """Load registered sonar scans, each in a transaction of its own, with the bed of the kilometres that it touches.

    Parameters
    ----------
    conn : Connection
        Idle.
    paths : sequence of Path
        Registered by `tunneldb.pipeline.register.register_survey`.
    begin : callable
        See `tunneldb.progress.StartProgress`.

    Yields
    ------
    Loaded
        One a file, as soon as it is committed; ``noise`` are its false echoes.

    Raises
    ------
    UserError
        If a file was changed since it was registered, or its pose is not known.
    """
    known = stored_scans(conn, survey)
    alignment = load_alignment(conn, survey)
    conn.rollback()
    for path in paths:
        _require_pose(path, known[path.name])
    for path in paths:
        scan = known[path.name]
        if scan.loaded:
            yield Loaded(path.name, "unchanged", *scan.counts)
            continue
        started = time.monotonic()
        begin(path.name, 1)
        with stage_run(conn, survey.id, None, "load", {"files": [path.name], "medium": "water"}) as run:
            rows, false = _rows(path, scan, alignment)
            kilometres = save_points(conn, survey, scan, rows, false)
            save_bed(conn, survey, kilometres)
            run.counts["kept"] = len(rows.chainage)
        counts = (rows.points, false, rows.outside, 0, 0, rows.thinned, len(rows.chainage))
        yield Loaded(path.name, "loaded", *counts, seconds=time.monotonic() - started)


def _require_pose(path: Path, scan: StoredScan) -> None:
    if not path.is_file() or checksum(path) != scan.checksum:
        raise UserError(
            f"{path}: the sonar scan is gone or was changed since it was registered; register it again: tunneldb register"
        )
    if scan.state == "undetermined":
        named = ", ".join(scan.undetermined)
        raise UserError(
            f"{path}: its pose is not determined ({named}): it cannot be loaded; tunneldb register names what to do"
        )


def _rows(path: Path, scan: StoredScan, alignment: Alignment) -> tuple[SonarRows, int]:
    """Return points of a scan in the tunnel without false echoes, and the number of these."""
    points, read, in_reach, reach = _placed(path, scan)
    chainage, across = alignment.places(points)
    inside = np.isfinite(chainage) & in_reach
    chainage, across, points = chainage[inside], across[inside], points[inside]
    if len(points) == 0:
        raise UserError(f"{path}: none of its {read} points is along the axis of the tunnel")
    spacing = spacing_of_soundings(points) if reach is None else spacing_of_rays(reach[inside])
    classes = classify(np.column_stack([chainage, across, points[:, 2] - scan.water_level]), spacing)
    true = classes != WaterClass.FALSE
    false = int((~true).sum())
    chainage, across, points, classes = chainage[true], across[true], points[true], classes[true]
    voxel = np.floor((points - points[:1]) / VOXEL).astype(np.int64)
    _, first = np.unique(voxel, axis=0, return_index=True)
    first.sort()
    rows = SonarRows(
        chainage[first], across[first], points[first], classes[first], read, read - int(inside.sum()),
        len(points) - len(first),
    )  # fmt: skip
    return rows, false


def _placed(path: Path, scan: StoredScan) -> tuple[Float, int, Bool, Float | None]:
    """Return points (n, 3) of a file in the tunnel, their total, those near enough to the sonar, and their ranges, if known."""
    if scan.state == GIVEN:
        points, invalid = read_soundings(path)
        return points, len(points) + invalid, np.ones(len(points), bool), None
    points, invalid = read_sonar(path)
    arm = scan.scale * points @ scan.rotation.T
    reach = np.linalg.norm(arm, axis=1)
    return arm + scan.translation, len(points) + invalid, reach < MAX_SONAR_RANGE, reach
