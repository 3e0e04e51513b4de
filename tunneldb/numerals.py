"""Numbers in texts: digits 0 to 9, without separators of thousands. Python also reads 272_000 and ２７２."""

from __future__ import annotations


def parse_number(text: str) -> float:
    """Return the number of a text, also ``inf`` and ``nan``.

    Raises
    ------
    ValueError
        If it is none.
    """
    return float(_require_plain(text))


def parse_whole(text: str) -> int:
    """Return the whole number of a text.

    Raises
    ------
    ValueError
        If it is none.
    """
    return int(_require_plain(text))


def is_plain(text: str) -> bool:
    """Return True if a text has no character that only Python reads as a part of a number."""
    return text.strip().isascii() and "_" not in text


def _require_plain(text: str) -> str:
    if not is_plain(text):
        raise ValueError(f"{text!r} is not a number")
    return text
