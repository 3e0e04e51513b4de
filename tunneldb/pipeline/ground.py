"""The stage ``ground``: ground, lining and clusters of a kilometre from its points of survey density, and their classes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import psycopg

from tunneldb.arrays import Float
from tunneldb.classification.classes import PointClass
from tunneldb.classification.classify import find_scene
from tunneldb.classification.ground.extraction import MARGIN, GroundSettings, find_ground
from tunneldb.classification.ground.wall_arcs import foot_arcs
from tunneldb.classification.objects.objects import ClusterSettings
from tunneldb.classification.scene import Scene
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.geometry.surface import Surface
from tunneldb.store.scene import line_of, load_spheres, save_classes, save_clusters, save_ground, save_relief
from tunneldb.store.sources import load_points
from tunneldb.store.surface import load_surface
from tunneldb.store.survey import Survey

Counts = dict[str, Any]


def ground(
    conn: psycopg.Connection[Any],
    survey: Survey,
    km: int,
    values: Mapping[str, float],
    progress: Callable[[float], None],
) -> Counts:
    """Find ground, lining and other objects in a kilometre (Li et al., 2023), and classify its points.

    Points and sections beyond its ends within ``MARGIN`` are used too, so that its neighbours have the same result there. A
    tunnel without ground has none in the database, but all other results.

    Raises
    ------
    UserError
        If there are no sections, or no points.
    """
    begin, end = km * KILOMETRE - MARGIN, (km + 1) * KILOMETRE + MARGIN
    surface = load_surface(conn, survey, begin, end)
    points, own = load_points(conn, survey, km, begin, end)
    spheres = load_spheres(conn, survey, km, km)
    progress(0.2)
    scene = compute_scene(points, surface, spheres, values)
    progress(0.6)
    classes = scene.classes(points[:own])
    metres = save_ground(conn, survey, km, scene.line, scene.ground, foot_arcs(scene.ground, scene.line, surface))
    save_relief(conn, survey, km, scene.relief)
    clusters = save_clusters(conn, survey, km, scene.clusters)
    progress(0.8)
    save_classes(conn, survey, km, classes)
    count = np.bincount(classes, minlength=256)
    return {"metres": metres, "clusters": clusters, **{klass.name.lower(): int(count[klass]) for klass in PointClass}}


def compute_scene(points: Float, surface: Surface, spheres: Float, values: Mapping[str, float]) -> Scene:
    """Find ground, lining and clusters.

    Parameters
    ----------
    points : (n, 3) float array
        Points of survey density, m.
    surface : Surface
        The tunnel there.
    spheres : (k, 4) float array
        Centres and radii of the target spheres there, m.
    values : mapping
        Parameters of the stage.
    """
    line = line_of(surface)
    found = find_ground(points, line, GroundSettings.of(values))
    return replace(find_scene(points, line, surface, found, ClusterSettings.of(values)), spheres=spheres)
