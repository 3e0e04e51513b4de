"""The command ``rings`` on a survey whose lining is known, over the end of a kilometre."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import openpyxl
import psycopg
import pyogrio
import pyogrio.raw
import pytest
import shapely
from click.testing import CliRunner, Result
from support.straight_survey import FIRST, LAST, RADIUS, Scene, make_survey

from tunneldb.cli.main import main
from tunneldb.raster.geotiff import Raster, encode
from tunneldb.raster.grid import Grid
from tunneldb.raster.state import PixelState

PIXEL, HIDDEN = 0.05, 9.0
JOINT, STEP = 1000.7, 0.012
"""The ring behind this chainage and all that follow stand in by so much, m."""

LENGTH = 1.7
CIRCLE = ["circle_x", "circle_y", "circle_z", "circle_radius"]


@pytest.fixture
def survey(conn: psycopg.Connection) -> str:
    make_survey(conn, Scene("straight"))
    row = conn.execute("SELECT id FROM tunnel.survey").fetchone()
    assert row is not None
    random = np.random.default_rng(1)
    for km in (0, 1):
        grid = Grid.covering(km, PIXEL, -np.pi * RADIUS, np.pi * RADIUS, 0, (FIRST, LAST))
        for block in range(grid.blocks):
            columns = slice(block * grid.block_columns, (block + 1) * grid.block_columns)
            chainage, arc = np.meshgrid(grid.chainages(columns), grid.arcs())
            offset = np.where(chainage > JOINT, STEP, 0.0) + random.normal(0.0, 0.001, chainage.shape)
            offset[(chainage < FIRST) | (chainage > LAST)] = np.nan
            state = np.where(np.isnan(offset), PixelState.EMPTY, PixelState.LINING).astype(float)
            state[np.abs(arc) > HIDDEN] = PixelState.FLOOR
            for kind, values in (("offset", offset), ("state", state)):
                conn.execute(
                    "INSERT INTO tunnel.image (survey_id, km, kind, block, tiff) VALUES (%s, %s, %s, %s, %s)",
                    (row[0], km, kind, grid.first_block + block,
                     encode(Raster(values.astype(np.float32), grid.transform(columns.start)), kind)),
                )  # fmt: skip
    conn.commit()
    return "straight"


def invoke(*words: object) -> Result:
    return CliRunner().invoke(main, [*map(str, words), "--json"])


def run(*words: object) -> dict:
    done = invoke(*words)
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)


def test_rings_are_measured_over_the_end_of_a_kilometre(survey: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    told = run(
        "rings", survey, "--length", LENGTH, "--start", JOINT, "--diameter", 2 * RADIUS, "--chord", "9:00-3:00"
    )  # fmt: skip
    assert told["made"] == [0, 1]
    rows = told["rows"]
    assert [row["number"] for row in rows] == list(range(1, len(rows) + 1))
    assert len(rows) == pytest.approx((LAST - FIRST) / LENGTH, abs=2)
    at = next(k for k, row in enumerate(rows) if abs(row["chainage_from"] - JOINT) < 1e-6)
    for k, row in enumerate(rows):
        radius = RADIUS - STEP * (k >= at)
        assert row["shape"] == "ellipse"
        assert row["radius"] == pytest.approx(radius, abs=0.0005)
        assert row["ovality"] < 0.0005
        assert row["centre_right"] == pytest.approx(0.0, abs=0.0005)
        assert row["seen_share"] == pytest.approx(HIDDEN / np.pi / RADIUS, abs=0.02)
        assert row["chord_270_90"] == pytest.approx(2 * radius, abs=max(0.002, 5 * row["chord_270_90_se"]))
        assert list(row)[-4:] == CIRCLE
        middle = 4.64e6 + 0.5 * (row["chainage_from"] + row["chainage_to"])
        assert [row[name] for name in CIRCLE] == pytest.approx([5e5, middle, 100.0, radius], abs=0.0006, rel=0)
    steps = [row["step_greatest"] for row in rows]
    assert steps[0] is None
    assert steps[at] == pytest.approx(STEP, abs=0.003)
    assert max(abs(step) for k, step in enumerate(steps) if k not in (0, at)) < 0.004
    cells = conn.execute("SELECT avg(step), count(*) FROM tunnel_api.ring_step WHERE number = %s", [at + 1]).fetchone()
    assert cells is not None
    assert cells[0] == pytest.approx(STEP, abs=0.0005)
    across = next(row for row in rows if row["chainage_from"] < 1000.0 < row["chainage_to"])
    assert across["seen_share"] == pytest.approx(HIDDEN / np.pi / RADIUS, abs=0.02)

    assert run("rings", survey, "-o", tmp_path / "r.csv")["made"] == []
    with (tmp_path / "r.csv").open(encoding="utf-8") as file:
        table = list(csv.DictReader(file))
    assert list(table[0]) == list(rows[0])
    np.testing.assert_allclose(
        [[float(row[name]) for name in CIRCLE] for row in table], [[row[c] for c in CIRCLE] for row in rows]
    )
    run("rings", survey, "-o", tmp_path / "r.xlsx")
    sheet = openpyxl.load_workbook(tmp_path / "r.xlsx", read_only=True)["rings"]
    assert [cell.value for cell in next(sheet.iter_rows(max_row=1))] == list(rows[0])
    run("rings", survey, "-o", tmp_path / "r.gpkg")
    assert [tuple(layer) for layer in pyogrio.list_layers(tmp_path / "r.gpkg")] == [
        ("ring_map", "Polygon"), ("ring_unrolled", "Polygon"), ("ring_step", "Point")
    ]  # fmt: skip
    unrolled = pyogrio.raw.read(tmp_path / "r.gpkg", layer="ring_unrolled")
    fields = dict(zip(unrolled[0]["fields"], unrolled[3], strict=True))
    bounds = shapely.bounds(shapely.from_wkb(unrolled[2]))
    np.testing.assert_allclose(bounds[:, [0, 2]], np.column_stack([fields["chainage_from"], fields["chainage_to"]]), atol=1e-9)
    np.testing.assert_allclose(bounds[:, [1, 3]], [[-np.pi * RADIUS, np.pi * RADIUS]] * len(rows), atol=0.05)
    for name in ("number", "radius", "ovality_se", "step_greatest", "chord_270_90", *CIRCLE):
        wanted = [np.nan if row[name] is None else row[name] for row in rows]
        np.testing.assert_allclose(fields[name], wanted, atol=1e-6)
    assert [len(text.split()) for text in fields["harmonic"]] == [5] * len(rows)
    drawn = pyogrio.raw.read(tmp_path / "r.gpkg", layer="ring_map")
    assert len(drawn[2]) == len(rows)
    assert drawn[0]["crs"]
    known = conn.execute("SELECT count(*) FROM tunnel_api.ring_step").fetchone()
    assert known is not None
    assert known[0] == len(pyogrio.raw.read(tmp_path / "r.gpkg", layer="ring_step")[2])


def test_rings_are_stale_after_what_they_rest_on(survey: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    def reasons() -> list[tuple]:
        conn.rollback()
        return conn.execute("SELECT km, reason FROM tunnel_api.result_status WHERE stage = 'rings' ORDER BY km").fetchall()

    path = tmp_path / "rings.csv"
    path.write_text("number,chainage_from,chainage_to\n7,950,951.5\n8,951.5,953\n9,1010,1012\n")
    assert run("rings", survey, "--rings", path, "--from", 1000)["made"] == [1]
    assert reasons() == [(0, "never ran"), (1, None)]
    assert run("rings", survey)["made"] == [0]
    path.write_text("number,chainage_from,chainage_to\n7,950,951.5\n8,951.5,953\n9,1010,1012.5\n")
    assert run("rings", survey, "--rings", path, "--to", 1000)["made"] == []
    assert reasons() == [(0, None), (1, "rings changed since")]
    conn.execute("UPDATE tunnel.run SET finished_at = clock_timestamp() WHERE km = 1 AND stage = 'ground'")
    conn.commit()
    assert reasons()[1] == (1, "detect is stale: ground ran since")
    done = invoke("rings", survey)
    assert (done.exit_code, "detect is stale" in done.output) == (2, True)


def test_what_cannot_be_done_is_one_line(survey: str, tmp_path: Path) -> None:
    path = tmp_path / "rings.csv"
    path.write_text("number,chainage_from,chainage_to\n1,950,952\n2,951,953\n")
    (tmp_path / "large.csv").write_text("number,chainage_from,chainage_to\n999999999999,950,952\n")
    for words, said in (
        (["rings"], "rings of what"),
        (["rings", survey], "has no rings there"),
        (["rings", survey, "--find"], "rings not found"),
        (["rings", survey, "--find", "--length", "2"], "one of"),
        (["rings", survey, "--start", "2"], "--length"),
        (["rings", survey, "--sigma", "0.002"], "--points"),
        (["rings", survey, "--rings", path], "begins within"),
        (["rings", survey, "--rings", tmp_path / "large.csv"], "at most nine digits"),
        (["rings", survey, "--length", "2", "-o", tmp_path / "r.pdf"], ".csv"),
    ):
        done = invoke(*words)
        assert (done.exit_code, said in done.output) == (2, True), done.output
