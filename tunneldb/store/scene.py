"""Results of stage ``ground`` for a kilometre in the database: ground, lining and clusters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import psycopg
import shapely
from psycopg import sql

from tunneldb.arrays import Float, UInt8
from tunneldb.classification.ground.model import COLUMN, Ground
from tunneldb.classification.lining_relief import Relief
from tunneldb.classification.objects.clusters import CELL, Cluster
from tunneldb.classification.scene import Scene
from tunneldb.classification.targets.detection import Sphere
from tunneldb.database.copy import copy_binary, pack_array, pack_row, pack_value, unpack_array
from tunneldb.geometry.plan_line import PlanLine
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.geometry.surface import Surface
from tunneldb.store.surface import load_surface
from tunneldb.store.survey import Survey

END_MARGIN = 20.0
"""Distance beyond the ends of a stretch that is loaded too, m: heights are interpolated, objects cross the ends."""


def line_of(surface: Surface) -> PlanLine:
    """Return the axis as a line in plan: the vertices of the segments, at their chainages."""
    vertices = surface.segments[:, :6].reshape(-1, 3)
    along = surface.ends.ravel()
    new = np.diff(along, prepend=-np.inf) > 1e-6
    return PlanLine.of(vertices[new], along[new])


def save_ground(
    conn: psycopg.Connection[Any], survey: Survey, km: int, line: PlanLine, ground: Ground | None, arcs: Float
) -> int:
    """Replace the ground of a kilometre; returns the metres that have one.

    Parameters
    ----------
    ground : Ground or None
        Columns of that kilometre and more; None if there is none.
    arcs : (rows, 2) float array
        Arcs at which it begins on the left and on the right, m; NaN for none.
    """
    _forget(conn, survey, km, "ground")
    if ground is None:
        return 0
    first = max(int(km * KILOMETRE) - ground.start, 0)
    rows = range(first, min(int((km + 1) * KILOMETRE) - ground.start, len(ground.height)))
    across = (ground.first + np.arange(ground.height.shape[1])) * COLUMN
    columns = ("survey_id", "n", "km", "across", "height", "gamma", "foot", "lean", "arc_left", "arc_right", "geom")
    packed = []
    for row in rows:
        there = np.flatnonzero(np.isfinite(ground.height[row]))
        if len(there) < 2:
            continue
        held = slice(there[0], there[-1] + 1)
        xy = line.point(np.full(len(there), float(ground.start + row)), across[there])
        drawn = shapely.linestrings(np.column_stack([xy, ground.height[row, there]]))
        left, right = (None if np.isnan(arc) else float(arc) for arc in arcs[row])
        packed.append(
            pack_row([
                pack_value(survey.id, "i"), pack_value(ground.start + row, "i"), pack_value(km, "i"),
                pack_value(float(across[held.start]), "d"), pack_array(ground.height[row, held]),
                pack_value(float(ground.gamma[row]), "d"), pack_array(ground.foot[row]), pack_array(ground.lean[row]),
                pack_value(left, "d"), pack_value(right, "d"), _ewkb(drawn, survey),
            ])
        )  # fmt: skip
    return copy_binary(conn, sql.Identifier("tunnel", "ground"), columns, packed)


def load_ground(conn: psycopg.Connection[Any], survey: Survey, first: float, stop: float) -> Ground | None:
    """Load the ground of a survey between two chainages, m; None if there is none.

    Rows between metres with ground are as wide as all of them together, NaN where unknown. If a kilometre has ground to its
    last metre and the next one has none, or was not processed, it continues straight to the end.
    """
    rows = conn.execute(
        "SELECT n, across, array_send(height), gamma, array_send(foot), array_send(lean) FROM tunnel.ground"
        " WHERE survey_id = %s AND n BETWEEN %s AND %s ORDER BY n",
        [survey.id, int(np.floor(first)), int(np.ceil(stop))],
        binary=True,
    ).fetchall()
    if not rows:
        return None
    heights = [unpack_array(row[2], np.float64) for row in rows]
    begins = [round(row[1] / COLUMN) for row in rows]
    start, left = rows[0][0], min(begins)
    last = rows[-1][0] + 1 if _is_end(rows[-1][0] + 1) and rows[-1][0] < stop else rows[-1][0]
    count, width = last - start + 1, max(b + len(h) for b, h in zip(begins, heights, strict=True)) - left
    height = np.full((count, width), np.nan)
    gamma = np.full(count, np.nan)
    foot, lean = np.full((count, 2), np.nan), np.full((count, 2), np.nan)
    for row, begin, values in zip(rows, begins, heights, strict=True):
        k = row[0] - start
        height[k, begin - left : begin - left + len(values)] = values
        gamma[k] = row[3]
        foot[k], lean[k] = unpack_array(row[4], np.float64), unpack_array(row[5], np.float64)
    ground = Ground(start, left, height, gamma, foot, lean)
    _carry_to_ends(ground)
    return ground


def _carry_to_ends(ground: Ground) -> None:
    """Extrapolate the ends of kilometres without a following ground from the metres before them."""
    height, others = ground.height, (ground.gamma, ground.foot, ground.lean)
    for k in range(1, len(height)):
        if _is_end(ground.start + k) and np.isnan(height[k]).all():
            height[k] = height[k - 1] + np.nan_to_num(height[k - 1] - height[max(k - 2, 0)])
            for values in others:
                values[k] = values[k - 1]


def _is_end(metre: int) -> bool:
    """Return True if a kilometre ends at a metre, whose ground is stored with the next one."""
    return metre % KILOMETRE == 0


def load_arcs(conn: psycopg.Connection[Any], survey: Survey, first: int, stop: int) -> tuple[Float, Float]:
    """Return the arcs of the ground's left and right limits, at each metre from ``first`` to ``stop``; NaN for none.

    The end of a kilometre has those of its last metre, if the next one has none.
    """
    arcs = np.full((2, stop - first + 1), np.nan)
    rows = conn.execute(
        "SELECT n, arc_left, arc_right FROM tunnel.ground WHERE survey_id = %s AND n BETWEEN %s AND %s",
        [survey.id, first, stop],
    ).fetchall()
    for n, left, right in rows:
        arcs[:, n - first] = [np.nan if arc is None else arc for arc in (left, right)]
    for k in range(1, stop - first + 1):
        if _is_end(first + k) and np.isnan(arcs[:, k]).all():
            arcs[:, k] = arcs[:, k - 1]
    return arcs[0], arcs[1]


def save_relief(conn: psycopg.Connection[Any], survey: Survey, km: int, relief: Relief | None) -> None:
    """Replace the stored lining of a kilometre by its part of a relief; delete it if ``relief`` is None."""
    _forget(conn, survey, km, "lining")
    if relief is None:
        return
    begin, end = (round(k * KILOMETRE / relief.cell) for k in (km, km + 1))
    columns = slice(max(begin - relief.column, 0), max(end - relief.column, 0))
    offset, spread = relief.offset[:, columns], relief.spread[:, columns]
    if not offset.size:
        return
    box = [relief.column + columns.start, relief.row, offset.shape[1], offset.shape[0]]
    conn.execute(
        'INSERT INTO tunnel.lining (survey_id, km, cell, box, "offset", spread) VALUES (%s, %s, %s, %s, %b, %b)',
        [survey.id, km, relief.cell, box, offset.astype("<f4").tobytes(), spread.astype("<f4").tobytes()],
    )


def load_relief(conn: psycopg.Connection[Any], survey: Survey, km_from: int, km_to: int) -> Relief | None:
    """Load the lining of kilometres ``km_from`` to ``km_to``, joined; None if there is none."""
    rows = conn.execute(
        'SELECT cell, box, "offset", spread FROM tunnel.lining WHERE survey_id = %s AND km BETWEEN %s AND %s ORDER BY km',
        [survey.id, km_from, km_to],
        binary=True,
    ).fetchall()
    if not rows:
        return None
    boxes = np.array([row[1] for row in rows])
    column, row = boxes[:, :2].min(axis=0)
    end = (boxes[:, :2] + boxes[:, 2:]).max(axis=0)
    offset = np.full((end[1] - row, end[0] - column), np.nan, np.float32)
    spread = offset.copy()
    for (_, _, offsets, spreads), (west, south, width, height) in zip(rows, boxes.tolist(), strict=True):
        part = (slice(south - row, south - row + height), slice(west - column, west - column + width))
        offset[part] = np.frombuffer(offsets, "<f4").reshape(height, width)
        spread[part] = np.frombuffer(spreads, "<f4").reshape(height, width)
    return Relief(rows[0][0], int(column), int(row), offset, spread)


def save_clusters(conn: psycopg.Connection[Any], survey: Survey, km: int, clusters: Sequence[Cluster]) -> int:
    """Replace the clusters of a kilometre by those with their middle in it; return their number."""
    _forget(conn, survey, km, "cluster")
    columns = (
        "survey_id", "km", "class", "chainage_from", "chainage_to", "height_from", "height_to", "points", "cell", "cells",
        "geom",
    )  # fmt: skip
    packed = [
        pack_row([
            pack_value(survey.id, "i"), pack_value(km, "i"), pack_value(int(c.klass), "h"), pack_value(c.along_from, "d"),
            pack_value(c.along_to, "d"), pack_value(c.height_from, "d"), pack_value(c.height_to, "d"),
            pack_value(c.points, "q"), pack_value(CELL, "d"), pack_array(np.ascontiguousarray(c.cells, np.int32).ravel()),
            _ewkb(shapely.Polygon(c.hull), survey),
        ])
        for c in clusters
        if (c.along_from + c.along_to) / 2.0 // KILOMETRE == km
    ]  # fmt: skip
    return copy_binary(conn, sql.Identifier("tunnel", "cluster"), columns, packed)


def load_clusters(conn: psycopg.Connection[Any], survey: Survey, first: float, stop: float) -> list[Cluster]:
    """Load the clusters of a survey that are at least partly between two chainages, m."""
    rows = conn.execute(
        "SELECT class, array_send(cells), points, chainage_from, chainage_to, height_from, height_to,"
        " public.ST_AsBinary(geom) FROM tunnel.cluster WHERE survey_id = %s AND km BETWEEN %s AND %s"
        " AND chainage_to >= %s AND chainage_from <= %s ORDER BY chainage_from, id",
        [survey.id, int(first // KILOMETRE) - 1, int(stop // KILOMETRE) + 1, first, stop],
        binary=True,
    ).fetchall()
    return [
        Cluster(
            klass, unpack_array(cells, np.int32).reshape(-1, 3), points, along_from, along_to, height_from, height_to,
            shapely.get_coordinates(shapely.from_wkb(hull))[:-1],
        )
        for klass, cells, points, along_from, along_to, height_from, height_to, hull in rows
    ]  # fmt: skip


def save_classes(conn: psycopg.Connection[Any], survey: Survey, km: int, classes: UInt8) -> None:
    """Write the classes (n,) of a kilometre's points, in the order of its rows."""
    conn.execute("SELECT tunnel_internal.class_write(%s, %s, %b)", [survey.id, km, classes.tobytes()])


