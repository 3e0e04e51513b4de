"""The chapters on findings of all kinds, detected and drawn, and on dry regions."""

from __future__ import annotations

import hashlib
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import psycopg
import shapely

from tunneldb.export.tables.dry_regions import DryRegion
from tunneldb.export.tables.finding_counts import (
    STATES,
    UNCOUNTED,
    KindCount,
    count_findings,
    read_kinds,
    read_severities,
    read_wet_kinds,
)
from tunneldb.export.tables.findings import Chosen, Finding, read_findings
from tunneldb.report.drawing import line_path, outline_path
from tunneldb.report.photos import Thumbnail, make_thumbnails, read_photos
from tunneldb.store.survey import Survey

MOST = 2000
"""Rows of a kind at most; of more those that count first, then by severity and size, and a line says how many have none."""

STATE_WORDS = {
    "confirmed": "confirmed",
    "open": "open",
    "rejected": "rejected",
    "gone": "not found again",
    "dry": "in a dry region",
    "same": "the same as another",
    "merged": "merged into another",
}
"""States in the words of the report."""


@dataclass(frozen=True)
class KindChapter:
    """The chapter on a kind of findings.

    Attributes
    ----------
    count : KindCount
        What there is of it.
    groups : list of (str, list of Finding)
        Those listed by their state, in order of chainage: confirmed, open, and what no sum counts.
    plain : int
        How many stand here without a row: detected, and nobody has said anything of them.
    tabled : bool
        Whether these are in the table of leaks.
    beyond : list of Finding
        Those for which there is no row, as there are too many.
    """

    count: KindCount
    groups: list[tuple[str, list[Finding]]]
    plain: int
    tabled: bool
    beyond: list[Finding]


@dataclass(frozen=True)
class FindingsChapter:
    """What a report states of findings.

    Attributes
    ----------
    kinds : list of KindChapter
        Of those kinds that occur.
    severities : dict of int to str
        The owner's words for them.
    photos : dict of int to list of Thumbnail
        Photos of findings, by their id.
    by_id : dict of int to Finding
        All of them.
    leaks : frozenset of int
        Ids of those that are reported as leaks.
    merged : dict of int to list of int
        Ids of those that are merged into one, by its id.
    wet : frozenset of str
        Codes of the kinds that are leaks in the sums.
    """

    kinds: list[KindChapter]
    severities: dict[int, str]
    photos: dict[int, list[Thumbnail]]
    by_id: dict[int, Finding]
    leaks: frozenset[int]
    merged: dict[int, list[int]]
    wet: frozenset[str]

    @property
    def states(self) -> dict[str, int]:
        """How many there are in each state."""
        return _states(self.kinds)

    @property
    def wet_states(self) -> dict[str, int]:
        """How many leaks, those of wet kinds, there are in each state."""
        return _states([kind for kind in self.kinds if kind.count.kind in self.wet])

    @property
    def counted(self) -> int:
        """How many sums count."""
        return sum(kind.count.counted for kind in self.kinds)

    @property
    def uncounted(self) -> int:
        """How many no sum counts."""
        return len(self.by_id) - self.counted

    @property
    def listed(self) -> list[Finding]:
        """Those that have a row, by their ids."""
        rows = [finding for kind in self.kinds for _, group in kind.groups for finding in group]
        return sorted(rows, key=lambda finding: finding.id)

    @property
    def besides(self) -> bool:
        """Whether there is more than leaks, joints and dark spots as detection left them."""
        return bool(self.listed)

    @property
    def missing(self) -> list[Thumbnail]:
        """Photos that can't be had."""
        return [photo for photos in self.photos.values() for photo in photos if photo.url is None]

    @property
    def marks(self) -> list[Finding]:
        """Those that the pictures of the lining show: they count, have a row, and are none of the leaks."""
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
    photos: Path,
    *,
    table: bool,
) -> FindingsChapter | None:
    """Read what is stated of findings; None where there is none.

    Parameters
    ----------
    conn, survey
        Where from.
    stretch : (float, float)
        Only those that reach between these chainages, m.
    leaks : frozenset of int
        Ids of those that are reported as leaks.
    photos : Path
        Folder in which relative paths of photos begin.
    table : bool
        Whether the report has a table of the leaks.
    """
    found = read_findings(conn, survey, chosen=Chosen(states=(), low=stretch[0], high=stretch[1]))
    if not found:
        return None
    kinds: defaultdict[str, list[Finding]] = defaultdict(list)
    for finding in found:
        kinds[finding.kind].append(finding)
    counts = count_findings(found, read_kinds(conn))
    chapters = [_chapter(count, kinds[count.kind], leaks if table else frozenset()) for count in counts]
    taken = [finding.id for chapter in chapters for _, rows in chapter.groups for finding in rows if finding.photos]
    pictures: defaultdict[int, list[Thumbnail]] = defaultdict(list)
    for photo in make_thumbnails(read_photos(conn, survey, taken), photos):
        pictures[photo.photo.finding_id].append(photo)
    merged: defaultdict[int, list[int]] = defaultdict(list)
    for finding in sorted(found, key=lambda finding: finding.id):
        if finding.merged_into is not None:
            merged[finding.merged_into].append(finding.id)
    by_id = {finding.id: finding for finding in found}
    return FindingsChapter(chapters, read_severities(conn), dict(pictures), by_id, leaks, dict(merged), read_wet_kinds(conn))


