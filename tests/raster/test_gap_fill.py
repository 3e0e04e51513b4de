"""Gaps between profiles, filled in what is only looked at."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from tunneldb.raster.gap_fill import fill_blocks, fill_gaps

Single = np.ndarray[tuple[int, ...], np.dtype[np.float32]]


def sparse(step: int, columns: int = 95) -> Single:
    """Profiles a step apart, each with values of its own."""
    values = np.full((30, columns), np.nan, np.float32)
    values[:, 2::step] = np.random.default_rng(1).normal(size=(30, len(range(2, columns, step))))
    return values


def test_profiles_join_up_to_twice_the_reach_and_no_farther() -> None:
    near = fill_gaps(sparse(13), 6)
    assert np.isfinite(near[:, : 2 + 6 * 13 + 7]).all()
    assert np.isfinite(sparse(13)).mean() < 0.1
    far = fill_gaps(sparse(20), 6)
    assert np.isfinite(far[:, 2 + 6]).all()
    assert np.isnan(far[:, 2 + 7 : 2 + 14]).all()


def test_what_was_measured_stays_and_the_rest_is_the_nearest_profile() -> None:
    values = sparse(13)
    filled = fill_gaps(values, 6)
    held = np.isfinite(values)
    assert (filled[held] == values[held]).all()
    assert (filled[:, 2 + 13 - 6 : 2 + 13 + 7] == values[:, [2 + 13]]).all()


@pytest.mark.parametrize("step", [5, 13, 40])
def test_blocks_are_filled_as_the_whole_is(step: int) -> None:
    whole = sparse(step)
    borders = [0, 20, 24, 60, 95]  # one block is narrower than the reach
    blocks = [(west, whole[:, west:east]) for west, east in pairwise(borders)]
    joined = list(fill_blocks(iter(blocks), 4))
    assert [column for column, _ in joined] == borders[:-1]
    assert np.array_equal(np.concatenate([values for _, values in joined], axis=1), fill_gaps(whole, 4), equal_nan=True)


def test_blocks_that_do_not_touch_fill_nothing_in_each_other() -> None:
    empty, full = np.full((3, 10), np.nan, np.float32), np.ones((3, 10), np.float32)
    (_, apart), _ = fill_blocks([(0, empty), (20, full)], 4)
    (_, beside), _ = fill_blocks([(10, empty), (20, full)], 4)
    assert np.isnan(apart).all()
    assert np.isfinite(beside).all(axis=0).tolist() == [False] * 6 + [True] * 4
    assert list(fill_blocks([], 4)) == []
