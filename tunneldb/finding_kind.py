"""Kinds of findings that the program knows, and the colours of findings in all outputs.

Owners add kinds of their own to the table ``tunnel.finding_kind``.
"""

from __future__ import annotations

from enum import StrEnum


class FindingKind(StrEnum):
    """Codes of the kinds that are in ``tunnel.finding_kind`` from the first migration on."""

    LEAK = "leak"
    DRIP = "drip"
    CRACK = "crack"
    SPALL = "spall"
    DELAMINATION = "delamination"
    EFFLORESCENCE = "efflorescence"
    DAMAGED_JOINT = "damaged_joint"
    MISSING_BOLT = "missing_bolt"
    CORRODED = "corroded"
    OBSTRUCTION = "obstruction"
    OTHER = "other"
    JOINT = "joint"
    DARK = "dark"


DETECTED = (FindingKind.LEAK, FindingKind.JOINT, FindingKind.DARK)
"""Kinds that detection distinguishes: a leak, a joint, another dry dark area."""

DRY = (FindingKind.JOINT, FindingKind.DARK)
"""Those of them that are no leaks."""

REVIEW_COLOURS = {"open": "#e67e00", "confirmed": "#005caf", "rejected": "#6e6e6e"}
"""Colour of leaks by their review, in styles, drawings, images and reports."""

SEVERITY_COLOURS = {1: "#3a8f5c", 2: "#c9a100", 3: "#e0660b", 4: "#b8171d"}
"""Colour of findings by their severity."""


def rgb(colour: str) -> tuple[int, int, int]:
    """Return red, green and blue, 0 to 255, of a colour such as ``#e67e00``."""
    red, green, blue = bytes.fromhex(colour.removeprefix("#"))
    return red, green, blue
