"""The command ``compare`` on two surveys whose linings and leaks are known."""

from __future__ import annotations

import json
import re
import sqlite3
from pathlib import Path

import numpy as np
import psycopg
import pytest
import rasterio
from click.testing import CliRunner
from support.straight_survey import FIRST, LAST, RADIUS, Scene, Wet, make_survey

from tunneldb.cli.main import main
from tunneldb.raster.geotiff import Raster, encode
from tunneldb.raster.grid import Grid
from tunneldb.raster.state import PixelState

PIXEL, NOISE = 1 / 30, 0.0015
PATCH = (1009.5, 1012.5, -1.0, 1.0)
"""Lining that stands in by 4 mm: chainage and arc from and to, m."""

HIDDEN = (1040.0, 1045.0)
"""What the later survey did not see, m of chainage."""

OLD = [Wet(950, 951, 0, 1), Wet(970, 971, 0, 1), Wet(1041, 1042, 0, 1), Wet(980, 982, 3, 4)]
NEW = [Wet(950, 951, 0, 1), Wet(980, 980.8, 3, 4), Wet(981.2, 984, 3, 4), Wet(1000, 1001, -4, -3)]


@pytest.fixture
def surveys(conn: psycopg.Connection) -> tuple[str, str]:
    make_survey(conn, Scene("before", leaks=OLD))
    make_survey(conn, Scene("after", leaks=NEW))
    conn.execute("UPDATE tunnel.survey SET tunnel_id = (SELECT min(tunnel_id) FROM tunnel.survey), date = date"
                 " + CASE name WHEN 'after' THEN 365 ELSE 0 END")  # fmt: skip
    for survey, name in conn.execute("SELECT id, name FROM tunnel.survey").fetchall():
        rng = np.random.default_rng(survey)
        for km in (0, 1):
            grid = Grid.covering(km, PIXEL, -np.pi * RADIUS, np.pi * RADIUS, 0, (FIRST, LAST))
            for block in range(grid.blocks):
                columns = slice(block * grid.block_columns, (block + 1) * grid.block_columns)
                chainage, arc = np.meshgrid(grid.chainages(columns), grid.arcs())
                offset = rng.normal(0.0, NOISE, chainage.shape)
                offset[(chainage < FIRST) | (chainage > LAST)] = np.nan
                if name == "after":
                    west, east, south, north = PATCH
                    offset += 0.004 * ((chainage > west) & (chainage < east) & (arc > south) & (arc < north))
                    offset -= 0.01 * np.sin(arc / RADIUS)  # all of it 10 mm to the right
                    offset[(chainage > HIDDEN[0]) & (chainage < HIDDEN[1])] = np.nan
                state = np.where(np.isnan(offset), PixelState.EMPTY, PixelState.LINING).astype(float)
                for kind, values in (("offset", offset), ("state", state)):
                    conn.execute(
                        "INSERT INTO tunnel.image (survey_id, km, kind, block, tiff) VALUES (%s, %s, %s, %s, %s)",
                        (survey, km, kind, grid.first_block + block,
                         encode(Raster(values.astype(np.float32), grid.transform(columns.start)), kind)),
                    )  # fmt: skip
    conn.commit()
    return "before", "after"


def run(*words: object) -> dict[str, object]:
    done = CliRunner().invoke(main, [*map(str, words), "--json"])
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)


