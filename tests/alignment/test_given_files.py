"""Axes from tables, maps and drawings: each format holds the same line, written by another library."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import shapely
from support.axis_files import LINE, SRID, chain, dxf, edited, gis, pieces, written

from tunneldb.alignment.given import read_given
from tunneldb.alignment.joining import join_pieces
from tunneldb.errors import UserError


def text(path: Path, separator: str, comma: bool) -> Path:
    rows = [separator.join(f"{value:.3f}" for value in row) for row in LINE]
    lines = [separator.join("XYZ"), *(row.replace(".", ",") if comma else row for row in rows)]
    path.write_text("\n".join(lines) + "\n")
    return path


WRITERS: dict[str, Callable[[Path], Path]] = {
    "comma": lambda f: text(f / "a.csv", ",", False),
    "semicolon": lambda f: text(f / "a.csv", ";", False),
    "decimal comma": lambda f: text(f / "a.csv", ";", True),
    "tab": lambda f: text(f / "a.txt", "\t", True),
    "spaces": lambda f: text(f / "a.xyz", "   ", False),
    "gpkg": lambda f: gis(f / "a.gpkg", pieces()),
    "gpkg of multi lines": lambda f: gis(f / "a.gpkg", [shapely.MultiLineString(pieces())]),
    "shp": lambda f: gis(f / "a.shp", pieces()),
    "geojson": lambda f: gis(f / "a.geojson", pieces()),
    "fgb": lambda f: gis(f / "a.fgb", pieces(), SPATIAL_INDEX="NO"),
    "dxf lines": lambda f: dxf(f / "a.dxf", chain),
    "dxf polyline": lambda f: dxf(f / "a.dxf", lambda space: space.add_polyline3d(LINE)),
}


@pytest.mark.parametrize("kind", WRITERS)
def test_each_format_holds_the_line(kind: str, tmp_path: Path) -> None:
    path = WRITERS[kind](tmp_path)
    given = read_given(path, srid=SRID)
    np.testing.assert_allclose(given.xyz, LINE, atol=1e-6)
    assert given.notes == ()
    np.testing.assert_allclose(read_given(path, srid=SRID, reverse=True, start=50.0).xyz, LINE[::-1], atol=1e-6)


def geojson(path: Path, *coordinates: list[list[float]] | None) -> Path:
    """GeoJSON in the system of the tests, written by hand; None is a row without a geometry."""
    shapes = [None if one is None else {"type": "LineString", "coordinates": one} for one in coordinates]
    rows = [{"type": "Feature", "properties": {}, "geometry": shape} for shape in shapes]
    system = {"type": "name", "properties": {"name": f"urn:ogc:def:crs:EPSG::{SRID}"}}
    return written(path, json.dumps({"type": "FeatureCollection", "crs": system, "features": rows}).encode())


@pytest.mark.parametrize("kind", ["gpkg", "shp", "fgb", "geojson"])
def test_rows_without_geometry_are_left_out_and_counted(kind: str, tmp_path: Path) -> None:
    line, empty = shapely.LineString(LINE), shapely.LineString()
    if kind == "geojson":
        path = geojson(tmp_path / "a.geojson", None, [], LINE.tolist())
    else:
        rows = {"gpkg": [None, empty, line], "shp": [None, line], "fgb": [None, line]}[kind]
        path = gis(
            tmp_path / f"a.{kind}", rows, geometry_type="LineString Z", **({"SPATIAL_INDEX": "NO"} if kind == "fgb" else {})
        )
    given = read_given(path, srid=SRID)
    np.testing.assert_allclose(given.xyz, LINE, atol=1e-6)
    count = "2 of 3" if kind in ("gpkg", "geojson") else "1 of 2"
    assert given.notes == (f"rows without geometry in layer 'a': {count}; left out",)


@pytest.mark.parametrize("missing", [0.0, -9999.0, None])
def test_vertices_without_height_are_interpolated_and_counted(missing: float | None, tmp_path: Path) -> None:
    """As QGIS writes a vertex without height: 0 among heights; and as a missing value, or number."""
    rows = LINE.tolist()
    rows[1][2:] = [] if missing is None else [missing]
    given = read_given(geojson(tmp_path / "a.geojson", rows), srid=SRID)
    plan = np.hypot(*np.diff(LINE[:, :2], axis=0).T)
    np.testing.assert_allclose(given.xyz[1, 2], 100.0 + 2.0 * plan[0] / plan[:2].sum())
    assert given.notes == ("vertices without height in layer 'a': 1; interpolated between their neighbours",)


def test_a_line_at_sea_level_keeps_its_heights(tmp_path: Path) -> None:
    rows = np.column_stack([LINE[:, :2], [2.0, 0.0, 0.0, -2.5]])
    given = read_given(geojson(tmp_path / "a.geojson", rows.tolist()), srid=SRID)
    np.testing.assert_allclose(given.xyz, rows)
    assert given.notes == ()


@pytest.mark.parametrize("kind", ["gpkg", "dxf", "zero", "csv"])
def test_a_line_without_heights_has_none(kind: str, tmp_path: Path) -> None:
    flat = LINE * (1, 1, 0)
    path = {
        "gpkg": lambda: gis(tmp_path / "a.gpkg", [shapely.LineString(LINE[:, :2])]),
        "dxf": lambda: dxf(tmp_path / "a.dxf", lambda space: space.add_lwpolyline(LINE[:, :2])),
        "zero": lambda: gis(tmp_path / "a.gpkg", [shapely.LineString(flat)]),
        "csv": lambda: (
            tmp_path / "a.csv",
            (tmp_path / "a.csv").write_text("E;N\n" + "".join(f"{x};{y}\n" for x, y, _ in LINE)),
        )[0],
    }[kind]()
    given = read_given(path, srid=SRID)
    assert not given.has_heights
    np.testing.assert_allclose(given.xyz[:, :2], LINE[:, :2])


def test_a_trajectory_is_thinned(tmp_path: Path) -> None:
    """A trolley that stands for a while, rolls on by centimetres and trembles meanwhile."""
    way = np.concatenate([np.zeros(50), np.arange(0.0, 40.0, 0.02)])
    tremor = np.random.default_rng(1).normal(0, 0.005, (len(way), 2))
    rows = [
        f"{i / 100},{500_000 + s + dx},{4_640_000 + dy},100" for i, (s, (dx, dy)) in enumerate(zip(way, tremor, strict=True))
    ]
    path = tmp_path / "trajectory.csv"
    path.write_text("time,x,y,z\n" + "\n".join(rows) + "\n")
    given = read_given(path)
    step = np.diff(given.xyz[:, 0])
    assert 4.9 < step.min() <= step.max() < 10.0
    assert given.xyz[-1, 0] == pytest.approx(500_040, abs=0.1)
    assert "a trajectory" in given.notes[0]


def far_apart() -> list[shapely.Geometry]:
    return [shapely.LineString(LINE), shapely.LineString(LINE[:3] + np.array([0, 20, 0]))]


def two_layers(folder: Path) -> Path:
    gis(folder / "a.gpkg", pieces(), layer="tube north")
    gis(folder / "a.gpkg", far_apart()[1:], layer="tube south", append=True)
    return gis(folder / "a.gpkg", [shapely.Point(1, 2)], layer="points", append=True)


def test_of_several_one_is_chosen(tmp_path: Path) -> None:
    path = two_layers(tmp_path)
    with pytest.raises(UserError, match=r"holds 2 layers of lines: 'tube north', 'tube south'; choose one by --axis-layer"):
        read_given(path)
    with pytest.raises(UserError, match="no layer 'points' of lines; it has 'tube north', 'tube south'"):
        read_given(path, layer="points")
    assert read_given(path, layer="tube south").xyz[0, 1] == 4_640_020
    path = gis(tmp_path / "b.gpkg", far_apart())
    with pytest.raises(UserError, match=r"2 separate lines: 1 \(150\.0 m from .*\); 2 \(100\.0 m "):
        read_given(path)
    assert len(read_given(path, alignment="2").xyz) == 3
    with pytest.raises(UserError, match="has no line '3'; it holds 2 separate lines"):
        read_given(path, alignment="3")


REFUSED: dict[str, tuple[Callable[[Path], Path], str]] = {
    "other crs": (lambda f: gis(f / "a.gpkg", pieces(), srid=3794), r"system is EPSG:3794 .*, the tunnel's is EPSG:25830"),
    "degrees": (lambda f: gis(f / "a.geojson", [shapely.LineString([(1, 41), (2, 42)])], 4326), r"EPSG:4326 .*25830"),
    "points": (lambda f: gis(f / "a.gpkg", [shapely.Point(1, 2)], layer="p"), "holds no lines; its layers: 'p'; draw the axis"),
    "no lines": (lambda f: dxf(f / "a.dxf", lambda space: space.add_circle((0, 0), 5)), "no lines, but 1 CIRCLE; draw"),
    "sheet": (lambda f: dxf(f / "a.dxf", sheet), r"\(layout 'Layout1' has some\); draw the axis as a line in model space"),
    "comma": (lambda f: edited(dxf(f / "a.dxf", chain), "500050.0", "500050,0"), "Export it again, with decimal points"),
    "nan": (lambda f: edited(dxf(f / "a.dxf", chain), "500050.0", "nan"), "2 lines of layer 'AXIS' with invalid coordinates"),
    "UTF-16": (lambda f: written(f / "a.dxf", "\ufeff0\nSECTION\n".encode("utf-16-le")), "text is UTF-16; save it as UTF-8"),
    "kml": (lambda f: written(f / "a.kml", b'<kml xmlns="http://www.opengis.net/kml/2.2"/>'), "root is kml, .* as GeoPackage"),
    "pdf": (lambda f: written(f / "a.pdf", b"%PDF-1.7"), "is a PDF; export its drawing as DXF"),
    "dbf": (lambda f: gis(f / "a.shp", pieces()).with_suffix(".dbf"), r"is one file of a Shapefile; pass .*a\.shp"),
    "only empty": (lambda f: gis(f / "a.gpkg", [None], geometry_type="LineString"), "no line with a length; draw the axis"),
    "turns back": (
        lambda f: gis(f / "a.gpkg", [shapely.LineString([(0, 0, 1), (20, 0, 1), (10, 1, 1)])]),
        "at 10.00,1.00 the axis reverses here",
    ),
    "broken dxf": (lambda f: written(f / "a.dxf", b"0\nSECTION\n2\nHEAD"), "cannot be read as DXF"),
    "broken gpkg": (lambda f: written(f / "a.gpkg", b"SQLite format 3\0nothing else"), "cannot be read"),
    "broken geojson": (lambda f: written(f / "a.geojson", b'{"type": "Feature'), "cannot be read"),
    "zip": (lambda f: written(f / "a.zip", b"PK\x03\x04...."), "is a ZIP archive or a spreadsheet; unpack it"),
    "dwg": (lambda f: written(f / "a.dwg", b"AC1032...."), "is a DWG drawing; save it as DXF"),
    "scan": (lambda f: written(f / "a.las", b"LASF...."), "is a scan, not an axis; --axis auto"),
    "no header": (lambda f: written(f / "a.csv", b"500000.0;4640000.0;100\n"), "the first line must contain column names"),
    "two eastings": (lambda f: written(f / "a.csv", b"e,easting,n,h\n1,2,3,4\n"), "e and easting may both be x"),
}  # fmt: skip


def sheet(space: object) -> None:
    space.doc.layout("Layout1").add_polyline3d(LINE)  # type: ignore[attr-defined]


@pytest.mark.parametrize("kind", REFUSED)
def test_what_is_refused_is_said_in_one_line(kind: str, tmp_path: Path) -> None:
    make, message = REFUSED[kind]
    path = make(tmp_path)
    with pytest.raises(UserError, match=message) as caught:
        read_given(path, srid=SRID)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


def test_a_shapefile_is_whole_or_the_missing_files_are_named(tmp_path: Path) -> None:
    whole = gis(tmp_path / "a.shp", pieces())
    (tmp_path / "b").mkdir()
    alone = Path(shutil.copy(whole, tmp_path / "b"))
    with pytest.raises(UserError, match=r"copy the files that belong to it to the same folder: \.shx, also \.dbf and \.prj"):
        read_given(alone, srid=SRID)
    for suffix in (".shx", ".dbf", ".prj"):
        shutil.copy(whole.with_suffix(suffix), alone.with_suffix(suffix.upper()))
    given = read_given(alone.rename(alone.with_suffix(".SHP")), srid=SRID)
    np.testing.assert_allclose(given.xyz, LINE, atol=1e-6)
    assert given.notes == ()
    content = whole.read_bytes()
    whole.write_bytes(content[:-20])
    with pytest.raises(UserError, match=f"is truncated: its header states {len(content)} bytes, it has {len(content) - 20}"):
        read_given(whole, srid=SRID)
    whole.write_bytes(content)
    whole.with_suffix(".prj").write_text("no system")
    assert "a coordinate system that cannot be read (a.prj); using the tunnel's" in read_given(whole, srid=SRID).notes[0]


@pytest.mark.filterwarnings("ignore:'crs' was not provided")
def test_units_and_systems_that_are_not_stated_are_said(tmp_path: Path) -> None:
    assert "states no coordinate system" in read_given(gis(tmp_path / "a.shp", pieces(), srid=None), srid=SRID).notes[0]
    assert "states no unit" in read_given(dxf(tmp_path / "a.dxf", chain, 0)).notes[0]
    millimetres = read_given(dxf(tmp_path / "b.dxf", lambda s: s.add_polyline3d(1000 * (LINE - LINE[0])), 4), unit="millimeter")
    np.testing.assert_allclose(millimetres.xyz[:, :2], (LINE - LINE[0])[:, :2], atol=1e-6)
    wrong = read_given(dxf(tmp_path / "c.dxf", chain, 1), unit="meter")  # inches: what a template says
    np.testing.assert_allclose(wrong.xyz, LINE, atol=1e-6)
    assert "as given; the file states in" in wrong.notes[0]


def test_options_that_mean_nothing_are_refused(tmp_path: Path) -> None:
    def refused(message: str, path: Path, **options: str) -> None:
        with pytest.raises(UserError, match=message):
            read_given(path, **options)  # type: ignore[arg-type]

    refused("a table of points, for which --axis-layer does not apply", text(tmp_path / "a.csv", ",", False), layer="x")
    refused("is a map, for which --axis-unit does not apply", gis(tmp_path / "a.gpkg", pieces()), unit="foot")


def test_pieces_are_joined_as_far_as_there_is_one_way() -> None:
    ring = np.array([[0.0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0]])
    fork = [ring[:2], ring[1:3], np.array([[10.0, 0, 0], [20, 0, 0]])]
    assert sorted(len(line) for line in join_pieces(fork)) == [2, 2, 2]
    closed = join_pieces([ring[:3], ring[[3, 2]], ring[[0, 3]]])
    assert len(closed) == 1
    np.testing.assert_array_equal(closed[0][0], closed[0][-1])
    above = np.array([[10.0, 0, 5], [20, 0, 5]])  # at the same place in plan, 5 m higher
    assert len(join_pieces([ring[:2], above])) == 2
    assert join_pieces([ring[:1], np.repeat(ring[:1], 3, axis=0)]) == []
