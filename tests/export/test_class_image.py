"""The image of classes of a survey made by hand: each pixel against the tunnel's own geometry."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import psycopg
import pytest
import rasterio
from click.testing import CliRunner
from numpy.typing import NDArray
from psycopg import sql
from support.example_objects import CORNER, FLOOR, HALF_FLOOR, THINGS

from tunneldb.classification.classes import PointClass
from tunneldb.cli.main import main


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


def image(folder: Path) -> list[str]:
    """Write the survey's images; returns their names."""
    result = CliRunner().invoke(main, ["image", "demo-2024", "-o", str(folder)])
    assert result.exit_code == 0, result.output
    return sorted(path.name for path in folder.iterdir())


def read(path: Path) -> tuple[NDArray[np.uint8], NDArray[np.float64], NDArray[np.float64]]:
    """Classes, chainages and arcs of an image's pixels."""
    with rasterio.open(path) as file:
        place = file.transform
        x, y = np.meshgrid(
            place.c + (np.arange(file.width) + 0.5) * place.a, place.f + (np.arange(file.height) + 0.5) * place.e
        )
        return file.read(1), x, y


def floor_arc(across: float) -> float:
    """Arc of a place on the floor, m right of the axis."""
    return float(np.sign(across) * (CORNER + HALF_FLOOR - abs(across)))


def test_each_pixel_shows_what_is_there(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    assert {"demo-2024-km012-class.tif", "demo-2024-km012-class.png"} <= set(image(tmp_path))
    classes, chainage, arc = read(tmp_path / "demo-2024-km012-class.tif")
    expected = np.where(np.abs(arc) < CORNER, int(PointClass.LINING), int(PointClass.GROUND))
    unsure = np.abs(np.abs(arc) - CORNER) < 0.15
    inner = np.abs(chainage - 12400) < 98
    for klass, at, across, length, width, low, high in THINGS:
        if klass == PointClass.APPENDAGE:  # on the wall: seen from the axis at this angle
            angle = np.arctan2(across, (low + high) / 2 - FLOOR)
            middle, half = 4.0 * angle, (high - low) / 2 * 1.1
        else:
            middle, half = floor_arc(across), width / 2
        off = np.maximum(np.abs(arc - middle) - half, np.abs(chainage - at) - length / 2)
        expected[off <= -0.05] = klass
        unsure |= np.abs(off) < 0.25
    sure = inner & ~unsure
    assert sure.mean() > 0.9
    wrong = sure & (classes != expected)
    assert not wrong.any(), np.unique(np.column_stack([expected[wrong], classes[wrong]]), axis=0)
    for klass in (PointClass.LINING, PointClass.GROUND, PointClass.OBJECT, PointClass.RAIL, PointClass.APPENDAGE):
        assert (classes[inner] == klass).any(), klass


def test_pixels_without_points_have_no_class(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    conn.execute("DELETE FROM tunnel.image WHERE block = 247")
    conn.commit()
    image(tmp_path)
    classes, chainage, _ = read(tmp_path / "demo-2024-km012-class.tif")
    gap = (chainage > 12350) & (chainage < 12400)
    assert (classes[gap] == 0).all()
    assert (classes[~gap] != 0).all()


@pytest.mark.parametrize("gone", [("ground", "lining"), ("section",)])
def test_before_stage_ground_there_is_no_image_of_classes(
    conn: psycopg.Connection, example: str, tmp_path: Path, gone: tuple[str, ...]
) -> None:
    for table in gone:
        conn.execute(sql.SQL("DELETE FROM tunnel.{}").format(sql.Identifier(table)))
    conn.commit()
    assert image(tmp_path) == [
        f"demo-2024-km012-{kind}.{end}" for kind in ("corrected", "offset", "raw", "state") for end in ("png", "tif")
    ]


def test_tunnel_without_ground_has_lining_and_things(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    """As where nobody could stand in it: nothing is called ground then."""
    conn.execute("DELETE FROM tunnel.ground")
    conn.commit()
    image(tmp_path)
    classes, _, arc = read(tmp_path / "demo-2024-km012-class.tif")
    assert not (classes == PointClass.GROUND).any()
    wall = np.abs(arc) < CORNER - 0.3
    assert (classes[wall] == PointClass.LINING).mean() > 0.98
