"""Synthetic leaks that are injected into images."""

from __future__ import annotations

import numpy as np
import pytest

from tunneldb.anomalies.detectability.synthetic import AREAS, draw_leak


@pytest.mark.parametrize("pixel", [0.02, 0.08])
def test_areas_and_darkening_span_what_is_asked(pixel: float) -> None:
    rng = np.random.default_rng(5)
    leaks = [draw_leak(rng, pixel, downward=True) for _ in range(200)]
    area = np.array([np.count_nonzero(leak.wet) * pixel**2 for leak in leaks])
    low, high = AREAS
    assert area.min() >= 0.8 * low
    assert area.max() <= 1.05 * high
    assert np.quantile(np.log(area), [0.25, 0.5, 0.75]) == pytest.approx(
        np.log(low) + np.array([0.25, 0.5, 0.75]) * np.log(high / low), abs=0.4
    )
    for leak in leaks:
        assert leak.darkening[leak.wet].mean() == pytest.approx(leak.drop)
        assert leak.darkening[~leak.wet].mean() < 0.5 * leak.drop
        rows, columns = np.nonzero(leak.wet)
        size = len(leak.wet) - 1
        assert min(rows.min(), columns.min()) > 0
        assert max(rows.max(), columns.max()) < size


def test_streaks_run_downward() -> None:
    """Leaks drawn for either direction from the same numbers are mirrored in their streaks alone: the lower half is longer."""
    reach = {}
    for downward in (True, False):
        rng = np.random.default_rng(1)
        leaks = [draw_leak(rng, 0.02, downward=downward) for _ in range(100)]
        middle = [len(leak.wet) // 2 for leak in leaks]
        rows = [np.flatnonzero(leak.wet.any(axis=1)) for leak in leaks]
        reach[downward] = np.mean([one.max() + one.min() - 2 * half for one, half in zip(rows, middle, strict=True)])
    assert reach[True] > 0 > reach[False]
