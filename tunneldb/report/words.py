"""The language of a report's headings, labels and short statements: English as written, or as a catalogue translates it."""

from __future__ import annotations

import datetime as dt
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from gettext import c2py
from importlib.resources import files
from typing import Any

from tunneldb.report import text

ENGLISH = "en"
_FOLDER = files("tunneldb.report") / "languages"

Texts = Mapping[str, str | list[str]]
"""Translations by English text; a list has the plural forms of a text with a count."""

ENGLISH_PLURAL = "n != 1"
"""Number of the plural form of a count ``n``, as an expression in gettext's notation."""

HIGHEST_TRIED = 1000
"""Counts up to which the forms of a plural expression are tried; all known rules repeat after 100."""


def languages() -> list[str]:
    """Return the codes of the available languages."""
    return sorted(entry.name.removesuffix(".toml") for entry in _FOLDER.iterdir() if entry.name.endswith(".toml"))


def read_language(code: str) -> dict[str, Any]:
    """Read a catalogue: ``date``, how days are written, ``plural``, and ``texts`` by the English ones."""
    return tomllib.loads((_FOLDER / f"{code}.toml").read_text("utf-8"))


@cache
def english_texts() -> Texts:
    """Return all translatable texts: those of the English catalogue."""
    texts: Texts = read_language(ENGLISH)["texts"]
    return texts


@dataclass(frozen=True)
class Words:
    """Texts of a report for each English text.

    Attributes
    ----------
    language : str
        Its code, as ``de``.
    texts : mapping of str to str or list of str
        By the English text; missing ones stay English.
    date : str or None
        Date format for ``strftime``; None for 4 May 2024.
    plural : str
        Number of the plural form of a count ``n``, in gettext's notation.
    """

    language: str = ENGLISH
    texts: Texts = field(default_factory=english_texts)
    date: str | None = None
    plural: str = ENGLISH_PLURAL

    def __call__(self, english: str, **values: Any) -> str:
        """Return a text in this language, values put in for the names in braces."""
        translation = self.texts.get(english, english)
        if not isinstance(translation, str):
            raise TypeError(f"{english!r} has plural forms: use count()")
        return translation.format(**values) if values else translation

    def count(self, english: str, count: int, **values: Any) -> str:
        """Return a text in the plural form of a count, which is put in for ``{count}``."""
        if english in self.texts:
            translation = self.texts[english][c2py(self.plural)(count)]
        else:
            translation = english_texts()[english][c2py(ENGLISH_PLURAL)(count)]
        return translation.format(count=text.whole(count), **values)

    def other_than_english(self) -> dict[str, str]:
        """Return the texts without plural forms that differ from the English ones."""
        return {
            english: translation
            for english, translation in self.texts.items()
            if isinstance(translation, str) and translation != english
        }

    def day(self, date: dt.date) -> str:
        """Return a day as it is written in this language."""
        return date.strftime(self.date) if self.date else text.day(date)


def plural_forms(plural: str) -> int:
    """Return the number of plural forms of an expression in gettext's notation.

    Raises
    ------
    ValueError
        If it is not such an expression.
    """
    number = c2py(plural)
    try:
        forms = {number(count) for count in range(HIGHEST_TRIED)}
    except ZeroDivisionError as error:
        raise ValueError(str(error)) from error
    if forms != set(range(len(forms))):
        raise ValueError(f"the numbers of its forms are {sorted(forms)}")
    return len(forms)