def load_scene(conn: psycopg.Connection[Any], survey: Survey, km_from: int, km_to: int) -> Scene:
    """Load the results of stage ``ground`` for kilometres ``km_from`` to ``km_to``: they classify points of any density.

    Raises
    ------
    UserError
        If there are no sections there.
    """
    first, stop = km_from * KILOMETRE - END_MARGIN, (km_to + 1) * KILOMETRE + END_MARGIN
    surface = load_surface(conn, survey, first, stop)
    return Scene(
        line_of(surface),
        load_ground(conn, survey, first, stop),
        load_clusters(conn, survey, first, stop),
        surface,
        load_relief(conn, survey, km_from - 1, km_to + 1),
        load_spheres(conn, survey, km_from, km_to),
    )


def load_spheres(conn: psycopg.Connection[Any], survey: Survey, km_from: int, km_to: int) -> Float:
    """Load target spheres of kilometres ``km_from`` to ``km_to`` and the neighbouring ones, averaged over scans.

    They have a kilometre also where they were found before there were segments, and so have no chainage.

    Returns
    -------
    (k, 4) float array
        x, y, z and nominal radius of each, m.
    """
    rows = conn.execute(
        "SELECT public.ST_X(geom), public.ST_Y(geom), public.ST_Z(geom), nominal FROM tunnel.target_sphere"
        " WHERE survey_id = %s AND km BETWEEN %s AND %s ORDER BY number, scan_id",
        [survey.id, km_from - 1, km_to + 1],
    ).fetchall()
    return np.array(rows, dtype=np.float64).reshape(-1, 4)