def _chapter(count: KindCount, findings: Sequence[Finding], tabled: frozenset[int]) -> KindChapter:
    noted = [finding for finding in findings if not _is_plain(finding, tabled)]
    first = sorted(noted, key=lambda one: (not one.counted, -(one.severity or 0), -one.area, -(one.length or 0.0), one.id))
    shown = {finding.id for finding in first[:MOST]}
    groups = [
        (state, [finding for finding in noted if finding.state == state and finding.id in shown])
        for state in ("confirmed", "open", *UNCOUNTED)
    ]
    return KindChapter(
        count,
        [(state, rows) for state, rows in groups if rows],
        len(findings) - len(noted),
        any(finding.id in tabled for finding in findings),
        first[MOST:],
    )


def _is_plain(finding: Finding, tabled: frozenset[int]) -> bool:
    """Whether a finding needs no row: as detected, and what was said of it is in the table of leaks, or nothing was said."""
    if finding.origin != "detected" or finding.severity or finding.photos or finding.also_detected:
        return False
    if finding.id in tabled:
        return True
    return finding.state == "open" and not finding.remark and not finding.reviewed_by


def digest_findings(digest: hashlib._Hash, found: FindingsChapter | None, regions: Sequence[DryRegion]) -> None:
    """Add what is reported of findings that somebody noted, their photos, and of all dry regions."""
    beyond = [finding for kind in found.kinds for finding in kind.beyond] if found else []
    for finding in [*(found.listed if found else []), *sorted(beyond, key=lambda finding: finding.id)]:
        stated = (
            finding.id, finding.kind, finding.origin, finding.state, finding.severity, finding.drawn_by, finding.reviewed_by,
            finding.remark, f"{finding.area:.4f}", f"{finding.length or 0:.4f}", finding.width, finding.geometry.wkb_hex,
            [(photo.photo.path, photo.photo.caption) for photo in (found.photos.get(finding.id, []) if found else [])],
        )  # fmt: skip
        digest.update(repr(stated).encode())
    for region in regions:
        place = [f"{end:.4f}" for end in (region.chainage_from, region.chainage_to, region.arc_from, region.arc_to)]
        stated_of_region = (
            region.id, place, f"{region.area:.4f}", region.reason, region.drawn_by, region.waits, region.approved_by,
            region.leak_ids,
        )  # fmt: skip
        digest.update(repr(stated_of_region).encode())


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
        Above which its number stands.
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
