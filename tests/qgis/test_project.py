"""The QGIS project, opened, drawn and edited by real QGIS where it is installed."""

from __future__ import annotations

import re
import shutil
import subprocess
import warnings
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import psycopg
import pytest
import rasterio
from click.testing import CliRunner, Result
from PIL import Image
from psycopg import sql
from psycopg.conninfo import make_conninfo
from rasterio.errors import NotGeoreferencedWarning
from support.coloured_image import ABOVE, BELOW, add_image_in_colour
from support.example_survey import LEAKS, example_surface, thin_images, without_intensity
from support.pdf import words
from support.qgis import ENVIRONMENT, PYTHON, SCRIPT, Look, act, opened
from support.system import missing

from tunneldb.classification.classes import PointClass
from tunneldb.cli.main import main
from tunneldb.export.images.palette import COLOURS, PALETTES, hexadecimal
from tunneldb.export.qgis.layer import CHANGE_LAYERS, SCANNER_LAYERS, STRUCTURE_LAYERS, UNDERWATER_LAYERS
from tunneldb.export.tables.leaks import clock_label

ON_MAP = {
    "axis": "LineStringZ",
    "axis_vertex": "PointZ",
    "segment": "LineStringZ",
    "section": "LineStringZ",
    "leak_map": "Polygon",
    "dark_map": "Polygon",
    "target_sphere": "PointZ",
    "cluster": "Polygon",
    "outline": "LineString",
    "ground": "LineStringZ",
    "leak_3d": "PolygonZ",
    "clearance_map": "LineString",
    "clearance_infringement_3d": "MultiPointZ",
    "detectability_map": "Polygon",
    "ring_map": "Polygon",
    "action_map": "Point",
    "deviation_map": "LineString",
}
IMAGES = ("raw", "corrected", "corrected-filled", "offset", "state", "class")
UNROLLED = {
    "leak_unrolled": "Polygon", "dark_unrolled": "Polygon", "section_unrolled": "LineString", "region": "Polygon",
    "sheet": "Polygon", "leak_sheet": "Polygon", "coverage_gap": "Polygon", "dark_band": "Polygon", "detectability": "Polygon",
    "clearance_unrolled": "Polygon",
    "clearance_infringement_unrolled": "MultiPolygon",
    "action_unrolled": "Point", "ring_unrolled": "Polygon", "deviation_bar": "Polygon", "evenness_area": "Polygon",
}  # fmt: skip
NOT_AT_FIRST = {"dark_unrolled", "detectability", "leak_sheet", "ring_unrolled", "deviation_bar", "evenness_area"}
"""Layers of the unrolled plane that its theme does not show."""
FINDINGS = {
    f"finding_{name}_{place}": kind + z
    for place, z in (("map", ""), ("unrolled", ""), ("3d", "Z"))
    for name, kind in (("point", "Point"), ("line", "LineString"), ("area", "Polygon"))
}
ON_SHEETS = {
    "finding_point_sheet": "Point", "finding_line_sheet": "LineString", "finding_area_sheet": "Polygon",
}  # fmt: skip
LISTS = {"finding_photo", "finding_kind", "severity", "sheet_finding"}
STYLED = {*ON_MAP, *UNROLLED} - {"leak_sheet", "dark_map", "dark_unrolled"}


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


def write(output: Path | None, *options: str, dsn: str | None = None) -> Result:
    where = [] if dsn is None else ["--dsn", dsn]
    file = [] if output is None else ["-o", str(output)]
    return CliRunner().invoke(main, [*where, "qgis", "demo-2024", *file, *options])


@pytest.fixture(scope="module")
def shared_dsn(server_dsn: str, example_template: str) -> str:
    """Database of the tests that only read."""
    with psycopg.connect(server_dsn, autocommit=True) as connection:
        connection.execute(sql.SQL("CREATE DATABASE qgis_shared TEMPLATE {}").format(sql.Identifier(example_template)))
    return make_conninfo(server_dsn, dbname="qgis_shared")


