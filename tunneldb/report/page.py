"""The report as one HTML file, written piece by piece: what lies in memory does not grow with the pictures."""

from __future__ import annotations

import datetime as dt
import hashlib
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
import psycopg
from markupsafe import Markup

from tunneldb import __version__
from tunneldb.database import Survey, snapshot
from tunneldb.report import data, text
from tunneldb.report.drawing import (
    Section,
    Sign,
    near,
    outline_path,
    place_signs,
    share_path,
    step_for,
    ticks,
    wet_bins,
    without_detection,
)
from tunneldb.report.lining import Lining, Picture, Window

CARDS = 400
"""Leaks of which a printed report shows picture and section at most, the largest first; the HTML file shows those of all."""

PICTURE, SHAPE = 256, 4 / 3
"""Width of a leak's picture at most, pixels, and its width for its height."""

LEAST = 3.0
"""Width of the lining that a leak's picture shows at least, m."""

STRIP_PIXELS = 1600
"""Width of the picture of a strip, pixels."""

LETTERS = 80
"""Height of letters beside a strip: so many make its length."""

SLIVER = 0.1
"""A last strip shorter than this is left out, m."""

Progress = Callable[[int, int], None]
"""Takes how many strips are drawn, and of how many."""


@dataclass(frozen=True)
class Strip:
    """A stretch of the lining as a picture with its leaks; lengths in m, y downwards from the greatest arc.

    Attributes
    ----------
    low, left, high : float
        Chainage at which its drawing begins, how far from there its picture does, and the chainage at which it ends.
    title : str
        Both, in the tunnel's stationing.
    picture : Picture or None
        None where there is no image.
    ticks : list of (float, str)
        Chainage and label.
    leaks : list of (Leak, str)
        Leaks with the path of their outline, x from ``low``.
    signs : list of Sign
        Their numbers.
    ribbon : str
        Path of the share seen.
    blank : list of (float, float)
        Where detection did not run.
    summary : str
        How many leaks, how much was seen.
    details : Markup
        What the leaks whose middle lies in it show, as JSON.
    """

    low: float
    left: float
    high: float
    title: str
    picture: Picture | None
    ticks: list[tuple[float, str]]
    leaks: list[tuple[data.Leak, str]]
    signs: list[Sign]
    ribbon: str
    blank: list[tuple[float, float]]
    summary: str
    details: Markup


def strip_length(length: float) -> float:
    """Length of a strip, m, for a stretch so long: no more than about a hundred."""
    return 50.0 if length <= 500 else 100.0 if length <= 5000 else 250.0 if length <= 50_000 else 500.0


def write_html(
    conn: psycopg.Connection[Any],
    survey: Survey,
    path: Path,
    low: float = -np.inf,
    high: float = np.inf,
    progress: Progress = lambda done, count: None,
    pictures: int | None = None,
) -> int:
    """Write the report of a survey, or of the stretch between two chainages, m, as an HTML file; the connection must be idle.

    Parameters
    ----------
    conn, survey, path, low, high
        What, where to.
    progress : callable
        Told after each strip.
    pictures : int, optional
        Only of so many leaks, the largest, pictures go into the file.

    Returns
    -------
    int
        Number of leaks reported.
    """
    with snapshot(conn):
        report = _Report(conn, survey, *data.find_stretch(conn, survey, low, high), progress, pictures)
        with path.open("w", encoding="utf-8") as file:
            file.writelines(_template().generate(report.context()))
        return len(report.leaks)


def _template() -> jinja2.Template:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("tunneldb.report"),
        autoescape=jinja2.select_autoescape(["html"]),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {
        "percent": text.percent, "number": text.number, "whole": text.whole, "when": text.when, "day": text.day,
        "kilometres": text.kilometres, "size": text.size, "css": text.css,
    }  # fmt: skip
    return environment.get_template("report.html")


