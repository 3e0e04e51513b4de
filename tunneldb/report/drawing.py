"""Shapes of a report's drawings as SVG paths: outlines of leaks, cross-sections, the tunnel at a glance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import LineString, Polygon

from tunneldb.arrays import Float
from tunneldb.report.data import CoverageBins, Leak

STEPS = (1.0, 2.0, 5.0, 10.0, 20.0, 25.0, 50.0, 100.0, 200.0, 250.0, 500.0, 1000.0, 2000.0, 5000.0, 10_000.0)
"""Possible distances between ticks, and lengths of bins, m."""


def step_for(length: float, most: int) -> float:
    """Return the least of STEPS that divides a length, m, into at most so many parts."""
    return next((step for step in STEPS if length / step <= most), STEPS[-1])


def ticks(low: float, high: float, step: float) -> list[float]:
    """Return multiples of a step from low to high, both to the millimetre."""
    low, high = round(low, 3), round(high, 3)
    return [float(n * step) for n in range(int(np.ceil(low / step - 1e-9)), int(np.floor(high / step + 1e-9)) + 1)]


def line_path(xy: Float, decimals: int = 2) -> str:
    """Return the path through points (n, 2)."""
    return "M" + "L".join(f"{_number(x, decimals)} {_number(y, decimals)}" for x, y in xy)


def outline_path(outline: Polygon, west: float, north: float, tolerance: float) -> str:
    """Return the path of an outline in the unrolled plane, simplified, m: x from ``west``, y down from ``north``."""
    simple = outline.simplify(tolerance)
    rings = [simple.exterior, *simple.interiors]
    return "".join(line_path(np.array(ring.coords)[:-1, :2] * [1, -1] + [-west, north]) + "Z" for ring in rings)


def _number(value: float, decimals: int) -> str:
    """Return the shortest text of a rounded number."""
    text = f"{value:.{decimals}f}".rstrip("0").rstrip(".") if decimals else f"{value:.0f}"
    return "0" if text in ("-0", "") else text


@dataclass(frozen=True)
class Section:
    """A cross-section of the lining, looking up-chainage; m, x to the right of the axis, y above it.

    Attributes
    ----------
    arc : (n,) array
        Arc of its nodes, growing, m.
    x, y : (n,) arrays
        Their places.
    """

    arc: Float
    x: Float
    y: Float

    @classmethod
    def of(cls, radius: Sequence[float], arc: Sequence[float]) -> Section:
        """Set the radius and the arc at each whole degree from -180 to 180, m."""
        angle = np.radians(np.arange(-180.0, 181.0))
        far = np.asarray(radius, dtype=np.float64)
        return cls(np.asarray(arc, dtype=np.float64), far * np.sin(angle), far * np.cos(angle))

    def path(self) -> str:
        """Return the closed path to 1 cm, y downwards."""
        line = LineString(np.column_stack([self.x, -self.y])).simplify(0.01)
        return line_path(np.array(line.coords)) + "Z"

    def band(self, arc_from: float, arc_to: float) -> str:
        """Return the path of the part between two arcs, m."""
        inner = self.arc[(self.arc > arc_from) & (self.arc < arc_to)]
        arcs = np.concatenate([[arc_from], inner, [arc_to]])
        x, y = (np.interp(arcs, self.arc, v) for v in (self.x, self.y))
        return line_path(np.array(LineString(np.column_stack([x, -y])).simplify(0.01).coords))

    def box(self) -> str:
        """Return a ``viewBox`` with a margin of 0.7 m for the clock's hours."""
        west, east, low, high = self.x.min() - 0.7, self.x.max() + 0.7, self.y.min() - 0.7, self.y.max() + 0.7
        return f"{west:.2f} {-high:.2f} {east - west:.2f} {high - low:.2f}"


