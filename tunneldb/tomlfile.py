"""TOML files that people write: templates and rating schemes."""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

from tunneldb.errors import InputError, did_you_mean
from tunneldb.files import require_at_most

MAX_MEGABYTES = 1
"""Maximum size of a file, MB."""

_DEEP = re.compile(r"(?:[\[{]\s*){100}")
"""Lists in each other, deeper than any settings need."""


def read_toml(path: Path, what: str) -> dict[str, Any]:
    """Read a TOML file.

    Parameters
    ----------
    path : Path
    what : str
        What the file is, with its article, for the error of one that is too large.

    Raises
    ------
    InputError
        If it cannot be read, is larger than MAX_MEGABYTES, or is not TOML.
    """
    try:
        require_at_most(path, MAX_MEGABYTES, what)
        text = path.read_text("utf-8-sig")
        # Else the parser would use up the stack, and what is collected meanwhile would fail in its finalizer.
        if _DEEP.search(text):
            raise RecursionError
        return tomllib.loads(text)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: is not TOML: {error}") from error
    except RecursionError:
        raise InputError(f"{path}: its lists are nested too deep") from None


@dataclass(frozen=True)
class TomlTable:
    """Table of a TOML file; errors are reported with the file, the place in it and the key.

    Attributes
    ----------
    path : Path
    values : dict
    place : str
        Place of the table in the file, as ``rule 2: ``; empty for the whole file.
    """

    path: Path
    values: dict[str, Any]
    place: str = ""

    def refuse(self, key: str, reason: str) -> NoReturn:
        """Raise InputError for a key."""
        raise InputError(f"{self.path}: {self.place}{key}: {reason}")

    def refuse_others(self, known: tuple[str, ...]) -> None:
        """Raise InputError for a key that is not known."""
        for key in self.values:
            if key not in known:
                self.refuse(key, f"there is no such key{did_you_mean(key, known)}; there are {', '.join(known)}")
