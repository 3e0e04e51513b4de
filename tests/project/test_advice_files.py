"""Messages about files: each test reads a faulty file, does what the message says, and reads the file again."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest
import shapely
from support.advice import advised
from support.axis_files import J_LANDXML, LINE, SRID, chain, dxf, gis, pieces

from tunneldb import csvfile
from tunneldb.alignment.given import read_given
from tunneldb.pipeline.profile_file import read_profile
from tunneldb.pointcloud.reader import read_chunks
from tunneldb.pointcloud.sonar import read_sonar
from tunneldb.pointcloud.stations import read_stations
from tunneldb.store.scanner import _stations_together

POSE = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
IFC = J_LANDXML.with_name("aplitop-3.ifc")
PTX = f"2\n1\n{POSE}{{}} 0 0 0\n0 {{}} 0 0\n0 0 {{}} 0\n0 0 0 1\n1 0 0 0.5\n2 0 0 0.5\n"
PLY = "ply\nformat ascii 1.0\n{}element vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n{}1 2 3\n"
FACE = "element face 1\nproperty list uchar int vertex_indices\n"


def points(path: Path) -> int:
    return sum(len(chunk) for chunk in read_chunks(path, None))


def stations(path: Path) -> Any:
    return read_stations([path])


def xyz(path: Path) -> Any:
    return csvfile.read_csv(path, ("x", "y", "z"))


def column(path: Path) -> str | None:
    return csvfile.find_column(path, csvfile.read_header(path), "x")


TEXTS: list[tuple[str, Callable[[Path], Any], str, str, Callable[[re.Match[str]], str]]] = [
    ("a.csv", csvfile.read_header, "", r"for example (x,y,z)$", lambda found: f"{found[1]}\n"),
    ("a.csv", xyz, "", r"write the header (\S+)$", lambda found: f"{found[1]}\n1,2,3\n"),
    ("a.csv", column, "easting,ost\n1,2\n", r"easting and ost may both be x; rename one of them to (x)$",
     lambda found: f"easting,{found[1]}\n1,2\n"),
    ("a.ptx", points, PTX.format(3, 3, 3), "export it with its pose, in metres", lambda _: PTX.format(1, 1, 1)),
    ("a.ply", points, PLY.format(FACE, "3 0 0 0\n"), "export only the points", lambda _: PLY.format("", "")),
    ("a.xyz", read_sonar, "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n", "type git lfs pull",
     lambda _: "1 2 3\n4 5 6\n"),
    ("a.xyz", read_sonar, "nan 0 0\n1 2 3\n", "have invalid coordinates; export it again", lambda _: "0 1 0\n1 2 3\n"),
    ("a.csv", stations, "scan_id,x,y,z\n1,0,0,0\n1,5,0,0\n", "scan_id (1) is repeated; list each station once",
     lambda found: f"scan_id,x,y,z\n{found[1]},0,0,0\n"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "read", "wrong", "advice", "right"), TEXTS, ids=[f"{t[0]} {t[3]}" for t in TEXTS])
def test_a_text(
    name: str, read: Callable[[Path], Any], wrong: str, advice: str, right: Callable[[re.Match[str]], str], tmp_path: Path
) -> None:
    path = tmp_path / name
    path.write_text(wrong)
    path.write_text(right(advised(lambda: read(path), advice)))
    read(path)


DOTS = [shapely.MultiPoint(LINE)]
ARC = 1e8
"""Radius of an arc that is drawn in millimetres, without a unit."""


def two(path: Path) -> Path:
    return gis(gis(path, pieces(), layer="road"), pieces(), layer="rail", append=True)


def arc(path: Path) -> Path:
    def draw(space: Any) -> None:
        space.add_arc((0.0, 0.0), ARC, 0.0, 2.0)

    return dxf(path, draw, 0)


def bytes_of(path: Path, content: bytes) -> Path:
    path.write_bytes(content)
    return path


def table(folder: Path) -> Path:
    return bytes_of(folder / "b.csv", csvfile.write_csv(("x", "y", "z"), LINE.tolist()).encode())


def landxml(path: Path, count: int) -> Path:
    """Write the design with so many alignments of different names."""
    head, rest = J_LANDXML.read_text().split("    <Alignment ", 1)
    end = rest.index("</Alignment>") + len("</Alignment>")
    one = f"    <Alignment {rest[:end]}\n"
    name = re.search(r'name="([^"]*)"', one)
    assert name
    text = "".join(one.replace(name[0], f'name="A{k}"', 1) for k in range(count))
    path.write_text(head + text + rest[end:])
    return path


Options = Callable[[re.Match[str]], dict[str, Any]]
AXES: list[tuple[Callable[[Path], Path], dict[str, Any], str, Callable[[Path], Path], Options]] = [
    (lambda f: gis(f / "a.gpkg", DOTS), {}, "draw the axis as a line", lambda f: gis(f / "b.gpkg", pieces()), lambda _: {}),
    (lambda f: two(f / "a.gpkg"), {}, r"layers of lines: '(\w+)', .* choose one by --axis-(layer) NAME",
     lambda f: f / "a.gpkg", lambda found: {found[2]: found[1]}),
    (lambda f: gis(f / "a.gpkg", pieces()), {"unit": "foot"}, "--axis-unit does not apply; omit it", lambda f: f / "a.gpkg",
     lambda _: {}),
    (lambda f: dxf(f / "a.dxf", chain), {"profile": "P"}, "--profile does not apply; omit it", lambda f: f / "a.dxf",
     lambda _: {}),
    (lambda f: arc(f / "a.dxf"), {}, "or pass the unit by --axis-(unit)", lambda f: f / "a.dxf",
     lambda found: {found[1]: "millimeter"}),
    (lambda f: bytes_of(f / "a.dwg", b"AC1032" + bytes(2000)), {}, "is a DWG drawing; save it as DXF",
     lambda f: dxf(f / "a.dxf", chain), lambda _: {}),
    (lambda f: bytes_of(f / "a.pdf", b"%PDF-1.7" + bytes(2000)), {}, "or its table as CSV", table, lambda _: {}),
    (lambda f: bytes_of(f / "a.xlsx", b"PK\x03\x04" + bytes(2000)), {}, "or save the table as CSV", table, lambda _: {}),
    (lambda f: bytes_of(f / "a.ifc", IFC.read_bytes()[:-200]), {}, "is truncated: .*; copy or export it again", lambda _: IFC,
     lambda _: {}),
    (lambda f: landxml(f / "a.xml", 0), {}, "holds no alignment; export the design alignment, with plan and profile",
     lambda f: landxml(f / "a.xml", 1), lambda _: {}),
    (lambda f: landxml(f / "a.xml", 2), {}, r"alignments: '(\w+)', .* choose one by --(alignment) NAME", lambda f: f / "a.xml",
     lambda found: {found[2]: found[1]}),
]  # fmt: skip


@pytest.mark.parametrize(("write", "options", "advice", "mended", "more"), AXES, ids=[row[2][:50] for row in AXES])
def test_an_axis(
    write: Callable[[Path], Path],
    options: dict[str, Any],
    advice: str,
    mended: Callable[[Path], Path],
    more: Callable[[re.Match[str]], dict[str, Any]],
    tmp_path: Path,
) -> None:
    path = write(tmp_path)
    found = advised(lambda: read_given(path, srid=SRID, **options), advice)
    assert np.isfinite(read_given(mended(tmp_path), srid=SRID, **more(found)).xyz[:, :2]).all()


def test_the_unit_of_a_drawn_profile_is_its_own(tmp_path: Path) -> None:
    square = [(-3, -3), (3, -3), (3, 3), (-3, 3)]
    path = dxf(tmp_path / "a.dxf", lambda space: space.add_lwpolyline(square, close=True), ezdxf.units.M)
    advised(lambda: read_profile(path, unit="ft"), "--unit says ft; omit --unit")
    assert read_profile(path).outline.area == pytest.approx(36.0)


def test_stations_of_scans_without_poses_are_a_table(tmp_path: Path) -> None:
    scan, table = tmp_path / "a.ptx", tmp_path / "stations.csv"
    scan.write_text(PTX.format(1, 1, 1) * 2)
    advice = r"CSV file with (scan_id,x,y,z): --stations FILE, scan_id (\d+), (\d+)$"
    found = advised(lambda: _stations_together([scan], read_stations([scan])), advice)
    table.write_text(f"{found[1]}\n{found[2]},0,0,1\n{found[3]},9,0,1\n")
    assert _stations_together([table], read_stations([table])) == ()