def share_path(coverage: CoverageBins, low: float, high: float, base: float, height: float, scale: float = 1.0) -> str:
    """Return the path of the area under the inspected share of lining, in steps; ``base`` is at 0, ``height`` the height of 1.

    x is the chainage from ``low``, times ``scale``; limited to ``low`` and ``high``.
    """
    share = np.nan_to_num(coverage.share)
    parts = []
    for n in np.flatnonzero((coverage.edges[1:] > low) & (coverage.edges[:-1] < high)).tolist():
        left = (max(coverage.edges[n], low) - low) * scale
        right = (min(coverage.edges[n + 1], high) - low) * scale
        if share[n] > 0:
            parts.append(f"M{left:.2f} {base:.2f}V{base - height * share[n]:.2f}H{right:.2f}V{base:.2f}Z")
    return "".join(parts)


def without_detection(coverage: CoverageBins, low: float, high: float) -> list[tuple[float, float]]:
    """Return the stretches between two chainages, m, in which detection did not run."""
    none = np.isnan(coverage.share)
    turns = np.flatnonzero(np.diff(np.concatenate([[False], none, [False]]).astype(np.int8))).reshape(-1, 2)
    ends = [(max(float(coverage.edges[a]), low), min(float(coverage.edges[b]), high)) for a, b in turns.tolist()]
    return [(a, b) for a, b in ends if b > a]


def wet_bins(low: Float, high: Float, area: Float, edges: Float) -> Float:
    """Return the wet area in bins of chainage (n,), m²: each leak in the stretch is spread evenly over its length there.

    Parameters
    ----------
    low, high, area : (k,) float64 arrays
        Begin and end of leaks, m, and their area in the stretch, m².
    edges : (n + 1,) float64 array
        Edges of the bins, m.
    """
    count = len(edges) - 1
    total = np.zeros(count)
    first = np.clip(np.searchsorted(edges, low, side="right") - 1, 0, count - 1)
    last = np.clip(np.searchsorted(edges, high, side="left") - 1, first, count - 1)
    length = np.minimum(high, edges[-1]) - np.maximum(low, edges[0])
    for further in range(int((last - first).max(initial=-1)) + 1):
        at = np.flatnonzero(first + further <= last)
        n = first[at] + further
        inside = np.minimum(edges[n + 1], high[at]) - np.maximum(edges[n], low[at])
        np.add.at(total, n, area[at] * np.maximum(inside, 0.0) / np.maximum(length[at], 1e-9))
    return total


ROWS = 12
"""Maximum number of rows of numbers beside a strip."""


@dataclass(frozen=True)
class Sign:
    """Number beside a picture that points at a leak.

    Attributes
    ----------
    id : int
        The leak's.
    x, at : float
        Its place and the place of the leak's middle, m.
    row : int
        Its row, from 0, the one next to the picture.
    """

    id: int
    x: float
    at: float
    row: int


def place_signs(leaks: Sequence[Leak], low: float, high: float, width: float) -> list[Sign]:
    """Place numbers of leaks along a strip, those of the largest nearest to it; a digit is ``width`` m wide.

    If they do not fit side by side they are in several rows, at most ROWS; a leak without space there has no number.
    """
    placed: list[list[tuple[float, float]]] = [[] for _ in range(ROWS)]
    signs = []
    for leak in sorted(leaks, key=lambda leak: -leak.area):
        half = width * (len(str(leak.id)) + 1) / 2
        x = float(np.clip(leak.middle, low + half, high - half))
        free = (n for n, row in enumerate(placed) if all(x + half <= left or x - half >= right for left, right in row))
        row = next(free, None)
        if row is not None:
            placed[row].append((x - half, x + half))
            signs.append(Sign(leak.id, x, leak.middle, row))
    return sorted(signs, key=lambda sign: sign.x)


def near(leak: Leak, least: float, shape: float) -> tuple[float, float, float, float]:
    """Return a window around a leak: west, east, south, north, m; with a minimum width, and ``shape`` times as wide as high."""
    west, south, east, north = shapely.bounds(leak.outline)
    width = max(least, 1.5 * (east - west), 1.5 * (north - south) * shape)
    x, y = (west + east) / 2, (south + north) / 2
    return x - width / 2, x + width / 2, y - width / shape / 2, y + width / shape / 2
