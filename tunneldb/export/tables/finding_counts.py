"""How many findings there are of each kind, and how large they are: the sums of report, workbook and ``--json``."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, get_args

import psycopg

from tunneldb.export.tables.findings import COUNTED, Finding, State

ORIGINS = ("detected", "drawn", "redrawn", "split", "merged")
STATES: tuple[State, ...] = get_args(State)
"""In the order in which they are told."""

UNCOUNTED: tuple[State, ...] = tuple(state for state in STATES if state not in COUNTED)
"""States of what no sum counts."""

SEVERITIES = (1, 2, 3, 4, 0)
"""From the least; 0 for those that have none."""


@dataclass(frozen=True)
class KindCount:
    """What there is of a kind.

    Attributes
    ----------
    kind, label : str
        Its code, and its name in the owner's words.
    states : dict of str to int
        How many are in each state.
    origins : dict of str to int
        Of those that count, how many came about how.
    severities : dict of int to int
        Of those that count, how many have which severity; 0 for none.
    counted : int
        How many sums count: open and confirmed.
    area, length : float
        Of those that count, as far as they lie in the stretch asked for, m² and m.
    """

    kind: str
    label: str
    states: dict[str, int]
    origins: dict[str, int]
    severities: dict[int, int]
    counted: int
    area: float
    length: float


def count_findings(findings: Sequence[Finding], order: Sequence[str] = ()) -> list[KindCount]:
    """Count findings by kind, those that count and the others apart.

    Parameters
    ----------
    findings : sequence of Finding
        As they were read, of whatever states.
    order : sequence of str
        Codes of kinds in the order in which they are wanted; others follow by their code.
    """
    kinds: defaultdict[str, list[Finding]] = defaultdict(list)
    for finding in findings:
        kinds[finding.kind].append(finding)
    place = {kind: n for n, kind in enumerate(order)}
    return [_count(kinds[kind]) for kind in sorted(kinds, key=lambda kind: (place.get(kind, len(place)), kind))]


def _count(findings: Sequence[Finding]) -> KindCount:
    counted = [finding for finding in findings if finding.counted]
    states = Counter[str](finding.state for finding in findings)
    origins = Counter(finding.origin for finding in counted)
    severities = Counter(finding.severity or 0 for finding in counted)
    return KindCount(
        findings[0].kind,
        findings[0].kind_label,
        {state: states[state] for state in STATES},
        {origin: origins[origin] for origin in ORIGINS},
        {severity: severities[severity] for severity in SEVERITIES},
        len(counted),
        sum(finding.share * finding.area for finding in counted),
        sum(finding.share * (finding.length or 0.0) for finding in counted),
    )


def read_kinds(conn: psycopg.Connection[Any]) -> list[str]:
    """Read the codes of all kinds, in the order of the catalogue."""
    return [code for (code,) in conn.execute("SELECT code FROM tunnel_api.finding_kind ORDER BY position, code")]


def read_wet_kinds(conn: psycopg.Connection[Any]) -> frozenset[str]:
    """Read the codes of the kinds that count as wet: the leaks of statistics and classes."""
    return frozenset(code for (code,) in conn.execute("SELECT code FROM tunnel_api.finding_kind WHERE wet"))


def read_severities(conn: psycopg.Connection[Any]) -> dict[int, str]:
    """Read the owner's words for the degrees of severity."""
    return dict(conn.execute("SELECT id, label FROM tunnel_api.severity ORDER BY id").fetchall())
