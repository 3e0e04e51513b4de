"""Files that would take forever or all memory, by nesting or by holes: E57, IFC, DXF, LAS. LandXML: tests/alignment."""

from __future__ import annotations

import os
import struct
import time
from pathlib import Path

import ezdxf
import laspy
import numpy as np
import pytest
from support.e57_files import Scan, write

from tunneldb.alignment.dxf import read_dxf
from tunneldb.alignment.ifc import Ifc
from tunneldb.errors import UserError
from tunneldb.pointcloud.formats.e57_xml import require_bounded_xml
from tunneldb.pointcloud.reader import read_header

DATA = Path(__file__).parents[1] / "data"
LAUGHS = '<!ENTITY l0 "lol">' + "".join(f'<!ENTITY l{n} "{f"&l{n - 1};" * 10}">' for n in range(1, 10))
XML = {
    "document type": (f"<!DOCTYPE e57Root [{LAUGHS}]>" + "<e57Root>&l9;</e57Root>", "declares a document type"),
    "external entity": (
        '<!DOCTYPE e57Root [<!ENTITY a SYSTEM "file:///etc/passwd">]><e57Root>&a;</e57Root>',
        "declares a document type",
    ),
    "deep": ("<e57Root>" + '<a type="Structure">' * 100_000, "nested more than 50 deep"),
    "wide": ("<e57Root>" + "".join(f'<a{n} type="Integer"/>' for n in range(100_000)), "more than 1000 children"),
}


def _e57(path: Path, xml: str) -> Path:
    """An E57 file of nothing but XML; its pages have no checksums, which nobody comes to look at."""
    data = xml.encode()
    pages = -(-(48 + len(data)) // 1020)
    head = struct.pack("<8sIIQQQQ", b"ASTM-E57", 1, 0, pages * 1024, 48, len(data), 1024)
    whole = (head + data).ljust(pages * 1020, b"\0")
    path.write_bytes(b"".join(whole[n * 1020 : (n + 1) * 1020] + b"\0" * 4 for n in range(pages)))
    return path


@pytest.mark.parametrize("attack", XML)
def test_the_xml_of_an_e57_is_bounded(tmp_path: Path, attack: str) -> None:
    xml, said = XML[attack]
    path = _e57(tmp_path / "a.e57", xml)
    began = time.process_time()
    with pytest.raises(UserError, match=rf"a\.e57: truncated, corrupt or not an E57 file: .*{said}"):
        read_header(path)
    assert time.process_time() - began < 2


def test_a_right_e57_is_within_bounds(tmp_path: Path) -> None:
    points = {f"cartesian{axis}": np.arange(3.0) for axis in "XYZ"}
    path = write(tmp_path / "a.e57", [Scan(points, translation=(1, 2, 3), guid=f"{{{n}}}") for n in range(40)])
    require_bounded_xml(path)
    assert read_header(path).points == 120


def test_blocks_of_a_drawing_are_not_multiplied(tmp_path: Path) -> None:
    """Ten blocks, each of which holds the one before ten times: 10¹⁰ lines, none of them in the drawing's own space."""
    document = ezdxf.new(units=6)
    document.blocks.new("B0").add_line((0, 0), (1, 1))
    for n in range(1, 11):
        block = document.blocks.new(f"B{n}")
        for _ in range(10):
            block.add_blockref(f"B{n - 1}", (0, 0))
    document.blocks.get("B0").add_blockref("B10", (0, 0))  # and without end
    document.modelspace().add_blockref("B10", (0, 0))
    path = tmp_path / "axis.dxf"
    document.saveas(path)
    began = time.process_time()
    with pytest.raises(UserError, match="its blocks hold more than 10000 entities; write the axis alone to a file"):
        read_dxf(path, None, 1.0)
    document.modelspace().add_polyline3d([(0, 0, 0), (100, 0, 1)])
    document.saveas(path)
    assert len(read_dxf(path, None, 1.0).lines) == 1
    assert time.process_time() - began < 10


@pytest.mark.parametrize(
    ("wrong", "right"),
    [
        ("IFCCARTESIANPOINT((", "IFCCARTESIANPOINT((" + "(" * 200_000),
        ("#21= IFCLOCALPLACEMENT($", "#21= IFCLOCALPLACEMENT(#21"),  # the alignment's
    ],
    ids=["lists in lists", "a placement in itself"],
)
def test_ifc_that_is_nested_without_end(tmp_path: Path, wrong: str, right: str) -> None:
    pytest.importorskip("ifcopenshell")
    lines = (DATA / "indot-twin-branch.ifc").read_text(encoding="latin-1").splitlines()
    number = next(n for n, line in enumerate(lines) if wrong in line)
    lines[number] = lines[number].replace(wrong, right)
    path = tmp_path / "axis.ifc"
    path.write_text("\n".join(lines), encoding="latin-1")
    began = time.process_time()
    with pytest.raises(UserError, match=r"axis\.ifc is damaged: an alignment entity lacks a required attribute: ") as refused:
        Ifc(path).design(0, 0)
    assert "\n" not in str(refused.value)
    assert time.process_time() - began < 10


def test_a_file_of_points_with_a_hole_of_a_terabyte(tmp_path: Path) -> None:
    """The checksum would read all of it."""
    path = tmp_path / "a.las"
    points = laspy.create(point_format=0, file_version="1.2")
    points.x = points.y = points.z = np.arange(100.0)
    points.write(path)
    size = path.stat().st_size
    os.truncate(path, size + 7)  # some bytes behind the points are usual
    assert read_header(path).points == 100
    os.truncate(path, size + (1 << 40) + 7)
    with pytest.raises(UserError, match=r"a\.las: .*its header states 100 points, but it contains 5\d{10}; export it again"):
        read_header(path)
