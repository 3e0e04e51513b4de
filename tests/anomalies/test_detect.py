"""Image, appendages, threshold, polygons and matching, on made-up pictures."""

import numpy as np
import pytest
import shapely
import shapely.affinity
from shapely.geometry import Polygon, box

from tunneldb.anomalies.background.contrast import ContrastImage
from tunneldb.anomalies.detect import _lining_in_columns, _scanned_share
from tunneldb.anomalies.matching import match, match_parts
from tunneldb.anomalies.regions import find_regions
from tunneldb.anomalies.threshold import dark_pixels, filter_size
from tunneldb.errors import UserError
from tunneldb.raster.accumulator import LEVEL, OFFSET, Accumulator
from tunneldb.raster.appendages import distance_from_plane, off_plane, reach, recessed
from tunneldb.raster.geotiff import NODATA, Raster, decode, encode
from tunneldb.raster.grid import Grid
from tunneldb.raster.projection import WEIGHT, Pixels
from tunneldb.raster.state import PixelState

PIXEL = 0.02


def add(image, chainage, arc, offset, raw, use, weight=None):
    """Add points whose corrected intensity is 5 dB less than the raw."""
    row, column = image.grid.place(chainage, arc)
    weight = np.ones(len(row), np.int32) if weight is None else weight
    image.add(Pixels(row, np.where(use, column, -1), weight, offset.astype(np.float32), raw, raw - 5), len(row))


