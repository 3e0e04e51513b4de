"""Numbers in texts: digits 0 to 9, no separators of thousands (Python reads 272_000 and ２７２, too); shares in per cent."""

from __future__ import annotations

MAX_MEASUREMENT = 1e12
"""Greatest measured value that is accepted; seconds since 1970 and coordinates are smaller."""


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


def percent_number(share: float, decimals: int = 1) -> str:
    """Return a share in per cent, without the sign; 100 only for all, 0 only for nothing."""
    least = 10**-decimals
    value = 100.0 * share
    if 0.0 < value < least:
        return f"< {least:.{decimals}f}"
    if 100.0 - least / 2.0 <= value < 100.0:
        return f"> {100.0 - least:.{decimals}f}"
    return f"{value:.{decimals}f}"


def is_plain(text: str) -> bool:
    """Return True if a text has no character that only Python reads as a part of a number."""
    return text.strip().isascii() and "_" not in text


def _require_plain(text: str) -> str:
    if not is_plain(text):
        raise ValueError(f"{text!r} is not a number")
    return text
