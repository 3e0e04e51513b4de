"""Map of a survey's axis in a report: axis, ends, grid of coordinates, north arrow and scale bar."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from shapely.geometry import LineString

from tunneldb.arrays import Float
from tunneldb.report.drawing import line_path

WIDTH, HEIGHT, MARGIN = 360.0, 230.0, 30.0
"""Size of the frame, and distance of the axis from it, units of the drawing (about pixels on a phone)."""

LABEL_BELOW, LABEL_ABOVE = 15.0, -8.0
"""Offset of the label of an end, downwards."""

GRID_LINES = 4
"""Approximate number of grid lines in the direction of the width."""

BAR_SHARE = 0.3
"""Maximum length of the scale bar, share of the width."""


@dataclass(frozen=True)
class LocationMap:
    """Map of an axis, drawn in a frame of WIDTH × HEIGHT with x to the right (east) and y down (south).

    Attributes
    ----------
    line : str
        SVG path of the axis.
    ends : list of (float, float, float, str)
        Place of the first and the last point, y of its label, and the label.
    eastings, northings : list of (float, str)
        Place and value of the grid lines: x of eastings, y of northings.
    bar : float
        Length of the scale bar in the drawing.
    bar_label : str
        Its length, with unit.
    bar_left, arrow_left : bool
        True if scale bar and north arrow are at the left edge: an end of the axis is at the right.
    """

    line: str
    ends: list[tuple[float, float, float, str]]
    eastings: list[tuple[float, str]]
    northings: list[tuple[float, str]]
    bar: float
    bar_label: str
    bar_left: bool
    arrow_left: bool


def draw_location(axis: Float, labels: tuple[str, str]) -> LocationMap:
    """Draw an axis on a map.

    Parameters
    ----------
    axis : (n, 2) float64 array
        Vertices of the axis, easting and northing, m; at least two.
    labels : (str, str)
        Labels of its first and last point.
    """
    low, high = axis.min(axis=0), axis.max(axis=0)
    size = np.array([WIDTH, HEIGHT]) - 2 * MARGIN
    scale = float(np.min(size / np.maximum(high - low, 1e-3)))
    middle = (low + high) / 2

    def place(points: Float) -> Float:
        return np.asarray((points - middle) * [scale, -scale] + [WIDTH / 2, HEIGHT / 2])

    west, south = middle - np.array([WIDTH, HEIGHT]) / 2 / scale
    east, north = middle + np.array([WIDTH, HEIGHT]) / 2 / scale
    step = round_length(WIDTH / scale / GRID_LINES)
    bar = round_length(BAR_SHARE * WIDTH / scale)
    drawn = place(axis)
    ends = drawn[[0, -1]]
    right = ends[:, 0] > WIDTH / 2
    # the label is on the side of the end that the axis leaves free
    beside = np.where(drawn[[1, -2], 1] < ends[:, 1], LABEL_BELOW, LABEL_ABOVE)
    return LocationMap(
        line=line_path(np.array(LineString(drawn).simplify(0.2).coords), 1),
        ends=[(x, y, y + off, label) for (x, y), off, label in zip(ends.tolist(), beside.tolist(), labels, strict=True)],
        eastings=[((x - west) * scale, f"{x:.0f}") for x in _multiples(west, east, step)],
        northings=[((north - y) * scale, f"{y:.0f}") for y in _multiples(south, north, step)],
        bar=bar * scale,
        bar_label=f"{bar / 1000:g} km" if bar >= 1000 else f"{bar:g} m",
        bar_left=bool(np.any(right & (ends[:, 1] > HEIGHT / 2))),
        arrow_left=bool(np.any(right & (ends[:, 1] <= HEIGHT / 2))),
    )


def round_length(most: float) -> float:
    """Return the greatest of 1, 2 and 5 times a power of ten, at least 1 m, that is not above a length, m."""
    power = 10.0 ** np.floor(np.log10(max(most, 1.0)))
    return float(max(factor * power for factor in (1, 2, 5) if factor * power <= max(most, 1.0)))


def _multiples(low: float, high: float, step: float) -> Sequence[float]:
    return [float(n * step) for n in range(int(np.ceil(low / step)), int(np.floor(high / step)) + 1)]
