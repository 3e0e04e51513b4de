"""Other images under findings: a thermal image of known contrasts, colours of known lightness, redrawn outlines."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import psycopg
import pytest
from affine import Affine
from click.testing import CliRunner
from shapely import contains_xy, from_wkb
from shapely.geometry import box
from support.example_survey import NAME
from support.imported_image import write

from tunneldb.cli.main import main
from tunneldb.pipeline.other_images import measure_kilometre
from tunneldb.raster.geotiff import RGB
from tunneldb.raster.grid import Grid
from tunneldb.store.images import ImageStore
from tunneldb.store.survey import get_survey

PIXEL = 0.05
WEST, TOP, COLUMNS, ROWS = 12295.0, 10.0, 4200, 400
PLACE = Affine(PIXEL, 0, WEST, 0, -PIXEL, TOP)


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


def outlines(conn: psycopg.Connection) -> dict[int, box]:
    rows = conn.execute("SELECT id, ST_AsBinary(unrolled) FROM tunnel.finding WHERE shape IS NULL ORDER BY id").fetchall()
    conn.rollback()
    return {number: from_wkb(bytes(wkb)) for number, wkb in rows}


def thermal(folder: Path, found: dict[int, box]) -> Path:
    """A strip of 11 °C, with each finding colder by 0.1 K times its place in the list; a little noise."""
    x = WEST + (np.arange(COLUMNS) + 0.5) * PIXEL
    y = TOP - (np.arange(ROWS) + 0.5) * PIXEL
    values = 11.0 + np.random.default_rng(5).normal(0.0, 0.05, (ROWS, COLUMNS))
    places = np.meshgrid(x, y)
    for n, outline in enumerate(found.values(), 1):
        values[contains_xy(outline, *places)] -= 0.1 * n
    return write(folder / "thermal.tif", values.astype(np.float32), PLACE, "°C")


def imported(folder: Path, found: dict[int, box]) -> None:
    done = CliRunner().invoke(main, ["image", "import", NAME, str(thermal(folder, found)), "--kind", "thermal"])
    assert done.exit_code == 0, done.output


def test_an_import_measures_the_findings_under_it(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    found = outlines(conn)
    imported(tmp_path, found)
    rows = conn.execute(
        "SELECT finding_id, image, kind, unit, contrast, relative_contrast FROM tunnel_api.finding_image ORDER BY finding_id"
    ).fetchall()
    assert rows
    place = {number: n for n, number in enumerate(found, 1)}
    for number, image, kind, unit, contrast, relative in rows:
        assert (image, kind, unit) == ("imported_thermal", "thermal", "°C")
        assert contrast == pytest.approx(-0.1 * place[number], abs=0.05)
        assert relative == pytest.approx(2.0 * place[number], rel=0.35)
    large = [number for number, outline in found.items() if outline.area > 0.1]
    assert set(large) <= {row[0] for row in rows}
    number = large[-1]
    text, most = conn.execute(
        "SELECT other_images, other_contrast FROM tunnel_api.leak WHERE id = %s"
        " UNION ALL SELECT other_images, other_contrast FROM tunnel_api.finding WHERE id = %s LIMIT 1",
        [number, number],
    ).fetchone()
    (value,) = (row[4] for row in rows if row[0] == number)
    assert text.startswith("thermal -")
    assert text.endswith(" K")
    assert float(text.split()[1]) == pytest.approx(value, abs=0.05)
    assert most == max(row[5] for row in rows if row[0] == number)


def test_nothing_is_said_of_an_outline_that_was_drawn_again(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    found = outlines(conn)
    imported(tmp_path, found)
    number = conn.execute("SELECT min(finding_id) FROM tunnel_api.finding_image").fetchone()[0]
    west, low, east, high = found[number].bounds
    conn.execute(
        "UPDATE tunnel_api.finding_unrolled SET geom = ST_MakeEnvelope(%s, %s, %s, %s, 0) WHERE id = %s",
        [west, low, east, high + 0.1, number],
    )
    conn.commit()
    asked = "SELECT other_images FROM tunnel_api.finding WHERE id = %s"
    assert conn.execute(asked, [number]).fetchone() == (None,)
    measure_kilometre(conn, get_survey(conn, NAME), 12)  # as the next detect does
    assert conn.execute(asked, [number]).fetchone()[0].startswith("thermal -")


def test_a_removed_image_takes_its_values_with_it(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    imported(tmp_path, outlines(conn))
    assert CliRunner().invoke(main, ["image", "remove", NAME, "thermal"]).exit_code == 0
    assert conn.execute("SELECT count(*) FROM tunnel.finding_image").fetchone() == (0,)


def test_colours_are_compared_by_lightness(conn: psycopg.Connection, example: str) -> None:
    survey = get_survey(conn, NAME)
    number, outline = max(outlines(conn).items(), key=lambda item: item[1].area)
    grid = Grid.covering(12, 0.02, -12.0, 12.0)
    block = int(outline.centroid.x // 50)
    x = 50.0 * block + (np.arange(grid.block_columns) + 0.5) * grid.pixel
    y = (grid.bottom + grid.rows - np.arange(grid.rows) - 0.5) * grid.pixel
    west, low, east, high = outline.bounds
    colours = np.full((grid.rows, grid.block_columns, 3), 119.0, np.float32)
    colours[np.ix_((y > low) & (y < high), (x > west) & (x < east))] = 94.0
    conn.execute("DELETE FROM tunnel.image WHERE kind = 'rgb'")
    ImageStore(conn, survey, [RGB]).save_colours(grid, block - grid.first_block, colours)
    measure_kilometre(conn, survey, 12)
    unit, contrast = conn.execute(
        "SELECT unit, contrast FROM tunnel_api.finding_image WHERE finding_id = %s AND image = 'rgb'", [number]
    ).fetchone()
    assert unit == "L*"
    assert contrast == pytest.approx(-10.0, abs=0.2)  # L* 50 and 40
    text = conn.execute("SELECT other_images FROM tunnel_api.finding WHERE id = %s", [number]).fetchone()[0]
    assert text == "rgb 10 L* darker"


def test_the_list_of_leaks_has_the_text(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    imported(tmp_path, outlines(conn))
    listed = CliRunner().invoke(main, ["leaks", NAME, "--json"])
    leaks = json.loads(listed.stdout)["leaks"]
    assert any((leak["other_images"] or "").startswith("thermal") for leak in leaks)
