"""TOML files that people write: templates and rating schemes."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

from tunneldb.errors import InputError
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