@pytest.fixture(scope="module")
def shared(shared_dsn: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Project of the tests that only read."""
    path = tmp_path_factory.mktemp("project") / "demo.qgz"
    result = write(path, dsn=shared_dsn)
    assert result.exit_code == 0, result.output
    return path


@pytest.fixture(scope="module")
def look(shared: Path) -> Iterator[Look]:
    """Function that looks at it in a QGIS in which it is open, and changes nothing."""
    with opened(shared) as look:
        yield look


@pytest.fixture(scope="module")
def seen(look: Look) -> dict[str, Any]:
    """What QGIS sees of it."""
    return look("describe")


@pytest.fixture
def rows(shared_dsn: str) -> Iterator[psycopg.Connection]:
    """Connection to the database of the tests that only read."""
    with psycopg.connect(shared_dsn) as connection:
        yield connection


@pytest.fixture
def project(shared: Path, conn: psycopg.Connection, tmp_path: Path) -> Path:
    """The same project on a database of the test's own."""
    path = tmp_path / "own.qgs"
    path.write_text(qgs(shared).replace("dbname='qgis_shared'", f"dbname='{conn.info.dbname}'"), encoding="utf-8")
    (tmp_path / "demo-images").symlink_to(shared.parent / "demo-images")
    return path


def qgs(path: Path) -> str:
    with zipfile.ZipFile(path) as archive:
        (name,) = archive.namelist()
        return archive.read(name).decode()


def test_every_layer_is_valid_and_whole(rows: psycopg.Connection, seen: dict[str, Any]) -> None:
    layers = seen["layers"]
    assert {name for name, layer in layers.items() if not layer["valid"]} == set()
    images = {f"demo-2024-km012-{kind}" for kind in IMAGES}
    assert set(layers) == {*ON_MAP, *UNROLLED, *FINDINGS, *ON_SHEETS, *LISTS, "remark", *images}
    assert seen["crs"] == "EPSG:25830"
    for name, kind in (ON_MAP | UNROLLED).items():
        layer = layers[name]
        view = {"leak_sheet": "sheet_leak", "dark_map": "finding_map", "dark_unrolled": "finding_unrolled"}.get(name, name)
        dry = "AND kind IN ('joint', 'dark') AND GeometryType(geom) = 'POLYGON'" if view.startswith("finding_") else ""
        on_sheet = "AND review <> 'rejected'" if name == "leak_sheet" else ""
        (count,) = rows.execute(  # type: ignore[misc]
            f"SELECT count(*) FROM tunnel_api.{view} WHERE survey = 'demo-2024' {dry} {on_sheet}"  # type: ignore[arg-type]
        ).fetchone()
        assert (layer["wkb"], layer["features"]) == (kind, count), name
        assert layer["crs"] == ("EPSG:25830" if name in ON_MAP else ""), name
        assert layer["error"] == "", name
    for name, kind in FINDINGS.items():
        (count,) = rows.execute(  # type: ignore[misc]
            "SELECT count(*) FROM tunnel_api.finding WHERE GeometryType(unrolled) = upper(%s) AND (%s OR manual AND NOT wet)",
            [kind.removesuffix("Z"), not name.endswith("3d")],
        ).fetchone()
        assert (layers[name]["wkb"], layers[name]["features"], layers[name]["error"]) == (kind, count, ""), name
        assert layers[name]["crs"] == ("" if name.endswith("unrolled") else "EPSG:25830"), name
    for name, kind in ON_SHEETS.items():
        assert (layers[name]["wkb"], layers[name]["read_only"], layers[name]["error"]) == (kind, True, ""), name
    (remarks,) = rows.execute("SELECT count(*) FROM tunnel_api.remark WHERE survey = 'demo-2024'").fetchone()  # type: ignore[misc]
    assert layers["remark"]["counted"] == remarks, "what stands beside its name is no estimate"
    for kind in IMAGES:
        assert layers[f"demo-2024-km012-{kind}"]["crs"] == ""


def test_height_reaches_qgis(rows: psycopg.Connection, seen: dict[str, Any]) -> None:
    layers = seen["layers"]
    for name in ("axis_vertex", "axis", "segment", "section", "leak_3d", "target_sphere", "ground"):
        heights = rows.execute(f"SELECT ST_ZMax(geom) FROM tunnel_api.{name}").fetchall()  # type: ignore[arg-type]
        assert sorted(layers[name]["z"]) == pytest.approx(sorted(z for (z,) in heights)), name
    assert layers["target_sphere"]["clamping"] == "absolute"
    for name in ("axis", "section", "leak_3d", "ground"):
        assert (layers[name]["clamping"], layers[name]["binding"]) == ("absolute", "vertex")


def test_only_what_may_be_edited_is_editable(seen: dict[str, Any]) -> None:
    layers = seen["layers"]
    for name in ("leak_map", "leak_unrolled", "leak_3d", "dark_map", "dark_unrolled"):
        assert (layers[name]["read_only"], layers[name]["editable"]) == (False, ["kind", "review", "remark"])
        assert layers[name]["widget"]["review"] == layers[name]["widget"]["kind"] == "ValueMap"
        assert set(layers[name]["aliases"]) == set(layers[name]["widget"]) - {"geom"}
    assert (layers["axis_vertex"]["read_only"], layers["axis_vertex"]["editable"]) == (False, [])
    assert all(
        layers[name]["read_only"]
        for name in (
            "axis",
            "segment",
            "section",
            "section_unrolled",
            "target_sphere",
            "cluster",
            "outline",
            "ground",
            "sheet",
            "leak_sheet",
            "coverage_gap",
            "dark_band",
            "detectability",
            "detectability_map",
        )
    )


def test_themes_and_views(seen: dict[str, Any]) -> None:
    assert set(seen["themes"]) == {
        "Map", "Unrolled", "Findings", "Findings on the map", "Deviation", "3D", "Inspection sheets",
    }  # fmt: skip
    assert set(seen["themes"]["Deviation"]) == {"deviation_bar", "evenness_area"}
    assert set(seen["themes"]["Inspection sheets"]) == {
        "coverage_gap", "dark_band", "leak_sheet", *ON_SHEETS, "demo-2024-km012-corrected", "demo-2024-km012-corrected-filled",
    }  # fmt: skip
    assert set(seen["themes"]["Map"]) == {
        "action_map", "axis", "axis_vertex", "segment", "section", "leak_map", "target_sphere", "cluster", "outline",
        "clearance_map", "clearance_infringement_3d",
    }  # fmt: skip
    assert set(seen["themes"]["3D"]) == {
        *(name for name in FINDINGS if name.endswith("3d")),
        "axis",
        "section",
        "leak_3d",
        "target_sphere",
        "ground",
        "clearance_infringement_3d",
    }
    images = {"demo-2024-km012-corrected", "demo-2024-km012-corrected-filled"}
    unrolled = {name for name in FINDINGS if name.endswith("unrolled")}
    assert set(seen["themes"]["Findings"]) == {*unrolled, "region", "sheet", *images}
    assert set(seen["themes"]["Findings on the map"]) == {"axis", "outline", *(n for n in FINDINGS if n.endswith("map"))}
    assert set(seen["themes"]["Unrolled"]) == {*UNROLLED, *images} - NOT_AT_FIRST
    assert seen["bookmarks"] == ["Map", "Unrolled", "Unrolled, km 12"]
    # all there is to the map, without the unrolled plane: there a new 3D view begins
    assert seen["full_extent"] == seen["extent"]
    # the second canvas follows the theme, and starts where there is lining
    assert seen["canvas_theme"] == "Unrolled"
    low, high = (corner.split(",") for corner in seen["canvas_extent"].split(" : "))
    assert 12300 <= float(low[0]) < float(high[0]) <= 12500
    assert float(low[1]) < -9 < 9 < float(high[1])


@pytest.mark.parametrize("theme", ["Map", "Unrolled"])
def test_themes_are_drawn(look: Look, tmp_path: Path, theme: str) -> None:
    picture = tmp_path / f"{theme}.png"
    assert look("render", theme, str(picture)) == {"saved": True, "errors": []}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NotGeoreferencedWarning)
        image = rasterio.open(picture)
    with image:
        pixels = image.read([1, 2, 3]).astype(int)
    inked = (pixels < 250).any(axis=0)
    colourful = np.ptp(pixels, axis=0) > 80
    orange = (pixels[0] > 180) & (pixels[1] > 80) & (pixels[1] < 180) & (pixels[2] < 80)
    assert orange.sum() > 30, "an open leak"
    assert colourful.sum() > 200
    # the image of the lining fills half of its picture; a map of a tunnel is mostly paper
    assert 0.4 < inked.mean() < 0.9 if theme == "Unrolled" else 0.01 < inked.mean() < 0.3
    if theme == "Unrolled":
        rows = np.flatnonzero(inked.mean(axis=1) > 0.9)
        assert rows[-1] - rows[0] > 0.4 * inked.shape[0], "the lining"


