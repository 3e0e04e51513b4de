"""The image of classes: which point a pixel stands for, what the file holds, and its preview."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import rasterio
from affine import Affine
from numpy.typing import NDArray
from PIL import Image

from tunneldb.classification.classes import PointClass
from tunneldb.export.images import preview
from tunneldb.export.images.class_raster import ClassPainter
from tunneldb.export.images.cog import Extent, write_cog
from tunneldb.export.images.palette import COLOURS
from tunneldb.geometry.frame import segment_rows, tangents
from tunneldb.geometry.stationing import Stationing
from tunneldb.geometry.surface import Surface
from tunneldb.raster.geotiff import Raster
from tunneldb.raster.overview import shrink_codes

RADIUS = 4.0


@pytest.fixture
def tube() -> Surface:
    """A straight, level tube along y from 1000 to 1100 m, of 4 m radius."""
    vertices = np.column_stack([np.zeros(11), np.arange(11) * 10.0, np.full(11, 50.0)])
    chainage = 1000.0 + vertices[:, 1]
    sections = np.sort(np.concatenate([chainage[:-1] + 2.5, chainage[:-1] + 7.5]))
    radius = np.full((len(sections), 361), RADIUS)
    arcs = np.tile(np.radians(np.arange(361) - 180.0) * RADIUS, (len(sections), 1))
    ends = np.column_stack([chainage[:-1], chainage[1:]])
    return Surface(np.arange(100, 110), segment_rows(vertices, tangents(vertices)), ends, sections, radius, arcs, 10.0)


def test_pixel_has_the_class_of_the_point_in_its_middle(tube: Surface) -> None:
    """Classes here tell by what a tube is in closed form: its height, its distance from the axis, and its place along it."""
    values = np.full((60, 100), np.nan, np.float32)
    values[10:50, 20:90] = 0.0
    values[30, 40:60] = 0.25
    seen: list[NDArray[np.float64]] = []

    def classes(points: NDArray[np.float64]) -> NDArray[np.uint8]:
        seen.append(points)
        radius = np.hypot(points[:, 0], points[:, 2] - 50.0)
        stands_off = np.abs(radius - (RADIUS - 0.25)) < 1e-3
        right = points[:, 0] > 0
        return np.where(stands_off, PointClass.APPENDAGE, np.where(right, PointClass.LINING, PointClass.NICHE)).astype(np.uint8)

    # rows from arc +3 m down to -3 m, columns from chainage 1000 on
    painted = ClassPainter(tube, classes).paint(Raster(values, Affine(0.1, 0, 1000.0, 0, -0.1, 3.0)))
    expected = np.zeros((60, 100), np.uint8)
    expected[10:30, 20:90] = PointClass.LINING
    expected[30:50, 20:90] = PointClass.NICHE
    expected[30, 40:60] = PointClass.APPENDAGE
    assert (painted == expected).all()
    # the pixel of row 10 and column 20: arc 1.95 m, chainage 1002.05 m
    angle = 1.95 / RADIUS
    assert seen[0][0] == pytest.approx([RADIUS * np.sin(angle), 2.05, 50.0 + RADIUS * np.cos(angle)], abs=2e-3)


def test_pixel_across_the_seam_is_that_beside_it(tube: Surface) -> None:
    """The section ends at an arc of 4π = 12.57 m; the middle of the outermost pixel lies at 12.6 m."""
    seen: list[NDArray[np.float64]] = []

    def classes(points: NDArray[np.float64]) -> NDArray[np.uint8]:
        seen.append(points)
        return np.full(len(points), PointClass.GROUND, np.uint8)

    painted = ClassPainter(tube, classes).paint(Raster(np.zeros((253, 3), np.float32), Affine(0.1, 0, 1050, 0, -0.1, 12.65)))
    assert (painted == PointClass.GROUND).all()
    assert seen[0][0] == pytest.approx([0.0, 50.05, 46.0], abs=2e-3)


def test_pixel_off_the_tunnel_is_unassigned(tube: Surface) -> None:
    def classes(points: NDArray[np.float64]) -> NDArray[np.uint8]:
        return np.full(len(points), PointClass.LINING, np.uint8)

    painted = ClassPainter(tube, classes).paint(Raster(np.zeros((2, 20), np.float32), Affine(1, 0, 1090.0, 0, -1, 1.0)))
    assert (painted[:, :10] == PointClass.LINING).all()
    assert (painted[:, 10:] == PointClass.UNASSIGNED).all()


@pytest.fixture
def written(tmp_path: Path) -> Path:
    """Two blocks of a larger image, a third one between them missing."""
    rng = np.random.default_rng(1)
    left = rng.choice(np.array([0, *map(int, PointClass)], np.uint8), (300, 500))
    right = np.full((300, 500), int(PointClass.GROUND), np.uint8)
    path = tmp_path / "x-class.tif"
    write_cog(path, "class", Extent(Affine(0.1, 0, 1000, 0, -0.1, 15), 300, 1500), [(0, left), (1000, right)])
    return path


def test_file_of_classes_explains_itself(written: Path) -> None:
    with rasterio.open(written) as image:
        values = image.read(1)
        colours = image.colormap(1)
        assert (image.dtypes, image.nodata, image.descriptions) == (("uint8",), 0, ("class",))
        assert image.tags(1)["CLASS_2"] == "ground"
        assert image.overviews(1)
        assert image.tags(ns="IMAGE_STRUCTURE")["LAYOUT"] == "COG"
        coarse = image.read(1, out_shape=(75, 375))
    assert {klass: colours[klass][:3] for klass in PointClass} == COLOURS
    assert (values[:, 500:1000] == 0).all()
    assert (values[:, 1000:] == PointClass.GROUND).all()
    assert set(np.unique(values[:, :500])) == {0, *PointClass}
    # a smaller picture holds classes, not means of their codes
    assert set(np.unique(coarse)) <= {0, *PointClass}
    assert list(written.parent.iterdir()) == [written]


def test_gap_in_an_image_of_numbers_holds_nothing(tmp_path: Path) -> None:
    block = np.ones((300, 500), np.float32)
    path = tmp_path / "x-offset.tif"
    write_cog(path, "offset", Extent(Affine(0.1, 0, 1000, 0, -0.1, 15), 300, 1500), [(0, block), (1000, 2 * block)])
    with rasterio.open(path) as image:
        values = image.read(1)
        assert image.units == ("m",)
    assert np.isnan(values[:, 500:1000]).all()
    assert (values[:, :500] == 1).all()
    assert (values[:, 1000:] == 2).all()


def test_smaller_picture_shows_the_commonest_class() -> None:
    values = np.zeros((4, 6), np.uint8)
    values[:2, :2] = [[2, 64], [64, 0]]
    values[2:, :2] = [[0, 0], [0, 66]]
    values[:2, 2:4] = [[2, 2], [67, 67]]
    small = shrink_codes(values, 2)
    assert small[:, :2].tolist() == [[64, 67], [66, pytest.approx(np.nan, nan_ok=True)]]
    assert np.isnan(small[:, 2]).all()


def test_preview_paints_classes_and_names_those_there(tmp_path: Path) -> None:
    values = np.full((100, 2000), np.nan, np.float32)
    values[:40] = PointClass.LINING
    values[60:] = PointClass.GROUND
    path = tmp_path / "class.png"
    preview.draw(path, "x", "class", [preview.Strip(1000.0, values)], Stationing(), 2.5, 0.05)
    pixels = np.asarray(Image.open(path).convert("RGB")).reshape(-1, 3)
    painted = {klass: int((pixels == colour).all(axis=1).sum()) for klass, colour in COLOURS.items()}
    # gaps of 1 m are closed from both sides by 0.3 m; lines of the grid take a little
    assert painted[PointClass.LINING] == pytest.approx(46 * 2000, rel=0.03)
    assert painted[PointClass.GROUND] == pytest.approx(46 * 2000, rel=0.03)
    # less than a legend's square of 15 × 15; letters are drawn in greys
    assert all(painted[klass] < 50 for klass in PointClass if klass not in (PointClass.LINING, PointClass.GROUND))


@pytest.mark.parametrize(("begin", "end", "metres"), [(0.0, 61.3, 70), (43.0, 58.0, 20), (0.0, 100.0, 100), (10.0, 60.0, 50)])
def test_a_preview_is_as_long_as_what_is_held(tmp_path: Path, begin: float, end: float, metres: int) -> None:
    """From ten metres to ten metres; the title has its room beside."""
    values = np.full((40, 1000), np.nan, np.float32)
    values[:, round(begin / 0.1) : round(end / 0.1)] = PointClass.LINING
    preview.draw(tmp_path / "a.png", "x", "class", [preview.Strip(1000.0, values)], Stationing(), 2.0, 0.1)
    strip = np.asarray(Image.open(tmp_path / "a.png").convert("RGB"))
    coloured = np.flatnonzero((strip == COLOURS[PointClass.LINING]).all(axis=2).sum(axis=0) > 20)
    assert len(coloured) == pytest.approx(10 * (end - begin), abs=10)  # lines of the grid take a column each
    assert strip.shape[1] - 10 * metres < 120
    whole = np.full((40, 1000), PointClass.LINING, np.float32)
    both = [preview.Strip(1000.0, whole), preview.Strip(1100.0, values)]
    preview.draw(tmp_path / "b.png", "x", "class", both, Stationing(), 2.0, 0.1)
    assert 1000 < Image.open(tmp_path / "b.png").width < 1120
