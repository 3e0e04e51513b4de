"""Numbers and sizes of findings by kind: the totals of report, workbook and ``--json``."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Container, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, get_args

from tunneldb.finding_kind import DRY
from tunneldb.store.findings import COUNTED, Finding, State

ORIGINS = ("detected", "drawn", "redrawn", "split", "merged")
STATES: tuple[State, ...] = get_args(State)
"""Order of output."""

UNCOUNTED: tuple[State, ...] = tuple(state for state in STATES if state not in COUNTED)
"""States that are not included in totals."""

LEAKS, OTHERS, DARK = "All leaks", "All other findings", "All joints and dry dark areas"
"""Groups of kinds whose numbers are added up."""

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

    @property
    def uncounted(self) -> int:
        """Number not included in totals."""
        return sum(self.states[state] for state in UNCOUNTED)


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


def group_of(kind: str, wet: Container[str]) -> str:
    """Return the group of a kind: wet kinds, other kinds, and joints and dry dark areas, which are no defects."""
    return LEAKS if kind in wet else DARK if kind in DRY else OTHERS


def sum_groups(counts: Sequence[KindCount], wet: Container[str]) -> list[tuple[KindCount, list[KindCount]]]:
    """Return the sum of each group of kinds that occurs, with the counts of its kinds: no sum adds dry lining to leaks.

    Parameters
    ----------
    counts : sequence of KindCount
        Counts by kind.
    wet : container of str
        Codes of the kinds that count as wet.
    """
    groups = {label: [count for count in counts if group_of(count.kind, wet) == label] for label in (LEAKS, OTHERS, DARK)}
    return [(_sum(label, members), members) for label, members in groups.items() if members]


def _sum(label: str, counts: Sequence[KindCount]) -> KindCount:
    """Return the sum over several kinds, whose code is empty."""

    def total(name: str) -> dict[Any, int]:
        return {key: sum(getattr(count, name)[key] for count in counts) for key in getattr(counts[0], name)}

    return KindCount(
        "", label, total("states"), total("origins"), total("severities"), sum(count.counted for count in counts),
        sum(count.area for count in counts), sum(count.length for count in counts),
    )  # fmt: skip


def in_order(kinds: Iterable[str], order: Sequence[str]) -> list[str]:
    """Sort codes of kinds in a given order; others follow by their code."""
    place = {kind: n for n, kind in enumerate(order)}
    return sorted(kinds, key=lambda kind: (place.get(kind, len(place)), kind))
