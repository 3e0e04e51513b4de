"""The XML section of an E57 file, looked at before libE57Format takes it: that has no limits of its own.

It takes a time that grows with the square of how deep elements are nested, and of how many children a Structure has.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path
from xml.parsers import expat

_HEADER = struct.Struct("<8sIIQQQQ")  # ASTM E2807, 6.4: signature, versions, length, XML's offset and length, page size
_CHECKSUM = 4  # bytes at the end of each page
_SMALLEST, _LARGEST = 64, 1 << 20  # bytes of a page; files have 1024
_BLOCK = 1024  # pages

DEEPEST = 50
"""Levels of elements: the standard's own structures have nine."""

MOST_CHILDREN = 1000
"""Children of an element that is no Vector: the standard's own structures have some thirty, and extensions add to them."""


def require_bounded_xml(path: Path) -> None:
    """Refuse an XML section with a document type, or one nested too deep or too wide; what else is wrong libE57Format says.

    Raises
    ------
    ValueError
        Which says what it has.
    """
    parser = expat.ParserCreate()
    children: list[int] = []

    def begin(name: str, attributes: dict[str, str]) -> None:
        if children:
            children[-1] += 1
            if children[-1] > MOST_CHILDREN:
                raise ValueError(f"an element of its XML has more than {MOST_CHILDREN} children")
        children.append(-(1 << 62) if attributes.get("type") == "Vector" else 0)  # of which there may be any number
        if len(children) > DEEPEST:
            raise ValueError(f"its XML is nested more than {DEEPEST} deep")

    def refuse(*declared: object) -> None:
        raise ValueError("its XML declares a document type, and E57 has none")

    parser.StartElementHandler = begin
    parser.EndElementHandler = lambda name: children.pop()
    parser.StartDoctypeDeclHandler = refuse
    try:
        for block in _section(path):
            parser.Parse(block, False)
    except expat.ExpatError:
        return


def _section(path: Path) -> Iterator[bytes]:
    """Blocks of the XML section, without the checksums of pages; nothing if the header is none."""
    with path.open("rb") as file:
        head = file.read(_HEADER.size)
        if len(head) < _HEADER.size:
            return
        _, _, _, _, offset, length, page = _HEADER.unpack(head)
        if not _SMALLEST <= page <= _LARGEST or offset >= path.stat().st_size:
            return
        within = offset % page
        file.seek(offset - within)
        while length > 0 and (block := file.read(_BLOCK * page)):
            pages = (block[at : at + page - _CHECKSUM] for at in range(0, len(block), page))
            data = b"".join(pages)[within : within + length]
            within = 0
            length -= len(data)
            yield data
