"""Numbers in texts: digits 0 to 9, without separators of thousands. Python also reads 272_000 and ２７２."""

from __future__ import annotations


def parse_number(text: str) -> float:
    """Return the number of a text, also ``inf`` and ``nan``.

    Raises
    ------
    ValueError
        If it is none.
    """
    return float(_plain(text))


def parse_whole(text: str) -> int:
    """Return the whole number of a text.

    Raises
    ------
    ValueError
        If it is none.
    """
    return int(_plain(text))


def _plain(text: str) -> str:
    bare = text.strip()
    if "_" in bare or not bare.isascii():
        raise ValueError(f"{text!r} is not a number")
    return bare
