"""Check of the XML section of an E57 file before libE57Format reads it, since that has no limits of its own.

Its time grows with the square of the nesting depth of elements, and of the number of children of a Structure.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path
from xml.parsers import expat

_HEADER = struct.Struct("<8sIIQQQQ")  # ASTM E2807, 6.4: signature, versions, length, XML's offset and length, page size
_CHECKSUM = 4  # bytes at the end of each page
_MIN_PAGE, _MAX_PAGE = 64, 1 << 20  # bytes of a page; usually 1024
_BLOCK = 1024  # pages

MAX_DEPTH = 50
"""Greatest nesting depth of elements; the standard's own structures have nine levels."""

MAX_CHILDREN = 1000
"""Greatest number of children of an element other than a Vector; the standard's structures have about thirty."""


def require_bounded_xml(path: Path) -> None:
    """Refuse an XML section with a document type, or with too deep or too wide nesting; libE57Format reports other faults.

    Raises
    ------
    ValueError
        Names the fault.
    """
    parser = expat.ParserCreate()
    children: list[int] = []

    def begin(name: str, attributes: dict[str, str]) -> None:
        if children:
            children[-1] += 1
            if children[-1] > MAX_CHILDREN:
                raise ValueError(f"an element of its XML has more than {MAX_CHILDREN} children")
        children.append(-(1 << 62) if attributes.get("type") == "Vector" else 0)  # which may have any number
        if len(children) > MAX_DEPTH:
            raise ValueError(f"its XML is nested more than {MAX_DEPTH} deep")

    def refuse(*declared: object) -> None:
        raise ValueError("its XML declares a document type, which E57 does not allow")

    parser.StartElementHandler = begin
    parser.EndElementHandler = lambda name: children.pop()
    parser.StartDoctypeDeclHandler = refuse
    try:
        for block in xml_section(path):
            parser.Parse(block, False)
    except expat.ExpatError:
        return


def xml_section(path: Path) -> Iterator[bytes]:
    """Yield blocks of the XML section, without page checksums; nothing if the header is invalid."""
    with path.open("rb") as file:
        head = file.read(_HEADER.size)
        if len(head) < _HEADER.size:
            return
        _, _, _, _, offset, length, page = _HEADER.unpack(head)
        if not _MIN_PAGE <= page <= _MAX_PAGE or offset >= path.stat().st_size:
            return
        within = offset % page
        file.seek(offset - within)
        while length > 0 and (block := file.read(_BLOCK * page)):
            pages = (block[at : at + page - _CHECKSUM] for at in range(0, len(block), page))
            data = b"".join(pages)[within : within + length]
            within = 0
            length -= len(data)
            yield data
