"""The commands ``thickness`` and ``evenness`` on surveys whose lining is known, and what makes them stale."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import psycopg
import pytest
from click.testing import CliRunner
from psycopg import sql
from support.straight_survey import FIRST, LAST, RADIUS, Scene, make_survey

from tunneldb.cli.main import main
from tunneldb.raster.geotiff import Raster, encode
from tunneldb.raster.grid import Grid
from tunneldb.raster.state import PixelState

PIXEL = 0.025
DESIGN = 4.05
THICK, THIN = 0.3, (1010.0, 1015.0, 2.0, 0.1)
"""What is put on, m; but in a place from a chainage to another, half as wide along the arc about the crown, as thin as that."""

HOLLOW = (1000.0, 0.6, 0.03)
"""A hollow across the end of a kilometre: its middle, half its length and its depth, m."""


def add_images(conn: psycopg.Connection, survey: int, put_on: float) -> None:
    for km in (0, 1):
        grid = Grid.covering(km, PIXEL, -np.pi * RADIUS, np.pi * RADIUS, 0, (FIRST, LAST))
        for block in range(grid.blocks):
            columns = slice(block * grid.block_columns, (block + 1) * grid.block_columns)
            chainage, arc = np.meshgrid(grid.chainages(columns), grid.arcs())
            low, high, half, thin = THIN
            offset = np.full(chainage.shape, put_on)
            if put_on:
                offset[(chainage > low) & (chainage < high) & (np.abs(arc) < half)] = thin
            middle, reach, depth = HOLLOW
            hollow = (np.abs(chainage - middle) < reach) & (np.abs(arc - 5.0) < 1.0)
            offset[hollow] -= depth
            offset[(chainage < FIRST) | (chainage > LAST)] = np.nan
            state = np.where(np.isnan(offset), PixelState.EMPTY, PixelState.LINING).astype(np.float32)
            for kind, values in (("offset", offset.astype(np.float32)), ("state", state)):
                conn.execute(
                    "INSERT INTO tunnel.image (survey_id, km, kind, block, tiff) VALUES (%s, %s, %s, %s, %s)",
                    (survey, km, kind, grid.first_block + block, encode(Raster(values, grid.transform(columns.start)), kind)),
                )


def copied(conn: psycopg.Connection, survey: int, name: str) -> int:
    """Another survey of the same tunnel with the same geometry."""
    tables = ("scan_file", "run", "axis_vertex", "segment", "section")
    (other,) = conn.execute(
        "INSERT INTO tunnel.survey (tunnel_id, name, date, intensity_dimension, intensity_kind, platform)"
        " SELECT tunnel_id, %s, '2025-05-04', intensity_dimension, intensity_kind, platform FROM tunnel.survey WHERE id = %s"
        " RETURNING id",
        (name, survey),
    ).fetchone()
    for table in tables:
        names = conn.execute(
            "SELECT attname FROM pg_attribute WHERE attrelid = %s::regclass AND attnum > 0 AND NOT attisdropped"
            " AND attgenerated = '' AND attidentity = '' AND attname <> 'survey_id'",
            (f"tunnel.{table}",),
        ).fetchall()
        columns = sql.SQL(", ").join(sql.Identifier(column) for (column,) in names)
        conn.execute(
            sql.SQL("INSERT INTO {0} (survey_id, {1}) SELECT %s, {1} FROM {0} WHERE survey_id = %s").format(
                sql.Identifier("tunnel", table), columns
            ),
            (other, survey),
        )
    return other


@pytest.fixture
def surveys(conn: psycopg.Connection, tmp_path: Path) -> tuple[str, str]:
    make_survey(conn, Scene("before"))
    (first,) = conn.execute("SELECT id FROM tunnel.survey").fetchone()
    second = copied(conn, first, "after")
    add_images(conn, first, 0.0)
    add_images(conn, second, THICK)
    conn.commit()
    path = tmp_path / "round.csv"
    path.write_text(f"right,up,radius\n0,-{DESIGN},{DESIGN}\n0,{DESIGN},{DESIGN}\n0,-{DESIGN},0\n")
    run("profile", "add", "before", path)
    return "before", "after"


def run(*words: object) -> dict:
    done = CliRunner().invoke(main, [*map(str, words), "--json"])
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)


def test_thickness_is_what_was_put_on(surveys: tuple[str, str], conn: psycopg.Connection, tmp_path: Path) -> None:
    told = run("thickness", *surveys, "--minimum", 0.2, "--axis-sigma", 0.01)
    assert told["made"] == [0, 1]
    sections = {section["chainage_from"]: section for section in told["sections"]}
    assert len(sections) == LAST - FIRST
    usual = sections[950.0]
    # The lining is stored in chords of a degree, with pixels of 1 mm; both cancel.
    assert usual["thickness_mean"] == pytest.approx(THICK, abs=1e-4)
    assert usual["area"] == pytest.approx(np.pi * (RADIUS**2 - (RADIUS - THICK) ** 2), rel=1e-3)
    assert sections[1012.0]["thickness_least"] == pytest.approx(THIN[3], abs=1e-4)
    thin = sum(stretch["thin_area"] for stretch in told["stretches"])
    assert thin == pytest.approx(5.0 * 2.0 * THIN[2] * DESIGN / RADIUS, rel=0.03)  # on the design, in whole cells
    volume = sum(stretch["volume"] for stretch in told["stretches"])
    ring = np.pi * (RADIUS**2 - (RADIUS - THICK) ** 2)
    missing = 2.0 * THIN[2] / RADIUS / 2.0 * ((RADIUS - THIN[3]) ** 2 - (RADIUS - THICK) ** 2)
    assert volume == pytest.approx((LAST - FIRST) * ring - 5.0 * missing, rel=1e-3)
    (reasons,) = zip(*conn.execute("SELECT reason FROM tunnel_api.result_status WHERE stage = 'thickness'"), strict=True)
    assert reasons == (None, None)
    conn.rollback()
    path = tmp_path / "t.csv"
    assert run("thickness", *surveys, "-o", path)["made"] == []
    assert len(path.read_text().splitlines()) == 1 + LAST - FIRST
    run("profile", "remove", "before", "round")
    found = {row[0] for row in conn.execute("SELECT reason FROM tunnel_api.result_status WHERE stage = 'thickness'")}
    assert found == {"deviation of the older survey is stale: design profiles changed since"}
    done = CliRunner().invoke(main, ["thickness", "after", "after"])
    assert (done.exit_code, "given twice" in done.output) == (2, True)


def test_gaps_beneath_a_straightedge_over_the_end_of_a_kilometre(surveys: tuple[str, str], conn: psycopg.Connection) -> None:
    told = run("evenness", surveys[0], "--length", 2, "--limit", 0.02)
    assert told["made"] == [0, 1]
    sections = {section["chainage_from"]: section for section in told["sections"]}
    middle, reach, depth = HOLLOW
    for begin in (middle - 1.0, middle):
        assert sections[begin]["gap_along"] == pytest.approx(depth, abs=1e-9)
        assert sections[begin]["gap_along_at"] == pytest.approx(5.0, abs=1.05)
        # Around it is as deep, between rims 2 m apart less than a cell: a straightedge of 2 m just bridges it.
        assert sections[begin]["gap_around"] <= depth + 1e-9
    assert sections[980.0]["gap_along"] == pytest.approx(0.0, abs=1e-9)
    assert sections[980.0]["gap_around"] < 2e-3  # chords of a degree, in pixels of 1 mm
    # Six cells from the nearer of the rims' cells, 0.05 m outside.
    assert max(sections[begin]["waviness"] for begin in (middle - 1.0, middle)) == pytest.approx(depth / reach, abs=1e-5)
    areas = conn.execute("SELECT chainage_from, chainage_to, area, gap FROM tunnel_api.evenness_area ORDER BY 1").fetchall()
    assert [row[:2] for row in areas] == [(pytest.approx(999.4), 1000.0), (1000.0, pytest.approx(1000.6))]
    assert sum(row[2] for row in areas) == pytest.approx(2.0 * reach * 2.0, rel=0.1)
    conn.rollback()
    assert run("evenness", surveys[0], "--length", 2, "--limit", 0.02)["made"] == []
    assert run("evenness", surveys[0], "--length", 2, "--limit", 0.04, "--from", 1005)["made"] == [1]
    conn.execute("UPDATE tunnel.run SET outcome = 'failed' WHERE stage = 'deviation' AND km = 0")
    found = conn.execute(
        "SELECT reason FROM tunnel_api.result_status WHERE stage = 'evenness' AND survey = 'before' ORDER BY km"
    ).fetchall()
    assert found == [("deviation is stale: never ran",), ("deviation ran since",)]