@pytest.mark.parametrize(("pixel", "itemsize"), [(0.5, 8), (0.02, 4)])
def test_image_means_do_not_depend_on_the_order_of_points(pixel, itemsize):
    rng = np.random.default_rng(1)
    half = 6.4 * pixel
    grid = Grid.covering(12, pixel, -half, half)
    # So many points to a pixel, and two blocks more than there is room for in memory, whatever the pixel.
    chainage = rng.uniform(11_990, 13_010, 40_000)
    if pixel < 0.5:
        chainage = 12_000 + 50 * rng.integers(0, 20, 40_000) + rng.uniform(-2.0, 2.0, 40_000)
    arc, offset = rng.uniform(-half, half, 40_000), rng.normal(0, 0.01, 40_000)
    raw = rng.normal(20, 1, 40_000).astype(np.float32)
    use = rng.random(40_000) < 0.9
    weight = rng.integers(1, WEIGHT + 1, 40_000).astype(np.int32)
    windows = []
    # Room for two blocks of twenty: the others lie in the file.
    for order, memory in (
        (np.arange(40_000), 10**9),
        (rng.permutation(40_000), 2 * grid.block_columns * grid.rows * 4 * itemsize),
    ):
        with Accumulator(grid, memory) as image:
            for part in np.array_split(order, 7):
                add(image, chainage[part], arc[part], offset[part], raw[part], use[part], weight[part])
            assert image.blocks() == list(range(20))
            windows.append(image.window(0, grid.columns))
    one, other = windows
    inside = use & (chainage >= 12_000) & (chainage < 13_000)
    assert one.weight.dtype.itemsize == itemsize
    assert one.weight.sum() == weight[inside].sum()
    for name in ("weight", "offset", "raw", "corrected"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    np.testing.assert_allclose(one.corrected, one.raw - 5, atol=0.001)
    # A pixel's mean is that of the points within its corners.
    row, column = np.argwhere(one.weight > 3 * WEIGHT / 2)[500 if pixel == 0.5 else 5]
    west, north = grid.transform() @ (column, row)
    inside = use & (chainage >= west) & (chainage < west + pixel) & (arc < north) & (arc >= north - pixel)
    assert inside.sum() > 1
    assert one.weight[row, column] == weight[inside].sum()
    assert one.offset[row, column] == pytest.approx(np.average(offset[inside], weights=weight[inside]), abs=OFFSET)
    assert one.raw[row, column] == pytest.approx(np.average(raw[inside], weights=weight[inside]), abs=LEVEL)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_pixel_that_a_scanner_stood_before_does_not_run_over(sign):
    grid = Grid.covering(0, 0.02, 0.0, 0.1)
    count = 200_000
    level = np.full(count, sign * 500.0, np.float32)  # held at 128 dB
    with Accumulator(grid) as image:
        add(image, np.full(count, 5.01), np.full(count, 0.05), np.full(count, sign * 3.0), level, True, np.full(count, 64))
        window = image.window(0, 500)
    assert window.raw[2, 250] == pytest.approx(sign * 128, abs=0.01)
    assert window.offset[2, 250] == pytest.approx(sign * 3.0)
    assert window.weight[2, 250] <= 2**17


def test_windows_join_across_blocks_and_stop_at_the_kilometre():
    grid = Grid.covering(0, 1.0, -1.0, 1.0)
    with Accumulator(grid) as image:
        chainage = np.arange(1000) + 0.5
        level = chainage.astype(np.float32)
        add(image, chainage, np.full(1000, 0.5), np.zeros(1000), level, np.ones(1000, bool))
        across = image.window(40, 120)
        np.testing.assert_allclose(across.raw[0], chainage[40:120])
        assert np.isnan(across.raw[1]).all()
        assert image.window(-10, 20).columns == slice(0, 20)
        assert image.window(990, 1020).columns == slice(990, 1000)


def test_with_a_halo_the_grid_has_a_block_more_at_either_end_and_lines_up_with_the_neighbours():
    grid, following = Grid.covering(3, 0.5, -1.2, 1.0, 7), Grid.covering(4, 0.5, -1.9, 0.3, 7)
    assert grid.inner == slice(100, 2100)
    assert grid.near == slice(93, 2107)
    assert grid.transform(100) @ (0, 0) == (3000.0, 1.0)
    assert (grid.first_block, grid.first_column) == (59, 5900)
    assert following.first_column + following.inner.start == grid.first_column + grid.inner.stop
    place = np.array([4001.3]), np.array([0.2])
    here, there = grid.place(*place), following.place(*place)
    assert grid.first_column + here[1] == following.first_column + there[1]
    assert grid.bottom + grid.rows - here[0] == following.bottom + following.rows - there[0]
    with Accumulator(grid) as image:
        chainage = np.array([2999.0, 4001.0])
        add(image, chainage, np.zeros(2), np.zeros(2), np.ones(2, np.float32), np.ones(2, bool))
        assert image.blocks() == [0, 21]
        assert image.inner_blocks() == []


@pytest.mark.parametrize(
    ("between", "covered"),
    [((2970.0, 4200.0), (0, 20)), ((3030.0, 3101.0), (0, 3)), ((3050.0, 3100.0), (1, 2)), ((3999.0, 5000.0), (19, 20))],
)
def test_grid_of_a_short_tunnel_covers_the_blocks_in_which_it_lies_and_lines_up_with_the_whole(between, covered):
    whole = Grid.covering(3, 0.5, -1.2, 1.0, 7)
    part = Grid.covering(3, 0.5, -1.2, 1.0, 7, between)
    assert part.covered == covered
    assert part.columns == 100 * (covered[1] - covered[0] + 2)
    place = np.array([3000.0 + 50.0 * covered[0] + 10.3]), np.array([0.2])
    assert part.first_column + part.place(*place)[1] == whole.first_column + whole.place(*place)[1]
    assert part.first_block == whole.first_block + covered[0]
    assert part.west == whole.west + 50.0 * covered[0]


@pytest.mark.parametrize("kind", ["raw", "offset"])
def test_an_image_comes_back_from_its_file(kind):
    values = np.random.default_rng(3).normal(0, 5, (70, 300)).astype(np.float32)
    values[np.random.default_rng(4).random(values.shape) < 0.3] = np.nan
    values[0, :3] = 1e4, -1e4, 0.0
    step = {"raw": 0.01, "offset": 0.001}[kind]
    raster = Raster(values, Grid.covering(2, 0.5, -1.0, 1.0).transform())
    back = decode(encode(raster, kind))
    assert back.transform == raster.transform
    np.testing.assert_allclose(back.values, np.clip(values, -32767 * step, 32767 * step), atol=0.51 * step)


@pytest.mark.parametrize("pixel", [0.03, 0.0, -1.0, np.nan, 0.001])
def test_a_pixel_that_does_not_divide_a_block_is_refused(pixel):
    with pytest.raises(UserError, match=r"image\.pixel"):
        Grid.covering(0, pixel, -1.0, 1.0)


def _wall(rows=300, columns=600, seed=1):
    """A wall that leans against the section surface, with a box, a cable and a niche; 4 mm of noise."""
    rng = np.random.default_rng(seed)
    row, column = np.mgrid[:rows, :columns]
    wall = 0.02 + 0.01 * np.sin(column / 150) - 0.00008 * row
    offset = (wall + rng.normal(0, 0.004, (rows, columns))).astype(np.float32)
    shapes = {"box": np.s_[100:140, 200:260], "cable": np.s_[220:222, :], "niche": np.s_[20:90, 400:450]}
    for name, stand in (("box", 0.12), ("cable", 0.045), ("niche", -0.3)):
        offset[shapes[name]] += stand
    offset[rng.random(offset.shape) < 0.2] = np.nan
    return offset, wall, shapes


def split(offset, pixel=PIXEL, corner=(0, 0)):
    """What stands off, and recesses."""
    distance = distance_from_plane(offset, pixel, corner)
    recess = recessed(offset, distance, pixel)
    return off_plane(distance, recess, pixel), recess


@pytest.mark.slow
def test_appendages_stand_off_from_the_wall_and_niches_lie_behind_it():
    offset, wall, shapes = _wall()
    found, recess = split(offset)
    held = ~np.isnan(offset)
    true = np.zeros(offset.shape, bool)
    for name, where in shapes.items():
        if name == "niche":
            inner = np.s_[where[0].start + 2 : where[0].stop - 2, where[1].start + 2 : where[1].stop - 2]
            assert recess[inner][held[inner]].all()
            edge = np.zeros(offset.shape, bool)
            edge[where] = True
            edge[inner] = False
            assert found[edge & held].mean() > 0.97
            assert recess[edge & held].mean() < 0.03  # where a pixel of the wall is alone at a corner
            recess[where] = False
        else:
            assert found[where][held[where]].all()
        true[where] = True
    assert not recess.any()
    near = np.pad(true, 3)
    near = np.any([np.roll(near, (i, j), (0, 1)) for i in range(-3, 4) for j in range(-3, 4)], axis=0)[3:-3, 3:-3]
    assert not found[~near].any()
    residual = distance_from_plane(offset, PIXEL)
    lining = held & ~near
    assert np.abs(residual - (offset - wall))[lining].max() < 0.01


def test_a_wide_tray_does_not_pass_for_the_wall():
    offset = np.random.default_rng(2).normal(0, 0.004, (200, 400)).astype(np.float32)
    offset[80:105] += 0.1  # half a metre
    found, _ = split(offset)
    assert found[80:105].all()
    assert not found[:77].any()
    assert not found[108:].any()


@pytest.mark.parametrize("pixel", [0.02, 0.05])
def test_a_pixel_is_judged_alike_in_whichever_part_of_the_image(pixel):
    offset, _, _ = _wall()
    whole, far = split(offset, pixel, (-37, 1234)), reach(pixel)
    for first, stop, low, high in ((0, 200, 0, 150), (133, 333, 41, 300), (399, 600, 7, 222)):
        part = split(offset[low:high, first:stop], pixel, (-37 + low, 1234 + first))
        within = np.s_[far if low else 0 : None if high == 300 else -far, far if first else 0 : None if stop == 600 else -far]
        for one, other in zip(part, whole, strict=True):
            np.testing.assert_array_equal(one[within], other[low:high, first:stop][within])


def test_a_single_outlier_is_not_grown():
    offset = np.zeros((60, 60), np.float32)
    offset[30, 30] = 0.2
    assert split(offset)[0].sum() == 1


def test_a_niche_is_recess_though_profiles_are_apart_and_an_outlier_lies_in_it():
    rng = np.random.default_rng(3)
    offset = rng.normal(0, 0.003, (200, 300)).astype(np.float32)
    offset[60:140, 100:200] -= 0.7
    offset[100, 148] = -0.2
    offset[:, np.arange(300) % 4 > 0] = np.nan
    off, recess = split(offset)
    held = ~np.isnan(offset)
    back = np.zeros(offset.shape, bool)
    back[62:138, 104:197] = True
    assert off[100, 148]
    held[100, 148] = False
    assert recess[back & held].all()
    # Between its profiles nothing is barred.
    assert off[70:95, 110:190].sum() == 0


@pytest.mark.parametrize("stand", [0.045, 0.1, 0.3])
@pytest.mark.parametrize(("profiles", "thick"), [(1, 2), (3, 2), (3, 1), (5, 1)])
def test_a_cable_goes_with_its_shadow_and_its_mixed_pixels(stand, profiles, thick):
    rng = np.random.default_rng(6)
    offset = rng.normal(0, 0.004, (200, 600)).astype(np.float32)
    # Some rows of cable that sags, a mixed row on both sides; above it wall that it hides.
    middle = np.rint(100 + 6 * np.sin(np.arange(600) / 90)).astype(int)
    cable, mixed = np.zeros((2, *offset.shape), bool)
    columns = np.arange(600)
    for row in range(thick):
        cable[middle + row, columns] = True
    for row in (-1, thick):
        mixed[middle + row, columns] = True
    offset[cable] += stand
    offset[mixed] += stand * rng.uniform(0, 1, mixed.sum())
    for row in range(-1 - round(stand / PIXEL / 2), -1):
        offset[middle + row, columns] = np.nan
    offset[:, columns % profiles > 0] = np.nan
    off, recess = split(offset)
    held = ~np.isnan(offset)
    assert off[(cable | mixed) & held].all()
    near = np.abs(np.arange(200)[:, None] - middle) < 7
    assert not off[held & ~near].any()
    assert not recess.any()


def test_points_scattered_behind_the_wall_are_no_recess():
    rng = np.random.default_rng(4)
    offset = rng.normal(0, 0.003, (300, 300)).astype(np.float32)
    ghost = rng.random(offset.shape) < 0.01
    offset[ghost] -= rng.uniform(0.05, 1.0, ghost.sum()).astype(np.float32)
    ghost[100:200, 100:200] = False
    # A doorway, in which they are alone.
    offset[100:200, 100:200] = np.where(rng.random((100, 100)) < 0.05, -rng.uniform(0.1, 1.1, (100, 100)), np.nan)
    off, recess = split(offset)
    assert not recess.any()
    assert off[ghost].all()


def _rings():
    """State and level of lining at 0 dB ± 0.3 with a wet disc of −3 dB that has a dry hole; levels in hundredths."""
    rng = np.random.default_rng(5)
    corrected = rng.normal(0, 0.3, (200, 300))
    row, column = np.mgrid[:200, :300]
    distance = np.hypot(row - 99.5, column - 149.5)
    wet = (distance < 60) & (distance > 20)
    corrected[wet] -= 3.0
    state = (rng.random(corrected.shape) < 0.6).astype(np.uint8)
    level = np.where(state == PixelState.LINING, np.rint(corrected * 100), NODATA).astype(np.int16)
    return state, level, wet


def cut_out(mask, level, min_area, dry_mean=0.0):
    """Outlines of the regions of a mask at the corner of a kilometre, with the regions."""
    grid = Grid(0, PIXEL, 0, mask.shape[0])
    whole = np.zeros((mask.shape[0], grid.columns), bool)
    drop = np.full(whole.shape, NODATA, np.int16)
    drop[:, 50 : 50 + mask.shape[1]] = np.where(level == NODATA, NODATA, 100 * dry_mean - level)
    whole[:, 50 : 50 + mask.shape[1]] = mask
    state = (drop != NODATA).astype(np.uint8)
    sigma = np.full((-(-len(mask) // 25), grid.columns // 25), 0.3, np.float32)
    found = find_regions(whole, whole, ContrastImage(grid, state, drop, 25, sigma), min_area, lambda _: True)
    return [shapely.affinity.translate(region.outline, -50 * PIXEL) for region in found], found


def test_wet_polygon_with_a_hole_has_the_true_area_and_drop():
    state, level, _ = _rings()
    sigma = np.full((1, 1), 0.3, np.float32)
    mask = dark_pixels(ContrastImage(Grid(0, PIXEL, 0, 200), state, -level, 300, sigma), filter_size(0.6))
    (found,), (region,) = cut_out(mask, level, 0.05, 0.5)
    centre = shapely.Point(150 * PIXEL, 100 * PIXEL)
    true = centre.buffer(60 * PIXEL, 64).difference(centre.buffer(20 * PIXEL, 64))
    assert found.is_valid
    assert len(found.interiors) == 1
    assert found.exterior.is_ccw
    assert found.area == pytest.approx(true.area, rel=0.02)
    assert found.intersection(true).area / found.union(true).area > 0.96
    shown = mask & (level != NODATA)
    assert region.filled == shown.sum()
    assert region.darkening_sum == pytest.approx((0.5 - level[shown] / 100).sum())
    assert region.darkening_max == pytest.approx(0.5 - level[shown].min() / 100)
    np.testing.assert_array_equal(region.mask, mask[np.ix_(mask.any(axis=1), mask.any(axis=0))][::-1])


def test_small_regions_are_left_out_and_outlines_stay_within_a_pixel():
    rng = np.random.default_rng(6)
    mask = np.zeros((400, 400), bool)
    row, column = np.mgrid[:400, :400]
    for _ in range(12):
        r, c, size = rng.uniform(40, 360), rng.uniform(40, 360), rng.uniform(3, 30)
        mask |= np.hypot(row - r, column - c) < size
    level = np.zeros(mask.shape, np.int16)
    found, _ = cut_out(mask, level, 0.05)
    truth, _ = cut_out(mask, level, 0.0)
    assert 0 < len(found) < len(truth)
    assert all(p.is_valid and p.area > 0.045 for p in found)
    stairs = shapely.union_all(
        [box(c * PIXEL, (399 - r) * PIXEL, (c + 1) * PIXEL, (400 - r) * PIXEL) for r, c in np.argwhere(mask)]
    )
    assert shapely.union_all(truth).symmetric_difference(stairs).buffer(-PIXEL).is_empty
    assert sum(p.area for p in truth) == pytest.approx(mask.sum() * PIXEL**2, rel=0.02)


def test_leaks_found_again_by_mutual_best_overlap():
    before = [box(0, 0, 1, 1), box(5, 0, 6, 1), box(10, 0, 14, 1)]
    now = [box(20, 0, 21, 1), box(0.2, 0, 1.2, 1), box(10, 0, 11.5, 1), box(12, 0, 14, 1), box(5.8, 0, 7, 1)]
    assert match(before, now) == {1: 0, 3: 2}
    assert match([], now) == {}
    assert match(before, []) == {}
    same = [Polygon(p.exterior.coords) for p in now]
    assert match(same, now) == {k: k for k in range(len(now))}


def test_a_part_known_before_and_the_whole_are_the_same_leak():
    whole, apart = box(0, 0, 10, 1), box(20, 0, 21, 1)
    assert match_parts([box(0, 0, 1, 1)], [False], [apart, whole]) == {1: 0}
    # The reviewed half counts before the larger one, and is not used twice.
    assert match_parts([box(1, 0, 10, 1), box(0, 0, 1, 1)], [False, True], [whole]) == {0: 1}
    assert match_parts([whole], [False], [box(0, 0, 2, 1), box(4, 0, 10, 1)]) == {1: 0}
    assert match_parts([box(-3, 0, 0.5, 1)], [True], [whole]) == {}
    assert match_parts([box(10, 0, 11, 1)], [True], [whole]) == {}


def test_gap_in_the_scan_is_not_taken_for_a_sparse_scan() -> None:
    state = np.full((10, 400), PixelState.EMPTY, np.uint8)
    state[:, 20:60] = state[:, 300:350] = PixelState.LINING
    state[:, 30:40:3] = PixelState.EMPTY
    columns = _lining_in_columns(state, slice(0, 400))
    assert _scanned_share(*columns, 50) == pytest.approx(86 / 90)
    assert _scanned_share(*columns, 400) == pytest.approx(86 / 330)
    assert _scanned_share(*_lining_in_columns(state, slice(20, 60)), 50) == pytest.approx(36 / 40)
