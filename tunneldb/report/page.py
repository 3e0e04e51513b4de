"""Report as one HTML file, written piece by piece, so that memory does not grow with the pictures."""

from __future__ import annotations

import datetime as dt
import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
import psycopg
from markupsafe import Markup

from tunneldb import __version__
from tunneldb.database import snapshot
from tunneldb.errors import NotReadyError
from tunneldb.export.tables.finding_counts import ORIGINS, SEVERITIES, STATES, UNCOUNTED
from tunneldb.export.tables.leaks import clock_label
from tunneldb.raster.gap_fill import FILL_NOTE
from tunneldb.report import data, text
from tunneldb.report.change import CHANGE_WORDS, read_change
from tunneldb.report.clearance import read_clearance
from tunneldb.report.deviation import read_deviation
from tunneldb.report.drawing import share_path, step_for, ticks, without_detection
from tunneldb.report.findings import STATE_WORDS, digest_findings, read_findings_chapter
from tunneldb.report.leak_sums import sum_leaks
from tunneldb.report.lining import Form
from tunneldb.report.owner import CHAPTERS, Owner
from tunneldb.report.photos import Thumbnail
from tunneldb.report.rings import read_rings
from tunneldb.report.strip import LETTERS, Progress, Strips
from tunneldb.report.structures import StructuresChapter, read_structures
from tunneldb.report.underwater import read_underwater
from tunneldb.store.catalog import crs_text
from tunneldb.store.coverage import Coverage, read_coverage
from tunneldb.store.dry_regions import read_dry_regions
from tunneldb.store.remarks import read_remarks
from tunneldb.store.survey import Survey

MAX_LISTED_LEAKS = 10_000
"""Default number of leaks that a report lists and draws, the largest; the others are only counted."""

CARDS = 400
"""Maximum number of leaks with picture and section in a printed report, the largest first; the HTML file has all."""

_OF_LEAKS = frozenset({"seen", "classes", "leaks", "statistics"})
"""Chapters that are empty if leaks were not searched for."""


@dataclass(frozen=True)
class Written:
    """Numbers of a report.

    Attributes
    ----------
    leaks, findings : int
        Number of leaks, and of findings of all kinds, that are included in totals: existing, and not rejected.
    missing : list of Thumbnail
        Photos that can't be had.
    """

    leaks: int
    findings: int
    missing: list[Thumbnail]


def write_html(
    conn: psycopg.Connection[Any],
    survey: Survey,
    path: Path,
    low: float = -np.inf,
    high: float = np.inf,
    progress: Progress = lambda done, count: None,
    pictures: int | None = None,
    form: Form = "WEBP",
    owner: Owner | None = None,
    photos: Path | None = None,
    listed: int = MAX_LISTED_LEAKS,
) -> Written:
    """Write the report of a survey, or of the stretch between two chainages, m, as an HTML file; the connection must be idle.

    Parameters
    ----------
    conn, survey, path, low, high
        Content, and target.
    progress : callable
        Called after each strip.
    pictures : int, optional
        Maximum number of leaks, the largest, with pictures in the file.
    form : {'WEBP', 'JPEG'}
        Format of the pictures.
    owner : Owner, optional
        Owner's settings.
    photos : Path, optional
        Folder in which relative paths of photos begin; else the current one.
    listed : int
        Maximum number of leaks, the largest, that are listed and drawn; rejected ones last. Totals and digest include all.
    """
    wanted = Owner() if owner is None else owner
    with snapshot(conn):
        search = read_coverage(conn, survey, low, high)
        ends = data.find_stretch(conn, survey, low, high)
        folder = Path() if photos is None else photos
        report = _Report(conn, survey, *ends, search, progress, pictures, form, wanted, folder, listed)
        with path.open("w", encoding="utf-8") as file:
            file.writelines(_template("report.html", wanted).generate(report.context()))
        found = report.findings
        return Written(report.sums.counted, found.counted if found else 0, found.missing if found else [])


