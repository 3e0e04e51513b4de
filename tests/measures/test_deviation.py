"""The command ``deviation`` on a survey whose lining is known, against areas by shapely."""

from __future__ import annotations

import json
from pathlib import Path

import ezdxf
import numpy as np
import psycopg
import pytest
import rasterio
import shapely
from click.testing import CliRunner
from support.curved_lining import block as offset_block
from support.curved_lining import circle, made
from support.straight_survey import FIRST, LAST, RADIUS, Scene, make_survey

from tunneldb.cli.main import main
from tunneldb.measures.deviation.compute import Design
from tunneldb.raster.geotiff import Raster, encode
from tunneldb.raster.grid import Grid
from tunneldb.raster.state import PixelState
from tunneldb.shape.profile import Profile, stretches

PIXEL = 0.05
PATCH = (1010.0, 1015.0, 2.0)
"""A pocket 0.2 m deep: from chainage, to, and half its width along the arc about the crown, m."""

HIDDEN = 9.0
"""Beyond this arc to both sides there is a floor, m."""


@pytest.fixture
def survey(conn: psycopg.Connection) -> str:
    make_survey(conn, Scene("straight"))
    row = conn.execute("SELECT id FROM tunnel.survey").fetchone()
    assert row is not None
    for km in (0, 1):
        grid = Grid.covering(km, PIXEL, -np.pi * RADIUS, np.pi * RADIUS, 0, (FIRST, LAST))
        for block in range(grid.blocks):
            columns = slice(block * grid.block_columns, (block + 1) * grid.block_columns)
            chainage, arc = np.meshgrid(grid.chainages(columns), grid.arcs())
            low, high, half = PATCH
            offset = np.where((chainage > low) & (chainage < high) & (np.abs(arc) < half), -0.2, 0.0)
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


def run(*words: object) -> dict[str, object]:
    done = CliRunner().invoke(main, [*map(str, words), "--json"])
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)


def ring(radius: float, right: float = 0.0) -> shapely.Polygon:
    """The lining, or a design, as far as it is lining: without what lies beyond HIDDEN."""
    angle = np.radians(np.arange(0.0, 360.0, 1.0 if radius == RADIUS and not right else 0.02))
    return shapely.Polygon(np.column_stack([right + radius * np.sin(angle), radius * np.cos(angle)]))


def seen_part() -> shapely.Polygon:
    """Sector of the section in which lining is seen."""
    edge = HIDDEN / RADIUS
    angle = np.linspace(-edge, edge, 400)
    return shapely.Polygon([(0.0, 0.0), *zip(9.0 * np.sin(angle), 9.0 * np.cos(angle), strict=True)])


