"""The commands leaks and image on a survey made by hand, read back by other libraries."""

import csv
import json
import math
import re

import numpy as np
import psycopg
import pyogrio
import pyogrio.raw
import pytest
import rasterio
import shapely
from click.testing import CliRunner
from PIL import Image
from support.example_survey import without_intensity

from tunneldb.cli.main import main

COLUMNS = [
    *("id", "km", "chainage_from", "chainage_to", "label", "arc_from", "arc_to", "clock"),
    *("kind", "confidence", "reasons", "contrast", "area"),
    *("drop_mean", "drop_max", "image_share", "review", "reviewed_by", "reviewed_at"),
]


def run(*arguments, code=0):
    result = CliRunner().invoke(main, [str(a) for a in arguments], catch_exceptions=False)
    assert result.exit_code == code, result.output
    return result


def listed(text):
    """The leaks of a CSV, behind the stretches for which they can't be vouched for."""
    return [row for row in csv.DictReader(text.splitlines()) if row["id"]]


@pytest.mark.parametrize(
    ("chainage", "label"),
    [
        (12345.678, "12+345.678"),
        (0.0, "0+000.000"),
        (999.9996, "1+000.000"),
        (12999.9999, "13+000.000"),
        (511746.75, "511+746.750"),
        (-5.25, "-0+005.250"),
        (-0.0001, "0+000.000"),
        (-1234.5, "-1+234.500"),
    ],
)
def test_chainage_labels(conn, chainage, label):
    assert conn.execute("SELECT tunnel_api.chainage_label(%s)", [chainage]).fetchone() == (label,)
    (back,) = conn.execute("SELECT tunnel_api.chainage_parse(%s)", [label]).fetchone()
    assert back == pytest.approx(chainage, abs=0.0005)


def test_chainage_is_parsed_or_refused(conn):
    def parse(text):
        return conn.execute("SELECT tunnel_api.chainage_parse(%s)", [text]).fetchone()[0]

    assert parse(" 12+345 ") == 12345.0
    assert parse("12345.5") == 12345.5
    for text in ("12+34", "12+3456", "a", "", "1+2+3", "12 345"):
        with pytest.raises(psycopg.errors.InvalidTextRepresentation), conn.transaction():
            parse(text)


def test_wet_area_is_cut_at_the_ends_and_leaves_out_the_rejected(conn, example):
    leaks = conn.execute(
        "SELECT chainage_from, chainage_to, area, review FROM tunnel.finding WHERE kind = 'leak' ORDER BY chainage_from"
    ).fetchall()

    def wet(start, end):
        return conn.execute("SELECT tunnel_api.wet_area(%s, %s, %s)", [example, start, end]).fetchone()[0]

    assert wet(12300, 12500) == pytest.approx(sum(leak[2] for leak in leaks if leak[3] != "rejected"))
    start, end, area, _ = leaks[0]
    middle = (start + end) / 2
    assert 0 < wet(12300, middle) < area
    assert wet(12300, middle) + wet(middle, end) == pytest.approx(area)
    with pytest.raises(psycopg.errors.InvalidParameterValue, match="runs backwards"), conn.transaction():
        wet(12500, 12300)


def test_table_lists_every_leak(example):
    text = run("leaks", example).stdout
    assert "6 leaks, " in text
    assert "; also listed: 1 rejected" in text
    rows = listed(run("leaks", example, "--format", "csv").stdout)
    assert len(rows) == 7
    assert all(row["label"] in text for row in rows)
    assert "confirmed" in text


HEADINGS = [
    *("id", "chainage", "length m", "arc m", "clock", "kind", "conf.", "contrast", "area m²", "drop dB", "max dB", "image"),
    *("review", "by"),
]


@pytest.mark.parametrize("kind", ["leak", "all"])
@pytest.mark.parametrize("width", [80, 100, 120, 132, 200])
def test_table_fits_the_terminal(conn, example, width, kind):
    """What is shown is whole, on one line a leak; what there is no room for is named."""
    conn.execute("UPDATE tunnel.finding SET detected = false, reviewed_by = 'inspectora.de.guardia' WHERE review = 'confirmed'")
    conn.commit()
    terminal = {"FORCE_COLOR": "1", "TERM": "xterm", "COLUMNS": str(width)}
    result = CliRunner().invoke(main, ["leaks", example, "--kind", kind], env=terminal)
    assert result.exit_code == 0
    lines = re.sub(r"\x1b\[[0-9;]*m", "", result.stdout).splitlines()
    assert max(map(len, lines)) <= width
    (head,) = (line for line in lines if "chainage" in line)
    shown = [cell.strip() for cell in head.strip("┃").split("┃")]
    said = " ".join(line.strip() for line in lines[-4:])
    hidden = said.partition("shows: ")[2].split(", ") if "shows: " in said else []
    assert [name for name in HEADINGS if name in shown] == shown
    assert sorted(shown + hidden) == sorted(HEADINGS)
    assert {"id", "chainage", "area m²", "review", *(("kind",) if kind == "all" else ())} <= set(shown)
    assert (width < 200) == bool(hidden)
    rows = [[cell.strip() for cell in line.strip("│").split("│")] for line in lines if line.startswith("│")]
    text = run("leaks", example, "--kind", kind, "--format", "csv").stdout
    by_id = {row["id"]: row for row in listed(text)}
    assert {row[0] for row in rows} == set(by_id)
    for row in rows:
        cells, leak = dict(zip(shown, row, strict=True)), by_id[row[0]]
        assert cells["chainage"] == leak["label"]
        assert cells["review"].partition(",")[0] == leak["review"]
        assert cells["area m²"] == f"{float(leak['area']):.2f}"
    assert "…" not in "".join(lines)