def write_site_html(conn: psycopg.Connection[Any], survey: Survey, path: Path, owner: Owner | None = None) -> int:
    """Write the report of a survey of a site, with the chapter on structures; the connection must be idle.

    Returns
    -------
    int
        Number of spots that it counts: found last, and not rejected.

    Raises
    ------
    UserError
        Members were never looked for.
    """
    with snapshot(conn):
        found = read_structures(conn, survey)
        if found is None:
            raise NotReadyError(f"survey {survey.name} has nothing to report yet: tunneldb members {survey.name}")
        numbers = {spot.id: spot.number for spot in found.spots.rows}
        edits_in_all, edits = data.read_edits(conn, survey)
        context = {
            "survey": survey,
            "version": __version__,
            "now": dt.datetime.now(dt.UTC),
            "digest": _digest_spots(hashlib.sha256(survey.name.encode()), found).hexdigest()[:16],
            "structures": found,
            "files": data.read_files_of_site(conn, survey),
            "remarks": read_remarks(conn, survey),
            "runs": data.read_member_runs(conn, survey),
            "edits": [text.edit(edit, numbers) for edit in edits],
            "edits_in_all": edits_in_all,
            "crs": text.crs(crs_text(conn, survey.srid)),
        }
        with path.open("w", encoding="utf-8") as file:
            file.writelines(_template("site.html", Owner() if owner is None else owner).generate(context))
        return found.spots.count


def _digest_spots(digest: hashlib._Hash, found: StructuresChapter) -> hashlib._Hash:
    """Add the reported spots."""
    for spot in sorted(found.spots.rows, key=lambda spot: spot.number):
        wkb = spot.geometry.wkb_hex
        stated = (spot.number, spot.review, spot.detected, spot.reviewed_by, spot.remark, f"{spot.area:.4f}", wkb)
        digest.update(repr(stated).encode())
    return digest


def _template(name: str, owner: Owner) -> jinja2.Template:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("tunneldb.report"),
        autoescape=jinja2.select_autoescape(["html"]),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {
        "percent": text.percent, "number": text.number, "whole": text.whole, "signed": text.signed, "clock": clock_label,
        "when": text.when, "day": owner.words.day, "kilometres": text.kilometres, "size": text.size, "css": text.css,
        "counters": text.counters,
    }  # fmt: skip
    environment.globals |= {"_": owner.words, "owner": owner}
    environment.globals |= {"origins": ORIGINS, "severities": SEVERITIES, "uncounted": UNCOUNTED, "said": STATE_WORDS}
    return environment.get_template(name)


