"""Numbers of points that the scans of an E57 file state, compared with the size of their data.

Source: ASTM E2807-11, 8.3.5 (CompressedVector) and 9.3 (binary sections: header of 32 bytes, data packets, index packets).
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.parsers import expat

from tunneldb.pointcloud.formats.e57_xml import xml_section

_SECTION = struct.Struct("<B7xQ")  # identifier, logical length
_MAX_RATIO, _MAX_REST = 1.25, 65536  # of a section to its points' bits, and bytes: packets have heads, and an index


def surplus_notes(path: Path, libe57: Any, image: Any) -> list[str]:
    """Return notes on scans of an open file whose data hold more points than their number says: only so many are read."""
    nodes, notes = image.root()["data3D"], []
    with path.open("rb") as file:
        for index, (place, count) in zip(range(len(nodes)), _sections(path), strict=False):
            bits = _point_bits(libe57, libe57.StructureNode(nodes[index]["points"].prototype()))
            file.seek(place)
            head = file.read(_SECTION.size)
            if bits is None or len(head) < _SECTION.size:
                continue
            _, length = _SECTION.unpack(head)
            if length > _MAX_RATIO * count * bits / 8.0 + _MAX_REST:
                notes.append(
                    f"scan {scan_name(nodes[index], index)!r} states {count} points, which are read, but its data are of about"
                    f" {int(8.0 * length / bits)}; export it again"
                )
    return notes


def scan_name(node: Any, index: int) -> str:
    """Return the name of a scan, or its number in the file, from 1."""
    return str(node["name"].value()) if node.isDefined("name") else f"{index + 1}"


def _point_bits(libe57: Any, prototype: Any) -> int | None:
    """Return the number of bits of a point from its prototype; None if it varies."""
    total = 0
    for index in range(prototype.childCount()):
        node = prototype.get(index)
        if node.type() == libe57.E57_FLOAT:
            total += 32 if libe57.FloatNode(node).precision() == libe57.E57_SINGLE else 64
        elif node.type() in (libe57.E57_INTEGER, libe57.E57_SCALED_INTEGER):
            kind = libe57.IntegerNode if node.type() == libe57.E57_INTEGER else libe57.ScaledIntegerNode
            total += (int(kind(node).maximum()) - int(kind(node).minimum())).bit_length()
        else:
            return None
    return total or None


def _sections(path: Path) -> Iterator[tuple[int, int]]:
    """Return place in the file and number of points of the section of each scan, from the XML."""
    found: list[tuple[int, int]] = []

    def begin(name: str, attributes: dict[str, str]) -> None:
        if name == "points" and attributes.get("type") == "CompressedVector":
            found.append((max(int(attributes.get("fileOffset", 0)), 0), int(attributes.get("recordCount", 0))))

    parser = expat.ParserCreate()
    parser.StartElementHandler = begin
    for block in xml_section(path):
        parser.Parse(block, False)
    return iter(found)
