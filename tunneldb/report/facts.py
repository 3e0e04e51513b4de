"""Results of a survey, or of a stretch of it, that several chapters of its report state; each is read once, when needed."""

from __future__ import annotations

import datetime as dt
import hashlib
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import psycopg

from tunneldb.report import data, text
from tunneldb.report.actions import Actions, digest_actions, read_actions
from tunneldb.report.data import CoverageBins, Leak
from tunneldb.report.drawing import step_for, ticks
from tunneldb.report.findings import FindingsChapter, digest_findings, read_findings_chapter
from tunneldb.report.leak_sums import LeakSums, sum_leaks
from tunneldb.report.lining import Form
from tunneldb.report.owner import Owner
from tunneldb.report.pictures.load import Source
from tunneldb.report.rating import Rating, digest_ratings, read_rating
from tunneldb.report.since import Since, read_since
from tunneldb.report.strip import Progress, Strips
from tunneldb.report.structures import StructuresChapter, read_structures
from tunneldb.store.coverage import Coverage
from tunneldb.store.dry_regions import DryRegion, read_dry_regions
from tunneldb.store.survey import Survey


@dataclass(frozen=True)
class Request:
    """Content and form of a report.

    Attributes
    ----------
    survey : Survey
    low, high : float
        Ends of the stretch, chainage, m; within the survey.
    search : Coverage
        Statement on the requested stretch, also beyond the survey.
    owner : Owner
        Owner's settings.
    photos : Source
        Folder and servers of photos.
    listed : int
        Maximum number of leaks that are listed and drawn.
    pictures : int or None
        Maximum number of leaks with pictures; None for all.
    form : {'WEBP', 'JPEG'}
        Format of the pictures.
    progress : callable
        Called after each strip.
    at : datetime
        Moment whose state is reported.
    past : bool
        True if that is not the present.
    """

    survey: Survey
    low: float
    high: float
    search: Coverage
    owner: Owner
    photos: Source
    listed: int
    pictures: int | None
    form: Form
    progress: Progress
    at: dt.datetime
    past: bool = False


