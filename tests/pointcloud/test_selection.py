import threading
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import laspy
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tunneldb.geometry.alignment import Alignment
from tunneldb.pointcloud import selection as scan_filter
from tunneldb.pointcloud.noise import noise_filter
from tunneldb.pointcloud.poses import PoseModel
from tunneldb.pointcloud.prefetch import in_order, prefetch
from tunneldb.pointcloud.selection import FilterCounts, FilterSettings, filter_file
from tunneldb.pointcloud.spool import BINS_PER_KM, BINS_PER_METRE, ROW, Rows, Spool, windows
from tunneldb.pointcloud.thinning import thin, voxel_edge

pytestmark = pytest.mark.slow

ORIGIN = np.array([500_000.0, 4_500_000.0, 100.0])


def make_rows(chainage: np.ndarray, seed: int) -> Rows:
    rows = np.zeros(len(chainage), ROW)
    rows["chainage"] = chainage
    rows["x"] = np.random.default_rng(seed).uniform(0, 1, len(chainage))
    return rows


@given(
    st.lists(st.lists(st.floats(-1500, 2500), max_size=30), max_size=6),
    st.integers(0, 5000),
    st.integers(-12_000, 20_000),
    st.integers(0, 10_000),
)
@settings(deadline=None)
def test_a_spool_gives_back_what_lies_in_a_range(parts: list[list[float]], memory: int, low: int, width: int) -> None:
    added = [make_rows(np.array(part), seed) for seed, part in enumerate(parts)]
    everything = np.concatenate([*added, np.empty(0, ROW)])
    inside = (everything["chainage"] >= low / BINS_PER_METRE) & (everything["chainage"] < (low + width) / BINS_PER_METRE)
    with Spool(memory) as spool:
        for rows in added:
            spool.add(rows)
        found = spool.read(low, low + width)
        first, counts = spool.counts()
    np.testing.assert_array_equal(np.sort(found, order=["chainage", "x"]), np.sort(everything[inside], order=["chainage", "x"]))
    assert counts.sum() == len(everything)
    expected = np.bincount((np.floor(everything["chainage"] * BINS_PER_METRE) - first).astype(int), minlength=len(counts))
    np.testing.assert_array_equal(counts, expected)


@given(st.integers(-20_000, 20_000), st.lists(st.integers(0, 50), max_size=200), st.integers(1, 300))
@settings(deadline=None)
def test_windows_hold_every_row_once_and_no_kilometre_ends_inside(first: int, counts: list[int], limit: int) -> None:
    spread = np.zeros(200 * len(counts), np.int64)
    spread[::200] = counts
    found = list(windows(first, spread, limit))
    held = [int(spread[low - first : high - first].sum()) for low, high in found]
    assert sum(held) == sum(counts)
    assert all(count > 0 for count in held)
    for (low, high), (after, _) in zip(found, [*found, (10**9, 0)][1:], strict=True):
        assert low < high <= after
        assert low // BINS_PER_KM == (high - 1) // BINS_PER_KM
    # A window ends with the bin that fills it.
    assert all(count < limit + 50 for count in held)


@pytest.fixture
def scan(tmp_path: Path) -> tuple[Path, np.ndarray]:
    """A tunnel along a curve whose density falls from 20 000 to 100 points per m², with strays; in no order."""
    rng = np.random.default_rng(5)
    share = rng.uniform(0, 1, 150_000)
    along = 40 * np.log1p(share * 60) / np.log(61)
    angle = rng.uniform(-np.pi, np.pi, len(along))
    radial = np.where(rng.uniform(0, 1, len(along)) < 0.001, rng.uniform(0, 1.5, len(along)), 2.0)
    turn = along / 100.0
    x, y = 100 * np.sin(turn), 100 * (1 - np.cos(turn))
    u, w = radial * np.sin(angle), radial * np.cos(angle)
    xyz = np.round(ORIGIN + np.column_stack([x + u * np.sin(turn), y - u * np.cos(turn), w]), 3)
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales, header.offsets = [0.001] * 3, ORIGIN
    las = laspy.LasData(header)
    las.x, las.y, las.z = xyz.T
    las.gps_time = np.arange(len(xyz))
    las.write(tmp_path / "a.laz")
    return tmp_path / "a.laz", xyz


