"""The stages axis, segments and sections, and unrolling in SQL, on simulated tunnels whose geometry is known exactly."""

from __future__ import annotations

import csv
import re
import subprocess
import sys
import threading
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import numpy as np
import psycopg
import pytest
from click.testing import CliRunner
from support.command import command
from support.databases import Copies

from tunneldb.cli.main import main
from tunneldb.errors import UserError
from tunneldb.simulate import Parameters, Simulation, write
from tunneldb.stages.parameters import PARAMETERS
from tunneldb.stages.registry import STAGE_NAMES, STAGES
from tunneldb.stages.run import parse_km
from tunneldb.store.surface import load_surface
from tunneldb.store.survey import Survey, get_survey

NAME = "curve"
START = 960.0
LENGTH = 80.0
LINING = 0


def scan(folder: Path, section: str, seed: int) -> Simulation:
    """A tunnel at survey density, R 300 m and 4 % slope, over a kilometre's border, with a niche and appendages."""
    simulation = Simulation(
        Parameters(
            name=NAME,
            section=section,
            seed=seed,
            length=LENGTH,
            start_chainage=START,
            radius=300.0,
            straight=0.0,
            slope=4.0,
            scanner="profiler",
            density=100.0,
            leaks=0,
        )
    )
    write(simulation, folder)
    return simulation


def prepare(folder: Path) -> None:
    command("tunnel", "add", NAME, "--srid", 25830, "--axis", folder / f"{NAME}.axis.csv", "--start-chainage", START)
    command(
        "survey", "add", NAME, "--tunnel", NAME, "--date", "2024-05-04", "--trajectory", folder / f"{NAME}.trajectory.csv",
        "--intensity", "Amplitude", "--intensity-kind", "amplitude",
    )  # fmt: skip
    command("load", NAME, *sorted(folder.glob("*.laz")))


@pytest.fixture(scope="module", params=["circular", "horseshoe", "box"])
def scanned(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Simulation, Path]:
    folder = tmp_path_factory.mktemp(request.param)
    return scan(folder, request.param, seed=7), folder


