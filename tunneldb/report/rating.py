"""The chapter on ratings: elements of the tunnel in the stretch, rated by the schemes of the owner's template."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import psycopg

from tunneldb.report import data, text
from tunneldb.report.drawing import step_for, ticks
from tunneldb.report.owner import RatingRequest
from tunneldb.report.words import Words
from tunneldb.store.rating import MEASURES, rate, scheme_rules
from tunneldb.store.survey import Survey

Row = dict[str, Any]

LISTED_WORST = 20
"""Number of listed elements, the worst ones."""

UNFOLDED = 100
"""Number of elements up to which the table of all of them is open, and on paper."""

NAMED = 10
"""Number of elements up to which a sentence names them."""

MAX_BARS = 1000
"""Maximum number of bars of a lane of the drawing; with more elements each bar shows the worst of several."""

NARROW = 3.0
"""Width of a bar without a gap to the next one, in thousandths of the stretch."""

_STOPS = ("#8fbf9f", "#ecc94b", "#e8833a", "#c0392b", "#6b1230")
"""Colours from the best result to the worst."""

_LETTERS = ("#000000", "#ffffff")


@dataclass(frozen=True)
class Lane:
    """Elements of one zone, drawn along the tunnel.

    Attributes
    ----------
    label : str
        Clock positions, as 10–2; empty for elements that go all round.
    bars : list of (float, float, int)
        Place and width, in thousandths of the stretch, and level; 0 for elements that are not rated.
    partial : list of (float, float)
        Place and width of elements whose result is a lower bound.
    """

    label: str
    bars: list[tuple[float, float, int]]
    partial: list[tuple[float, float]]


@dataclass(frozen=True)
class Rating:
    """Rating of the elements of a stretch by one scheme.

    Attributes
    ----------
    number : int
        Number in the owner's template, from 1.
    scheme : dict
        Name, version, source, valid_from, results, min_inspected.
    elements : str
        Name of the division into elements.
    rows : list of dict
        Columns of ``tunnel_api.rating`` for each element that touches the stretch, in order of their numbers, with
        ``place`` and ``rule_text``.
    outside : int
        Number of elements of the division outside of the stretch.
    low, high : float
        The stretch, m.
    ticks : list of (float, str)
        Places along the drawing, in thousandths, with their labels.
    """

    number: int
    scheme: Row
    elements: str
    rows: list[Row]
    outside: int
    low: float
    high: float
    ticks: list[tuple[float, str]]

    @property
    def counts(self) -> list[tuple[str, int, int]]:
        """Each result of the scheme, from the best to the worst, with its level and the number of elements."""
        return count_results(self.scheme, self.rows)

    @property
    def unrated(self) -> list[Row]:
        """Elements without a result, because nothing was inspected."""
        return [row for row in self.rows if row["result"] is None]

    @property
    def partial(self) -> list[Row]:
        """Elements whose result is a lower bound."""
        return [row for row in self.rows if row["result"] is not None and not row["complete"]]

    @property
    def min_inspected(self) -> str:
        """Inspected share below which a result is a lower bound, in per cent."""
        return f"{100 * self.scheme['min_inspected']:.4g} %"

    @property
    def hardly_inspected(self) -> list[Row]:
        """Elements whose result is a lower bound, because too little of them was inspected."""
        return [row for row in self.partial if row["inspected_share"] < self.scheme["min_inspected"]]

    @property
    def growth_unknown(self) -> list[Row]:
        """Elements whose result is a lower bound, because it is not known what grew since the earlier inspection."""
        return [row for row in self.partial if row["inspected_share"] >= self.scheme["min_inspected"]]

    @property
    def rated(self) -> int:
        """Number of elements with a result."""
        return len(self.rows) - len(self.unrated)

    @property
    def worst(self) -> Row | None:
        """Worst result as a row: ``result``, ``level``, ``complete`` if all elements were inspected; None without any."""
        levels = [row["level"] for row in self.rows if row["level"] is not None]
        if not levels:
            return None
        complete = not self.unrated and not self.partial
        return {"result": self.scheme["results"][max(levels) - 1], "level": max(levels), "complete": complete}

    @property
    def crossing(self) -> bool:
        """True if an element goes across an end of the stretch."""
        return any(row["chainage_from"] < end < row["chainage_to"] for row in self.rows for end in (self.low, self.high))

    @property
    def reached(self) -> list[Row]:
        """Elements with a result worse than the best one, the worst first: by result, then by value over limit."""
        worse = (row for row in self.rows if (row["level"] or 0) > 1)
        return sorted(worse, key=lambda row: (-row["level"], -excess(row), row["number"]))

    @property
    def colours(self) -> list[tuple[str, str]]:
        """Colour of each result, and of letters on it."""
        return level_colours(len(self.scheme["results"]))

    @property
    def lanes(self) -> list[Lane]:
        """Drawing of the elements, a lane for each zone."""
        zones: dict[tuple[Any, Any], list[Row]] = {}
        for row in self.rows:
            zones.setdefault((row["clock_from"], row["clock_to"]), []).append(row)
        return [self._lane(zone, rows) for zone, rows in zones.items()]

    @property
    def merged(self) -> bool:
        """True if a bar of the drawing shows several elements."""
        zones = Counter((row["clock_from"], row["clock_to"]) for row in self.rows)
        return any(count > MAX_BARS for count in zones.values())

    def _lane(self, zone: tuple[Any, Any], rows: Sequence[Row]) -> Lane:
        scale = 1000.0 / (self.high - self.low)
        bars = []
        for row in rows:
            left = (max(row["chainage_from"], self.low) - self.low) * scale
            right = (min(row["chainage_to"], self.high) - self.low) * scale
            bars.append((left, right, row["level"] or 0, row["result"] is not None and not row["complete"]))
        if len(bars) > MAX_BARS:
            bars = _merge(bars)
        bars = _join(bars)
        return Lane(
            "" if zone[0] is None else f"{zone[0]:g}{text.DASH}{zone[1]:g}",
            [(left, _width(left, right), level) for left, right, level, _ in bars],
            [(left, right - left) for left, right, _, partial in bars if partial],
        )


def _width(left: float, right: float) -> float:
    """Return the width of a bar with a gap to the next one, unless it is narrow."""
    return right - left - (0.8 if right - left > NARROW else 0.0)


def _join(bars: Sequence[tuple[float, float, int, bool]]) -> list[tuple[float, float, int, bool]]:
    """Return the bars with equal neighbours as one, if they are narrow or not rated."""
    joined: list[tuple[float, float, int, bool]] = []
    for bar in bars:
        left, right, level, partial = bar
        if joined and (not level or right - left < NARROW):
            start, end, *state = joined[-1]
            if abs(end - left) < 1e-6 and state == [level, partial]:
                bar = (start, right, level, partial)
                joined.pop()
        joined.append(bar)
    return joined


def _merge(bars: Sequence[tuple[float, float, int, bool]]) -> list[tuple[float, float, int, bool]]:
    """Return bars of equal width with the worst level of those in each; one that is not rated if none of them is."""
    size = 1000.0 / MAX_BARS
    merged: dict[int, tuple[float, float, int, bool]] = {}
    for left, right, level, partial in bars:
        for n in range(int(left / size), max(int(left / size) + 1, int((right - 1e-9) / size) + 1)):
            _, _, worst, any_partial = merged.get(n, (0.0, 0.0, 0, False))
            merged[n] = (n * size, (n + 1) * size, max(worst, level), any_partial or partial)
    return [merged[n] for n in sorted(merged)]


def level_colours(count: int) -> list[tuple[str, str]]:
    """Return a colour for each of so many results, from the best to the worst, and that of legible letters on it."""
    stops = [tuple(int(stop[i : i + 2], 16) for i in (1, 3, 5)) for stop in _STOPS]
    colours = []
    for n in range(count):
        place = n * (len(stops) - 1) / max(count - 1, 1)
        k = min(int(place), len(stops) - 2)
        parts = [round(a + (b - a) * (place - k)) for a, b in zip(stops[k], stops[k + 1], strict=True)]
        colour = "#{:02x}{:02x}{:02x}".format(*parts)
        colours.append((colour, max(_LETTERS, key=lambda letters: _contrast(colour, letters))))
    return colours


def _contrast(colour: str, other: str) -> float:
    """Return the contrast of two colours, by WCAG."""
    dark, light = sorted((luminance(colour), luminance(other)))
    return (light + 0.05) / (dark + 0.05)


def luminance(colour: str) -> float:
    """Return the relative luminance of a colour, by WCAG."""
    parts = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    red, green, blue = (part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def excess(row: Row) -> float:
    """Return the value that decided as a multiple of its limit; 0 without a limit."""
    return float(row["value"] / row["limit_reached"]) if row["limit_reached"] and row["value"] is not None else 0.0


def count_results(scheme: Row, rows: Sequence[Row]) -> list[tuple[str, int, int]]:
    """Return each result of a scheme, from the best to the worst, with its level and the number of elements."""
    counts = Counter(row["result"] for row in rows)
    return [(result, level, counts[result]) for level, result in enumerate(scheme["results"], start=1)]


def rate_stretch(
    conn: psycopg.Connection[Any], survey: Survey, elements: str, scheme: Row, low: float, high: float
) -> tuple[list[Row], int]:
    """Return the rating of the elements that touch a stretch, m, and the number of the others."""
    rows = rate(conn, survey.name, elements, scheme["name"], scheme["version"])
    inside = [row for row in rows if row["chainage_to"] > low and row["chainage_from"] < high]
    return inside, len(rows) - len(inside)


def read_rating(
    conn: psycopg.Connection[Any], survey: Survey, low: float, high: float, number: int, asked: RatingRequest
) -> Rating:
    """Rate the elements of a stretch, m.

    Raises
    ------
    UserError
        If there is no such scheme, or the tunnel has no such elements.
    """
    scheme, rules = scheme_rules(conn, asked.scheme, asked.version)
    rows, outside = rate_stretch(conn, survey, asked.elements, scheme, low, high)
    texts = {rule["number"]: rule["text"] for rule in rules if rule["by_measure"] is None and not scheme["totals"]}
    places = ticks(low, high, step_for(high - low, 10))
    ends = [row[end] for row in rows for end in ("chainage_from", "chainage_to")]
    labels = [text.short(label) for label in data.label_chainages(conn, survey, [*ends, *places])]
    for n, row in enumerate(rows):
        row["place"] = f"{labels[2 * n]}{text.DASH}{labels[2 * n + 1]}"
        row["rule_text"] = texts.get(row["rule"], row["why"])
    scale = 1000.0 / (high - low)
    marks = [((place - low) * scale, label) for place, label in zip(places, labels[len(ends) :], strict=True)]
    return Rating(number, scheme, asked.elements, rows, outside, low, high, marks)


@dataclass(frozen=True)
class Difference:
    """Ratings of the same elements by several schemes.

    Attributes
    ----------
    ratings : list of Rating
    rows : list of list of dict
        Elements with different places of the results in their schemes, from 0 (best) to 1 (worst), the greatest difference
        first: the row of each rating.
    """

    ratings: list[Rating]
    rows: list[list[Row]]


def differences(ratings: Sequence[Rating]) -> list[Difference]:
    """Compare the ratings that have the same elements."""
    by_elements: dict[str, list[Rating]] = {}
    for one in ratings:
        by_elements.setdefault(one.elements, []).append(one)
    return [_compare(group) for group in by_elements.values() if len(group) > 1]


def _compare(ratings: list[Rating]) -> Difference:
    found = []
    for rows in zip(*(one.rows for one in ratings), strict=True):
        places = [
            (row["level"] - 1) / max(len(one.scheme["results"]) - 1, 1)
            for row, one in zip(rows, ratings, strict=True)
            if row["level"] is not None
        ]
        spread = max(places, default=0.0) - min(places, default=0.0)
        if spread > 1e-9:
            found.append((-round(spread, 9), rows[0]["number"], list(rows)))
    return Difference(ratings, [rows for *_, rows in sorted(found, key=lambda one: one[:2])])


def measured(value: float | None, measure: str | None) -> str:
    """Return a value or a limit of a rule with its unit, to 4 significant digits; a share in per cent."""
    if value is None or measure is None:
        return text.DASH
    if measure == "share":
        return f"{100 * value:.4g} %"
    return f"{value:.4g} {MEASURES.get(measure, '')}".rstrip()


def result_text(words: Words, row: Row) -> str:
    """Return a result in the language of the report; a lower bound is marked."""
    if row["result"] is None:
        return words("not rated")
    return row["result"] if row["complete"] else words("at least {result}", result=row["result"])


def name_elements(words: Words, rows: Sequence[Row]) -> str:
    """Return the number of elements, and their names if they are few."""
    count = words.count("{count} elements", len(rows))
    return f"{count} ({', '.join(row['name'] for row in rows)})" if len(rows) <= NAMED else count


def headline(words: Words, rating: Rating, template: str | None) -> str:
    """Return the headline of a rating, in the owner's words if there are any."""
    names = {"scheme": rating.scheme["name"], "version": rating.scheme["version"]}
    if rating.worst is None:
        return words("No result by {scheme} {version}: nothing was inspected.", **names)
    names["result"] = result_text(words, rating.worst)
    return template.format(**names) if template else words("Worst result by {scheme} {version}: {result}", **names)


def digest_ratings(digest: hashlib._Hash, ratings: Sequence[Rating]) -> None:
    """Add the reported ratings."""
    for one in ratings:
        digest.update(repr((one.scheme["name"], one.scheme["version"], one.elements)).encode())
        for row in one.rows:
            digest.update(repr((row["number"], row["name"], row["result"], row["complete"], row["finding_id"])).encode())