class Facts:
    """Results that several chapters state.

    Parameters
    ----------
    conn : psycopg.Connection
        Connection in the snapshot that the whole report is read from.
    request : Request
    """

    def __init__(self, conn: psycopg.Connection[Any], request: Request) -> None:
        self.conn, self.request = conn, request
        self.survey, self.low, self.high = request.survey, request.low, request.high

    @property
    def sought(self) -> bool:
        """True if leaks can be searched for: the survey has intensity."""
        return self.survey.intensity_kind != "none"

    @cached_property
    def part(self) -> bool:
        """True if the report is of a part of the survey."""
        return (self.low, self.high) != data.find_stretch(self.conn, self.survey, -np.inf, np.inf)

    @cached_property
    def leaks(self) -> list[Leak]:
        """Leaks that are listed and drawn."""
        return data.read_leaks(self.conn, self.survey, self.low, self.high, self.request.listed)

    @cached_property
    def pictured(self) -> set[int]:
        """Leaks with a picture: the largest, rejected ones last."""
        by_size = sorted(self.leaks, key=lambda leak: (leak.review == "rejected", -leak.area))
        return {leak.id for leak in by_size[: self.request.pictures]}

    @property
    def bin_length(self) -> float:
        """Length of the bins of wet area along the stretch, m."""
        return step_for(self.high - self.low, 150)

    @cached_property
    def sums(self) -> LeakSums:
        """Sums over all leaks of the stretch."""
        edges = np.unique([self.low, *ticks(self.low, self.high, self.bin_length), self.high])
        digest = hashlib.sha256(f"{self.survey.name} {self.low:.3f} {self.high:.3f}".encode())
        return sum_leaks(self.conn, self.survey, self.low, self.high, edges, digest)

    @cached_property
    def coverage(self) -> CoverageBins:
        """Inspected lining along the stretch."""
        return data.read_bins(self.conn, self.survey, self.low, self.high)

    @cached_property
    def findings(self) -> FindingsChapter | None:
        """Findings of all kinds."""
        ids = frozenset(leak.id for leak in self.leaks)
        table = "leaks" in self.request.owner.chapters and self.sought
        stretch = self.low, self.high
        return read_findings_chapter(self.conn, self.survey, stretch, ids, self.sums.ids, self.request.photos, table=table)

    @cached_property
    def detectability(self) -> list[data.DetectabilityShares]:
        """Shares of the inspected lining by whether leaks of the demanded size would be found."""
        return data.read_detectability(self.conn, self.survey, self.low, self.high)

    @cached_property
    def ratings(self) -> list[Rating]:
        """Ratings that the owner's template asks for."""
        asked = self.request.owner.ratings
        return [read_rating(self.conn, self.survey, self.low, self.high, n, one) for n, one in enumerate(asked, start=1)]

    @cached_property
    def since(self) -> Since | None:
        """Comparison with the last inspection."""
        return read_since(self.conn, self.survey, self.low, self.high, self.ratings) if self.sought else None

    @cached_property
    def linked(self) -> tuple[frozenset[int], frozenset[int]]:
        """Ids of the leaks and of the other findings that have a place in this report."""
        chapters = self.request.owner.chapters
        leaks = frozenset(leak.id for leak in self.leaks) if "leaks" in chapters and self.sought else frozenset()
        found = self.findings.listed if self.findings and "findings" in chapters else []
        return leaks, frozenset(finding.id for finding in found)

    @cached_property
    def regions(self) -> list[DryRegion]:
        """Dry regions that inspectors drew."""
        return read_dry_regions(self.conn, self.survey, self.low, self.high)

    @cached_property
    def structures(self) -> StructuresChapter | None:
        """Members of structures and their spots."""
        found = read_structures(self.conn, self.survey, (self.low, self.high) if self.part else None)
        return found if found and (found.spots.face_area > 0.0 or (self.part and found.spots.statement)) else None

    @cached_property
    def strips(self) -> Strips:
        """Strips of the unrolled lining."""
        request = self.request
        marks = self.findings.marks if self.findings else []
        return Strips(
            self.conn, self.survey, self.low, self.high, self.leaks, marks, self.coverage, self.pictured, request.form,
            request.progress, request.owner.words, self.sums.reach,
        )  # fmt: skip

    @cached_property
    def actions(self) -> Actions:
        """Actions; in a report of the past those of the survey itself, because only its own edits are reverted."""
        return read_actions(self.conn, self.survey, self.low, self.high, not self.request.past)

    @cached_property
    def total(self) -> dict[str, Any]:
        """Statistics of the whole stretch."""
        return data.read_statistics(self.conn, self.survey, [self.low], [self.high])[0]

    @cached_property
    def kilometres(self) -> list[dict[str, Any]]:
        """Statistics of each kilometre, limited to the stretch."""
        inner = [end for end in ticks(self.low, self.high, 1000.0) if self.low + 0.5 < end < self.high - 0.5]
        starts, ends = [self.low, *inner], [*inner, self.high]
        rows = data.read_statistics(self.conn, self.survey, starts, ends)
        labels = self.labels([*starts, self.high])
        for n, row in enumerate(rows):
            row |= {"from": labels[n], "to": labels[n + 1], "km": int(np.floor((starts[n] + ends[n]) / 2000))}
        return rows

    @cached_property
    def files(self) -> list[dict[str, Any]]:
        """Scan files."""
        return data.read_files(self.conn, self.survey, self.low, self.high)

    @cached_property
    def stale(self) -> Any:
        """Stages that are out of date."""
        return text.stale(data.read_stale(self.conn, self.survey, self.low, self.high))

    @cached_property
    def place(self) -> str:
        """Name of a place of the tunnel: station or chainage."""
        return data.place_name(self.conn, self.survey)

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the reported findings and ratings: two reports of the same findings and reviews have the same."""
        digest = self.sums.digest.copy()
        digest_findings(digest, self.findings, self.regions)
        if self.structures:
            digest_spots(digest, self.structures)
        digest_ratings(digest, self.ratings)
        digest_actions(digest, self.actions, self.survey)
        return digest.hexdigest()[:16]

    def labels(self, chainages: list[float]) -> list[str]:
        """Return the places at these chainages as text."""
        return data.label_chainages(self.conn, self.survey, chainages)


def digest_spots(digest: hashlib._Hash, found: StructuresChapter) -> hashlib._Hash:
    """Add the reported spots."""
    for spot in sorted(found.spots.rows, key=lambda spot: spot.number):
        wkb = spot.geometry.wkb_hex
        stated = (spot.number, spot.review, spot.detected, spot.reviewed_by, spot.remark, f"{spot.area:.4f}", wkb)
        digest.update(repr(stated).encode())
    return digest
