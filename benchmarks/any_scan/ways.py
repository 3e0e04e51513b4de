"""Ten ways of doing it wrong, each a scene of the matrix, and the step at which the user first learns of it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from benchmarks.any_scan.program import Call

WAYS = {
    "wrong time base (UTC for GPS)": "utc",
    "wrong zone": "other-crs",
    "feet": "feet",
    "swapped axes": "scan-swapped",
    "mirrored stations": "mirrored",
    "millimetres": "scan-thousandfold",
    "clipped export": "clipped-las",
    "merged scans": "numbered-anew",
    "wrong intensity field, reflectance for amplitude": "reflectance-as-amplitude",
    "wrong intensity field, 8-bit grey values": "eight-bits",
    "axis of another tunnel": "axis-other",
}
"""Scene of each."""

_COUNTS = re.compile(r"file +points|.*┃|\S+: [\d ]+ (stations|poses) of |.* m of axis, chainage |chainage grows over ")


def first_word(name: str, word: str, calls: Sequence[Call]) -> tuple[str, str]:
    """Return command and line that first name the matter `word` (regular expression) of the scene `name`; else empty."""
    for call in calls:
        verb = " ".join(call.words[:2]) if call.words[0] in ("tunnel", "survey") else call.words[0]
        lines = list(_doubts(call) if verb == "inspect" else _said(call))
        named = [line for line in lines if re.search(word, line.replace(name, "").lower())]
        if named or call.code == 2:
            return verb, (named or lines)[-1]
    return "", ""


def _said(call: Call) -> Iterator[str]:
    """Return lines of messages, without the heads of tables and counts."""
    return (line.strip() for line in call.err.splitlines() if line.strip() and not _COUNTS.match(line))


def _doubts(call: Call) -> Iterator[str]:
    """Return what ``inspect`` doubts or cannot read."""
    yield from _said(call)
    doubtful = False
    for line in call.out.splitlines():
        if line.endswith(":") and not line.startswith(" "):
            doubtful = line == "Doubtful:"
        elif doubtful:
            yield line.strip()
