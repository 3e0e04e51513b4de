"""The axis found in scan files by the command line: simulated ones against the simulator's line, and a real one."""

from __future__ import annotations

import json
from pathlib import Path

import laspy
import numpy as np
import psycopg
import pyogrio
import pytest
import shapely
from click.testing import CliRunner, Result
from PIL import Image
from scipy.spatial import cKDTree
from support.real_scans import real_scan

from tunneldb.arrays import Float
from tunneldb.cli.main import main
from tunneldb.geometry.alignment import Alignment
from tunneldb.simulate import Parameters, Simulation, write

CURVE = Parameters(
    name="bend", length=80, radius=300, straight=20, slope=4, section="horseshoe", scanner="profiler", density=30, leaks=0,
    profile_spacing=0.25, profile_points=300,
)  # fmt: skip


def run(*arguments: object) -> Result:
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


def done(*arguments: object) -> Result:
    result = run(*arguments)
    assert result.exit_code == 0, result.output
    return result


def refused(result: Result, *parts: str) -> None:
    assert result.exit_code == 2, (result.stderr, result.exception)
    assert result.stderr.startswith("tunneldb: ")
    assert result.stderr.count("\n") == 1
    for part in parts:
        assert part in result.stderr


@pytest.fixture(scope="module")
def bend(tmp_path_factory: pytest.TempPathFactory) -> tuple[Simulation, Path]:
    simulation = Simulation(CURVE)
    return simulation, write(simulation, tmp_path_factory.mktemp("bend"), truth=False).clouds[0]


def true_axis(simulation: Simulation) -> Float:
    line = simulation.tunnel.line
    return np.asarray(line.position(np.arange(line.start, line.end + 0.01, 0.05)))


def deviation(path: Path, truth: Float) -> tuple[Float, Float]:
    """Distance in plan and in height of an axis file, taken every half a metre, from a dense line, m."""
    found = np.loadtxt(path, delimiter=",", skiprows=1)
    vertices = Alignment.from_polyline(found, 0.0, 1.0).vertices[2:-2]
    distance, place = cKDTree(truth[:, :2]).query(vertices[:, :2])
    return distance, vertices[:, 2] - truth[place, 2]


def test_it_follows_the_simulators_line(bend: tuple[Simulation, Path], tmp_path: Path) -> None:
    simulation, scan = bend
    result = done("tunnel", "find-axis", scan, "-o", tmp_path / "a.csv", "--json")
    said = json.loads(result.stdout)
    distance, up = deviation(tmp_path / "a.csv", true_axis(simulation))
    assert distance.max() < 0.15
    # niches and rails are on it; its middle is halfway from floor to crown, and the line's is the arch's centre
    section = simulation.tunnel.section
    crown, floor = section.point(np.array([0.0, section.half_perimeter]))[0][:, 1]
    assert np.ptp(up) < 0.1
    assert abs(up.mean() - (crown + floor) / 2.0) < 0.3
    assert said["length"] == pytest.approx(80.0, abs=0.5)
    assert said["whole_sections"] == said["sections"]
    assert said["doubtful"] == []
    look = json.loads(done("inspect", scan, "--json").stdout)["files"][0]
    assert (said["width"], said["height"]) == (look["width"], look["height"])
    assert said["width"] == pytest.approx(
        np.ptp(section.point(np.linspace(-1, 1, 400) * section.half_perimeter)[0][:, 0]), rel=0.03
    )
    assert "chainage grows over" in result.stderr
    with Image.open(tmp_path / "a.png") as picture:
        assert min(picture.size) > 400