def test_states_are_named_and_drawn_in_their_colours(look: Look, seen: dict[str, Any], tmp_path: Path) -> None:
    entries = PALETTES["state"].entries
    legend = [[code, name, hexadecimal(colour)] for code, (name, colour) in entries.items()]
    assert seen["layers"]["demo-2024-km012-state"]["legend"] == legend
    assert [name for _, name, _ in legend] == ["unseen", "lining", "recess", "appendage", "floor", "dark", "submerged"]
    picture = tmp_path / "state.png"
    # 160 m along the tunnel by 64 m across in 1600 × 640 pixels: one of the image is one of the picture
    assert look("draw_layer", "demo-2024-km012-state", "12300,-32,12460,32", str(picture))["saved"]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NotGeoreferencedWarning)
        image = rasterio.open(picture)
    with image:
        pixels = image.read([1, 2, 3])
    area = {
        name: (pixels == np.array(colour)[:, None, None]).all(axis=0).sum() * 0.01 for name, colour in entries.values()
    }  # fmt: skip
    # the wall is 18.0 m round, of which 0.4 m are hidden by a cable
    assert area["unseen"] == pytest.approx(10 * (17.96 - 0.4), rel=0.02)
    assert area["recess"] == pytest.approx(4, abs=0.5)
    assert area["appendage"] == pytest.approx(160 * 0.4, rel=0.1)
    assert area["dark"] > 5


def test_classes_are_named_and_drawn_in_their_colours(look: Look, seen: dict[str, Any], tmp_path: Path) -> None:
    legend = {klass: (klass.name.lower(), hexadecimal(colour)) for klass, colour in COLOURS.items()}
    assert seen["layers"]["demo-2024-km012-class"]["legend"] == [[int(k), name, colour] for k, (name, colour) in legend.items()]
    picture = tmp_path / "class.png"
    # 160 m along the tunnel by 64 m across in 1600 × 640 pixels: one of the image is one of the picture
    assert look("draw_layer", "demo-2024-km012-class", "12320,-32,12480,32", str(picture))["saved"]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NotGeoreferencedWarning)
        image = rasterio.open(picture)
    with image:
        pixels = image.read([1, 2, 3])
    shares = {klass: (pixels == np.array(colour)[:, None, None]).all(axis=0).mean() for klass, colour in COLOURS.items()}
    # the wall is 18.0 m round and the floor 6.2 m wide, of 64 m
    assert shares[PointClass.LINING] == pytest.approx(17.96 / 64, rel=0.02)
    assert shares[PointClass.GROUND] == pytest.approx(6.24 / 64, rel=0.05)
    for klass in (PointClass.OBJECT, PointClass.RAIL, PointClass.APPENDAGE):
        assert shares[klass] > 0, klass


@pytest.fixture(scope="module")
def sheets(shared: Path, look: Look) -> Path:
    """The inspection sheets, printed."""
    path = shared.with_name("sheets.pdf")
    assert look("atlas", str(path)) == {"saved": True, "error": "", "sheets": 4}
    return path


def test_sheets_keep_their_scale_in_the_preview(look: Look) -> None:
    assert look("preview") == {"scales": [200] * 4}


def test_a_sheet_is_printed_for_each_50_m(sheets: Path) -> None:
    for number, page in enumerate(words(sheets), start=1):
        start = 250 + 50 * number
        assert f"12+{start} – 12+{start + 50}" in page
        assert f"Inspection sheet {number} of 4" in page
        assert all(f"12+{start + along}" in page.split("Tunnel demo")[0] for along in range(0, 51, 10)), "ticks"
    assert number == 4


def test_a_sheet_lists_its_leaks_and_no_others(sheets: Path) -> None:
    middles = [chainage for chainage, _, _, review in LEAKS if review != "rejected"]
    for number, page in enumerate(words(sheets)):
        listed = [float(f"{km}{m}") for km, m in re.findall(r"\b(12)\+(\d{3}\.\d{3})\b", page)]
        assert listed == pytest.approx([m for m in middles if 0 <= m - 12300 - 50 * number < 50], abs=0.5)
        assert f"leaks {len(listed)}, " in page
        assert page.count("confirmed") == 1 + (2 if number == 2 else 0), "beside the legend"
        assert page.count("Drop, dB") == 1, "no second table where the first has room"


def test_the_sheet_writes_the_clock_as_the_list_of_leaks_does(rows: psycopg.Connection, sheets: Path) -> None:
    stated = rows.execute("SELECT label, clock FROM tunnel_api.leak WHERE counted").fetchall()
    assert len(stated) > 3
    pages = words(sheets)
    for label, clock in stated:
        (page,) = [page for page in pages if label in page]
        assert clock_label(clock) in page.split(label)[1][:16], label


def test_a_leak_over_the_edge_of_a_sheet_is_in_both_tables(conn: psycopg.Connection, project: Path, tmp_path: Path) -> None:
    """And one beside the edge in its own sheet's, and seen on no other: a sheet shows its own 50 m."""
    crowd(conn, 2, 0.5, "No %s")  # from 12351.5 and 12352.0
    for number, (start, end) in {1: (12349.9, 12350.2), 2: (12350.3, 12350.8)}.items():
        conn.execute(
            "UPDATE tunnel.finding SET chainage_from = %s, chainage_to = %s, unrolled = ST_MakeEnvelope(%s, 0, %s, 0.5)"
            " WHERE remark = %s",
            (start, end, start, end, f"No {number}"),
        )
    conn.commit()
    act(project, "atlas", str(tmp_path / "edge.pdf"))
    pages = words(tmp_path / "edge.pdf")
    assert ["No 1" in page for page in pages] == [True, True, False, False]
    assert ["No 2" in page for page in pages] == [False, True, False, False]
    strip = re.search(r'<LayoutItem[^>]*id="strip".*?<Extent ([^>]*)/>', project.read_text("utf-8"), re.DOTALL)
    assert strip is not None
    sides = {side: float(value) for side, value in re.findall(r'(\w+)="([^"]*)"', strip[1])}
    assert sides["xmax"] - sides["xmin"] == pytest.approx(50.0)


