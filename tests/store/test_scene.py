"""What stage ground has found goes into the database and comes back as it was."""

from __future__ import annotations

import numpy as np
import psycopg
import pytest
import shapely
from support.example_survey import NAME, example_surface

from tunneldb.classification.classes import PointClass
from tunneldb.classification.ground.model import COLUMN, Ground
from tunneldb.classification.lining_relief import Relief
from tunneldb.classification.objects.clusters import Cluster
from tunneldb.store.scene import (
    line_of,
    load_arcs,
    load_clusters,
    load_ground,
    load_relief,
    load_scene,
    save_clusters,
    save_ground,
    save_relief,
)
from tunneldb.store.survey import Survey, get_survey

# The example's tunnel is thought to go on into kilometres 11 and 13.
FIRST, STOP = 11_990, 13_010


@pytest.fixture
def survey(conn: psycopg.Connection, example: str) -> Survey:
    return get_survey(conn, NAME)


def ground(first: int, stop: int) -> Ground:
    """Ground between two metres, of which every number tells where it stands; with holes."""
    metres, columns = np.arange(first, stop), np.arange(-30, 28)
    height = metres[:, None] + columns[None, :] / 1000.0
    height[:, :3] = np.nan
    height[5::7, 10:12] = np.nan
    height[metres % 97 == 0] = np.nan
    foot = np.column_stack([-2.8 - metres / 1e6, 2.7 + metres / 1e6])
    foot[3::11, 1] = np.nan
    return Ground(first, int(columns[0]), height, 0.01 + metres / 1e6, foot, np.column_stack([metres, -metres]) / 1e5)


def test_ground_of_kilometres_is_put_together(conn: psycopg.Connection, survey: Survey) -> None:
    line = line_of(example_surface()[0])
    arcs = np.column_stack([np.arange(FIRST, STOP) / -1e4, np.arange(FIRST, STOP) / 1e4])
    arcs[100] = np.nan
    for km in (12, 11, 13):
        begin, end = max(km * 1000 - 30, FIRST), min((km + 1) * 1000 + 30, STOP)  # each knows more than its own
        save_ground(conn, survey, km, line, ground(FIRST, STOP).rows(begin, end), arcs[begin - FIRST : end - FIRST])
    whole = ground(FIRST, STOP)
    found = load_ground(conn, survey, FIRST, STOP)
    assert found is not None
    there = np.isfinite(whole.height).any(axis=1)
    assert (found.start, found.first) == (FIRST, -27)  # columns without any height are left out
    np.testing.assert_array_equal(found.height, whole.height[: len(found.height), 3:])
    for name in ("gamma", "foot", "lean"):
        np.testing.assert_array_equal(getattr(found, name)[there], getattr(whole, name)[there])
    left, right = load_arcs(conn, survey, FIRST, STOP - 1)
    np.testing.assert_array_equal(np.column_stack([left, right]), np.where(there[:, None], arcs, np.nan))
    assert len(load_ground(conn, survey, 12_500.5, 12_502.5).height) == 4
    (wkb,) = conn.execute("SELECT ST_AsBinary(geom) FROM tunnel.ground WHERE n = 12400").fetchone()
    drawn = shapely.get_coordinates(shapely.from_wkb(bytes(wkb)), include_z=True)
    along, across = line.place(drawn)
    np.testing.assert_allclose(along, 12_400.0, atol=1e-6)
    np.testing.assert_allclose(across, np.arange(-27, 28) * COLUMN, atol=1e-6)
    np.testing.assert_array_equal(drawn[:, 2], whole.height[12_400 - FIRST, 3:])
    assert save_ground(conn, survey, 12, line, None, np.empty((0, 2))) == 0
    assert load_ground(conn, survey, 12_000, 12_999) is None


