"""Statement on where leaks could be missed, in the language of the report."""

from __future__ import annotations

import re
from collections.abc import Sequence

from tunneldb.report.text import percent
from tunneldb.report.words import ENGLISH, Words
from tunneldb.store.coverage import Coverage, CoverageGap

MAX_STRETCHES = 6
"""Maximum number of named stretches of each kind, as in ``tunnel_api.coverage_statement``."""


def gaps_statement(words: Words, search: Coverage) -> str | None:
    """Return the statement; in English that of ``tunnel_api.coverage_statement``. None if there are no gaps."""
    if search.statement is None or words.language == ENGLISH:
        return search.statement
    parts = []
    for searched, template in ((False, "Not searched for leaks: {stretches}"), (True, "Searched, with gaps: {stretches}")):
        gaps = sorted((gap for gap in search.gaps if gap.searched == searched), key=lambda gap: gap.chainage_from)
        if gaps:
            parts.append(words(template, stretches=_stretches(words, gaps)))
    return "; ".join(parts)


def _stretches(words: Words, gaps: Sequence[CoverageGap]) -> str:
    named = [_stretch(words, gap) for gap in gaps[:MAX_STRETCHES]]
    if len(gaps) > MAX_STRETCHES:
        named.append(words("and {count} more", count=len(gaps) - MAX_STRETCHES))
    return ", ".join(named)


def _stretch(words: Words, gap: CoverageGap) -> str:
    place = "–".join(re.sub(r"\.0+$", "", label) for label in (gap.label_from, gap.label_to))
    state = words(gap.state)
    if gap.seen_share is not None:
        share = words("{share} of the lining inspected", share=percent(gap.seen_share, 0))
        state += f", {share}"
    return f"{place} ({state})"