def crowd(conn: psycopg.Connection, count: int, apart: float, remark: str) -> None:
    """Put so many leaks on the second sheet, some metres apart, each with a remark; the database has the last first."""
    conn.execute("DELETE FROM tunnel.finding WHERE kind <> 'leak'")
    conn.execute(
        "INSERT INTO tunnel.finding (survey_id, km, chainage_from, chainage_to, arc_from, arc_to, clock, kind, reasons, area, "
        "darkening_mean, darkening_max, image_share, unrolled, map, surface, remark) "
        "SELECT survey_id, km, at, at + 0.05, 0, 0.1, clock, kind, reasons, 0.01, darkening_mean, darkening_max, 1, "
        "ST_MakeEnvelope(at, 0, at + 0.05, 0.1), map, surface, format(%s, i) "
        "FROM tunnel.finding, generate_series(%s, 1, -1) AS i, LATERAL (SELECT 12351 + i * %s AS at) AS placed WHERE id = 1",
        (remark, count, apart),
    )
    conn.commit()


def test_long_tables_go_on_on_another_page(conn: psycopg.Connection, project: Path, tmp_path: Path) -> None:
    crowd(conn, 60, 0.5, "No %s")
    assert act(project, "atlas", str(tmp_path / "long.pdf"))["sheets"] == 4
    pages = words(tmp_path / "long.pdf")
    assert ["leaks continued" in page for page in pages] == [False, False, True, False, False]
    assert [page.count("Drop, dB") for page in pages] == [1, 1, 2, 1, 1]
    remarks = [int(number) for page in pages for number in re.findall(r"\bNo (\d+)\b", page)]
    assert remarks == list(range(1, 61))
    assert "more leaks" not in "".join(pages)


def test_a_table_that_is_too_long_says_how_many_leaks_it_lacks(conn: psycopg.Connection, project: Path, tmp_path: Path) -> None:
    """Also where each leak has a long remark, of which there is no room for more than a line."""
    crowd(conn, 600, 0.08, "No %s drips\nfrom a crack beside the joint, more in winter")
    assert act(project, "atlas", str(tmp_path / "long.pdf"))["sheets"] == 4
    pages = words(tmp_path / "long.pdf")
    listed = [int(number) for page in pages for number in re.findall(r"\bNo (\d+)\b", page)]
    assert listed == list(range(1, len(listed) + 1))
    assert 400 < len(listed) < 600
    assert ["more leaks" in page for page in pages] == [False] * 6 + [True] + [False] * 2
    assert f"... and {600 - len(listed)} more leaks: table of the report" in pages[6]
    assert "leaks 600, " in pages[1]


def draw(conn: psycopg.Connection, kind: str, shape: str, *, severity: int | None = None, review: str = "confirmed") -> int:
    """Draw a finding on the unrolled lining, with a remark; return its number."""
    row = conn.execute(
        "INSERT INTO tunnel_api.finding_unrolled (survey, kind, severity, width_mm, review, remark, geom)"
        " VALUES ('demo-2024', %s, %s, 2, %s, %s, ST_GeomFromText(%s)) RETURNING id",
        (kind, severity, review, f"a {kind}", shape),
    ).fetchone()
    assert row is not None
    return int(row[0])


def test_a_sheet_lists_findings_by_kind_and_each_in_one_table(conn: psycopg.Connection, project: Path, tmp_path: Path) -> None:
    """In the owner's words; what does not count is told by its number, and not drawn."""
    conn.execute("UPDATE tunnel_api.severity SET label = 'Stufe 3' WHERE id = 3")
    bolt = draw(conn, "missing_bolt", "POINT(12360 1)")
    spall = draw(conn, "spall", "POLYGON((12370 1, 12372 1, 12372 2, 12370 2, 12370 1))", severity=3)
    crack = draw(conn, "crack", "LINESTRING(12380 1, 12384 1)")
    drip = draw(conn, "drip", "POINT(12390 1)", severity=3)
    draw(conn, "crack", "LINESTRING(12385 3, 12387 3)", review="rejected")
    conn.commit()
    with opened(project) as look:
        look("atlas", str(tmp_path / "findings.pdf"))
        drawn = {name: look("numbers", name)["numbers"] for name in ON_SHEETS}
    page = words(tmp_path / "findings.pdf")[1]
    leaks, _, findings = page.partition("Size Severity State Remark")
    # 1 m of arc is 0.25 of 4 m of radius: 29 minutes. The tunnel bends to the right by 1 / 300 m: there lengths are 0.3 % less
    # than unrolled, and areas 1.5 m from the crown 0.5 %.
    listed = [
        f"{crack} Crack 12+382.000 12:29 3.99 m, 2.00 mm confirmed a crack",
        f"{spall} Spall 12+371.000 12:43 1.99 m2 Stufe 3 confirmed a spall",
        f"{bolt} Missing bolt 12+360.000 12:29 confirmed",
    ]
    places = [findings.find(line) for line in listed]
    assert -1 < places[0] < places[1] < places[2], findings
    assert f"{drip} 12+390.000" in leaks
    assert "Drip, Stufe 3; a drip" in leaks
    assert str(drip) not in findings.split("Inspected by")[0].split(listed[2])[0]
    assert "other findings 3" in page
    assert "Not counted and not drawn: 1 rejected" in page
    assert drawn == {"finding_point_sheet": [bolt, drip], "finding_line_sheet": [crack], "finding_area_sheet": [spall]}


