"""Numbers and sizes of findings by kind: the totals of report, workbook and ``--json``."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import get_args

from tunneldb.store.findings import COUNTED, Finding, State

ORIGINS = ("detected", "drawn", "redrawn", "split", "merged")
STATES: tuple[State, ...] = get_args(State)
"""Order of output."""

UNCOUNTED: tuple[State, ...] = tuple(state for state in STATES if state not in COUNTED)
"""States that are not included in totals."""

SEVERITIES = (1, 2, 3, 4, 0)
"""Severities from the least; 0 for findings without one."""


@dataclass(frozen=True)
class KindCount:
    """Findings of a kind.

    Attributes
    ----------
    kind, label : str
        Its code, and its name in the owner's words.
    states : dict of str to int
        Number in each state.
    origins : dict of str to int
        Number of included findings by origin.
    severities : dict of int to int
        Number of included findings by severity; 0 for none.
    counted : int
        Number included in totals: open and confirmed.
    area, length : float
        Area and length of included findings within the requested stretch, m² and m.
    """

    kind: str
    label: str
    states: dict[str, int]
    origins: dict[str, int]
    severities: dict[int, int]
    counted: int
    area: float
    length: float


@dataclass
class KindTally:
    """Running count of the findings of a kind."""

    label: str = ""
    states: Counter[str] = field(default_factory=Counter)
    origins: Counter[str] = field(default_factory=Counter)
    severities: Counter[int] = field(default_factory=Counter)
    counted: int = 0
    area: float = 0.0
    length: float = 0.0

    def add(self, finding: Finding) -> None:
        """Count a finding."""
        self.label = self.label or finding.kind_label
        self.states[finding.state] += 1
        if finding.counted:
            self.origins[finding.origin] += 1
            self.severities[finding.severity or 0] += 1
            self.counted += 1
            self.area += finding.share * finding.area
            self.length += finding.share * (finding.length or 0.0)

    def count(self, kind: str) -> KindCount:
        """Return the counts."""
        return KindCount(
            kind,
            self.label,
            {state: self.states[state] for state in STATES},
            {origin: self.origins[origin] for origin in ORIGINS},
            {severity: self.severities[severity] for severity in SEVERITIES},
            self.counted,
            self.area,
            self.length,
        )


def count_findings(findings: Iterable[Finding], order: Sequence[str] = ()) -> list[KindCount]:
    """Count findings by kind, separately for those that count and the others.

    Parameters
    ----------
    findings : iterable of Finding
        Findings of any state.
    order : sequence of str
        Codes of kinds in the order in which they are wanted; others follow by their code.
    """
    kinds: defaultdict[str, KindTally] = defaultdict(KindTally)
    for finding in findings:
        kinds[finding.kind].add(finding)
    return [kinds[kind].count(kind) for kind in in_order(kinds, order)]


def in_order(kinds: Iterable[str], order: Sequence[str]) -> list[str]:
    """Sort codes of kinds in a given order; others follow by their code."""
    place = {kind: n for n, kind in enumerate(order)}
    return sorted(kinds, key=lambda kind: (place.get(kind, len(place)), kind))
