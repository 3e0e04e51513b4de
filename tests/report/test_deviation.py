"""The report's chapter on the design: it states what the views say, and its picture shows deviation where it is."""

from __future__ import annotations

import io
import re
from pathlib import Path

import numpy as np
import psycopg
import pytest
from affine import Affine
from click.testing import CliRunner
from PIL import Image
from support.example_deviation import OVER, UNDER

from tunneldb.cli.main import main
from tunneldb.raster.geotiff import Raster
from tunneldb.report.deviation import colours, read_deviation
from tunneldb.store.deviation import replace_image
from tunneldb.store.survey import get_survey

PIXEL = 0.05


def test_the_chapter(example: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    survey = get_survey(conn, "demo-2024")
    values = np.full((400, 1000), np.nan, np.float32)
    values[100:300, :400] = -0.2  # 20 m outside, then inside
    values[100:300, 400:] = 0.2
    replace_image(conn, survey, 12, "lining", [Raster(values, Affine(PIXEL, 0, 12300.0, 0, -PIXEL, 10.0))])
    conn.commit()

    (layer,) = read_deviation(conn, survey, 12300.0, 12500.0, "JPEG")
    assert layer.whole["overbreak"] == pytest.approx(200 * OVER)
    assert layer.whole["underbreak"] == pytest.approx(UNDER * sum(range(1, 201)))
    assert sum(row["overbreak"] for row in layer.stretches) == pytest.approx(200 * OVER)
    assert layer.span == 0.1
    assert [drawn.row["chainage_from"] for drawn in layer.worst] == [12499.0 - 6 * n for n in range(5, -1, -1)]
    assert [drawn.exaggeration for drawn in layer.worst] == [10] * 6  # 0.1 m of 8 m at most
    (strip,) = layer.strips
    window = strip.picture.window
    assert (window.west, window.north, window.south) == (12300.0, pytest.approx(5.3), pytest.approx(-5.3))  # gaps are filled
    picture = np.asarray(Image.open(io.BytesIO(strip.picture.content))).astype(int)
    side = window.width / picture.shape[1]
    for at, colour in ((10.0, (33, 102, 172)), (30.0, (178, 24, 43)), (100.0, (255, 255, 255))):
        assert picture[picture.shape[0] // 2, round(at / side)] == pytest.approx(colour, abs=12)
    assert colours(np.array([[0.0, np.nan]], np.float32), 0.1).tolist() == [[[230, 230, 230], [255, 255, 255]]]

    page = tmp_path / "report.html"
    done = CliRunner().invoke(main, ["report", "demo-2024", "-o", str(page)])
    assert done.exit_code == 0, done.output
    chapter = page.read_text("utf-8").split('<section id="deviation">')[1].split("</section>")[0]
    assert re.findall(r"<dd>([\d.\u202f ]+)", chapter)[:2] == [f"{200 * OVER:.1f} ", f"{UNDER * sum(range(1, 201)):.1f} "]
    assert chapter.count("<img ") == 1
    assert "Kilometre 12 is out of date: never ran" in chapter
