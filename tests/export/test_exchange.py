"""A survey as GeoPackage and as DXF, read back by other libraries and by real QGIS."""

from __future__ import annotations

import json
import os
import sqlite3
import subprocess
from collections import Counter
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import psycopg
import pyogrio
import pyogrio.raw
import pytest
import shapely
from click.testing import CliRunner
from psycopg import sql
from psycopg.conninfo import make_conninfo
from support.system import missing

from tunneldb.cli.main import main
from tunneldb.export.exchange.dxf import LAYERS, facts_of

RADIUS, HEIGHT = 4.0, 2.5  # of the example's tunnel: a circle, and its floor below the axis, m
CURVE, CENTRE = 300.0, np.array([500_300.0, 4_640_000.0])  # of its axis, in plan
FIRST, LAST = 12300.0, 12500.0
UNROLLED = {
    *("leak_unrolled", "dark_unrolled", "region", "section_unrolled", "sheet", "chainage_unrolled", "lining_unrolled"),
    "action_unrolled", "coverage_gap", "dark_band", "detectability", "finding_point_unrolled", "finding_line_unrolled",
    "finding_area_unrolled",
}  # fmt: skip
PYTHON = "/usr/bin/python3"
ENVIRONMENT = {**os.environ, "QT_QPA_PLATFORM": "offscreen", "LC_ALL": "C.UTF-8", "PYTHONPATH": ""}


def run(*arguments: object, code: int = 0, dsn: str | None = None) -> str:
    where = [] if dsn is None else ["--dsn", dsn]
    result = CliRunner().invoke(main, [*where, *map(str, arguments)], catch_exceptions=False)
    assert result.exit_code == code, result.output
    return result.output


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


@pytest.fixture(scope="module")
def shared_dsn(server_dsn: str, example_template: str) -> str:
    """Database of the tests that only read."""
    with psycopg.connect(server_dsn, autocommit=True) as connection:
        connection.execute(sql.SQL("CREATE DATABASE plain_shared TEMPLATE {}").format(sql.Identifier(example_template)))
    return make_conninfo(server_dsn, dbname="plain_shared")


