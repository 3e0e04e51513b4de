"""The verb ``thickness`` on two surveys of a round lining, the later one inside the earlier and beside it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import psycopg
import pytest
from click.testing import CliRunner
from support.straight_survey import FIRST, LAST, RADIUS, Scene, make_survey

from tunneldb.cli.main import main
from tunneldb.raster.geotiff import Raster, encode
from tunneldb.raster.grid import Grid
from tunneldb.raster.pixel_state import PixelState

PIXEL = 0.05
SHIFT, THINNER = 0.03, (1010.0, 1015.0)
"""The later lining lies so far to the right of the earlier one, m; where it is thinner, m."""

TABLES = ("run", "axis_vertex", "segment", "section")


def run(*words: object) -> dict[str, object]:
    done = CliRunner().invoke(main, [*map(str, words), "--json"])
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)


def offsets(chainage: np.ndarray, arc: np.ndarray, later: bool) -> np.ndarray:
    """How far the lining lies inside of a circle of RADIUS, m."""
    if not later:
        return np.zeros(chainage.shape)
    radius = np.where((chainage > THINNER[0]) & (chainage < THINNER[1]), RADIUS - 0.15, RADIUS - 0.25)
    along = SHIFT * np.sin(arc / RADIUS)
    return RADIUS - along - np.sqrt(along**2 - SHIFT**2 + radius**2)


@pytest.fixture
def surveys(conn: psycopg.Connection, tmp_path: Path) -> tuple[str, str]:
    make_survey(conn, Scene("before"))
    (first,) = conn.execute("SELECT id FROM tunnel.survey").fetchone()
    (second,) = conn.execute(
        "INSERT INTO tunnel.survey (tunnel_id, name, date, intensity_kind, platform)"
        " SELECT tunnel_id, 'after', '2025-05-04', 'none', 'mobile' FROM tunnel.survey RETURNING id"
    ).fetchone()
    for table in TABLES:
        columns = conn.execute(
            "SELECT string_agg(quote_ident(column_name), ', ') FROM information_schema.columns"
            " WHERE table_schema = 'tunnel' AND table_name = %s AND column_name NOT IN ('id', 'survey_id')"
            " AND is_generated = 'NEVER'", (table,),
        ).fetchone()[0]  # fmt: skip
        conn.execute(
            f"INSERT INTO tunnel.{table} (survey_id, {columns}) SELECT {second}, {columns} FROM tunnel.{table}"
            f" WHERE survey_id = {first}"
        )
    for survey, later in ((first, False), (second, True)):
        for km in (0, 1):
            grid = Grid.covering(km, PIXEL, -np.pi * RADIUS, np.pi * RADIUS, 0, (FIRST, LAST))
            for block in range(grid.blocks):
                columns = slice(block * grid.block_columns, (block + 1) * grid.block_columns)
                chainage, arc = np.meshgrid(grid.chainages(columns), grid.arcs())
                offset = offsets(chainage, arc, later)
                offset[(chainage < FIRST) | (chainage > LAST)] = np.nan
                state = np.where(np.isnan(offset), PixelState.EMPTY, PixelState.LINING).astype(float)
                if later:
                    state[arc > 9.0] = PixelState.FLOOR
                for kind, values in (("offset", offset), ("state", state)):
                    conn.execute(
                        "INSERT INTO tunnel.image (survey_id, km, kind, block, tiff) VALUES (%s, %s, %s, %s, %s)",
                        (survey, km, kind, grid.first_block + block,
                         encode(Raster(values.astype(np.float32), grid.transform(columns.start)), kind)),
                    )  # fmt: skip
    conn.commit()
    profile = tmp_path / "round.csv"
    profile.write_text("right,up,radius\n0,-4.1,4.1\n0,4.1,4.1\n0,-4.1,0\n")
    run("profile", "add", "before", "round", profile, "--layer", "excavation")
    return "before", "after"


def test_thickness_volume_and_what_is_too_thin(surveys: tuple[str, str], conn: psycopg.Connection, tmp_path: Path) -> None:
    told = run("thickness", *surveys, "--layer", "excavation", "--minimum", 0.2, "--every", 10, "--axis-sigma", 0.01)
    assert told["made"] == [0, 1]
    by_begin = {section["chainage_from"]: section for section in told["sections"]}
    assert len(by_begin) == LAST - FIRST
    seen = (np.pi * RADIUS + 9.0) / (2.0 * np.pi * RADIUS)
    plain, thin = by_begin[950.0], by_begin[1012.0]
    assert plain["compared_length"] / plain["design_length"] == pytest.approx(seen, abs=0.005)
    angle = np.linspace(-np.pi, 9.0 / RADIUS, 200_001)
    for section, radius in ((plain, RADIUS - 0.25), (thin, RADIUS - 0.15)):
        along = SHIFT * np.sin(angle)
        ray = along + np.sqrt(along**2 - SHIFT**2 + radius**2)
        area = float(np.trapezoid((RADIUS**2 - ray**2) / 2.0, angle))
        assert section["area"] == pytest.approx(area, rel=5e-3)  # to a cell of where it ends
        assert section["thickness_least"] == pytest.approx(RADIUS - radius - SHIFT, abs=1e-3)  # as images are stored
    assert told["whole"]["volume"] == pytest.approx(sum(s["area"] for s in told["sections"]), rel=1e-6)
    assert sum(row["volume"] for row in told["stretches"]) == pytest.approx(told["whole"]["volume"], rel=1e-9)
    # Half the lining goes by: its feet do not balance, and both surveys move against each other all along.
    assert told["whole"]["volume_sigma"] == pytest.approx(0.01 * (LAST - FIRST) * 4.1 * np.hypot(
        np.cos(np.pi) - np.cos(9.0 / 4.0), np.sin(9.0 / 4.0)), rel=0.02)  # fmt: skip
    below = told["below"]
    assert {row["chainage_from"] for row in below} == set(np.arange(*THINNER))
    assert sum(row["area"] for row in below) == pytest.approx(told["whole"]["below_area"], rel=1e-9)
    assert told["whole"]["below_area"] == pytest.approx(5.0 * seen * 2.0 * np.pi * 4.1, rel=0.01)

    assert run("thickness", *surveys, "--layer", "excavation", "-o", tmp_path / "t.csv")["made"] == []
    assert len((tmp_path / "t.csv").read_text().splitlines()) == 1 + LAST - FIRST


def test_it_is_stale_after_either_deviation_and_refused_between_what_does_not_go_together(
    surveys: tuple[str, str], conn: psycopg.Connection
) -> None:
    run("thickness", *surveys, "--layer", "excavation")
    state = (
        "SELECT km, t.reason FROM tunnel_api.thickness_state(tunnel_api.survey_id('before'), tunnel_api.survey_id('after')) t"
    )
    assert conn.execute(f"{state} ORDER BY km").fetchall() == [(0, None), (1, None)]
    conn.execute(
        "DELETE FROM tunnel.image WHERE kind = 'deviation_excavation' AND survey_id = tunnel_api.survey_id('before') AND km = 1"
    )
    conn.commit()
    assert conn.execute(f"{state} ORDER BY km").fetchall()[1] == (
        1, "deviation of the earlier survey is stale: its image is not stored"
    )  # fmt: skip
    conn.rollback()
    assert run("thickness", *surveys, "--layer", "excavation")["made"] == [1]
    for words, said in ((("before", "before"), "is both"), (surveys, "has no design profile")):
        done = CliRunner().invoke(main, ["thickness", *words])
        assert (done.exit_code, said in done.output) == (2, True), done.output
