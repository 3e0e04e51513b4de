"""The chapter on images of other instruments: table, warnings, and pictures in their place."""

from __future__ import annotations

import base64
import io
import re
from pathlib import Path

import numpy as np
import psycopg
import pytest
from click.testing import CliRunner
from PIL import Image
from support.example_survey import NAME
from support.imported_image import SPOTS, STATED, strip, write

from tunneldb.cli.main import main


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


def run(*words: object) -> None:
    done = CliRunner().invoke(main, [str(word) for word in words])
    assert done.exit_code == 0, done.output


def chapter(path: Path) -> str:
    page = path.read_text("utf-8")
    return page.split('<section id="imported">')[1].split("</section>")[0]


def test_pictures_show_values_in_their_place(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    values = strip(STATED)
    values[:, :100] = np.nan
    run("image", "import", NAME, write(tmp_path / "a.tif", values, STATED, "°C"), "--kind", "thermal")
    run("report", NAME, "-o", tmp_path / "r.html")
    said = chapter(tmp_path / "r.html")
    assert "10.00 to 18" in said or "10.00 to 17" in said
    assert "a.tif" in said
    strips = re.findall(r'<image x="0" y="0" width="([\d.]+)" height="([\d.]+)".*?base64,([^"]+)"', said)
    assert len(strips) >= 2
    titles = re.findall(r"<figcaption><b>12\+(\d+)", said)
    seen = 0
    for start, (width, height, content) in zip(titles, strips, strict=True):
        west = 12000.0 + float(start)
        picture = np.asarray(Image.open(io.BytesIO(base64.b64decode(content))).convert("RGB")).astype(int)
        rows, columns = picture.shape[:2]
        north = float(height) / 2  # the section is symmetric
        for x, y in SPOTS:
            if west < x < west + float(width) - 1.2:
                row = int((north - y) / float(height) * rows)
                hot, cold = (picture[row, int((at - west) / float(width) * columns)] for at in (x, x + 1.0))
                assert hot[0] > 180, (x, y)
                assert cold[0] < 80, (x, y)
                seen += 1
    assert seen >= 4


def test_the_chapter_needs_an_image(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    run("report", NAME, "-o", tmp_path / "r.html")
    assert '<section id="imported">' not in (tmp_path / "r.html").read_text("utf-8")
    photo = np.full((3, 400, 600), 120, np.uint8)
    run("image", "import", NAME, write(tmp_path / "p.tif", photo, STATED, photometric="RGB"), "--kind", "photo")
    (tmp_path / "owner.toml").write_text('language = "de"\nchapters = ["imported"]\n', "utf-8")
    run("report", NAME, "-o", tmp_path / "r.html", "--template", tmp_path / "owner.toml")
    assert "Bilder anderer Geräte" in chapter(tmp_path / "r.html")
