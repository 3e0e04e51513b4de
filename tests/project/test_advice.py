"""Messages that say what to do: each test provokes a message, does what it says, and succeeds."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import ezdxf
import laspy
import numpy as np
import pyogrio
import pytest
import shapely
from support.advice import advised
from support.axis_files import J_LANDXML, LINE, SRID, chain, dxf, gis, pieces

from tunneldb.alignment.given import read_given
from tunneldb.csvfile import read_csv, read_texts
from tunneldb.pipeline.profile_file import read_profile
from tunneldb.pointcloud.reader import read_chunks, read_header
from tunneldb.pointcloud.rewrite import rewrite_with_numbers
from tunneldb.pointcloud.stations import read_stations
from tunneldb.simulate.checks import require_within
from tunneldb.simulate.parameters import LIMITS, Parameters
from tunneldb.store.scanner import read_reference

XYZ = [[1.5, 2.0, 3.0], [4640000.5, 5.0, 6.0]]

Edit = Callable[[bytes, re.Match[str]], bytes]


def replaced(old: bytes, new: bytes) -> Edit:
    return lambda content, _: content.replace(old, new)


def without_line(content: bytes, found: re.Match[str]) -> bytes:
    """Remove the line that the message names."""
    lines = content.splitlines(keepends=True)
    del lines[int(found["line"]) - 1]
    return b"".join(lines)


def as_utf8(content: bytes, _: re.Match[str]) -> bytes:
    return content.decode("utf-16").encode()


GOOD = b"1.5 2 3\n4640000.5 5 6\n"
CLOUDS: dict[str, tuple[str, bytes, str, Edit]] = {
    "commas": ("a.xyz", GOOD.replace(b".", b","), "write decimals with a point", replaced(b",", b".")),
    "commas in a table": (
        "a.csv", b"x;y;z\n" + GOOD.replace(b".", b",").replace(b" ", b";"), "write decimals with a point", replaced(b",", b"."),
    ),
    "thousands": (
        "a.csv", b"x;y;z\n1.5;2;3\n4'640'000.5;5;6\n", "write it without separators of thousands", replaced(b"'", b""),
    ),
    "UTF-16": ("a.xyz", GOOD.decode().encode("utf-16"), "save it as UTF-8", as_utf8),
    "CR": ("a.xyz", GOOD.replace(b"\n", b"\r"), "save it with line ends LF", replaced(b"\r", b"\n")),
    "count": (
        "a.asc", b"//X Y Z\n3\n" + GOOD, r"line (?P<line>\d+) states 3 points, but 2 follow; .* remove that line", without_line,
    ),
}  # fmt: skip


def points(path: Path) -> list[list[float]]:
    read_header(path)
    return [row for chunk in read_chunks(path, None) for row in chunk.xyz.tolist()]


@pytest.mark.parametrize("kind", CLOUDS)
def test_points_in_text(kind: str, tmp_path: Path) -> None:
    name, content, advice, edit = CLOUDS[kind]
    path = tmp_path / name
    path.write_bytes(content)
    path.write_bytes(edit(content, advised(lambda: points(path), advice)))
    assert points(path) == XYZ


def test_names_of_columns_are_written_by_the_command_of_the_message(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("1.5 2 3 0.5\n")
    subprocess.run(advised(lambda: read_header(path), "name them: (echo .*)$")[1], shell=True, check=True)
    assert read_header(path).dimensions == ("column4",)
    assert points(path) == XYZ[:1]


@pytest.mark.parametrize(
    ("content", "advice", "names"),
    [
        ("x y z\n1.5 2 3 word\n", r"write 4 names, - for a column to leave out, to (.*)$", "x y z -"),
        ("wall 1.5 2 3\nwall 4 5 6\n", r"write the column names, with x, y and z, to (.*)$", "- x y z"),
    ],
)
def test_names_of_columns_are_written_to_the_file_of_the_message(content: str, advice: str, names: str, tmp_path: Path) -> None:
    path = tmp_path / "a.xyz"
    path.write_text(content)
    Path(advised(lambda: read_header(path), advice)[1]).write_text(names)
    assert points(path)[0] == XYZ[0]


TABLES: dict[str, tuple[bytes, str, Edit]] = {
    "commas": (b"x,y,z\n1,5,2,3\n", "write decimals with a point", replaced(b"1,5", b"1.5")),
    "comma in quotes": (b'x,y,z\n"1,5",2,3\n', "write decimals with a point", replaced(b"1,5", b"1.5")),
    "thousands": (b"x;y;z\n1.000,5;2;3\n", "write it without separators of thousands", replaced(b"1.000,5", b"1,5")),
    "nan": (b"x,y,z\nnan,1,1\n1.5,2,3\n", r"line (?P<line>\d+): .*; remove the line", without_line),
    "empty": (b"x,y,z\n1.5,2,3\n,1,1\n", r"line (?P<line>\d+): .* is empty; fill it in, or remove the line", without_line),
    "two names": (b"east,easting,y,z\n1.5,9,2,3\n", "rename one of them to (x)", replaced(b"east,", b"x,")),
    "no header": (
        b"1.5,2,3\n", "the first line must name the columns (x,y,z)", lambda text, found: found[1].encode() + b"\n" + text,
    ),
    "separator": (b"x|y|z\n1.5|2|3\n", "separate columns by commas, semicolons, tabs or spaces", replaced(b"|", b";")),
    "nothing": (b"", "is empty; write the header (x,y,z)", lambda _, found: found[1].encode() + b"\n1.5,2,3\n"),
    "no text": (b"x,y,z\n1.5,2,3\n\x00\x00\n", "save the table as CSV UTF-8", replaced(b"\x00", b"")),
}  # fmt: skip


@pytest.mark.parametrize("kind", TABLES)
def test_tables(kind: str, tmp_path: Path) -> None:
    content, advice, edit = TABLES[kind]
    path = tmp_path / "a.csv"
    path.write_bytes(content)

    def read() -> list[list[float]]:
        return read_csv(path, ("x", "y", "z")).values.tolist()

    path.write_bytes(edit(content, advised(read, advice)))
    assert read() == XYZ[:1]


def test_words_of_a_table_are_saved_as_utf8(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes("id,x\nTür,1\n".encode("cp1252"))
    advised(lambda: read_texts(path, "id"), "save the table as CSV UTF-8")
    path.write_text(path.read_text("cp1252"), "utf-8")
    assert read_texts(path, "id") == ["Tür"]


def test_a_table_is_sorted_without_repeats(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    head, *rows = ["range_m,intensity_db", "2,5", "1,4", "2,5"]
    path.write_text("\n".join([head, *rows]))
    advised(lambda: read_reference(path), "sort by range_m, without repeats")
    path.write_text("\n".join([head, *sorted(set(rows))]))
    assert read_reference(path)["range_m"].tolist() == [1.0, 2.0]


AXES: dict[str, tuple[bytes, str, Edit]] = {
    "no header": (b"1,2,3\n2,2,3\n", "the first line must contain column names, for example (x,y,z)",
                  lambda text, found: found[1].encode() + b"\n" + text),
    "standing": (b"x,y,z\n1,2,3\n1,2,3\n2,2,3\n", r"line (?P<line>\d+): the same x,y .*; remove one of them", without_line),
    "back": (b"x,y,z\n1,2,3\n3,2,3\n2,2,3\n", "sort its points by ascending chainage",
             lambda text, _: b"\n".join([b"x,y,z", *sorted(text.split()[1:])])),
}  # fmt: skip


@pytest.mark.parametrize("kind", AXES)
def test_an_axis_in_a_table(kind: str, tmp_path: Path) -> None:
    content, advice, edit = AXES[kind]
    path = tmp_path / "a.csv"
    path.write_bytes(content)
    path.write_bytes(edit(content, advised(lambda: read_given(path), advice)))
    assert read_given(path).xyz[-1, 0] in (2.0, 3.0)


def one_of_two_layers(folder: Path) -> None:
    path = gis(folder / "a.gpkg", pieces(), layer="north")
    gis(path, [shapely.LineString(LINE + 20.0)], layer="south", append=True)
    layer = advised(lambda: read_given(path), "'north', '(south)'; choose one by --axis-layer NAME")[1]
    np.testing.assert_allclose(read_given(path, layer=layer).xyz, LINE + 20.0)


def one_of_two_lines(folder: Path) -> None:
    path = gis(folder / "a.gpkg", [shapely.LineString(LINE[:3]), shapely.LineString(LINE + 20.0)])
    number = advised(lambda: read_given(path), r"; (\d) \(100.*; choose one by --alignment NUMBER")[1]
    np.testing.assert_allclose(read_given(path, alignment=number).xyz, LINE[:3])


def another_system(folder: Path) -> None:
    """Save the line in the system of the tunnel, as QGIS does."""
    from pyproj import Transformer

    other = Transformer.from_crs(SRID, 25829, always_xy=True).transform
    path = gis(folder / "a.gpkg", [shapely.transform(shapely.LineString(LINE[:, :2]), other, interleaved=False)], 25829)
    srid = advised(
        lambda: read_given(path, srid=SRID), r"save the line in EPSG:(\d+) .*, or add the tunnel with the line's SRID"
    )[1]
    assert read_given(path, srid=25829).xyz.shape == LINE.shape
    back = Transformer.from_crs(25829, int(srid), always_xy=True).transform
    rows = shapely.from_wkb(pyogrio.raw.read(path)[2])
    saved = gis(folder / "b.gpkg", list(shapely.transform(rows, back, interleaved=False)), int(srid))
    np.testing.assert_allclose(read_given(saved, srid=SRID).xyz[:, :2], LINE[:, :2], atol=0.001)


def a_part_of_a_shapefile(folder: Path) -> None:
    path = gis(folder / "a.shp", pieces())
    whole = advised(lambda: read_given(path.with_suffix(".dbf"), srid=SRID), "is one file of a Shapefile; pass (.*)$")[1]
    np.testing.assert_allclose(read_given(Path(whole), srid=SRID).xyz, LINE)


def a_shapefile_alone(folder: Path) -> None:
    path = gis(folder / "a.shp", pieces())
    (folder / "there").mkdir()
    alone = Path(shutil.copy(path, folder / "there"))
    found = advised(lambda: read_given(alone, srid=SRID), r"copy the files .*: (\.\w+), also (\.\w+) and (\.\w+)$")
    for suffix in found.groups():
        shutil.copy(path.with_suffix(suffix), alone.with_suffix(suffix))
    given = read_given(alone, srid=SRID)
    np.testing.assert_allclose(given.xyz, LINE)
    assert given.notes == ()


def an_option_of_another_format(folder: Path) -> None:
    path = gis(folder / "a.gpkg", pieces())
    options = {"--axis-unit": "unit"}
    option = advised(lambda: read_given(path, unit="foot"), "for which (--[a-z-]+) does not apply; omit it")[1]
    given = {"unit": "foot"}
    del given[options[option]]
    np.testing.assert_allclose(read_given(path, **given).xyz, LINE)  # type: ignore[arg-type]


def a_drawing_of_other_things(folder: Path) -> None:
    path = dxf(folder / "a.dxf", lambda space: space.add_circle((0, 0), 5))
    advised(lambda: read_given(path), "draw the axis as a line in model space")
    document = ezdxf.readfile(path)
    chain(document.modelspace())
    document.saveas(path)
    np.testing.assert_allclose(read_given(path).xyz, LINE)


def blocks_that_multiply(folder: Path) -> None:
    def draw(space: Any) -> None:
        block = space.doc.blocks.new("B")
        for _ in range(3):
            block.add_line((0, 0), (1, 0))
        space.add_blockref("B", (0, 0))

    path = dxf(folder / "a.dxf", draw)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("tunneldb.alignment.dxf._MAX_IN_BLOCKS", 2)
        advised(lambda: read_given(path), "write the axis alone to a file")
        np.testing.assert_allclose(read_given(dxf(folder / "b.dxf", chain)).xyz, LINE)


def a_drawing_with_decimal_commas(folder: Path) -> None:
    path = dxf(folder / "a.dxf", chain)
    good = path.read_text()
    path.write_text(good.replace("500050.0", "500050,0"))
    advised(lambda: read_given(path), "Export it again, with decimal points")
    path.write_text(good)
    np.testing.assert_allclose(read_given(path).xyz, LINE)


def a_landxml_in_an_asian_encoding(folder: Path) -> None:
    text = J_LANDXML.read_text()
    path = folder / "a.xml"
    path.write_bytes(re.sub("encoding=.[^ ?]*", 'encoding="shift_jis"', text, count=1).encode("shift_jis", "replace"))
    advised(lambda: read_given(path), "cannot be read as XML: .*; save it as UTF-8")
    path.write_text(re.sub("encoding=.[^ ?]*", 'encoding="UTF-8"', text, count=1), "utf-8")
    assert len(read_given(path).xyz) > 2


def a_landxml_without_profile(folder: Path) -> None:
    text = J_LANDXML.read_text()
    path = folder / "a.xml"
    path.write_text(re.sub("<Profile.*</Profile>", "", text, flags=re.DOTALL))
    advised(lambda: read_given(path), "has no profile, .*; export both together")
    path.write_text(text)
    assert read_given(path).has_heights


FILES = [
    a_landxml_in_an_asian_encoding, a_landxml_without_profile,
    one_of_two_layers, one_of_two_lines, another_system, a_part_of_a_shapefile, a_shapefile_alone, an_option_of_another_format,
    a_drawing_of_other_things, blocks_that_multiply, a_drawing_with_decimal_commas,
]  # fmt: skip


@pytest.mark.parametrize("case", FILES, ids=lambda case: case.__name__)
def test_an_axis_in_a_file(case: Callable[[Path], None], tmp_path: Path) -> None:
    case(tmp_path)


def test_coordinates_of_a_ply_are_exported_as_double(tmp_path: Path) -> None:
    path = tmp_path / "a.ply"
    header = "ply\nformat binary_little_endian 1.0\nelement vertex 1\n{}end_header\n"

    def write(kind: str, dtype: str) -> None:
        names = "".join(f"property {kind} {name}\n" for name in "xyz")
        path.write_bytes(header.format(names).encode() + np.array(XYZ[1], dtype).tobytes())

    write("float", "<f4")
    advised(lambda: read_header(path), "export them as double")
    write("double", "<f8")
    assert points(path) == XYZ[1:]


def test_members_are_numbered_in_the_original_scan(tmp_path: Path) -> None:
    las = laspy.LasData(laspy.LasHeader(point_format=6, version="1.4"))
    las.x = las.y = las.z = np.arange(3.0)
    source, target = tmp_path / "a.laz", tmp_path / "b.laz"
    las.write(source)

    def number(path: Path) -> None:
        rewrite_with_numbers(path, tmp_path / "c.laz", [[np.arange(3, dtype=np.uint32)]], {"member": "number"})

    number(source)
    (tmp_path / "c.laz").rename(target)
    advised(lambda: number(target), "already has a dimension 'member', .*; use the original scan")
    number(source)
    assert laspy.read(tmp_path / "c.laz")["member"].tolist() == [0, 1, 2]


def test_each_station_is_listed_once(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("scan_id,x,y,z\n1,1.5,2,3\n1,1.5,2,3\n")
    line = int(advised(lambda: read_stations([path]), r"line (\d+): scan_id 1 is repeated; list each station once")[1])
    path.write_text("\n".join(path.read_text().splitlines()[: line - 1]))
    assert read_stations([path]).xyz.tolist() == XYZ[:1]


def outline(path: Path, unit: int = 4, layers: tuple[str, ...] = ("0",)) -> Path:
    """A square of 6 m, about 1000, 2000 mm, on each layer."""
    document = ezdxf.new()
    document.header["$INSUNITS"] = unit
    corners = [(-2000, -1000), (4000, -1000), (4000, 5000), (-2000, 5000)]
    for layer in layers:
        document.modelspace().add_lwpolyline(corners, close=True, dxfattribs={"layer": layer})
    document.saveas(path)
    return path


@pytest.mark.parametrize(
    ("unit", "layers", "wrong", "advice", "right"),
    [
        (0, ("0",), {}, r"say what its lengths are by --unit .*\|(mm)", "unit"),
        (21, ("0",), {}, r"its unit is US survey feet .* by --unit .*\|(mm)", "unit"),
        (4, ("A", "B"), {}, "'A', '(B)'; choose one by --drawing-layer NAME", "layer"),
        (4, ("0",), {"unit": "m"}, "it states mm .*; omit --unit()", None),
    ],
)
def test_a_profile_in_a_drawing(
    unit: int, layers: tuple[str, ...], wrong: dict[str, str], advice: str, right: str | None, tmp_path: Path
) -> None:
    path = outline(tmp_path / "a.dxf", unit, layers)
    found = advised(lambda: read_profile(path, (1000.0, 2000.0), **wrong), advice)  # type: ignore[arg-type]
    options = {right: found[1]} if right else {}
    assert read_profile(path, (1000.0, 2000.0), **options).outline.area == pytest.approx(36.0)  # type: ignore[arg-type]


def test_the_origin_of_a_profile_is_given(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("right,up\n20,20\n26,20\n26,26\n20,26\n20,20\n")
    advised(lambda: read_profile(path), "say where the file has the axis by --origin RIGHT,UP")
    assert read_profile(path, (23.0, 23.0)).outline.area == pytest.approx(36.0)


@pytest.mark.parametrize("width", [6.0, 6.12346, 6.123451, 7.0 / 3.0])
def test_the_least_radius_of_a_profile_is_enough(width: float, tmp_path: Path) -> None:
    """However it is rounded: half a circle over the width."""
    path = tmp_path / "a.csv"
    text = f"right,up,radius\n{-width / 2!r},0,RADIUS\n{width / 2!r},0,0\n"
    path.write_text(text.replace("RADIUS", "0.5"))
    path.write_text(text.replace("RADIUS", advised(lambda: read_profile(path), r"it takes ([\d.]+) or more")[1]))
    assert read_profile(path).outline.length == pytest.approx(np.pi * width / 2.0, rel=0.02)


@pytest.mark.parametrize("name", LIMITS)
def test_limits_of_the_simulation_are_those_of_the_message(name: str) -> None:
    class Asked:
        """Parameters with one value."""

    asked = Asked()
    setattr(asked, name, 1e300)
    found = advised(lambda: require_within(asked, {name: LIMITS[name]}), r"give (\S+) to (\S+)")
    for limit in found.groups():
        setattr(asked, name, float(limit))
        require_within(asked, {name: LIMITS[name]})


@pytest.mark.parametrize(
    ("wrong", "advice", "right"),
    [
        ({"lining": "glass"}, r"use (\w+)", lambda found: {"lining": found[1]}),
        ({"radius": 20.0}, r"give (\d+) m or more", lambda found: {"radius": float(found[1])}),
        ({"density": 1e9}, r"give 0.1 to (\d+)", lambda found: {"density": float(found[1])}),
        ({"new_leaks": 1}, r"add --(epoch) (1)", lambda found: {"new_leaks": 1, found[1]: int(found[2])}),
        ({"mesh": 0.001}, r"or (0.02) m and more", lambda found: {"mesh": float(found[1])}),
        ({"banding": 0.1, "density": 10.0}, "omit --density", lambda _: {"banding": 0.1}),
        ({"niche_leaks": 1, "niches": 0}, "omit --no-niches", lambda _: {"niche_leaks": 1}),
        ({"segment_step": 0.01, "lining": "cast"}, "use lining (s.*)", lambda m: {"segment_step": 0.01, "lining": m[1]}),
        ({"srid": 4326}, "give one that is", lambda _: {"srid": SRID}),
    ],
)  # fmt: skip
def test_parameters_of_the_simulation(
    wrong: dict[str, Any], advice: str, right: Callable[[re.Match[str]], dict[str, Any]]
) -> None:
    found = advised(lambda: Parameters(name="a", **wrong), advice)
    Parameters(name="a", **right(found))
