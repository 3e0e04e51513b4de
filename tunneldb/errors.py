"""The error that is the user's to mend, and what a mistyped word may have meant."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class UserError(Exception):
    """Bad input or a missing thing that the user can put right.

    The message is one clear line: what is wrong, where (file, line, value) and what to do. The command line
    prints it without a traceback and exits with code 2; every other exception is a bug and keeps its traceback.
    """


class BusyError(UserError):
    """Another process is at work on the same survey or kilometre."""


def did_you_mean(word: str, words: Iterable[str]) -> str:
    """Ask for the one of some words that another is closest to, as `` Did you mean 'leaks'?``; empty where none is close."""
    close = difflib.get_close_matches(word, list(words), n=1)
    return f" Did you mean {close[0]!r}?" if close else ""