def test_ground_goes_on_to_the_end_of_the_last_kilometre(conn: psycopg.Connection, survey: Survey) -> None:
    surface, whole = example_surface()[0], ground(12_800, 13_010)
    whole.height[12_998 - 12_800] = whole.height[12_997 - 12_800] + 1.0  # a hole
    arcs = np.tile([-6.0, 6.0], (len(whole.height), 1))
    conn.execute("DELETE FROM tunnel.ground WHERE survey_id = %s", [survey.id])
    save_ground(conn, survey, 12, line_of(surface), whole, arcs)
    along, across = np.array([12_998.5, 12_999.4, 12_999.999]), np.full(3, 0.5)
    height = whole.height_at(along, across)
    for stop in (13_000.0, 13_020.0):
        found = load_ground(conn, survey, 12_990.0, stop)
        np.testing.assert_allclose(found.height_at(along, across), height)
        assert found.is_ground(along, across, height).all()
        assert np.isnan(found.height_at(np.array([13_000.5]), across[:1])).all()
    assert len(load_ground(conn, survey, 12_990.0, 12_999.0).height) == 10
    left, right = load_arcs(conn, survey, 12_990, 13_005)
    assert (left[:11] == -6.0).all()
    assert (right[:11] == 6.0).all()
    assert np.isnan([left[11:], right[11:]]).all()


def test_the_lining_of_kilometres_is_put_together(conn: psycopg.Connection, survey: Survey) -> None:
    rng = np.random.default_rng(1)
    whole = Relief(0.25, 4 * FIRST, -40, *rng.standard_normal((2, 80, 4 * (STOP - FIRST))).astype(np.float32))
    whole.offset[7, 99] = np.nan
    for km in (13, 12, 11):
        save_relief(conn, survey, km, whole)
    found = load_relief(conn, survey, 11, 13)
    assert found is not None
    assert (found.cell, found.column, found.row) == (0.25, 4 * FIRST, -40)
    np.testing.assert_array_equal(found.offset, whole.offset)
    np.testing.assert_array_equal(found.spread, whole.spread)
    save_relief(conn, survey, 12, None)
    assert load_relief(conn, survey, 12, 12) is None
    assert load_relief(conn, survey, 13, 13).offset.shape == (80, 40)


def test_clusters_belong_to_the_kilometre_of_their_middle(conn: psycopg.Connection, survey: Survey) -> None:
    rng = np.random.default_rng(1)

    def cluster(along: float, height: float) -> Cluster:
        xyz = rng.uniform(-0.5, 0.5, (200, 3)) + np.array([500_000.0, 4_640_000.0 + along, 600.0])
        return Cluster.of(PointClass.OBJECT, xyz, along + xyz[:, 0] - 500_000.0, np.full(200, height))

    given = [cluster(12_000.3, 1.0), cluster(12_700.0, np.nan), cluster(12_999.9, 2.0)]
    assert [save_clusters(conn, survey, km, given) for km in (11, 12, 13)] == [0, 3, 0]
    found = load_clusters(conn, survey, 12_000.0, 13_000.0)
    assert len(found) == 3
    for one, other in zip(given, found, strict=True):
        np.testing.assert_array_equal(other.cells, one.cells)
        np.testing.assert_allclose(other.hull, one.hull)
        for name in ("klass", "points", "along_from", "along_to", "height_from", "height_to"):
            assert getattr(other, name) == getattr(one, name)
    assert len(load_clusters(conn, survey, 12_999.5, 13_500.0)) == 1
    assert len(load_clusters(conn, survey, 11_900.0, 12_500.0)) == 1


def test_a_scene_needs_no_ground(conn: psycopg.Connection, survey: Survey) -> None:
    for table in ("ground", "lining", "cluster", "target_sphere"):
        conn.execute(f"DELETE FROM tunnel.{table}")
    scene = load_scene(conn, survey, 12, 12)
    assert (scene.ground, scene.relief, list(scene.clusters), len(scene.spheres)) == (None, None, [], 0)