@pytest.mark.parametrize(("kind", "number"), [("leak", 6), ("joint", 1), ("dark", 2), ("all", 9)])
def test_kinds_are_listed_and_exported(conn, example, tmp_path, kind, number):
    conn.execute("UPDATE tunnel_api.finding SET kind = 'dark' WHERE id = 1")
    conn.execute("UPDATE tunnel_api.finding SET kind = 'leak' WHERE kind = 'joint'")
    conn.execute("UPDATE tunnel_api.finding SET kind = 'joint' WHERE id = 2")
    conn.execute("UPDATE tunnel.finding SET confidence = NULL, contrast = NULL WHERE id = 3")
    conn.commit()
    expected = conn.execute(
        "SELECT id, kind, CASE WHEN id NOT IN (1, 2) AND kind_detected <> 'joint' THEN confidence END,"
        " array_to_string(reasons, ', ')"
        " FROM tunnel_api.finding WHERE kind = %s OR %s = 'all' ORDER BY id", (kind, kind),
    ).fetchall()  # fmt: skip
    assert len(expected) == number
    assert kind != "all" or sum(row[2] is not None for row in expected) == 5  # none in a kind that an inspector gave
    features = json.loads(run("leaks", example, "--kind", kind, "--format", "geojson").stdout)
    assert features["name"] == ("anomaly" if kind == "all" else kind) + "_unrolled"
    told = sorted(
        (f["id"], *(f["properties"][name] for name in ("kind", "confidence", "reasons"))) for f in features["features"]
    )
    assert [(k, c, None if conf is None else pytest.approx(conf, abs=1e-4), r) for k, c, conf, r in expected] == told
    path = tmp_path / "dark.gpkg"
    run("leaks", example, "--kind", kind, "-o", path)
    layer = f"{'anomaly' if kind == 'all' else kind}_unrolled"
    meta, _, _, values = pyogrio.raw.read(path, layer=layer, columns=["kind", "confidence", "reasons"])
    columns = dict(zip(meta["fields"], values, strict=True))
    assert sorted(zip(columns["kind"], columns["reasons"], strict=True)) == sorted((row[1], row[3]) for row in expected)
    assert np.isnan(columns["confidence"]).sum() == sum(row[2] is None for row in expected)


def test_kilometres_are_summed_up(conn, example):
    said, *lines = run("leaks", example, "--by-km").stdout.splitlines()
    assert said == "Searched, but unseen 12+300–12+310 (0 % of the lining inspected)"
    header = (
        "km", "lining m²", "seen %", "wet m²", "wet ‰", "leaks", "largest m²", "in 100 m²", "class", "undecided m²",
        "class if wet",
    )  # fmt: skip
    assert lines[0].split() == " ".join(header).split()
    (areas,) = conn.execute("SELECT array_agg(area) FROM tunnel_api.leak WHERE review <> 'rejected'").fetchone()
    # 200 m of tunnel with 18.0 m of wall around, of which the first 10 m were not seen
    lining = 200 * 2 * 4 * np.arccos(-2.5 / 4)
    wet = sum(areas)
    assert lines[1].split() == [
        "12", f"{lining:.0f}", "95.0", f"{wet:.2f}", f"{1000 * wet / (0.95 * lining):.2f}", "6", f"{max(areas):.2f}", "1", "4",
        "0.00", "4",
    ]  # fmt: skip
    assert lines[2].split() == ["all", *lines[1].split()[1:]]
    assert run("leaks", example, "--by-km", "--kind", "all", code=2).stderr.count("\n") == 1


def test_leaks_are_chosen_by_area_and_kilometre(example, dsn):
    rows = listed(run("leaks", example, "--format", "csv", "--min-area", "1.5").stdout)
    assert rows
    assert all(float(row["area"]) >= 1.5 for row in rows)
    assert run("leaks", example, "--km", "13", code=2).stderr.startswith("tunneldb: ")


def test_csv_has_the_columns_and_a_readable_outline(example):
    rows = listed(run("leaks", example, "--format", "csv").stdout)
    assert list(rows[0])[: len(COLUMNS)] == COLUMNS
    for row in rows:
        outline = shapely.from_wkt(row["geometry"])
        assert outline.bounds[0] == pytest.approx(float(row["chainage_from"]), abs=1e-3)
        assert outline.bounds[3] == pytest.approx(float(row["arc_to"]), abs=1e-3)
        # Left of the crown is before 12 o'clock, right after it.
        after = 0 < float(row["clock"]) % 12 < 6
        assert after == (outline.representative_point().y > 0)


