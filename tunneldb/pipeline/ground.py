"""The stage ``ground``: ground, lining and clusters of a kilometre from its points of survey density, and their classes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import psycopg
from psycopg import sql

from tunneldb.arrays import Float
from tunneldb.classification.classes import PointClass
from tunneldb.classification.classify import find_scene
from tunneldb.classification.ground.extraction import MARGIN, GroundSettings, find_ground
from tunneldb.classification.ground.wall_arcs import foot_arcs
from tunneldb.classification.objects.objects import ClusterSettings
from tunneldb.classification.scene import Scene
from tunneldb.database.fetch import fetch_array
from tunneldb.errors import UserError
from tunneldb.geometry.plan_line import PlanLine
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.geometry.surface import Surface
from tunneldb.store.partition import partition, partition_exists
from tunneldb.store.scene import line_of, load_spheres, save_clusters, save_ground, save_relief
from tunneldb.store.surface import load_surface
from tunneldb.store.survey import Survey

Counts = dict[str, Any]

_XYZ: tuple[tuple[str, str, sql.Composable], ...] = tuple(
    (axis, "f8", sql.SQL("public.{}(geom)").format(sql.Identifier(f"st_{axis}"))) for axis in "xyz"
)


def ground(
    conn: psycopg.Connection[Any],
    survey: Survey,
    km: int,
    values: Mapping[str, float],
    progress: Callable[[float], None],
) -> Counts:
    """Find the ground, the lining and what else there is in a kilometre (Li et al., 2023), and class its points.

    Points and sections so far beyond its ends as the ground depends on (``MARGIN``) are looked at too, so that its neighbours
    find the same there. A tunnel without ground has none in the database, and all else.

    Raises
    ------
    UserError
        If there are no sections, or no points.
    """
    begin, end = km * KILOMETRE - MARGIN, (km + 1) * KILOMETRE + MARGIN
    surface = load_surface(conn, survey, begin, end)
    points, own = read_points(conn, survey, km, begin, end)
    progress(0.2)
    line = line_of(surface)
    scene = replace(find(points, line, surface, values), spheres=load_spheres(conn, survey, km, km))
    progress(0.6)
    classes = scene.classes(points[:own])
    metres = save_ground(conn, survey, km, line, scene.ground, foot_arcs(scene.ground, line, surface))
    save_relief(conn, survey, km, scene.relief)
    clusters = save_clusters(conn, survey, km, scene.clusters)
    progress(0.8)
    conn.execute("SELECT tunnel_api.class_write(%s, %s, %b)", [survey.id, km, classes.tobytes()])
    count = np.bincount(classes, minlength=256)
    return {"metres": metres, "clusters": clusters, **{klass.name.lower(): int(count[klass]) for klass in PointClass}}


def find(points: Float, line: PlanLine, surface: Surface, values: Mapping[str, float]) -> Scene:
    """Find ground, lining and clusters from points (n, 3) of survey density, m."""
    found = find_ground(points, line, GroundSettings.of(values))
    return find_scene(points, line, surface, found, ClusterSettings.of(values))


def read_points(conn: psycopg.Connection[Any], survey: Survey, km: int, begin: float, end: float) -> tuple[Float, int]:
    """Read the points of a kilometre, in the order of its rows, and after them those of its neighbours between two chainages.

    Returns
    -------
    points : (n, 3) float array
        m.
    own : int
        How many are the kilometre's own.

    Raises
    ------
    UserError
        If it has none.
    """
    limits = {km: "true", km - 1: "chainage >= %(begin)s", km + 1: "chainage < %(end)s"}
    parts = []
    # Rolled back for the sake of its locks: of two neighbours that held each other's points none could swap in its own.
    with conn.transaction(force_rollback=True):
        conn.execute("SET LOCAL synchronize_seqscans = off")  # row by row, from the first one
        conn.execute("SET LOCAL max_parallel_workers_per_gather = 0")
        for part, limit in limits.items():
            if partition_exists(conn, survey, part):
                source = sql.SQL("FROM {} WHERE ").format(partition(survey, part)) + sql.SQL(limit)
                rows = fetch_array(conn, _XYZ, source, {"begin": begin, "end": end})
                parts.append(np.column_stack([rows[axis] for axis in "xyz"]))
            elif part == km:
                raise UserError(f"survey {survey.name} has no points in kilometre {km}")
    return np.concatenate(parts), len(parts[0])
