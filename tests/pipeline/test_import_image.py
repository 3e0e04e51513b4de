"""`image import`: images of other instruments in the unrolled plane, stored, listed, removed and exported."""

from __future__ import annotations

import json
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import psycopg
import pytest
import rasterio
from affine import Affine
from click.testing import CliRunner, Result
from support.example_survey import NAME
from support.imported_image import LONG, PIXELS, SPOTS, STATED, TOP, WEST, strip, temperature, write

from tunneldb.cli.main import main
from tunneldb.raster.accumulator import Window
from tunneldb.raster.geotiff import decode
from tunneldb.raster.grid import Grid
from tunneldb.store.clearing import clear_kilometre
from tunneldb.store.images import ImageStore
from tunneldb.store.survey import get_survey


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


def run(*arguments: object) -> Result:
    return CliRunner().invoke(main, [str(a) for a in arguments])


def told(*arguments: object) -> dict[str, Any]:
    done = run(*arguments, "--json")
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)


def points(path: Path, place: Affine, wrong: dict[int, tuple[float, float]] | None = None, noise: float = 0.004) -> Path:
    rng = np.random.default_rng(2)
    lines = ["column,row,chainage,arc"]
    for k, (column, row) in enumerate(PIXELS):
        chainage, arc = np.array(place @ (column, row)) + rng.normal(0, noise, 2) + (wrong or {}).get(k, (0.0, 0.0))
        lines.append(f"{column},{row},{chainage:.4f},{arc:.4f}")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def stored(conn: psycopg.Connection, kind: str) -> dict[int, Any]:
    rows = conn.execute("SELECT block, tiff FROM tunnel.image WHERE kind = %s ORDER BY block", [kind], binary=True).fetchall()
    conn.rollback()
    return {block: decode(bytes(tiff), kind) for block, tiff in rows}


def spot_errors(values: np.ndarray, place: Affine) -> np.ndarray:
    """Distance of the centres of the hot spots in an image from their true places, chainage and arc, m."""
    chainage = place.c + (np.arange(values.shape[1]) + 0.5) * place.a
    arc = place.f + (np.arange(values.shape[0]) + 0.5) * place.e
    out = []
    for x, y in SPOTS:
        near = np.ix_(abs(arc - y) < 0.6, abs(chainage - x) < 0.6)
        above = np.maximum(np.nan_to_num(values[near], nan=10.0) - 11.0, 0.0)
        out.append(
            [(above.sum(0) @ chainage[near[1][0]]) / above.sum() - x, (above.sum(1) @ arc[near[0][:, 0]]) / above.sum() - y]
        )
    return np.array(out)


