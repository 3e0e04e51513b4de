"""Drawn regions, curved faces and built edges on images and points with known truth."""

from __future__ import annotations

import numpy as np
import pytest

from tunneldb.structures.drawn import deviations, drawn, left_out, patch_of
from tunneldb.structures.materials import part_by_material
from tunneldb.structures.results import LeftOut
from tunneldb.structures.segmentation import find_faces
from tunneldb.structures.voxel_moments import VoxelMoments

SIGMA = 0.4


def _patches(*masks, pipe=False, level=2.0, hidden=None):
    """Paint masks (120, 160) on an even face and measure them."""
    rng = np.random.default_rng(1)
    out = []
    for mask in masks:
        drop = (rng.normal(0.0, SIGMA, mask.shape) + level * mask).astype(np.float32)
        rows, columns = np.nonzero(mask)
        part = mask[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1]
        judged = np.ones(mask.shape, np.bool_) if hidden is None else ~hidden
        out.append(patch_of(part, (int(rows.min()), int(columns.min())), 0.01, drop, judged, SIGMA, pipe=pipe))
    return out


def _image():
    return np.mgrid[:120, :160]


def test_label_is_drawn_and_blot_is_not():
    row, column = _image()
    label = (abs(row - 50) < 12) & (abs(column - 70) < 30)
    angle = np.arctan2(row - 50, column - 70)
    blot = np.hypot(row - 50, column - 70) < 20 + 4 * np.sin(3 * angle) + 2 * np.sin(7 * angle)
    assert drawn(_patches(label)) == ["label"]
    assert drawn(_patches(blot)) == [None]


def test_tilted_plate_is_straight():
    row, column = _image()
    u, v = 0.8 * (column - 80) + 0.6 * (row - 60), 0.8 * (row - 60) - 0.6 * (column - 80)
    straight, round_, regular = deviations((abs(u) < 30) & (abs(v) < 12))
    assert straight == regular < 0.5 < round_
    flake = (abs(v) < 12) & (u + 0.8 * v > -30) & (u - 0.5 * v < 30)
    straight, _, regular = deviations(flake)
    assert straight < 0.5 < regular


def test_stripes_of_one_width_are_drawn_though_they_end_at_the_rim():
    row, column = _image()
    stripes = [(row < 20) & (abs(column - at - 0.5 * row) < 4) for at in (20, 50, 80, 110)]
    assert drawn(_patches(*stripes)) == ["band"] * 4
    assert drawn(_patches(stripes[0])) == [None]


def test_ring_around_a_pipe_is_drawn():
    _, column = _image()
    ring = abs(column - 80) < 15
    assert drawn(_patches(ring, pipe=True)) == ["band"]

    assert drawn(_patches(ring)) == [None]


def test_ring_hidden_in_part_is_drawn_and_rust_around_a_pipe_is_not():
    row, column = _image()
    hidden = (abs(row - 60) < 8) & (column > 70)
    assert drawn(_patches((abs(column - 80) < 15) & ~hidden, pipe=True, hidden=hidden)) == ["band"]
    wave = 4 * np.sin(row / 6.0) + 3 * np.sin(row / 2.5)
    assert drawn(_patches(abs(column - 80 + wave) < 15, pipe=True)) == [None]


def test_stray_points_have_no_level():
    row, column = _image()
    mask = (abs(row - 50) < 6) & (abs(column - 70) < 6)
    drop = np.random.default_rng(4).normal(2.0, 4.0, mask.shape).astype(np.float32)
    assert patch_of(mask[45:56, 65:76], (45, 65), 0.01, drop, np.ones(mask.shape, np.bool_), SIGMA, pipe=False).stray
    assert not _patches(mask)[0].stray


def test_regions_left_out_are_counted_by_kind():
    row, column = _image()
    label = (abs(row - 50) < 12) & (abs(column - 70) < 30)
    blot = np.hypot(row - 50, column - 70) < 20
    found = left_out(_patches(label, label, blot, blot), ["label", "label", "band", None])
    assert (found.labels, found.bands, found.stray) == (2, 1, 0)
    assert (found + LeftOut(stray=1)).statement == (
        "2 labels, 1 painted band, 1 region of stray points left out: they differ from their surface but are no spots"
    )
    assert LeftOut().statement is None


@pytest.mark.parametrize(("wave", "parts"), [(0.0, 2), (6.0, 1)])
def test_only_a_straight_edge_is_of_another_material(wave, parts):
    rng = np.random.default_rng(2)
    row, column = np.mgrid[:200, :300]
    below = row < 80 + wave * np.sin(column / 25.0)
    image = rng.normal(0.0, SIGMA, row.shape) - 3.0 * below
    assert len(np.unique(part_by_material([image], 0.01))) == parts


def test_wide_vessel_is_one_cylinder():
    rng = np.random.default_rng(3)
    station = np.array([[0.0, -4.0, 1.5]])
    angle, height = rng.uniform(-0.35, 0.35, 150_000), rng.uniform(0.0, 3.0, 150_000)
    xyz = np.column_stack([6.0 * np.sin(angle), 6.0 - 6.0 * np.cos(angle), height])
    ray = xyz - station[0]
    xyz += rng.normal(0.0, 0.0015, len(xyz))[:, None] * ray / np.linalg.norm(ray, axis=1, keepdims=True)
    moments = VoxelMoments(station.mean(axis=0))
    moments.add(xyz, np.zeros(len(xyz), np.int32))
    moments.complete()
    faces = find_faces(moments, station).faces
    assert faces.models[0, 6] == pytest.approx(6.0, rel=0.01)
    assert faces.points[0] > 0.95 * len(xyz)


def test_straight_regions_with_the_contrast_of_bands_are_parts_of_bands():
    row, column = _image()
    stripes = [(row < 20) & (abs(column - at - 0.5 * row) < 4) for at in (20, 50, 80, 110)]
    part = (row > 100) & (abs(column - 80) < 14)
    assert drawn(_patches(*stripes, part)) == ["band"] * 5
    assert drawn(_patches(*stripes[:2], part)) == [None] * 3
