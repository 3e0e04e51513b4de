"""The chapters on findings of all kinds, detected and drawn, and on dry regions."""

from __future__ import annotations

import datetime as dt
import hashlib
from bisect import insort
from collections import Counter, defaultdict
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import psycopg
import shapely

from tunneldb.arrays import Int64
from tunneldb.export.tables.finding_counts import DARK, OTHERS, STATES, UNCOUNTED, KindCount, KindTally, in_order, sum_groups
from tunneldb.report.drawing import line_path, outline_path
from tunneldb.report.photos import Thumbnail, make_thumbnails, read_photos
from tunneldb.report.pictures.load import Source
from tunneldb.store.dry_regions import DryRegion
from tunneldb.store.finding_kinds import read_kinds, read_severities, read_wet_kinds
from tunneldb.store.findings import Chosen, Finding, stream_findings
from tunneldb.store.survey import Survey

MAX_ROWS = 2000
"""Maximum number of rows of a kind; counted ones first, then by severity and size. A line gives the number without a row."""

STATE_WORDS = {
    "confirmed": "confirmed",
    "open": "open",
    "rejected": "rejected",
    "gone": "not found again",
    "dry": "in a dry region",
    "same": "same as another",
    "merged": "merged into another",
}
"""States in the words of the report."""


@dataclass(frozen=True)
class KindChapter:
    """The chapter on a kind of findings.

    Attributes
    ----------
    count : KindCount
        Counts of the kind.
    groups : list of (str, list of Finding)
        Listed findings by state, in order of chainage: confirmed, open, and not included in totals.
    tabled : int
        Number without a row, because the table of leaks has all information on them.
    plain : int
        Number without a row, because they are only detected, without any edit.
    beyond : list of (int, bytes)
        Findings without a row, because there are too many: their ids, and a digest of their notes.
    digested : set of int
        Ids of those with a row that the digest of leaks includes completely.
    """

    count: KindCount
    groups: list[tuple[str, list[Finding]]]
    tabled: int
    plain: int
    beyond: list[tuple[int, bytes]]
    digested: set[int]


@dataclass(frozen=True)
class FindingsChapter:
    """Findings in a report.

    Attributes
    ----------
    kinds : list of KindChapter
        Counts of the kinds that occur.
    severities : dict of int to str
        The owner's words for them.
    photos : dict of int to list of Thumbnail
        Photos of findings, by their id.
    by_id : dict of int to Finding
        Findings in the table of leaks.
    total : int
        Number of findings.
    people : list of dict
        Reviewers with the number of their reviews, and the first and the last time.
    leaks : frozenset of int
        Ids of those in the table of leaks.
    merged : dict of int to list of int
        Ids of those that are merged into one, by its id.
    wet : frozenset of str
        Codes of the kinds that are leaks in the sums.
    """

    kinds: list[KindChapter]
    severities: dict[int, str]
    photos: dict[int, list[Thumbnail]]
    by_id: dict[int, Finding]
    total: int
    people: list[dict[str, Any]]
    leaks: frozenset[int]
    merged: dict[int, list[int]]
    wet: frozenset[str]

    @property
    def states(self) -> dict[str, int]:
        """Number in each state."""
        return _states(self.kinds)

    @property
    def wet_states(self) -> dict[str, int]:
        """Number of leaks (wet kinds) in each state."""
        return _states([kind for kind in self.kinds if kind.count.kind in self.wet])

    @property
    def groups(self) -> list[KindCount]:
        """Sums of leaks, of other findings, and of joints and dry dark areas."""
        return [total for total, _ in sum_groups([kind.count for kind in self.kinds], self.wet)]

    @property
    def others(self) -> KindCount | None:
        """Sum of the findings that are neither wet nor joints and dry dark areas."""
        return next((total for total in self.groups if total.label == OTHERS), None)

    @property
    def open(self) -> int:
        """Number of open findings, without joints and dry dark areas."""
        return sum(total.states["open"] for total in self.groups if total.label != DARK)

    @property
    def counted(self) -> int:
        """Number included in totals."""
        return sum(kind.count.counted for kind in self.kinds)

    @property
    def uncounted(self) -> int:
        """Number not included in totals."""
        return self.total - self.counted

    @property
    def listed(self) -> list[Finding]:
        """Findings with a row, by their ids."""
        rows = [finding for kind in self.kinds for _, group in kind.groups for finding in group]
        return sorted(rows, key=lambda finding: finding.id)

    @property
    def besides(self) -> bool:
        """True if there is more than leaks, joints and dry dark areas as detected."""
        return bool(self.listed)

    @property
    def missing(self) -> list[Thumbnail]:
        """Photos that can't be had."""
        return [photo for photos in self.photos.values() for photo in photos if photo.url is None]

    @property
    def marks(self) -> list[Finding]:
        """Findings in the pictures of the lining: counted, with a row, and not leaks."""
        return [finding for finding in self.listed if finding.counted and finding.id not in self.leaks]

    @property
    def marked(self) -> list[tuple[int, str]]:
        """Severities of these, from the greatest, with the owner's words; 0 for none."""
        there = {finding.severity or 0 for finding in self.marks}
        return [(severity, self.severities.get(severity, "")) for severity in sorted(there, reverse=True)]


