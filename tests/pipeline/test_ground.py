"""The stage ground through the real commands, on simulated tunnels whose ground and things are known."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import laspy
import numpy as np
import psycopg
import pytest
from scipy.spatial import cKDTree
from support.databases import Copies

from tests.pipeline.test_detect import NAME, command, parameters, prepare
from tunneldb.classification.classes import PointClass
from tunneldb.pipeline import ground as stage
from tunneldb.simulate import Simulation, write
from tunneldb.stages.parameters import settings
from tunneldb.store.scene import load_ground, load_scene
from tunneldb.store.surface import load_surface
from tunneldb.store.survey import get_survey

PLANE = 13_000.0
START = PLANE - 20.0
# Classes of the simulator's truth.
LINING, FLOOR, APPENDAGE, NICHE, OUTLIER, RAIL, OBJECT, SPHERE = range(8)
MODELS = {
    "ground": "n, km, across, height, gamma, foot, lean, arc_left, arc_right, ST_AsBinary(geom)",
    "lining": 'km, cell, box, "offset", spread',
    "cluster": "km, class, chainage_from, chainage_to, height_from, height_to, points, cells, ST_AsBinary(geom)",
}
POINTS = """
    SELECT km, count(*), sum(hash_record_extended(ROW(chainage, ST_AsBinary(geom), segment, scan_id, file_id, intensity,
                                                      classification, "class"), 0))
      FROM tunnel.point GROUP BY km ORDER BY km
"""
"""Number of points in each kilometre, and a checksum of all their values."""


def scene(**others: object) -> Simulation:
    """A tunnel over the end of a kilometre, with people and cases in it."""
    options: dict[str, object] = {
        "start_chainage": START, "length": 40.0, "profile_spacing": 0.035, "profile_points": 800, "leaks": 2, "people": 3,
        "equipment": 3, "free_cables": 1, "ballast": 0.02,
    }  # fmt: skip
    return Simulation(parameters("profiler", 2, **(options | others)))


@pytest.fixture(scope="module")
def scan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("ground")
    write(scene(), folder)
    return folder


@pytest.fixture(scope="module")
def prepared(copies: Copies, template: str, scan: Path) -> Iterator[str]:
    """A database of two kilometres up to their sections, to be copied."""

    def fill() -> None:
        prepare(scan, "profiler", start=START)
        command("run", NAME, "--to", "sections")

    with copies.prepared(template, fill) as name:
        yield name


@pytest.fixture
def sections(copies: Copies, prepared: str) -> Iterator[psycopg.Connection]:
    """Connection to a copy of two kilometres up to their sections."""
    with copies.connected(prepared) as conn:
        yield conn


def points(conn: psycopg.Connection, km: int | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates and classes, 0 for none, of the points of a kilometre or of all, in the order of rows."""
    rows = conn.execute(
        'SELECT ST_X(geom), ST_Y(geom), ST_Z(geom), coalesce("class", 0) FROM tunnel.point'
        " WHERE km = %(km)s OR %(km)s IS NULL ORDER BY km, ctid",
        {"km": km},
    ).fetchall()
    conn.rollback()
    table = np.array(rows)
    return table[:, :3], table[:, 3].astype(int)


def truth_of(folder: Path, xyz: np.ndarray) -> np.ndarray:
    """Class in the simulation of points that come from its files."""
    (path,) = folder.glob("*.truth.npz")
    cloud = np.concatenate([laspy.read(file).xyz for file in sorted(folder.glob("*.laz"))])
    origin = cloud[0]
    away, nearest = cKDTree(cloud - origin).query(xyz - origin)
    assert away.max() < 1e-3
    return np.load(path)["class"][nearest]


def contents(conn: psycopg.Connection) -> dict[str, list[tuple[Any, ...]]]:
    """All that the stage writes, in a fixed order."""
    found = {
        table: conn.execute(f"SELECT {columns} FROM tunnel.{table} ORDER BY 1, 2, 3, 4").fetchall()
        for table, columns in MODELS.items()
    }
    found["point"] = conn.execute(POINTS).fetchall()
    conn.rollback()
    return found


