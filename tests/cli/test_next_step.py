"""What is said where something is missing or misspelt: what it is, and what to type."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from pathlib import Path

import laspy
import numpy as np
import psycopg
import pyogrio
import pytest
import shapely
from click.testing import CliRunner
from pyproj import CRS
from support.axis_files import J_LANDXML

from tunneldb.cli.main import main


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


@pytest.fixture
def refused(dsn: str, example: str) -> Callable[..., str]:
    """Return a function that runs a command, which is refused, and returns what it says."""

    def run(*words: object) -> str:
        result = CliRunner().invoke(main, ["--dsn", dsn, *map(str, words)])
        assert result.exit_code == 2, result.output
        return result.stderr

    return run


@pytest.fixture
def empty(conn: psycopg.Connection, example: str) -> str:
    """Return the name of a survey of the example's tunnel that holds nothing."""
    conn.execute(
        "INSERT INTO tunnel.survey (name, tunnel_id, date, platform, intensity_kind, intensity_dimension, reference)"
        " SELECT 'empty', tunnel_id, date, 'unknown', 'reflectance', 'Reflectanze', 'none' FROM tunnel.survey WHERE name = %s",
        [example],
    )
    conn.commit()
    return "empty"


def test_before_load_all_verbs_send_to_load(refused: Callable[..., str], empty: str, tmp_path: Path) -> None:
    for words in (
        ["run", empty],
        ["image", empty, "-o", tmp_path],
        ["qgis", empty, "-o", tmp_path / "x.qgz"],
        ["report", empty, "-o", tmp_path / "x.html"],
    ):
        assert f"tunneldb load {empty} FILE..." in refused(*words), words


def test_a_tunnel_is_not_taken_for_a_survey(refused: Callable[..., str]) -> None:
    assert "'demo' is a tunnel; say which of its surveys: demo-2024" in refused("leaks", "demo")
    assert "there is no survey 'nowhere'" in refused("leaks", "nowhere")


def test_a_day_is_asked_for_in_words(refused: Callable[..., str]) -> None:
    said = refused("survey", "set", "demo-2024", "--date", "04.05.2024")
    assert "'04.05.2024' is no day as YYYY-MM-DD" in said
    assert "%" not in said


@pytest.mark.parametrize("place", ["12+3", "12+345,678"])
def test_a_station_is_asked_for_with_its_digits(refused: Callable[..., str], place: str) -> None:
    said = refused("leaks", "demo-2024", "--from", place)
    assert "three digits after the +" in said
    assert said.rstrip().endswith(f"not '{place}'")


def test_a_misspelt_dimension_is_mended_by_what_is_said(refused: Callable[..., str], empty: str, tmp_path: Path) -> None:
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.add_extra_dim(laspy.ExtraBytesParams("Reflectance", np.float32))
    header.add_crs(CRS(25830))
    las = laspy.LasData(header)
    las.x = las.y = las.z = np.zeros(10)
    las.write(tmp_path / "a.laz")
    said = refused("load", empty, tmp_path / "a.laz")
    assert "did you mean 'Reflectance'?" in said
    assert said.rstrip().endswith(": tunneldb survey set empty --intensity Reflectance")


ADVICE: list[tuple[str, str, str]] = [
    ("leaks demo", r"say which of its surveys: (\S+)", "leaks {0}"),
    ("leaks demo-2023", r"Did you mean '(\S+)'\?", "leaks {0}"),
    ("tunnel add demo --srid 25830 --axis no.csv", r"there is a tunnel 'demo' already: tunneldb (tunnel list)", "{0}"),
    ("leaks demo-2024 --format gpkg", r"add -o (leaks\.gpkg)", "leaks demo-2024 --format gpkg -o {0}"),
    ("leaks demo-2024 -o a.pdf", r"leaks are written as (\.csv), .* use one of these", "leaks demo-2024 -o a{0}"),
    ("leaks demo-2024 --clock 10-10", r"is one position; give two, as (10-2)", "leaks demo-2024 --clock {0}"),
    ("findings demo-2024 --count --from 0", r"leave out --from\b", "findings demo-2024 --count"),
    ("survey set demo-2024", r"nothing to set: give (--date)", "survey set demo-2024 {0} 2024-05-05"),
    ("status --watch", r"--watch is for one survey: tunneldb (status) SURVEY (--watch)", "status demo-2024"),
    (
        "profile add demo a.csv", r"remove one of them: tunneldb (profile remove demo) NAME (--layer lining)",
        "{0} round {1} && profile add demo a.csv",
    ),
    ("findings import demo-2024 a.gpkg", "it has no geometry; draw it, or delete the row", "findings import demo-2024 b.gpkg"),
    (
        "tunnel add x --srid 25830 --axis a.xml --reverse", "for stations that decrease along the alignment use --stationing",
        "tunnel add x --srid 25830 --axis a.xml --stationing s.csv",
    ),
    ("tunnel stationing demo", r"give either a FILE, or (--show)", "tunnel stationing demo {0}"),
    ("leaks demo-2024 --from 900+000", r"has no such station: tunneldb (tunnel stationing demo --show)", "{0}"),
]  # fmt: skip


def write_inputs() -> None:
    """Write a profile, and findings without and with a place."""
    shutil.copy(J_LANDXML, "a.xml")
    Path("s.csv").write_text("chainage,station,direction\n-90,1000,-1\n")
    Path("a.csv").write_text("right,up\n-3,-2\n-3,0\n0,4\n3,0\n3,-2\n")
    for name, place in (("a.gpkg", None), ("b.gpkg", shapely.to_wkb(shapely.Point(12350, 1)))):
        kind = np.array(["missing_bolt"], object)
        pyogrio.raw.write(name, np.array([place], object), [kind], ["kind"], geometry_type="Point", layer="a", crs=None)


@pytest.mark.filterwarnings("ignore:'crs' was not provided")
@pytest.mark.parametrize(("wrong", "advice", "right"), ADVICE, ids=[wrong for wrong, _, _ in ADVICE])
def test_what_a_message_says_is_typed(
    refused: Callable[..., str], dsn: str, wrong: str, advice: str, right: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    write_inputs()
    said = refused(*wrong.split())
    found = re.search(advice, said)
    assert found, said
    for command in right.format(*found.groups()).split(" && "):
        result = CliRunner().invoke(main, ["--dsn", dsn, *command.split()])
        assert result.exit_code == 0, result.stderr