def test_a_strip_too_long_and_off_is_placed_by_control_points(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    image = write(tmp_path / "strip.tif", strip(LONG), STATED, "°C")
    said = told("image", "import", NAME, image, "--kind", "thermal", "--points", points(tmp_path / "points.csv", LONG))
    assert said["image"]["model"] == "affine"
    assert said["image"]["residual"] < 0.01
    assert "2.00 % too long" in said["notes"][0]
    assert said["kilometres"] == [12]
    folder = tmp_path / "images"
    assert run("image", NAME, "-o", folder).exit_code == 0
    with rasterio.open(folder / f"{NAME}-km012-imported-thermal.tif") as written:
        assert written.units == ("°C",)
        assert written.tags()["TUNNELDB_KIND"] == "thermal"
        assert np.abs(spot_errors(written.read(1), written.transform)).max() < 0.02
    # without control points it is where it states
    told("image", "import", NAME, image, "--kind", "thermal", "--name", "stated")
    run("image", NAME, "-o", folder)
    with rasterio.open(folder / f"{NAME}-km012-imported-stated.tif") as written:
        chainage, arc = SPOTS[-1]
        column, row = ~written.transform @ (chainage, arc)
        assert written.read(1)[int(row), int(column)] < 11.0


def test_unit_range_and_person_are_kept(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    values = np.rint(100 * (strip(STATED, 400) + 273.15)).astype(np.uint16)
    image = write(tmp_path / "flir.tif", values, STATED)
    said = told("image", "import", NAME, image, "--kind", "thermal", "--scale", 0.01, "--offset", -273.15)
    assert said["image"]["unit"] == "°C"
    assert (said["image"]["value_from"], said["image"]["value_to"]) == (
        pytest.approx(10, abs=0.01),
        pytest.approx(18, abs=0.05),
    )
    (row,) = told("image", "list", NAME)["images"]
    assert row["source"] == "flir.tif"
    assert row["imported_by"] == conn.execute("SELECT current_user").fetchone()[0]
    (raster, *_) = stored(conn, "imported_thermal").values()
    assert np.nanmax(raster.values) == pytest.approx(18.0, abs=0.05)
    plain = write(tmp_path / "raw.tif", values, STATED)
    assert "are no °C" in told("image", "import", NAME, plain, "--kind", "thermal")["image"]["warnings"][0]


def test_an_import_is_replaced_by_the_next_of_its_name(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    own = conn.execute("SELECT kind, block, md5(tiff) FROM tunnel.image ORDER BY 1, 2").fetchall()
    conn.rollback()
    long = write(tmp_path / "long.tif", strip(STATED), STATED)
    short = write(tmp_path / "short.tif", strip(STATED, 500), STATED)
    assert told("image", "import", NAME, long, "--kind", "thermal")["replaced"] is False
    assert len(stored(conn, "imported_thermal")) == 2
    first = told("image", "import", NAME, short, "--kind", "thermal")
    assert first["replaced"] is True
    assert list(stored(conn, "imported_thermal")) == [246]
    again = stored(conn, "imported_thermal")[246].values
    told("image", "import", NAME, short, "--kind", "thermal")
    np.testing.assert_array_equal(stored(conn, "imported_thermal")[246].values, again)
    assert run("image", "remove", NAME, "thermal").exit_code == 0
    assert conn.execute("SELECT kind, block, md5(tiff) FROM tunnel.image ORDER BY 1, 2").fetchall() == own
    conn.rollback()
    assert told("image", "list", NAME)["images"] == []
    gone = run("image", "remove", NAME, "thermal")
    assert gone.exit_code == 2
    assert "has no imported image 'thermal'" in gone.stderr


def test_a_failed_import_leaves_the_former_one(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    told("image", "import", NAME, write(tmp_path / "a.tif", strip(STATED, 500), STATED), "--kind", "thermal")
    before = stored(conn, "imported_thermal")[246].values
    empty = write(tmp_path / "b.tif", np.full((100, 100), np.nan, np.float32), STATED)
    assert run("image", "import", NAME, empty, "--kind", "thermal").exit_code == 2
    np.testing.assert_array_equal(stored(conn, "imported_thermal")[246].values, before)


def test_a_wrong_control_point_is_named(example: str, tmp_path: Path) -> None:
    image = write(tmp_path / "strip.tif", strip(LONG), None)
    control = points(tmp_path / "points.csv", LONG, {3: (0.0, 0.5)})
    done = run("image", "import", NAME, image, "--kind", "thermal", "--points", control)
    assert done.exit_code == 0, done.output
    assert "Note: control point line 5 is not used: it deviates by" in done.stderr
    assert "affine by 6 control points" in done.stdout


def test_points_of_qgis_are_read(example: str, tmp_path: Path) -> None:
    image = write(tmp_path / "strip.tif", strip(LONG, 1000, 400), None)
    lines = ["#CRS: none", "mapX,mapY,sourceX,sourceY,enable,dX,dY,residual"]
    for column, row in [(10, 20), (900, 30), (950, 390), (20, 380), (500, 200)]:
        x, y = LONG @ (column, row)
        lines.append(f"{x + (5 if column == 500 else 0)},{y},{column},{-row},{0 if column == 500 else 1},0,0,0")
    (tmp_path / "strip.points").write_text("\n".join(lines), encoding="utf-8")
    said = told("image", "import", NAME, image, "--kind", "thermal", "--points", tmp_path / "strip.points")
    assert (said["image"]["points"], said["image"]["outliers"]) == (4, 0)
    assert said["image"]["chainage_from"] == pytest.approx(WEST + 0.05, abs=1e-3)


def test_frames_are_placed_by_a_table(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    rows = ["file,chainage_from,chainage_to,arc_from,arc_to"]
    for k in range(5):
        west = WEST + 8.0 * k
        write(tmp_path / f"frame-{k}.tif", strip(Affine(0.02, 0, west, 0, -0.02, TOP), 500), None)
        rows.append(f"frame-{k}.tif,{'12+' + format(west - 12000, '07.3f') if k else west},{west + 10},{TOP - 16},{TOP}")
    (tmp_path / "frames.csv").write_text("\n".join(rows), encoding="utf-8")
    said = told("image", "import", NAME, tmp_path / "frames.csv", "--kind", "thermal", "--name", "frames")
    assert (said["image"]["frames"], said["image"]["placement"]) == (5, "frames")
    assert said["image"]["warnings"] == []
    first = stored(conn, "imported_frames")[246]
    chainage, arc = first.places()
    held = np.isfinite(first.values)
    assert np.abs(first.values - temperature(chainage[None], arc[:, None]))[held].max() < 0.05
    assert held[:, chainage > WEST + 0.1].mean() > 0.99


def test_frames_that_fit_badly_are_warned_of(example: str, tmp_path: Path) -> None:
    write(tmp_path / "f.tif", np.ones((200, 500), np.float32), None)
    rows = [
        "file,chainage_from,chainage_to,arc_from,arc_to",
        "f.tif,12310,12320,-2,2",
        "f.tif,12320,12330,-2,3",
        "f.tif,0,10,-2,2",
    ]
    (tmp_path / "frames.csv").write_text("\n".join(rows), encoding="utf-8")
    warnings = told("image", "import", NAME, tmp_path / "frames.csv", "--kind", "thermal")["image"]["warnings"]
    assert "exceeds the survey by" in warnings[0]
    assert warnings[1] == "1 frame of 3 outside the survey's lining"
    assert "differ by up to 25 %" in warnings[2]


@pytest.mark.parametrize(("dtype", "step"), [(np.uint8, 1), (np.uint16, 257)])
def test_photos_keep_their_colours(conn: psycopg.Connection, example: str, tmp_path: Path, dtype: type, step: int) -> None:
    photo = np.zeros((3, 400, 600), dtype)
    photo[0, :, :300], photo[1, :, 300:], photo[2] = 200 * step, 150 * step, 30 * step
    told("image", "import", NAME, write(tmp_path / "p.tif", photo, STATED, photometric="RGB"), "--kind", "photo")
    run("image", NAME, "-o", tmp_path)
    with rasterio.open(tmp_path / f"{NAME}-km012-imported-photo.tif") as written:
        assert written.count == 4
        for chainage, colour in ((WEST + 3.0, (200, 0, 30, 255)), (WEST + 9.0, (0, 150, 30, 255)), (WEST + 20.0, (0, 0, 0, 0))):
            column, row = ~written.transform @ (chainage, TOP - 4.0)
            found = written.read(window=((int(row), int(row) + 1), (int(column), int(column) + 1)))[:, 0, 0]
            assert found.tolist() == list(colour), chainage


@pytest.mark.parametrize(
    ("place", "message"),
    [
        (None, "has no coordinates: give control points"),
        (Affine(0.02, 0, WEST, 0, 0.02, -8.0), "the image is mirrored"),
        (Affine(0.02, 0, 0.0, 0, -0.02, TOP), "the image is outside the survey"),
        (Affine(0.02, 0, WEST, 0, -0.02, 40.0), "the image is beside the lining"),
    ],
)
def test_an_image_that_cannot_fit_is_refused(example: str, tmp_path: Path, place: Affine | None, message: str) -> None:
    image = write(tmp_path / "x.tif", np.ones((800, 1000), np.float32), place)
    done = run("image", "import", NAME, image, "--kind", "thermal")
    assert done.exit_code == 2
    assert message in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_wrong_files_are_refused(example: str, tmp_path: Path) -> None:
    good = write(tmp_path / "x.tif", np.ones((80, 100), np.float32), STATED)
    vrt = tmp_path / "x.vrt"
    vrt.write_text(f'<VRTDataset rasterXSize="1" rasterYSize="1"><SourceFilename>{good}</SourceFilename></VRTDataset>')
    utm = write(tmp_path / "utm.tif", np.ones((80, 100), np.float32), STATED, crs="EPSG:25833")
    five = write(tmp_path / "five.tif", np.ones((5, 80, 100), np.float32), STATED)
    real = write(tmp_path / "real.tif", np.ones((3, 80, 100), np.float32), STATED, photometric="RGB")
    outside = tmp_path / "outside.csv"
    outside.write_text("column,row,chainage,arc\n1,2,12310,1\n500,2,12320,1\n")
    mirrored = tmp_path / "frames.csv"
    mirrored.write_text("file,chainage_from,chainage_to,arc_from,arc_to\nx.tif,12310,12320,5,1\n")
    lost = tmp_path / "lost.csv"
    lost.write_text("file,chainage_from,chainage_to,arc_from,arc_to\nnone.tif,12310,12320,1,5\n")
    for words, message in (
        ([vrt], "is no GeoTIFF, PNG or JPEG"),
        ([tmp_path / "none.tif"], "no such file"),
        ([utm], "has the coordinate system ETRS89 / UTM zone 33N"),
        ([five], "has 5 bands; choose one by --band"),
        ([real], "its colours have the type float32"),
        ([five, "--band", 6], "--band 6: it has 5"),
        ([good, "--points", outside], "line 3: column 500, row 2 is outside the image"),
        ([mirrored], "line 2: the image is mirrored"),
        ([lost], "line 2:"),
        ([good, "--name", "Night 1"], "small letters"),
        ([good, "--pixel", 0.03], "it must be 0.002 m to 5 m and divide 50 m"),
        ([good, "--scale", 0], "all values would be equal"),
    ):
        done = run("image", "import", NAME, *words, "--kind", "thermal")
        assert done.exit_code == 2, (words, done.output)
        assert message in done.stderr, done.stderr
    assert told("image", "import", NAME, five, "--band", 3, "--kind", "other")["blocks"] == 1


def test_values_are_read_in_sql(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    if conn.execute("SELECT FROM pg_available_extensions WHERE name = 'postgis_raster'").fetchone() is None:
        pytest.skip("no postgis_raster")
    conn.execute("CREATE EXTENSION postgis_raster SCHEMA public")
    conn.commit()
    told("image", "import", NAME, write(tmp_path / "a.tif", strip(STATED), STATED), "--kind", "thermal")
    conn.execute("SET LOCAL ROLE tunnel_viewer")
    (kind, survey) = conn.execute("SELECT image, survey_id FROM tunnel_api.imported_image").fetchone()
    (value,) = conn.execute("SELECT tunnel_api.image_value(%s, %s, %s, %s)", [survey, kind, *SPOTS[1]]).fetchone()
    assert value == pytest.approx(18.0, abs=0.1)


def test_stages_keep_imported_images(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    told("image", "import", NAME, write(tmp_path / "a.tif", strip(STATED), STATED), "--kind", "thermal")
    before = conn.execute("SELECT kind, block, md5(tiff) FROM tunnel.image WHERE kind ~ 'imported' ORDER BY 1, 2").fetchall()
    assert len(before) == 3
    survey = get_survey(conn, NAME)
    grid = Grid.covering(12, 0.05, -9.0, 9.0)
    shape = grid.rows, grid.block_columns
    window = Window(slice(0, shape[1]), *(np.ones(shape, np.float32) for _ in fields(Window)[1:]))
    ImageStore(conn, survey, ("offset",)).save(grid, window)
    assert conn.execute("SELECT count(*) FROM tunnel.image WHERE kind !~ 'imported'").fetchone() == (1,)
    clear_kilometre(conn, survey, 12)
    assert conn.execute("SELECT kind, block, md5(tiff) FROM tunnel.image ORDER BY 1, 2").fetchall() == before


def test_an_archive_has_imported_images(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    told("image", "import", NAME, write(tmp_path / "a.tif", strip(STATED), STATED), "--kind", "thermal")
    assert run("survey", "export", NAME, "-o", tmp_path / "s.tdb").exit_code == 0
    done = run("survey", "import", tmp_path / "s.tdb", "--name", "copy-2024")
    assert done.exit_code == 0, done.output
    first, second = (told("image", "list", name)["images"] for name in (NAME, "copy-2024"))
    assert first == second
    rows = conn.execute(
        "SELECT s.name, i.kind, i.block, md5(i.tiff) FROM tunnel.image i JOIN tunnel.survey s ON s.id = i.survey_id"
        " WHERE i.kind ~ 'imported' ORDER BY 1, 2, 3"
    ).fetchall()
    assert [row[1:] for row in rows if row[0] == NAME] == [row[1:] for row in rows if row[0] == "copy-2024"]
    assert len(rows) == 6


def test_a_viewer_sees_the_list_and_may_not_import(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    told("image", "import", NAME, write(tmp_path / "a.tif", strip(STATED, 300), STATED), "--kind", "thermal")
    conn.execute("SET LOCAL ROLE tunnel_viewer")
    assert conn.execute("SELECT survey, name, kind FROM tunnel_api.imported_image").fetchall() == [(NAME, "thermal", "thermal")]
    with pytest.raises(psycopg.errors.InsufficientPrivilege):
        conn.execute("DELETE FROM tunnel.imported_image")
    conn.rollback()
    conn.execute("SET LOCAL ROLE tunnel_operator")
    assert conn.execute("DELETE FROM tunnel.imported_image").rowcount == 1
