"""Poses of sonar scans, their observations, and the ladders, in the database."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import psycopg
from psycopg import sql

from tunneldb.arrays import Float, Int64
from tunneldb.database.copy import Column, PointZ, copy_binary, pack
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.registration.underwater import LadderFit, Registration, SonarPose
from tunneldb.registration.underwater.observations import RANGE_NOISE
from tunneldb.store.scan_files import checksum
from tunneldb.store.survey import Survey

MIN_CELL_POINTS = 3  # points: their median tolerates one false echo


def save_registration(conn: psycopg.Connection[Any], survey: Survey, found: Registration, up: int) -> None:
    """Store the poses of scans in the place of those that scans of these names had, and the survey's ladders.

    Points that were loaded with an earlier pose go with it.

    Parameters
    ----------
    conn : Connection
        In a transaction.
    up : int
        Direction of up in the scan files, as they were registered: 1 or -1.
    """
    save_scans(conn, survey, found.scans, found.water_level, up)
    conn.execute("DELETE FROM tunnel.ladder WHERE survey_id = %s", [survey.id])
    for ladder in found.ladders:
        _save_ladder(conn, survey, ladder)


def save_scans(conn: psycopg.Connection[Any], survey: Survey, scans: Sequence[SonarPose], water_level: float, up: int) -> None:
    """Replace scans and poses of the same names, and delete their points; see `save_registration`."""
    names = [scan.path.name for scan in scans]
    rows = conn.execute(
        "SELECT DISTINCT p.km FROM tunnel.sonar_point p JOIN tunnel.sonar_scan c ON c.id = p.scan_id"
        " WHERE c.survey_id = %s AND c.name = ANY (%s)",
        [survey.id, names],
    ).fetchall()
    for scan in scans:
        _save_scan(conn, survey, scan, water_level, up)
    save_bed(conn, survey, [row[0] for row in rows])  # their points went with their poses


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


@dataclass(frozen=True)
class StoredScan:
    """Registered scan: its pose, and the counts of its points, as in `tunneldb.store.scan_files.Loaded`."""

    id: int
    checksum: str
    state: str
    undetermined: tuple[str, ...]
    rotation: Float
    translation: Float
    scale: float
    water_level: float
    loaded: bool
    counts: tuple[int, int, int, int, int, int, int]


@dataclass(frozen=True)
class SonarRows:
    """Points of a scan in the tunnel.

    Attributes
    ----------
    chainage, across : (n,) float64 arrays
        m.
    xyz : (n, 3) float64 array
        Tunnel's SRID, m.
    classes : (n,) int array
        See `tunneldb.classification.underwater.WaterClass`.
    points, outside, thinned : int
        Points of the file; of these, beyond the axis' ends or too far from the sonar, and left out for other reasons.
    """

    chainage: Float
    across: Float
    xyz: Float
    classes: Int64
    points: int
    outside: int
    thinned: int


def has_sonar(conn: psycopg.Connection[Any], survey: Survey) -> bool:
    """Return True if sonar scans were registered for a survey."""
    row = conn.execute("SELECT EXISTS (SELECT FROM tunnel.sonar_scan WHERE survey_id = %s)", [survey.id]).fetchone()
    return row is not None and bool(row[0])


def stored_scans(conn: psycopg.Connection[Any], survey: Survey) -> dict[str, StoredScan]:
    """Load the registered scans of a survey, by name; poses are NaN if there is none."""
    rows = conn.execute(
        "SELECT name, id, checksum, state, undetermined, rotation, translation, scale, water_level, loaded_at IS NOT NULL,"
        "       coalesce(points, 0), coalesce(false_echoes, 0), coalesce(outside, 0), coalesce(kept, 0)"
        "  FROM tunnel.sonar_scan WHERE survey_id = %s",
        [survey.id],
    ).fetchall()
    found = {}
    for name, key, digest, state, directions, rotation, translation, scale, level, loaded, *counts in rows:
        points, false, outside, kept = counts
        found[name] = StoredScan(
            key,
            digest,
            state,
            tuple(directions),
            np.reshape(rotation or [np.nan] * 9, (3, 3)),
            np.array(translation or [np.nan] * 3),
            np.nan if scale is None else scale,
            level,
            loaded,
            (points, false, outside, 0, 0, points - false - outside - kept, kept),
        )
    return found


def water_level(conn: psycopg.Connection[Any], survey: Survey, km: int) -> float | None:
    """Return the water level in a kilometre, m; None if no sonar scan was loaded."""
    row = conn.execute("SELECT height FROM tunnel.water_level WHERE survey_id = %s AND km = %s", [survey.id, km]).fetchone()
    return None if row is None else row[0]


def save_points(conn: psycopg.Connection[Any], survey: Survey, scan: StoredScan, rows: SonarRows, false: int) -> list[int]:
    """Store the points of a scan in the place of those that it had; returns the kilometres that they touch."""
    conn.execute("DELETE FROM tunnel.sonar_point WHERE scan_id = %s", [scan.id])
    km = np.floor(rows.chainage / KILOMETRE).astype(np.int32)
    count = len(km)
    columns: dict[str, Column] = {
        "survey_id": np.full(count, survey.id, np.int32),
        "km": km,
        "scan_id": np.full(count, scan.id, np.int64),
        "chainage": rows.chainage,
        "across": rows.across,
        "classification": rows.classes.astype(np.int16),
        "geom": PointZ(rows.xyz, survey.srid),
    }
    copy_binary(conn, sql.Identifier("tunnel", "sonar_point"), list(columns), [pack(list(columns.values()))])
    conn.execute(
        "UPDATE tunnel.sonar_scan SET points = %s, false_echoes = %s, outside = %s, kept = %s, loaded_at = clock_timestamp()"
        " WHERE id = %s",
        [rows.points, false, rows.outside, count, scan.id],
    )
    return sorted({int(one) for one in np.unique(km)})


def save_bed(conn: psycopg.Connection[Any], survey: Survey, kilometres: Sequence[int]) -> None:
    """Recompute bed and water level of kilometres from their points; results that depend on them become stale."""
    conn.execute(
        """
        INSERT INTO tunnel.water_level (survey_id, km, height, changed_at)
        SELECT %(survey)s, k.km,
               (SELECT max(c.water_level) FROM tunnel.sonar_scan c
                 WHERE c.survey_id = %(survey)s
                   AND EXISTS (SELECT FROM tunnel.sonar_point p WHERE p.scan_id = c.id AND p.km = k.km)), clock_timestamp()
          FROM unnest(%(km)s::int[]) AS k (km)
        ON CONFLICT (survey_id, km) DO UPDATE SET height = excluded.height, changed_at = excluded.changed_at
        """,
        {"survey": survey.id, "km": list(kilometres)},
    )
    conn.execute("DELETE FROM tunnel.bed WHERE survey_id = %s AND km = ANY (%s)", [survey.id, list(kilometres)])
    conn.execute(
        """
        INSERT INTO tunnel.bed (survey_id, km, n, across_n, height, depth, sigma, points)
        SELECT cell.survey_id, km, n, across_n, height, water_level - height, sqrt(variance / points + pose_variance), points
          FROM (SELECT p.survey_id, p.km, floor(p.chainage)::int AS n, floor(p.across * 10)::int AS across_n,
                       percentile_cont(0.5) WITHIN GROUP (ORDER BY ST_Z(p.geom)) AS height, max(c.water_level) AS water_level,
                       coalesce(var_samp(ST_Z(p.geom)), %(noise)s ^ 2) AS variance,
                       coalesce(max(c.covariance[41]), 0) AS pose_variance, count(*) AS points
                  FROM tunnel.sonar_point p
                  JOIN tunnel.sonar_scan c ON c.id = p.scan_id
                 WHERE p.survey_id = %(survey)s AND p.km = ANY (%(km)s) AND p.classification = 40
                 GROUP BY 1, 2, 3, 4
                HAVING count(*) >= %(least)s) cell
        """,
        {"survey": survey.id, "km": list(kilometres), "noise": RANGE_NOISE, "least": MIN_CELL_POINTS},
    )


@dataclass(frozen=True)
class BedCells:
    """The bed of a kilometre; all arrays over its cells.

    Attributes
    ----------
    chainage, across : (n,) float64 arrays
        Places of the cells' middles, m.
    values : (n, 3) float64 array
        Height, depth below the water and standard deviation, m.
    """

    chainage: Float
    across: Float
    values: Float

    def at(self, chainage: Float, across: Float) -> Float:
        """Return the values (k, 3) of the cells at places (k,), m; NaN if there is none."""
        key, wanted = self._keys(self.chainage, self.across), self._keys(chainage, across)
        order = np.argsort(key)
        place = order[np.minimum(np.searchsorted(key, wanted, sorter=order), len(order) - 1)]
        return np.where((key[place] == wanted)[:, None], self.values[place], np.nan)

    @staticmethod
    def _keys(chainage: Float, across: Float) -> Int64:
        """Return a whole number for each cell, -1 beyond the axis."""
        with np.errstate(invalid="ignore"):
            key = np.floor(chainage) * 10_000 + np.floor(across * 10.0) + 5_000  # a canal is not 500 m wide
        return np.where(np.isfinite(key), key, -1).astype(np.int64)


def load_bed(conn: psycopg.Connection[Any], survey: Survey, km: int) -> BedCells:
    """Read the bed of a kilometre."""
    rows = conn.execute(
        "SELECT n + 0.5::float8, (across_n + 0.5::float8) / 10, height, depth, sigma FROM tunnel.bed"
        " WHERE survey_id = %s AND km = %s ORDER BY n, across_n",
        [survey.id, km],
    ).fetchall()
    cells = np.reshape(np.array(rows, np.float64), (-1, 5))
    return BedCells(cells[:, 0], cells[:, 1], cells[:, 2:])


def load_sonar_points(conn: psycopg.Connection[Any], survey: Survey, km: int) -> Float:
    """Load points (n, 3) of sonar scans on the submerged lining and the bed of a kilometre, tunnel's SRID, m."""
    rows = conn.execute(
        "SELECT ST_X(geom), ST_Y(geom), ST_Z(geom) FROM tunnel.sonar_point"
        " WHERE survey_id = %s AND km = %s AND classification IN (40, 42) ORDER BY id",
        [survey.id, km],
    ).fetchall()
    return np.reshape(np.array(rows, np.float64), (-1, 3))
