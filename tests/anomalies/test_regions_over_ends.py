"""Wet regions that the end of a kilometre cuts: put together, they are what they were."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tunneldb.anomalies.background.contrast import ContrastImage
from tunneldb.anomalies.detect import classify_region
from tunneldb.anomalies.features import FEATURES
from tunneldb.anomalies.records import Anomaly
from tunneldb.anomalies.regions import Region, RegionProperties, find_regions, merge_regions, touching_groups
from tunneldb.raster.geotiff import NODATA
from tunneldb.raster.grid import Grid

PIXEL = 0.5  # 2000 columns a kilometre
DRY = 1.25


def cut_by_kilometre(mask: np.ndarray, level: np.ndarray, first: int, bottom: int) -> list[tuple[int, Region]]:
    """Regions of a mask whose first column has a number, kilometre by kilometre, each on a grid of its own height."""
    found = []
    for km in range(first // 2000, (first + mask.shape[1] - 1) // 2000 + 1):
        # Neighbours' images reach to other arcs; all go on beyond the mask, as they do beyond the walls.
        grid = Grid(km, PIXEL, bottom - km % 3 - 1, len(mask) + km % 3 + km % 2 + 2, halo=30)
        wet = np.zeros((grid.rows, grid.columns), bool)
        levels = np.full(wet.shape, NODATA, np.int16)
        begin, stop = max(first, grid.first_column), min(first + mask.shape[1], grid.first_column + grid.columns)
        here, there = (
            np.s_[km % 2 + 1 : km % 2 + 1 + len(mask), begin - grid.first_column : stop - grid.first_column],
            np.s_[:, begin - first : stop - first],
        )
        wet[here], levels[here] = mask[there], level[there]
        drop = np.where(levels == NODATA, NODATA, 100 * DRY - levels).astype(np.int16)
        sigma = np.full((len(wet), grid.columns), 0.25, np.float32)
        contrast = ContrastImage(grid, (drop != NODATA).astype(np.uint8), drop, 1, sigma)
        found += [(km, region) for region in find_regions(wet, wet, contrast, 0.0, lambda _: True)]
    return found


def leaks(parts: list[Region], min_area: float) -> list[Anomaly]:
    united = [merge_regions([parts[k] for k in group]) for group in touching_groups(parts)]
    return [leak for region in united if (leak := classify_region(region, min_area)) is not None]


def assert_same(one: list[Anomaly], other: list[Anomaly]) -> None:
    assert len(one) == len(other)
    for a, b in zip(one, other, strict=True):
        assert a.outline.equals_exact(b.outline, 1e-9)
        assert (a.darkening_mean, a.darkening_max, a.image_share) == pytest.approx(
            (b.darkening_mean, b.darkening_max, b.image_share)
        )
        assert a.contrast == pytest.approx(b.contrast)
        # Which sides are sharp goes by the drop of each part; all other features are those of the whole.
        by_part = {"straight", "sharp", "rectangular_degree"}
        alike = [k for k, feature in enumerate(FEATURES) if feature.name not in by_part]
        assert a.verdict.features[alike] == pytest.approx(b.verdict.features[alike], nan_ok=True)


@settings(max_examples=60, deadline=None)
@given(
    mask=arrays(bool, st.tuples(st.integers(1, 12), st.integers(2, 40)), elements=st.booleans()),
    before=st.integers(0, 40),
    min_area=st.sampled_from([0.0, 1.0, 3.0]),
    seed=st.integers(0, 9),
)
def test_leaks_are_the_same_wherever_the_kilometre_ends(mask: np.ndarray, before: int, min_area: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    level = rng.integers(-300, 0, mask.shape).astype(np.int16)
    level[rng.random(mask.shape) < 0.2] = NODATA
    uncut = [region for _, region in cut_by_kilometre(mask, level, 7 * 2000 + 700, -5)]
    cut = [region for _, region in cut_by_kilometre(mask, level, 8 * 2000 - before, -5)]
    moved = [
        replace(region, column=region.column - 8 * 2000 + before + 7 * 2000 + 700)
        for region in rng.permutation(np.array(cut, dtype=object))
    ]
    assert_same(leaks(moved, min_area), leaks(uncut, min_area))
    assert sum(np.count_nonzero(region.mask) for region in cut) == mask.sum()


def test_a_leak_across_three_kilometres_is_one() -> None:
    mask = np.zeros((6, 3100), bool)
    mask[2:4, 40:3080] = True
    mask[3, 900:1200] = False
    mask[5, 1500:1503] = True  # beside it, not part of it
    level = np.full(mask.shape, -100, np.int16)
    found = cut_by_kilometre(mask, level, 5 * 2000 - 500, 3)
    assert [km for km, _ in found] == [4, 5, 5, 6]
    whole, speck = leaks([region for _, region in found], 0.0)
    assert whole.outline.bounds == (5000 - 250 + 20, 0.5 * (3 + 2), 5000 - 250 + 1540, 0.5 * (3 + 4))
    assert whole.outline.area == pytest.approx(0.25 * (mask.sum() - 3))
    assert whole.darkening_mean == pytest.approx(DRY + 1.0)
    assert speck.outline.area == pytest.approx(0.25 * 3)


def test_regions_that_touch_by_a_corner_or_have_other_pixels_stay_apart() -> None:
    def part(column: int, row: int, pixel: float = PIXEL) -> Region:
        return Region(pixel, column, row, np.ones((2, 3), bool), 6, 1.0, 1.0, RegionProperties())

    assert touching_groups([part(0, 0), part(3, 1)]) == [[0, 1]]
    assert touching_groups([part(3, 1), part(0, 0)]) == [[1, 0]]
    assert touching_groups([part(0, 0), part(3, 2)]) == [[0], [1]]
    assert touching_groups([part(0, 0), part(4, 0)]) == [[0], [1]]
    assert touching_groups([part(0, 0), part(3, 1, 0.25)]) == [[0], [1]]