@pytest.mark.parametrize("geometry", ["unrolled", "map", "3d"])
@pytest.mark.parametrize("form", ["geojson", "gpkg"])
def test_files_hold_the_chosen_geometry(example, tmp_path, geometry, form):
    path = tmp_path / f"leaks.{form}"
    run("leaks", example, "--geometry", geometry, "-o", path)
    info = pyogrio.read_info(path, layer=f"leak_{geometry}", force_total_bounds=True)
    assert info["features"] == 7
    assert set(COLUMNS) - {"id"} <= set(info["fields"])
    assert info["geometry_type"] == ("Polygon Z" if geometry == "3d" else "Polygon")
    west, _, east, _ = info["total_bounds"]
    if geometry == "unrolled":
        assert 12300 < west < east < 12500
        assert form == "geojson" or info["crs"] is None or "EPSG" not in info["crs"]
    else:
        assert info["crs"] == "EPSG:25830"
        assert 499_000 < west < east < 501_000
    assert sorted(p.name for p in tmp_path.iterdir()) == [path.name]


def test_geometries_agree_with_each_other(example):
    def features(geometry):
        text = run("leaks", example, "--format", "geojson", "--geometry", geometry).stdout
        return {f["id"]: f for f in json.loads(text)["features"]}

    flat, strip, space = (features(g) for g in ("unrolled", "map", "3d"))
    for key, feature in flat.items():
        unrolled = shapely.geometry.shape(feature["geometry"])
        on_map = shapely.geometry.shape(strip[key]["geometry"])
        # On a curve of 300 m the strip is stretched by 1 + arc / R at most.
        stretch = 1 + max(abs(unrolled.bounds[1]), abs(unrolled.bounds[3])) / 300
        assert on_map.is_valid
        assert unrolled.area / stretch < on_map.area < unrolled.area * stretch
        assert feature["properties"]["area"] == pytest.approx(unrolled.area, rel=0.03)
        height = np.array(space[key]["geometry"]["coordinates"][0])[:, 2]
        assert 590 < height.min() < height.max() < 615


def test_a_geopackage_wants_a_file(example):
    assert "-o" in run("leaks", example, "--format", "gpkg", code=2).stderr


def test_a_folder_that_is_not_there_is_named_and_nothing_is_left(example, tmp_path):
    message = run("leaks", example, "-o", tmp_path / "no" / "leaks.csv", code=2).stderr
    assert str(tmp_path / "no" / "leaks.csv") in message
    assert message.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_a_leak_confirmed_but_not_found_again_is_listed(conn, example):
    conn.execute("UPDATE tunnel.finding SET detected = false")
    conn.commit()
    rows = listed(run("leaks", example, "--format", "csv").stdout)
    assert [row["review"] for row in rows] == ["confirmed", "confirmed"]


def test_images_are_cloud_optimized_and_lie_in_the_unrolled_plane(conn, example, tmp_path):
    run("image", example, "-o", tmp_path / "images")
    names = sorted(p.name for p in (tmp_path / "images").iterdir())
    kinds = ("raw", "corrected", "offset", "state", "class")
    assert names == sorted(f"{example}-km012-{kind}.{end}" for kind in kinds for end in ("tif", "png"))
    with rasterio.open(tmp_path / "images" / f"{example}-km012-corrected.tif") as image:
        assert image.tags(ns="IMAGE_STRUCTURE")["LAYOUT"] == "COG"
        assert image.overviews(1)
        assert image.dtypes == ("float32",)
        assert math.isnan(image.nodata)
        assert image.bounds.left == 12300
        assert image.bounds.right == 12500
        pixel = image.transform.a
        values = image.read(1)
        # The leaks that were painted are darker than what lies about them.
        (wkb,) = conn.execute("SELECT ST_AsBinary(unrolled) FROM tunnel.finding ORDER BY id LIMIT 1").fetchone()
        centre = shapely.from_wkb(bytes(wkb)).representative_point()
        row, column = image.index(centre.x, centre.y)
        assert np.nanmean(values[row - 2 : row + 3, column - 2 : column + 3]) < np.nanmedian(values) - 2
    with Image.open(tmp_path / "images" / f"{example}-km012-corrected.png") as picture:
        assert picture.width > 100.0 / max(pixel, 0.05)  # a hectometre a strip, and the margin
        assert len(picture.getcolors(1 << 24)) > 100


def test_images_of_a_survey_without_any(conn, example):
    conn.execute("DELETE FROM tunnel.image")
    conn.commit()
    assert "tunneldb run" in run("image", example, code=2).stderr


def test_no_leaks_where_none_were_sought_are_said_to_be_so(conn, example):
    assert "sought" not in run("leaks", example).stderr
    without_intensity(conn)
    for option in ([], ["--by-km"], ["--format", "csv"]):
        assert (
            run("leaks", example, *option, code=1).stderr == f"survey {example} has no intensity: leaks were not searched for\n"
        )
