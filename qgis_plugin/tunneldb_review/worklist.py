"""List of findings to review: order, position and speed; without QGIS and without a database."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Callable, Dict, FrozenSet, Iterable, List, Optional, Tuple

OPEN, CONFIRMED, REJECTED = "open", "confirmed", "rejected"

PAUSE = 300.0
"""Time between two reviews that is a pause, and not counted, s."""


@dataclass(frozen=True)
class Finding:
    """Finding in the list: lengths in m, in the unrolled plane (chainage, arc); area in m².

    ``confidence`` is how sure detection is of the kind that it found; None of what people drew.
    """

    id: int
    km: int
    chainage_from: float
    chainage_to: float
    arc_from: float
    arc_to: float
    kind: str
    kind_detected: Optional[str]
    confidence: Optional[float]
    area: float
    review: str
    counted: bool = True
    other_contrast: Optional[float] = None

    @property
    def probability(self) -> float:
        """Probability that it is a leak, by detection; 1 if a person drew it as wet."""
        if self.confidence is None:
            return 1.0 if self.kind in ("leak", "drip") else 0.0
        return self.confidence if self.kind_detected == "leak" else 1.0 - self.confidence

    @property
    def contrast_elsewhere(self) -> float:
        """Greatest contrast in other images, in standard deviations; -1 if none shows it."""
        return -1.0 if self.other_contrast is None else self.other_contrast


ORDERS: Dict[str, Tuple[str, Callable[[Finding], Tuple[float, ...]]]] = {
    "likely": ("Most probable leak first", lambda f: (-f.probability, f.chainage_from)),
    "unlikely": ("Least probable leak first", lambda f: (f.probability, f.chainage_from)),
    "doubtful": ("Most doubtful first", lambda f: (abs(f.probability - 0.5), f.chainage_from)),
    "large": ("Largest first", lambda f: (-f.area, f.chainage_from)),
    "chainage": ("By chainage", lambda f: (f.chainage_from, f.arc_from)),
    "images": ("Greatest contrast in photos and thermography first", lambda f: (-f.contrast_elsewhere, f.chainage_from)),
}
"""Orders by name: title, and sort key."""


@dataclass(frozen=True)
class Filter:
    """Selection of findings.

    Attributes
    ----------
    kinds : frozenset of str
        Kinds; empty for all.
    km_from, km_to : int, optional
        Kilometres, both counted in.
    min_area : float
        Smaller ones are left out, m².
    open_only : bool
        Whether next and previous pass over what is reviewed.
    """

    kinds: FrozenSet[str] = frozenset()
    km_from: Optional[int] = None
    km_to: Optional[int] = None
    min_area: float = 0.0
    open_only: bool = True

    def takes(self, finding: Finding) -> bool:
        """Return True if a finding is selected, reviewed or not."""
        return (
            (not self.kinds or finding.kind in self.kinds)
            and (self.km_from is None or finding.km >= self.km_from)
            and (self.km_to is None or finding.km <= self.km_to)
            and finding.area >= self.min_area
        )


@dataclass
class WorkList:
    """Findings in order, and the current one.

    What was asked for stays in the list when its kind changes, so that one can step back to it.
    """

    findings: List[Finding] = field(default_factory=list)
    asked: Filter = Filter()
    at: int = -1

    @classmethod
    def of(cls, findings: Iterable[Finding], asked: Filter, order: str) -> WorkList:
        """Return the list of those asked for, before its first."""
        return cls(sorted(filter(asked.takes, findings), key=ORDERS[order][1]), asked)

    @property
    def current(self) -> Optional[Finding]:
        """The finding that is looked at."""
        return self.findings[self.at] if 0 <= self.at < len(self.findings) else None

    def ahead(self, count: int = 1) -> List[Finding]:
        """Return the next ones, without going there."""
        return [self.findings[place] for place in self._places(1)][:count]

    def next(self) -> bool:
        """Go to the next; return False, and stay, if there is none."""
        return self._go(1)

    def previous(self) -> bool:
        """Go to the previous one; return False, and stay, if there is none."""
        return self._go(-1)

    def go(self, finding_id: int) -> bool:
        """Go to a finding by its number, selected or not; return False, and stay, if it is not in the list."""
        place = next((n for n, finding in enumerate(self.findings) if finding.id == finding_id), None)
        if place is not None:
            self.at = place
        return place is not None

    def drop(self, finding_id: int) -> None:
        """Remove a finding that no longer exists, and keep the position; go to the beginning if it was the current one."""
        here = self.current
        self.findings = [finding for finding in self.findings if finding.id != finding_id]
        self.at = next((n for n, finding in enumerate(self.findings) if here is not None and finding.id == here.id), -1)

    def change(self, finding_id: int, **values: str) -> None:
        """Record what was written of a finding."""
        for place, finding in enumerate(self.findings):
            if finding.id == finding_id:
                self.findings[place] = replace(finding, **values)

    @property
    def reviewed(self) -> int:
        """Return the number of reviewed findings in the list."""
        return sum(finding.review != OPEN for finding in self.findings)

    def _go(self, step: int) -> bool:
        place = next(iter(self._places(step)), None)
        if place is not None:
            self.at = place
        return place is not None

    def _places(self, step: int) -> List[int]:
        places = range(self.at + 1, len(self.findings)) if step > 0 else range(self.at - 1, -1, -1)
        return [n for n in places if not self.asked.open_only or self.findings[n].review == OPEN]


@dataclass
class Pace:
    """Speed of review without pauses, per hour."""

    last: Optional[float] = None
    seconds: float = 0.0
    intervals: int = 0
    done: int = 0

    def count(self, now: float) -> None:
        """Count a review, at a time in seconds."""
        if self.last is not None and now - self.last <= PAUSE:
            self.seconds += now - self.last
            self.intervals += 1
        self.last = now
        self.done += 1

    @property
    def per_hour(self) -> Optional[float]:
        """Return reviews per hour; None without two reviews within PAUSE."""
        return 3600.0 * self.intervals / self.seconds if self.intervals and self.seconds > 0 else None


def progress_text(work: WorkList, pace: Pace) -> str:
    """Return how far one is: "12 of 500 reviewed, 240 an hour, 2 h left"."""
    total, done = len(work.findings), work.reviewed
    said = f"{done} of {total} reviewed"
    speed = pace.per_hour
    if speed is not None:
        minutes = 60.0 * (total - done) / speed
        left = f"{minutes:.0f} min" if minutes < 90 else f"{minutes / 60:.1f} h"
        said += f"; {speed:.0f} per hour, {left} left" if total > done else f"; {speed:.0f} per hour"
    return said