def _states(kinds: Sequence[KindChapter]) -> dict[str, int]:
    return {state: sum(kind.count.states[state] for kind in kinds) for state in STATES}


def read_findings_chapter(
    conn: psycopg.Connection[Any],
    survey: Survey,
    stretch: tuple[float, float],
    leaks: frozenset[int],
    reported: Int64,
    photos: Source,
    *,
    table: bool,
) -> FindingsChapter | None:
    """Read the findings of a stretch; None if there are none.

    Parameters
    ----------
    conn, survey
        Source.
    stretch : (float, float)
        Only those that reach between these chainages, m.
    leaks : frozenset of int
        Ids of those that are listed as leaks.
    reported : (n,) int64 array
        Growing ids of all leaks that are in the report's sums and digest, listed or not.
    photos : Source
        Folder and servers of photos.
    table : bool
        True if the report has a table of the leaks.
    """
    order = read_kinds(conn)
    kinds: defaultdict[str, _Gathered] = defaultdict(_Gathered)
    people: defaultdict[str, _Reviews] = defaultdict(_Reviews)
    by_id: dict[int, Finding] = {}
    merged: defaultdict[int, list[int]] = defaultdict(list)
    total = 0
    chosen = Chosen(states=(), low=stretch[0], high=stretch[1])
    with closing(stream_findings(conn, survey, chosen=chosen)) as found:
        for finding in found:
            total += 1
            place = int(np.searchsorted(reported, finding.id))
            digested = place < len(reported) and reported[place] == finding.id and _is_plain(finding, tabled=True)
            kinds[finding.kind].add(finding, tabled=table and finding.id in leaks, digested=digested)
            if finding.id in leaks:
                by_id[finding.id] = finding
            if finding.merged_into is not None:
                insort(merged[finding.merged_into], finding.id)
            if finding.reviewed_by and finding.reviewed_at:
                people[finding.reviewed_by].add(finding.review, finding.reviewed_at)
    if not total:
        return None
    chapters = [kinds[kind].chapter(kind) for kind in in_order(kinds, order)]
    taken = [finding.id for chapter in chapters for _, rows in chapter.groups for finding in rows if finding.photos]
    pictures: defaultdict[int, list[Thumbnail]] = defaultdict(list)
    for photo in make_thumbnails(conn, read_photos(conn, survey, taken), photos):
        pictures[photo.photo.finding_id].append(photo)
    reviews = [people[name].person(name) for name in sorted(people)]
    return FindingsChapter(
        chapters, read_severities(conn), dict(pictures), by_id, total, reviews, leaks, dict(merged), read_wet_kinds(conn)
    )


@dataclass
class _Reviews:
    """Reviewed findings."""

    first: dt.datetime | None = None
    last: dt.datetime | None = None
    states: Counter[str] = field(default_factory=Counter)

    def add(self, review: str, moment: dt.datetime) -> None:
        self.first = moment if self.first is None else min(self.first, moment)
        self.last = moment if self.last is None else max(self.last, moment)
        self.states[review] += 1

    def person(self, name: str) -> dict[str, Any]:
        counts = {state: self.states[state] for state in ("open", "confirmed", "rejected")}
        return {"name": name, "first": self.first, "last": self.last, **counts}


