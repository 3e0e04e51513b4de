"""Tracing of masks: length and width of lines that were drawn, in all directions, with rough rims, rings and crossings."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from scipy import ndimage

from tunneldb.raster.tracing.lines import Centreline, trace
from tunneldb.raster.tracing.thinning import thin

SIZE = 400


def draw(line: list[tuple[float, float]] | np.ndarray, width: float) -> np.ndarray:
    row, column = np.mgrid[:SIZE, :SIZE] + 0.5
    return shapely.contains_xy(shapely.buffer(shapely.LineString(line), width / 2, cap_style="flat"), column, row)


def traced(mask: np.ndarray) -> list[tuple[Centreline, float]]:
    """The lines with their lengths, the longest first."""
    found = trace(np.argwhere(thin(mask)), np.argwhere(mask))
    lengths = [float(np.hypot(*np.diff(line.points, axis=0).T).sum()) for line in found]
    return sorted(zip(found, lengths, strict=True), key=lambda pair: -pair[1])


@pytest.mark.parametrize("width", [2.0, 3.0, 5.0, 12.0])
@pytest.mark.parametrize("angle", range(0, 180, 15))
def test_a_straight_line_has_its_length_and_width(angle: int, width: float) -> None:
    way = 150 * np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
    middle = np.array([200.3, 200.7])
    mask = draw([middle - way, middle + way], width)
    ((line, length),) = traced(mask)
    assert length == pytest.approx(300, rel=0.02)
    assert line.pixels == mask.sum()
    assert line.pixels / length == pytest.approx(width, abs=1.0)


@pytest.mark.parametrize("width", [3, 5, 8])
def test_a_rough_rim_changes_little(width: int) -> None:
    rng = np.random.default_rng(0)
    points = [(20, 30), (200, 60), (380, 350)]
    mask = draw(points, width)
    rim, beside = mask & ~ndimage.binary_erosion(mask), ndimage.binary_dilation(mask) & ~mask
    flipped = rng.random(mask.shape) < 0.1
    (line, length), *others = traced((mask & ~(rim & flipped)) | (beside & flipped))
    assert length == pytest.approx(shapely.LineString(points).length, rel=0.02)
    assert line.pixels / length == pytest.approx(width, abs=0.5)
    assert all(short < 20 for _, short in others)


def test_a_ring_is_closed_and_two_crossing_lines_are_two() -> None:
    turn = np.linspace(0, 2 * np.pi, 200)
    ((_, length),) = traced(draw(np.column_stack([200 + 100 * np.cos(turn), 200 + 100 * np.sin(turn)]), 3))
    assert length == pytest.approx(200 * np.pi, rel=0.01)
    lines = [(50, 50), (350, 320)], [(60, 350), (340, 40)]
    found = traced(draw(lines[0], 4) | draw(lines[1], 4))
    assert [length for _, length in found] == pytest.approx(
        sorted((shapely.LineString(line).length for line in lines), reverse=True), rel=0.02
    )
