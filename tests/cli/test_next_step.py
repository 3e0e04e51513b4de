"""What is said where something is missing or misspelt: what it is, and what to type."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import laspy
import numpy as np
import psycopg
import pytest
from click.testing import CliRunner
from pyproj import CRS

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