@dataclass
class _Gathered:
    """Findings of a kind while they are read: counted, and those kept that get a row; of too many those that weigh most."""

    tally: KindTally = field(default_factory=KindTally)
    noted: list[Finding] = field(default_factory=list)
    digested: set[int] = field(default_factory=set)
    beyond: list[tuple[int, bytes]] = field(default_factory=list)
    tabled: int = 0
    plain: int = 0

    def add(self, finding: Finding, *, tabled: bool, digested: bool) -> None:
        """Add a finding, which may be in the table of leaks, and completely in the digest of leaks."""
        self.tally.add(finding)
        if not _is_plain(finding, tabled=tabled):
            self.noted.append(finding)
            if digested:
                self.digested.add(finding.id)
            if len(self.noted) >= 2 * MAX_ROWS + 1000:
                self._leave_beyond()
        elif tabled:
            self.tabled += 1
        else:
            self.plain += 1

    def _leave_beyond(self) -> None:
        """If there are too many, keep the most important, in order of chainage, and a digest of the others."""
        ranked = sorted(self.noted, key=_weight)
        shown = {finding.id for finding in ranked[:MAX_ROWS]}
        for one in ranked[MAX_ROWS:]:
            noted = b"" if one.id in self.digested else hashlib.sha256(repr(_stated(one, [])).encode()).digest()
            self.beyond.append((one.id, noted))
        self.digested &= shown
        self.noted = [finding for finding in self.noted if finding.id in shown]

    def chapter(self, kind: str) -> KindChapter:
        """Return the chapter on the kind."""
        self._leave_beyond()
        groups = [
            (state, [finding for finding in self.noted if finding.state == state])
            for state in ("confirmed", "open", *UNCOUNTED)
        ]
        return KindChapter(
            self.tally.count(kind),
            [(state, rows) for state, rows in groups if rows],
            self.tabled,
            self.plain,
            self.beyond,
            self.digested,
        )


def _weight(finding: Finding) -> tuple[Any, ...]:
    """Return the sort key of findings, the most important first."""
    return not finding.counted, -(finding.severity or 0), -finding.area, -(finding.length or 0.0), finding.id


def _is_plain(finding: Finding, *, tabled: bool) -> bool:
    """Return True if a finding needs no row: as detected, without edits or with all edits in the table of leaks."""
    if finding.origin != "detected" or finding.severity or finding.photos or finding.also_detected:
        return False
    return tabled or (finding.state == "open" and not finding.remark and not finding.reviewed_by)


def digest_findings(digest: hashlib._Hash, found: FindingsChapter | None, regions: Sequence[DryRegion]) -> None:
    """Add the noted findings, their photos, and all dry regions."""
    known = {key for kind in found.kinds for key in kind.digested} if found else set()
    for finding in found.listed if found else []:
        if finding.id in known:
            continue
        digest.update(repr(_stated(finding, found.photos.get(finding.id, []) if found else [])).encode())
    for _, part in sorted(beyond for kind in found.kinds for beyond in kind.beyond) if found else []:
        digest.update(part)
    for region in regions:
        place = [f"{end:.4f}" for end in (region.chainage_from, region.chainage_to, region.arc_from, region.arc_to)]
        stated_of_region = (
            region.id, place, f"{region.area:.4f}", region.reason, region.drawn_by, region.pending_approval, region.approved_by,
            region.leak_ids,
        )  # fmt: skip
        digest.update(repr(stated_of_region).encode())


def _stated(finding: Finding, photos: Sequence[Thumbnail]) -> tuple[Any, ...]:
    """Return the report entry of a noted finding."""
    return (
        finding.id, finding.kind, finding.origin, finding.state, finding.severity, finding.drawn_by, finding.reviewed_by,
        finding.remark, f"{finding.area:.4f}", f"{finding.length or 0:.4f}", finding.width_mm, finding.geometry.wkb_hex,
        [(photo.photo.path, photo.photo.caption) for photo in photos],
    )  # fmt: skip


@dataclass(frozen=True)
class Mark:
    """A finding on the picture of a strip; m, y downwards.

    Attributes
    ----------
    finding : Finding
    path : str
        Its outline or line; empty of a point.
    x, y : float
        Its middle.
    top : float
        Bottom of its number.
    """

    finding: Finding
    path: str
    x: float
    y: float
    top: float


def draw_mark(finding: Finding, west: float, north: float, tolerance: float) -> Mark:
    """Draw a finding in the unrolled plane, x from ``west``, y downwards from ``north``, simplified by a tolerance, m."""
    paths = []
    for part in shapely.get_parts(finding.geometry):
        if part.geom_type == "Polygon":
            paths.append(outline_path(part, west, north, tolerance))
        elif part.geom_type == "LineString":
            paths.append(line_path(shapely.get_coordinates(part.simplify(tolerance)) * [1, -1] + [-west, north]))
    left, low, right, high = finding.geometry.bounds
    return Mark(finding, "".join(paths), (left + right) / 2 - west, north - (low + high) / 2, north - high)
