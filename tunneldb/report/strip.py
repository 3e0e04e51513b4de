"""Lining strip by strip: pictures with the leaks on them, and details of each leak."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import psycopg
from markupsafe import Markup

from tunneldb.report import text
from tunneldb.report.data import CoverageBins, Leak, Row, label_chainages, read_statistics
from tunneldb.report.drawing import Section, Sign, near, outline_path, place_signs, share_path, ticks, without_detection
from tunneldb.report.findings import Mark, draw_mark
from tunneldb.report.lining import Form, Lining, Picture, Window
from tunneldb.report.words import Words
from tunneldb.store.findings import Finding
from tunneldb.store.survey import Survey

PICTURE, SHAPE = 256, 4 / 3
"""Maximum width of a leak's picture, pixels, and ratio of its width to its height."""

MIN_PICTURE_WIDTH = 3.0
"""Minimum width of the lining in a leak's picture, m."""

STRIP_PIXELS = 1600
"""Width of the picture of a strip, pixels."""

LETTERS = 80
"""Letter heights in the length of a strip."""

SLIVER = 0.1
"""Length below which a last strip without leaks is left out, m."""

Progress = Callable[[int, int], None]
"""Progress callback: number of strips drawn, and in total."""


@dataclass(frozen=True)
class Strip:
    """A stretch of the lining as a picture with its leaks; lengths in m, y downwards from the greatest arc.

    Attributes
    ----------
    number : int
        Whole chainage from which it would be drawn if the stretch did not begin later: by this it is known.
    low, high : float
        Chainage at which it begins and ends.
    title : str
        Both, in the tunnel's stationing.
    picture : Picture or None
        None without an image.
    ticks : list of (float, str)
        Chainage and label.
    leaks : list of (Leak, str)
        Leaks with the path of their outline, x from ``low``.
    marks : list of Mark
        Findings that are no leaks.
    signs : list of Sign
        Numbers of the leaks.
    rows : int
        Number of their rows, at least 1.
    ribbon : str
        Path of the share seen.
    blank : list of (float, float)
        Stretches without detection; none for a survey without intensity.
    summary : str
        Number of leaks, and inspected share; empty for a survey without intensity.
    details : Markup
        Leaks with their middle in it, as JSON.
    """

    number: int
    low: float
    high: float
    title: str
    picture: Picture | None
    ticks: list[tuple[float, str]]
    leaks: list[tuple[Leak, str]]
    marks: list[Mark]
    signs: list[Sign]
    rows: int
    ribbon: str
    blank: list[tuple[float, float]]
    summary: str
    details: Markup


def strip_length(length: float) -> float:
    """Return the length of a strip, m, for a stretch: at most about a hundred strips."""
    return 50.0 if length <= 500 else 100.0 if length <= 5000 else 250.0 if length <= 50_000 else 500.0


