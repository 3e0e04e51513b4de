"""The compiled pass over points against the same steps in NumPy, array by array."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tunneldb.errors import UserError
from tunneldb.geometry.frame import plan_lengths, segment_rows, tangents
from tunneldb.geometry.surface import Surface
from tunneldb.pointcloud.poses import PoseModel
from tunneldb.pointcloud.reader import Points, ScanSource
from tunneldb.radiometry.correction import Kind, to_decibel
from tunneldb.radiometry.oren_nayar import incidence_db
from tunneldb.radiometry.reference_curve import ReferenceCurve
from tunneldb.raster import rasterize as module
from tunneldb.raster.accumulator import LEVEL, OFFSET, Accumulator
from tunneldb.raster.floor import Floor
from tunneldb.raster.grid import Grid
from tunneldb.raster.observation import Observer, Radiometer
from tunneldb.raster.projection import WEIGHT
from tunneldb.raster.rasterize import Projector, rasterize
from tunneldb.threads import threads, use_threads

KM, START, LENGTH = 3, 3100.0, 60.0
ORIGIN = np.array([512_000.0, 4_104_000.0, 414.0])
CURVE = ReferenceCurve.from_rows(np.array([0.5, 2.0, 3.0, 4.5, 9.0]), np.array([31.0, 36.0, 34.0, 30.0, 22.0]))
FAR = ReferenceCurve.from_rows(np.array([0.5, 2.0, 5.0, 60.0]), np.array([31.0, 36.0, 30.0, 5.0]))
ROUGHNESS = 14.0
MAX_INCIDENCE, MAX_RANGE, MAX_OUTSIDE = 70.0, 8.0, 0.05
DEPTH = 0.3, 0.4


def tunnel() -> Surface:
    """A bend that climbs; sections from round to a box, with a niche in one of them and a hole where one is missing."""
    s = np.arange(0.0, LENGTH + 1, 10.0)
    angle = s / 150.0
    vertices = ORIGIN + np.column_stack([150.0 * (1 - np.cos(angle)), 150.0 * np.sin(angle), 0.03 * s])
    tangent = tangents(vertices)
    ends = START + np.concatenate([[0.0], np.cumsum(plan_lengths(vertices, tangent))])
    chainages = START + np.array([2.5, 7.5, 12.5, 17.5, 22.5, 37.5, 42.5, 47.5, 52.5, 57.5])
    degree = np.radians(np.arange(-180.0, 181.0))
    box = np.minimum(3.5 / np.maximum(np.abs(np.sin(degree)), 1e-9), 2.8 / np.maximum(np.abs(np.cos(degree)), 1e-9))
    share = np.linspace(0.0, 1.0, len(chainages))[:, None]
    radius = (1 - share) * 3.2 + share * box
    radius[3, 265:285] += 1.2
    step = np.hypot(*np.diff(np.stack([radius * np.sin(degree), radius * np.cos(degree)]), axis=2))
    arcs = np.concatenate([np.zeros((len(step), 1)), np.cumsum(step, axis=1)], axis=1)
    arcs -= arcs[:, 180:181]
    return Surface(
        np.arange(len(vertices) - 1),
        segment_rows(vertices, tangent),
        np.column_stack([ends[:-1], ends[1:]]),
        chainages,
        radius,
        arcs,
        10.0,
    )


SURFACE = tunnel()
# The floor rises to the left, and there is none for the last metres on the right.
FLOOR = Floor.of(int(START), np.linspace(-7.5, -6.0, 61), np.where(np.arange(61) < 50, 7.0, np.nan))


def poses(mobile: bool) -> PoseModel:
    chainage = START + np.arange(1.0, LENGTH, 1.0)
    origin = SURFACE.frames(chainage)[:, 0] + [0.2, 0.1, -0.4]
    if mobile:
        return PoseModel.from_trajectory(np.arange(len(chainage), dtype=float), origin)
    return PoseModel.from_stations(np.array([40, 7, 12]), origin[[50, 10, 30]])


def cloud(count: int, seed: int = 1) -> Points:
    """Points in a spiral and points anywhere, near the surface and far from it, on planes and sections too."""
    rng = np.random.default_rng(seed)
    chainage = START + np.sort(rng.uniform(-3.0, LENGTH + 3.0, count))
    arc = np.linspace(0.0, 60.0, count) * 20.0 % 24.0 - 12.0
    offset = rng.normal(0.0, 0.05, count)
    loose = rng.random(count) < 0.2
    chainage[loose] = START + rng.uniform(-3.0, LENGTH + 3.0, loose.sum())
    arc[loose] = rng.uniform(-13.0, 13.0, loose.sum())
    offset[loose] = rng.uniform(-3.5, 3.5, loose.sum())
    exact = np.flatnonzero(rng.random(count) < 0.02)
    chainage[exact] = rng.choice(np.concatenate([SURFACE.ends[:, 0], SURFACE.chainages, [START]]), len(exact))
    xyz = SURFACE.to_space(chainage, arc, offset)
    lost = np.isnan(xyz[:, 0])
    xyz[lost] = ORIGIN + rng.uniform(-80.0, 80.0, (lost.sum(), 3))
    time = np.clip(chainage - START - 1.0 + rng.normal(0.0, 0.01, count), 0.0, LENGTH - 2.0)
    return Points(
        xyz,
        time,
        rng.choice(np.array([7, 12, 40], np.int32), count),
        rng.uniform(15.0, 40.0, count).astype(np.float32),
        np.zeros(count, np.uint8),
    )


def observer(kind: str, mobile: bool, curve: ReferenceCurve = FAR) -> Observer:
    if kind == "none":
        return Observer.of(SURFACE, KM, DEPTH, None, FLOOR)
    reference = None if kind == "reflectance" else curve
    typed: Kind = kind  # type: ignore[assignment]
    return Observer.of(
        SURFACE, KM, DEPTH, Radiometer(typed, poses(mobile), reference, MAX_INCIDENCE, MAX_RANGE, MAX_OUTSIDE), FLOOR
    )


def grid(pixel: float = 0.02) -> Grid:
    return Grid.covering(KM, pixel, float(SURFACE.arcs.min()), float(SURFACE.arcs.max()))


@pytest.mark.parametrize("mobile", [True, False])
@pytest.mark.parametrize("kind", ["amplitude", "reflectance", "linear", "none"])
def test_each_point_is_what_the_steps_in_numpy_make_of_it(kind: str, mobile: bool) -> None:
    points = cloud(60_000)
    points.intensity[::50] = np.nan
    points.intensity[1::50] = 0.0
    look = observer(kind, mobile, CURVE)
    assert look.edges.sharp.any()
    pixels, tally = Projector.of(look, grid(), ROUGHNESS).project(points)

    unrolled = SURFACE.unroll(points.xyz)
    row, column = grid().place(unrolled.chainage, unrolled.arc)
    with np.errstate(invalid="ignore"):
        use = (unrolled.offset <= DEPTH[0]) & (unrolled.offset >= -DEPTH[1]) & (column >= 0)
    raw = corrected = np.zeros(len(points))
    weight = np.ones(len(points))
    if kind != "none":
        scanner = poses(mobile).positions(points)
        ray = scanner - points.xyz
        distance = np.linalg.norm(ray, axis=1)
        cosine = (ray * look.edges.normals_of(points.xyz, unrolled)).sum(axis=1) / distance
        raw = to_decibel(points.intensity, kind)  # type: ignore[arg-type]
        use &= np.isfinite(raw) & (cosine >= np.cos(np.radians(MAX_INCIDENCE))) & (distance <= MAX_RANGE)
        least = np.cos(np.radians(MAX_INCIDENCE)) ** 2
        slant, far = (cosine**2 - least) / (1 - least), 1 / (1 + (distance / (MAX_RANGE / 2)) ** 2)
        weight = 1 + np.rint(63 * slant * (far - 0.2) / 0.8)
        corrected = raw - incidence_db(np.where(use, cosine, 1.0), ROUGHNESS)
        if kind != "reflectance":
            corrected -= CURVE(distance)
            lining = use & ~look.floor.covers(unrolled.chainage, unrolled.arc)
            assert tally.lining == lining.sum()
            beyond = lining & CURVE.outside(distance)
            assert tally.outside == beyond.sum()
            use &= ~beyond
            assert (tally.nearest, tally.farthest) == pytest.approx((distance[lining].min(), distance[lining].max()))
    assert 5_000 < use.sum() < 55_000
    assert tally.used == use.sum()
    assert tally.lost == 0
    np.testing.assert_array_equal(pixels.column[: len(points)], np.where(use, column, -1))
    np.testing.assert_array_equal(pixels.row[: len(points)][use], row[use])
    differs = pixels.weight[: len(points)][use] != weight[use]
    assert differs.mean() < 1e-3  # a half may be rounded either way
    np.testing.assert_allclose(pixels.weight[: len(points)][use], weight[use], atol=1)
    np.testing.assert_allclose(pixels.offset[: len(points)][use], unrolled.offset[use], atol=1e-7)
    np.testing.assert_allclose(pixels.raw[: len(points)][use], raw[use], atol=1e-5)
    np.testing.assert_allclose(pixels.corrected[: len(points)][use], corrected[use], atol=1e-5)


def test_the_order_of_points_does_not_change_where_they_fall() -> None:
    points = cloud(30_000, 2)
    order = np.random.default_rng(3).permutation(len(points))
    mixed = points.some(order)
    projector = Projector.of(observer("amplitude", True), grid(), ROUGHNESS)
    straight = [array[: len(points)].copy() for array in projector.project(points)[0]]
    shuffled = [array[: len(points)].copy() for array in projector.project(mixed)[0]]
    np.testing.assert_array_equal(straight[1][order], shuffled[1])
    held = shuffled[1] >= 0
    for one, other in zip(straight, shuffled, strict=True):
        np.testing.assert_array_equal(one[order][held], other[held])


def read(monkeypatch: pytest.MonkeyPatch, look: Observer, parts: list[list[Points]], pixel: float = 0.1) -> Accumulator:
    """Image of files, each a list of chunks."""
    files = {Path(f"{k}.laz"): chunks for k, chunks in enumerate(parts)}
    monkeypatch.setattr(module, "read_chunks", lambda path, *_, **__: iter(files[path]))
    image = Accumulator(grid(pixel))
    sources = [ScanSource(path, [(0, sum(map(len, chunks)))], "Amplitude") for path, chunks in files.items()]
    rasterize(look, sources, image, ROUGHNESS, lambda share: None)
    return image


def part(points: Points, chosen: np.ndarray) -> Points:
    return points.some(chosen)


def test_the_image_depends_neither_on_files_nor_on_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    points, look, before = cloud(50_000, 4), observer("amplitude", True), threads()
    index = np.arange(len(points))
    splits = [
        [[points]],
        [[part(points, chunk) for chunk in np.array_split(index, 9)]],
        [[part(points, chunk)] for chunk in np.array_split(np.random.default_rng(5).permutation(index), 3)[::-1]],
    ]
    images = []
    try:
        for count in (1, 2):
            use_threads(count)
            for files in splits:
                with read(monkeypatch, look, files) as image:
                    images.append(image.window(0, image.grid.columns))
    finally:
        use_threads(before)
    assert images[0].weight.max() > 3 * WEIGHT / 2
    for other in images[1:]:
        for name in ("weight", "offset", "raw", "corrected"):
            np.testing.assert_array_equal(getattr(other, name), getattr(images[0], name))


def test_a_pixel_is_the_weighted_mean_of_its_points(monkeypatch: pytest.MonkeyPatch) -> None:
    points, look = cloud(50_000, 6), observer("reflectance", False)
    pixels, _ = Projector.of(look, grid(0.5), ROUGHNESS).project(points)
    with read(monkeypatch, look, [[points]], 0.5) as image:
        window = image.window(0, image.grid.columns)
    # One that points of very different weight fall into.
    heaviest = np.zeros(window.weight.shape, int)
    held = pixels.column[: len(points)] >= 0
    np.maximum.at(
        heaviest, (pixels.row[: len(points)][held], pixels.column[: len(points)][held]), pixels.weight[: len(points)][held]
    )
    row, column = np.unravel_index(np.argmax(window.weight - heaviest), heaviest.shape)
    inside = np.flatnonzero((pixels.row[: len(points)] == row) & (pixels.column[: len(points)] == column))
    weight = pixels.weight[inside]
    assert len(np.unique(weight)) > 1
    assert window.weight[row, column] == weight.sum()
    assert window.offset[row, column] == pytest.approx(np.average(pixels.offset[inside], weights=weight), abs=OFFSET)
    assert window.raw[row, column] == pytest.approx(np.average(pixels.raw[inside], weights=weight), abs=LEVEL)
    assert window.corrected[row, column] == pytest.approx(np.average(pixels.corrected[inside], weights=weight), abs=LEVEL)


@pytest.mark.parametrize("mobile", [True, False])
def test_points_of_unknown_scanner_position_go_nowhere(mobile: bool) -> None:
    points = cloud(20_000, 7)
    known, _ = Projector.of(observer("amplitude", mobile), grid(), ROUGHNESS).project(points)
    lost = np.zeros(len(points), bool)
    lost[15_000:15_010] = True
    points.time[lost] = [LENGTH + 2.5] * 5 + [np.nan] * 5
    points.scan_id[lost] = 13
    expected = np.where(lost, -1, known.column[: len(points)].copy())
    pixels, tally = Projector.of(observer("amplitude", mobile), grid(), ROUGHNESS).project(points)
    np.testing.assert_array_equal(pixels.column[: len(points)], expected)
    assert 0 < tally.lost <= 10


def test_without_scanner_positions_intensity_is_taken_as_it_is() -> None:
    points = cloud(20_000, 9)
    points.intensity[::50] = np.nan
    posed = observer("reflectance", True)
    assert posed.radiometer is not None
    look = replace(posed, radiometer=replace(posed.radiometer, poses=PoseModel.unknown()))
    pixels, tally = Projector.of(look, grid(), 0.0).project(points)
    bare, _ = Projector.of(observer("none", True), grid(), 0.0).project(points)
    expected = np.where(np.isnan(points.intensity), -1, bare.column[: len(points)])
    np.testing.assert_array_equal(pixels.column[: len(points)], expected)
    use = expected >= 0
    assert 1000 < tally.used <= use.sum()
    assert tally.lost == 0
    np.testing.assert_array_equal(pixels.corrected[: len(points)][use], points.intensity[use])
    np.testing.assert_array_equal(pixels.weight[: len(points)][use], 1)
    seen = look.observe(points)
    assert seen.observations is not None
    assert np.count_nonzero(seen.use) > 1000
    np.testing.assert_allclose(seen.observations.corrected(0.0)[seen.use], points.intensity[seen.use], atol=1e-6)


def test_a_time_just_beyond_the_trajectory_is_that_of_its_end(monkeypatch: pytest.MonkeyPatch) -> None:
    points = cloud(20_000, 8)
    points.time[:] = LENGTH - 2.0
    with read(monkeypatch, observer("amplitude", True), [[points]], 0.5) as image:
        at_end = image.window(0, image.grid.columns)
    points.time[:] += 0.0009
    with read(monkeypatch, observer("amplitude", True), [[points]], 0.5) as image:
        beyond = image.window(0, image.grid.columns)
    np.testing.assert_array_equal(at_end.corrected, beyond.corrected)


def test_points_that_the_curve_does_not_span_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    short = ReferenceCurve.from_rows(np.array([0.5, 3.0]), np.array([30.0, 28.0]))
    with pytest.raises(UserError, match=r"covers 0\.5 to 3 m, the lining is .* % "):
        read(monkeypatch, observer("amplitude", True, short), [[cloud(20_000, 9)]])


def test_no_point_on_the_lining_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    points = cloud(5_000)
    points.xyz[:, 2] += 30.0
    with pytest.raises(UserError, match=r"no point of 0\.laz is on the lining of kilometre 3"):
        read(monkeypatch, observer("amplitude", True), [[points]])
