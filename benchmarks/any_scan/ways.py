"""Ten ways of doing it wrong, each a scene of the matrix, and what each step says of it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

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


@dataclass(frozen=True)
class Step:
    """A command of a way of doing it wrong: the line that names the mistake, or that it refuses with; empty if none does."""

    command: str
    line: str
    refused: bool


def steps_of(name: str, word: str, calls: Sequence[Call]) -> list[Step]:
    """Return the steps of the scene `name`, whose mistake the regular expression `word` names."""
    found = []
    for call in calls:
        command = " ".join(call.words[:2]) if call.words[0] in ("tunnel", "survey") else call.words[0]
        lines = list(_doubts(call) if command == "inspect" else _said(call))
        named = [line for line in lines if re.search(word, line.replace(name, "").lower())]
        refused = call.code == 2 or (command == "inspect" and call.code == 1)
        found.append(Step(command, named[-1] if named else lines[-1] if refused and lines else "", refused))
    return found


def _said(call: Call) -> Iterator[str]:
    """Return lines of messages, without the heads of tables and counts."""
    notes = [line.strip() for line in call.out.splitlines() if line.strip().startswith("note:")]
    said = [line.strip() for line in call.err.splitlines() if line.strip() and not _COUNTS.match(line)]
    yield from (*notes, *said)


def _doubts(call: Call) -> Iterator[str]:
    """Return what ``inspect`` doubts or cannot read."""
    yield from _said(call)
    doubtful = False
    for line in call.out.splitlines():
        if line.endswith(":") and not line.startswith(" "):
            doubtful = line == "Doubtful:"
        elif doubtful:
            yield line.strip()