def test_change_leaks_files_and_when_they_are_stale(surveys: tuple[str, str], conn: psycopg.Connection, tmp_path: Path) -> None:
    reversed_ = CliRunner().invoke(main, ["compare", *surveys[::-1]])
    assert reversed_.exit_code == 2
    (advice,) = re.findall(r"tunneldb (compare \w+ \w+)", reversed_.output)
    told = run(*advice.split())
    assert told["made"] == [0, 1]
    (region,) = told["regions"]
    west, east, south, north = PATCH
    assert (region["chainage_from"], region["chainage_to"]) == (pytest.approx(west, abs=0.11), pytest.approx(east, abs=0.11))
    assert (region["arc_from"], region["arc_to"]) == (pytest.approx(south, abs=0.11), pytest.approx(north, abs=0.11))
    assert region["change_mean"] == pytest.approx(0.004, abs=3e-4)
    assert region["lod"] < 0.001
    for section in told["sections"]:
        if section["seen_both"]:
            assert section["shift_right"] == pytest.approx(0.01, abs=6e-4)
            assert abs(section["shift_right"] - 0.01) < 5.0 * section["shift_right_se"]
    girth = 2.0 * np.pi * RADIUS  # of two cells beside what is not seen nothing is told
    assert told["summary"]["unseen"] == pytest.approx((HIDDEN[1] - HIDDEN[0] + 0.4) * girth, rel=0.01)
    assert told["summary"]["compared"] == pytest.approx((LAST - FIRST - HIDDEN[1] + HIDDEN[0] - 0.8) * girth, rel=0.01)

    by_state = {leak["state"]: leak for leak in told["leaks"]}
    assert sorted(leak["state"] for leak in told["leaks"]) == ["dry", "grown", "new", "same", "unseen"]
    assert (by_state["grown"]["area_old"], by_state["grown"]["area_new"]) == (pytest.approx(2.0), pytest.approx(3.6))
    assert (len(by_state["grown"]["old_ids"]), len(by_state["grown"]["new_ids"])) == (1, 2)
    assert by_state["unseen"]["chainage_from"] == 1041.0
    assert by_state["unseen"]["seen_new"] == 0.0
    assert by_state["dry"]["chainage_from"] == 970.0

    (at,) = conn.execute("SELECT change FROM tunnel_api.change_at('before', 1011, 0)").fetchone()
    assert at == pytest.approx(0.004, abs=1e-3)
    (closer,) = conn.execute("SELECT convergence FROM tunnel_api.convergence('before', 960)").fetchone()
    assert closer == pytest.approx(0.0, abs=2e-3)
    stretches = "SELECT sum(changed), sum(unseen), sum(wet_new) FROM tunnel_api.change_stretches('before', 'after')"
    assert conn.execute(stretches).fetchone() == (
        pytest.approx(region["area"]), pytest.approx(told["summary"]["unseen"], rel=1e-3), pytest.approx(5.6)
    )  # fmt: skip
    series = conn.execute("SELECT survey, sum(area) FROM tunnel_api.leak_area_series('before') GROUP BY 1").fetchall()
    assert dict(series) == {"before": pytest.approx(5.0), "after": pytest.approx(5.6)}
    conn.rollback()

    assert run("compare", *surveys, "-o", tmp_path / "c.gpkg")["made"] == []
    with sqlite3.connect(tmp_path / "c.gpkg") as file:
        assert file.execute("SELECT count(*) FROM leak_change_map").fetchone() == (5,)
        assert file.execute("SELECT count(*) FROM change_region_3d").fetchone() == (1,)
    run("compare", *surveys, "-o", tmp_path / "c.csv")
    assert len((tmp_path / "c.csv").read_text().splitlines()) == 6
    run("compare", *surveys, "-o", tmp_path / "c.xlsx")
    run("compare", *surveys, "--from", 1000, "-o", tmp_path / "c.tif")
    with rasterio.open(tmp_path / "c.tif") as image:
        values = image.read(1)
        assert image.units == ("m",)
    assert np.nanmax(values) > 0.004

    def reasons() -> list[str | None]:
        conn.rollback()
        return [
            row[0]
            for row in conn.execute(
                "SELECT reason FROM tunnel_api.result_status WHERE stage = 'compare' ORDER BY km"
            ).fetchall()
        ]

    assert reasons() == [None, None]
    conn.execute("UPDATE tunnel.finding SET review = 'rejected' WHERE chainage_from = 970")
    conn.commit()
    assert reasons() == ["leaks of the older survey changed since"] * 2  # it lies within 100 m of the next kilometre, too
    assert run("compare", *surveys)["made"] == [0, 1]
    assert run("compare", *surveys, "--from", 1000, "--cell", 0.2)["made"] == [1]
    conn.execute("UPDATE tunnel.run SET finished_at = clock_timestamp() WHERE km = 1 AND stage = 'ground'")
    conn.commit()
    assert reasons()[1] == "detect of the older survey is stale: ground ran since"
    done = CliRunner().invoke(main, ["compare", *surveys])
    assert (done.exit_code, "detect of the older survey is stale" in done.output) == (2, True)
    done = CliRunner().invoke(main, ["compare", "before", "before"])
    assert (done.exit_code, "given twice" in done.output) == (2, True)