def sample(simulation: Simulation, folder: Path, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Points of the lining with their true chainage, arc and offset, spread over the scan."""
    files = sorted(folder.glob("*.truth.npz"))
    truth = [np.load(path) for path in files]
    columns = {name: np.concatenate([t[name] for t in truth]) for name in ("chainage", "arc", "offset", "class")}
    lining = np.flatnonzero(columns["class"] == LINING)
    chosen = np.random.default_rng(0).choice(lining, count, replace=False)
    known = np.column_stack([columns[name][chosen].astype(float) for name in ("chainage", "arc", "offset")])
    return simulation.tunnel.to_space(*known.T), known


def run_as_advised(folder: Path) -> None:
    """Run what commands say that miss results, and repeat these commands."""
    table = folder / "points.csv"
    table.write_text("x,y,z\n0,0,0\n")
    unroll = ("unroll", NAME, table)
    unrolled = command(*unroll, code=2).stderr
    for words in (("axis", NAME), ("sections", NAME)):
        message = command(*words, code=2).stderr
        advice = re.search(r"tunneldb (run \S+ --to \w+)", message)
        assert advice, message
        command(*advice[1].split())
        command(*words)
    assert advice[0] in unrolled
    command(*unroll)


def test_accuracy(scanned: tuple[Simulation, Path], conn: psycopg.Connection) -> None:
    """The bounds of the method at R = 300 m and 4 %, and SQL = Python to 0.1 mm, there and back to 1 mm."""
    simulation, folder = scanned
    prepare(folder)
    run_as_advised(folder)
    survey = get_survey(conn, NAME)
    surface = load_surface(conn, survey)
    points, truth = sample(simulation, folder, 20_000)
    unrolled = surface.unroll(points)
    error = np.column_stack([unrolled.chainage, unrolled.arc, unrolled.offset]) - truth
    assert np.isnan(error).mean() < 0.001
    chainage, arc, offset = np.nanpercentile(np.abs(error), 95, axis=0)
    box = simulation.tunnel.section.name == "box"
    assert abs(np.nanmean(error[:, 1])) < 0.005
    assert arc < (0.030 if box else 0.010)
    assert chainage < 0.020
    assert offset < 0.010
    _sql_is_python(conn, survey, points[:300], unrolled.chainage[:300], unrolled.arc[:300], unrolled.offset[:300])
    back = surface.to_space(unrolled.chainage, unrolled.arc, unrolled.offset)
    assert np.nanmax(np.linalg.norm(back - points, axis=1)) < 0.001
    _no_jump(conn, survey)


def _sql_is_python(
    conn: psycopg.Connection, survey: Survey, points: np.ndarray, chainage: np.ndarray, arc: np.ndarray, offset: np.ndarray
) -> None:
    rows = conn.execute(
        "SELECT u.chainage, u.arc, u.offset,"
        "       ST_3DDistance(p.point, tunnel_api.roll(%(id)s, u.chainage, u.arc, u.offset))"
        "  FROM unnest(%(x)s::float8[], %(y)s::float8[], %(z)s::float8[]) WITH ORDINALITY AS v (x, y, z, i),"
        "       ST_SetSRID(ST_MakePoint(v.x, v.y, v.z), 25830) AS p (point), tunnel_api.unroll(%(id)s, p.point) u ORDER BY v.i",
        {"id": survey.id, **dict(zip("xyz", points.T.tolist(), strict=True))},
    ).fetchall()
    found = np.array([[np.nan if value is None else value for value in row] for row in rows])
    np.testing.assert_allclose(found[:, :3], np.column_stack([chainage, arc, offset]), atol=1e-4, equal_nan=True)
    assert np.nanmax(found[:, 3]) < 0.001


def _no_jump(conn: psycopg.Connection, survey: Survey) -> None:
    """The surface hardly moves from just before a segment's plane to just after it, at a kilometre's border too."""
    surface = load_surface(conn, survey)
    for plane in surface.ends[1:, 0]:
        low, high = surface.arc_range(plane)
        arc = np.linspace(low + 0.1, high - 0.1, 100)
        before = surface.to_space(np.full(100, plane - 1e-5), arc, np.zeros(100))
        after = surface.to_space(np.full(100, plane + 1e-5), arc, np.zeros(100))
        held = ~np.isnan(before[:, 0]) & ~np.isnan(after[:, 0])
        assert held.any()
        assert np.linalg.norm(before - after, axis=1)[held].max() < 0.003


@pytest.fixture(scope="module")
def curve_made(copies: Copies, template: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, Path]]:
    """A database with a circular tunnel up to its sections, to be copied, and the scan's folder."""
    folder = tmp_path_factory.mktemp("curve")
    scan(folder, "circular", seed=3)

    def fill() -> None:
        prepare(folder)
        command("run", NAME, "--to", "sections")

    with copies.prepared(template, fill) as name:
        yield name, folder


@pytest.fixture
def curve(copies: Copies, curve_made: tuple[str, Path]) -> Iterator[tuple[psycopg.Connection, Survey, Path]]:
    """Connection to a copy of it, the survey, and the scan's folder."""
    with copies.connected(curve_made[0]) as conn:
        survey = get_survey(conn, NAME)
        conn.rollback()
        yield conn, survey, curve_made[1]


def state(conn: psycopg.Connection) -> list[list[tuple[object, ...]]]:
    """All that the stages made, without keys and times."""
    queries = (
        "SELECT n, ST_AsEWKB(geom), points, source FROM tunnel.axis_vertex ORDER BY n",
        "SELECT n, km, chainage_from, chainage_to, vertex_from, tangent_to, points FROM tunnel.segment ORDER BY n",
        "SELECT segment, half, chainage, half_width, radius, arc, points FROM tunnel.section ORDER BY 1, 2",
        "SELECT segment, half, class, c.radius, slope, sigma, c.points, state FROM tunnel.section_class c"
        " JOIN tunnel.section s ON s.id = c.section_id ORDER BY 1, 2, 3",
        "SELECT km, chainage, segment, ST_AsEWKB(geom) FROM tunnel.point ORDER BY 1, 2, 4",
    )
    result = [conn.execute(query).fetchall() for query in queries]
    conn.rollback()
    return result


def test_a_rerun_gives_the_same(curve: tuple[psycopg.Connection, Survey, Path]) -> None:
    conn, _, _ = curve
    before = state(conn)
    command("run", NAME, "--to", "sections")
    for first, second in zip(before, state(conn), strict=True):
        assert first == second


def test_every_point_lies_between_the_planes_of_its_segment(curve: tuple[psycopg.Connection, Survey, Path]) -> None:
    conn, survey, _ = curve
    row = conn.execute(
        """
        SELECT count(*), count(s.n), min(q.before), min(q.after), max(abs(p.chainage - s.chainage_from
                 - (s.chainage_to - s.chainage_from) * q.before / (q.before + q.after)))
        FROM tunnel.point p LEFT JOIN tunnel.segment s ON s.survey_id = p.survey_id AND s.n = p.segment
        CROSS JOIN LATERAL (SELECT
            (ST_X(p.geom) - s.vertex_from[1]) * s.tangent_from[1] + (ST_Y(p.geom) - s.vertex_from[2]) * s.tangent_from[2]
                + (ST_Z(p.geom) - s.vertex_from[3]) * s.tangent_from[3] AS before,
            (s.vertex_to[1] - ST_X(p.geom)) * s.tangent_to[1] + (s.vertex_to[2] - ST_Y(p.geom)) * s.tangent_to[2]
                + (s.vertex_to[3] - ST_Z(p.geom)) * s.tangent_to[3] AS after) q
        WHERE p.survey_id = %s
        """,
        [survey.id],
    ).fetchone()
    total, tagged, before, after, difference = row
    assert tagged > 0.999 * total
    assert before > -1e-6
    assert after > -1e-6
    assert difference < 1e-6


def test_an_edited_vertex_stays_and_makes_stale(curve: tuple[psycopg.Connection, Survey, Path]) -> None:
    conn, survey, _ = curve
    conn.execute(
        "UPDATE tunnel_api.axis_vertex SET geom = ST_Translate(geom, 0.2, 0, 0) WHERE survey_id = %s AND n = 98", [survey.id]
    )
    moved = conn.execute("SELECT ST_AsEWKB(geom) FROM tunnel.axis_vertex WHERE n = 98").fetchone()
    conn.commit()
    stale = {
        (km, stage)
        for km, stage in conn.execute("SELECT km, stage FROM tunnel_api.stage_status WHERE stale AND survey = %s", [NAME])
    }
    assert {(0, "segments"), (0, "sections"), (1, "sections")} <= stale
    assert (1, "segments") not in stale  # the plane at its first vertex, 100, turns with 99 and 101 only
    conn.rollback()
    command("run", NAME, "--to", "sections")
    assert conn.execute("SELECT ST_AsEWKB(geom), source FROM tunnel.axis_vertex WHERE n = 98").fetchone() == (
        moved[0],
        "edited",
    )
    vertex = conn.execute("SELECT vertex_from[1] FROM tunnel.segment WHERE n = 98").fetchone()
    assert vertex == conn.execute("SELECT ST_X(geom) FROM tunnel.axis_vertex WHERE n = 98").fetchone()
    conn.rollback()


def test_wider_slabs_where_profiles_are_far_apart(conn: psycopg.Connection, tmp_path: Path) -> None:
    """Profiles 0.5 m apart: the slab of a section must widen until its classes fill."""
    simulation = Simulation(
        Parameters(
            name=NAME,
            section="horseshoe",
            length=60.0,
            start_chainage=START,
            radius=300.0,
            straight=0.0,
            scanner="profiler",
            profile_spacing=0.5,
            profile_points=1500,
            leaks=0,
            appendages=False,
            niches=False,
            outliers=0.0,
        )
    )
    write(simulation, tmp_path)
    prepare(tmp_path)
    command("run", NAME, "--to", "sections")
    widest, empty = conn.execute("SELECT max(half_width), sum(interpolated) FROM tunnel.section").fetchone()
    assert widest > 0.15
    assert empty < 0.1 * 72 * 12
    survey = get_survey(conn, NAME)
    points, truth = sample(simulation, tmp_path, 5000)
    unrolled = load_surface(conn, survey).unroll(points)
    assert np.nanpercentile(np.abs(unrolled.arc - truth[:, 1]), 95) < 0.015


def test_unroll_command(curve: tuple[psycopg.Connection, Survey, Path]) -> None:
    _, _, folder = curve
    simulation = Simulation(
        Parameters(
            name=NAME,
            section="circular",
            seed=3,
            length=LENGTH,
            start_chainage=START,
            radius=300.0,
            straight=0.0,
            slope=4.0,
            scanner="profiler",
            density=100.0,
            leaks=0,
        )
    )
    points = simulation.tunnel.to_space(np.array([980.0, 1010.0]), np.array([-3.0, 5.0]), np.zeros(2))
    table = folder / "points.csv"
    with table.open("w", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerows(
            [["name", "x", "y", "z"], *[[f"p{i}", *row] for i, row in enumerate(points.tolist())], ["far", 0, 0, 0]]
        )
    command("unroll", NAME, table, "-o", folder / "out.csv")
    with (folder / "out.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [row["name"] for row in rows] == ["p0", "p1", "far"]
    assert [float(row["chainage"]) for row in rows[:2]] == pytest.approx([980.0, 1010.0], abs=0.02)
    assert [float(row["arc"]) for row in rows[:2]] == pytest.approx([-3.0, 5.0], abs=0.01)
    assert [float(row["offset"]) for row in rows[:2]] == pytest.approx([0.0, 0.0], abs=0.01)
    assert (rows[2]["chainage"], rows[2]["arc"], rows[2]["offset"]) == ("", "", "")

    inverse = folder / "plane.csv"
    inverse.write_text("chainage,arc,offset\n" + "".join(f"{r['chainage']},{r['arc']},{r['offset']}\n" for r in rows[:2]))
    result = command("unroll", NAME, inverse, "--inverse")
    back = [list(map(float, line.split(",")[3:])) for line in result.output.splitlines()[1:]]
    np.testing.assert_allclose(back, points, atol=0.001)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("x,y\n1,2\n", "has no column z: the header is 'x,y'"),
        ("x,y,z\n1,2,three\n", "line 2: z is 'three', not a number"),
        ("x,y,z\n1,2,nan\n", "line 2: z is nan, not a plausible measurement"),
        ("x,y,z\n1,2\n", "line 2: 2 values, but the header has 3 columns"),
        ("", "is empty"),
        ("x,y,z,arc\n1,2,3,4\n", "already has the column arc"),
    ],
)
def test_unroll_of_bad_tables(conn: psycopg.Connection, tmp_path: Path, text: str, says: str) -> None:
    table = tmp_path / "points.csv"
    table.write_text(text)
    result = CliRunner().invoke(main, ["unroll", "nobody", str(table), "-o", str(tmp_path / "out.csv")])
    assert (result.exit_code, says in result.output) == (2, True), result.output
    assert not (tmp_path / "out.csv").exists()


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--km", "7"], "no points are loaded in kilometre 7; loaded: 0, 1"),
        (["--km", "7-9"], "no points are loaded in kilometre 7-9"),
        (["--km", "1-0"], "runs backwards"),
        (["--km", "one"], "--km needs a kilometre"),
        (["--from", "leaks"], "unknown stage 'leaks'"),
        (["--from", "sections", "--to", "axis"], "stage axis comes before sections"),
        (["--set", "section.angle=5"], "unknown parameter 'section.angle'"),
        (["--set", "section.angle_step=7"], "must divide 180"),
        (["--set", "section.angle_step=much"], "needs a number"),
        (["--set", "axis.half_width=99"], "out of bounds"),
    ],
)
def test_bad_runs(loaded_curve: psycopg.Connection, options: list[str], says: str) -> None:
    result = CliRunner().invoke(main, ["run", NAME, *options])
    assert (result.exit_code, says in result.output) == (2, True), result.output
    assert loaded_curve.execute("SELECT count(*) FROM tunnel.run WHERE stage <> 'load'").fetchone() == (0,)