def axis() -> Alignment:
    turn = np.linspace(-0.05, 0.45, 30)
    vertices = ORIGIN + np.column_stack([100 * np.sin(turn), 100 * (1 - np.cos(turn)), 0 * turn])
    return Alignment.from_polyline(vertices, 995.0 - 5.0, 10.0)


def filtered(
    path: Path, memory: int = 1 << 28, chunk: int = 1_000_000, density: float | None = None
) -> tuple[FilterCounts, Rows]:
    poses = PoseModel.from_stations(np.array([0]), ORIGIN[None]).coverage
    with Spool(1 << 28) as survivors:
        counts = filter_file(path, None, axis(), poses, FilterSettings(density), survivors, 3, memory=memory, chunk=chunk)
        first, bins = survivors.counts()
        rows = survivors.read(first, first + len(bins))
    return counts, np.sort(rows, order=["time"])


def test_noise_does_not_depend_on_parts_chunks_or_disk(scan: tuple[Path, np.ndarray], monkeypatch: pytest.MonkeyPatch) -> None:
    path, xyz = scan
    counts, expected = filtered(path)
    assert counts.points == len(xyz) == counts.noise + counts.kept
    assert 50 < counts.noise < 300
    assert set(expected["tag"].tolist()) == {3}
    for window in (1000, 30_000):
        monkeypatch.setattr(scan_filter, "WINDOW", window)
        for memory, chunk in ((1 << 28, 7_000), (0, 50_000)):
            found_counts, found = filtered(path, memory, chunk)
            np.testing.assert_array_equal(found, expected)
            assert found_counts.noise == counts.noise


def test_thinning_keeps_of_each_voxel_the_first_that_is_no_noise(
    scan: tuple[Path, np.ndarray], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever chunks and windows it is done in: the same rows as with all points judged, and the same count of noise."""
    path, xyz = scan
    _, good = filtered(path)
    kilometres = [good[good["chainage"] < 1000.0], good[good["chainage"] >= 1000.0]]  # each is thinned by itself
    expected = np.concatenate([part[thin(rows_of(part), voxel_edge(100.0))] for part in kilometres])
    expected = np.sort(expected, order=["time"])
    noise = []
    for window, memory, chunk in ((10**6, 1 << 28, 10**6), (1000, 0, 7_000), (30_000, 1 << 20, 50_000)):
        monkeypatch.setattr(scan_filter, "WINDOW", window)
        counts, found = filtered(path, memory, chunk, 100.0)
        np.testing.assert_array_equal(found, expected)
        assert counts.points == len(xyz) == counts.noise + counts.thinned + counts.kept
        noise.append(counts.noise)
    assert noise[0] == noise[1] == noise[2]
    assert 20 < noise[0] <= len(xyz) - len(good)


def rows_of(rows: Rows) -> np.ndarray:
    return np.column_stack([rows[name] for name in "xyz"])


@pytest.mark.parametrize("count", [1, 3])
def test_results_come_in_order(count: int) -> None:
    def work(low: int, high: int) -> int:
        time.sleep(0.002 * (low % 3))
        return low * high

    parts = [(n, n + 1) for n in range(20)]
    assert list(in_order(count, work, parts)) == [low * high for low, high in parts]


def test_progress_adds_up_to_twice_the_points(scan: tuple[Path, np.ndarray]) -> None:
    path, xyz = scan
    poses, told = PoseModel.from_stations(np.array([0]), ORIGIN[None]).coverage, []
    with Spool(1 << 28) as survivors:
        filter_file(path, None, axis(), poses, FilterSettings(), survivors, 0, told.append)
    assert sum(told) == 2 * len(xyz)


def test_one_stretch_is_filtered_as_a_cloud(scan: tuple[Path, np.ndarray], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scan_filter, "STRETCH", 1e6)
    path, xyz = scan
    _, found = filtered(path)
    np.testing.assert_array_equal(np.delete(np.arange(len(xyz)), found["time"].astype(int)), np.flatnonzero(noise_filter(xyz)))


def test_prefetch_passes_items_and_errors_on() -> None:
    def items() -> Iterator[int]:
        yield from (1, 2, 3)
        raise ValueError("no more")

    got: list[int] = []
    with pytest.raises(ValueError, match="no more"):
        got.extend(prefetch(items()))
    assert got == [1, 2, 3]


def test_prefetch_ends_its_thread_when_left_early() -> None:
    before = threading.active_count()
    with closing(prefetch(iter(range(1000)))) as items:
        assert next(items) == 0
    time.sleep(0.05)
    assert threading.active_count() == before
