"""Counts with what they count, in the singular or the plural."""

from __future__ import annotations


def counted(count: int, one: str, many: str = "") -> str:
    """Return a count in groups of three digits, with what it counts; ``many`` is the plural if it is not ``one`` with an s."""
    return f"{grouped(count)} {one if count == 1 else many or f'{one}s'}"


def grouped(count: int) -> str:
    """Return a whole number in groups of three digits."""
    return f"{count:,}".replace(",", " ")
