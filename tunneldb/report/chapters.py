"""Chapters of a report: each reads what it alone states. Its template `chapters/NAME.html` sees it as `chapter`."""

from __future__ import annotations

from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from tunneldb.export.tables.section_dimensions import dimension_rows
from tunneldb.raster.gap_fill import FILL_NOTE
from tunneldb.report import data, text
from tunneldb.report.change import CHANGE_WORDS, read_change
from tunneldb.report.clearance import read_clearance
from tunneldb.report.deviation import read_deviation
from tunneldb.report.drawing import share_path, step_for, ticks, without_detection
from tunneldb.report.facts import Facts
from tunneldb.report.imported import read_images
from tunneldb.report.location import LocationMap, draw_location
from tunneldb.report.owner import CHAPTERS
from tunneldb.report.rating import LISTED_WORST, UNFOLDED, Difference, differences
from tunneldb.report.rings import read_rings
from tunneldb.report.since import LISTED_WORSE
from tunneldb.report.strip import LETTERS
from tunneldb.report.underwater import read_underwater
from tunneldb.store.actions import STATES
from tunneldb.store.catalog import crs_text
from tunneldb.store.remarks import read_remarks

LISTED_SECTIONS = 20
"""Maximum number of sections in the table of cross-sections."""


class Chapter:
    """A chapter of a report.

    Attributes
    ----------
    name : str
        Key of the chapter in the owner's template, and name of its HTML template.
    style : str
        Style sheet that it needs beside that of the report.
    """

    name: ClassVar[str]
    style: ClassVar[str] = ""

    def __init__(self, facts: Facts) -> None:
        self.facts = facts
        self._of = facts.conn, facts.survey, facts.low, facts.high

    @property
    def heading(self) -> str:
        """Title in the navigation."""
        return CHAPTERS[self.name]

    @property
    def template(self) -> str:
        """Name of its HTML template."""
        return f"chapters/{self.name}.html"

    @property
    def has_content(self) -> bool:
        """True if there is something to state."""
        return True


class _OfLeaks(Chapter):
    """A chapter without content if leaks cannot be searched for."""

    @property
    def has_content(self) -> bool:
        return self.facts.sought


class _Found(Chapter):
    """A chapter about one result, `found`, which may be absent."""

    @property
    def found(self) -> Any:
        """The result; None or empty if there is none."""
        raise NotImplementedError

    @property
    def has_content(self) -> bool:
        return bool(self.found)


class Summary(Chapter):
    """Headline as the owner's template asks for it, main figures, changes since the last inspection, facts of the survey."""

    name, style = "summary", "rating.css"
    words, listed = CHANGE_WORDS, LISTED_WORSE

    @cached_property
    def crs(self) -> str:
        """Spatial reference."""
        return text.crs(crs_text(self.facts.conn, self.facts.survey.srid))

    @cached_property
    def location(self) -> LocationMap | None:
        """Map of the axis of the stretch; None without an axis."""
        facts = self.facts
        axis = data.read_axis(facts.conn, facts.survey, facts.low, facts.high)
        if len(axis) < 2:
            return None
        first, last = (text.short(label) for label in facts.labels([facts.low, facts.high]))
        return draw_location(axis, (first, last))

    @cached_property
    def remarks(self) -> Any:
        """Notes and limitations."""
        return read_remarks(*self._of)

    @cached_property
    def glance(self) -> dict[str, Any]:
        """Drawing of the whole stretch, 1000 wide: inspected share, wet area in bins, class of each kilometre, ticks."""
        facts = self.facts
        low, high = facts.low, facts.high
        length = high - low
        scale = 1000.0 / length
        edges, wet = facts.sums.edges, facts.sums.wet
        places = ticks(low, high, step_for(length, 10))
        most = float(wet.max(initial=0.0))
        bars = [
            ((edges[n] - low) * scale, max((edges[n + 1] - edges[n]) * scale - 0.6, 0.8), wet[n] / most, edges[n])
            for n in np.flatnonzero(wet > 0).tolist()
        ]
        merged = facts.coverage.merged(max(1, round(length / 500)))
        return {
            "bin": facts.bin_length,
            "most": most,
            "bars": bars,
            "rows": [
                ((row["chainage_from"] - low) * scale, (row["chainage_to"] - row["chainage_from"]) * scale - 0.6, row["class"])
                for row in facts.kilometres
            ],
            "seen": share_path(merged, low, high, 50.0, 50.0, scale),
            "blank": [((a - low) * scale, (b - a) * scale) for a, b in without_detection(merged, low, high)],
            "ticks": [((x - low) * scale, text.short(label)) for x, label in zip(places, facts.labels(places), strict=True)],
            "leaks": [((leak.middle - low) * scale, leak) for leak in facts.leaks if leak.counts],
        }


