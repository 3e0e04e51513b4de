"""`tunneldb register`: sonar scans of a canal tunnel from files to poses in the database."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import psycopg
import pytest
from click.testing import Result
from support.canal_scene import DEPTH, LEVEL, Canal, Sonar
from support.command import command
from support.databases import Copies

NAME = "canal"


@pytest.fixture(scope="module")
def canal(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[Sonar]]:
    folder = tmp_path_factory.mktemp(NAME)
    scene = Canal(77)
    scene.write_laser(folder / "laser.laz", scene.laser())
    scene.write_ladders(folder / "ladders.csv")
    scene.write_axis(folder / "axis.csv")
    scans = [scene.sonar(-2.0), scene.sonar(2.0)]
    for k, scan in enumerate(scans):
        np.savetxt(folder / f"s{k}.xyz", np.column_stack([scan.points, np.full(len(scan.points), 50)]), "%.4f")
    return folder, scans


@pytest.fixture(scope="module")
def template(copies: Copies, template: str, canal: tuple[Path, list[Sonar]]) -> Iterator[str]:
    """A database in which the laser's points are loaded, to be copied."""
    folder, _ = canal

    def fill() -> None:
        command("tunnel", "add", NAME, "--srid", 25832, "--axis", folder / "axis.csv")
        command("survey", "add", NAME, "--tunnel", NAME, "--date", "2026-05-04", "--no-poses", "--intensity-kind", "none")
        command("load", NAME, folder / "laser.laz", "--noise-points", 1)

    with copies.prepared(template, fill) as name:
        yield name


def register(folder: Path, *more: object, code: int = 0, up: str = "+z", level: float = LEVEL) -> Result:
    files = [folder / "s0.xyz", folder / "s1.xyz"]
    ladders = ["--ladders", folder / "ladders.csv", "--up", up, "--water-level", level]
    return command("register", NAME, *files, *ladders, *more, code=code)


@dataclass(frozen=True)
class Registered:
    """Database in which both scans are registered, what the command told, and its report."""

    name: str
    told: dict[str, Any]
    report: str


@pytest.fixture(scope="module")
def registered(copies: Copies, template: str, canal: tuple[Path, list[Sonar]]) -> Iterator[Registered]:
    folder, _ = canal
    told: list[str] = []
    report = folder / "report.md"

    def fill() -> None:
        told.append(register(folder, "--json", "--report", report).stdout)

    with copies.prepared(template, fill) as name:
        yield Registered(name, json.loads(told[0]), report.read_text("utf-8"))


@pytest.fixture
def after(copies: Copies, registered: Registered) -> Iterator[psycopg.Connection]:
    """Connection to a database in which both scans are registered; commands use it."""
    with copies.connected(registered.name) as conn:
        yield conn


POINTS = "SELECT count(*), sum(ST_Z(geom)), sum(chainage) FROM tunnel.point"


def test_poses_are_told_stored_and_shown(
    canal: tuple[Path, list[Sonar]], conn: psycopg.Connection, registered: Registered, after: psycopg.Connection
) -> None:
    folder, scans = canal
    before = conn.execute(POINTS).fetchone()
    conn = after
    told = registered.told
    assert [Path(scan["file"]).name for scan in told["scans"]] == ["s0.xyz", "s1.xyz"]
    for scan, true in zip(told["scans"], scans, strict=True):
        points = true.points[np.linalg.norm(true.points, axis=1) < 10.0][::50]
        mine = scan["scale"] * points @ np.array(scan["rotation"]).T + np.array(scan["translation"])
        assert np.percentile(np.linalg.norm(mine - true.to_tunnel(points), axis=1), 95) < 0.035
        assert np.array(scan["covariance"]).shape == (7, 7)
        assert (scan["state"], scan["undetermined"]) == ("determined", [])
    rows = conn.execute(
        "SELECT name, state, rotation, translation, scale, ST_X(geom), sigma_z, water_level"
        "  FROM tunnel_api.sonar_scan ORDER BY name"
    ).fetchall()
    for row, scan in zip(rows, told["scans"], strict=True):
        assert (row[0], row[1]) == (Path(scan["file"]).name, "determined")
        assert np.array_equal(row[2], np.ravel(scan["rotation"]))
        assert (row[3], row[4], row[5]) == (scan["translation"], scan["scale"], scan["translation"][0])
        assert row[6] == pytest.approx(np.sqrt(scan["covariance"][5][5]))
        assert row[7] == LEVEL
    residuals = conn.execute("SELECT DISTINCT scan, kind FROM tunnel_api.registration_residual").fetchall()
    assert set(residuals) == {(name, kind) for name in ("s0.xyz", "s1.xyz") for kind in ("wall", "ladder", "waterline", "scan")}
    assert conn.execute("SELECT array_agg(name ORDER BY name) FROM tunnel_api.ladder").fetchone() == (["L0", "L1"],)
    assert conn.execute(POINTS).fetchone() == before
    conn.rollback()
    assert "| s0.xyz | determined |" in registered.report
    assert "| L1 |" in registered.report
    again = json.loads(register(folder, "--json").stdout)
    assert again["scans"] == told["scans"]
    assert conn.execute("SELECT count(*) FROM tunnel.sonar_scan").fetchone() == (2,)
    conn.rollback()
    command("survey", "remove", NAME, "--yes")
    assert conn.execute("SELECT count(*) FROM tunnel.sonar_scan").fetchone() == (0,)