@pytest.fixture
def loaded_curve(conn: psycopg.Connection) -> psycopg.Connection:
    """A survey with a handful of points in two kilometres."""
    conn.execute(
        "INSERT INTO tunnel.tunnel (name, srid, start_chainage, alignment)"
        " VALUES (%s, 25830, 0, ST_GeomFromEWKT('SRID=25830;LINESTRING Z (0 0 0, 0 2000 0)'))",
        [NAME],
    )
    survey = conn.execute(
        "INSERT INTO tunnel.survey (tunnel_id, name, date, intensity_kind, platform)"
        " SELECT id, name, '2024-05-04', 'none', 'mobile' FROM tunnel.tunnel RETURNING id"
    ).fetchone()[0]
    for km in (0, 1):
        conn.execute("SELECT tunnel_internal.partition_new(%s, %s)", [survey, km])
        conn.execute("SELECT tunnel_internal.partition_swap(%s, %s)", [survey, km])
    conn.commit()
    return conn


def test_a_range_takes_the_kilometres_that_are_there() -> None:
    assert parse_km("511-512", [510, 511]) == [511]
    assert parse_km("0-9", [1, 3, 12]) == [1, 3]
    assert parse_km(None, [1, 3]) == [1, 3]
    assert parse_km("-2", [-3, -2, 2]) == [-2]
    assert parse_km("-3--2", [-3, -2, 2]) == parse_km("-9-1", [-3, -2, 2]) == [-3, -2]
    with pytest.raises(UserError, match="backwards"):
        parse_km("-2--3", [-3, -2])