def save_spheres(
    conn: psycopg.Connection[Any],
    survey: Survey,
    spheres: Sequence[tuple[int, int, int, float | None, Sphere]],
    nominal: float,
) -> None:
    """Replace the target spheres of a survey.

    Parameters
    ----------
    spheres : sequence of (int, int, int, float or None, Sphere)
        For each scan that saw one: kilometre, number of the sphere, scan, chainage (m) and the sphere.
    nominal : float
        Radius that was looked for, m.
    """
    conn.execute("DELETE FROM tunnel.target_sphere WHERE survey_id = %s", [survey.id])
    with conn.cursor() as cursor:
        cursor.executemany(
            "INSERT INTO tunnel.target_sphere"
            " (survey_id, km, number, scan_id, chainage, geom, radius, nominal, rms, sigma, coverage, points)"
            " VALUES (%s, %s, %s, %s, %s, public.ST_SetSRID(public.ST_MakePoint(%s, %s, %s), %s), %s, %s, %s, %s, %s, %s)",
            [
                (
                    survey.id, km, number, scan, chainage, *sphere.centre.tolist(), survey.srid,
                    sphere.radius, nominal, sphere.rms, sphere.sigma, sphere.coverage, sphere.points,
                )
                for km, number, scan, chainage, sphere in spheres
            ],
        )  # fmt: skip


def _forget(conn: psycopg.Connection[Any], survey: Survey, km: int, table: str) -> None:
    conn.execute(
        sql.SQL("DELETE FROM {} WHERE survey_id = %s AND km = %s").format(sql.Identifier("tunnel", table)), [survey.id, km]
    )


def _ewkb(geometry: shapely.Geometry, survey: Survey) -> bytes:
    return bytes(shapely.to_wkb(shapely.set_srid(geometry, survey.srid), include_srid=True))
