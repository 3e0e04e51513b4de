"""The report's chapter on the design: it states what the views say, and its picture shows deviation where it is."""

from __future__ import annotations

import base64
import io
import re
from pathlib import Path

import numpy as np
import psycopg
from affine import Affine
from click.testing import CliRunner
from PIL import Image
from support.example_deviation import OVER, THICK, THIN, UNDER, UNEVEN, add_surfaces

from tunneldb.cli.main import main
from tunneldb.measures.deviation.rows import replace_image
from tunneldb.raster.geotiff import Raster
from tunneldb.store.survey import get_survey

PIXEL = 0.05


def test_the_chapter(example: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    survey = get_survey(conn, "demo-2024")
    values = np.full((400, 1000), np.nan, np.float32)
    values[100:300, :400] = -0.2  # 20 m outside, then 30 m inside
    values[100:300, 400:] = 0.2
    replace_image(conn, survey, 12, "lining", [Raster(values, Affine(PIXEL, 0, 12300.0, 0, -PIXEL, 10.0))])
    add_surfaces(conn, survey.id)
    conn.commit()
    page = tmp_path / "report.html"
    done = CliRunner().invoke(main, ["report", "demo-2024", "-o", str(page)])
    assert done.exit_code == 0, done.output
    chapter = page.read_text("utf-8").split('<section id="deviation">')[1].split("</section>")[0]

    figures = re.findall(r"<dd>([\d.\u202f]+)", chapter)
    assert [float(figure.replace("\u202f", "")) for figure in figures[:2]] == [200 * OVER, round(UNDER * sum(range(1, 201)), 2)]
    assert "never ran" in chapter
    # The metres with the greatest underbreak, 5 m apart.
    worst = re.findall(r"<figcaption>12\+(\d+\.\d+): [\d.]+ / ([\d.]+) m²", chapter)
    assert {round((float(at) - 299.5) * UNDER, 3) for at, _ in worst} == {float(under) for _, under in worst}
    assert max(float(at) for at, _ in worst) == 499.5
    assert f"exceeds 20 mm on {200 * UNEVEN:.1f} m²" in chapter
    (row,) = re.findall(r"<td>demo-2023</td>(.*?)</tr>", chapter)
    assert re.findall(r"<td class=\"n\">([^<]*)", row) == ["4\u202f500.0", "1\u202f500.00", f"{THICK:.3f}", f"{THIN:.3f}"]

    (address, *_) = re.findall(r'<img src="data:image/\w+;base64,([^"]+)" alt="12\+300', chapter)
    picture = np.asarray(Image.open(io.BytesIO(base64.b64decode(address)))).astype(int)
    across = picture[picture.shape[0] // 2]
    blue, red = (np.flatnonzero(np.abs(across - colour).max(axis=1) < 40) for colour in ((33, 102, 172), (178, 24, 43)))
    assert blue.max() < red.min()
    assert abs(len(blue) / len(red) - 20.0 / 30.3) < 0.05  # the gap beyond is filled