def test_points_get_the_classes_of_the_truth(sections: psycopg.Connection, scan: Path) -> None:
    conn = sections
    assert not points(conn)[1].any()
    output = command("run", NAME, "--from", "ground", "--to", "ground").output
    assert "[2/2] ground km 13" in output
    xyz, found = points(conn)
    truth = truth_of(scan, xyz)
    ground = np.isin(truth, (FLOOR, RAIL))
    judged = truth != OUTLIER
    wrong = np.isin(found, (PointClass.GROUND, PointClass.RAIL)) != ground
    assert wrong[judged].mean() < 0.01
    assert (found[truth == LINING] == PointClass.LINING).mean() > 0.98
    assert (found[truth == OBJECT] == PointClass.OBJECT).mean() > 0.9
    assert (found != 0).all()
    metres = [n for (n,) in conn.execute("SELECT n FROM tunnel.ground ORDER BY n").fetchall()]
    assert metres == list(range(metres[0], metres[-1] + 1))
    assert abs(metres[0] - START) <= 1
    assert abs(metres[-1] - START - 40) <= 1
    assert conn.execute("SELECT count(*) FROM tunnel.cluster WHERE class = 68").fetchone()[0] >= 6


def test_the_ground_lies_where_it_was_put_and_begins_at_the_walls(sections: psycopg.Connection) -> None:
    conn = sections
    command("run", NAME, "--from", "ground", "--to", "ground")
    simulation = scene()
    rows = conn.execute(
        "SELECT g.n, ST_X(p.geom), ST_Y(p.geom), ST_Z(p.geom) FROM tunnel.ground g, ST_DumpPoints(g.geom) p ORDER BY 1, p.path"
    ).fetchall()
    there = simulation.tunnel.unroll(np.array(rows)[:, 1:])
    inside = (there.chainage > START) & (there.chainage < START + 40.0)
    inside &= np.abs(there.arc) > simulation.tunnel.section.floor_arc + 0.1
    assert np.quantile(np.abs(there.offset[inside]), 0.95) < 0.025  # ballast of 2 cm about it
    arcs = conn.execute(
        "SELECT arc_left, arc_right FROM tunnel.ground WHERE n BETWEEN %s AND %s ORDER BY n", [START + 1, START + 39]
    ).fetchall()
    conn.rollback()
    assert len(arcs) == 39
    foot = simulation.tunnel.section.floor_arc
    # arcs of the survey run along its own sections, a little shorter in the rounded corner
    np.testing.assert_allclose(np.array(arcs), np.tile([-foot, foot], (39, 1)), atol=0.06)


def test_a_rerun_gives_the_same_and_marks_what_rests_on_it(sections: psycopg.Connection) -> None:
    conn = sections
    coarse = "--set", "image.pixel=0.1"  # of detection it matters that it ran
    command("run", NAME, *coarse)
    before = contents(conn)
    assert stale(conn) == {}
    command("run", NAME, "--from", "ground", "--to", "ground")
    assert contents(conn) == before
    assert stale(conn) == {"detect": 2}
    command("run", NAME, "--from", "sections", "--to", "sections")
    assert stale(conn) == {"ground": 2, "detect": 2}
    command("run", NAME, "--from", "segments", *coarse)
    assert contents(conn) == before  # tagging carries classes on, and gives the rows the same order


def stale(conn: psycopg.Connection) -> Mapping[str, int]:
    rows = conn.execute("SELECT stage, count(*) FROM tunnel_api.stage_status WHERE stale GROUP BY stage").fetchall()
    conn.rollback()
    return dict(rows)


