"""Thickness between two surfaces held against one profile, against closed formulas of eccentric circles and shapely."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from support.curved_lining import circle
from support.eccentric_circles import held_against, ray

from tunneldb.measures.thickness.compute import resampled, section_thickness
from tunneldb.shape.outline import Outline


@pytest.mark.parametrize("reference", [4.0, 4.4])
def test_between_two_eccentric_circles(reference: float) -> None:
    """Excavation of 4.4 m radius, lining of 4.0 m that lies 60 mm off, held against either layer's profile."""
    outline = circle(reference)
    before, after = (4.4, 0.02, -0.01), (4.0, -0.03, 0.02)
    found = section_thickness(held_against(outline, *before), held_against(outline, *after), outline)
    count = len(found.thickness)
    angle = np.pi + 2.0 * np.pi * (np.arange(count) + 0.5) / count  # a closed outline begins straight below
    assert found.thickness == pytest.approx(ray(angle, *before) - ray(angle, *after), abs=1e-4)
    assert found.least[0] == pytest.approx(0.4 - np.hypot(0.05, 0.03), abs=2e-4)
    assert found.area == pytest.approx(np.pi * (4.4**2 - 4.0**2), rel=1e-3)
    assert found.compared_length == pytest.approx(2.0 * np.pi * reference, rel=1e-9)
    assert found.area_by == pytest.approx([0.0, 0.0], abs=1e-9)  # a whole ring is moved: nothing is put on


def test_of_a_horseshoe_where_a_part_was_not_seen() -> None:
    arch = np.array([[-5.0, -2.0], [-5.0, 0.0], [5.0, 0.0], [5.0, -2.0]])
    outline = Outline.of(arch, np.array([0.0, -1.0, 0.0, 0.0]), closed=False)
    count = 197
    before, after = np.full(count, -0.3), np.full(count, -0.05)
    after[:40] = np.nan  # of the left wall, and a little of the vault
    found = section_thickness(before, after, outline)
    ring = shapely.Point(0.0, 0.0).buffer(5.3, 4096) - shapely.Point(0.0, 0.0).buffer(5.05, 4096)
    each = outline.length / count
    start = (40 * each - 2.0) / 5.0  # angle of the vault that was not seen
    area = ring.area / 2.0 * (1.0 - start / np.pi) + 2.0 * 0.25
    assert found.area == pytest.approx(area, rel=1e-3)
    assert found.compared_length == pytest.approx(157 * each)
    assert np.isnan(found.thickness[:40]).all()


def test_cells_of_two_lengths_are_compared_in_the_longer() -> None:
    outline = circle(4.0)
    fine, coarse = held_against(outline, 4.1, 0.05, 0.0), held_against(outline, 4.0, 0.0, 0.0, 0.1)
    found = section_thickness(fine, coarse, outline)
    assert len(found.thickness) == len(coarse) < len(fine)
    angle = np.pi + 2.0 * np.pi * (np.arange(len(coarse)) + 0.5) / len(coarse)
    assert found.thickness == pytest.approx(ray(angle, 4.1, 0.05, 0.0) - 4.0, abs=1e-4)
    holed = np.array([1.0, np.nan, np.nan, 3.0, 3.0, 3.0])
    assert resampled(holed, 2) == pytest.approx([np.nan, 3.0], nan_ok=True)
