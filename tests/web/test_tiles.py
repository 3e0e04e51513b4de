"""Tiles hold the values of the stored image in their place."""

from __future__ import annotations

import io

import numpy as np
import psycopg
import pytest
from PIL import Image
from starlette.testclient import TestClient
from support.coloured_image import ABOVE, BELOW, add_image_in_colour
from web.conftest import SignIn

from tunneldb.raster.tiles import SIZE, Tile

WORLD = 40075016.68557849  # circumference of the earth by which web maps divide their plane, m


def tile_at(zoom: int, chainage: float, arc: float) -> Tile:
    """Return the tile at a place, by the formula of web maps."""
    side = WORLD / 2**zoom
    return Tile(zoom, int((chainage + WORLD / 2) // side), int((WORLD / 2 - arc) // side))


def picture(browser: TestClient, kind: str, tile: Tile) -> np.ndarray:
    answer = browser.get(f"/tiles/demo-2024/{kind}/{tile.zoom}/{tile.column}/{tile.row}.png")
    assert (answer.status_code, answer.headers["content-type"]) == (200, "image/png"), answer.text
    return np.asarray(Image.open(io.BytesIO(answer.content)).convert("RGBA"))


@pytest.mark.parametrize("zoom", range(10, 24))
def test_a_tile_holds_its_place(zoom: int) -> None:
    tile = tile_at(zoom, 12350.0, -1.0)
    assert tile.west <= 12350.0 < tile.east
    assert tile.south < -1.0 <= tile.north
    assert tile.east - tile.west == pytest.approx(WORLD / 2**zoom)


def test_pixels_are_those_of_the_stored_image(signed_in: SignIn, conn: psycopg.Connection) -> None:
    """PostGIS reads the same values at the same places, by another library."""
    if conn.execute("SELECT FROM pg_available_extensions WHERE name = 'postgis_raster'").fetchone() is None:
        pytest.skip("no postgis_raster")
    conn.execute("CREATE EXTENSION postgis_raster SCHEMA public")
    browser = signed_in("viola_web")
    ends = browser.get("/api/surveys/demo-2024/colours/corrected").json()
    tile = tile_at(23, 12350.0, -1.0)
    image = picture(browser, "corrected", tile)
    rng = np.random.default_rng(1)
    rows, columns = rng.integers(0, SIZE, (2, 200))
    step = (tile.east - tile.west) / SIZE
    chainage, arc = tile.west + (columns + 0.5) * step, tile.north - (rows + 0.5) * step
    found = conn.execute(
        "SELECT value FROM tunnel_api.image_values('demo-2024', 'corrected', %s, %s) ORDER BY n",
        [chainage.tolist(), arc.tolist()],
    ).fetchall()
    value = np.array([row[0] for row in found], dtype=np.float64)
    assert np.isfinite(value).sum() > 100
    grey = np.clip(255 * (value - ends["low"]) / (ends["high"] - ends["low"]), 0, 255)
    shown = image[rows, columns]
    assert (shown[:, 3] == np.where(np.isfinite(value), 255, 0)).all()
    assert np.abs(shown[:, 0] - grey)[np.isfinite(value)].max() <= 1.0


@pytest.mark.parametrize("zoom", [14, 17, 19, 21])
def test_far_tiles_are_means(signed_in: SignIn, zoom: int) -> None:
    """A leak is darker than its surroundings at every scale at which it has some pixels; what is outside is transparent."""
    browser = signed_in("viola_web")
    tile = tile_at(zoom, 12350.0, -1.0)
    image = picture(browser, "corrected", tile)
    assert (image[..., 3] == 0).any() or zoom > 19
    assert image[image[..., 3] > 0][:, 0].std() > 0


def test_browser_keeps_a_tile_until_it_changes(signed_in: SignIn, conn: psycopg.Connection) -> None:
    browser = signed_in("viola_web")
    tile = tile_at(23, 12350.0, -1.0)
    path = f"/tiles/demo-2024/corrected/{tile.zoom}/{tile.column}/{tile.row}.png"
    first = browser.get(path)
    again = browser.get(path, headers={"If-None-Match": first.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")
    conn.execute("UPDATE tunnel.image i SET tiff = (SELECT tiff FROM tunnel.image o WHERE o.kind = 'raw' AND o.block = i.block)"
                 " WHERE kind = 'corrected'")  # fmt: skip
    conn.commit()
    changed = browser.get(path, headers={"If-None-Match": first.headers["etag"]})
    assert changed.status_code == 200
    assert changed.content != first.content


def test_nothing_where_there_is_no_image(signed_in: SignIn) -> None:
    tile = tile_at(20, 50_000.0, 0.0)
    assert signed_in("viola_web").get(f"/tiles/demo-2024/corrected/20/{tile.column}/{tile.row}.png").status_code == 204


@pytest.mark.parametrize("zoom", [13, 18, 22])
def test_findings_as_vector_tiles(signed_in: SignIn, conn: psycopg.Connection, zoom: int) -> None:
    """GDAL, another reader, finds the findings of the database in the tile."""
    import pyogrio

    rows = conn.execute(
        "SELECT id, chainage_from, arc_from FROM tunnel_api.finding WHERE counted ORDER BY area DESC LIMIT 1"
    ).fetchone()
    tile = tile_at(zoom, rows[1] + 0.01, rows[2] + 0.01)
    answer = signed_in("viola_web").get(f"/tiles/demo-2024/findings/{zoom}/{tile.column}/{tile.row}.mvt")
    assert answer.status_code == 200
    info = pyogrio.read_info(answer.content)
    assert info["features"] >= 1
    assert {"kind", "review", "probability", "wet"} <= set(info["fields"])


@pytest.mark.parametrize("zoom", [23, 18])
def test_tiles_in_colour(signed_in: SignIn, conn: psycopg.Connection, zoom: int) -> None:
    """A tile has the colours of the stored image; far away, those of its overview."""
    add_image_in_colour(conn, "demo-2024")
    browser = signed_in("viola_web")
    kinds = browser.get("/api/surveys/demo-2024").json()["kinds"]
    assert {"kind": "rgb", "label": "Colour", "unit": "", "signed": False, "ramp": []} in kinds
    assert browser.get("/api/surveys/demo-2024/colours/rgb").json() == {"low": 0, "high": 255}
    for place, colour in ((2.0, ABOVE), (-2.0, BELOW)):
        tile = tile_at(zoom, 12350.0, place)
        image = picture(browser, "rgb", tile)
        step = (tile.east - tile.west) / SIZE
        row, column = int((tile.north - place) // step), int((12350.0 - tile.west) // step)
        np.testing.assert_array_equal(image[row, column], [*colour, 255])