def test_points_are_loaded_with_their_poses_and_the_bed_is_where_it_is(
    canal: tuple[Path, list[Sonar]], after: psycopg.Connection, tmp_path: Path
) -> None:
    folder, _ = canal
    conn = after
    files = [folder / "s0.xyz", folder / "s1.xyz"]
    before = conn.execute(POINTS).fetchone()
    conn.rollback()
    told = json.loads(command("load", NAME, *files, "--json").stdout)["files"]
    assert [(one["name"], one["state"]) for one in told] == [("s0.xyz", "loaded"), ("s1.xyz", "loaded")]
    for one in told:
        assert one["points"] == one["noise"] + one["outside"] + one["thinned"] + one["kept"]
        assert 0.02 < one["noise"] / one["points"] < 0.06  # 3 % are false
    assert conn.execute(POINTS).fetchone() == before
    scene = Canal(77)
    rows = conn.execute("SELECT chainage, across, height, depth, sigma FROM tunnel_api.bed").fetchall()
    chainage, across, height, depth, sigma = np.array(rows).T
    # the axis begins at x = -30 of the scene; right of it is -y
    x, y = chainage - 30.0, -across
    near = (np.abs(x) < 6.0) & (np.abs(y) < 2.5)
    error = height[near] - (LEVEL - DEPTH + scene.bed.at(x[near], y[near]))
    assert np.median(np.abs(error)) < 0.02
    assert np.percentile(np.abs(error), 95) < 0.06  # a metre along, over which the bed waves by that much
    assert np.allclose(depth, LEVEL - height)
    assert (sigma > 0.0).all()
    assert near.sum() > 0.9 * 12 * 50
    k = int(np.flatnonzero(near)[0])
    found = conn.execute("SELECT depth FROM tunnel_api.depth(%s, %s, %s)", [NAME, chainage[k], across[k]]).fetchone()
    assert found == (depth[k],)
    assert conn.execute("SELECT depth FROM tunnel_api.depth(%s, 30, 50)", [NAME]).fetchone() in {(None,), None}
    volume = conn.execute("SELECT * FROM tunnel_api.bed_volume(%s, 26, 34, %s)", [NAME, LEVEL - DEPTH - 0.5]).fetchone()
    assert volume is not None
    above, below, _, seen, unseen = volume
    assert above == pytest.approx(0.5 * seen, rel=0.06)
    assert below < 0.01
    assert seen > 0.9 * 8 * 6.0
    assert unseen < 0.1 * seen
    conn.rollback()
    again = json.loads(command("load", NAME, *files, "--json").stdout)["files"]
    assert [one["state"] for one in again] == ["unchanged", "unchanged"]
    assert [one["kept"] for one in again] == [one["kept"] for one in told]
    register(folder)  # points of the poses before go, and the bed with them
    assert conn.execute("SELECT (SELECT count(*) FROM tunnel.sonar_point), (SELECT count(*) FROM tunnel.bed)").fetchone() == (
        0,
        0,
    )
    conn.rollback()
    changed = tmp_path / "s0.xyz"
    changed.write_text("1.0 2.0 3.0 4\n")
    assert "changed since it was registered" in command("load", NAME, changed, code=2).stderr


