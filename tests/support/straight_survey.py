"""A survey of a straight tunnel across the end of a kilometre, made row by row as the stages leave them, to be stated on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import psycopg
import shapely
from psycopg.types.json import Jsonb
from shapely.geometry import Polygon

from tunneldb.anomalies.geometries import anomaly_geometries
from tunneldb.geometry.frame import segment_rows, tangents
from tunneldb.geometry.surface import Surface

FIRST, LAST = 940.0, 1060.0
"""Segments, m of chainage, every 10 m; sections twice in each. Kilometre 0 ends in the middle."""

RADIUS, SRID, STEP = 4.0, 25830, 0.1
GIRTH = 2 * np.pi * RADIUS
STAGES = ("load", "axis", "segments", "sections", "ground", "detect")


@dataclass(frozen=True)
class Wet:
    """A leak: a rectangle in the unrolled plane (chainage and arc from and to, m), and what became of it."""

    west: float
    east: float
    south: float
    north: float
    review: str = "open"
    detected: bool = True
    kind: str = "leak"
    confidence: float = 0.9

    @property
    def outline(self) -> Polygon:
        return shapely.box(self.west, self.south, self.east, self.north)

    @property
    def counts(self) -> bool:
        return self.kind == "leak" and self.detected and self.review != "rejected"

    def between(self, low: float, high: float) -> float:
        """Area of its part between two chainages, m²."""
        return max(min(self.east, high) - max(self.west, low), 0.0) * (self.north - self.south)


@dataclass(frozen=True)
class Scene:
    """What is to be made.

    Attributes
    ----------
    name : str
        Of the survey, and of its tunnel.
    scanned : (float, float)
        First and last point along the given axis, m.
    leaks : list of Wet
    done : dict of int to str
        Last stage that each kilometre was brought to.
    failed : dict of int to (str, str)
        Stage that then failed, and why.
    seen : float
        Share of the lining seen where detection ran.
    dark : (float, float)
        Stretch of it of which nothing was seen, m.
    notes : dict of int to str
        What stage axis noted of each kilometre.
    unposed : int
        Points of its file, of 1000, left out for want of the scanner's position.
    """

    name: str
    scanned: tuple[float, float] = (FIRST, LAST)
    leaks: Sequence[Wet] = ()
    done: dict[int, str] = field(default_factory=lambda: {0: "detect", 1: "detect"})
    failed: dict[int, tuple[str, str]] = field(default_factory=dict)
    seen: float = 0.9
    dark: tuple[float, float] = (0.0, 0.0)
    notes: dict[int, str] = field(default_factory=dict)
    unposed: int = 0


def make_survey(conn: psycopg.Connection, scene: Scene) -> None:
    """Make a survey."""
    surface, vertices = _surface()
    (tunnel,) = conn.execute(
        "INSERT INTO tunnel.tunnel (name, srid, start_chainage, spacing, alignment) VALUES (%s, %s, %s, 10, "
        "ST_GeomFromWKB(%s, %s)) RETURNING id",
        (scene.name, SRID, scene.scanned[0], shapely.to_wkb(shapely.LineString(vertices)), SRID),
    ).fetchone()
    (survey,) = conn.execute(
        "INSERT INTO tunnel.survey (tunnel_id, name, date, intensity_dimension, intensity_kind, platform) "
        "VALUES (%s, %s, '2024-05-04', 'Reflectance', 'reflectance', 'mobile') RETURNING id",
        (tunnel, scene.name),
    ).fetchone()
    conn.execute(
        "INSERT INTO tunnel.scan_file (survey_id, name, path, checksum, bytes, points, noise, outside, thinned, kept, unposed, "
        "chainage_from, chainage_to) VALUES (%s, 'a.laz', '/a.laz', repeat('0', 64), 1, 1000, 0, 0, 0, %s, %s, %s, %s)",
        (survey, 1000 - scene.unposed, scene.unposed, *scene.scanned),
    )
    for km, last in scene.done.items():
        reached = STAGES[: STAGES.index(last) + 1]
        for hour, stage in enumerate(reached):
            _run(conn, survey, km, stage, hour, None, scene.notes.get(km) if stage == "axis" else None)
        if km in scene.failed:
            stage, message = scene.failed[km]
            _run(conn, survey, km, stage, len(STAGES), message)
        if "sections" in reached:
            _geometry(conn, survey, km, surface, vertices)
        if last == "detect":
            _coverage(conn, survey, km, scene)
    for leak in scene.leaks:
        _leak(conn, survey, surface, leak)
    conn.commit()


def _run(
    conn: psycopg.Connection, survey: int, km: int, stage: str, hour: int, message: str | None, note: str | None = None
) -> None:
    conn.execute(
        "INSERT INTO tunnel.run (survey_id, km, stage, started_at, finished_at, outcome, message, counts) VALUES "
        "(%s, %s, %s, make_timestamptz(2024, 5, 5, %s, 0, 0, 'UTC'), make_timestamptz(2024, 5, 5, %s, 30, 0, 'UTC'), "
        "%s, %s, %s)",
        (survey, km, stage, hour, hour, "failed" if message else "done", message, Jsonb({"note": note} if note else {})),
    )


def _surface() -> tuple[Surface, np.ndarray]:
    """A level circular tunnel along y (right is x)."""
    chainage = np.arange(FIRST, LAST + 1, 10.0)
    vertices = np.column_stack([np.full(len(chainage), 5e5), 4.64e6 + chainage, np.full(len(chainage), 100.0)])
    at = np.arange(FIRST + 2.5, LAST, 5.0)
    radius = np.full((len(at), 361), RADIUS)
    arc = np.tile(np.radians(np.arange(361) - 180.0) * RADIUS, (len(at), 1))
    rows = segment_rows(vertices, tangents(vertices))
    ends = np.column_stack([chainage[:-1], chainage[1:]])
    return Surface((chainage[:-1] / 10).astype(int), rows, ends, at, radius, arc, 10.0), vertices


def _geometry(conn: psycopg.Connection, survey: int, km: int, surface: Surface, vertices: np.ndarray) -> None:
    """Axis, segments and sections of a kilometre; the vertex at its end belongs to the next."""
    for n, vertex in zip(np.append(surface.number, surface.number[-1] + 1).tolist(), vertices, strict=True):
        if n // 100 == km:
            point = shapely.to_wkb(shapely.Point(vertex))
            conn.execute(
                "INSERT INTO tunnel.axis_vertex (survey_id, n, km, geom, given, points, source) VALUES (%s, %s, %s, "
                "ST_GeomFromWKB(%s, %s), ST_GeomFromWKB(%s, %s), 5000, 'measured')",
                (survey, n, km, point, SRID, point, SRID),
            )
    for n, row, (start, end) in zip(surface.number.tolist(), surface.segments, surface.ends, strict=True):
        if n // 100 == km:
            conn.execute(
                "INSERT INTO tunnel.segment (survey_id, n, km, chainage_from, chainage_to, vertex_from, vertex_to, "
                "tangent_from, tangent_to, geom, points) "
                "VALUES (%s, %s, %s, %s, %s, %s, %s, %s, %s, ST_GeomFromWKB(%s, %s), 2500)",
                (
                    survey, n, km, float(start), float(end), *(row[i : i + 3].tolist() for i in (0, 3, 6, 9)),
                    shapely.to_wkb(shapely.LineString([row[:3], row[3:6]])), SRID,
                ),
            )  # fmt: skip
    for k, chainage in enumerate(surface.chainages.tolist()):
        if chainage // 1000 == km:
            ring = surface.to_space(np.full(361, chainage), surface.arcs[k], np.zeros(361))
            conn.execute(
                "INSERT INTO tunnel.section (survey_id, km, segment, half, chainage, half_width, angle_step, radius, arc, "
                "geom, points, interpolated) VALUES (%s, %s, %s, %s, %s, 0.5, 5, %s, %s, ST_GeomFromWKB(%s, %s), 900, 0)",
                (
                    survey, km, int(surface.number[k // 2]), 25 if k % 2 == 0 else 75, chainage,
                    surface.radius[k].tolist(), surface.arcs[k].tolist(), shapely.to_wkb(shapely.LineString(ring)), SRID,
                ),
            )  # fmt: skip


def _coverage(conn: psycopg.Connection, survey: int, km: int, scene: Scene) -> None:
    at = 1000 * km + STEP * (np.arange(10_000) + 0.5)
    lining = np.where((at > FIRST) & (at < LAST), STEP * GIRTH, 0)
    seen = np.where((at > scene.scanned[0]) & (at < scene.scanned[1]), scene.seen * lining, 0)
    seen[(at > scene.dark[0]) & (at < scene.dark[1])] = 0
    conn.execute(
        "INSERT INTO tunnel.coverage (survey_id, km, step, lining, seen, wet) VALUES (%s, %s, %s, %s, %s, %s)",
        (survey, km, STEP, lining.tolist(), seen.tolist(), (0 * seen).tolist()),
    )


def _leak(conn: psycopg.Connection, survey: int, surface: Surface, leak: Wet) -> None:
    shaped = anomaly_geometries(leak.outline, surface)
    conn.execute(
        "INSERT INTO tunnel.finding (survey_id, km, chainage_from, chainage_to, arc_from, arc_to, clock, kind, confidence, "
        "area, darkening_mean, darkening_max, image_share, unrolled, map, surface, review, detected) VALUES (%s, %s,"
        " %s, %s, %s, %s, "
        "%s, %s, %s, %s, 3, 4, 1, ST_GeomFromWKB(%s, 0), ST_GeomFromWKB(%s, %s), ST_GeomFromWKB(%s, %s), %s, %s)",
        (
            survey, int((leak.west + leak.east) // 2000), leak.west, leak.east, leak.south, leak.north, shaped.clock, leak.kind,
            leak.confidence, leak.outline.area, shapely.to_wkb(leak.outline), shapely.to_wkb(shaped.map), SRID,
            shapely.to_wkb(shaped.surface), SRID, leak.review, leak.detected,
        ),
    )  # fmt: skip
