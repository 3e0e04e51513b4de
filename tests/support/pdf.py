"""Text of PDFs that QGIS prints."""

from __future__ import annotations

import re
import unicodedata
from pathlib import Path

import pypdf
from pypdf.generic import ContentStream, NameObject

DRAWN = re.compile(rb"^(?!.*Q).*(?: (?:m|l|c|v|y|re|d|SCN|scn|gs|cs|CS)|\b[hn]|W\*?(?: n)?)[ \r]*$\n?", re.MULTILINE)
"""Lines of a page that only draw, without q and Q. They are most lines, and pypdf would parse each of their numbers."""

EMPTY = re.compile(rb"^q\n(?:[-+.\d ]+ cm\n)*Q\n", re.MULTILINE)
"""A state that is saved and restored, with nothing drawn between."""


def words(path: Path) -> list[str]:
    """Return the text of each page."""
    return [_text(page) for page in pypdf.PdfReader(path).pages]


def _text(page: pypdf.PageObject) -> str:
    contents = ContentStream(page["/Contents"].get_object(), page.pdf, "bytes")
    lines = DRAWN.sub(b"", re.sub(rb"\b([qQ]) (?=[qQ]\b)", rb"\1\n", contents.get_data()))
    found = 1
    while found:
        lines, found = EMPTY.subn(b"", lines)
    contents.set_data(lines)
    page[NameObject("/Contents")] = contents
    return " ".join(unicodedata.normalize("NFKC", page.extract_text()).split())
