"""Units of length in alignment files."""

from __future__ import annotations

UNITS = {
    "millimeter": 0.001, "centimeter": 0.01, "meter": 1.0, "kilometer": 1000.0,
    "inch": 0.0254, "foot": 0.3048, "USSurveyFoot": 1200.0 / 3937.0, "mile": 1609.344,
}  # fmt: skip
"""Metres per linear unit of LandXML, by its name there."""

_SPELLINGS = {
    **{name.casefold(): name for name in UNITS},
    **{name.replace("meter", "metre"): name for name in UNITS if "meter" in name},
    "feet": "foot",
}


def unit_of(text: str) -> str | None:
    """Return the name of a unit in `UNITS`, however spelled; None for another unit."""
    return _SPELLINGS.get(text.strip().casefold())