class Strips:
    """Draws the strips of a stretch, one after another.

    Parameters
    ----------
    conn, survey
        Source.
    low, high : float
        The stretch, m.
    leaks : sequence of Leak
        Leaks in it.
    findings : sequence of Finding
        Findings in it that are no leaks.
    coverage : Coverage
        Inspected part of it.
    pictured : collection of int
        Leaks that get a picture, by their id.
    form : {'WEBP', 'JPEG'}
        Format of the pictures.
    progress : callable
        Called after each strip.
    words : Words
        The language in which they are captioned.
    reach : float
        Greatest chainage of a leak, m.

    Attributes
    ----------
    length : float
        Length of a strip, m.
    south, north : float
        Least and greatest arc, m.
    starts : list of float
        Beginning of the strips if the stretch did not begin later, m.
    """

    def __init__(
        self,
        conn: psycopg.Connection[Any],
        survey: Survey,
        low: float,
        high: float,
        leaks: Sequence[Leak],
        findings: Sequence[Finding],
        coverage: CoverageBins,
        pictured: Collection[int],
        form: Form,
        progress: Progress,
        words: Words,
        reach: float,
    ) -> None:
        self.conn, self.survey, self.low, self.high = conn, survey, low, high
        self.leaks, self.findings, self.coverage, self.progress, self.words = leaks, findings, coverage, progress, words
        self._pictured, self._form = pictured, form
        self.length = strip_length(high - low)
        row = conn.execute(
            # not of the widest: a section that is measured astray would make all strips higher
            "SELECT percentile_cont(0.02) WITHIN GROUP (ORDER BY arc[1]),"
            " percentile_cont(0.98) WITHIN GROUP (ORDER BY arc[361])"
            " FROM tunnel.section WHERE survey_id = %s AND chainage BETWEEN %s AND %s",
            [survey.id, low - survey.spacing, high + survey.spacing],
        ).fetchone()
        assert row is not None
        first, last = np.floor(low / self.length), np.ceil((high - SLIVER) / self.length)
        if reach > last * self.length:
            last = np.ceil(high / self.length)
        self.starts = (np.arange(first, max(last, first + 1)) * self.length).tolist()
        self.south, self.north = (-9.0, 9.0) if row[0] is None else (float(row[0]), float(row[1]))

    def of(self, leak: Leak) -> int:
        """Begin of the strip that shows a leak's middle, m."""
        inside = min(max(leak.middle, self.low), self.high - 1e-6)
        return int(min(np.floor(inside / self.length) * self.length, self.starts[-1]))

    def __iter__(self) -> Iterator[Strip]:
        """Draw one strip after another."""
        lining = Lining(self.conn, self.survey, self._form)
        ends = [(max(start, self.low), min(start + self.length, self.high)) for start in self.starts]
        stated = read_statistics(self.conn, self.survey, *map(list, zip(*ends, strict=True)))
        for done, (start, (low, high), row) in enumerate(zip(self.starts, ends, stated, strict=True), start=1):
            yield self._strip(lining, start, low, high, row)
            self.progress(done, len(self.starts))

    def _strip(self, lining: Lining, start: float, low: float, high: float, stated: Row) -> Strip:
        leaks = [leak for leak in self.leaks if leak.chainage_to > low and leak.chainage_from < high]
        places = ticks(low, high, self.length / 10)
        names = label_chainages(self.conn, self.survey, [low, high, *places])
        picture = lining.picture(Window(low, high, self.south, self.north), self.length / STRIP_PIXELS)
        sought = self.survey.intensity_kind != "none"
        wet = [leak for leak in leaks if leak.counts]
        signs = place_signs(wet, low, low + self.length, self.length / LETTERS * 0.6)
        return Strip(
            number=int(start),
            low=low,
            high=high,
            title=self.words("{low} to {high}", low=text.short(names[0]), high=text.short(names[1])),
            picture=picture,
            ticks=[(place, text.short(name)) for place, name in zip(places, names[2:], strict=True)],
            leaks=[(leak, outline_path(leak.outline, low, self.north, self.length / 2000)) for leak in leaks],
            marks=[
                draw_mark(finding, low, self.north, self.length / 2000)
                for finding in self.findings
                if _reaches_in(finding, low, high)
            ],
            signs=signs,
            rows=1 + max((sign.row for sign in signs), default=0),
            ribbon=share_path(self.coverage, low, high, 0.0, 0.8 * self.length / LETTERS),
            blank=without_detection(self.coverage, low, high) if sought else [],
            summary=_summary(stated, len(signs), self.words) if sought else "",
            details=text.script_json(self._details(lining, [leak for leak in leaks if self.of(leak) == int(start)])),
        )

    def _details(self, lining: Lining, leaks: list[Leak]) -> dict[int, Any]:
        """Return picture, outline and section of leaks, by their id."""
        leaks = [leak for leak in leaks if leak.id in self._pictured]
        if not leaks:
            return {}
        sections = self._sections(min(leak.middle for leak in leaks), max(leak.middle for leak in leaks))
        details = {}
        for leak in leaks:
            window = Window(*near(leak, MIN_PICTURE_WIDTH, SHAPE))
            picture = lining.picture(window, window.width / PICTURE)
            window = window if picture is None else picture.window
            detail: dict[str, Any] = {
                "size": [round(window.width, 2), round(window.height, 2)],
                "outline": outline_path(leak.outline, window.west, window.north, window.width / 400),
            }
            if picture is not None:
                detail["picture"] = picture.url
                colour = lining.colours(picture)
                if colour is not None:
                    detail["colour"] = colour.url
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


def _reaches_in(finding: Finding, low: float, high: float) -> bool:
    """Return True if a finding is visible between two chainages, m; one that begins at the second is not, except a point."""
    left, _, right, _ = finding.geometry.bounds
    return (left < high and right > low) or low <= left == right <= high


def _summary(stated: Row, numbered: int, words: Words) -> str:
    """Return the number of leaks on a strip and the inspected share of the lining; only some leaks have a number beside it."""
    if stated["patches"] is None:
        return words("leaks were not searched for")
    count = stated["patches"]
    leaks = words.count("{count} leaks", count)
    unnumbered = max(count - numbered, 0)
    without = words.count(", the {count} smallest without a number here", unnumbered) if unnumbered else ""
    return leaks + without + words(", {share} of the lining inspected", share=text.percent(stated["seen_share"]))
