"""An owner's template of the report: a small TOML file with logo, client, language, headline, ratings, chapters, colours."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tunneldb.finding_kind import SEVERITY_COLOURS
from tunneldb.report.pictures.load import Source, load_pictures
from tunneldb.report.words import ENGLISH, ENGLISH_PLURAL, Words, english_texts, languages, plural_forms, read_language
from tunneldb.tomlfile import TomlTable, read_toml

CHAPTERS = {
    "summary": "Summary",
    "rating": "Rating",
    "actions": "Actions",
    "seen": "Inspected lining",
    "classes": "Waterproofing",
    "lining": "Lining",
    "imported": "Other instruments",
    "sections": "Cross-sections",
    "leaks": "Leaks",
    "statistics": "Statistics",
    "findings": "Findings",
    "dry": "Dry regions",
    "structures": "Structures",
    "underwater": "Under water",
    "clearance": "Clearance",
    "rings": "Rings",
    "change": "What changed",
    "deviation": "Design and deviation",
    "methods": "Methods",
    "reviews": "Reviews",
    "signatures": "Signatures",
}
"""Chapters in their default order: names, and titles in the navigation."""

STANDARDS = ("GB 50108-2008",)
"""Standards of waterproofing whose classes the program computes: the only ones that a report names by itself."""

HEADLINES = ("facts", "rating", "waterproofing", "none")
"""Headlines: leaks, wet area, inspected share and what could be found; worst result of a rating; class of waterproofing."""

HEADLINE_NAMES = ("{result}", "{scheme}", "{version}")
"""Names in braces of the owner's text of the headline."""

_COLOUR = re.compile(r"#[0-9a-fA-F]{6}")
_NAME = re.compile(r"\{\w+\}")
_DAY_CODE = re.compile(r"%(?:-?[dejmUuVWwGgyY]|[aAbBCDFhx%])")


@dataclass(frozen=True)
class RatingRequest:
    """Rating that a report states.

    Attributes
    ----------
    scheme : str
        Name of the scheme.
    version : str or None
        Its version; None for the one added last.
    elements : str
        Name of the division of the tunnel into elements.
    """

    scheme: str
    version: str | None
    elements: str


@dataclass(frozen=True)
class Owner:
    """Owner's settings of the report.

    Attributes
    ----------
    words : Words
        The language of its headings.
    client, project : str or None
        Client and project.
    headline : str
        One of HEADLINES.
    headline_text : str or None
        Text of the headline of a rating, with HEADLINE_NAMES; None for the program's.
    ratings : tuple of RatingRequest
        Ratings by the owner's schemes; the first is that of the headline.
    waterproofing : str or None
        Standard of STANDARDS whose classes are stated; None for a report without a class.
    logo : str or None
        The owner's, as a data URL.
    chapters : tuple of str
        Names of those wanted, in order.
    colours : dict of int to str
        Colours of severities, as #rrggbb.
    """

    words: Words = field(default_factory=Words)
    client: str | None = None
    project: str | None = None
    headline: str = HEADLINES[0]
    headline_text: str | None = None
    ratings: tuple[RatingRequest, ...] = ()
    waterproofing: str | None = None
    logo: str | None = None
    chapters: tuple[str, ...] = tuple(CHAPTERS)
    colours: Mapping[int, str] = field(default_factory=lambda: SEVERITY_COLOURS)


_KEYS = (
    "logo", "client", "project", "headline", "headline_text", "rating", "waterproofing", "language", "chapters", "headings",
    "severity_colours",
)  # fmt: skip
_RATING_KEYS = ("scheme", "version", "elements")


def read_owner(path: Path) -> Owner:
    """Read an owner's template.

    Raises
    ------
    InputError
        If it cannot be read, or something in it is wrong: with file, key and value.
    """
    given = _Given(path, read_toml(path, "a template"))
    given.refuse_others(_KEYS)
    logo, waterproofing, ratings = given.text("logo"), _waterproofing(given), _ratings(given)
    headline = _headline(given, ratings, waterproofing)
    return Owner(
        words=_words(given),
        client=given.text("client"),
        project=given.text("project"),
        headline=headline,
        headline_text=_headline_text(given, headline),
        ratings=ratings,
        waterproofing=waterproofing,
        logo=None if logo is None else _logo(given, path.parent / logo),
        chapters=_chapters(given, ratings, waterproofing),
        colours=_colours(given),
    )


