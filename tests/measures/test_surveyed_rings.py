"""The command ``rings``: real rings against their published results, and what is wrong of the files."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from tunneldb.cli.main import main

WRIGGLE = Path(__file__).parents[1] / "data" / "wriggle"
AXIS = "chainage,x,y,z\n" + "".join(f"{c},{c},0,0\n" for c in range(0, 60, 2))


def rings(*words: object) -> Result:
    return CliRunner().invoke(main, ["rings", *map(str, words)])


def table(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def lines(chainage: float = 20.0, ring: str = "1", points: int = 8, radius: float = 3.0) -> list[str]:
    """Rows of a level tunnel to the east: right is south."""
    clock = np.arange(points) * 2.0 * np.pi / points
    where = zip(clock, range(1, points + 1), strict=True)
    return [f"{ring},{k},{chainage:.4f},{-0.02 - radius * np.sin(a):.5f},{0.01 + radius * np.cos(a):.5f}" for a, k in where]


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    (tmp_path / "axis.csv").write_text(AXIS)
    return tmp_path / "points.csv", tmp_path / "axis.csv"


def measured(files: tuple[Path, Path], rows: list[str], *words: object, header: str = "ring,point,x,y,z") -> Result:
    files[0].write_text("\n".join([header, *rows]) + "\n")
    return rings("--points", files[0], "--axis", files[1], "--diameter", 6, *words)


@pytest.mark.slow
def test_real_rings_are_those_that_were_published(tmp_path: Path) -> None:
    out = tmp_path / "rings.csv"
    done = rings("--points", WRIGGLE / "points.csv", "--axis", WRIGGLE / "axis.csv", "--diameter", 5.8, "-o", out)
    assert done.exit_code == 0, done.output
    ours = {row["ring"]: row for row in table(out)}
    theirs = {str(int(float(row["RING NO."]))): row for row in table(WRIGGLE / "published.csv")}
    assert list(ours) == list(theirs)
    names = {"deviation_right": "dHz", "deviation_up": "dVt", "radius": "R_Average", "chainage": "CHAINAGE"}
    off = {
        ring: np.array([abs(float(row[name]) - float(theirs[ring][other])) for name, other in names.items()])
        for ring, row in ours.items()
    }
    assert {ring for ring, values in off.items() if (values[:3] > 0.001).any()} == {"0", "917"}
    moved = {ring for ring, values in off.items() if values[3] > 0.002}
    assert moved == {ring for ring, row in ours.items() if "along the tunnel" in row["remark"]}
    assert len(moved) == 14
    assert "point 5 rejected: 35.5 mm inside" in ours["0"]["remark"]
    assert float(ours["917"]["ovality"]) == pytest.approx(14.2, abs=0.2)


def test_a_ring_lies_where_it_was_put(files: tuple[Path, Path]) -> None:
    done = measured(files, lines(), "--sigma", 0.002, "--chord", "9:00-3:00")
    (row,) = csv.DictReader(done.stdout.splitlines())
    assert (float(row["chainage"]), float(row["deviation_right"]), float(row["deviation_up"])) == (20.0, 0.02, 0.01)
    assert (float(row["radius"]), float(row["chord_270_90"])) == (3.0, 6.0)
    assert float(row["radius_se"]) == pytest.approx(0.002 / np.sqrt(8), abs=1e-5)
    assert row["remark"] == ""
    assert list(row)[-4:] == ["circle_x", "circle_y", "circle_z", "circle_radius"]
    assert [float(row[name]) for name in list(row)[-4:]] == [20.0, -0.02, 0.01, 3.0]


@pytest.mark.parametrize(
    ("rows", "header", "said"),
    [
        (lines(), "ring,point,x,y,q", "has no column z"),
        ([], "ring,point,x,y,z", "has no point"),
        (lines(radius=3000.0), "ring,point,x,y,z", "in millimetres"),
        (lines(radius=6.0), "ring,point,x,y,z", "is 6 m the radius"),
        ([row.replace("20.0000", "20000") for row in lines()], "ring,point,x,y,z", "from the axis"),
        (lines(points=4), "ring,point,x,y,z", "only 4 points; a ring needs 5"),
        ([f"{row},30" for row in lines()], "ring,point,x,y,z,offset", "offsets are in metres"),
        ([*lines(), "1,9,a,0,0"], "ring,point,x,y,z", "line 10: x is 'a'"),
    ],
)
def test_what_is_wrong_as_a_whole_is_one_line(files: tuple[Path, Path], rows: list[str], header: str, said: str) -> None:
    done = measured(files, rows, header=header)
    assert done.exit_code == 2
    assert said in done.stderr
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("axis", "said"),
    [
        ("chainage,x,y,z\n0,0,0,0\n5,5,0,0\n4,9,0,0\n", "line 4: chainage 4 is less than"),
        (
            "chainage,x,y,z\n0,0,0,0\n10,10,0,0\n20,20000,0,0\n30,30,0,0\n40,40,0,0\n50,50,0,0\n",
            "line 4: 19990.000 m from the previous point",
        ),
        ("chainage,x,y,z\n0,0,0,0\n10,32.808,0,0\n", "the axis is 3.281 long in plan: are the points in feet?"),
        ("chainage,x,y,z\n0,0,0,0\n", "at least 2 points"),
    ],
)
def test_an_axis_that_is_none_is_refused(files: tuple[Path, Path], axis: str, said: str) -> None:
    files[1].write_text(axis)
    done = measured(files, lines())
    assert (done.exit_code, said in done.stderr) == (2, True), done.stderr


def test_what_is_wrong_of_one_ring_is_its_remark(files: tuple[Path, Path]) -> None:
    good = lines()
    rows = [*good, *lines(24, "few", 4), *lines(26, "twice"), lines(26, "twice")[0], *lines(28, "other"), "other,1,28,0,3.5"]
    rows += [*lines(500, "far"), *lines(30, "half", 16)[:8]]
    done = measured(files, rows, "--json")
    assert done.exit_code == 0, done.output
    said = json.loads(done.stdout)
    remarks = {row["ring"]: row["remark"] for row in said["rows"]}
    assert remarks["1"] == ""
    assert remarks["few"] == "only 4 points; a ring needs 5"
    assert remarks["twice"] == "point 1 occurs twice: counted once"
    assert remarks["other"] == "point 1 occurs twice, at different places"
    assert "m from the axis" in remarks["far"]
    assert "ellipse not determined" in remarks["half"]
    by_name = {row["ring"]: row for row in said["rows"]}
    assert by_name["few"]["radius"] is None
    assert (by_name["half"]["ovality"], by_name["half"]["radius"]) == (None, 3.0)
    assert (said["rings"], said["measured"]) == (6, 3)


def test_what_is_read_is_not_written_over(files: tuple[Path, Path]) -> None:
    done = measured(files, lines(), "-o", files[0])
    assert done.exit_code == 2
    assert "is what is read" in done.stderr
    assert measured(files, lines(), "--chord", "13:70-3:00").exit_code == 2
