"""Values of records as files state them: rounded, in one cell."""

from __future__ import annotations

import datetime as dt
from typing import Any

DECIMALS = 4
"""Decimals of numbers in files: metres, square metres, degrees, dB or shares."""


def plain(value: Any) -> Any:
    """Return a value as a number or a text: a list as its parts with commas, a date in the way of ISO 8601."""
    if isinstance(value, float):
        return round(value, DECIMALS)
    if isinstance(value, list):
        return ", ".join(map(str, value))
    return value.isoformat() if isinstance(value, dt.datetime) else value