def test_too_few_points_is_one_line(loaded_curve: psycopg.Connection) -> None:
    result = CliRunner().invoke(main, ["run", NAME])
    assert result.exit_code == 2
    assert "kilometre 0 has too few points" in result.output
    row = loaded_curve.execute("SELECT stage, km, outcome, message FROM tunnel.run").fetchall()
    assert [r[:3] for r in row] == [("axis", 0, "failed")]
    assert "too few points" in row[0][3]
    assert loaded_curve.execute("SELECT count(*) FROM tunnel.axis_vertex").fetchone() == (0,)


def test_readers_see_the_old_kilometre_until_the_new_one_is_whole(curve: tuple[psycopg.Connection, Survey, Path]) -> None:
    """While a stage is under way in one transaction, others read what was there before, and wait for nothing."""
    conn, survey, _ = curve
    dsn = conn.info.dsn
    before = conn.execute("SELECT count(*), sum(points) FROM tunnel.section").fetchone()
    conn.rollback()
    with psycopg.connect(dsn) as worker, psycopg.connect(dsn) as reader:
        worker.execute("SELECT tunnel_internal.section_build(%s, 0, 10.0)", [survey.id])
        assert reader.execute("SELECT count(*), sum(points) FROM tunnel.section").fetchone() == before
        worker.rollback()
        assert reader.execute("SELECT count(*), sum(points) FROM tunnel.section").fetchone() == before


