"""Cracks of other systems: lines in four formats, masks, and their density by element; the truth is what was drawn."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import psycopg
import pytest
import shapely
from affine import Affine
from click.testing import CliRunner, Result
from support.cracks import ANGLES, CLASSES, CRACKS, mask, write_dxf, write_layer, write_png
from support.example_survey import GIRTH, NAME, SRID, example_surface

from tunneldb.cli.main import main

LINES = [shapely.LineString(points) for points, _ in CRACKS]
WIDTHS = [width for _, width in CRACKS]
SURFACE, _ = example_surface()


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


def run(*arguments: object) -> Result:
    return CliRunner().invoke(main, [str(a) for a in arguments])


def told(*arguments: object) -> dict[str, Any]:
    done = run(*arguments, "--json")
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)


def refused(*arguments: object) -> str:
    """Return the one line by which a command is refused."""
    done = run(*arguments)
    assert (done.exit_code, done.stderr.count("\n")) == (2, 1), done.output
    return done.stderr


def cracks(conn: psycopg.Connection) -> list[Any]:
    rows = conn.execute(
        "SELECT length, width_mm, orientation, orientation_class, ST_AsText(unrolled), review, remark FROM tunnel_api.finding"
        " WHERE kind = 'crack' ORDER BY id"
    ).fetchall()
    conn.rollback()
    return rows


def on_lining(line: shapely.LineString) -> shapely.LineString:
    """The line in space."""
    x, y = np.array(line.coords).T
    return shapely.LineString(SURFACE.to_space(x, y, np.zeros(len(x))))


def length_on_lining(line: shapely.LineString) -> float:
    points = np.array(on_lining(line.segmentize(0.01)).coords)
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def write_cracks(folder: Path, form: str, space: bool) -> tuple[Path, list[str]]:
    lines = [on_lining(line.segmentize(0.5)) for line in LINES] if space else LINES
    path = folder / f"cracks.{form}"
    if form == "dxf":
        return write_dxf(path, [list(line.coords) for line in lines]), ["--kind", "crack", "--layer", "RISSE"]
    if form == "csv":
        texts = [shapely.to_wkt(line, rounding_precision=9) for line in lines]
        rows = [f'"{text}",{width or ""}' for text, width in zip(texts, WIDTHS, strict=True)]
        path.write_text("wkt,breite\n" + "\n".join(rows) + "\n")
    else:
        write_layer(path, lines, f"EPSG:{SRID}" if space else None, breite=WIDTHS)
        if form == "geojson" and not space:
            path.write_text(json.dumps({k: v for k, v in json.loads(path.read_text()).items() if k != "crs"}))
    return path, ["--kind", "crack", "--column", "width_mm=breite"]


@pytest.mark.parametrize("space", [False, True], ids=["unrolled", "space"])
@pytest.mark.parametrize("form", ["gpkg", "geojson", "dxf", "csv"])
def test_lines_of_four_formats_become_cracks_with_length_width_and_orientation(
    conn: psycopg.Connection, example: str, tmp_path: Path, form: str, space: bool
) -> None:
    path, options = write_cracks(tmp_path, form, space)
    assert told("findings", "import", NAME, path, *options)["kinds"] == {"crack": 4}
    found = cracks(conn)
    assert [row[0] for row in found] == pytest.approx([length_on_lining(line) for line in LINES], rel=0.002)
    assert [row[1] for row in found] == (WIDTHS if form != "dxf" else [None] * 4)
    assert [row[2] for row in found[:3]] == pytest.approx(ANGLES[:3], abs=0.1)
    assert [row[3] for row in found] == CLASSES
    for row, line in zip(found, LINES, strict=True):
        assert shapely.from_wkt(row[4]).hausdorff_distance(line) < 0.005


def test_the_orientation_is_that_of_the_principal_axis(conn: psycopg.Connection) -> None:
    rng = np.random.default_rng(5)
    for _ in range(20):
        points = np.cumsum(rng.normal(0.3, 0.5, (30, 2)), axis=0) + np.array([12300.0, -5.0])
        even = shapely.get_coordinates(shapely.LineString(points).interpolate(np.linspace(0, 1, 20001), normalized=True))
        values, axes = np.linalg.eigh(np.cov(even.T))
        x, y = axes[:, np.argmax(values)]
        expected = np.degrees(np.arctan2(abs(y), abs(x)))
        line = shapely.LineString(points).wkt
        (angle,) = conn.execute("SELECT tunnel_api.line_orientation(ST_GeomFromText(%s))", [line]).fetchone()
        assert angle == pytest.approx(expected, abs=0.1)
    none = "SELECT tunnel_api.line_orientation(ST_GeomFromText(%s))"
    for shape in ("POINT(1 2)", "POLYGON((0 0,1 0,1 1,0 0))", "LINESTRING(1 1,1 1)"):
        assert conn.execute(none, [shape]).fetchone() == (None,)


def test_parts_of_a_line_that_meet_are_one_crack_and_others_several(
    conn: psycopg.Connection, example: str, tmp_path: Path
) -> None:
    parts = shapely.MultiLineString([[(12315, 0), (12316, 0)], [(12316, 0), (12317, 0.2)], [(12320, 0), (12320, 2)]])
    path = write_layer(tmp_path / "c.gpkg", [parts], kind=["crack"], width_mm=[0.4])
    assert told("findings", "import", NAME, path)["kinds"] == {"crack": 2}
    assert sorted(row[0] for row in cracks(conn)) == pytest.approx([2.0, 1 + np.hypot(1, 0.2)], rel=0.01)
    assert {row[1] for row in cracks(conn)} == {0.4}


def test_a_drawing_s_other_entities_and_layers_are_told(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    drawing = ezdxf.new()
    space = drawing.modelspace()
    space.add_line((12315, 1), (12316, 1), dxfattribs={"layer": "RISSE"})
    space.add_arc((12320, 0), 1.0, 0, 90, dxfattribs={"layer": "RISSE"})
    space.add_line((12330, 1), (12330, 2), dxfattribs={"layer": "FUGEN"})
    space.add_text("0,3", dxfattribs={"layer": "RISSE"})
    drawing.saveas(tmp_path / "c.dxf")
    options = ["--column", "kind=layer", "--map", "RISSE=crack", "--map", "FUGEN=damaged_joint"]
    done = told("findings", "import", NAME, tmp_path / "c.dxf", *options)
    assert done["kinds"] == {"crack": 2, "damaged_joint": 1}
    assert done["notes"][0].endswith("left out, because they are not lines: 1 TEXT")
    assert [row[0] for row in cracks(conn)] == pytest.approx([1.0, np.pi / 2], rel=0.01)
    assert "has no layer 'WAND' with lines: it has FUGEN, RISSE" in refused(
        "findings", "import", NAME, tmp_path / "c.dxf", "--kind", "crack", "--layer", "WAND"
    )


def test_bad_files_are_one_line_and_nothing_is_written(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    far = [shapely.LineString([(500000, 4000000), (500003, 4000000)])]
    flat = write_layer(tmp_path / "flat.gpkg", LINES, f"EPSG:{SRID}", kind=["crack"] * 4)
    (tmp_path / "text.dxf").write_text("no drawing\n")
    layer = lambda name, *rest, **columns: write_layer(tmp_path / name, *rest, **columns)  # noqa: E731
    for path, options, message in (
        (layer("far.gpkg", far), ["--kind", "crack"], "it states no coordinate system"),
        (layer("far.geojson", far, f"EPSG:{SRID}"), ["--kind", "crack"], "but without heights; give z"),
        (flat, [], "but without heights; give z"),
        (layer("utm.gpkg", far, "EPSG:32601"), ["--kind", "crack"], "WGS 84 / UTM zone 1N"),
        (layer("empty.gpkg", [], kind=[]), [], "has no features; nothing was imported"),
        (layer("plain.gpkg", LINES[:1]), [], "or the kind of all by --kind"),
        (layer("unit.gpkg", LINES[:1], width=[0.3]), ["--kind", "crack"], "add --column width_mm=width"),
        (write_dxf(tmp_path / "mm.dxf", [[(0, 0), (1, 0)]], unit=4), ["--kind", "crack"], "its unit is millimetres"),
        (write_dxf(tmp_path / "none.dxf", []), ["--kind", "crack"], "has no lines in model space"),
        (write_dxf(tmp_path / "far.dxf", [[(0, 0), (1, 0)]]), ["--kind", "crack"], "outside survey"),
        (write_dxf(tmp_path / "kind.dxf", [[(12315, 0), (12316, 0)]]), [], "say the kind of all lines by --kind"),
        (tmp_path / "text.dxf", ["--kind", "crack"], "cannot be read as DXF"),
    ):  # fmt: skip
        assert message in refused("findings", "import", NAME, path, *options), path
    # a mistake of a row names the row
    text = layer("text.gpkg", LINES[:2], kind=["crack"] * 2, width_mm=["0,3", "0.3 mm"])
    area = layer("area.gpkg", [LINES[0], LINES[1].buffer(0.1)], kind=["crack"] * 2)
    reach = layer("reach.gpkg", [LINES[0], shapely.LineString([(12315, 0), (12315, 40)])], kind=["crack"] * 2)
    wide = layer("wide.gpkg", LINES[:2], kind=["crack"] * 2, width_mm=[1, 300])
    for path, message in (
        (text, "row 2: width_mm is '0.3 mm', not a number"),
        (area, "row 2: crack is drawn as line, not as polygon"),
        (reach, "row 2: the drawing reaches beyond the lining"),
        (wide, "row 2: a crack is 0.01 to 100 mm wide, not 300 mm"),
    ):
        done = run("findings", "import", NAME, path)
        assert (done.exit_code, done.stderr.count("\n")) == (2, 2)
        assert message in done.stderr.splitlines()[0]
    assert cracks(conn) == []


DRAWN = [
    [(12313.0, 3.0), (12317.0, 3.4)],
    [(12315.0, -2.0), (12315.2, 1.0)],
    [(12319.0, -3.0), (12321.0, -1.0), (12323.0, -1.5)],
    [(12325.0, 1.0 + 0.0), (12325.03, 1.0)],
]
"""Cracks of a strip, chainage and arc, m; the last is a speck."""

PLACE = Affine(0.005, 0.0, 12312.05, 0.0, -0.005, 4.05)
"""True place of the strip: 5 cm off in both directions from where it would be by its round numbers."""

WIDTH, PIXEL = 0.02, 0.005


def control(path: Path, columns: int, rows: int) -> Path:
    rng = np.random.default_rng(2)
    lines = ["column,row,chainage,arc"]
    for column, row in [
        (40, 60),
        (70, rows - 50),
        (700, 100),
        (1200, rows - 90),
        (columns - 60, 70),
        (columns - 90, rows - 40),
    ]:
        chainage, arc = np.array(PLACE @ (column, row)) + rng.normal(0, 0.003, 2)
        lines.append(f"{column},{row},{chainage:.4f},{arc:.4f}")
    path.write_text("\n".join(lines) + "\n")
    return path


def test_a_mask_placed_by_control_points_gives_the_cracks_drawn_in_it(
    conn: psycopg.Connection, example: str, tmp_path: Path
) -> None:
    values = mask(DRAWN, WIDTH, PLACE, 2800, 1500)
    path = write_png(tmp_path / "mask.png", values)
    points = control(tmp_path / "points.csv", 2800, 1500)
    done = told("findings", "trace", NAME, path, "--points", points)
    assert (len(done["ids"]), done["short"], done["wide"], done["beyond"]) == (3, 1, 0, 0)
    assert done["short_length"] == pytest.approx(0.03, abs=0.02)
    found = sorted(cracks(conn), key=lambda row: shapely.from_wkt(row[4]).bounds)
    for row, line in zip(found, DRAWN, strict=False):
        true = shapely.LineString(line)
        assert shapely.from_wkt(row[4]).hausdorff_distance(true) < 0.02
        assert row[0] == pytest.approx(true.length, rel=0.05)
        assert row[1] == pytest.approx(1000 * WIDTH, abs=1000 * PIXEL)
        assert row[5:] == ("open", "traced in mask.png")
    assert [row[3] for row in found] == ["longitudinal", "transverse", "longitudinal"]
    assert "left out: 1 line shorter than 0.1 m" in run("findings", "trace", NAME, path, "--points", points).stderr


def test_a_crack_across_overlapping_frames_is_one(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    line = [(12312.0, -1.0), (12318.0, 0.5), (12327.0, 0.2)]
    rows = ["file,chainage_from,chainage_to,arc_from,arc_to"]
    for k in range(4):
        place = Affine(0.005, 0, 12311.0 + 4 * k, 0, -0.005, 2.0)
        write_png(tmp_path / f"f{k}.png", mask([line], WIDTH, place, 1000, 800))
        rows.append(f"f{k}.png,{12311 + 4 * k},{12316 + 4 * k},-2,2")
    (tmp_path / "frames.csv").write_text("\n".join(rows) + "\n")
    assert len(told("findings", "trace", NAME, tmp_path / "frames.csv")["ids"]) == 1
    (row,) = cracks(conn)
    assert shapely.from_wkt(row[4]).hausdorff_distance(shapely.LineString(line)) < 0.01
    assert row[0] == pytest.approx(shapely.LineString(line).length, rel=0.01)


def test_bad_masks_are_one_line_and_nothing_is_written(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    points = control(tmp_path / "points.csv", 2800, 1500)
    one = np.zeros((1500, 2800), np.uint8)
    one[700:705, 100:2000] = 255
    grey, blob, speck = one.copy(), np.zeros_like(one), np.zeros_like(one)
    grey[700:705, 100:300] = 90
    blob[100:1000, 100:400] = 1
    speck[5, 5] = 1
    write = lambda name, values: write_png(tmp_path / name, values)  # noqa: E731
    for path, options, message in (
        (write("one.png", one), [], "has no coordinates: give control points"),
        (write("grey.png", grey), ["--points", points], "several values besides 0, such as 90 and 255"),
        (write("inverted.png", 255 - one), ["--points", points], "% of the mask's pixels are not 0; invert it"),
        (write("none.png", 0 * one), ["--points", points], "the mask has no crack of at least 0.1 m: 0 shorter lines"),
        (write("speck.png", speck), ["--points", points], "the mask has no crack of at least 0.1 m"),
        (write("blob.png", blob), ["--points", points], "1 area wider than 100 mm"),
        (points, [], "has no column file"),
    ):
        assert message in refused("findings", "trace", NAME, path, *options), path
    assert "a mask by: tunneldb findings trace" in refused("findings", "import", NAME, tmp_path / "one.png")
    assert cracks(conn) == []


def test_the_density_of_cracks_is_their_length_by_the_lining_of_each_element(
    conn: psycopg.Connection, example: str, tmp_path: Path
) -> None:
    path, options = write_cracks(tmp_path, "gpkg", space=False)
    told("findings", "import", NAME, path, *options)
    assert run("elements", "add", "demo", "tens", "--length", 10).exit_code == 0
    done = run("elements", "add", "demo", "quarters", "--length", 10, "--zones")
    assert done.exit_code == 0, done.output
    rows = conn.execute(
        "SELECT chainage_from, cracks, crack_length, lining_area, density, longitudinal_length, transverse_length,"
        " oblique_length, width_mm FROM tunnel_api.crack_density WHERE survey = %s AND element_set = 'tens'"
        " ORDER BY number",
        [NAME],
    ).fetchall()
    assert len(rows) > 5
    for start, number, length, lining, density, *by_class, width in rows:
        parts = [line.intersection(shapely.box(start, -20, start + 10, 20)) for line in LINES]
        inside = [0.0 if part.is_empty else length_on_lining(part) for part in parts]
        assert number == sum(part > 0 for part in inside)
        assert length == pytest.approx(sum(inside), rel=0.005)
        assert sum(by_class) == pytest.approx(length)
        if 12310 <= start <= 12480:
            assert lining == pytest.approx(10 * GIRTH, rel=0.01)
            assert density == (pytest.approx(sum(inside) / (10 * GIRTH), rel=0.02) if number else None)
        assert width == max((w for w, part in zip(WIDTHS, inside, strict=True) if part > 0 and w), default=None)
    whole, zones = (
        conn.execute(
            "SELECT sum(crack_length), sum(lining_area), sum(longitudinal_length) FROM tunnel_api.crack_density"
            " WHERE survey = %s AND element_set = %s",
            [NAME, name],
        ).fetchone()
        for name in ("tens", "quarters")
    )
    assert zones == pytest.approx(whole, rel=0.005)
    conn.rollback()


def test_the_density_is_printed_and_an_unknown_division_is_one_line(example: str, tmp_path: Path) -> None:
    path, options = write_cracks(tmp_path, "gpkg", space=False)
    told("findings", "import", NAME, path, *options)
    rows = {row["name"]: row for row in told("elements", "cracks", NAME, "blocks")["elements"]}
    expected = sum(length_on_lining(line) for line in LINES if line.bounds[2] < 12350)
    assert rows["block 1"]["crack_length"] == pytest.approx(expected, rel=0.002)
    assert rows["block 1"]["density"] == pytest.approx(expected / (50 * GIRTH), rel=0.01)
    printed = run("elements", "cracks", NAME, "blocks").stdout
    assert f"{expected:.2f}" in printed
    assert "tunneldb elements list demo" in refused("elements", "cracks", NAME, "ghost")


def test_lists_and_the_report_state_the_orientation(example: str, tmp_path: Path) -> None:
    path, options = write_cracks(tmp_path, "gpkg", space=False)
    told("findings", "import", NAME, path, *options)
    listed = told("findings", "list", NAME, "--kind", "crack")["findings"]
    assert [row["orientation_class"] for row in listed] == CLASSES
    for name in ("c.csv", "c.gpkg", "c.geojson", "c.xlsx"):
        assert run("findings", "list", NAME, "--kind", "crack", "-o", tmp_path / name).exit_code in (0, 1)
    assert "orientation,orientation_class" in (tmp_path / "c.csv").read_text()
    assert run("report", NAME, "-o", tmp_path / "report.html").exit_code in (0, 1)
    page = (tmp_path / "report.html").read_text("utf-8")
    for said in ("longitudinal, 0°", "transverse, 90°", "oblique, 45°"):
        assert said in page


def test_a_second_import_adds_nothing(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    path, options = write_cracks(tmp_path, "gpkg", space=False)
    told("findings", "import", NAME, path, *options)
    first = cracks(conn)
    done = told("findings", "import", NAME, path, *options)
    assert (done["imported"], done["kinds"]) == (0, {})
    assert done["notes"] == [f"{path}: left out: 4 findings of the same kind and outline as one in the survey"]
    assert cracks(conn) == first
    # another kind at the same place is another finding, and what is new is added
    assert told("findings", "import", NAME, path, "--kind", "damaged_joint")["kinds"] == {"damaged_joint": 4}
    more = write_layer(tmp_path / "more.gpkg", [*LINES, shapely.LineString([(12345, 0), (12346, 0)])], kind=["crack"] * 5)
    assert told("findings", "import", NAME, more)["imported"] == 1
    assert len(cracks(conn)) == 5


def test_a_mask_traced_twice_adds_nothing(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    path = write_png(tmp_path / "mask.png", mask(DRAWN, WIDTH, PLACE, 2800, 1500))
    points = control(tmp_path / "points.csv", 2800, 1500)
    first = told("findings", "trace", NAME, path, "--points", points)
    # the strip is 14 m by 7.5 m, and lies within the lining
    corners = [first["searched"][name] for name in ("chainage_from", "chainage_to", "arc_from", "arc_to")]
    assert corners == pytest.approx([12312.05, 12326.05, -3.45, 4.05], abs=0.02)
    again = told("findings", "trace", NAME, path, "--points", points)
    assert (again["ids"], again["repeated"], again["searched"]) == ([], 3, first["searched"])
    assert len(cracks(conn)) == 3
    assert told("findings", "searched", NAME)["searches"] == [first["searched"]]


def densities(name: str) -> dict[float, tuple[float, float | None]]:
    """Return searched share and density of the elements by chainage at which they begin."""
    rows = [row for row in told("elements", "cracks", NAME, name)["elements"] if row["lining_area"] > 0]
    return {float(row["label_from"].replace("+", "")): (row["searched_share"], row["density"]) for row in rows}


def test_no_crack_is_a_density_of_0_only_where_somebody_searched(example: str, tmp_path: Path) -> None:
    path, options = write_cracks(tmp_path, "gpkg", space=False)
    told("findings", "import", NAME, path, *options)
    assert run("elements", "add", "demo", "tens", "--length", 10).exit_code == 0
    assert "it is not recorded that any part" in run("findings", "searched", NAME).stdout
    before = densities("tens")
    assert {share for share, _ in before.values()} == {0.0}
    assert {start for start, (_, density) in before.items() if density is not None} == {12310.0, 12330.0, 12340.0, 12350.0}
    done = told("findings", "searched", NAME, "--from", 12315, "--to", 12330, "--source", "photos of March")
    assert [(row["chainage_from"], row["chainage_to"], row["source"]) for row in done["searches"]] == [
        (12315.0, 12330.0, "photos of March")
    ]
    after = densities("tens")
    assert after[12310.0] == (pytest.approx(0.5, abs=0.01), before[12310.0][1])
    assert after[12320.0] == (pytest.approx(1.0, abs=1e-3), 0.0)
    assert {start: row for start, row in after.items() if start > 12325} == {
        start: row for start, row in before.items() if start > 12325
    }
    printed = run("elements", "cracks", NAME, "tens")
    (line,) = (line for line in printed.stdout.splitlines() if "12+310" in line and "12+320" in line)
    assert f"≥ {after[12310.0][1]:.3f}" in line
    unknown = sum(density is None for _, density in after.values())
    assert f"Note: {unknown} elements not known to be searched for cracks" in printed.stderr
    # by zones: what was searched all round was searched in each
    assert run("elements", "add", "demo", "zones of tens", "--length", 10, "--zones").exit_code == 0
    rows = told("elements", "cracks", NAME, "zones of tens")["elements"]
    assert {round(row["searched_share"], 2) for row in rows if row["label_from"] == "12+320.000"} == {1.0}
    (key,) = (row["id"] for row in done["searches"])
    assert told("findings", "searched", NAME, "--remove", key)["searches"] == []
    assert densities("tens") == before


def test_a_wrong_search_is_one_line(example: str) -> None:
    for options, message in (
        (["--from", "12315"], "need --source TEXT"),
        (["--source", "x", "--remove", "1"], "exclude each other"),
        (["--remove", "9"], "has no search with number 9"),
        (["--source", ""], "it is not said what was searched"),
        (["--source", "x" * 1001], "has 1001 characters"),
        (["--from", "99000", "--source", "x"], "lies beside this stretch"),
    ):
        assert message in refused("findings", "searched", NAME, *options), options


@pytest.mark.parametrize(
    ("shape", "source", "message"),
    [
        ("POINT(12315 0)", "x", "no valid polygon"),
        ("POLYGON((0 0,1 1,1 0,0 1,0 0))", "x", "no valid polygon"),
        ("POLYGON((0 0,1 0,1 1,0 0))", "x", "does not meet the lining"),
        ("POLYGON EMPTY", "x", "does not meet the lining"),
        ("POLYGON((12315 0,12316 0,12316 1,12315 0))", "", "it is not said what"),
        ("POLYGON((12315 0,12316 0,12316 1,12315 0))", "x" * 1001, "has 1001 characters"),
    ],
)
def test_an_area_that_is_none_of_the_lining_is_refused(
    conn: psycopg.Connection, example: str, shape: str, source: str, message: str
) -> None:
    with pytest.raises(psycopg.errors.DataError, match=message):
        conn.execute("SELECT tunnel_api.crack_search_add(%s, ST_GeomFromText(%s), %s)", [NAME, shape, source])
