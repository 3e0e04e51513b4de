"""Errors that the user can fix, and suggestions for mistyped words."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class UserError(Exception):
    """Invalid input or missing prerequisite that the user can fix.

    The message is one line: what is wrong, where (file, line, value) and what to do. The command line prints it without
    a traceback and exits with code 2; every other exception is a bug and keeps its traceback.
    """


class InputError(UserError):
    """Unreadable or invalid input: a file, a value, a name."""


class NotReadyError(UserError):
    """Missing or stale result that the request needs: a stage was not run, or must be run again."""


class BusyError(UserError):
    """Another process is at work on the same survey or kilometre."""


def did_you_mean(word: str, words: Iterable[str]) -> str:
    """Return a question with the closest word, as `` Did you mean 'leaks'?``; empty if no word is close."""
    close = difflib.get_close_matches(word, list(words), n=1)
    return f" Did you mean {close[0]!r}?" if close else ""
