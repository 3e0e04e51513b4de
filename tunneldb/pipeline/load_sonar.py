"""Loading registered sonar scans: their points into the tunnel, classed, thinned, and the bed of the kilometres they touch."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import psycopg

from tunneldb.classification.underwater import WaterClass, classify
from tunneldb.errors import UserError
from tunneldb.geometry.alignment import Alignment
from tunneldb.pipeline.read import Begin, silent
from tunneldb.pointcloud.sonar import read_sonar
from tunneldb.store.ledger import stage_run
from tunneldb.store.scan_files import Loaded, checksum
from tunneldb.store.sonar import SonarRows, StoredScan, save_bed, save_points, stored_scans
from tunneldb.store.surface import load_alignment
from tunneldb.store.survey import Survey

FARTHEST = 15.0  # m from the sonar: beyond, its rays graze bed and walls, and lie too far apart to tell false echoes
VOXEL = 0.05  # of which one point is kept, m: a beam is as wide a few metres off


def sonar_among(conn: psycopg.Connection[Any], survey: Survey, paths: Sequence[Path]) -> list[Path]:
    """Those of some files that were registered as sonar scans of the survey, by their names."""
    known = stored_scans(conn, survey)
    return [path for path in paths if path.name in known]


def load_sonar(conn: psycopg.Connection[Any], survey: Survey, paths: Sequence[Path], begin: Begin = silent) -> Iterator[Loaded]:
    """Load registered sonar scans, each in a transaction of its own, with the bed of the kilometres that it touches.

    Parameters
    ----------
    conn : Connection
        Idle.
    paths : sequence of Path
        Registered by `tunneldb.pipeline.register.register_survey`.
    begin : callable
        See `tunneldb.pipeline.read.Begin`.

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
        raise UserError(f"{path}: the sonar scan was changed since it was registered: tunneldb register it again")
    if scan.state == "undetermined":
        named = ", ".join(scan.undetermined)
        raise UserError(
            f"{path}: its pose is not determined ({named}): it cannot be loaded; tunneldb register names what to do"
        )


def _rows(path: Path, scan: StoredScan, alignment: Alignment) -> tuple[SonarRows, int]:
    """Points of a scan that are no false echoes, in the tunnel, and how many are false."""
    file_points, _ = read_sonar(path)
    points = scan.scale * file_points @ scan.rotation.T + scan.translation
    chainage, across = alignment.places(points)
    inside = np.isfinite(chainage) & (np.linalg.norm(points - scan.translation, axis=1) < FARTHEST)
    chainage, across, points = chainage[inside], across[inside], points[inside]
    reach = np.linalg.norm(points - scan.translation, axis=1)
    classes = classify(np.column_stack([chainage, across, points[:, 2] - scan.water_level]), reach)
    true = classes != WaterClass.FALSE
    false = int((~true).sum())
    chainage, across, points, classes = chainage[true], across[true], points[true], classes[true]
    voxel = np.floor((points - scan.translation) / VOXEL).astype(np.int64)
    _, first = np.unique(voxel, axis=0, return_index=True)
    first.sort()
    rows = SonarRows(
        chainage[first], across[first], points[first], classes[first], len(file_points),
        len(file_points) - int(inside.sum()), len(points) - len(first),
    )  # fmt: skip
    return rows, false
