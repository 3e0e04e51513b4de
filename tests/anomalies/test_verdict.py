"""Leaks, joints and what is dark but dry, painted on lining with noise: what detection takes them for, and how exact it is."""

from types import SimpleNamespace

import numpy as np
import pytest
import shapely
from scipy import ndimage
from shapely.geometry import Polygon, box

from tunneldb.anomalies.background.contrast import ContrastImage
from tunneldb.anomalies.detect import Detection, find_anomalies
from tunneldb.anomalies.records import Anomaly
from tunneldb.anomalies.regions import Region, RegionProperties
from tunneldb.anomalies.verdict import classify
from tunneldb.raster.geotiff import NODATA
from tunneldb.raster.grid import Grid
from tunneldb.raster.state import PixelState

pytestmark = pytest.mark.slow

PIXEL, SIGMA = 0.02, 0.3
WIDTH, HALF = 14.0, 4.0  # of the canvas: from chainage 0, and from arc -HALF to HALF, m


class Canvas:
    """Lining with noise on which to paint; each pixel is the mean of what it covers, as a pixel of points is."""

    def __init__(self, seed: int = 0, filled: float = 0.8, sigma: float = SIGMA) -> None:
        self.rng, self.filled, self.sigma = np.random.default_rng(seed), filled, sigma
        self.grid = Grid.covering(0, PIXEL, -HALF, HALF, chainages=(0.0, WIDTH))
        self.drop = np.zeros((self.grid.rows, round(WIDTH / PIXEL)))
        self.state = np.full(self.drop.shape, PixelState.LINING, np.uint8)
        self.chainage, self.arc = (np.arange(self.drop.shape[1]) + 0.5) * PIXEL, self.grid.arcs()[:, None]

    def inside(self, shape: Polygon) -> np.ndarray:
        """Share of each pixel that a shape covers."""
        fine = 4
        west, south, east, north = shape.bounds
        first, last = int(west / PIXEL) - 1, int(east / PIXEL) + 2
        top, bottom = int((HALF - north) / PIXEL) - 1, int((HALF - south) / PIXEL) + 2
        first, top, last, bottom = max(first, 0), max(top, 0), min(last, self.drop.shape[1]), min(bottom, self.grid.rows)
        x = (first + (np.arange((last - first) * fine) + 0.5) / fine) * PIXEL
        y = HALF - (top + (np.arange((bottom - top) * fine) + 0.5) / fine) * PIXEL
        held = shapely.contains_xy(shape, *np.meshgrid(x, y)).reshape(bottom - top, fine, last - first, fine)
        out = np.zeros(self.drop.shape)
        out[top:bottom, first:last] = held.mean(axis=(1, 3))
        return out

    def paint(self, shape: Polygon, drop: float) -> None:
        self.drop = np.maximum(self.drop, drop * ndimage.gaussian_filter(self.inside(shape), 0.4))

    def detect(self) -> Detection:
        noisy = self.drop + self.rng.normal(0, self.sigma, self.drop.shape)
        empty = self.rng.random(self.drop.shape) > self.filled
        drop = np.full((self.grid.rows, self.grid.columns), NODATA, np.int16)
        state = np.zeros(drop.shape, np.uint8)
        drop[:, : self.drop.shape[1]] = np.where(empty, NODATA, np.rint(100 * noisy))
        state[:, : self.drop.shape[1]] = np.where(empty & (self.state == PixelState.LINING), PixelState.EMPTY, self.state)
        sigma = np.full((self.grid.rows // 25, self.grid.columns // 25), self.sigma, np.float32)
        return find_anomalies(ContrastImage(self.grid, state, drop, 25, sigma), SimpleNamespace(count=1), 0.05)


def blob(chainage: float, arc: float, area: float, seed: int = 0) -> Polygon:
    """An irregular patch."""
    rng = np.random.default_rng(seed)
    angle = np.linspace(0, 2 * np.pi, 90, endpoint=False)
    radius = 1 + sum(rng.normal(0, 0.2 / k) * np.cos(k * angle + rng.uniform(0, 6)) for k in range(2, 8))
    radius *= np.sqrt(area / np.pi)
    shape = Polygon(np.column_stack([chainage + radius * np.cos(angle), arc + radius * np.sin(angle)]))
    return shapely.affinity.scale(shape, np.sqrt(area / shape.area), np.sqrt(area / shape.area))


def of_kind(found: Detection, kind: str) -> list[Anomaly]:
    return [anomaly for anomaly in found.anomalies if anomaly.verdict.kind == kind]


@pytest.mark.parametrize("filled", [0.9, 0.4])
@pytest.mark.parametrize(("contrast", "sigma"), [(4.0, 0.3), (6.0, 0.3), (4.0, 0.8), (6.0, 0.6), (25.0, 0.3)])
def test_edges_areas_and_holes_hold_whatever_the_contrast(contrast: float, sigma: float, filled: float) -> None:
    """All are found. From 3 dB on they are leaks, but for a few where lining itself differs by as much as a quarter of that; up
    to 1.2 dB, less than damp lining loses, they are said to be faint."""
    canvas = Canvas(1, filled, sigma)
    true = [blob(1.5 + 2.1 * k, arc, area, k) for k, area in enumerate((0.1, 0.2, 0.5, 1.0, 1.5, 0.3)) for arc in (-2.0, 2.0)]
    true[6] = true[6].difference(shapely.Point(1.5 + 2.1 * 3, -2.0).buffer(0.25))
    for leak in true:
        canvas.paint(leak, contrast * sigma)
    found = canvas.detect()
    assert len(found.anomalies) == len(true)
    if contrast * sigma >= 3.0:
        assert len(of_kind(found, "leak")) >= (len(true) if contrast > 4.0 else 0.8 * len(true))
    elif contrast * sigma <= 1.5:
        assert all("faint" in anomaly.verdict.reasons for anomaly in found.anomalies)
    errors = []
    for leak in true:
        (same,) = (anomaly for anomaly in found.anomalies if anomaly.outline.intersects(leak))
        assert same.outline.intersection(leak).area / same.outline.union(leak).area > 0.8
        assert leak.boundary.hausdorff_distance(same.outline.boundary) < 0.08
        assert len(same.outline.interiors) == len(leak.interiors)
        places = shapely.line_interpolate_point(leak.exterior, np.arange(0, leak.exterior.length, 0.05))
        assert np.median(shapely.distance(places, same.outline.exterior)) < 0.02
        errors.append(same.outline.area / leak.area - 1)
    assert np.median(np.abs(errors)) < 0.05
    assert np.abs(errors).max() < 0.15


def test_drips_are_a_part_of_the_patch_above_them() -> None:
    """On both sides of the crown water runs down, away from it; a speck above or far below a patch is none of it."""
    canvas = Canvas(2)
    patches = [blob(3.0, 1.0, 0.5), blob(9.0, -1.0, 0.5)]
    drips, strangers = [], []
    for patch, down in zip(patches, (1, -1), strict=True):
        middle = patch.centroid.x
        low = patch.intersection(shapely.LineString([(middle, -HALF), (middle, HALF)])).bounds[3 if down > 0 else 1]
        at = low
        for gap, length in ((0.06, 0.14), (0.08, 0.1)):
            at += down * gap
            drips.append(box(middle - 0.04, min(at, at + down * length), middle + 0.04, max(at, at + down * length)))
            at += down * length
        strangers.append(shapely.Point(middle, at + down * 0.4).buffer(0.05))
        strangers.append(shapely.Point(middle, patch.centroid.y - down * 0.65).buffer(0.05))
    for shape in (*patches, *drips, *strangers):
        canvas.paint(shape, 3.0)
    found = canvas.detect().anomalies
    assert len(found) == 2
    for patch, anomaly in zip(patches, found, strict=True):
        assert anomaly.verdict.kind == "leak"
        of_it = [drip for drip in drips if drip.distance(patch) < 0.5]
        assert all(anomaly.outline.intersection(drip).area > 0.5 * drip.area for drip in of_it)
        assert not any(anomaly.outline.intersects(stranger) for stranger in strangers)
        whole = shapely.union_all([patch, *of_it])
        assert anomaly.outline.area == pytest.approx(whole.area, rel=0.05)


def test_joints_are_no_leaks_and_do_not_tie_leaks_together() -> None:
    canvas = Canvas(3)
    for chainage in np.arange(0.75, WIDTH, 1.5):
        canvas.paint(box(chainage, -HALF, chainage + 0.05, HALF), 3.0)
    canvas.paint(box(0.2, 1.0, WIDTH - 0.2, 1.04), 3.0)
    true = [blob(3.0, 2.2, 0.6), blob(8.3, -1.5, 0.8, 1)]
    for leak in true:
        canvas.paint(leak, 3.0)
    found = canvas.detect()
    leaks = of_kind(found, "leak")
    assert len(leaks) == 2
    for leak, anomaly in zip(true, leaks, strict=True):
        assert anomaly.outline.area == pytest.approx(leak.area, rel=0.2)
    joints = of_kind(found, "joint")
    assert len(joints) >= 9
    assert all("thin" in joint.verdict.reasons for joint in joints)


def test_a_leak_that_runs_along_a_joint_is_a_leak() -> None:
    canvas = Canvas(4)
    y = np.linspace(-1.5, 1.5, 40)
    for k, width in enumerate((0.12, 0.2, 0.4)):
        half = 0.5 * width * (1 + 0.25 * np.sin(5 * y + k))
        middle = 2.0 + 4.0 * k
        canvas.paint(box(middle - 0.01, -HALF, middle + 0.01, HALF), 3.0)
        canvas.paint(Polygon([*zip(middle - half, y, strict=True), *zip((middle + half)[::-1], y[::-1], strict=True)]), 2.5)
    found = canvas.detect()
    assert [anomaly.verdict.kind for anomaly in found.anomalies] == ["leak"] * 3


@pytest.mark.parametrize("drop", [1.2, 2.0])
def test_repairs_and_stripes_have_straight_sides(drop: float) -> None:
    canvas = Canvas(5)
    for k, (along, across) in enumerate([(1.2, 0.8), (0.5, 0.6), (0.4, 1.5), (1.0, 1.0)]):
        canvas.paint(box(1 + 3 * k, 0.5, 1 + 3 * k + along, 0.5 + across), drop)
    canvas.paint(box(1.0, -2.0, 9.0, -1.89), 3.5)
    found = canvas.detect().anomalies
    assert len(found) == 5
    assert all(anomaly.verdict.kind == "dark" for anomaly in found)
    assert sorted(anomaly.verdict.reasons[0] for anomaly in found) == ["rectangular"] * 4 + ["stripe"]


@pytest.mark.parametrize("drop", [1.2, 2.0])
def test_repairs_that_joints_and_appendages_cut_up_have_straight_sides_still(drop: float) -> None:
    canvas = Canvas(10)
    patches = [box(1.0, 0.4, 2.8, 1.6), box(5.0, 0.4, 6.4, 1.9), box(9.0, 0.2, 10.6, 1.4)]
    for patch in patches:
        canvas.paint(patch, drop)
    canvas.paint(box(2.2, -HALF, 2.22, HALF), 3.0)  # a joint through the first
    for hidden in (box(2.3, 1.2, 2.65, 1.6), box(4.0, 0.8, 8.0, 0.95), box(9.9, 0.2, 10.2, 0.5), box(8.9, 1.1, 9.3, 1.5)):
        canvas.state[canvas.inside(hidden) > 0] = PixelState.OFF
    found = [anomaly for anomaly in canvas.detect().anomalies if anomaly.verdict.kind != "joint"]
    assert len(found) == 3  # what the cable cuts in two is one
    assert all(anomaly.verdict.reasons[0] == "rectangular" for anomaly in found)


def test_a_segment_of_a_darker_shade_of_which_a_part_is_dark_enough_is_no_leak() -> None:
    """It ends at its joints, and fades within."""
    canvas = Canvas(11)
    canvas.paint(box(4.0, -1.0, 5.5, 2.0), 1.2)
    canvas.drop -= canvas.inside(box(4.0, -1.0, 5.5, 2.0)) * 0.5 * np.clip((canvas.arc + 1.0) / 2.0, 0.0, 1.0)
    found = canvas.detect()
    assert found.anomalies
    assert not of_kind(found, "leak")


@pytest.mark.parametrize("seed", range(4))
def test_leaks_of_many_shapes_are_not_taken_for_something_built(seed: int) -> None:
    """They are as even and sharp as paint; one of twelve may be doubted, none is dismissed."""
    canvas = Canvas(20 + seed)
    areas = np.tile((0.12, 0.25, 0.5, 0.9, 1.3, 0.4), 2)
    for k, area in enumerate(areas):
        leak = blob(1.3 + 2.2 * (k % 6), -2.0 if k < 6 else 2.0, float(area), 100 * seed + k)
        canvas.paint(leak, (2.4, 3.0, 4.0)[k % 3])
    found = canvas.detect()
    assert len(found.anomalies) == len(areas)
    assert len(of_kind(found, "leak")) >= len(areas) - 1
    assert all(anomaly.verdict.kind == "leak" or anomaly.verdict.confidence < 0.65 for anomaly in found.anomalies)


def test_what_shows_between_appendages_only_is_no_leak() -> None:
    canvas = Canvas(12)
    canvas.state[canvas.inside(box(3.0, 0.0, 6.0, 1.2)) > 0] = PixelState.OFF
    canvas.state[canvas.inside(box(3.3, 0.4, 5.7, 0.8)) > 0] = PixelState.LINING
    canvas.paint(box(3.3, 0.4, 5.7, 0.8), 4.0)
    (only,) = canvas.detect().anomalies
    assert only.verdict.kind == "dark"
    assert "shadow" in only.verdict.reasons


def test_soot_fades_out() -> None:
    canvas = Canvas(6)
    canvas.drop += 2.2 * np.exp(-((canvas.arc / 1.2) ** 2) - ((canvas.chainage - 7) / 4) ** 2)
    found = canvas.detect()
    assert not of_kind(found, "leak")
    assert {reason for anomaly in found.anomalies for reason in anomaly.verdict.reasons} >= {"gradual"}


def test_a_bolt_pocket_is_dark_and_a_leak_on_the_back_of_a_niche_is_a_leak() -> None:
    canvas = Canvas(7)
    pockets = [box(1 + 2 * k, 2.0, 1.25 + 2 * k, 2.25) for k in range(5)]
    niche = box(3.0, -2.5, 5.0, -0.5)
    for recess in (*pockets, niche):
        canvas.state[canvas.inside(recess) > 0.5] = PixelState.RECESS
    for pocket in pockets:
        canvas.paint(pocket, 3.0)
    leak = blob(4.0, -1.5, 0.6)
    canvas.paint(leak, 3.0)
    found = canvas.detect()
    (only,) = of_kind(found, "leak")
    assert only.outline.intersection(leak).area > 0.9 * leak.area
    dark = of_kind(found, "dark")
    assert len(dark) == len(pockets)
    assert all(anomaly.verdict.reasons[0] == "recess" for anomaly in dark)


def test_a_dark_line_beside_a_cable_is_its_shadow() -> None:
    canvas = Canvas(8)
    canvas.state[np.abs(canvas.arc[:, 0] - 1.0) < 0.04] = PixelState.OFF
    canvas.paint(box(2.0, 1.04, 12.0, 1.13), 3.0)
    found = canvas.detect()
    assert found.anomalies
    assert not of_kind(found, "leak")


def test_dry_lining_shows_nothing() -> None:
    for filled in (1.0, 0.5, 0.2):
        assert not Canvas(9, filled).detect().anomalies


def _region(side: int, drop: float, share: float = 1.0, pixel: float = PIXEL) -> Region:
    """A round one."""
    row, column = np.mgrid[:side, :side]
    mask = np.hypot(row - side / 2 + 0.5, column - side / 2 + 0.5) < side / 2
    filled = round(share * mask.sum())
    rim = 4.0 * side
    properties = RegionProperties(
        sigma=filled * SIGMA, perimeter=rim, steps=rim, inside=0.9 * rim * drop, outside=0.2 * rim * drop, far_steps=rim,
        sharp=rim, straight=0.4 * rim, darkening_square=1.05 * filled * drop**2,
    )  # fmt: skip
    return Region(pixel, 0, 0, mask, filled, filled * drop, drop, properties)


def _probability(region: Region) -> float:
    """That it is a leak."""
    verdict = classify(region)
    return verdict.confidence if verdict.kind == "leak" else 1.0 - verdict.confidence


def test_the_probability_of_a_leak_grows_with_contrast_and_support() -> None:
    for grown in (
        [_region(30, drop) for drop in (0.9, 1.3, 1.8, 2.5, 3.5, 5.0)],
        [_region(30, 3.0, share) for share in (0.02, 0.05, 0.1, 0.3, 0.6, 1.0)],
    ):
        told = [_probability(region) for region in grown]
        assert told == sorted(told)
        assert 0 < told[0] < told[-1] < 1
    assert classify(_region(30, 0.9)).kind == "dark"
    assert classify(_region(30, 5.0)).kind == "leak"