class _Given(TomlTable):
    """Settings of a template."""

    def text(self, key: str) -> str | None:
        value = self.values.get(key)
        if value is not None and (not isinstance(value, str) or not value.strip()):
            self.refuse(key, f"must be a text, not {value!r}")
        return value

    def day_format(self, key: str) -> str | None:
        """Return the date format; unknown codes, which ``strftime`` would print unchanged, are refused."""
        value = self.text(key)
        stray = value and re.search(r"%.?", _DAY_CODE.sub("", value), re.DOTALL)
        if stray:
            self.refuse(key, f"{stray.group()!r} in {value!r} is no part of a day as strftime has it, such as %d, %m, %B, %Y")
        return value

    def table(self, key: str) -> dict[str, Any]:
        value = self.values.get(key, {})
        if not isinstance(value, dict):
            self.refuse(key, f"must be a table of texts, not {value!r}")
        return value

    def plural(self, key: str) -> str:
        """Return the expression of plural forms; English's if there is none."""
        value = self.text(key) or ENGLISH_PLURAL
        try:
            plural_forms(value)
        except ValueError as error:
            self.refuse(key, f'{value!r} is not a plural expression of gettext, such as "{ENGLISH_PLURAL}": {error}')
        return value

    def texts(self, key: str, plural: str) -> dict[str, str | list[str]]:
        """Return a table of translations; each must have the names in braces of the English text, and all plural forms."""
        table, known, forms = self.table(key), english_texts(), plural_forms(plural)
        for english, translation in table.items():
            place = f"{key}.{english!r}"
            if english not in known:
                self.refuse(place, "unknown heading; all are in languages/en.toml of the package")
            if isinstance(known[english], str):
                self.refuse_text(place, translation, english)
                continue
            if not isinstance(translation, list) or len(translation) != forms:
                self.refuse(place, f"must be a list of {forms} texts, the plural forms by {plural!r}, not {translation!r}")
            for form in translation:
                self.refuse_text(place, form, english)
        return table

    def refuse_text(self, place: str, translation: Any, english: str) -> None:
        """Refuse a translation that is no text or has other names in braces; a plural form may omit the count."""
        if not isinstance(translation, str):
            self.refuse(place, f"must be a text, not {translation!r}")
        stray = re.search(r"[{}]", _NAME.sub("", translation))
        names, wanted = set(_NAME.findall(translation)), set(_NAME.findall(english))
        if stray or names - wanted or wanted - names - ({"{count}"} if isinstance(english_texts()[english], list) else set()):
            self.refuse(place, f"{translation!r} has other names in braces")


def _words(given: _Given) -> Words:
    name = given.text("language") or ENGLISH
    if name.endswith(".toml"):
        path = given.path.parent / name
        own = _Given(path, read_toml(path, "a template"))
        own.refuse_others(("date", "plural", "texts"))
        code, date, plural = path.stem, own.day_format("date"), own.plural("plural")
        texts = own.texts("texts", plural)
    elif name in languages():
        catalogue = read_language(name)
        code, date, plural, texts = name, catalogue.get("date"), catalogue["plural"], catalogue["texts"]
    else:
        given.refuse("language", f"{name!r} is none of {', '.join(languages())}, nor a .toml file of texts")
    return Words(code, texts | given.texts("headings", plural), date, plural)


def _waterproofing(given: _Given) -> str | None:
    standard = given.text("waterproofing")
    if standard is not None and standard not in STANDARDS:
        given.refuse(
            "waterproofing",
            f"there are no classes of {standard!r}; leave it out, or choose {' or '.join(STANDARDS)}; for limits of your own"
            " write [[rating]]",
        )
    return standard


