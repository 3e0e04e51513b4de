"""Random textures and shapes on the unrolled lining.

Everything here works on a regular grid over the unrolled lining: rows follow the chainage ``s``, columns the girth ``u``.
A shape is a `Shape`: a window of the grid with signed distances in metres, positive within. Painting and the outline
of truth both come from it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


def _axis_weights(count: int, cell: float, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, int]:
    """Index of the lower knot, smooth weight and number of knots for value noise along one axis."""
    position = np.arange(count, dtype=np.float32) / np.float32(cell) + np.float32(rng.random())
    lower = position.astype(np.int32)
    weight = position - lower
    return lower, weight * weight * (3 - 2 * weight), int(lower[-1]) + 2


def fractal(
    shape: tuple[int, int], cell: tuple[float, float], rng: np.random.Generator, octaves: int = 3, persistence: float = 0.55
) -> np.ndarray:
    """Smooth noise of about zero mean and unit deviation.

    Parameters
    ----------
    shape : tuple
        Rows and columns.
    cell : tuple
        Size of the largest waves in cells of the grid, along rows and columns.
    rng : Generator
        Source of chance.
    octaves, persistence : int, float
        Number of scales, each half as large as the one before, and how much weaker each is.
    """
    total = np.zeros(shape, np.float32)
    power = 0.0
    for octave in range(octaves):
        rows, row_weight, row_knots = _axis_weights(shape[0], max(cell[0] / 2**octave, 1.0), rng)
        columns, column_weight, column_knots = _axis_weights(shape[1], max(cell[1] / 2**octave, 1.0), rng)
        knots = rng.standard_normal((row_knots, column_knots)).astype(np.float32)
        tall = knots[rows] + (knots[rows + 1] - knots[rows]) * row_weight[:, None]
        gain = persistence**octave
        total += gain * (tall[:, columns] + (tall[:, columns + 1] - tall[:, columns]) * column_weight[None, :])
        power += (0.74 * gain) ** 2
    return total / np.float32(np.sqrt(power))


def smoothstep(value: np.ndarray) -> np.ndarray:
    """From 0 to 1 with soft ends, one half at one half."""
    clipped = np.clip(value, 0.0, 1.0)
    return clipped * clipped * (3 - 2 * clipped)


@dataclass(frozen=True)
class Grid:
    """Grid over the unrolled lining."""

    length: float
    girth: float
    cell: float = 0.01

    @property
    def shape(self) -> tuple[int, int]:
        """Rows along the chainage, columns along the girth."""
        return int(np.ceil(self.length / self.cell)), int(np.ceil(self.girth / self.cell))

    def window(self, s0: float, s1: float, u0: float, u1: float) -> tuple[slice, slice]:
        """Slices that cover a rectangle, as far as it lies on the grid."""
        rows, columns = self.shape
        first_row, last_row = int(np.floor(s0 / self.cell)), int(np.ceil(s1 / self.cell))
        first_column, last_column = int(np.floor(u0 / self.cell)), int(np.ceil(u1 / self.cell))
        first_row, first_column = np.clip(first_row, 0, rows), np.clip(first_column, 0, columns)
        return slice(first_row, np.clip(last_row, first_row, rows)), slice(
            first_column, np.clip(last_column, first_column, columns)
        )

    def coordinates(self, window: tuple[slice, slice]) -> tuple[np.ndarray, np.ndarray]:
        """Chainage (as a column) and girth (as a row) of the centres of cells of a window."""
        s = (np.arange(window[0].start, window[0].stop, dtype=np.float32) + 0.5) * self.cell
        u = (np.arange(window[1].start, window[1].stop, dtype=np.float32) + 0.5) * self.cell
        return s[:, None], u[None, :]


@dataclass
class Shape:
    """A window of the grid, and signed distances in it (metres, positive within)."""

    window: tuple[slice, slice]
    distance: np.ndarray

    def ragged(self, grid: Grid, rng: np.random.Generator, amount: float, scale_s: float, scale_u: float) -> Shape:
        """The same shape with a torn outline; ``amount`` in metres, scales of the tears in metres along both axes."""
        if self.distance.size:
            tears = fractal(self.distance.shape, (scale_s / grid.cell, scale_u / grid.cell), rng, octaves=4)
            self.distance = self.distance + np.float32(amount) * np.clip(tears, -2.2, 2.2)
        return self


def chain(grid: Grid, points: list[tuple[float, float]], radii: list[float], margin: float = 0.6) -> Shape:
    """A line of changing half width through points (chainage, girth)."""
    knots, widths = np.asarray(points, np.float32), np.asarray(radii, np.float32)
    reach = float(widths.max()) + margin
    window = grid.window(
        knots[:, 0].min() - reach, knots[:, 0].max() + reach, knots[:, 1].min() - reach, knots[:, 1].max() + reach
    )
    s, u = grid.coordinates(window)
    best = np.full((s.shape[0], u.shape[1]), -9.0, np.float32)
    if len(knots) == 1:
        return Shape(window, widths[0] - np.hypot(s - knots[0, 0], u - knots[0, 1]))
    for start, end, first, last in zip(knots[:-1], knots[1:], widths[:-1], widths[1:], strict=True):
        local = grid.window(
            min(start[0], end[0]) - reach,
            max(start[0], end[0]) + reach,
            min(start[1], end[1]) - reach,
            max(start[1], end[1]) + reach,
        )
        if local[0].stop <= local[0].start or local[1].stop <= local[1].start:
            continue
        s, u = grid.coordinates(local)
        step = end - start
        along = np.clip(((s - start[0]) * step[0] + (u - start[1]) * step[1]) / max(float(step @ step), 1e-9), 0, 1)
        away = np.hypot(s - start[0] - along * step[0], u - start[1] - along * step[1])
        inner = tuple(slice(a.start - w.start, a.stop - w.start) for a, w in zip(local, window, strict=True))
        np.maximum(best[inner], first + (last - first) * along - away, out=best[inner])
    return Shape(window, best)


def ellipse(grid: Grid, s: float, u: float, half_s: float, half_u: float, margin: float = 0.5) -> Shape:
    """An ellipse round a point."""
    window = grid.window(s - half_s - margin, s + half_s + margin, u - half_u - margin, u + half_u + margin)
    along, girth = grid.coordinates(window)
    radius = np.hypot((along - s) / half_s, (girth - u) / half_u)
    return Shape(window, ((1 - radius) * np.float32(min(half_s, half_u))).astype(np.float32))


def box(grid: Grid, s0: float, s1: float, u0: float, u1: float, margin: float = 0.3) -> Shape:
    """A rectangle."""
    window = grid.window(s0 - margin, s1 + margin, u0 - margin, u1 + margin)
    s, u = grid.coordinates(window)
    return Shape(window, np.minimum(np.minimum(s - s0, s1 - s), np.minimum(u - u0, u1 - u)))


def below_curve(grid: Grid, s: np.ndarray, height: np.ndarray, foot_u: float, upward: int, margin: float = 0.6) -> Shape:
    """What lies between the foot of a wall and a curve ``height`` over the chainages ``s``; ends are closed."""
    top = float(np.max(height)) + margin
    low, high = sorted((foot_u - upward * 0.05, foot_u + upward * top))
    window = grid.window(float(s[0]) - margin, float(s[-1]) + margin, low, high)
    along, girth = grid.coordinates(window)
    level = np.interp(along[:, 0], s, height, left=float(height[0]) - 0.001, right=float(height[-1]) - 0.001)[:, None]
    ends = np.minimum(along - s[0], s[-1] - along)
    return Shape(window, np.minimum(level - upward * (girth - foot_u), ends).astype(np.float32))


def union(grid: Grid, shapes: list[Shape]) -> Shape:
    """All shapes in one window."""
    rows = slice(min(x.window[0].start for x in shapes), max(x.window[0].stop for x in shapes))
    columns = slice(min(x.window[1].start for x in shapes), max(x.window[1].stop for x in shapes))
    best = np.full((rows.stop - rows.start, columns.stop - columns.start), -9.0, np.float32)
    for shape in shapes:
        inner = tuple(slice(a.start - w.start, a.stop - w.start) for a, w in zip(shape.window, (rows, columns), strict=True))
        np.maximum(best[inner], shape.distance, out=best[inner])
    return Shape((rows, columns), best)