class Rating(_Found):
    """Elements of the tunnel, rated by schemes of the owner."""

    name, style = "rating", "rating.css"
    listed, unfolded = LISTED_WORST, UNFOLDED

    @property
    def found(self) -> Any:
        """Ratings that the template asks for."""
        return self.facts.ratings

    @property
    def differences(self) -> list[Difference]:
        """Schemes that rate the same elements, and where they differ."""
        return differences(self.facts.ratings)


class Actions(_Found):
    """Actions that this inspection and earlier ones demand."""

    name, style = "actions", "rating.css"
    states = STATES

    @property
    def found(self) -> Any:
        """Actions; None without any."""
        return self.facts.actions if self.facts.actions.rows else None


class Seen(_OfLeaks):
    """Inspected lining, and where leaks could be missed."""

    name = "seen"

    @property
    def unsearched(self) -> float:
        """Length of the stretch that was not searched for leaks, m."""
        return float((1 - self.facts.total["searched_share"]) * (self.facts.high - self.facts.low))

    @cached_property
    def ribbon(self) -> list[tuple[float, float, float, float]]:
        """Bins of the drawing of detectability, 1000 wide: beginning, width, and shares where the demand is met and not met."""
        low, high = self.facts.low, self.facts.high
        scale = 1000.0 / (high - low)
        bins = data.read_detectability_bins(*self._of, max(10.0, step_for(high - low, 500)))
        return [((a - low) * scale, (b - a) * scale, met, missed) for a, b, met, missed in bins]

    @property
    def gaps(self) -> list[Any]:
        """Stretches where leaks could be missed: not searched ones first, then the longest."""
        gaps = self.facts.request.search.gaps
        return sorted(gaps, key=lambda gap: (gap.searched, gap.chainage_from - gap.chainage_to))


class Classes(_OfLeaks):
    """Classes of waterproofing by the standard that the owner's template asks for."""

    name = "classes"

    @property
    def has_content(self) -> bool:
        """True if leaks can be searched for, and a standard is asked for."""
        return super().has_content and self.facts.request.owner.waterproofing is not None

    @cached_property
    def rows(self) -> Any:
        """Limits of each class, and whether they are met."""
        return data.read_classes(*self._of)


class Lining(Chapter):
    """Strips of the unrolled lining."""

    name = "lining"
    filled = FILL_NOTE

    @property
    def girth(self) -> float:
        """Height of a strip, m."""
        return self.facts.strips.north - self.facts.strips.south

    @property
    def letter(self) -> float:
        """Height of letters, m."""
        return self.facts.strips.length / LETTERS


class Imported(_Found):
    """Images of other instruments."""

    name, style = "imported", "imported.css"

    @cached_property
    def found(self) -> Any:
        """Imported images of the stretch."""
        return read_images(self.facts) if self.name in self.facts.request.owner.chapters else []

    @property
    def girth(self) -> float:
        """Height of a strip, m."""
        return self.facts.strips.north - self.facts.strips.south

    @property
    def north(self) -> float:
        """Greatest arc of a strip, m."""
        return self.facts.strips.north

    @property
    def length(self) -> float:
        """Length of a strip, m."""
        return self.facts.strips.length

    @property
    def letter(self) -> float:
        """Height of letters, m."""
        return self.facts.strips.length / LETTERS


class Sections(_Found):
    """Width, height and area of cross-sections."""

    name = "sections"

    @property
    def step(self) -> float:
        """Distance between listed sections, m."""
        return step_for(self.facts.high - self.facts.low, LISTED_SECTIONS)

    @cached_property
    def found(self) -> Any:
        """Sections at the step."""
        return dimension_rows(self.facts.conn, self.facts.survey, self.facts.low, self.facts.high, self.step)