def _ratings(given: _Given) -> tuple[RatingRequest, ...]:
    """Return the ratings: a table ``[rating]``, or several ``[[rating]]``."""
    tables = given.values.get("rating", [])
    tables = [tables] if isinstance(tables, dict) else tables
    if not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables):
        given.refuse("rating", f"must be a table [rating] or several [[rating]], not {tables!r}")
    ratings = []
    for number, table in enumerate(tables, start=1):
        one = _Given(given.path, table, f"rating {number}: ")
        one.refuse_others(_RATING_KEYS)
        scheme, version, elements = (one.text(key) for key in _RATING_KEYS)
        if scheme is None:
            one.refuse("scheme", "is missing: the name of a scheme (tunneldb rating list)")
        if elements is None:
            one.refuse("elements", "is missing: the name of a division of the tunnel (tunneldb elements list)")
        ratings.append(RatingRequest(scheme, version, elements))
    return tuple(ratings)


def _headline(given: _Given, ratings: tuple[RatingRequest, ...], waterproofing: str | None) -> str:
    headline = given.text("headline") or HEADLINES[0]
    if headline not in HEADLINES:
        given.refuse("headline", f"{headline!r} is none of {', '.join(HEADLINES)}")
    if headline == "rating" and not ratings:
        given.refuse("headline", "'rating' needs a table [rating] with scheme and elements")
    if headline == "waterproofing" and waterproofing is None:
        given.refuse("headline", f"'waterproofing' needs a standard: waterproofing = \"{STANDARDS[0]}\"")
    return headline


def _headline_text(given: _Given, headline: str) -> str | None:
    value = given.text("headline_text")
    if value is None:
        return None
    if headline != "rating":
        given.refuse("headline_text", 'needs headline = "rating"')
    names = set(_NAME.findall(value))
    if re.search(r"[{}]", _NAME.sub("", value)) or names - set(HEADLINE_NAMES) or "{result}" not in names:
        given.refuse(
            "headline_text", f"{value!r} must contain {{result}}, and no other braces than {', '.join(HEADLINE_NAMES)}"
        )
    return value


def _chapters(given: _Given, ratings: tuple[RatingRequest, ...], waterproofing: str | None) -> tuple[str, ...]:
    chapters = given.values.get("chapters", list(CHAPTERS))
    if not isinstance(chapters, list) or not chapters:
        given.refuse("chapters", f"must be a list of names, not {chapters!r}")
    for name in chapters:
        if not isinstance(name, str) or name not in CHAPTERS:
            given.refuse("chapters", f"unknown chapter {name!r}; known are {', '.join(CHAPTERS)}")
        if chapters.count(name) > 1:
            given.refuse("chapters", f"{name!r} occurs {chapters.count(name)} times")
    if waterproofing is None and "classes" in given.values.get("chapters", []):
        given.refuse("chapters", f"'classes' needs a standard: waterproofing = \"{STANDARDS[0]}\"")
    if not ratings and "rating" in given.values.get("chapters", []):
        given.refuse("chapters", "'rating' needs a table [rating] with scheme and elements")
    return tuple(chapters)


def _colours(given: _Given) -> dict[int, str]:
    colours = given.table("severity_colours")
    for name, colour in colours.items():
        if not isinstance(colour, str):
            given.refuse(f"severity_colours.{name}", f"must be a text, not {colour!r}")
        if name not in ("1", "2", "3", "4"):
            given.refuse(f"severity_colours.{name}", "severities are 1 to 4")
        if not _COLOUR.fullmatch(colour):
            given.refuse(f"severity_colours.{name}", f"must be a colour such as #b8371d, not {colour!r}")
    return SEVERITY_COLOURS | {int(name): colour for name, colour in colours.items()}


def _logo(given: _Given, path: Path) -> str:
    """Return a logo as a data URL, reduced if larger than a cover needs."""
    if not path.is_file():
        given.refuse("logo", f"no file {path}")
    (picture,) = load_pictures([str(path)], Source(path.parent, confined=False), "logo").values()
    if picture.trouble:
        given.refuse("logo", f"{path}: {picture.trouble}; a logo is a PNG, JPEG, WebP, GIF, TIFF or BMP of up to 50 megapixels")
    return picture.url
