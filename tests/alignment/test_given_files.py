"""Axes from tables, maps and drawings: each format holds the same line, written by another library."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import ezdxf
import numpy as np
import pyogrio
import pytest
import shapely

from tunneldb.alignment.given import GivenAxis, read_given
from tunneldb.alignment.joining import join_pieces
from tunneldb.arrays import Float
from tunneldb.errors import UserError

SRID = 25830
LINE = np.array(
    [[500_000.0, 4_640_000.0, 100.0], [500_050, 4_640_000, 101], [500_099, 4_640_010, 102], [500_147, 4_640_024, 103]]
)


def gis(
    path: Path, geometries: list[shapely.Geometry], srid: int | None = SRID, layer: str | None = None, **more: object
) -> Path:
    pyogrio.raw.write(
        path,
        np.array([shapely.to_wkb(g) for g in geometries], dtype=object),
        [],
        [],
        layer=layer,
        geometry_type=more.pop("geometry_type", geometries[0].geom_type + (" Z" if geometries[0].has_z else "")),
        crs=f"EPSG:{srid}" if srid else None,
        **more,
    )
    return path


def pieces(xyz: Float = LINE) -> list[shapely.Geometry]:
    """The line in pieces, out of order, the middle one drawn backwards."""
    return [shapely.LineString(xyz[2:]), shapely.LineString(xyz[[2, 1]]), shapely.LineString(xyz[:2])]


def dxf(path: Path, draw: Callable, insunits: int = 6) -> Path:  # type: ignore[type-arg]
    document = ezdxf.new("R2018")
    document.header["$INSUNITS"] = insunits
    draw(document.modelspace())
    document.saveas(path)
    return path


def chain(space: object) -> None:
    for a, b in ((2, 3), (1, 0), (1, 2)):
        space.add_line(LINE[a], LINE[b], dxfattribs={"layer": "AXIS"})  # type: ignore[attr-defined]


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


def test_arcs_and_bulges_keep_their_circle(tmp_path: Path) -> None:
    """Straight, quarter of a circle of R 60 as a bulge of tan(90°/4), straight: in one polyline, and as LINE and ARC."""
    bulge = np.tan(np.radians(90.0 / 4))
    ends = [(0.0, 0.0, 0.0), (100.0, 0.0, bulge), (160.0, 60.0, 0.0), (160.0, 160.0, 0.0)]
    one = dxf(
        tmp_path / "one.dxf",
        lambda space: space.add_lwpolyline([(x, y, b) for x, y, b in ends], format="xyb", dxfattribs={"elevation": 12.0}),
    )

    def apart(space: object) -> None:
        space.add_line((0, 0, 12), (100, 0, 12))  # type: ignore[attr-defined]
        space.add_arc((100, 60, 12), 60, 270, 360)  # type: ignore[attr-defined]
        space.add_line((160, 160, 12), (160, 60, 12))  # type: ignore[attr-defined]

    for path in (one, dxf(tmp_path / "apart.dxf", apart)):
        xyz = read_given(path).xyz
        xyz = xyz if xyz[0, 0] < 1 else xyz[::-1]
        length = np.hypot(*np.diff(xyz[:, :2], axis=0).T)
        assert length.sum() == pytest.approx(200.0 + 60.0 * np.pi / 2, abs=0.01)
        assert length.max() < 2.0
        on = xyz[(xyz[:, 0] > 100.1) & (xyz[:, 1] < 59.9)]
        np.testing.assert_allclose(np.hypot(on[:, 0] - 100.0, on[:, 1] - 60.0), 60.0, atol=0.001)
        assert set(xyz[:, 2].round(6)) == {12.0}


def test_a_spline_is_followed(tmp_path: Path) -> None:
    path = dxf(tmp_path / "a.dxf", lambda space: space.add_spline([tuple(p) for p in LINE - LINE[0]]))
    line = shapely.LineString(read_given(path).xyz)
    assert max(line.distance(shapely.Point(p)) for p in LINE - LINE[0]) < 0.001


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
    "millimetres": (lambda f: dxf(f / "a.dxf", chain, 4), r"unit is mm \(\$INSUNITS 4\); .* --axis-unit"),
    "no lines": (lambda f: dxf(f / "a.dxf", lambda space: space.add_circle((0, 0), 5)), "holds no lines; draw the axis"),
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


def written(path: Path, content: bytes) -> Path:
    path.write_bytes(content)
    return path


@pytest.mark.parametrize("kind", REFUSED)
def test_what_is_refused_is_said_in_one_line(kind: str, tmp_path: Path) -> None:
    make, message = REFUSED[kind]
    path = make(tmp_path)
    with pytest.raises(UserError, match=message) as caught:
        read_given(path, srid=SRID)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


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


def test_a_landxml_says_its_unit_or_is_asked(tmp_path: Path) -> None:
    path = tmp_path / "a.xml"
    bare = (Path(__file__).parents[1] / "data" / "j-landxml.xml").read_text()
    begin, end = bare.index("<Units"), bare.index("</Units>") + len("</Units>")
    path.write_text(bare[:begin] + bare[end:])
    with pytest.raises(UserError, match=r"states no unit of lengths .* --axis-unit"):
        read_given(path)

    def length(given: GivenAxis) -> float:
        return float(np.hypot(*np.diff(given.xyz[:, :2], axis=0).T).sum())

    assert read_given(path, unit="foot").design is not None
    assert length(read_given(path, unit="foot")) == pytest.approx(0.3048 * length(read_given(path, unit="meter")), abs=0.001)
    assert read_given(path, unit="meter").notes[0].endswith("1 unit is 1 m, as given; the file states none")
    with pytest.raises(UserError, match="own direction"):
        read_given(path, unit="meter", reverse=True)


def test_a_landxml_whose_height_lacks_its_decimal_point_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.xml"
    bare = (Path(__file__).parents[1] / "data" / "j-landxml.xml").read_text()
    straight = re.sub(r" *<ParaCurve.*</ParaCurve>\n", "", bare)
    path.write_text(straight)
    assert read_given(path).xyz[:, 2].max() < 91.0
    path.write_text(straight.replace("995.94618316 75.38160000", "995.94618316 75381.60000"))
    with pytest.raises(UserError, match=r"a\.xml: at chainage .* its profile rises .* is a decimal point missing"):
        read_given(path)
