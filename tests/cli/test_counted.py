"""Counts in messages: one thing in the singular."""

from __future__ import annotations

from tunneldb.counted import counted


def test_counts_have_singular_and_plural() -> None:
    assert [counted(n, "point") for n in (0, 1, 2, 12345)] == ["0 points", "1 point", "2 points", "12 345 points"]
    assert [counted(n, "axis vertex", "axis vertices") for n in (1, 2)] == ["1 axis vertex", "2 axis vertices"]
