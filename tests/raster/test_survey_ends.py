"""Beyond the survey's first and last point nothing is lining, and no point is taken."""

from __future__ import annotations

import numpy as np
from support.straight_tunnel import straight

from tests.raster.test_blending import FLOOR
from tunneldb.geometry.section_outliers import MAX_GIRTH_SHARE, SectionOutliers
from tunneldb.raster.accumulator import Accumulator
from tunneldb.raster.grid import Grid
from tunneldb.raster.image import lining_image
from tunneldb.raster.observation import Observer
from tunneldb.raster.rasterize import Projector
from tunneldb.raster.state import PixelState

PIXEL, ENDS = 0.1, (12.34, 40.0)
FIRST, STOP = 124, 400
"""Columns, of kilometre 0, that lie wholly between the ends."""


def test_no_lining_and_no_points_beyond_the_ends() -> None:
    surface = straight(np.full(361, 4.0))
    grid = Grid.covering(0, PIXEL, -12.0, 12.0)
    observer = Observer.of(surface, 0, (0.5, 1.2), None, FLOOR, ends=ENDS)
    with Accumulator(grid) as image:
        picture = lining_image(image, None, observer, SectionOutliers.of(surface, MAX_GIRTH_SHARE), 0.02, lambda window: None)
    unseen = np.flatnonzero((picture.state == PixelState.EMPTY).any(axis=0))
    assert (unseen[0], unseen[-1]) == (FIRST, STOP - 1)
    target = Projector.of(observer, grid, 0.0).target
    assert (target.first, target.stop) == (FIRST, STOP)


def test_without_ends_all_columns_count() -> None:
    grid = Grid.covering(3, 0.05, -1.0, 1.0, 40)
    assert grid.columns_between(-np.inf, np.inf) == slice(0, grid.columns)
    assert grid.columns_between(9000.0, 9100.0) == slice(grid.columns, grid.columns)
    assert grid.columns_between(0.0, 100.0) == slice(0, 0)
