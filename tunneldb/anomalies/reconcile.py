"""Compare the findings of an earlier run with what detection finds now: which to insert, update, keep or delete."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import chain

from shapely.geometry import Polygon

from tunneldb.anomalies.matching import match, match_parts
from tunneldb.anomalies.records import Anomaly, BoundaryRegion, EarlierFinding
from tunneldb.anomalies.regions import Region, merge_regions, touching_groups
from tunneldb.finding_kind import FindingKind
from tunneldb.geometry.stationing import KILOMETRE


@dataclass(frozen=True)
class Cluster:
    """Boundary regions that touch each other, of one kilometre or several, and their union.

    Attributes
    ----------
    parts : sequence of BoundaryRegion
        In order of chainage.
    region : Region
        All of them as one region.
    """

    parts: Sequence[BoundaryRegion]
    region: Region

    @property
    def crosses(self) -> bool:
        """True if its parts lie in more than one kilometre."""
        return len({part.km for part in self.parts}) > 1


@dataclass(frozen=True)
class Boundary:
    """Clusters at the ends of a kilometre.

    Attributes
    ----------
    km : int
        The kilometre.
    clusters : sequence of Cluster
        Those with a part in the kilometre or at its ends, in order of chainage.
    findings : set of int
        Keys of the findings that the parts belonged to, those of the parts that were replaced included.
    first, last : int
        Kilometres over which the clusters reach.
    other_pixels : list of int
        Neighbours whose boundary parts have another pixel size: nothing can be merged with them.
    """

    km: int
    clusters: Sequence[Cluster]
    findings: set[int]
    first: int
    last: int
    other_pixels: list[int]

    @property
    def pixel(self) -> float:
        """Largest edge of a pixel of the clusters, m; 0 if there are none."""
        return max((cluster.region.pixel for cluster in self.clusters), default=0.0)


@dataclass(frozen=True)
class Reconciliation:
    """Actions on the findings of a kilometre.

    Candidates are numbered: first the anomalies of the boundary's clusters, in their order, then those found within the
    kilometre.

    Attributes
    ----------
    insert : list of int
        Candidates that were found for the first time.
    update : dict of int to int
        Candidate → key of the earlier finding that it is.
    keep, delete : list of int
        Keys of earlier findings that were not found again: the reviewed ones stay, the others are deleted.
    summary : Summary
        Numbers of findings.
    """

    insert: list[int]
    update: dict[int, int]
    keep: list[int]
    delete: list[int]
    summary: Summary


@dataclass(frozen=True)
class Summary:
    """Numbers of findings of an earlier run and of this one.

    Attributes
    ----------
    kinds : Counter of str
        Candidates of each kind, as detected.
    new, again : int
        Number of leaks found for the first time, and of leaks that were a finding of any kind before.
    kept, gone : int
        Wet findings that were not found again: kept because of their review, and deleted.
    over_ends : int
        Leaks across a kilometre boundary.
    """

    kinds: Counter[str]
    new: int
    again: int
    kept: int
    gone: int
    over_ends: int


def gather_boundary(
    km: int,
    read: Callable[[Iterable[int]], Sequence[BoundaryRegion]],
    replaced: Iterable[int],
) -> Boundary:
    """Merge the regions that touch across the ends of a kilometre, as far as they reach.

    Parameters
    ----------
    km : int
        Kilometre.
    read : callable
        Returns the boundary regions of some kilometres.
    replaced : iterable of int
        Findings that the kilometre's earlier boundary regions belonged to.
    """
    first, last = km - 1, km + 1
    parts = list(read(range(first, last + 1)))
    while True:
        groups = [[parts[k] for k in group] for group in touching_groups([part.region for part in parts])]
        groups = [group for group in groups if any(part.concerns(km) for part in group)]
        touched = list(chain.from_iterable(groups))
        more = [
            *([first - 1] if any(part.km == first and part.reaches(first) for part in touched) else []),
            *([last + 1] if any(part.km == last and part.reaches(last + 1) for part in touched) else []),
        ]
        if not more:
            break
        parts += read(more)
        first, last = min(first, *more), max(last, *more)
    pixel = {part.region.pixel for part in parts if part.km == km}
    return Boundary(
        km,
        [Cluster(group, merge_regions([part.region for part in group])) for group in groups],
        {part.finding for part in touched if part.finding is not None} | set(replaced),
        first,
        last,
        sorted({p.km for p in parts if p.km != km and p.concerns(km) and pixel and p.region.pixel not in pixel}),
    )


def reconcile(
    found: Sequence[Anomaly], across: Sequence[Anomaly | None], boundary: Boundary, earlier: Sequence[EarlierFinding]
) -> Reconciliation:
    """Match each anomaly with an earlier finding, and decide what happens to the others.

    An anomaly within the kilometre is an earlier finding if the two overlap best with each other, by at least 0.3 of their
    union, whatever their kinds. One across an end of the kilometre is an earlier finding if the two share 0.3 of the smaller:
    so a leak that was known in part remains the same. Of the findings that are not found again, the reviewed ones are
    kept, and those that a dry region removes stay as they are.

    Parameters
    ----------
    found : sequence of Anomaly
        Anomalies within the kilometre.
    across : sequence of (Anomaly or None)
        Anomaly of each boundary cluster; None if it is too small or has no points.
    boundary : Boundary
        Clusters at its ends.
    earlier : sequence of EarlierFinding
        Findings that may be found again: those of the kilometre, those of the boundary, and those of the kilometres that the
        boundary reaches which an earlier run lost.
    """
    whole = [anomaly for anomaly in across if anomaly is not None]
    candidates = [*whole, *found]
    at_end = [one for one in earlier if one.id in boundary.findings or _is_near_end(one.outline, boundary)]
    pairs = match_parts(
        [one.outline for one in at_end],
        [one.reviewed for one in at_end],
        [anomaly.outline for anomaly in whole],
    )
    update = {number: at_end[k].id for number, k in pairs.items()}
    left = [one for one in earlier if one.id not in update.values()]
    again = match([one.outline for one in left], [anomaly.outline for anomaly in found])
    update |= {len(whole) + number: left[k].id for number, k in again.items()}
    # A finding of a neighbour that was lost before stays as it is.
    lost = [
        one
        for k, one in enumerate(left)
        if k not in again.values() and (one.km == boundary.km or one.id in boundary.findings) and not one.dry
    ]
    kept, gone = [one for one in lost if one.reviewed], [one for one in lost if not one.reviewed]
    leaks = [number in update for number, anomaly in enumerate(candidates) if anomaly.verdict.kind == FindingKind.LEAK]
    return Reconciliation(
        [number for number in range(len(candidates)) if number not in update],
        update,
        [one.id for one in kept],
        [one.id for one in gone],
        Summary(
            Counter(anomaly.verdict.kind for anomaly in candidates),
            leaks.count(False),
            leaks.count(True),
            sum(one.wet for one in kept),
            sum(one.wet for one in gone),
            sum(
                cluster.crosses
                for cluster, anomaly in zip(boundary.clusters, across, strict=True)
                if anomaly is not None and anomaly.verdict.kind == FindingKind.LEAK
            ),
        ),
    )


def _is_near_end(outline: Polygon, boundary: Boundary) -> bool:
    """Return True if an outline is so near an end of the kilometre that its straightening can move it there."""
    west, _, east, _ = outline.bounds
    planes = (boundary.km, boundary.km + 1)
    return any(west - boundary.pixel <= plane * KILOMETRE <= east + boundary.pixel for plane in planes)