def test_a_tunnel_is_added_by_its_scan_alone(
    bend: tuple[Simulation, Path], dsn: str, conn: psycopg.Connection, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    simulation, scan = bend
    monkeypatch.chdir(tmp_path)
    add = ["tunnel", "add", "t", "--srid", CURVE.srid, "--axis"]
    refused(run(*add, "auto"), "--axis auto SCAN...")
    refused(run(*add, "auto", scan, "--alignment", "x"), "--alignment and --profile are for")
    refused(run(*[*add[:4], 3794], "--axis", "auto", scan), "its coordinate system is EPSG:25830", "the tunnel's is EPSG:3794")
    assert list(tmp_path.iterdir()) == []
    result = done(*add, "auto", scan, "--start-chainage", 500, "--reverse")
    assert "t.found-axis.csv, picture to check: t.found-axis.png" in result.stderr
    row = conn.execute("SELECT start_chainage, design, ST_AsText(ST_StartPoint(alignment)) FROM tunnel.tunnel").fetchone()
    assert row is not None
    assert row[:2] == (500.0, "the axis found in bend.laz")
    begin = np.loadtxt("t.found-axis.csv", delimiter=",", skiprows=1)[0]
    assert np.hypot(*(begin[:2] - true_axis(simulation)[-1, :2])) < 0.5  # the simulator's line runs east
    conn.rollback()
    refused(run(*add, "auto", scan), "there is a tunnel 't' already")


def test_a_line_drawn_in_plan_takes_heights_from_the_scan(
    bend: tuple[Simulation, Path], dsn: str, conn: psycopg.Connection, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    simulation, scan = bend
    monkeypatch.chdir(tmp_path)
    truth = true_axis(simulation)
    drawn = truth[100:-100:200, :2][::-1] + np.random.default_rng(3).uniform(-1.0, 1.0, (8, 2))
    pyogrio.raw.write(
        "drawn.gpkg", np.array([shapely.LineString(drawn).wkb], object), [], [], geometry_type="LineString", crs="EPSG:25830"
    )
    add = ["tunnel", "add", "t", "--srid", CURVE.srid, "--axis", "drawn.gpkg"]
    refused(run(*add), "drawn.gpkg: its line has no heights", "SCAN...")
    result = done(*add, scan)
    assert "drawn.gpkg: its middle and heights are from bend.laz" in result.stderr
    distance, up = deviation(tmp_path / "t.found-axis.csv", truth)
    assert distance.max() < 0.15
    assert np.ptp(up) < 0.1
    begin = np.loadtxt("t.found-axis.csv", delimiter=",", skiprows=1)[0]
    assert np.hypot(*(begin[:2] - drawn[0])) < 1.5
    (tmp_path / "space.csv").write_text("x,y,z\n0,0,0\n10,0,0\n")
    refused(run(*add[:2], "u", *add[3:6], "space.csv", scan), "space.csv has heights; SCAN files go with --axis auto")


def test_a_gallery_open_on_one_side_takes_its_axis_as_a_table(
    dsn: str, conn: psycopg.Connection, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    p = np.random.default_rng(6).uniform((0.0, -4.0, -3.0), (40.0, 4.0, 3.0), (60_000, 3))
    p[:20_000, 2], p[20_000:40_000, 2], p[40_000:, 1] = -3.0, 3.0, -4.0
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales, header.offsets = np.full(3, 0.001), np.array([500_000.0, 4_640_000.0, 100.0])
    las = laspy.LasData(header)
    las.x, las.y, las.z = (p + header.offsets).T
    las.write("open.las")
    add = ["tunnel", "add", "t", "--srid", 25830, "--axis"]
    refused(
        run(*add, "auto", "open.las"), "0 have two walls, a vault and a floor; ", " are open on one side", ": --axis axis.csv"
    )
    Path("axis.csv").write_text("x,y,z\n500000,4640000.5,99.5\n500040,4640000.5,99.5\n")
    done(*add, "axis.csv")
    done("survey", "add", "s", "--tunnel", "t", "--date", "2024-05-01", "--no-poses", "--intensity-kind", "none")
    done("load", "s", "open.las")
    done("run", "s", "--to", "sections")
    ends = conn.execute("SELECT count(*), max(abs(ST_Y(geom) - 4640000)) FROM tunnel.axis_vertex").fetchone()
    assert ends is not None
    assert ends[1] < 2.0  # inside the gallery


def test_files_of_two_systems_and_stray_points(
    bend: tuple[Simulation, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, scan = bend
    cloud = laspy.read(scan)
    for name, crs in (("feet", 2263), ("other", 3794)):
        header = laspy.LasHeader(point_format=6, version="1.4")
        header.add_crs(__import__("pyproj").CRS.from_epsg(crs))
        las = laspy.LasData(header)
        las.x, las.y, las.z = np.arange(3.0), np.arange(3.0), np.arange(3.0)
        las.write(tmp_path / f"{name}.las")
    out = tmp_path / "a.csv"
    refused(run("tunnel", "find-axis", tmp_path / "feet.las", "-o", out), "not metres; convert them by --unit us-ft")
    refused(run("tunnel", "find-axis", tmp_path / "feet.las", "--unit", "us-ft", "-o", out), "feet.las: no tunnel: ")
    refused(run("tunnel", "find-axis", scan, tmp_path / "other.las", "-o", out), "EPSG:3794", "EPSG:25830", "give files of one")
    refused(run("tunnel", "find-axis", tmp_path / "other.las", "-o", out), "other.las: no tunnel: ")
    assert not out.exists()
    header = laspy.LasHeader(point_format=0)
    header.scales = np.full(3, 0.01)
    las = laspy.LasData(header)
    las.x, las.y, las.z = (np.append(np.asarray(cloud[axis]), 0.0) for axis in "xyz")  # a point at the origin of the system
    las.write(tmp_path / "stray.las")
    done("tunnel", "find-axis", tmp_path / "stray.las", "-o", out)
    monkeypatch.chdir(tmp_path)
    done("tunnel", "find-axis", scan)  # calls it as the scan is called
    other = f"{scan.stem}.found-axis.csv"
    assert np.abs(np.loadtxt(out, delimiter=",", skiprows=1) - np.loadtxt(other, delimiter=",", skiprows=1)).max() < 0.05
    assert Path(other).with_suffix(".png").exists()


def test_a_real_tunnel(tmp_path: Path) -> None:
    """Its given axis is that of a track: the distance from it is the same all along."""
    scan, given = real_scan("ringo.laz"), real_scan("ringo.axis.csv")
    done("tunnel", "find-axis", scan, "-o", tmp_path / "a.csv")
    line = Alignment.from_polyline(np.loadtxt(given, delimiter=",", skiprows=1), 0.0, 0.1).vertices
    distance, up = deviation(tmp_path / "a.csv", line)
    assert np.abs(distance - np.median(distance)).max() < 0.3
    assert np.abs(up - np.median(up)).max() < 0.3