def test_points_on_target_spheres_are_theirs_once_it_runs_again(sections: psycopg.Connection) -> None:
    conn = sections
    command("run", NAME, "--from", "ground", "--to", "ground")
    xyz, before = points(conn)
    centre = xyz[np.flatnonzero(before == PointClass.OBJECT)[0]]
    survey = get_survey(conn, NAME)
    conn.execute(  # as found before there were segments
        "INSERT INTO tunnel.target_sphere (survey_id, km, number, scan_id, geom, radius, nominal, rms, sigma, coverage, points)"
        " VALUES (%s, 12, 1, 1, ST_SetSRID(ST_MakePoint(%s, %s, %s), %s), 0.2, 0.2, 0.001, 0.0001, 0.4, 100)",
        [survey.id, *centre.tolist(), survey.srid],
    )
    conn.commit()
    command("run", NAME, "--from", "ground", "--to", "ground")
    again, after = points(conn)
    np.testing.assert_array_equal(again, xyz)
    on_it = np.linalg.norm(xyz - centre, axis=1) <= 0.2
    assert on_it.sum() > 1
    assert (after[on_it] == PointClass.SPHERE).all()
    np.testing.assert_array_equal(load_scene(conn, survey, 12, 13).classes(xyz)[on_it], after[on_it])


def test_at_the_end_of_a_kilometre_neighbours_find_what_one_whole_shows(sections: psycopg.Connection) -> None:
    conn = sections
    command("run", NAME, "--from", "ground", "--to", "ground")
    survey = get_survey(conn, NAME)
    surface = load_surface(conn, survey)
    xyz, found = points(conn)
    whole = stage.compute_scene(xyz, surface, np.empty((0, 4)), settings())
    assert (whole.classes(xyz) == found).mean() > 0.999
    stored = load_ground(conn, survey, START, START + 40)
    assert whole.ground is not None
    assert stored is not None
    expected = whole.ground
    along, across = (grid.ravel() for grid in np.meshgrid(np.arange(START, START + 39.5, 0.25), np.arange(-4.0, 4.0, 0.1)))
    np.testing.assert_allclose(stored.height_at(along, across), expected.height_at(along, across), atol=0.002)
    # read back for points of any density, the models say the same
    assert (load_scene(conn, survey, 12, 13).classes(xyz) == found).mean() > 0.999


def test_a_tunnel_without_ground_has_none_and_all_of_it_is_lining(conn: psycopg.Connection, tmp_path: Path) -> None:
    simulation = scene(start_chainage=12_310.0, length=20.0, slope=0.0, people=0, equipment=0, section="circular")
    write(simulation, tmp_path)
    prepare(tmp_path, "profiler", start=12_310.0)
    command("run", NAME, "--to", "sections")
    low = conn.execute("SELECT min(ST_Z(geom)) FROM tunnel.point").fetchone()[0]
    conn.execute("DELETE FROM tunnel.point WHERE ST_Z(geom) < %s", [low + 1.5])
    conn.commit()
    command("run", NAME, "--from", "ground", "--to", "ground")
    _, found = points(conn)
    assert not (found == PointClass.GROUND).any()
    assert (found == PointClass.LINING).mean() > 0.8
    assert conn.execute("SELECT count(*) FROM tunnel.ground").fetchone() == (0,)


def test_killed_in_the_middle_nothing_changes(sections: psycopg.Connection, monkeypatch: pytest.MonkeyPatch) -> None:
    conn = sections
    command("run", NAME, "--from", "ground", "--to", "ground", "--km", 12)
    before = contents(conn)
    save = stage.save_clusters

    def kill(own: psycopg.Connection, *rest: Any) -> int:
        count = save(own, *rest)
        conn.execute("SELECT pg_terminate_backend(%s, 5000)", [own.info.backend_pid])
        conn.commit()
        return count

    monkeypatch.setattr(stage, "save_clusters", kill)
    assert "saved whole or not at all" in command("run", NAME, "--from", "ground", "--to", "ground", code=2).stderr
    assert contents(conn) == before
    left = conn.execute("SELECT count(*) FROM pg_class WHERE relname LIKE '%\\_new'").fetchone()
    assert left == (0,)
    states = conn.execute("SELECT km, outcome FROM tunnel_api.stage_status WHERE stage = 'ground' ORDER BY km").fetchall()
    assert states == [(12, "interrupted"), (13, "never")]


def test_detection_says_that_the_ground_is_wanting(sections: psycopg.Connection) -> None:
    message = command("run", NAME, "--from", "detect", code=2).stderr
    assert "--from ground" in message