@pytest.fixture(scope="module")
def files(shared_dsn: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with whole.gpkg, whole.dxf, and part.gpkg, part.dxf from 12+400 to 12+430."""
    folder = tmp_path_factory.mktemp("plain")
    for suffix in ("gpkg", "dxf"):
        run("export", "demo-2024", "-o", folder / f"whole.{suffix}", dsn=shared_dsn)
        run("export", "demo-2024", "-o", folder / f"part.{suffix}", "--from", "12+400", "--to", "12430", dsn=shared_dsn)
    return folder


def layer(path: Path, name: str) -> tuple[dict[str, Any], np.ndarray, dict[str, np.ndarray]]:
    """Meta, geometries and columns of a layer."""
    meta, _, wkb, values = pyogrio.raw.read(path, layer=name)
    return meta, shapely.from_wkb(wkb), dict(zip(meta["fields"], values, strict=True))


def chainage_of(plan: np.ndarray) -> np.ndarray:
    """Chainage of places (n, 2) near the example's axis, by its own formula: it runs on a circle from due north."""
    away = plan - CENTRE
    return FIRST + CURVE * np.arctan2(away[:, 1], -away[:, 0])


def test_geopackage_has_the_layers_in_their_systems(files: Path, shared_dsn: str) -> None:
    path = files / "whole.gpkg"
    named = {name for name, geometry in pyogrio.list_layers(path) if geometry is not None}
    assert named >= {"axis", "axis_vertex", "segment", "section", "leak_map", "leak_3d", "chainage", "lining_map", *UNROLLED}
    with sqlite3.connect(path) as connection:
        systems = dict(connection.execute("SELECT table_name, srs_id FROM gpkg_contents WHERE data_type = 'features'"))
        assert {name for name, srid in systems.items() if srid == -1} == UNROLLED
        assert {srid for name, srid in systems.items() if name not in UNROLLED} == {25830}
        organisation = connection.execute(
            "SELECT organization, organization_coordsys_id FROM gpkg_spatial_ref_sys WHERE srs_id = 25830"
        ).fetchone()
    assert organisation == ("EPSG", 25830)
    with psycopg.connect(shared_dsn) as conn:
        for view in ("axis_vertex", "segment", "section", "leak_map", "cluster", "target_sphere", "region"):
            if view in named:
                query = sql.SQL("SELECT count(*) FROM tunnel_api.{}").format(sql.Identifier(view))
                assert pyogrio.read_info(path, layer=view)["features"] == conn.execute(query).fetchone()[0], view


def test_geopackage_holds_the_rows_of_the_views(files: Path, shared_dsn: str) -> None:
    meta, shapes, columns = layer(files / "whole.gpkg", "leak_3d")
    assert meta["geometry_type"] == "Polygon Z"
    with psycopg.connect(shared_dsn) as conn:
        rows = conn.execute(
            "SELECT id, area, review, array_to_string(reasons, ', '), reviewed_at, detected, ST_AsBinary(geom)"
            " FROM tunnel_api.leak_3d ORDER BY id"
        ).fetchall()
    order = np.argsort(columns["id"])
    assert [row[0] for row in rows] == columns["id"][order].tolist()
    assert [row[1] for row in rows] == pytest.approx(columns["area"][order].tolist())
    assert [row[2] for row in rows] == columns["review"][order].tolist()
    assert [row[3] for row in rows] == columns["reasons"][order].tolist()
    assert [row[4] is None for row in rows] == np.isnat(columns["reviewed_at"][order]).tolist()
    for row, shape in zip(rows, shapes[order], strict=True):
        assert shapely.equals_exact(shapely.from_wkb(bytes(row[6])), shape, 1e-9)
        assert shapely.get_coordinates(shape, include_z=True)[:, 2].min() > 590


def test_missing_values_stay_missing(dsn: str, example: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    conn.execute("UPDATE tunnel.finding SET contrast = NULL WHERE id = 2")
    conn.execute("UPDATE tunnel_api.leak SET review = 'confirmed', remark = 'drips – é' WHERE id = 2")
    (moment,) = conn.execute("SELECT reviewed_at FROM tunnel.finding WHERE id = 2").fetchone()
    conn.commit()
    run("export", example, "-o", tmp_path / "x.gpkg")
    _, _, columns = layer(tmp_path / "x.gpkg", "leak_map")
    (row,) = np.nonzero(columns["id"] == 2)[0]
    assert np.isnan(columns["contrast"]).tolist() == (columns["id"] == 2).tolist()
    assert columns["remark"][row] == "drips – é"
    assert [remark is None for remark in columns["remark"]] == (columns["id"] != 2).tolist()
    assert abs(columns["reviewed_at"][row] - np.datetime64(moment.replace(tzinfo=None), "ms")) <= np.timedelta64(1, "ms")
    with sqlite3.connect(tmp_path / "x.gpkg") as file:
        assert file.execute("SELECT count(*) FROM leak_map WHERE contrast IS NULL").fetchone() == (1,)


def test_ticks_stand_across_the_axis_at_their_chainage(files: Path) -> None:
    _, lines, columns = layer(files / "whole.gpkg", "chainage")
    assert columns["chainage"].tolist() == np.arange(12300, 12501, 10).tolist()
    assert columns["label"][7] == "12+370.000"
    assert columns["chainage"][columns["hundred"].astype(bool)].tolist() == [12300, 12400, 12500]
    at = shapely.get_coordinates(lines, include_z=True).reshape(-1, 2, 3)
    middle = at.mean(axis=1)
    # A frame of the ruled planes leaves the arc of 300 m by less than 1 mm; the middle is the axis, also in height.
    assert np.abs(chainage_of(middle[:, :2]) - columns["chainage"]).max() < 0.002
    assert np.abs(middle[:, 2] - (600 + 0.02 * (columns["chainage"] - FIRST))).max() < 0.001
    assert np.ptp(at[:, :, 2], axis=1).max() < 1e-6
    # From left to right: the curve bends to the right, so the right end is nearer to its centre, by the tick's length.
    reach = np.linalg.norm(at[:, :, :2] - CENTRE, axis=2)
    assert reach[:, 0] - reach[:, 1] == pytest.approx(np.where(columns["hundred"], 6.0, 2.0), abs=1e-3)


def test_lining_is_laid_flat(files: Path) -> None:
    _, flat, columns = layer(files / "whole.gpkg", "lining_unrolled")
    half = RADIUS * np.arccos(-HEIGHT / RADIUS) + np.sqrt(RADIUS**2 - HEIGHT**2)  # wall, and half the floor
    assert len(flat) == 20
    # Nodes stand a degree apart: the polygon through them falls short of the arc by a part in 70 000.
    assert shapely.area(flat).sum() == pytest.approx((LAST - FIRST) * 2 * half, rel=2e-3)
    assert columns["chainage_from"].min() == FIRST
    _, laid, _ = layer(files / "whole.gpkg", "lining_map")
    # Left of the axis a metre of chainage is longer on the map than right of it, by as much: the area is the same.
    assert shapely.area(laid).sum() == pytest.approx(shapely.area(flat).sum(), rel=2e-3)
    outer = np.linalg.norm(shapely.get_coordinates(laid) - CENTRE, axis=1)
    assert (outer.min(), outer.max()) == pytest.approx((CURVE - half, CURVE + half), abs=0.05)


def test_a_stretch_is_cut_out(files: Path) -> None:
    path = files / "part.gpkg"
    _, (axis,), columns = layer(path, "axis")
    assert (columns["chainage_from"][0], columns["label_to"][0]) == (12400.0, "12+430.000")
    ends = chainage_of(shapely.get_coordinates(axis)[[0, -1]])
    assert ends == pytest.approx([12400, 12430], abs=0.01)
    _, _, segments = layer(path, "segment")
    assert segments["chainage_from"].tolist() == [12400, 12410, 12420]
    _, _, leaks = layer(path, "dark_unrolled")
    assert leaks["kind"].tolist() == ["joint"]
    _, _, leaks = layer(path, "leak_unrolled")
    middles = np.sort((leaks["chainage_from"] + leaks["chainage_to"]) / 2)
    assert middles == pytest.approx([12402.5, 12421, 12428], abs=1)
    _, _, regions = layer(path, "region")
    assert len(regions["id"]) == 1  # 12+410 to 12+414
    assert pyogrio.read_info(path, layer="chainage")["features"] == 4


def test_qgis_shows_the_geopackage_in_its_styles(files: Path) -> None:
    script = """
import json, os, sys
from qgis.core import QgsApplication, QgsVectorLayer
application = QgsApplication([], True)
application.initQgis()
seen = {}
for name in sys.argv[2:]:
    layer = QgsVectorLayer(f"{sys.argv[1]}|layername={name}", name, "ogr")
    _, loaded = layer.loadDefaultStyle()
    seen[name] = [layer.isValid(), loaded, layer.renderer().type(), layer.crs().authid(), layer.labelsEnabled()]
print(json.dumps(seen))
sys.stdout.flush()
os._exit(0)
"""
    path = files / "whole.gpkg"
    named = [name for name, geometry in pyogrio.list_layers(path) if geometry is not None]
    try:
        subprocess.run([PYTHON, "-c", "import qgis.core"], env=ENVIRONMENT, capture_output=True, check=True)
    except (FileNotFoundError, subprocess.CalledProcessError):
        missing("QGIS")
    done = subprocess.run(
        [PYTHON, "-c", script, str(path), *named], env=ENVIRONMENT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    seen = json.loads(done.stdout.splitlines()[-1])
    assert [name for name, (valid, loaded, *_) in seen.items() if not valid or not loaded] == []
    assert {name for name, (*_, crs, _labels) in seen.items() if crs != "EPSG:25830"} == UNROLLED
    assert seen["leak_map"][2] == "categorizedSymbol"
    assert seen["chainage"][2:] == ["RuleRenderer", "EPSG:25830", True]


def entities(path: Path) -> dict[str, list[Any]]:
    """Entities of a drawing by layer; it must be free of faults."""
    document = ezdxf.readfile(path)
    audit = document.audit()
    assert not audit.errors
    assert not audit.fixes
    found: dict[str, list[Any]] = {name: [] for name in LAYERS}
    for entity in document.modelspace():
        found[entity.dxf.layer].append(entity)
    return found


def test_drawing_is_in_metres_and_says_what_it_is(files: Path) -> None:
    document = ezdxf.readfile(files / "whole.dxf")
    assert (document.dxfversion, document.header["$INSUNITS"], document.header["$MEASUREMENT"]) == ("AC1024", 6, 1)
    assert dict(document.header.custom_vars.properties)["CRS"] == "EPSG:25830"
    assert {view.dxf.name for view in document.views} == {"MAP", "UNROLLED", "PROFILES"}
    for name in LAYERS:
        assert document.layers.get(name).description
    count = Counter(entity.dxf.layer for entity in document.modelspace())
    assert set(LAYERS) == set(count)  # no layer is empty for the example, and nothing lies on another


def test_drawing_lies_in_its_true_place(files: Path) -> None:
    found = entities(files / "whole.dxf")
    (axis,) = found["AXIS"]
    points = np.array([vertex.dxf.location.xyz for vertex in axis.vertices])
    assert np.abs(np.linalg.norm(points[:, :2] - CENTRE, axis=1) - CURVE).max() < 0.005
    assert np.abs(points[:, 2] - (600 + 0.02 * (chainage_of(points[:, :2]) - FIRST))).max() < 0.001
    assert len(found["AXIS_VERTEX"]) == 21
    assert len(found["SECTION_3D"]) == 40
    section = np.array([vertex.dxf.location.xyz for vertex in found["SECTION_3D"][7].vertices])
    chainage = chainage_of(section.mean(axis=0)[None, :2])[0]
    assert chainage == pytest.approx(12337.5, abs=0.05)  # it is plumb to an axis that rises, and leans by 2 %
    # Every vertex lies on the circle about the axis or on the floor below it.
    across = CURVE - np.linalg.norm(section[:, :2] - CENTRE, axis=1)
    up = section[:, 2] - (600 + 0.02 * (12337.5 - FIRST))
    off = np.minimum(np.abs(np.hypot(across, up) - RADIUS), np.abs(up + HEIGHT))
    assert off.max() < 0.01


def number_of(entity: Any) -> int:
    return int(dict(fact.split("=") for _, fact in entity.get_xdata("TUNNELDB"))["id"])


@pytest.mark.parametrize(("text", "whole"), [("", True), ("ä" * 1000, True), ("€ü" * 1000, False)])
def test_a_long_remark_continues_in_further_facts(text: str, whole: bool) -> None:
    facts = [fact.split("=") for fact in facts_of("remark", text)]
    assert [name for name, _ in facts[:3]] == ["remark", "remark_2", "remark_3"][: len(facts)]
    assert max(len("=".join(fact).encode()) for fact in facts) <= 255
    joined = "".join(part for _, part in facts)
    assert joined == text if whole else text.startswith(joined[:-1]) and joined[-1] == "…" and len(joined) > 1500


def distances(points: np.ndarray, ring: np.ndarray) -> np.ndarray:
    """Distance of each point (n, 3) from a ring of straight sides through its vertices (m, 3)."""
    start, side = ring[None], np.roll(ring, -1, axis=0)[None] - ring[None]
    away = points[:, None] - start
    share = np.clip((away * side).sum(axis=2) / (side**2).sum(axis=2), 0, 1)
    return np.linalg.norm(away - share[..., None] * side, axis=2).min(axis=1)


def test_leaks_are_drawn_thrice_and_bear_what_is_known(files: Path, shared_dsn: str) -> None:
    found = entities(files / "whole.dxf")
    with psycopg.connect(shared_dsn) as conn:
        kept = dict(conn.execute("SELECT id, unrolled::text FROM tunnel_api.leak WHERE review <> 'rejected'").fetchall())
        map_area = dict(conn.execute("SELECT id, ST_Area(geom) FROM tunnel_api.leak_map").fetchall())
    assert len(kept) == 6
    for place in ("MAP", "3D", "UNROLLED"):
        numbers = [number_of(entity) for entity in found[f"LEAK_{place}"]]
        assert sorted(numbers) == sorted(kept)
    with psycopg.connect(shared_dsn) as conn:
        surfaces = {
            n: shapely.from_wkb(bytes(w)) for n, w in conn.execute("SELECT id, ST_AsBinary(geom) FROM tunnel_api.leak_3d")
        }
    for entity in found["LEAK_3D"]:
        true = shapely.get_coordinates(surfaces[number_of(entity)], include_z=True)
        drawn = np.array([vertex.dxf.location.xyz for vertex in entity.vertices])
        assert len(drawn) < len(true) / 2
        assert distances(true, drawn).max() < 0.0021
    assert len(found["JOINT_MAP"]) == len(found["DARK_3D"]) == 1
    for entity in found["LEAK_MAP"]:
        facts = dict(fact.split("=") for _, fact in entity.get_xdata("TUNNELDB"))
        outline = shapely.Polygon(entity.get_points("xy"))
        assert outline.area == pytest.approx(map_area[int(facts["id"])], rel=1e-6)
        at = chainage_of(shapely.get_coordinates(outline))
        assert (at.min(), at.max()) == pytest.approx((float(facts["chainage_from"]), float(facts["chainage_to"])), abs=0.01)
    # The unrolled lining is moved, not turned nor scaled.
    lines = sorted((entity.get_points("xy") for entity in found["UNROLLED"]), key=lambda points: points[0][1])
    origin = np.array(lines[1][0]) - [FIRST, 0.0]  # left edge, crown, right edge
    for entity in found["LEAK_UNROLLED"]:
        moved = shapely.Polygon(np.array(entity.get_points("xy")) - origin)
        assert shapely.hausdorff_distance(moved, shapely.from_wkb(bytes.fromhex(kept[number_of(entity)]))) < 1e-6


def test_profiles_stand_side_by_side_with_their_leaks(files: Path) -> None:
    found = entities(files / "whole.dxf")
    boxes = [shapely.Polygon(entity.get_points("xy")) for entity in found["PROFILE"]]
    assert len(boxes) == 40
    area = RADIUS**2 * (np.arccos(-HEIGHT / RADIUS)) + HEIGHT * np.sqrt(RADIUS**2 - HEIGHT**2)
    assert [box.area for box in boxes] == pytest.approx([area] * 40, rel=2e-3)
    assert sum(a.intersects(b) for a in boxes for b in boxes) == 40
    below = min(point[1] for entity in found["UNROLLED"] for point in entity.get_points("xy"))
    assert max(box.bounds[3] for box in boxes) < below < 4_640_000
    stations = {entity.dxf.text: np.array(entity.dxf.align_point.xyz[:2]) for entity in found["PROFILE_TEXT"]}
    assert "12+402.500" in stations
    width = 2 * RADIUS
    assert any(text == f"{width:.2f} × {RADIUS + HEIGHT:.2f} m" for text in stations)
    # One leak lies on a section, 12+402.5, between arcs 3.3 and 5.5 m: its line there follows the wall on the right.
    lines = [np.array(entity.get_points("xy")) for entity in found["LEAK_PROFILE"]]
    place = stations["12+402.500"]
    (box,) = [
        box for box in boxes if abs((box.bounds[0] + box.bounds[2]) / 2 - place[0]) < 0.1 and 0 < box.bounds[1] - place[1] < 1
    ]
    (line,) = [line for line in lines if box.buffer(0.1).contains(shapely.LineString(line))]
    axis = np.array([(box.bounds[0] + box.bounds[2]) / 2, box.bounds[3] - RADIUS])
    turned = np.arctan2(*(line - axis).T)
    assert np.linalg.norm(line - axis, axis=1) == pytest.approx([RADIUS] * len(line), abs=0.002)
    assert turned.min() > 0
    assert RADIUS * (turned.min() + turned.max()) / 2 == pytest.approx(4.4, abs=0.4)


def test_part_of_a_drawing(files: Path) -> None:
    found = entities(files / "part.dxf")
    assert len(found["SECTION_3D"]) == len(found["PROFILE"]) == 6
    assert len(found["LEAK_MAP"]) == 2  # the third is rejected
    (axis,) = found["AXIS"]
    ends = np.array([axis.vertices[k].dxf.location.xyz[:2] for k in (0, -1)])
    assert chainage_of(ends) == pytest.approx([12400, 12430], abs=0.01)


def test_a_drawing_ends_with_the_scan(example: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    """Not with the vertices of the axis farther out, which the GeoPackage has all."""
    conn.execute("UPDATE tunnel.scan_file SET chainage_from = 12303.5, chainage_to = 12486.25")
    conn.commit()
    for name in ("x.dxf", "x.gpkg"):
        run("export", example, "-o", tmp_path / name)
    found = entities(tmp_path / "x.dxf")
    (axis,) = found["AXIS"]
    ends = np.array([axis.vertices[k].dxf.location.xyz[:2] for k in (0, -1)])
    assert chainage_of(ends) == pytest.approx([12303.5, 12486.25], abs=0.01)
    assert (len(found["AXIS_VERTEX"]), len(layer(tmp_path / "x.gpkg", "axis_vertex")[1])) == (18, 21)


def test_other_programs_read_the_drawing(files: Path) -> None:
    meta, _, wkb, values = pyogrio.raw.read(files / "whole.dxf", columns=["Layer"])
    shapes = shapely.from_wkb(wkb)
    on = np.array(values[meta["fields"].tolist().index("Layer")])
    assert set(on) == set(LAYERS)
    assert shapely.length(shapes[on == "AXIS"]).sum() == pytest.approx(LAST - FIRST, abs=0.1)
    assert set(shapely.get_type_id(shapes[on == "SECTION_3D"])) <= {1, 3}


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["-o", "x.txt"], "x.txt: say by the ending what to write, .gpkg or .dxf"),
        (["-o", "x.dxf", "--km", "12"], "--km goes with --classified"),
        (["-o", "x", "--classified", "--from", "12+300"], "--classified writes whole scan files"),
        (["-o", "x.dxf", "--from", "14+000"], "--from 14+000: tunnel demo has no such station"),
        (["-o", "x.dxf", "--to", "12+3"], "metres, as 345.678, not '12+3'"),
        (["-o", "x.gpkg", "--from", "12+300", "--to", "12300"], "between them lies no tunnel"),
        (
            ["-o", "x.dxf", "--from", "14000"],
            "demo-2024 has no data there: it extends from chainage 12300.000 to 12500.000 m",
        ),
        (["-o", "nowhere/x.gpkg"], "nowhere/x.gpkg: cannot be written"),
    ],
)
def test_what_cannot_be_done_is_said_in_a_line(
    example: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], words: str
) -> None:
    monkeypatch.chdir(tmp_path)
    output = run("export", example, *arguments, code=2)
    assert words in output
    assert output.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_stations_choose_the_stretch(dsn: str, example: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    """Stations that run backwards from 5+200 at chainage 12 300: 5+100 is chainage 12 400, 5+070 is 12 430."""
    conn.execute(
        "INSERT INTO tunnel.station_equation (tunnel_id, chainage, station, direction)"
        " SELECT id, 12300, 5200, -1 FROM tunnel.tunnel"
    )
    conn.commit()
    run("export", example, "-o", tmp_path / "x.gpkg", "--from", "5+100", "--to", "5+070")
    _, _, columns = layer(tmp_path / "x.gpkg", "chainage")
    assert columns["chainage"].tolist() == [12400, 12410, 12420, 12430]
    assert columns["label"].tolist() == ["5+100.000", "5+090.000", "5+080.000", "5+070.000"]


def test_a_stretch_between_two_ticks(shared_dsn: str, tmp_path: Path) -> None:
    for suffix in ("gpkg", "dxf"):
        run("export", "demo-2024", "-o", tmp_path / f"x.{suffix}", "--from", "12+301", "--to", "12+305", dsn=shared_dsn)
    with sqlite3.connect(tmp_path / "x.gpkg") as file:
        counts = [file.execute(f"SELECT count(*) FROM {name}").fetchone()[0] for name in ("axis", "chainage", "lining_map")]
    assert counts == [1, 0, 1]
    found = entities(tmp_path / "x.dxf")
    assert [len(found[name]) for name in ("AXIS", "CHAINAGE", "SECTION_3D")] == [1, 0, 1]


@pytest.mark.parametrize(("low", "high"), [("12353", "12358"), ("12390", "12399")])
def test_a_stretch_in_a_gap_of_the_survey(example: str, conn: psycopg.Connection, tmp_path: Path, low: str, high: str) -> None:
    """Near the end of what there is, and farther from it than the surface reaches."""
    conn.execute("DELETE FROM tunnel.section WHERE chainage BETWEEN 12350 AND 12450")
    conn.execute("DELETE FROM tunnel.segment WHERE chainage_from >= 12350 AND chainage_to <= 12450")
    conn.commit()
    for suffix in ("gpkg", "dxf"):
        output = run("export", example, "-o", tmp_path / f"x.{suffix}", "--from", low, "--to", high, code=2)
        assert f"demo-2024 has no axis between chainages {low}.000 and {high}.000 m" in output
    assert not list(tmp_path.iterdir())


def test_a_definition_of_several_lines_is_one_in_the_drawing(example: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    conn.execute("UPDATE spatial_ref_sys SET auth_name = 'own', srtext = replace(srtext, ',', E',\n  ') WHERE srid = 25830")
    conn.commit()
    run("export", example, "-o", tmp_path / "x.dxf")
    assert entities(tmp_path / "x.dxf")["AXIS"]
    told = dict(ezdxf.readfile(tmp_path / "x.dxf").header.custom_vars.properties)["CRS"]
    assert told.startswith('PROJCS["ETRS89 / UTM zone 30N", GEOGCS["ETRS89",')


def test_a_survey_without_sections_says_so(dsn: str, example: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    conn.execute("DELETE FROM tunnel.section")
    conn.commit()
    assert "has no sections yet" in run("export", example, "-o", tmp_path / "x.gpkg", code=2)
    assert not list(tmp_path.iterdir())


def test_each_kind_of_finding_has_its_layers(example: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    """Drips, a wet kind of the owner's, and a leak that was judged to be of another kind."""
    conn.execute(
        "INSERT INTO tunnel_api.finding_kind (code, label, geometries, wet, position, active)"
        " VALUES ('seep', 'Seepage', '{polygon,line}', true, 65, true)"
    )
    conn.execute(
        "INSERT INTO tunnel_api.finding_unrolled (survey, kind, geom) VALUES ('demo-2024', 'drip', 'POINT(12360 -2)'),"
        " ('demo-2024', 'seep', 'LINESTRING(12350 1, 12353 1.5)')"
    )
    conn.execute("UPDATE tunnel_api.finding_unrolled SET kind = 'other' WHERE id = 2")
    conn.commit()
    run("export", example, "-o", tmp_path / "x.dxf")
    document = ezdxf.readfile(tmp_path / "x.dxf")
    count = Counter(entity.dxf.layer for entity in document.modelspace())
    for place in ("MAP", "3D", "UNROLLED"):
        assert [count[f"{kind}_{place}"] for kind in ("DRIP", "SEEP", "OTHER")] == [1, 1, 1]
    assert document.layers.get("SEEP_MAP").description == "Seepage beside the axis, on the map"
