"""Drips: small dark components below a wet patch, on the path of the water, belong to it."""

from __future__ import annotations

import numpy as np

from tunneldb.anomalies.runs import Components, pixels_of
from tunneldb.arrays import Bool, Int64
from tunneldb.raster.grid import PixelGrid

MAX_GAP = 0.12
"""Maximum length of dry gaps in water that runs down a wall, m."""

MAX_WIDTH = 0.3
"""Maximum width of a drip, m."""

MAX_WIDTH_SPACINGS = 1.5
"""Maximum width of a drip in spacings: if profiles are far apart, it shows on a single one."""


def attach_drips(components: Components, wanted: Bool, cut: Bool, grid: PixelGrid, spacing: float = 0.0) -> tuple[Int64, Int64]:
    """Assign drips to the component above them.

    A drip is narrower than MAX_WIDTH, smaller than the component above, and begins within MAX_GAP of it, towards the crown, or
    of another of its drips.

    Parameters
    ----------
    components : Components
        Components of the dark pixels.
    wanted : (k,) bool array
        True for regions in their own right: drips may be below them.
    cut : (k,) bool array
        True if an end of the kilometre cuts the component: its size is unknown, so it is no drip, and all others count as
        smaller.
    grid : PixelGrid
        The pixels.
    spacing : float
        Distance of profiles along the tunnel, m; 0 if they are as close as pixels.

    Returns
    -------
    whole : (k,) int array
        Component that each one is a part of; itself if of none.
    bridges : (m, 4) int array
        Row, first column, column behind the last one and whole of the pixels that connect the drips to it.
    """
    crown = grid.bottom + grid.rows  # rows before this one lie at arcs above 0
    gap = max(1, round(MAX_GAP / grid.pixel))
    narrow = (components.width <= max(MAX_WIDTH, MAX_WIDTH_SPACINGS * spacing) / grid.pixel) & ~cut
    above, row, column, distance = _above(components, narrow, grid.rows, crown, gap)
    whole = np.arange(len(components.pixels))
    for _ in range(8):  # chains of drips
        drip = np.flatnonzero((above >= 0) & (whole == np.arange(len(whole))))
        root = whole[above[drip]]
        joined = wanted[root] & (cut[root] | (components.pixels[drip] < components.pixels[root])) & (root != drip)
        if not joined.any():
            break
        whole[drip[joined]] = root[joined]
    # A component with drips may itself be a drip of a larger one.
    while not np.array_equal(whole, whole[whole]):
        whole = whole[whole]
    drips = np.flatnonzero(whole != np.arange(len(whole)))
    bridges = [
        (row[k] + (step if row[k] < crown else -step), column[k], column[k] + 1, whole[k])
        for k in drips.tolist()
        for step in range(1, int(distance[k]))
    ]
    return whole, np.array(bridges, dtype=np.int64).reshape(-1, 4)


def _above(components: Components, narrow: Bool, rows: int, crown: int, gap: int) -> tuple[Int64, Int64, Int64, Int64]:
    """Find the nearest other component within a gap above each narrow one.

    Returns
    -------
    above, row, column, distance : (k,) int arrays
        Component, -1 for none; its nearest pixel, the first of several, and the distance in pixels.
    """
    runs, count = components.runs, len(narrow)
    above, row, column = np.full(count, -1, np.int64), np.zeros(count, np.int64), np.zeros(count, np.int64)
    distance = np.full(count, gap + 1, np.int64)
    seeking = narrow[components.label]
    i, j = pixels_of(runs[seeking])
    own = np.repeat(components.label[seeking], (runs[:, 2] - runs[:, 1])[seeking])
    up = np.where(i < crown, 1, -1)
    wide = int(runs[:, 2].max(initial=0)) + 1
    behind = runs[:, 0] * wide + runs[:, 2]
    for step in range(1, gap + 1):
        m = i + up * step
        run = np.minimum(np.searchsorted(behind, m * wide + j, side="right"), len(runs) - 1)
        hit = (runs[run, 0] == m) & (runs[run, 1] <= j) & (j < runs[run, 2])
        other = np.flatnonzero(hit & (components.label[run] != own) & (above[own] < 0))
        found, first = np.unique(own[other], return_index=True)
        first = other[first]
        above[found], distance[found] = components.label[run[first]], step
        row[found], column[found] = i[first], j[first]
        free = ~hit & (above[own] < 0) & (m >= 0) & (m < rows)
        i, j, own, up = i[free], j[free], own[free], up[free]
    return above, row, column, distance