def test_a_table_that_is_too_long_says_how_many_findings_it_lacks(
    conn: psycopg.Connection, project: Path, tmp_path: Path
) -> None:
    """Here some 250 fit."""
    draw(conn, "crack", "LINESTRING(12351 3, 12351.1 3)")
    conn.execute(
        "INSERT INTO tunnel.finding (survey_id, km, chainage_from, chainage_to, arc_from, arc_to, clock, kind, reasons, area,"
        " length, width_mm, unrolled, map, surface, shape, shape_map, shape_surface, origin, manual, review, remark)"
        " SELECT survey_id, km, chainage_from + i * 0.1, chainage_to + i * 0.1, arc_from, arc_to, clock, kind, reasons, area,"
        " length, width_mm, ST_Translate(unrolled, i * 0.1, 0), map, surface, ST_Translate(shape, i * 0.1, 0), shape_map,"
        " shape_surface, origin, manual, review, 'No ' || i || ', wet in winter, dry in summer'"
        " FROM tunnel.finding, generate_series(1, 299) AS i WHERE manual"
    )
    conn.commit()
    act(project, "atlas", str(tmp_path / "long.pdf"))
    pages = words(tmp_path / "long.pdf")
    assert ["findings continued" in page for page in pages] == [False] * 2 + [True] * 3 + [False] * 2
    listed = sum(page.count(" Crack 12+3") for page in pages)
    assert 240 < listed < 260
    assert f"... and {300 - listed} more findings: table of the report" in pages[4]


def test_findings_are_drawn_with_what_the_form_begins_with(conn: psycopg.Connection, project: Path) -> None:
    conn.execute("UPDATE tunnel_api.finding_kind SET active = false WHERE code = 'spall'")
    conn.commit()
    done = act(project, "draw_findings")
    assert all(one["saved"] for one in done.values()), done
    rows = conn.execute(
        "SELECT kind, origin, review, survey, GeometryType(unrolled) FROM tunnel_api.finding WHERE manual ORDER BY id"
    ).fetchall()
    assert rows == [
        ("leak", "drawn", "confirmed", "demo-2024", "POLYGON"), ("crack", "drawn", "confirmed", "demo-2024", "LINESTRING"),
        ("drip", "drawn", "confirmed", "demo-2024", "POINT"), ("leak", "drawn", "confirmed", "demo-2024", "POLYGON"),
    ]  # fmt: skip
    shapes = {name: done[f"finding_{name}_unrolled"]["shapes"] for name in ("area", "line", "point")}
    assert shapes == {"area": ["Polygon"], "line": ["LineString"], "point": ["Point"]}, "each in one layer, labelled once"
    for name, shape in (("area", "polygon"), ("line", "line"), ("point", "point")):
        offered = conn.execute(
            "SELECT array_agg(code ORDER BY code) FROM tunnel_api.finding_kind WHERE active AND %s = ANY (geometries)", [shape]
        ).fetchone()
        assert (done[f"finding_{name}_unrolled"]["kinds"],) == offered
        assert done[f"finding_{name}_unrolled"]["photos"] == ["Photos (table)"]


def test_3d_view_looks_at_the_largest_leak(look: Look) -> None:
    seen = look("space")
    assert (seen["name"], seen["crs"]) == ("3D", "EPSG:25830")
    assert seen["open"] == "0", "QGIS 3.24 and later open it when asked to"
    assert set(seen["layers"]) == {"axis", "section", "leak_3d", "target_sphere", "ground", "clearance_infringement_3d"}
    # a terrain would hide what lies below it, and its height shift all layers in QGIS 3.22
    assert (seen["terrain"], seen["offset"], seen["lights"]) == (False, 0, 1)
    place = example_surface()[0].to_space(np.array([12402.5]), np.array([0.0]), np.zeros(1))[0]
    camera = seen["camera"]
    assert [*seen["origin"][:2], camera["elev"]] == pytest.approx([place[0], place[1], place[2] - 4.0], abs=0.1)
    assert seen["origin"] == [camera["xMap"], camera["yMap"], 0]
    assert (camera["x"], camera["y"], camera["zMap"]) == (0, 0, camera["elev"])