class Leaks(_OfLeaks):
    """Table of the leaks."""

    name = "leaks"

    @property
    def listed(self) -> int:
        """Number of leaks that are listed."""
        return len(self.facts.leaks)

    @property
    def unlisted(self) -> int:
        """Number of leaks that are not listed."""
        return self.facts.sums.leaks - self.listed

    @cached_property
    def others(self) -> Any:
        """Numbers of other detected findings by kind."""
        return data.read_others(*self._of)


class Statistics(_OfLeaks):
    """Leaks by place on the clock and by size."""

    name = "statistics"


class Findings(_Found):
    """Findings of all kinds."""

    name, style = "findings", "findings.css"

    @property
    def found(self) -> Any:
        """Findings of the stretch."""
        return self.facts.findings


class Dry(_Found):
    """Dry regions."""

    name, style = "dry", "findings.css"

    @property
    def found(self) -> Any:
        """Dry regions of the stretch."""
        return self.facts.regions


class Structures(_Found):
    """Members of structures and their spots."""

    name, style = "structures", "structures.css"

    @property
    def found(self) -> Any:
        """Members and spots of the stretch."""
        return self.facts.structures


class Underwater(_Found):
    """Canal tunnel below the water."""

    name, style = "underwater", "underwater.css"

    @cached_property
    def found(self) -> Any:
        """Sonar scans and the bed."""
        return read_underwater(*self._of)


class Clearance(_Found):
    """Clearance around tracks."""

    name, style = "clearance", "clearance.css"

    @cached_property
    def found(self) -> Any:
        """Margins and infringements."""
        return read_clearance(*self._of)


class Rings(_Found):
    """Rings of the lining."""

    name, style = "rings", "rings.css"

    @cached_property
    def found(self) -> Any:
        """Shape of the rings."""
        return read_rings(*self._of)


class Change(_Found):
    """Comparison with an earlier survey."""

    name, style = "change", "rings.css"
    words = CHANGE_WORDS

    @cached_property
    def found(self) -> Any:
        """Changes of leaks and of the lining."""
        return read_change(*self._of)


class Deviation(_Found):
    """Deviation from design profiles."""

    name, style = "deviation", "deviation.css"

    @cached_property
    def found(self) -> Any:
        """Layers of the design, which are read if the owner wants the chapter."""
        request = self.facts.request
        return read_deviation(*self._of, request.form) if self.name in request.owner.chapters else []


class Methods(Chapter):
    """Methods, parameters, versions and scan files."""

    name = "methods"

    @cached_property
    def runs(self) -> Any:
        """Last runs of the stages."""
        return data.read_runs(*self._of)

    @property
    def versions(self) -> Any:
        """Versions of the programs that the stages ran with."""
        return text.versions(self.runs)

    @cached_property
    def radiometry(self) -> Any:
        """Correction of the intensity by kilometre."""
        return data.read_radiometry(*self._of)


class Reviews(Chapter):
    """Reviews and edits by hand."""

    name = "reviews"

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self.edits_in_all, self._edits = data.read_edits(facts.conn, facts.survey, facts.request.at)

    @property
    def people(self) -> Any:
        """Reviewers, with the numbers of their reviews."""
        return self.facts.findings.people if self.facts.findings else []

    @property
    def edits(self) -> list[Any]:
        """Latest edits."""
        structures = self.facts.structures
        numbers = {spot.id: spot.number for spot in structures.spots.rows} if structures else {}
        return [text.edit(edit, numbers) for edit in self._edits]


class Signatures(Chapter):
    """Place for signatures."""

    name = "signatures"


ALL: dict[str, type[Chapter]] = {
    chapter.name: chapter
    for chapter in (
        Summary, Rating, Actions, Seen, Classes, Lining, Imported, Sections, Leaks, Statistics, Findings, Dry, Structures,
        Underwater, Clearance, Rings, Change, Deviation, Methods, Reviews, Signatures,
    )
}  # fmt: skip
"""All chapters by name, in their default order."""
