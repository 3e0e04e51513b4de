"""Parts flush with a face, seams and windows on images with known truth."""

from __future__ import annotations

import numpy as np
import pytest

from tunneldb.structures.drawn import drawn, left_out, patch_of
from tunneldb.structures.parts import REACH, is_attached, is_seam
from tunneldb.structures.results import LeftOut

SIGMA = 0.4


def _image():
    return np.mgrid[:100, :140]


@pytest.mark.parametrize(("rim", "attached"), [(40, True), (50, False)])
def test_part_beyond_the_rim_is_attached_and_rust_within_it_is_not(rim, attached):
    row, column = _image()
    tab = (row >= 40) & (row < 47) & (abs(column - 70) < 12)
    joist = (row > 20) & (row < rim)
    assert is_attached(tab, joist | tab) is attached


def test_rust_from_rim_to_rim_is_not_attached():
    row, column = _image()
    beam = (row > 40) & (row < 55)
    assert not is_attached(beam & (abs(column - 70) < 12), beam)
    assert not is_attached(beam & (column > 100), beam)


def _line(width, wave=0.0):
    """Draw a line of a width, pixels, each pixel with the share of it that the line covers; a piece of it is found."""
    rng = np.random.default_rng(1)
    row, column = _image()
    off = np.abs(row + 0.5 - (50.0 + 0.1 * column + wave * np.sin(column / 4.0)))
    drop = 4.0 * np.clip(0.5 * width + 0.5 - off, 0.0, min(width, 1.0)) + rng.normal(0.0, SIGMA, row.shape)
    mask = (off < 0.5 * width + 1.0) & (abs(column - 70) < 8)
    return mask, drop.astype(np.float32)


@pytest.mark.parametrize(("width", "wave", "seam"), [(0.8, 0.0, True), (3.0, 0.0, False), (0.8, 4.0, False)])
def test_straight_line_narrower_than_a_pixel_is_a_seam_and_streaks_and_cracks_are_not(width, wave, seam):
    mask, drop = _line(width, wave)
    assert is_seam(mask, drop, np.ones(mask.shape, np.bool_)) is seam


def test_short_line_is_no_seam():
    mask, drop = _line(0.8)
    _, column = _image()
    short = np.where(abs(column - 70) < 8, drop, np.float32(0.0))
    assert not is_seam(mask, short, np.ones(mask.shape, np.bool_))
    assert REACH > 8


def _window(level, scatter, corner=(40, 50)):
    rng = np.random.default_rng(2)
    row, column = _image()
    mask = (row >= corner[0]) & (row < 58) & (column >= corner[1]) & (column < 70)
    drop = rng.normal(0.0, SIGMA, row.shape) + mask * rng.normal(level, scatter, row.shape)
    return patch_of(np.ones((18, 20), np.bool_), corner, 0.01, drop.astype(np.float32), row >= 0, SIGMA, pipe=False)


def test_clear_rectangle_is_a_window_though_it_scatters():
    assert drawn([_window(4.0, 0.0)]) == ["label"]
    assert drawn([_window(4.0, 1.2)]) == ["label"]


def test_parts_and_seams_are_counted():
    patches = [_window(4.0, 0.0)] * 3
    found = left_out(patches, ["part", "seam", "seam"])
    assert found == LeftOut(parts=1, seams=2)
    assert found.statement == "1 attached part, 2 seams left out: they differ from their surface but are no spots"


def test_regions_in_the_paint_of_bands_are_bands_whatever_hides_them():
    row, column = _image()
    rng = np.random.default_rng(3)
    stripes = [(row < 20) & (abs(column - at - 0.5 * row) < 4) for at in (15, 45, 75, 105)]
    part = (row > 60) & (np.hypot(row - 70, column - 60) < 9)
    drop = (rng.normal(0.0, SIGMA, row.shape) + 2.5 * np.any([*stripes, part], axis=0)).astype(np.float32)
    patches = []
    for mask in (*stripes, part):
        rows, columns = np.nonzero(mask)
        box = mask[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1]
        corner = (int(rows.min()), int(columns.min()))
        patches.append(patch_of(box, corner, 0.01, drop, row >= 0, SIGMA, pipe=False))
    assert drawn(patches) == ["band"] * 5
    assert drawn(patches[2:]) == [None] * 3