def test_areas_and_volumes_are_those_of_the_lining(survey: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    small, large = tmp_path / "small.csv", tmp_path / "large.csv"
    for path, radius in ((small, 3.9), (large, 4.1)):
        path.write_text(f"right,up,radius\n0.05,{-radius},{radius}\n0.05,{radius},{radius}\n0.05,{-radius},0\n")
    assert run("profile", "add", survey, small, "--to", 980)["closed"]
    run("profile", "add", survey, large, "--from", 1000)
    assert [part["kind"] for part in run("profile", "list", survey)["profiles"]] == ["profile", "transition", "profile"]

    told = run("deviation", survey, "--axis-sigma", 0.01)
    assert told["made"] == [0, 1]
    by_begin = {section["chainage_from"]: section for section in told["sections"]}
    assert len(by_begin) == LAST - FIRST
    lining, seen = ring(RADIUS), seen_part()
    for begin, radius in ((950.0, 3.9), (989.0, 3.995), (1030.0, 4.1)):
        design, section = ring(radius, 0.05), by_begin[begin]
        over, under = lining.difference(design).intersection(seen).area, design.difference(lining).intersection(seen).area
        assert section["overbreak"] == pytest.approx(over, abs=0.001 * (over + under))
        assert section["underbreak"] == pytest.approx(under, abs=0.001 * (over + under))
        assert section["design_length"] == pytest.approx(2.0 * np.pi * radius, rel=1e-3)
        assert section["seen_length"] / section["design_length"] == pytest.approx(HIDDEN / np.pi / RADIUS, abs=0.02)
        assert section["shift_right"] == pytest.approx(-0.05, abs=5e-4)
        assert section["shift_up"] == pytest.approx(0.0, abs=5e-4)
    pocket = by_begin[1012.0]["overbreak"] - by_begin[1030.0]["overbreak"]
    angle = PATCH[2] / RADIUS  # under to over across the design: 0.1 m inside it before, 0.1 m outside in the pocket
    sector = shapely.Polygon([(0, 0), *((9 * np.sin(a), 9 * np.cos(a)) for a in np.linspace(-angle, angle, 99))])
    assert pocket == pytest.approx(ring(RADIUS + 0.2).difference(ring(4.1, 0.05)).intersection(sector).area, rel=0.01)

    (row,) = conn.execute(
        "SELECT length, overbreak FROM tunnel_api.deviation_volume('straight', 'lining', 950, 960.5)"
    ).fetchall()
    assert row == (pytest.approx(10.5), pytest.approx(10.5 * by_begin[950.0]["overbreak"], rel=1e-4))
    hundreds = conn.execute("SELECT * FROM tunnel_api.deviation_stretches('straight', 'lining')").fetchall()
    assert sum(hundred[7] for hundred in hundreds) == pytest.approx(told["volume"]["overbreak"], rel=1e-9)
    assert told["volume"]["overbreak_sigma"] > 0.01  # m of axis, by a metre of profile, along metres of tunnel


def test_it_is_stale_after_what_it_rests_on_and_written_as_files(survey: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    path = tmp_path / "round.csv"
    path.write_text("right,up,radius\n0,-4.05,4.05\n0,4.05,4.05\n0,-4.05,0\n")
    run("profile", "add", survey, "round", path)

    def reasons() -> list[tuple[int, str | None]]:
        conn.rollback()
        return conn.execute("SELECT km, reason FROM tunnel_api.result_status WHERE stage = 'deviation' ORDER BY km").fetchall()

    assert reasons() == [(0, "never ran"), (1, "never ran")]
    assert run("deviation", survey, "--from", 1010, "-o", tmp_path / "d.tif")["made"] == [1]
    assert reasons() == [(0, "never ran"), (1, None)]
    with rasterio.open(tmp_path / "d.tif") as image:
        values = image.read(1)
        assert image.units == ("m",)
    shown = values[np.isfinite(values)]
    assert (shown.min(), np.median(shown)) == (pytest.approx(-0.15, abs=1e-4), pytest.approx(0.05, abs=2e-4))
    assert run("deviation", survey, "-o", tmp_path / "d.csv")["made"] == [0]
    assert len((tmp_path / "d.csv").read_text().splitlines()) == 1 + LAST - FIRST
    run("deviation", survey, "-o", tmp_path / "d.dxf", "--every", 20)
    drawing = ezdxf.readfile(tmp_path / "d.dxf").modelspace()
    assert len(drawing.query('LWPOLYLINE[layer=="DESIGN"]')) == 6
    lining = drawing.query('LWPOLYLINE[layer=="LINING"]').first
    assert np.hypot(*np.array(lining.get_points("xy")).T) == pytest.approx(RADIUS, abs=1e-3)

    def stored(kind: str) -> int:
        conn.rollback()
        return conn.execute("SELECT count(*) FROM tunnel.image WHERE kind = %s", [kind]).fetchone()[0]

    assert stored("overview_deviation_lining") == 2
    assert stored("deviation_lining") == 4  # blocks of 50 m, with the one before the survey's end and the one after
    written = [Path(name).name for name in run("image", survey, "-o", tmp_path, "--km", 1)["files"]]
    assert "straight-km001-deviation_lining.tif" in written
    with rasterio.open(tmp_path / "straight-km001-deviation_lining.tif") as image:
        assert np.array_equal(image.read(1), values, equal_nan=True)

    run("profile", "remove", survey, "round")
    assert stored("deviation_lining") == stored("overview_deviation_lining") == 0
    assert reasons() == [(0, "design profiles changed since"), (1, "design profiles changed since")]
    path.write_text(path.read_text().replace("4.05", "4.06"))
    run("profile", "add", survey, "round", path)
    assert reasons() == [(0, "design profiles changed since"), (1, "design profiles changed since")]
    conn.execute("UPDATE tunnel.run SET finished_at = clock_timestamp() WHERE km = 1 AND stage = 'ground'")
    conn.commit()
    assert reasons()[1] == (1, "detect is stale: ground ran since")
    done = CliRunner().invoke(main, ["deviation", survey])
    assert (done.exit_code, "kilometre 0: detect is stale" in done.output) == (2, True)


@pytest.mark.parametrize(("right", "up"), [(0.0, 0.0), (-0.2, 0.1)])
def test_on_a_curve_and_a_grade_a_lining_that_is_its_design_has_none(right: float, up: float) -> None:
    """Wherever the measured axis lies; sections are chords of a degree, which stray from the circle by 0.15 mm at most."""
    surface, axis = made(4.0, 200.0, right, up)
    design = Design(surface, axis, stretches([Profile("round", 0.0, 200.0, circle(4.0))]))
    image = offset_block(surface, 50.0, 0.1, length=20.0)
    _, found = design.deviation(image, np.ones(image.values.shape, np.bool_))
    sagitta = 4.0 * (1.0 - np.cos(np.radians(0.5)))
    assert np.isfinite(found.distance).mean() > 0.99
    assert found.distance[np.isfinite(found.distance)].min() > -1e-4
    assert np.nanmax(found.distance) < sagitta + 1e-4
    assert np.nanmean(found.distance) == pytest.approx(2.0 / 3.0 * sagitta, abs=1e-5)


def test_a_profile_that_is_removed_and_added_again_leaves_no_image_missing(
    survey: str, conn: psycopg.Connection, tmp_path: Path
) -> None:
    path = tmp_path / "round.csv"
    path.write_text("right,up,radius\n0,-4.05,4.05\n0,4.05,4.05\n0,-4.05,0\n")
    run("profile", "add", survey, "round", path)
    run("deviation", survey)
    run("profile", "remove", survey, "round")
    run("profile", "add", survey, "round", path)  # the same again: what was measured holds, but its image went
    conn.rollback()
    rows = conn.execute("SELECT km, reason FROM tunnel_api.result_status WHERE stage = 'deviation' ORDER BY km").fetchall()
    assert rows == [(0, "its image is not stored"), (1, "its image is not stored")]
    assert run("deviation", survey)["made"] == [0, 1]