class _Report:
    """A report while it is written.

    Parameters
    ----------
    conn, survey, low, high, progress, pictures, form, owner, photos, listed
        As in :func:`write_html`; the stretch limited to the survey.
    search : Coverage
        Statement on the requested stretch, also beyond the survey.
    """

    def __init__(
        self,
        conn: psycopg.Connection[Any],
        survey: Survey,
        low: float,
        high: float,
        search: Coverage,
        progress: Progress,
        pictures: int | None,
        form: Form,
        owner: Owner,
        photos: Path,
        listed: int,
    ) -> None:
        self.owner = owner
        self.conn, self.survey, self.low, self.high, self.search = conn, survey, low, high, search
        self.leaks = data.read_leaks(conn, survey, low, high, listed)
        self.bin_length = step_for(high - low, 150)
        edges = np.unique([low, *ticks(low, high, self.bin_length), high])
        self.sums = sum_leaks(conn, survey, low, high, edges, hashlib.sha256(f"{survey.name} {low:.3f} {high:.3f}".encode()))
        self.coverage = data.read_bins(conn, survey, low, high)
        by_size = sorted(self.leaks, key=lambda leak: (leak.review == "rejected", -leak.area))
        pictured = {leak.id for leak in by_size[:pictures]}
        ids = frozenset(leak.id for leak in self.leaks)
        table = "leaks" in owner.chapters and survey.intensity_kind != "none"
        self.findings = read_findings_chapter(conn, survey, (low, high), ids, self.sums.ids, photos, table=table)
        self.underwater = read_underwater(conn, survey, low, high)
        self.clearance = read_clearance(conn, survey, low, high)
        self.rings = read_rings(conn, survey, low, high)
        self.change = read_change(conn, survey, low, high)
        self.deviation = read_deviation(conn, survey, low, high, form) if "deviation" in owner.chapters else []
        self.regions = read_dry_regions(conn, survey, low, high)
        marks = self.findings.marks if self.findings else []
        self.strips = Strips(
            conn, survey, low, high, self.leaks, marks, self.coverage, pictured, form, progress, owner.words, self.sums.reach
        )
        self.place = data.place_name(conn, survey)
        self.cards = min(CARDS, len(pictured))
        self.part = (low, high) != data.find_stretch(conn, survey, -np.inf, np.inf)
        found = read_structures(conn, survey, (low, high) if self.part else None)
        self.structures = found if found and (found.spots.face_area > 0.0 or (self.part and found.spots.statement)) else None

    def context(self) -> dict[str, Any]:
        """Return all that the template shows."""
        conn, survey, low, high = self.conn, self.survey, self.low, self.high
        classes = data.read_classes(conn, survey, low, high)
        total = data.read_statistics(conn, survey, [low], [high])[0]
        runs = data.read_runs(conn, survey, low, high)
        edits_in_all, edits = data.read_edits(conn, survey)
        numbers = {spot.id: spot.number for spot in self.structures.spots.rows} if self.structures else {}
        return {
            "survey": survey,
            "version": __version__,
            "now": dt.datetime.now(dt.UTC),
            "digest": self._digest(),
            "chapters": self.owner.chapters,
            "nav": [(name, CHAPTERS[name]) for name in self.owner.chapters if name != "summary" and self._says(name)],
            "left_out": [heading for name, heading in CHAPTERS.items() if name not in self.owner.chapters and self._says(name)],
            "findings": self.findings,
            "regions": self.regions,
            "place": self.place,
            "low": low,
            "high": high,
            "low_label": self._labels([low])[0],
            "high_label": self._labels([high])[0],
            "total": total,
            "classes": classes,
            "unlisted": self.sums.leaks - len(self.leaks),
            "listed": len(self.leaks),
            "by_state": self.findings.wet_states if self.findings else dict.fromkeys(STATES, 0),
            "lost": self.sums.lost,
            "others": data.read_others(conn, survey, low, high),
            "search": self.search,
            "gaps": sorted(self.search.gaps, key=lambda gap: (gap.searched, gap.chainage_from - gap.chainage_to)),
            "unlooked": (1 - total["searched_share"]) * (high - low),
            "kilometres": self._kilometres(),
            "files": data.read_files(conn, survey, low, high),
            "remarks": read_remarks(conn, survey, low, high),
            "filled": FILL_NOTE,
            "stale": text.stale(data.read_stale(conn, survey, low, high)),
            "runs": runs,
            "versions": text.versions(runs),
            "radiometry": data.read_radiometry(conn, survey, low, high),
            "people": self.findings.people if self.findings else [],
            "structures": self.structures,
            "underwater": self.underwater,
            "clearance": self.clearance,
            "rings": self.rings,
            "change": self.change,
            "change_words": CHANGE_WORDS,
            "deviation": self.deviation,
            "edits": [text.edit(edit, numbers) for edit in edits],
            "edits_in_all": edits_in_all,
            "part": self.part,
            "sought": survey.intensity_kind != "none",
            "unposed": survey.note,
            "crs": text.crs(crs_text(conn, survey.srid)),
            "clock": self.sums.clock_bars,
            "sizes": self.sums.size_bars,
            "glance": self._glance(),
            "strips": self.strips,
            "strip_length": self.strips.length,
            "girth": self.strips.north - self.strips.south,
            "south": self.strips.south,
            "north": self.strips.north,
            "letter": self.strips.length / LETTERS,
            "table": self._table(),
            "cards": self.cards,
        }

    def _says(self, chapter: str) -> bool:
        """Return True if a chapter has content."""
        if chapter in _OF_LEAKS:
            return self.survey.intensity_kind != "none"
        there: dict[str, object] = {
            "findings": self.findings, "dry": self.regions, "structures": self.structures, "underwater": self.underwater,
            "clearance": self.clearance, "rings": self.rings, "change": self.change, "deviation": self.deviation,
        }  # fmt: skip
        return chapter not in there or bool(there[chapter])

    def _labels(self, chainages: list[float]) -> list[str]:
        return data.label_chainages(self.conn, self.survey, chainages)

    def _kilometres(self) -> list[dict[str, Any]]:
        """Return the statistics of each kilometre, limited to the stretch."""
        inner = [end for end in ticks(self.low, self.high, 1000.0) if self.low + 0.5 < end < self.high - 0.5]
        starts, ends = [self.low, *inner], [*inner, self.high]
        rows = data.read_statistics(self.conn, self.survey, starts, ends)
        labels = self._labels([*starts, self.high])
        for n, row in enumerate(rows):
            row |= {"from": labels[n], "to": labels[n + 1], "km": int(np.floor((starts[n] + ends[n]) / 2000))}
        return rows

    def _digest(self) -> str:
        """Return the SHA-256 of the reported leaks: two reports of the same leaks and reviews have the same."""
        digest = self.sums.digest.copy()
        digest_findings(digest, self.findings, self.regions)
        if self.structures:
            _digest_spots(digest, self.structures)
        return digest.hexdigest()[:16]

    def _glance(self) -> dict[str, Any]:
        """Return the whole stretch in one drawing, 1000 wide: inspected share, wet area in bins, ticks."""
        length = self.high - self.low
        scale = 1000.0 / length
        bin_length, edges, wet = self.bin_length, self.sums.edges, self.sums.wet
        places = ticks(self.low, self.high, step_for(length, 10))
        most = float(wet.max(initial=0.0))
        bars = [
            ((edges[n] - self.low) * scale, max((edges[n + 1] - edges[n]) * scale - 0.6, 0.8), wet[n] / most, edges[n])
            for n in np.flatnonzero(wet > 0).tolist()
        ]
        merged = self.coverage.merged(max(1, round(length / 500)))
        return {
            "bin": bin_length,
            "most": most,
            "bars": bars,
            "seen": share_path(merged, self.low, self.high, 60.0, 50.0, scale),
            "blank": [((a - self.low) * scale, (b - a) * scale) for a, b in without_detection(merged, self.low, self.high)],
            "ticks": [
                ((x - self.low) * scale, text.short(label)) for x, label in zip(places, self._labels(places), strict=True)
            ],
            "leaks": [((leak.middle - self.low) * scale, leak) for leak in self.leaks if leak.counts],
        }

    def _table(self) -> Markup:
        """Return the table of the leaks as JSON: names of the columns, and rows."""
        rows = [
            [
                leak.id, round(leak.middle, 3), leak.label, round(leak.chainage_to - leak.chainage_from, 2),
                round(leak.arc_from, 2), round(leak.arc_to, 2), round(leak.clock, 3), clock_label(leak.clock),
                round(leak.area, 5), round(leak.inside, 5), text.rounded(leak.darkening_mean, 1),
                text.rounded(leak.darkening_max, 1),
                text.rounded(leak.contrast, 1), text.rounded(leak.confidence, 2), text.rounded(leak.image_share, 2),
                leak.review, leak.reviewed_by or "", text.when(leak.reviewed_at) if leak.reviewed_at else "",
                leak.remark or "", int(leak.detected), self.strips.of(leak), *self._as_finding(leak.id),
            ]
            for leak in self.leaks
        ]  # fmt: skip
        return text.script_json(
            {
                **{"columns": TABLE, "rows": rows, "cards": self.cards, "strip": self.strips.length, "place": self.place},
                **{"searched": self.search.searched_share > 0, "words": self.owner.words.texts},
            }
        )

    def _as_finding(self, key: int) -> tuple[str, str, int | None, str]:
        """Return name of the kind, origin, severity and its name of a leak."""
        assert self.findings is not None  # leaks are findings
        finding = self.findings.by_id[key]
        return finding.kind_label, finding.origin, finding.severity, finding.severity_label or ""


TABLE = [
    *(
        "id",
        "chainage",
        "label",
        "length",
        "arcFrom",
        "arcTo",
        "clock",
        "clockLabel",
        "area",
        "inside",
        "drop",
        "dropMax",
        "contrast",
        "confidence",
    ),
    *("imageShare", "review", "by", "at", "remark", "detected", "strip", "kind", "origin", "severity", "severityLabel"),
]
"""Columns of the table, as in the page's script."""
