"""Sentence that ``run`` prints for a finished stage, from its counts; ``--json`` and the ledger have all counts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from tunneldb.counted import counted, grouped
from tunneldb.numerals import percent_number

Counts = Mapping[str, Any]


def stage_sentence(stage: str, counts: Counts) -> str:
    """Return what a stage has come to, with units; its note is not in it.

    Parameters
    ----------
    stage : str
        Name of the stage.
    counts : mapping
        What the stage has counted.
    """
    if stage in _SENTENCES:
        return _SENTENCES[stage](counts)
    return ", ".join(f"{name} {value:.4g}" if isinstance(value, float) else f"{name} {value}" for name, value in counts.items())


def _axis(counts: Counts) -> str:
    of = {"measured": "measured", "interpolated": "interpolated between its neighbours", "edited": "moved by hand"}
    vertices = [f"{grouped(counts[source])} {said}" for source, said in of.items() if counts.get(source)]
    last = counted(counts["iterations"], "pass", "passes")
    return f"vertices: {', '.join(vertices)}; moved by at most {1000 * counts['moved']:.2g} mm in the last of {last}"


def _segments(counts: Counts) -> str:
    return f"{counted(counts['segments'], 'segment')} with {counted(counts['points'], 'point')}"


def _sections(counts: Counts) -> str:
    radii = {state: counts.get(f"classes_{state}", 0) for state in ("measured", "interpolated", "rejected")}
    whole = sum(radii.values())
    said = counted(counts["sections"], "cross-section")
    if whole:
        said += f", {100 * radii['measured'] / whole:.0f} % of their radii measured"
    return f"{said}; no roof over {counts['open']:g} m" if counts.get("open") else said


def _ground(counts: Counts) -> str:
    points = sum(counts[name] for name in _CLASSES)
    lining = 100 * counts["lining"] / points if points else 0.0
    return (
        f"the ground over {counts['metres']} m, {counted(counts['clusters'], 'object')} in the tunnel or on its lining;"
        f" {lining:.0f} % of {counted(points, 'point')} are lining"
    )


_CLASSES = ("unassigned", "ground", "lining", "niche", "appendage", "rail", "object", "sphere", "noise")


def _detect(counts: Counts) -> str:
    if "seen" not in counts:
        return f"offset image of {counted(counts['pixels'], 'pixel')}"
    said = f"{counted(counts['leaks'], 'leak')}, {percent_number(counts['seen'])} % of the lining inspected"
    dry = [counted(counts["joints"], "joint"), counted(counts["dark"], "other area")]
    said += f"; dry dark areas: {' and '.join(dry)}"
    changes = {
        "leaks_over_ends": "across the kilometre boundary",
        "leaks_gone": "not found again",
        "leaks_kept_for_review": "kept because they were reviewed",
    }
    return "; ".join([said, *(f"{grouped(counts[name])} {words}" for name, words in changes.items() if counts.get(name))])


_SENTENCES: dict[str, Callable[[Counts], str]] = {
    "axis": _axis,
    "segments": _segments,
    "sections": _sections,
    "ground": _ground,
    "detect": _detect,
}