def test_a_killed_stage_leaves_what_was_there(curve: tuple[psycopg.Connection, Survey, Path]) -> None:
    conn, _, _ = curve
    dsn = conn.info.dsn
    before = state(conn)
    for delay in (0.05, 0.2, 0.5):
        killer = threading.Timer(delay, _kill_others, [dsn])
        killer.start()
        CliRunner().invoke(main, ["run", NAME, "--to", "sections", "--set", "section.angle_step=10"])
        killer.join()
    command("run", NAME, "--to", "sections")
    with psycopg.connect(dsn) as fresh:
        for first, second in zip(before, state(fresh), strict=True):
            assert first == second


def _kill_others(dsn: str) -> None:
    with psycopg.connect(dsn, autocommit=True) as killer:
        killer.execute(
            "SELECT pg_terminate_backend(pid) FROM pg_stat_activity"
            " WHERE datname = current_database() AND pid <> pg_backend_pid() AND application_name = 'tunneldb'"
            "   AND query ~ 'tunnel_(api|internal)'"
        )


def test_shapes_there_and_back(curve: tuple[psycopg.Connection, Survey, Path]) -> None:
    """A polygon with a hole laid on the surface and back; its area on the map strip is that of the unrolled plane."""
    conn, survey, _ = curve
    ring = "(980 2, 983 2, 983 4, 980 4, 980 2)", "(981 2.5, 982 2.5, 982 3, 981 2.5)"
    plane = f"POLYGON ({ring[0]}, {ring[1]})"
    rolled, back, mapped, holes = conn.execute(
        """
        SELECT ST_ZMax(r.rolled) - ST_ZMin(r.rolled), ST_HausdorffDistance(tunnel_api.unroll_shape(%(id)s, r.rolled), p.plane),
               ST_Area(m.mapped) / ST_Area(p.plane), ST_NumInteriorRings(r.rolled)
        FROM (SELECT ST_GeomFromText(%(plane)s) AS plane) p, LATERAL (SELECT tunnel_api.roll(%(id)s, p.plane) AS rolled) r,
             LATERAL (SELECT tunnel_api.map_strip(%(id)s, p.plane) AS mapped) m
        """,
        {"id": survey.id, "plane": plane},
    ).fetchone()
    assert rolled > 0.5
    assert back < 0.001
    assert mapped == pytest.approx(1 - 3 / 300, abs=0.003)  # inside of a right-hand curve of R 300 m, 3 m off the axis
    assert holes == 1
    outside = "LINESTRING (980 2, 2000 2)"
    assert conn.execute("SELECT tunnel_api.roll(%s, ST_GeomFromText(%s))", [survey.id, outside]).fetchone() == (None,)
    with pytest.raises(psycopg.errors.RaiseException, match="not a MULTIPOINT"):
        conn.execute("SELECT tunnel_api.roll(%s, ST_GeomFromText('MULTIPOINT (1 1)'))", [survey.id])