def test_what_cannot_be_registered_is_refused_and_nothing_stored(
    canal: tuple[Path, list[Sonar]], conn: psycopg.Connection, tmp_path: Path
) -> None:
    folder, _ = canal
    assert "check --up" in register(folder, code=2, up="-z").stderr
    assert "0.28 m below the water level" in register(folder, code=2, level=LEVEL + 0.28).stderr
    assert "no laser point is within" in register(folder, code=2, level=LEVEL + 20.0).stderr
    ladders = tmp_path / "ladders.csv"
    cases = {
        "ladder,rung,height,stile_gap,diameter\nA,1,0.0,0.32,0.035\nA,2,0.28,0.32,0.035\n": "2 rungs; 3 are the least",
        "ladder,rung,height,stile_gap,diameter\nA,1,0,320,35\nA,2,280,320,35\nA,3,560,320,35\n": "line 3: rung 2",
        "ladder,rung,height,stile_gap,diameter\nA,1,0,0.3,0.03\nA,2,0.28,0.4,0.03\nA,3,0.56,0.3,0.03\n": "line 3: stile_gap",
        "ladder,rung,height,stile_gap\nA,1,0,0.3\n": "no column diameter",
        "ladder,rung,height,stile_gap,diameter\n": "has no ladder",
    }
    for text, said in cases.items():
        ladders.write_text(text)
        files = [folder / "s0.xyz", "--ladders", ladders, "--up", "+z", "--water-level", LEVEL]
        assert said in command("register", NAME, *files, code=2).stderr
    twice = [folder / "s0.xyz", folder / "s0.xyz", "--ladders", folder / "ladders.csv", "--up", "+z", "--water-level", LEVEL]
    assert "known by its name" in command("register", NAME, *twice, code=2).stderr
    assert conn.execute("SELECT count(*) FROM tunnel.sonar_scan").fetchone() == (0,)


def test_speed_of_sound_and_place_may_be_told(
    canal: tuple[Path, list[Sonar]], conn: psycopg.Connection, tmp_path: Path
) -> None:
    folder, scans = canal
    slow = tmp_path / "slow.xyz"
    np.savetxt(slow, scans[0].points / 1.05, "%.4f")
    how = ["--ladders", folder / "ladders.csv", "--up", "+z", "--water-level", LEVEL]
    untold = command("register", NAME, slow, *how, "--json", code=1)
    assert "check the speed of sound" in untold.stderr
    assert json.loads(untold.stdout)["scans"][0]["state"] == "undetermined"
    start = tmp_path / "start.csv"
    x, y, _ = scans[0].translation
    start.write_text(f"file,x,y,within\nslow.xyz,{x + 1.0:.2f},{y - 1.0:.2f},2.0\n")
    told = command("register", NAME, slow, *how, "--sound-speed", "1400=1470", "--start", start, "--json")
    (scan,) = json.loads(told.stdout)["scans"]
    assert scan["scale"] == pytest.approx(1.05 * scans[0].scale, abs=0.002)
    assert np.linalg.norm(np.array(scan["translation"]) - scans[0].translation) < 0.03
    start.write_text(f"file,x,y,within\nslow.xyz,{x + 9.0:.2f},{y + 9.0:.2f},2.0\n")
    assert "has no pose" in command("register", NAME, slow, *how, "--sound-speed", "1400=1470", "--start", start, code=1).stderr
    for options, said in (
        (["--sound-speed", "1500"], "takes ASSUMED=MEASURED"),
        (["--sound-speed", "1.5=1447"], "1300 to 1700 m/s"),
        (["--sound-speed", "1500=nan"], "1300 to 1700 m/s"),
    ):
        assert said in command("register", NAME, slow, *how, *options, code=2).stderr
    for text, said in (
        ("file,x,y,within\nother.xyz,1,2,3\n", "other.xyz is none of the files"),
        ("file,x,y,within\nslow.xyz,1,2,0\n", "line 2: within is 0"),
        ("file,x,y,within\nslow.xyz,1,2,1\nslow.xyz,1,2,1\n", "line 3: file slow.xyz occurs twice"),
    ):
        start.write_text(text)
        assert said in command("register", NAME, slow, *how, "--start", start, code=2).stderr


