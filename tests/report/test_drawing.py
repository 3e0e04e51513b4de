"""Drawings of the report."""

from __future__ import annotations

import pytest

from tunneldb.report.drawing import ticks


@pytest.mark.parametrize(
    ("low", "high", "there"),
    [
        (12300.0, 12330.0, [12300.0, 12310.0, 12320.0, 12330.0]),
        (12300.0004, 12329.9996, [12300.0, 12310.0, 12320.0, 12330.0]),  # a survey's first point lies where it lies
        (12300.004, 12329.996, [12310.0, 12320.0]),
        (-15.0, 5.0, [-10.0, 0.0]),
    ],
)
def test_ticks_lie_within_the_stretch_to_the_millimetre(low: float, high: float, there: list[float]) -> None:
    assert ticks(low, high, 10.0) == there