class _Report:
    """A report while it is written.

    Parameters
    ----------
    conn, survey, low, high, progress, pictures
        As in :func:`write_html`.
    """

    def __init__(
        self, conn: psycopg.Connection[Any], survey: Survey, low: float, high: float, progress: Progress, pictures: int | None
    ) -> None:
        self.conn, self.survey, self.low, self.high, self.progress = conn, survey, low, high, progress
        self.leaks = data.read_leaks(conn, survey, low, high)
        self.coverage = data.read_coverage(conn, survey, low, high)
        by_size = sorted(self.leaks, key=lambda leak: (leak.review == "rejected", -leak.area))
        self._pictured = {leak.id for leak in by_size[:pictures]}
        self.length = strip_length(high - low)
        row = conn.execute(
            "SELECT max(arc[361]), min(arc[1]) FROM tunnel.section WHERE survey_id = %s AND chainage BETWEEN %s AND %s",
            [survey.id, low - survey.spacing, high + survey.spacing],
        ).fetchone()
        assert row is not None
        self.north, self.south = (9.0, -9.0) if row[0] is None else row

    def context(self) -> dict[str, Any]:
        """Return all that the template shows."""
        conn, survey, low, high = self.conn, self.survey, self.low, self.high
        classes = data.read_classes(conn, survey, low, high)
        total = data.read_statistics(conn, survey, [low], [high])[0]
        hidden = data.hidden_stretches(self.coverage)
        runs = data.read_runs(conn, survey, low, high)
        counted = [leak for leak in self.leaks if leak.counts]
        return {
            "survey": survey,
            "version": __version__,
            "now": dt.datetime.now(dt.UTC),
            "digest": self._digest(),
            "low": low,
            "high": high,
            "low_label": self._labels([low])[0],
            "high_label": self._labels([high])[0],
            "total": total,
            "classes": classes,
            "leaks": self.leaks,
            "counted": counted,
            "by_review": {name: sum(leak.review == name for leak in self.leaks) for name in ("open", "confirmed", "rejected")},
            "lost": [leak for leak in self.leaks if not leak.detected],
            "others": data.read_others(conn, survey, low, high),
            "hidden": self._named(hidden),
            "hidden_length": sum(b - a for a, b, _ in hidden),
            "hidden_share": data.HIDDEN_SHARE,
            "unlooked": sum(b - a for a, b in without_detection(self.coverage, low, high)),
            "kilometres": self._kilometres(),
            "files": data.read_files(conn, survey, low, high),
            "stale": data.read_stale(conn, survey, low, high),
            "runs": runs,
            "versions": text.versions(runs),
            "radiometry": data.read_radiometry(conn, survey, low, high),
            "people": text.reviewers(self.leaks),
            "edits": [text.edit(edit) for edit in data.read_edits(conn, survey)],
            "clock": text.by_clock(counted),
            "sizes": text.by_size(counted),
            "glance": self._glance(),
            "strips": self._strips(),
            "strip_length": self.length,
            "girth": self.north - self.south,
            "south": self.south,
            "north": self.north,
            "letter": self.length / LETTERS,
            "table": self._table(),
            "cards": min(CARDS, len(self._pictured)),
        }

    def _labels(self, chainages: list[float]) -> list[str]:
        return data.label_chainages(self.conn, self.survey, chainages)

    def _named(self, stretches: list[tuple[float, float, float]]) -> list[dict[str, Any]]:
        """Stretches with the labels of their ends, the longest first."""
        labels = self._labels([end for low, high, _ in stretches for end in (low, high)])
        named = [
            {"from": labels[2 * n], "to": labels[2 * n + 1], "length": high - low, "share": share}
            for n, (low, high, share) in enumerate(stretches)
        ]
        return sorted(named, key=lambda stretch: -stretch["length"])

    def _kilometres(self) -> list[dict[str, Any]]:
        """Statistics of each kilometre, as far as it lies in the stretch."""
        inner = [end for end in ticks(self.low, self.high, 1000.0) if self.low + 0.5 < end < self.high - 0.5]
        starts, ends = [self.low, *inner], [*inner, self.high]
        rows = data.read_statistics(self.conn, self.survey, starts, ends)
        labels = self._labels([*starts, self.high])
        for n, row in enumerate(rows):
            row |= {"from": labels[n], "to": labels[n + 1], "km": int(np.floor((starts[n] + ends[n]) / 2000))}
        return rows

    def _digest(self) -> str:
        """SHA-256 of what is reported of the leaks: two reports of the same leaks and reviews have the same."""
        digest = hashlib.sha256(f"{self.survey.name} {self.low:.3f} {self.high:.3f}".encode())
        for leak in sorted(self.leaks, key=lambda leak: leak.id):
            stated = (
                leak.id,
                leak.review,
                leak.detected,
                leak.reviewed_by,
                leak.remark,
                f"{leak.area:.4f}",
                leak.outline.wkb_hex,
            )
            digest.update(repr(stated).encode())
        return digest.hexdigest()[:16]

    def _glance(self) -> dict[str, Any]:
        """The whole stretch in one drawing, 1000 wide: share seen, wet area in bins, ticks."""
        length = self.high - self.low
        scale = 1000.0 / length
        bin_length = step_for(length, 150)
        edges = np.unique([self.low, *ticks(self.low, self.high, bin_length), self.high])
        wet = wet_bins(self.leaks, edges)
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
        """Table of the leaks as JSON: names of the columns, and rows."""
        rows = [
            [
                leak.id, round(leak.middle, 3), leak.label, round(leak.chainage_to - leak.chainage_from, 2),
                round(leak.arc_from, 2), round(leak.arc_to, 2), round(leak.clock, 3), round(leak.area, 3),
                round(leak.drop_mean, 1), round(leak.drop_max, 1), text.rounded(leak.contrast, 1),
                text.rounded(leak.confidence, 2), round(leak.image_share, 2), leak.review, leak.reviewed_by or "",
                text.when(leak.reviewed_at) if leak.reviewed_at else "", leak.remark or "", int(leak.detected),
                self._strip_of(leak),
            ]
            for leak in self.leaks
        ]  # fmt: skip
        return _json({"columns": TABLE, "rows": rows, "cards": min(CARDS, len(self._pictured)), "strip": self.length})

    def _strip_of(self, leak: data.Leak) -> int:
        """Begin of the strip that shows a leak's middle, m."""
        inside = min(max(leak.middle, self.low), self.high - SLIVER)
        return int(np.floor(inside / self.length) * self.length)

    def _strips(self) -> Iterator[Strip]:
        """Draw one strip after another."""
        lining = Lining(self.conn, self.survey)
        starts = np.arange(np.floor(self.low / self.length), np.ceil((self.high - SLIVER) / self.length)) * self.length
        for done, start in enumerate(starts.tolist(), start=1):
            low, high = max(start, self.low), min(start + self.length, self.high)
            yield self._strip(lining, start, low, high)
            self.progress(done, len(starts))

    def _strip(self, lining: Lining, start: float, low: float, high: float) -> Strip:
        leaks = [leak for leak in self.leaks if leak.chainage_to > low and leak.chainage_from < high]
        seen = self.coverage
        inside = (seen.edges[:-1] < high) & (seen.edges[1:] > low)
        total = seen.lining[inside].sum()
        wet = [leak for leak in leaks if leak.counts]
        places = ticks(low, high, self.length / 10)
        names = self._labels([low, high, *places])
        picture = lining.picture(Window(low, high, self.south, self.north), self.length / STRIP_PIXELS)
        counted = f"{len(wet)} leak{'s' * (len(wet) != 1)}"
        return Strip(
            low=start,
            left=low - start,
            high=high,
            title=f"{text.short(names[0])} to {text.short(names[1])}",
            picture=picture,
            ticks=[(place, text.short(name)) for place, name in zip(places, names[2:], strict=True)],
            leaks=[(leak, outline_path(leak.outline, start, self.north, self.length / 2000)) for leak in leaks],
            signs=place_signs(wet, start, start + self.length, self.length / LETTERS * 0.6),
            ribbon=share_path(seen, start, high, 0.0, 0.8 * self.length / LETTERS),
            blank=without_detection(seen, low, high),
            summary=f"{counted}, {text.percent(seen.seen[inside].sum() / total) if total > 0 else 'nothing'} of the lining seen",
            details=_json(self._details(lining, [leak for leak in leaks if self._strip_of(leak) == int(start)])),
        )

    def _details(self, lining: Lining, leaks: list[data.Leak]) -> dict[int, Any]:
        """Return picture, outline and section of leaks, by their id."""
        leaks = [leak for leak in leaks if leak.id in self._pictured]
        if not leaks:
            return {}
        sections = self._sections(min(leak.middle for leak in leaks), max(leak.middle for leak in leaks))
        details = {}
        for leak in leaks:
            window = Window(*near(leak, LEAST, SHAPE))
            picture = lining.picture(window, window.width / PICTURE)
            window = window if picture is None else picture.window
            detail: dict[str, Any] = {
                "size": [round(window.width, 2), round(window.height, 2)],
                "outline": outline_path(leak.outline, window.west, window.north, window.width / 400),
            }
            if picture is not None:
                detail["picture"] = picture.base64
            if sections:
                chainage, section = min(sections, key=lambda known: abs(known[0] - leak.middle))
                detail |= {
                    "box": section.box(), "section": section.path(), "band": section.band(leak.arc_from, leak.arc_to),
                    "at": round(chainage - leak.middle, 1),
                }  # fmt: skip
            details[leak.id] = detail
        return details

    def _sections(self, low: float, high: float) -> list[tuple[float, Section]]:
        rows = self.conn.execute(
            "SELECT chainage, radius, arc FROM tunnel.section WHERE survey_id = %s AND chainage BETWEEN %s AND %s ORDER BY 1",
            [self.survey.id, low - self.survey.spacing, high + self.survey.spacing],
        ).fetchall()
        return [(chainage, Section.of(radius, arc)) for chainage, radius, arc in rows]


TABLE = [
    *("id", "chainage", "label", "length", "arcFrom", "arcTo", "clock", "area", "drop", "dropMax", "contrast", "confidence"),
    *("imageShare", "review", "by", "at", "remark", "detected", "strip"),
]
"""Columns of the table, as the script of the page calls them."""


def _json(value: Any) -> Markup:
    """JSON that may stand in a script element."""
    plain = json.dumps(value, ensure_ascii=False, separators=(",", ":"), allow_nan=False)
    return Markup(plain.replace("<", "\\u003c"))
