"""Kinds of findings that the program knows; owners add their own to the table ``tunnel.finding_kind``."""

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
