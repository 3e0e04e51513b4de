"""The desk shows images of other instruments: in their kinds, their place, their colours."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import psycopg
import pytest
from click.testing import CliRunner
from PIL import Image
from starlette.testclient import TestClient
from support.example_survey import NAME
from support.imported_image import SPOTS, STATED, TOP, WEST, strip, write
from web.conftest import SignIn

from tunneldb.cli.main import main
from tunneldb.raster.tiles import Tile

WORLD = 40075016.68557849


def imported(path: Path, kind: str, *options: object) -> None:
    done = CliRunner().invoke(main, ["image", "import", NAME, str(path), "--kind", kind, *map(str, options)])
    assert done.exit_code == 0, done.output


def shown_at(browser: TestClient, kind: str, zoom: int, chainage: float, arc: float) -> tuple[int, ...]:
    """Colour of a tile at a place."""
    side = WORLD / 2**zoom
    tile = Tile(zoom, int((chainage + WORLD / 2) // side), int((WORLD / 2 - arc) // side))
    answer = browser.get(f"/tiles/{NAME}/{kind}/{zoom}/{tile.column}/{tile.row}.png")
    assert (answer.status_code, answer.headers["content-type"]) == (200, "image/png"), answer.text
    image = np.asarray(Image.open(io.BytesIO(answer.content)).convert("RGBA"))
    step = (tile.east - tile.west) / 256
    return tuple(image[int((tile.north - arc) / step), int((chainage - tile.west) / step)].tolist())


def test_a_thermal_image_is_shown_in_its_place(signed_in: SignIn, conn: psycopg.Connection, tmp_path: Path) -> None:
    imported(write(tmp_path / "a.tif", strip(STATED), STATED, "°C"), "thermal", "--name", "night")
    browser = signed_in("viola_web")
    kinds = {kind["kind"]: kind for kind in browser.get(f"/api/surveys/{NAME}").json()["kinds"]}
    assert (kinds["imported_night"]["label"], kinds["imported_night"]["unit"]) == ("Imported: thermal, night", "°C")
    assert (kinds["imported_night"]["ramp"][0], kinds["imported_night"]["ramp"][-1]) == ("#000004", "#fcffa4")
    ends = browser.get(f"/api/surveys/{NAME}/colours/imported_night").json()
    assert ends["low"] == pytest.approx(10.0, abs=0.1)
    for zoom in (20, 22):
        for x, y in SPOTS:
            hot, cold = shown_at(browser, "imported_night", zoom, x, y), shown_at(browser, "imported_night", zoom, x + 1.0, y)
            assert hot[3] == cold[3] == 255
            assert hot[0] > 200
            assert cold[0] < 60
    far = [shown_at(browser, "imported_night", 15, x, y)[3] for x, y in SPOTS]
    assert far == [255] * len(SPOTS)


def test_a_photo_has_its_colours(signed_in: SignIn, conn: psycopg.Connection, tmp_path: Path) -> None:
    photo = np.zeros((3, 400, 600), np.uint8)
    photo[0, :, :300], photo[1, :, 300:], photo[2] = 200, 150, 30
    imported(write(tmp_path / "p.tif", photo, STATED, photometric="RGB"), "photo")
    browser = signed_in("viola_web")
    assert shown_at(browser, "imported_photo", 21, WEST + 3.0, TOP - 4.0) == (200, 0, 30, 255)
    assert shown_at(browser, "imported_photo", 21, WEST + 9.0, TOP - 4.0) == (0, 150, 30, 255)
    assert shown_at(browser, "imported_photo", 21, WEST + 14.0, TOP - 4.0)[3] == 0
    assert browser.get(f"/api/surveys/{NAME}/colours/imported_photo").json() == {"low": 0.0, "high": 255.0}


def test_an_image_that_does_not_exist_is_not_found(signed_in: SignIn) -> None:
    assert signed_in("viola_web").get(f"/tiles/{NAME}/imported_none/20/524450/524287.png").status_code == 404