@pytest.mark.parametrize(("stage", "says"), [("segments", "has no axis yet"), ("sections", "has no segments yet")])
def test_a_stage_whose_forerunner_is_missing(loaded_curve: psycopg.Connection, stage: str, says: str) -> None:
    result = CliRunner().invoke(main, ["run", NAME, "--km", "1", "--from", stage, "--to", stage])
    assert (result.exit_code, says in result.output) == (2, True), result.output


def test_each_stage_reads_earlier_ones_and_is_done_by_a_function_that_is_there() -> None:
    for n, stage in enumerate(STAGES):
        assert {*stage.reads, *stage.reads_beside} <= {*STAGE_NAMES[:n], "survey", "sonar", "learned"}
        assert set(stage.reads_beside) <= set(stage.reads)
        if stage.function:
            module, _, name = stage.function.partition(":")
            assert callable(getattr(import_module(module), name))


def test_each_parameter_is_of_one_stage() -> None:
    prefixes = [prefix for stage in STAGES for prefix in stage.parameters]
    assert sorted(prefixes) == sorted({name.partition(".")[0] for name in PARAMETERS})


def test_showing_the_stages_imports_nothing_that_computes() -> None:
    code = "import sys, tunneldb.stages.registry; sys.exit(any(name in sys.modules for name in ('numpy', 'numba', 'psycopg')))"
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0
