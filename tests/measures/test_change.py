"""Change of a round lining between two epochs, against what was put in."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from support.curved_lining import made

from tunneldb.measures.change.compute.cells import CellGrid, Cells, CellSums, rounding_variance, with_hollows, without_edges
from tunneldb.measures.change.compute.change import change_regions, significant
from tunneldb.measures.change.compute.leaks import Leak, groups, state_of, wet_area
from tunneldb.measures.change.compute.sections import Change, measure_change, section_figures
from tunneldb.measures.change.measure import rings_apart

pytestmark = pytest.mark.slow

RADIUS, LENGTH, PIXEL, NOISE = 4.0, 60.0, 0.02, 0.003
GRID = CellGrid(0.1, 60.0, -9.0, 600, 180)


def places() -> tuple[np.ndarray, np.ndarray]:
    west, pixels = GRID.west, (round(LENGTH / PIXEL), 900)
    chainage, arc = np.meshgrid(west + (np.arange(pixels[0]) + 0.5) * PIXEL, -9.0 + (np.arange(pixels[1]) + 0.5) * PIXEL)
    return chainage.ravel(), arc.ravel()


def epoch(seed: int, change: np.ndarray | float = 0.0, shift: tuple[float, float] = (0.0, 0.0)) -> Cells:
    """Cells of a scan with noise, whose offsets are rounded to millimetres; all is shifted to the right and up, m."""
    chainage, arc = places()
    noise = np.random.default_rng(seed).normal(0.0, NOISE, len(arc))
    moved = -shift[0] * np.sin(arc / RADIUS) - shift[1] * np.cos(arc / RADIUS)
    sums = CellSums(GRID, PIXEL)
    sums.add(chainage, arc, np.round(noise + moved + change, 3), np.ones(len(arc), np.bool_))
    return sums.cells()


def changed(change: np.ndarray | float, shift: tuple[float, float]) -> Change:
    surface, _ = made(RADIUS, 200.0, 0.0, 0.0)
    return measure_change(surface, GRID, epoch(1), epoch(2, change, shift), 1.5, PIXEL)


def test_a_cell_is_a_plane_through_its_pixels_and_rounding_is_what_it_is() -> None:
    grid = CellGrid(0.1, 0.0, 0.0, 1, 1)
    x, y = (values.ravel() for values in np.meshgrid(*(np.linspace(0.01, 0.09, 5),) * 2))
    sums = CellSums(grid, PIXEL)
    held = x + y < 0.11  # less than a half: the plane goes on to the middle
    sums.add(x[held], y[held], 0.02 + 0.3 * (x - 0.05)[held] - 0.2 * (y - 0.05)[held], np.ones(held.sum(), np.bool_))
    cells = sums.cells()
    assert cells.offset[0, 0] == pytest.approx(0.02, abs=1e-6)
    assert cells.share[0, 0] == pytest.approx(held.sum() / 25)
    between = np.random.default_rng(1).uniform(0.0, 0.001, 200)
    for sigma in (0.0003, 0.0005):
        drawn = between[:, None] + np.random.default_rng(2).normal(0.0, sigma, (200, 20_000))
        bias = (np.round(drawn, 3) - drawn).mean(axis=1)
        assert rounding_variance(np.array(sigma**2)) == pytest.approx(np.mean(bias**2), rel=0.1, abs=1e-11)


def test_an_unchanged_lining_whose_pose_is_off_is_unchanged_and_its_level_of_detection_holds() -> None:
    found = changed(0.0, (0.02, -0.01))
    held = np.abs(found.difference) <= found.lod
    assert 0.93 < held[np.isfinite(found.difference)].mean() < 0.97
    assert change_regions(found.difference, found.variance, found.removed_error, found.scatter, found.place_error) == []
    motions = np.array([motion.values[:2] for _, motion in found.sections])
    errors = np.array([motion.errors[:2] for _, motion in found.sections])
    assert np.abs(motions - [0.02, -0.01]).max() < 2e-4
    assert np.mean(np.abs(motions - [0.02, -0.01]) < 1.96 * errors) > 0.85
    assert all(np.isnan(motion.values[3]) for _, motion in found.sections)  # a round lining does not show its roll


def test_a_lining_with_relief_whose_pose_is_off_along_itself_is_unchanged() -> None:
    def relief(chainage: np.ndarray, arc: np.ndarray) -> np.ndarray:
        return 0.012 * np.sin(2.0 * np.pi * chainage / 1.4) * np.sin(2.0 * np.pi * arc / 1.2)

    chainage, arc = places()
    surface, _ = made(RADIUS, 200.0, 0.0, 0.0)
    found = measure_change(
        surface, GRID, epoch(1, relief(chainage, arc)), epoch(2, relief(chainage - 0.02, arc - 0.01), (0.01, 0.01)), 1.5, PIXEL
    )
    held = np.abs(found.difference) <= found.lod
    assert 0.93 < held[np.isfinite(found.difference)].mean() < 0.97
    assert change_regions(found.difference, found.variance, found.removed_error, found.scatter, found.place_error) == []
    along = np.array([motion.values[2] for _, motion in found.sections])
    assert np.median(along) == pytest.approx(0.02, abs=2e-3)


def test_pixels_whose_points_lie_to_one_side_are_no_change_of_relief_and_a_bulge_on_it_is() -> None:
    def relief(chainage: np.ndarray, arc: np.ndarray) -> np.ndarray:
        return 0.06 * np.sin(2.0 * np.pi * chainage / 1.2) * np.sin(2.0 * np.pi * arc / 1.6)

    chainage, arc = places()
    surface, _ = made(RADIUS, 200.0, 0.0, 0.0)
    beside = np.zeros_like(chainage)
    for place in (70.2, 85.2, 100.2):  # half a slope of the relief long
        beside[(np.abs(chainage - place) < 0.3) & (np.abs(arc - 2.0) < 0.4)] = PIXEL / 2.0
    bulge = (np.abs(chainage - 92.0) < 0.5) & (np.abs(arc + 2.0) < 0.5)
    old, new = epoch(1, relief(chainage - beside, arc)), epoch(2, relief(chainage + beside, arc) + 0.003 * bulge)
    found = measure_change(surface, GRID, old, new, 1.5, PIXEL)
    (region,) = change_regions(found.difference, found.variance, found.removed_error, found.scatter, found.place_error)
    assert region.mean == pytest.approx(0.003, abs=4e-4)
    assert GRID.chainage[region.columns.astype(int)].mean() == pytest.approx(92.0, abs=0.1)


@pytest.mark.parametrize("filled", [False, True])
def test_a_hollow_deeper_than_lining_stands_back_is_a_region_and_a_niche_is_none(filled: bool) -> None:
    chainage, arc = places()
    spall = (chainage > 80.0) & (chainage < 80.6) & (arc > 2.0) & (arc < 2.5)
    niche = (chainage > 100.0) & (chainage < 102.0) & (arc > 3.0) & (arc < 5.0)
    epochs = []
    for seed, hollow in ((1, spall & filled), (2, spall & (not filled))):
        offset = np.random.default_rng(seed).normal(0.0, NOISE, len(arc)) - 0.05 * hollow - 0.4 * niche
        epochs.append(CellSums(GRID, PIXEL))
        epochs[-1].add(chainage, arc, np.round(offset, 3), ~(hollow | niche))
    surface, _ = made(RADIUS, 200.0, 0.0, 0.0)
    found = measure_change(surface, GRID, *(without_edges(cells) for cells in with_hollows(*epochs)), 1.5, PIXEL)
    (region,) = change_regions(found.difference, found.variance, found.removed_error, found.scatter, found.place_error)
    sign = 1.0 if filled else -1.0
    assert region.greatest == pytest.approx(sign * 0.05, abs=0.001)
    assert region.mean * len(region.rows) * GRID.cell**2 == pytest.approx(sign * 0.05 * 0.6 * 0.5, rel=0.03)
    inside = np.ix_((GRID.arc > 3.0) & (GRID.arc < 5.0), (GRID.chainage > 100.0) & (GRID.chainage < 102.0))
    assert np.isnan(found.difference[inside]).all()


@pytest.mark.parametrize(("kind", "mean", "area"), [("bulge", 0.003, 1.0), ("wall", 0.005, 30.0 * 4.0), ("ring", 0.002, None)])
def test_what_moved_is_found_and_nothing_else(kind: str, mean: float, area: float | None) -> None:
    chainage, arc = places()
    where = {
        "bulge": (chainage > 80.0) & (chainage < 81.0) & (arc > 2.0) & (arc < 3.0),
        "wall": (chainage > 75.0) & (chainage < 105.0) & (arc > 4.0) & (arc < 8.0),
        "ring": (chainage > 90.0) & (chainage < 91.5),
    }[kind]
    change = where * (-mean * np.cos(2.0 * arc / RADIUS) if kind == "ring" else mean)
    found = changed(change, (0.01, 0.02))
    regions = change_regions(found.difference, found.variance, found.removed_error, found.scatter, found.place_error)
    truth = np.zeros(found.difference.shape)
    np.add.at(truth, (((arc + 9.0) / 0.1).astype(int), ((chainage - 60.0) / 0.1).astype(int)), where / 25.0)
    assert regions
    assert all(truth[region.rows, region.columns].mean() > 0.7 for region in regions)
    if area is not None:
        assert sum(len(region.rows) for region in regions) / 100.0 == pytest.approx(area, rel=0.1)
        largest = max(regions, key=lambda region: len(region.rows))
        assert largest.mean == pytest.approx(mean, abs=3e-4)
    else:  # walls come in by half of what the width loses
        sections = section_figures(found)
        squeezed = max(sections, key=lambda section: section.rms)
        assert (squeezed.low, squeezed.high) == (90.0, 91.5)
        assert squeezed.rms == pytest.approx(mean / np.sqrt(2.0), rel=0.2)


def test_false_discoveries_are_few_and_nan_is_none() -> None:
    drawn = np.random.default_rng(3).uniform(size=(200, 1000))
    assert sum(significant(row).any() for row in drawn) < 0.1 * len(drawn)
    assert significant(np.array([1e-9, np.nan, 0.5])).tolist() == [True, False, False]


def leak(number: int, west: float, east: float, kind: str = "leak") -> Leak:
    outline = shapely.box(west, 0.0, east, 1.0)
    return Leak(number, kind, kind == "leak", outline.area, 5.0, outline)


@pytest.mark.parametrize(
    ("old", "new", "seen", "state"),
    [
        ([leak(1, 0, 1)], [leak(2, 0, 1.01)], (1.0, 1.0), "same"),
        ([leak(1, 0, 1)], [leak(2, 0, 2)], (1.0, 1.0), "grown"),
        ([leak(1, 0, 1)], [leak(2, 0, 2)], (0.4, 1.0), "unseen"),
        ([leak(1, 0, 1)], [leak(2, 0, 0.4), leak(3, 0.5, 0.7)], (1.0, 1.0), "shrunk"),
        ([leak(1, 0, 1)], [], (1.0, 0.9), "dry"),
        ([leak(1, 0, 1)], [], (1.0, 0.3), "unseen"),
        ([], [leak(1, 0, 1)], (0.2, 1.0), "unseen"),
        ([], [leak(1, 0, 1)], (0.9, 1.0), "new"),
        ([leak(1, 0, 1)], [leak(2, 0, 1, "dark")], (1.0, 1.0), "kind"),
        ([leak(1, 0, 1)], [leak(2, 0, 1, "dark")], (1.0, 0.3), "unseen"),
        ([leak(1, 0, 1)], [leak(2, 0.9, 3, "dark")], (1.0, 1.0), "dry"),
    ],
)
def test_what_became_of_a_leak(old: list[Leak], new: list[Leak], seen: tuple[float, float], state: str) -> None:
    (group,) = groups(old, new)
    assert state_of(group, wet_area(group.old, PIXEL), wet_area(group.new, PIXEL), *seen) == state


def test_leaks_that_do_not_touch_are_apart() -> None:
    found = groups([leak(1, 0, 1), leak(2, 3, 4)], [leak(3, 0.5, 3.05), leak(4, 9, 10)])
    assert sorted((len(group.old), len(group.new)) for group in found) == [(0, 1), (2, 1)]
    assert groups([], []) == []


def test_rings_that_touch_are_drawn_apart() -> None:
    """Two holes that touch each other in a corner, one of which touches the rim."""
    outline = shapely.difference(shapely.box(0, 0, 1, 1), shapely.union_all([shapely.box(0.1, 0.1, 0.2, 0.2),
                                                                             shapely.box(0.2, 0.2, 0.3, 0.3)]))  # fmt: skip
    outline = shapely.difference(outline, shapely.box(0, 0, 0.1, 0.1))
    apart = rings_apart(outline)
    assert apart.geom_type == "Polygon"
    assert apart.is_valid
    rings = [apart.exterior, *apart.interiors]
    assert not any(one.intersects(other) for n, one in enumerate(rings) for other in rings[:n])
    assert shapely.hausdorff_distance(apart, outline) < 2e-3