def test_possible_poses_are_listed_pictured_and_chosen(
    canal: tuple[Path, list[Sonar]], conn: psycopg.Connection, tmp_path: Path
) -> None:
    folder, scans = canal
    how = ["--up", "+z", "--water-level", LEVEL]
    told = command("register", NAME, folder / "s0.xyz", *how, "--pictures", tmp_path, "--json", code=1)
    (scan,) = json.loads(told.stdout)["scans"]
    choices = scan["alternatives"]
    assert (scan["state"], scan["undetermined"]) == ("undetermined", ["along the tunnel"])
    likely = [one["probability"] for one in choices]
    assert len(likely) > 1
    assert likely == sorted(likely, reverse=True)
    assert sum(likely) <= 1.0 + 1e-9
    across = scans[0].to_tunnel(np.eye(3))[0] - scans[0].translation  # without a ladder only the place along is open
    for one in choices:
        assert np.array(one["rotation"])[:, 0] @ across / np.linalg.norm(across) > np.cos(np.radians(1.0))
    assert (tmp_path / "s0.png").read_bytes()[:4] == b"\x89PNG"
    x, y, _ = scans[0].translation
    azimuth = np.degrees(np.arctan2(*scans[0].rotation[:2, 0])) % 360.0
    start = tmp_path / "start.csv"
    how += ["--ladders", folder / "ladders.csv", "--start", start]
    start.write_text(f"file,x,y,within,azimuth\ns0.xyz,{x + 1.0:.1f},{y - 1.0:.1f},3.0,{azimuth:.0f}\n")
    (scan,) = json.loads(command("register", NAME, folder / "s0.xyz", *how, "--json").stdout)["scans"]
    assert scan["state"] == "determined"
    assert np.linalg.norm(np.array(scan["translation"]) - scans[0].translation) < 0.03
    start.write_text(f"file,x,y,within,azimuth\ns0.xyz,{x + 1.0:.1f},{y - 1.0:.1f},3.0,{azimuth - 180.0:.0f}\n")
    (scan,) = json.loads(command("register", NAME, folder / "s0.xyz", *how, "--json", code=1).stdout)["scans"]
    assert scan["state"] == "undetermined"


def test_soundings_in_the_tunnels_system_need_no_pose(
    canal: tuple[Path, list[Sonar]], conn: psycopg.Connection, tmp_path: Path
) -> None:
    _, scans = canal
    soundings = tmp_path / "soundings.xyz"
    points = np.vstack([scan.to_tunnel(scan.points[np.linalg.norm(scan.points, axis=1) < 10.0]) for scan in scans])
    np.savetxt(soundings, points, "%.4f")
    how = ["--medium", "water", "--water-level", LEVEL]
    assert "belong together" in command("load", NAME, soundings, *how[:2], code=2).stderr
    (told,) = json.loads(command("load", NAME, soundings, *how, "--json").stdout)["files"]
    assert (told["state"], told["points"]) == ("loaded", len(points))
    assert told["points"] == told["noise"] + told["outside"] + told["thinned"] + told["kept"]
    assert 0.02 < told["noise"] / told["points"] < 0.06  # 3 % are false
    chainage, across, height = np.array(conn.execute("SELECT chainage, across, height FROM tunnel_api.bed").fetchall()).T
    x, y = chainage - 30.0, -across
    near = (np.abs(x) < 6.0) & (np.abs(y) < 2.5)
    error = height[near] - (LEVEL - DEPTH + Canal(77).bed.at(x[near], y[near]))
    assert np.median(np.abs(error)) < 0.02
    row = "SELECT state, geom, translation, (SELECT min(sigma) > 0 FROM tunnel_api.bed) FROM tunnel_api.sonar_scan"
    assert conn.execute(row).fetchone() == ("given", None, None, True)
    conn.rollback()
    again = json.loads(command("load", NAME, soundings, *how, "--json").stdout)["files"]
    assert again[0]["state"] == "unchanged"
    np.savetxt(soundings, points[:, :2], "%.4f")
    assert "2 values, expected x, y and z" in command("load", NAME, soundings, *how, code=2).stderr
    np.savetxt(soundings, points + np.array([5000.0, 0.0, 0.0]), "%.4f")
    assert "is along the axis" in command("load", NAME, soundings, *how, code=2).stderr


@pytest.mark.usefixtures("after")
def test_a_registered_scan_is_not_loaded_as_soundings(canal: tuple[Path, list[Sonar]]) -> None:
    folder, _ = canal
    how = ["--medium", "water", "--water-level", LEVEL]
    assert "has been registered" in command("load", NAME, folder / "s0.xyz", *how, code=2).stderr
