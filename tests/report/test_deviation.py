"""The chapter on design and deviation, on the example survey and its rows."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import psycopg
from click.testing import CliRunner
from support.example_deviation import GAP, OVER, THICK, UNDER, add_surfaces
from support.example_survey import example_surface

from tunneldb.cli.main import main
from tunneldb.raster.geotiff import Raster, encode
from tunneldb.raster.grid import Grid


def test_it_states_volumes_images_and_the_worst_sections(example: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    (survey,) = conn.execute("SELECT id FROM tunnel.survey WHERE name = %s", (example,)).fetchone()
    add_surfaces(conn, survey)
    arcs = example_surface()[0].arcs
    grid = Grid.covering(12, 0.1, float(arcs.min()), float(arcs.max()), 0, (12300.0, 12500.0))
    for block in range(grid.blocks):
        values = np.full((grid.rows, grid.block_columns), 0.01, np.float32)
        raster = Raster(values, grid.transform(block * grid.block_columns))
        conn.execute(
            "INSERT INTO tunnel.image (survey_id, km, kind, block, tiff) VALUES (%s, 12, 'deviation_lining', %s, %s)",
            (survey, grid.first_block + block, encode(raster, "deviation_lining")),
        )
    conn.commit()
    path = tmp_path / "r.html"
    done = CliRunner().invoke(main, ["report", example, "-o", str(path)])
    assert done.exit_code == 0, done.output
    (chapter,) = re.findall(r'<section id="deviation">.*?</section>', path.read_text("utf-8"), re.DOTALL)
    said = re.sub(r"<[^>]+>|\s+", " ", chapter)
    assert f"{200 * OVER:.2f}" in said
    assert f"{UNDER * sum(range(1, 201)):.2f}" in said
    assert "90.0 %" in said
    assert chapter.count('<figure class="deviation-strip">') == 2
    assert chapter.count("viewBox") == 1 + 8  # the plot, and four sections each of over- and underbreak
    assert f"over {1000 * GAP:.0f} mm on 100.0 m² of 4" in said
    assert f"demo-2023 4 500.0 1 500.00 {THICK:.3f} 0.150" in re.sub(r" +", " ", said.replace("\N{NARROW NO-BREAK SPACE}", " "))
