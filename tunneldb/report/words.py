"""The language of a report's headings, labels and short statements: English as written, or as a catalogue translates it."""

from __future__ import annotations

import datetime as dt
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib.resources import files
from typing import Any

from tunneldb.report import text

ENGLISH = "en"
_FOLDER = files("tunneldb.report") / "languages"


@dataclass(frozen=True)
class Words:
    """Texts of a report for each English text.

    Attributes
    ----------
    language : str
        Its code, as ``de``.
    texts : mapping of str to str
        By the English text; missing ones stay English.
    date : str or None
        Date format for ``strftime``; None for 4 May 2024.
    """

    language: str = ENGLISH
    texts: Mapping[str, str] = field(default_factory=dict)
    date: str | None = None

    def __call__(self, english: str, **values: Any) -> str:
        """Return a text in this language, values put in for the names in braces."""
        translation = self.texts.get(english, english)
        return translation.format(**values) if values else translation

    def day(self, date: dt.date) -> str:
        """Return a day as it is written in this language."""
        return date.strftime(self.date) if self.date else text.day(date)


def languages() -> list[str]:
    """Return the codes of the available languages."""
    return sorted(entry.name.removesuffix(".toml") for entry in _FOLDER.iterdir() if entry.name.endswith(".toml"))


def read_language(code: str) -> dict[str, Any]:
    """Read a catalogue: ``date``, how days are written, and ``texts`` by the English ones."""
    return tomllib.loads((_FOLDER / f"{code}.toml").read_text("utf-8"))


def known_texts() -> frozenset[str]:
    """Return all translatable texts: those of the English catalogue."""
    return frozenset(read_language(ENGLISH)["texts"])
