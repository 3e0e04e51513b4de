"""Values of an image under an outline and around it: painted images, and published values of lightness."""

from __future__ import annotations

import numpy as np
import pytest
from affine import Affine
from shapely.geometry import Point, box

from tunneldb.raster.geotiff import Raster
from tunneldb.raster.surroundings import brightness, compare

SIDE = 0.02
OUTLINE = box(10.0, 1.0, 10.6, 1.4)


def picture(paint, west: float = 8.0, columns: int = 250) -> Raster:
    """An image whose values are a function of chainage and arc."""
    x = west + (np.arange(columns) + 0.5) * SIDE
    y = 3.0 - (np.arange(200) + 0.5) * SIDE
    return Raster(paint(*np.meshgrid(x, y)).astype(np.float32), Affine(SIDE, 0, west, 0, -SIDE, 3.0))


def inside(x, y, area=OUTLINE):
    west, low, east, high = area.bounds
    return (x > west) & (x < east) & (y > low) & (y < high)


def test_mean_surroundings_and_spread() -> None:
    noise = np.random.default_rng(1).normal(0.0, 0.3, (200, 250))
    found = compare(OUTLINE, [], [picture(lambda x, y: 11.0 - 0.8 * inside(x, y) + noise)])
    assert found is not None
    assert found.mean == pytest.approx(10.2, abs=0.05)
    assert found.surroundings == pytest.approx(11.0, abs=0.05)
    assert found.spread == pytest.approx(0.3, rel=0.1)
    assert found.share == 1.0


def test_a_slope_along_the_tunnel_is_no_contrast() -> None:
    found = compare(OUTLINE, [], [picture(lambda x, y: 5.0 * x)])
    assert found is not None
    assert found.mean - found.surroundings == pytest.approx(0.0, abs=0.05)


def test_other_findings_and_the_rim_are_no_surroundings() -> None:
    beside = box(10.7, 0.5, 11.2, 2.0)

    def paint(x, y):
        rim = inside(x, y, OUTLINE.buffer(0.04)) & ~inside(x, y)
        return 11.0 - 0.8 * inside(x, y) - 5.0 * rim - 3.0 * inside(x, y, beside)

    found = compare(OUTLINE, [beside], [picture(paint)])
    assert found is not None
    assert (found.mean, found.surroundings, found.spread) == pytest.approx((10.2, 11.0, 0.0), abs=1e-5)


def test_blocks_beside_each_other_are_one_image() -> None:
    def paint(x, y):
        return 11.0 + np.sin(9 * x) - 0.8 * inside(x, y)

    whole = compare(OUTLINE, [], [picture(paint)])
    parts = compare(OUTLINE, [], [picture(paint, 8.0, 115), picture(paint, 8.0 + 115 * SIDE, 135)])
    assert whole is not None
    assert parts is not None
    assert parts.mean == pytest.approx(whole.mean)
    assert parts.surroundings == pytest.approx(whole.surroundings)


def test_too_little_is_nothing() -> None:
    plain = picture(lambda x, y: np.where(x < 10.31, 11.0, np.nan))
    assert compare(OUTLINE, [], [plain]) is not None  # just over half of it is shown
    assert compare(OUTLINE, [], [picture(lambda x, y: np.where(x < 10.29, 11.0, np.nan))]) is None
    assert compare(OUTLINE, [], [picture(lambda x, y: np.where(inside(x, y), 11.0, np.nan))]) is None  # no surroundings
    assert compare(Point(10.0, 1.0).buffer(0.01), [], [picture(lambda x, y: x)]) is None  # smaller than four pixels
    assert compare(box(90.0, 1.0, 91.0, 2.0), [], [plain]) is None  # beside the image
    assert compare(OUTLINE, [], []) is None


def test_lightness_of_the_primaries() -> None:
    """Red, green and blue of sRGB in CIELAB, as Bruce Lindbloom's calculator gives them (D65)."""
    primaries = np.array([[[255.0, 0.0, 0.0], [0.0, 255.0, 0.0], [0.0, 0.0, 255.0]]], np.float32)
    assert brightness(primaries)[0] == pytest.approx([53.24, 87.73, 32.30], abs=0.02)


def test_lightness_of_greys() -> None:
    """CIE 15: white is 100, black 0; sRGB 119 is L* 50 (linear 18.4 %)."""
    greys = np.repeat(np.array([[0.0, 119.0, 255.0]], np.float32)[..., None], 3, axis=2)
    assert brightness(greys)[0] == pytest.approx([0.0, 50.0, 100.0], abs=0.1)
