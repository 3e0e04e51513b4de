"""Upper edges of the walls of a sonar scan, which are at the water level, seen from below.

Above them a scan shows only echoes off the water's surface, which are fewer. Each metre of either wall gives an edge. A beam
whose axis passes less than half its width above the edge still hits the wall; this is corrected.
"""

from __future__ import annotations

import numpy as np

from tunneldb.arrays import Float

STRIP = 1.0  # m along a wall
MIN_DISTANCE, MAX_DISTANCE = 2.0, 9.0  # m along the canal, from the sonar
WALL_THICKNESS = 0.1  # of a wall, m
BIN = 0.05  # m of height
MIN_POINTS = 60  # of a strip
SMOOTHING_BINS = 3  # bins
FAN_MARGIN = np.radians(2.0)  # below the fan's upper end; closer edges may be those of the fan
BEAM = np.radians(1.0)


def find_waterline(points: Float, walls: tuple[float, float], slopes: tuple[float, float]) -> Float:
    """Return the edges (k, 3) of the walls of a level scan (n, 3), in its axes: x along the canal, y across, z up.

    Parameters
    ----------
    walls, slopes
        Positions y of the two walls at z = 0, and change of y per metre of height.
    """
    reach = np.linalg.norm(points, axis=1)
    elevation = points[:, 2] / np.maximum(reach, 1e-6)
    fan = float(np.percentile(elevation[reach > 1.0], 99.8)) if (reach > 1.0).any() else 0.0
    edges = []
    for place, slope in zip(walls, slopes, strict=True):
        wall = points[np.abs(points[:, 1] - place - slope * points[:, 2]) < WALL_THICKNESS]
        strip = np.floor(wall[:, 0] / STRIP).astype(np.int64)
        for k in np.unique(strip):
            middle = (k + 0.5) * STRIP
            if not MIN_DISTANCE < abs(middle) < MAX_DISTANCE:
                continue
            height = _edge(wall[strip == k, 2])
            if height is None:
                continue
            y = place + slope * height
            distance = float(np.linalg.norm([middle, y, height]))
            if height / distance < np.sin(np.arcsin(np.clip(fan, -1.0, 1.0)) - FAN_MARGIN):
                edges.append([middle, y, height - 0.5 * BEAM * distance])
    return np.array(edges).reshape(-1, 3)


def _edge(height: Float) -> float | None:
    """Return the height above which a strip of wall has less than half as many points as below; None if there is none."""
    if len(height) < MIN_POINTS:
        return None
    low = float(height.min())
    histogram = np.bincount(((height - low) / BIN).astype(np.int64)).astype(np.float64)
    smooth = np.convolve(histogram, np.ones(SMOOTHING_BINS) / SMOOTHING_BINS, mode="same")
    usual = float(np.median(smooth[smooth > 0.2 * smooth.max()]))
    above = np.flatnonzero(smooth > 0.5 * usual)
    # between the last bin with at least half and the next
    return low + (float(above[-1]) + 1.0) * BIN
