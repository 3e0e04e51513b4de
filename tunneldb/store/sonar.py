"""Poses of sonar scans, what they rest on, and the ladders, as the database keeps them."""

from __future__ import annotations

from typing import Any

import numpy as np
import psycopg

from tunneldb.arrays import Float
from tunneldb.registration.underwater import LadderFit, Registration, SonarPose
from tunneldb.store.scan_files import checksum
from tunneldb.store.survey import Survey


def save_registration(conn: psycopg.Connection[Any], survey: Survey, found: Registration, up: int) -> None:
    """Store the poses of scans in the place of those that scans of these names had, and the survey's ladders.

    Parameters
    ----------
    conn : Connection
        In a transaction.
    up : int
        As the scans were taken: 1 or -1.
    """
    for scan in found.scans:
        _save_scan(conn, survey, scan, found.water_level, up)
    conn.execute("DELETE FROM tunnel.ladder WHERE survey_id = %s", [survey.id])
    for ladder in found.ladders:
        _save_ladder(conn, survey, ladder)


def _save_scan(conn: psycopg.Connection[Any], survey: Survey, scan: SonarPose, water_level: float, up: int) -> None:
    conn.execute("DELETE FROM tunnel.sonar_scan WHERE survey_id = %s AND name = %s", [survey.id, scan.path.name])
    known = bool(np.isfinite(scan.rotation).all())
    row = conn.execute(
        """
        INSERT INTO tunnel.sonar_scan (survey_id, name, path, checksum, bytes, up, water_level, state, undetermined,
                                       rotation, translation, scale, covariance)
        VALUES (%s, %s, %s, %s, %s, %s, %s, %s, %s, %s, %s, %s, %s)
        RETURNING id
        """,
        [
            survey.id,
            scan.path.name,
            str(scan.path.resolve()),
            checksum(scan.path),
            scan.path.stat().st_size,
            up,
            water_level,
            scan.state,
            list(scan.undetermined),
            _list(scan.rotation) if known else None,
            _list(scan.translation) if known else None,
            scan.scale if known else None,
            _list(scan.covariance) if known else None,
        ],
    ).fetchone()
    assert row is not None
    with conn.cursor() as cursor:
        cursor.executemany(
            "INSERT INTO tunnel.registration_residual (scan_id, kind, name, count, median, p95)"
            " VALUES (%s, %s, %s, %s, %s, %s)",
            [(row[0], one.kind, one.name, one.count, one.median, one.p95) for one in scan.residuals],
        )


def _save_ladder(conn: psycopg.Connection[Any], survey: Survey, ladder: LadderFit) -> None:
    axes = np.vstack([ladder.across, ladder.up, ladder.out])
    conn.execute(
        "INSERT INTO tunnel.ladder (survey_id, name, origin, axes, rms, rungs, scans) VALUES (%s, %s, %s, %s, %s, %s, %s)",
        [survey.id, ladder.name, _list(ladder.origin), _list(axes), ladder.rms, list(ladder.rungs), list(ladder.scans)],
    )


def _list(values: Float) -> list[float]:
    return [float(value) for value in np.ravel(values)]
