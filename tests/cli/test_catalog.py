"""Tunnels and surveys by the command line, and every way in which their files can be wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import psycopg
import pytest
from click.testing import CliRunner, Result

from tunneldb.cli.main import main

AXIS = "x,y,z\n500000,4640000,100\n500000,4640100,102\n500000,4640200,104\n"
TRAJECTORY = "time,x,y,z\n10,500001,4640010,101\n11,500001,4640100,103\n12,500001,4640190,104.5\n"
STATIONS = "scan_id,x,y,z\n1,500001,4640010,101\n2,500001,4640100,103\n"
REFERENCE = "range_m,intensity_db\n1,30\n5,25\n20,12\n"
ADD = [
    "survey",
    "add",
    "s",
    "--tunnel",
    "t",
    "--date",
    "2024-05-04",
    "--intensity",
    "Amplitude",
    "--intensity-kind",
    "amplitude",
]


def run(*arguments: str) -> Result:
    return CliRunner().invoke(main, [*arguments])


@pytest.fixture
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for name, text in {"axis": AXIS, "trajectory": TRAJECTORY, "stations": STATIONS, "reference": REFERENCE}.items():
        (tmp_path / f"{name}.csv").write_text(text)
    return tmp_path


@pytest.fixture
def tunnel(dsn: str, files: Path) -> Path:
    result = run("tunnel", "add", "t", "--srid", "25830", "--axis", "axis.csv", "--start-chainage", "950")
    assert result.exit_code == 0, result.stderr
    return files


def refused(result: Result, *parts: str) -> None:
    """One line on stderr, exit code 2, no traceback."""
    assert result.exit_code == 2, (result.stderr, result.exception)
    assert result.stderr.startswith("tunneldb: ")
    assert result.stderr.count("\n") == 1
    for part in parts:
        assert part in result.stderr


def test_a_tunnel_keeps_its_axis_as_given(tunnel: Path, conn: psycopg.Connection) -> None:
    row = conn.execute("SELECT srid, start_chainage, spacing, ST_AsEWKT(alignment) FROM tunnel.tunnel").fetchone()
    line = "SRID=25830;LINESTRING(500000 4640000 100,500000 4640100 102,500000 4640200 104)"
    assert row == (25830, 950.0, 10.0, line)
    assert "0+950.000" in run("tunnel", "list").stdout


def test_a_tunnel_in_local_coordinates(dsn: str, files: Path, conn: psycopg.Connection) -> None:
    result = run("tunnel", "add", "t", "--srid", "local", "--axis", "axis.csv")
    assert result.exit_code == 0, result.stderr
    assert conn.execute("SELECT srid, ST_SRID(alignment) FROM tunnel.tunnel").fetchone() == (0, 0)
    assert run("tunnel", "list").stdout.splitlines()[1].split()[:2] == ["t", "local"]
    refused(run("tunnel", "add", "u", "--srid", "somewhere", "--axis", "axis.csv"), "nor local")


def test_a_wrong_system_is_told_where_the_tunnel_is_added(dsn: str, files: Path) -> None:
    (files / "near.csv").write_text("x,y,z\n100,100,5\n200,150,6\n")
    assert "outside the area" in run("tunnel", "add", "t", "--srid", "25830", "--axis", "near.csv").stderr
    assert "outside the area" not in run("tunnel", "add", "u", "--srid", "local", "--axis", "near.csv").stderr
    assert "outside the area" not in run("tunnel", "add", "v", "--srid", "25830", "--axis", "axis.csv").stderr


def test_a_mobile_survey(tunnel: Path, conn: psycopg.Connection) -> None:
    result = run(*ADD, "--trajectory", "trajectory.csv", "--reference", "reference.csv")
    assert result.exit_code == 0, result.stderr
    poses = conn.execute(
        "SELECT time, ST_X(geom), ST_Y(geom), ST_Z(geom), ST_SRID(geom) FROM tunnel.pose ORDER BY 1"
    ).fetchall()
    assert poses[2] == (12.0, 500001.0, 4640190.0, 104.5, 25830)
    curve = conn.execute("SELECT range_m, intensity_db FROM tunnel.reference ORDER BY 1").fetchall()
    assert curve == [(1.0, 30.0), (5.0, 25.0), (20.0, 12.0)]
    assert conn.execute("SELECT platform, intensity_dimension FROM tunnel.survey").fetchone() == ("mobile", "Amplitude")


def test_a_static_survey(tunnel: Path, conn: psycopg.Connection) -> None:
    result = run(*ADD, "--stations", "stations.csv")
    assert result.exit_code == 0, result.stderr
    assert conn.execute("SELECT scan_id, ST_Z(geom) FROM tunnel.station ORDER BY 1").fetchall() == [(1, 101.0), (2, 103.0)]
    assert conn.execute("SELECT platform FROM tunnel.survey").fetchone() == ("static",)
    assert "s" in run("survey", "list").stdout


def test_a_survey_and_its_tunnel_are_removed_in_this_order(tunnel: Path, conn: psycopg.Connection) -> None:
    run(*ADD, "--stations", "stations.csv")
    refused(run("tunnel", "remove", "t"), "has surveys: s")
    assert CliRunner().invoke(main, ["survey", "remove", "s"], input="n\n").exit_code == 1
    assert conn.execute("SELECT count(*) FROM tunnel.survey").fetchone() == (1,)
    conn.rollback()
    assert run("survey", "remove", "s", "--yes").exit_code == 0
    assert run("tunnel", "remove", "t").exit_code == 0
    assert conn.execute("SELECT count(*) FROM tunnel.station").fetchone() == (0,)


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("", ["axis.csv is empty", "x,y,z"]),
        ("x|y|z\n1|2|3\n", ["no column x", "header is 'x|y|z'"]),
        ("x;y;z\n1;2;3\n", ["at least 2 points"]),
        ("x;y;z\n0,5;0,5;0\n1.000,5;2;3\n", ["line 3", "x is '1.000,5'"]),
        ("x,y\n0,0\n10,0\n", ["no heights", "tunneldb tunnel add t --srid 25830 --axis axis.csv SCAN..."]),
        ("x,x,y,z\n1,1,2,3\n", ["column x twice"]),
        ("x,y,z\n0,0,0\n", ["at least 2 points", "has 1"]),
        ("x,y,z\n0,0,0\n10,abc,0\n", ["line 3", "y is 'abc'"]),
        ("x,y,z\n0,0,0\n10,,0\n", ["line 3", "y is empty; fill it in, or remove the line"]),
        ("x,y,z\n0,0,0\n10,nan,0\n", ["line 3", "y is nan"]),
        ("x,y,z\n0,0,0\n10,0,-inf\n", ["line 3", "z is -inf"]),
        ("x,y,z\n0,0,0\n10,0\n", ["line 3", "2 values", "3 columns"]),
        ("x,y,z\n0,0,0\n\n10,0,0\n10,0,5\n", ["line 5", "same x,y"]),
        ("x,y,z\n0,0,0\n10,0,0\n5,0,0\n", ["line 4", "reverses"]),
    ],
)
def test_a_wrong_axis_is_refused(conn: psycopg.Connection, files: Path, text: str, parts: list[str]) -> None:
    (files / "axis.csv").write_text(text)
    refused(run("tunnel", "add", "t", "--srid", "25830", "--axis", "axis.csv"), "axis.csv", *parts)
    assert conn.execute("SELECT count(*) FROM tunnel.tunnel").fetchone() == (0,)


def test_an_axis_that_is_no_text_or_no_file(dsn: str, files: Path) -> None:
    (files / "axis.csv").write_bytes(b"x,y,z\n\xff\0\n")
    refused(run("tunnel", "add", "t", "--srid", "25830", "--axis", "axis.csv"), "not a text file; save the table as CSV UTF-8")
    refused(run("tunnel", "add", "t", "--srid", "25830", "--axis", "gone.csv"), "gone.csv: No such file")
    refused(run("tunnel", "add", "t", "--srid", "25830", "--axis", "."), "directory")


def test_a_byte_order_mark_and_other_columns_do_no_harm(dsn: str, files: Path) -> None:
    (files / "axis.csv").write_bytes(b"\xef\xbb\xbfname, x ,y,z\r\na,0,0,0\r\nb,100,0,1\r\n")
    assert run("tunnel", "add", "t", "--srid", "25830", "--axis", "axis.csv").exit_code == 0


@pytest.mark.parametrize(
    ("srid", "part"),
    [("4326", "not projected"), ("2263", "not metres"), ("123456", "does not know SRID 123456"), ("0", "does not know SRID 0")],
)
def test_an_srid_without_metres_is_refused(dsn: str, files: Path, srid: str, part: str) -> None:
    refused(run("tunnel", "add", "t", "--srid", srid, "--axis", "axis.csv"), part)


def test_names_and_spacings_that_will_not_do(tunnel: Path) -> None:
    refused(run("tunnel", "add", "t", "--srid", "25830", "--axis", "axis.csv"), "already")
    refused(run("tunnel", "add", "a/b", "--srid", "25830", "--axis", "axis.csv"), "'a/b'")
    refused(run("tunnel", "add", "u", "--srid", "25830", "--axis", "axis.csv", "--spacing", "7"), "7 m")
    refused(run("tunnel", "add", "u", "--srid", "25830", "--axis", "axis.csv", "--spacing", "-10"), "-10")
    refused(run("tunnel", "add", "u", "--srid", "25830", "--axis", "axis.csv", "--start-chainage", "nan"), "nan")
    refused(run("tunnel", "remove", "v"), "'v'")
    refused(run(*ADD[:2], "s", "--tunnel", "v", *ADD[5:], "--stations", "stations.csv"), "no tunnel 'v'", "has t")
    run(*ADD, "--stations", "stations.csv")
    refused(run(*ADD, "--stations", "stations.csv"), "survey 's' already")
    refused(run("survey", "remove", "x", "--yes"), "'x'", "has s")


def test_exactly_one_of_trajectory_and_stations(tunnel: Path) -> None:
    refused(run(*ADD), "exactly one of")
    refused(run(*ADD, "--stations", "stations.csv", "--trajectory", "trajectory.csv"), "exactly one of")


def test_intensity_and_its_kind_belong_together(tunnel: Path) -> None:
    base = ["survey", "add", "s", "--tunnel", "t", "--date", "2024-05-04", "--stations", "stations.csv", "--intensity-kind"]
    refused(run(*base, "amplitude"), "--intensity must name the dimension")
    assert run(*base, "none").exit_code == 0
    named = ["survey", "add", "named", *base[3:], "none", "--intensity", "Amplitude"]
    assert run(*named).exit_code == 0


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("time,x,y,z\n1,500001,4640010,101\n", ["at least 2 rows"]),
        ("time,x,y,z\n1,500001,4640010,101\n1,500001,4640020,101\n", ["line 3", "time 1 repeats"]),
        ("time,x,y,z\n2,500001,4640010,101\n1,500001,4640020,101\n", ["line 3", "time 1 is less"]),
        ("time,x,y,z\n1,500001,4640010,nan\n2,500001,4640020,101\n", ["line 2", "z is nan"]),
        (
            "time,x,y,z\n1,500090,4640010,101\n2,500090,4640020,101\n",
            ["never within 50 m", "in this tunnel, in its coordinate system", "90 m"],
        ),
        ("time,x,y,z\n1,1,1,1\n2,1,2,1\n", ["never within 50 m"]),
        ("time,x,y,z\n1,500001,4639990,101\n2,500001,4639999,101\n", ["no pose is between the ends"]),
    ],
)
def test_a_wrong_trajectory_is_refused(tunnel: Path, conn: psycopg.Connection, text: str, parts: list[str]) -> None:
    (tunnel / "trajectory.csv").write_text(text)
    refused(run(*ADD, "--trajectory", "trajectory.csv"), "trajectory.csv", *parts)
    assert conn.execute("SELECT count(*) FROM tunnel.survey").fetchone() == (0,)


def test_a_trajectory_that_runs_down_the_axis_is_noted_unless_that_is_said(tunnel: Path) -> None:
    rows = TRAJECTORY.splitlines()
    refused(run(*ADD, "--trajectory", "trajectory.csv", "--backwards"), "--backwards is wrong")
    positions = [row.split(",", 1)[1] for row in rows[:0:-1]]
    times = [row.split(",", 1)[0] for row in rows[1:]]
    text = "\n".join([rows[0], *(f"{time},{position}" for time, position in zip(times, positions, strict=True))])
    (tunnel / "trajectory.csv").write_text(text)
    assert run(*ADD, "--trajectory", "trajectory.csv", "--backwards", "--json").stdout.count("down the axis") == 0
    run("survey", "remove", "s", "--yes")
    noted = run(*ADD, "--trajectory", "trajectory.csv", "--json")
    assert (noted.exit_code, "m down the axis (--backwards confirms that)" in noted.stdout) == (0, True), noted.output


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("scan_id,x,y,z\n", ["no station"]),
        ("scan_id,x,y,z\n1.5,500001,4640010,101\n", ["line 2", "scan_id 1.5"]),
        ("scan_id,x,y,z\n2147483648,500001,4640010,101\n", ["line 2", "2147483647"]),
        ("scan_id,x,y,z\n1,500001,4640010,101\n2,500001,4640020,101\n1,500001,4640030,101\n", ["line 4", "scan_id 1"]),
        ("scan_id,x,y,z\n1,600001,4640010,101\n", ["never within 50 m"]),
        ("scan_id,x,y,z\n1,500000,4639940,101\n", ["never within 50 m", "60 m at the nearest, beyond its ends"]),
    ],
)
def test_wrong_stations_are_refused(tunnel: Path, text: str, parts: list[str]) -> None:
    (tunnel / "stations.csv").write_text(text)
    refused(run(*ADD, "--stations", "stations.csv"), "stations.csv", *parts)


def test_a_scanner_may_stand_before_the_portal(tunnel: Path, conn: psycopg.Connection) -> None:
    (tunnel / "stations.csv").write_text("scan_id,x,y,z\n1,500001,4639997,101\n")
    assert run(*ADD, "--stations", "stations.csv").exit_code == 0
    assert conn.execute("SELECT ST_Y(geom) FROM tunnel.station").fetchone() == (4639997,)


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("range_m,intensity_db\n1,30\n", ["at least 2 rows"]),
        ("range_m,intensity_db\n5,30\n1,20\n", ["line 3", "range_m 1 is less"]),
        ("range_m,intensity_db\n0,30\n1,20\n", ["line 2", "not positive"]),
        ("range_m,intensity_db\n1,30\n2,nan\n", ["line 3", "intensity_db is nan"]),
    ],
)
def test_a_wrong_reference_curve_is_refused(tunnel: Path, text: str, parts: list[str]) -> None:
    (tunnel / "reference.csv").write_text(text)
    refused(run(*ADD, "--stations", "stations.csv", "--reference", "reference.csv"), "reference.csv", *parts)


def test_a_long_trajectory_arrives_whole(tunnel: Path, conn: psycopg.Connection) -> None:
    count = 20_000
    chainage = np.linspace(1, 199, count)
    rows = [f"{i / 100},500001,{4640000 + c:.6f},101" for i, c in enumerate(chainage)]
    (tunnel / "trajectory.csv").write_text("\n".join(["time,x,y,z", *rows]))
    assert run(*ADD, "--trajectory", "trajectory.csv").exit_code == 0
    found = conn.execute("SELECT count(*), sum(time), avg(ST_Y(geom)) - 4640000 FROM tunnel.pose").fetchone()
    assert found == (count, pytest.approx(sum(i / 100 for i in range(count))), pytest.approx(chainage.mean(), abs=1e-5))
