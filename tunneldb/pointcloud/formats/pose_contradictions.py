"""Contradictions between the positions that a scan file's header states."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tunneldb.arrays import Float
from tunneldb.pointcloud.formats.scans import PosedScan

SAME_PLACE = 0.01
"""Maximum distance of two statements of one position, m; headers are written with few digits."""

_MAX_NAMED = 3


def lost_positions(scans: Sequence[PosedScan]) -> str:
    """Return why the positions of scans cannot be used: all are one place, but the header states others; empty if they can."""
    places = _places(scans)
    others = [scan for scan in scans if scan.stated is not None and _differ(scan)]
    if len(others) < 1 or len(places) != len(scans) or not _one_place(places):
        return ""
    if len(scans) > 1 and _one_place(np.array([scan.stated for scan in others])):
        return ""
    if np.abs(places).max() > SAME_PLACE:
        return ""
    named = ", ".join(f"{scan.number} {_text(scan.stated)}" for scan in others[:_MAX_NAMED])
    more = f" and {len(others) - _MAX_NAMED} more" if len(others) > _MAX_NAMED else ""
    count = "the scan" if len(scans) == 1 else f"all {len(scans)} scans"
    return (
        f"position and matrix of the header contradict each other: by its matrix {count} stood at 0,0,0, by line 3 elsewhere;"
        f" if the points are in the project's frame, give the positions of line 3 as scan_id,x,y,z: {named}{more}"
    )


def position_notes(scans: Sequence[PosedScan]) -> list[str]:
    """Return notes on positions of scans for which the header has two; none if they are lost."""
    if lost_positions(scans):
        return []
    notes = []
    others = [scan for scan in scans if scan.stated is not None and _differ(scan)]
    if others:
        first = others[0]
        notes.append(
            f"{len(others)} of {len(scans)} scans have another position in line 3 of their header than in their matrix: "
            f"{first.name} states {_text(first.stated)}, its matrix {_text(first.position)}; the matrix is used"
        )
    return notes


def _places(scans: Sequence[PosedScan]) -> Float:
    return np.array([scan.position for scan in scans if scan.position is not None], np.float64).reshape(-1, 3)


def _differ(scan: PosedScan) -> bool:
    if scan.position is None or scan.stated is None:
        return False
    return float(np.linalg.norm(scan.position - scan.stated)) > SAME_PLACE


def _one_place(places: Float) -> bool:
    return float(np.ptp(places, axis=0).max()) < SAME_PLACE


def _text(place: Float | None) -> str:
    return "nowhere" if place is None else ",".join(f"{value:.10g}" for value in place)
