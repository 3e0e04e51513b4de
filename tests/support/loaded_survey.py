"""A straight tunnel across a kilometre, scans of it, and what the database makes of them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import laspy
import numpy as np
import psycopg

from tunneldb.pipeline.load import load_files
from tunneldb.pointcloud.selection import FilterSettings
from tunneldb.store.scan_files import Loaded
from tunneldb.store.scanner import Positions, save_positions
from tunneldb.store.survey import get_survey

START = 970.0  # chainage of the axis' beginning: the kilometre changes in the middle
LENGTH = 60.0
RADIUS = 2.0
ORIGIN = np.array([500_000.0, 4_500_000.0, 100.0])
SURVEY = "s"
SETTINGS = FilterSettings()


def tube(first: float, last: float, density: float, seed: int) -> np.ndarray:
    """Points on a straight tunnel along x between two chainages, with strays in its air; to the millimetre."""
    rng = np.random.default_rng(seed)
    count = int(density * 2 * np.pi * RADIUS * (last - first))
    along, angle = rng.uniform(first, last, count) - START, rng.uniform(-np.pi, np.pi, count)
    wall = np.column_stack([along, RADIUS * np.sin(angle), RADIUS * np.cos(angle)])
    strays = rng.uniform([first - START, -1, -1], [last - START, 1, 1], (20, 3))
    return np.round(ORIGIN + np.concatenate([wall, strays]), 3)


def write(path: Path, xyz: np.ndarray, scan_id: int = 1, seed: int = 0) -> Path:
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales, header.offsets = [0.001] * 3, ORIGIN
    header.add_extra_dim(laspy.ExtraBytesParams("Amplitude", "float32"))
    las = laspy.LasData(header)
    las.x, las.y, las.z = xyz.T
    las.gps_time = xyz[:, 0] - ORIGIN[0]
    las.point_source_id = np.full(len(xyz), scan_id)
    # A value of its own for each place, so that a row can be told to have come whole.
    las.Amplitude = np.round(xyz[:, 1] - ORIGIN[1], 3)
    las.classification = np.full(len(xyz), seed % 5)
    las.write(path)
    return path


def add_survey(conn: psycopg.Connection, platform: str = "static", kind: str = "amplitude") -> None:
    end = ORIGIN + np.array([LENGTH, 0, 0])
    tunnel = conn.execute(
        "INSERT INTO tunnel.tunnel (name, srid, start_chainage, alignment) VALUES ('t', 25830, %s, "
        "ST_SetSRID(ST_MakeLine(ST_MakePoint(%s, %s, %s), ST_MakePoint(%s, %s, %s)), 25830)) RETURNING id",
        (START, *ORIGIN.tolist(), *end.tolist()),
    ).fetchone()[0]
    survey = conn.execute(
        "INSERT INTO tunnel.survey (tunnel_id, name, date, intensity_dimension, intensity_kind, platform) "
        "VALUES (%s, %s, '2024-05-04', %s, %s, %s) RETURNING id",
        (tunnel, SURVEY, None if kind == "none" else "Amplitude", kind, platform),
    ).fetchone()[0]
    mobile = platform == "mobile"
    keys, x = (np.array([0.0, 60.0]), [0.0, LENGTH]) if mobile else (np.arange(3, dtype=np.int32), [0.0, LENGTH, LENGTH])
    save_positions(conn, survey, Positions(mobile, keys, ORIGIN + np.outer(x, [1.0, 0.0, 0.0])), 25830)
    conn.commit()


def load(
    conn: psycopg.Connection, paths: Sequence[Path], settings: FilterSettings = SETTINGS, **options: object
) -> list[Loaded]:
    survey = get_survey(conn, SURVEY)
    conn.rollback()
    return list(load_files(conn, survey, paths, settings, **options))


def rows(conn: psycopg.Connection) -> set[tuple[object, ...]]:
    found = conn.execute(
        "SELECT p.km, p.chainage, p.gps_time, ST_X(geom), ST_Y(geom), ST_Z(geom), segment, scan_id, f.name, intensity, "
        "classification FROM tunnel.point p JOIN tunnel.scan_file f ON f.id = p.file_id"
    ).fetchall()
    conn.rollback()
    assert len(set(found)) == len(found)
    return set(found)


def files(conn: psycopg.Connection) -> dict[str, tuple[int, ...]]:
    found = conn.execute("SELECT name, points, noise, outside, thinned, kept FROM tunnel.scan_file").fetchall()
    conn.rollback()
    return {row[0]: row[1:] for row in found}


def runs(conn: psycopg.Connection) -> list[tuple[object, ...]]:
    found = conn.execute("SELECT km, outcome, message FROM tunnel.run WHERE stage = 'load' ORDER BY id").fetchall()
    conn.rollback()
    return found


def assert_nothing_loaded(conn: psycopg.Connection) -> None:
    assert rows(conn) == set()
    assert files(conn) == {}
    left = conn.execute("SELECT relname FROM pg_class WHERE relname ~ '_km-?[0-9]+|_new$' AND relkind = 'r'").fetchall()
    conn.rollback()
    assert left == []