def in_picture(camera: dict[str, float], centre: np.ndarray, point: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Row and column at which a camera with a field of view of 45° upright sees a point (east, north, up)."""
    pitch, yaw = np.radians([camera["pitch"], camera["yaw"]])
    tilt = np.array([[1, 0, 0], [0, np.cos(pitch), -np.sin(pitch)], [0, np.sin(pitch), np.cos(pitch)]])
    turn = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
    right, up, back = (turn @ tilt).T
    across, upward, behind = np.stack([right, up, back]) @ (point - centre) - [0, 0, camera["dist"]]
    half = shape[0] / 2
    return half * np.array([1 + upward / behind / np.tan(np.pi / 8), shape[1] / shape[0] - across / behind / np.tan(np.pi / 8)])


def test_layer_without_rows_is_not_in_3d(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    """It would leave the whole view blank; its style is in the database."""
    conn.execute("DELETE FROM tunnel.image")
    conn.execute("DELETE FROM tunnel.target_sphere")
    conn.commit()
    assert write(tmp_path / "demo.qgz").exit_code == 0
    assert set(act(tmp_path / "demo.qgz", "space")["layers"]) == {
        "axis", "section", "leak_3d", "ground", "clearance_infringement_3d",
    }  # fmt: skip
    after = {name: qgs(tmp_path / "demo.qgz").split(f"<id>tunneldb_layer_{name}</id>")[1] for name in ("target_sphere", "axis")}
    assert "<renderer-3d" not in after["target_sphere"].split("</maplayer>")[0]
    assert "<renderer-3d" in after["axis"].split("</maplayer>")[0]


def test_3d_view_shows_leaks_on_the_lining_in_their_colours(shared: Path, tmp_path: Path) -> None:
    """Real rendering: each leak in view has its colour at the pixel where its place in space is seen."""
    screen = shutil.which("xvfb-run")
    if screen is None:
        missing("xvfb-run, for OpenGL without a screen")
    software = {"QT_QPA_PLATFORM": "xcb", "LIBGL_ALWAYS_SOFTWARE": "1"}
    picture = tmp_path / "space.png"
    seen = act(shared, "space", str(picture), before=(screen, "-a", "-s", "-screen 0 1280x1024x24 +extension GLX"), **software)
    if seen["drawn"] is not True:
        missing(seen["drawn"])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NotGeoreferencedWarning)
        image = rasterio.open(picture)
    with image:
        pixels = image.read([1, 2, 3]).astype(int)
    camera = seen["camera"]
    centre = np.array([camera["xMap"], camera["yMap"], camera["zMap"]])
    found = []
    for chainage, arc, _, review in LEAKS:
        place = example_surface()[0].to_space(np.array([chainage]), np.array([arc]), np.zeros(1))[0]
        row, column = in_picture(camera, centre, place, pixels.shape[1:]).round().astype(int)
        if review == "rejected" or np.linalg.norm(place - centre) > 40 or not (0 <= column < pixels.shape[2]):
            continue
        red, green, blue = pixels[:, row - 2 : row + 3, column - 2 : column + 3].reshape(3, -1)
        own = (red > green + 50) & (green > blue + 30) if review == "open" else (blue > green + 50) & (green >= red)
        found.append((chainage, bool(own.any())))
    assert found == [(12402.5, True), (12428.0, True), (12436.0, True)]
    for colour in ((40, 52, 64), (120, 140, 155), (166, 129, 76)):
        assert (pixels == np.array(colour)[:, None, None]).all(axis=0).sum() > 500, "axis, sections and ground"


def test_place_on_the_image_is_told(rows: psycopg.Connection, look: Look) -> None:
    seen = look("where", "12367.891", "-3.456")
    title, text = seen["told"]
    assert title == "12+367.891"
    numbers = [float(number) for number in re.findall(r"-?\d+\.\d+", text)]
    point = example_surface()[0].to_space(np.array([12367.891]), np.array([-3.456]), np.zeros(1))[0]
    assert numbers == pytest.approx([12367.891, -3.456, *point], abs=0.002)
    assert "12+360 and 7.89 m on" in seen["tip"]


def test_vertex_moved_in_qgis_is_saved_with_its_stamp(conn: psycopg.Connection, project: Path) -> None:
    before = conn.execute("SELECT ST_X(geom), ST_Y(geom), ST_Z(geom) FROM tunnel.axis_vertex WHERE n = 1235").fetchone()
    conn.commit()
    assert act(project, "move_vertex", "1235", "0.25", "0.125")["saved"]
    x, y, z, source, by, at = conn.execute(
        "SELECT ST_X(geom), ST_Y(geom), ST_Z(geom), source, edited_by, edited_at FROM tunnel.axis_vertex WHERE n = 1235"
    ).fetchone()  # type: ignore[misc]
    assert before is not None
    assert (x, y, z) == pytest.approx((before[0] + 0.25, before[1], before[2] + 0.125), abs=1e-6)
    assert (source, by) == conn.execute("SELECT 'edited', session_user::text").fetchone()
    assert at is not None


@pytest.mark.parametrize(
    ("layer", "key", "kind"),
    [
        ("leak_unrolled", "3", "dark"), ("leak_map", "3", "joint"), ("leak_3d", "3", ""), ("dark_unrolled", "8", "leak"),
        ("dark_map", "9", "joint"),
    ],
)  # fmt: skip
def test_review_in_qgis_is_saved_with_its_stamp(
    conn: psycopg.Connection, project: Path, layer: str, key: str, kind: str
) -> None:
    assert act(project, "review", key, "rejected", "a stain, dry to the touch", layer, kind)["saved"]
    review, remark, kind_override, by, at = conn.execute(
        "SELECT review, remark, kind_override, reviewed_by, reviewed_at FROM tunnel.finding WHERE id = %s", (key,)
    ).fetchone()  # type: ignore[misc]
    assert (review, remark, kind_override) == ("rejected", "a stain, dry to the touch", kind or None)
    assert (by,) == conn.execute("SELECT session_user::text").fetchone()
    assert at is not None


@pytest.mark.parametrize(("chosen", "kind"), [("homogeneous", "homogeneous"), ("dry", "dry"), ("default", "dry")])
def test_region_drawn_in_qgis_belongs_to_the_survey(conn: psycopg.Connection, project: Path, chosen: str, kind: str) -> None:
    conn.execute("DELETE FROM tunnel.region")
    conn.commit()
    assert act(project, "draw", chosen)["saved"]
    rows = conn.execute("SELECT survey, kind, ST_Area(geom) FROM tunnel_api.region").fetchall()
    assert rows == [("demo-2024", kind, 8)]


def test_viewer_opens_the_project_but_cannot_edit(server_dsn: str, project: Path) -> None:
    with psycopg.connect(server_dsn, autocommit=True) as connection:
        connection.execute("CREATE ROLE reader LOGIN IN ROLE tunnel_viewer")
    text = project.read_text()
    assert "user=" not in text
    project.write_text(text.replace("host=", "user='reader' host="), encoding="utf-8")
    layers = act(project, "describe")["layers"]
    assert all(layer["valid"] for layer in layers.values())
    done = subprocess.run(
        [PYTHON, str(SCRIPT), str(project), "review", "1", "confirmed", ""],
        env=ENVIRONMENT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert "cannot be edited" in done.stderr


def test_inspector_edits_and_what_is_stale_can_be_recomputed(conn: psycopg.Connection, server_dsn: str, project: Path) -> None:
    with psycopg.connect(server_dsn, autocommit=True) as connection:
        connection.execute("CREATE ROLE mover LOGIN IN ROLE tunnel_inspector")
    conn.execute("DELETE FROM tunnel.run WHERE stage = 'detect'")
    conn.commit()
    project.write_text(project.read_text().replace("host=", "user='mover' host="), encoding="utf-8")
    with opened(project) as look:
        assert look("move_vertex", "1235", "0", "0.125")["saved"]
        assert look("review", "3", "confirmed", "wet")["saved"]
        commands = look("recompute")
    edited = conn.execute("SELECT n, edited_by FROM tunnel.axis_vertex WHERE source = 'edited'").fetchall()
    assert edited == [(1235, "mover")]
    assert conn.execute("SELECT reviewed_by FROM tunnel.finding WHERE id = 3").fetchone() == ("mover",)
    stale = conn.execute("SELECT stage FROM tunnel_api.stage_status WHERE stale ORDER BY step").fetchall()
    assert stale == [("segments",), ("sections",), ("ground",)]
    # as the action has it, but by one who may: without its points the example itself cannot be computed
    assert commands["segment"] == commands["axis_vertex"]
    words = [word.replace("user='mover'", "") for word in commands["axis_vertex"]]
    assert words[3:] == ["run", "demo-2024", "--stale"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "survey demo-2024 holds no points yet" in done.stderr
    conn.execute("DROP ROLE mover")
    conn.commit()


@pytest.mark.parametrize(
    "view",
    [
        "leak_map", "leak_3d", "leak_unrolled", "axis_vertex", "segment", "section", "target_sphere", "cluster", "ground",
        "action_unrolled",
    ],
)  # fmt: skip
def test_layer_added_by_hand_finds_its_style_srid_and_height(look: Look, view: str) -> None:
    added = look("add", view)
    assert added["valid"]
    assert added["loaded"], "no default style"
    assert added["renderer"] in ("categorizedSymbol", "RuleRenderer", "singleSymbol")
    assert added["alias"] == "Survey key"
    assert (added["wkb"], added["crs"]) == ((ON_MAP | UNROLLED)[view], "" if view in UNROLLED else "EPSG:25830")


def test_styles_have_one_default_a_layer_and_are_replaced(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    def styles() -> list[tuple[Any, ...]]:
        return conn.execute(
            "SELECT f_table_name, f_geometry_column, count(*) FILTER (WHERE useasdefault), count(*), "
            "bool_and(f_table_catalog = current_database() AND f_table_schema = 'tunnel_api') "
            "FROM public.layer_styles GROUP BY 1, 2 ORDER BY 1, 2"
        ).fetchall()

    conn.execute("DELETE FROM tunnel.image")
    conn.commit()
    assert write(tmp_path / "demo.qgz").exit_code == 0
    first = styles()
    assert {(row[0], row[1]) for row in first} == {
        *((name, "geom") for name in STYLED), ("leak", "unrolled"), ("leak", "map"), ("leak", "surface"),
        ("spot", "map"), ("spot", "surface"),
        *((layer.view, "geom") for layer in (*SCANNER_LAYERS, *STRUCTURE_LAYERS, *UNDERWATER_LAYERS, *CHANGE_LAYERS)),
        ("spot_face", "geom"), ("rating_map", "geom"), ("rating_unrolled", "geom"),
    }  # fmt: skip
    assert all(row[2:] == (1, 1, True) for row in first)
    conn.execute(
        "INSERT INTO public.layer_styles (f_table_catalog, f_table_schema, f_table_name, f_geometry_column, stylename, "
        "useasdefault) VALUES (current_database(), 'tunnel_api', 'axis', 'geom', 'my own', true)"
    )
    conn.commit()
    assert write(tmp_path / "demo.qgz").exit_code == 0
    again = {row[:2]: row[2:] for row in styles()}
    # the user's own style stays, but no longer as the default
    assert again.pop(("axis", "geom")) == (1, 2, True)
    assert all(counts == (1, 1, True) for counts in again.values())


def test_project_holds_relative_paths_and_spares_qgis_the_search(shared: Path) -> None:
    text = qgs(shared)
    assert str(shared.parent) not in text
    assert "<datasource>./demo-images/demo-2024-km012-corrected.tif</datasource>" in text
    sources = re.findall(r"<datasource>([^<]*tunnel_api[^<]*)</datasource>", text)
    assert len(sources) == len(ON_MAP | UNROLLED | FINDINGS | ON_SHEETS) + len(LISTS) + 1, "and the table of remarks"
    assert all("checkPrimaryKeyUnicity='0'" in source for source in sources)
    counted = [source for source in sources if "estimatedmetadata=true" not in source]
    assert len(counted) == 1 + len(LISTS), "small tables"


def test_project_holds_no_password(conn: psycopg.Connection, dsn: str, example: str, tmp_path: Path) -> None:
    conn.execute("DELETE FROM tunnel.image")
    conn.commit()
    assert write(tmp_path / "demo.qgs", dsn=make_conninfo(dsn, password="s3cret")).exit_code == 0
    text = (tmp_path / "demo.qgs").read_text()
    assert "s3cret" not in text
    assert "password" not in text


def test_service_stands_for_the_connection(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    conn.execute("DELETE FROM tunnel.image")
    conn.commit()
    assert write(tmp_path / "demo.qgs", "--service", "o'tunnels").exit_code == 0
    text = (tmp_path / "demo.qgs").read_text()
    assert "<datasource>service='o\\'tunnels' key=" in text
    assert "host=" not in text


def test_project_without_leaks_sections_and_images(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    for table in ("finding", "image", "section"):
        conn.execute(f"DELETE FROM tunnel.{table}")  # type: ignore[arg-type]
    conn.commit()
    assert write(tmp_path / "demo.qgz").exit_code == 0
    seen = act(tmp_path / "demo.qgz", "describe")
    assert all(layer["valid"] for layer in seen["layers"].values())
    assert (seen["layers"]["leak_3d"]["wkb"], seen["layers"]["leak_3d"]["features"]) == ("PolygonZ", 0)
    assert seen["bookmarks"] == ["Map"]


def test_offset_is_shown_where_there_is_no_intensity(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    conn.execute("DELETE FROM tunnel.image WHERE kind <> 'offset'")
    conn.commit()
    assert write(tmp_path / "demo.qgz").exit_code == 0
    assert set(act(tmp_path / "demo.qgz", "describe")["themes"]["Unrolled"]) == {
        *UNROLLED, "demo-2024-km012-offset", "demo-2024-km012-offset-filled",
    } - NOT_AT_FIRST  # fmt: skip


def test_the_image_in_colour_is_drawn_as_it_is(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    """Also a colour with bands of 0, which is no missing value."""
    add_image_in_colour(conn, "demo-2024")
    assert write(tmp_path / "demo.qgz").exit_code == 0
    with opened(tmp_path / "demo.qgz") as look:
        assert "demo-2024-km012-rgb" not in look("describe")["themes"]["Unrolled"]
        for place, colour in ((2.0, ABOVE), (-2.0, BELOW)):
            picture = tmp_path / "r.png"
            look("draw_layer", "demo-2024-km012-rgb", f"12350,{place - 0.5},12351,{place + 0.5}", str(picture))
            kinds, counts = np.unique(np.asarray(Image.open(picture).convert("RGB")).reshape(-1, 3), axis=0, return_counts=True)
            assert kinds[counts.argmax()].tolist() == list(colour)


@pytest.mark.parametrize("kind", ["offset", "corrected"])
def test_lining_of_profiles_apart_is_seen(conn: psycopg.Connection, example: str, tmp_path: Path, kind: str) -> None:
    """Profiles 0.5 m apart: under the image measured lies the same with gaps filled, which says that it is."""
    if kind == "offset":
        without_intensity(conn)
    thin_images(conn, kind, every=5)
    project = tmp_path / "demo.qgz"
    assert write(project).exit_code == 0
    names = f"demo-2024-km012-{kind}", f"demo-2024-km012-{kind}-filled"
    layers, shares = [], []
    for name in names:
        with rasterio.open(tmp_path / "demo-images" / f"{name}.tif") as image:
            layers.append(image.read(1))
            shares.append(np.isfinite(layers[-1]).mean())
            told = image.descriptions[0]
    assert told == f"{kind}, gaps up to 0.6 m filled"
    assert shares[1] / shares[0] == pytest.approx(5, abs=0.25)
    held = np.isfinite(layers[0])
    assert np.array_equal(layers[0][held], layers[1][held]), "what was measured is as it was"
    with opened(project) as look:
        seen = look("describe")
        for name in names:
            look("draw_layer", name, "12352,-3,12392,3", str(tmp_path / f"{name}.png"))
    for theme in ("Unrolled", "Inspection sheets"):
        assert [name for name in seen["themes"][theme] if name in names] == list(names), "the measured one on top"
    white = []
    for name in names:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", NotGeoreferencedWarning)
            image = rasterio.open(tmp_path / f"{name}.png")
        with image:
            white.append(float((image.read([1, 2, 3]) > 250).all(axis=0)[200:-200].mean()))
    assert white[0] > 0.5
    assert white[1] < 0.03, "the lightest of intensities are white"


def test_sheets_without_intensity_speak_of_no_leaks(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    without_intensity(conn, every=5)
    assert write(tmp_path / "demo.qgz").exit_code == 0
    path = tmp_path / "sheets.pdf"
    assert act(tmp_path / "demo.qgz", "atlas", str(path)) == {"saved": True, "error": "", "sheets": 4}
    pages = words(path)
    assert len(pages) == 4
    for page in pages:
        assert "leaks were not searched for" in page
        assert "gaps up to 0.6 m filled" in page
        for word in ("Drop", "leaks 0", "seen yet", "Orange"):
            assert word not in page


def test_project_in_the_database_opens_for_a_viewer(
    conn: psycopg.Connection, server_dsn: str, example: str, tmp_path: Path
) -> None:
    conn.execute("DELETE FROM tunnel.image WHERE kind <> 'corrected'")
    conn.execute("CREATE ROLE looker LOGIN IN ROLE tunnel_viewer")
    conn.commit()
    images = tmp_path / "some where" / "images"
    (tmp_path / "service.conf").write_text(
        f"[tunnels]\nhost={conn.info.host}\nport={conn.info.port}\ndbname={conn.info.dbname}\nuser=looker\n"
    )
    for _ in range(2):  # the second takes the place of the first
        result = write(None, "--database", "--service", "tunnels", "--images", str(images))
        assert result.exit_code == 0, result.output
    assert conn.execute("SELECT name FROM public.qgis_projects").fetchall() == [("demo-2024",)]
    stored = "postgresql:?service=tunnels&sslmode=disable&dbname=&schema=public&project=demo-2024"
    seen = act(stored, "describe", PGSERVICEFILE=str(tmp_path / "service.conf"))
    conn.execute("DROP ROLE looker")
    conn.commit()
    assert all(layer["valid"] for layer in seen["layers"].values())
    assert seen["layers"]["demo-2024-km012-corrected"]["source"] == str(images / "demo-2024-km012-corrected.tif")
    assert seen["layers"]["leak_map"]["features"] == len(LEAKS)
    assert seen["bookmarks"] == ["Map", "Unrolled", "Unrolled, km 12"]
    assert list(tmp_path.glob("*.qg?")) == []


def test_project_goes_into_file_and_database(
    conn: psycopg.Connection, example: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    conn.execute("DELETE FROM tunnel.image WHERE block <> 246 OR kind <> 'raw'")
    conn.commit()
    monkeypatch.chdir(tmp_path)
    assert write(tmp_path / "demo.qgz", "--database", "the demo").exit_code == 0
    content, by = conn.execute("SELECT content, metadata ->> 'last_modified_user' FROM public.qgis_projects").fetchone()  # type: ignore[misc]
    (tmp_path / "stored.qgz").write_bytes(content)
    image = tmp_path / "demo-images" / "demo-2024-km012-raw.tif"
    assert f"<datasource>{image}</datasource>" in qgs(tmp_path / "stored.qgz")
    assert f"<datasource>./{image.relative_to(tmp_path)}</datasource>" in qgs(tmp_path / "demo.qgz")
    assert (by,) == conn.execute("SELECT session_user::text").fetchone()
    assert write(None, "--database").exit_code == 0
    assert (tmp_path / "demo-2024-images" / image.name).exists()
    assert write(None).exit_code == 2


def test_socket_that_qgis_cannot_reach_is_refused(conn: psycopg.Connection, dsn: str, example: str, tmp_path: Path) -> None:
    conn.execute("DELETE FROM tunnel.image")
    conn.commit()
    (tmp_path / "a b").symlink_to(conn.info.host)
    result = write(tmp_path / "demo.qgz", dsn=make_conninfo(dsn, host=str(tmp_path / "a b")))
    assert result.exit_code == 2
    assert "--service" in result.stderr
    assert write(tmp_path / "demo.qgz", "--service", "tunnels").exit_code == 0


def test_errors_are_one_line(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    result = write(tmp_path / "demo.txt")
    assert (result.exit_code, result.stderr.count("\n")) == (2, 1)
    assert "ends in .qgz or .qgs" in result.stderr
    result = write(tmp_path / "nowhere" / "demo.qgz")
    assert (result.exit_code, result.stderr.count("\n")) == (2, 1)
    conn.execute("DELETE FROM tunnel.axis_vertex")
    conn.execute("DELETE FROM tunnel.finding")
    conn.execute("DELETE FROM tunnel.image")
    conn.commit()
    result = write(tmp_path / "demo.qgz")
    assert result.exit_code == 2
    assert "has no axis yet" in result.stderr
    assert list(tmp_path.iterdir()) == []
