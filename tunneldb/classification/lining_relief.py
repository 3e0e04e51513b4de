"""Relief of the lining: its offset from the surface of the sections, cell by cell of the unrolled plane.

Sections are metres apart and smooth; between them a lining, especially of rock, deviates from the surface. A plane is fitted
robustly to the points around each cell (Xu et al., 2018, eq. 21), so that fixtures and recesses do not attract it. Cells
without sufficient lining, in the mouth of a niche or behind a large object, are interpolated from the cells around them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from tunneldb.arrays import Bool, Float, Int64, Single
from tunneldb.classification.ground.model import Ground
from tunneldb.classification.ground.wall_arcs import foot_arcs
from tunneldb.compiled import inner, kernel
from tunneldb.geometry.plan_line import PlanLine
from tunneldb.geometry.robust_plane import DELTA, central_mode, plane_of_moments
from tunneldb.geometry.section_outliers import SectionOutliers
from tunneldb.geometry.surface import Surface
from tunneldb.robust import MAD_TO_SIGMA
from tunneldb.threads import in_blocks

CELL = 0.25
"""Edge of a cell, m."""

REACH = 0.5
"""Maximum distance from the surface of points used, m."""

SIGMAS = 3.0
"""Standard deviations about its plane within which points belong to the lining."""

MAX_CELL_DEVIATION = 0.06
"""Maximum deviation of a cell from its surroundings, m, unless the lining's own relief is as rough."""

_PART = 2  # cells to each side whose points are used for the plane
_MIN_POINTS = 6
_BIN, _BINS, _SMOOTH = 0.02, 25, 2  # of the histogram for the level: 2 cm to ±0.5 m, over five bins
_FINE, _FINES = 0.002, 128  # of the histogram for the spread
_TUKEY = 4.685  # Tukey's weights end at so many standard deviations
_FIRST_WIDTH, _FITS = 0.12, 5  # width of the first fit's weights, m
_CONVERGED = 2e-4  # the fit ends when a cell moves by less, m
_MIN_DETERMINANT = (
    0.05  # minimum determinant of the covariance of x and y, in cells: points on a line have less, a full part has 4.3
)
_ALONG, _ROUND = 12, 4  # cells to each side that a cell's offset is compared with: 6 m by 2 m
_SAMPLE = 1024  # points of a part: survey density gives 150, voxels may give more
_COLUMNS, _POINTS = 64, 1 << 16  # columns of cells, and points, at a time


@dataclass(frozen=True)
class Relief:
    """Offset of the lining from the section surface and its spread, on a grid of the unrolled plane.

    Attributes
    ----------
    cell : float
        Edge of a cell, m.
    column, row : int
        The first cell is at chainage ``column * cell`` and arc ``row * cell``.
    offset : (rows, columns) float32 array
        Offset of the lining at the cells' middles, m, positive into the tunnel; NaN without lining.
    spread : (rows, columns) float32 array
        Standard deviation of the lining's points about it, m; NaN at the same places.
    """

    cell: float
    column: int
    row: int
    offset: Single
    spread: Single

    @classmethod
    def of(
        cls, chainage: Float, arc: Float, offset: Float, wall: Wall | None = None, prior: SectionOutliers | None = None
    ) -> Relief:
        """Find the relief of a lining from points of survey density.

        Parameters
        ----------
        chainage, arc, offset : (n,) float arrays
            Points that are not ground, in the unrolled plane, m; those with NaN are ignored.
        wall : Wall, optional
            Lower ends of the lining at the ground; without it the whole surface is lining.
        prior : SectionOutliers, optional
            Places where the surface is known to be off the lining.

        Returns
        -------
        Relief
            Without cells if there are no points near the surface.
        """
        with np.errstate(invalid="ignore"):
            kept = np.isfinite(chainage) & (np.abs(offset) <= 2.0 * REACH)
        chainage, arc, offset = chainage[kept], arc[kept], offset[kept]
        if len(chainage) == 0:
            return cls.none()
        i, j = np.floor(arc / CELL).astype(np.int64), np.floor(chainage / CELL).astype(np.int64)
        row, column = int(i.min()), int(j.min())
        shape = int(i.max()) - row + 1, int(j.max()) - column + 1
        columns = np.asarray((np.arange(shape[1]) + column + 0.5) * CELL, np.float64)
        rows = np.asarray((np.arange(shape[0]) + row + 0.5) * CELL, np.float64)
        expected = np.zeros(shape) if prior is None else prior.offset(columns, rows)
        place = (i - row) * shape[1] + j - column
        order = np.argsort(place, kind="stable")
        starts = np.searchsorted(place[order], np.arange(shape[0] * shape[1] + 1))
        found, spread = _planes(chainage[order] / CELL - column, arc[order] / CELL - row, offset[order], starts, expected)
        found[_apart(found, expected)] = np.nan
        spread[np.isnan(found)] = np.nan
        inside = np.ones(shape, np.bool_) if wall is None else wall.holds(columns, rows)
        return cls(CELL, column, row, *_whole(found, _calm(spread), expected, inside))

    @classmethod
    def none(cls) -> Relief:
        """Make the relief of a scene without lining."""
        return cls(CELL, 0, 0, np.empty((0, 0), np.float32), np.empty((0, 0), np.float32))

    def level(self, chainage: Float, arc: Float) -> tuple[Float, Float]:
        """Return the offset of the lining at places (n,) of the unrolled plane and its tolerance, m; NaN if there is none.

        The tolerance is Xu's δ (3 cm), or three standard deviations of the lining there if that is more.
        """
        chainage, arc = np.ascontiguousarray(chainage, np.float64), np.ascontiguousarray(arc, np.float64)
        level, tolerance = np.empty(len(chainage)), np.empty(len(chainage))
        grid = float(self.cell), int(self.column), int(self.row), self.offset, self.spread
        in_blocks(lambda begin, end: _levels(chainage, arc, *grid, level, tolerance, begin, end), len(chainage), _POINTS)
        return level, tolerance


@dataclass(frozen=True)
class Wall:
    """Lower ends of the lining at the ground, on both sides.

    Attributes
    ----------
    chainage : (k,) float array
        Places along the tunnel, m, increasing, at least one.
    left, right : (k,) float arrays
        Arc of the left and the right wall's foot, m.
    """

    chainage: Float
    left: Float
    right: Float

    @classmethod
    def of(cls, ground: Ground | None, line: PlanLine, surface: Surface) -> Wall | None:
        """Make it from the feet of the walls; None without ground."""
        if ground is None:
            return None
        arcs = foot_arcs(ground, line, surface)
        metres = ground.start + np.arange(len(arcs), dtype=np.float64)
        known = np.isfinite(arcs).all(axis=1)
        return cls(metres[known], arcs[known, 0], arcs[known, 1]) if known.any() else None

    def holds(self, chainage: Float, arc: Float) -> Bool:
        """Return True for places above the ground; (rows,) arcs by (columns,) chainages."""
        left, right = np.interp(chainage, self.chainage, self.left), np.interp(chainage, self.chainage, self.right)
        # Half a cell more, so that the lowest part of the wall is in a cell too.
        return np.asarray((arc[:, None] > left - CELL / 2) & (arc[:, None] < right + CELL / 2))


def _apart(found: Float, expected: Float) -> Bool:
    """Return cells whose plane deviates from those around them: back of a shallow niche, front of a large box."""
    level = _median(found - expected, _ALONG, _ROUND)
    off = np.abs(found - expected - level)
    usual = 5.0 * MAD_TO_SIGMA * _median(off, _ALONG, _ROUND)
    with np.errstate(invalid="ignore"):
        return np.asarray(off > np.maximum(usual, MAX_CELL_DEVIATION))


def _calm(spread: Float) -> Float:
    """Return the spread of the lining around each cell: the median of its neighbours', robust against single boxes."""
    return np.asarray(_median(spread, 4, 4))


def _whole(found: Float, spread: Float, expected: Float, inside: Bool) -> tuple[Single, Single]:
    """Interpolate the relief in cells without one, from cells before and behind them along the tunnel."""
    offset, missing = found - expected, np.isnan(found)
    if missing.all():
        return np.full(found.shape, np.nan, np.float32), np.full(found.shape, np.nan, np.float32)
    columns = np.arange(found.shape[1])
    for row in np.flatnonzero(missing.any(axis=1)):
        known = columns[~missing[row]]
        if len(known):
            offset[row] = np.interp(columns, known, offset[row, known])
    empty = np.isnan(offset).any(axis=1)
    if empty.any():  # a whole line of the wall is hidden: it takes the nearest one
        nearest = ndimage.distance_transform_edt(empty, return_distances=False, return_indices=True)[0]
        offset = offset[nearest]
    usual = float(np.nanmedian(spread))
    spread = np.where(np.isnan(spread), usual, spread)
    offset = np.where(inside, offset + expected, np.nan)
    return offset.astype(np.float32), np.where(inside, spread, np.nan).astype(np.float32)


def _median(grid: Float, along: int, across: int) -> Float:
    """Return the median of the cells around each, without NaN; an even selection of them is sufficient."""
    rows, columns = grid.shape
    step = max(2, along // 3)
    padded = np.pad(grid, ((across, across), (along, along)), constant_values=np.nan)
    out = np.empty(grid.shape)

    def work(begin: int, end: int) -> None:
        about = [
            padded[m : m + rows, n + begin : n + end]
            for m in range(0, 2 * across + 1, 2)
            for n in range(0, 2 * along + 1, step)
        ]
        values = np.sort(np.stack(about, axis=-1), axis=-1)  # NaN come last
        count = np.isfinite(values).sum(axis=-1, keepdims=True)
        middle = [np.take_along_axis(values, k, axis=-1)[..., 0] for k in ((count - 1) // 2, count // 2)]
        out[:, begin:end] = (middle[0] + middle[1]) / 2.0

    in_blocks(work, columns, _COLUMNS)
    return out


def _planes(x: Float, y: Float, z: Float, starts: Int64, expected: Float) -> tuple[Float, Float]:
    """Return offset and spread of each cell; x and y in cells, z and the results in m, NaN with too few points."""
    offset, spread = np.full(expected.shape, np.nan), np.full(expected.shape, np.nan)

    def work(begin: int, end: int) -> None:
        part = np.empty((_SAMPLE, 3))
        counts, fine = np.empty(2 * _BINS + 1), np.empty(_FINES, np.int64)
        _fit_planes(x, y, z, starts, expected, part, counts, fine, offset, spread, begin, end)

    in_blocks(work, expected.shape[1], _COLUMNS)
    return offset, spread


@kernel
def _fit_planes(
    x: Float, y: Float, z: Float, starts: Int64, expected: Float, part: Float, counts: Float, fine: Int64,
    offset: Float, spread: Float, begin: int, end: int,
) -> None:  # fmt: skip  # pragma: no cover - compiled
    """Fit the planes of the columns of cells from begin to end; part, counts and fine are working memory."""
    rows, columns = expected.shape
    for j in range(begin, end):
        left, right = max(j - _PART, 0), min(j + _PART, columns - 1)
        for i in range(rows):
            below, above = max(i - _PART, 0), min(i + _PART + 1, rows)
            total = 0
            for m in range(below, above):
                total += starts[m * columns + right + 1] - starts[m * columns + left]
            if total < _MIN_POINTS:
                continue
            every = 1 + total // _SAMPLE
            count, seen = np.int64(0), 0  # no literal, to avoid a second compilation of the called function
            for k in range(counts.shape[0]):
                counts[k] = 0.0
            for m in range(below, above):
                for k in range(starts[m * columns + left], starts[m * columns + right + 1]):
                    if seen % every == 0:
                        part[count, 0], part[count, 1] = x[k] - j - 0.5, y[k] - i - 0.5
                        part[count, 2] = z[k] - expected[i, j]
                        b = math.floor(part[count, 2] / _BIN + 0.5) + _BINS
                        if 0 <= b <= 2 * _BINS:
                            counts[b] += 1.0
                        count += 1
                    seen += 1
            mode = central_mode(counts, 2 * _BINS + 1, _SMOOTH)
            if mode >= 0:
                level, sigma = _fit_plane(part, count, (mode - _BINS) * _BIN, fine)
                offset[i, j], spread[i, j] = level + expected[i, j], sigma


@inner
def _fit_plane(part: Float, count: int, level: float, fine: Int64) -> tuple[float, float]:  # pragma: no cover - compiled
    """Return the height in the middle of the plane through points, fitted from an initial level, and their spread, or NaN."""
    a, b, c, scale, sigma = level, 0.0, 0.0, _FIRST_WIDTH, np.nan
    for _ in range(_FITS):
        used, s, sx, sy, sxx, sxy, syy, sz, sxz, syz = 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(count):
            x, y, z = part[k, 0], part[k, 1], part[k, 2]
            u = (z - a - b * x - c * y) / scale
            if abs(u) < 1.0:
                used += 1
                w = (1.0 - u * u) ** 2
                wx, wy = w * x, w * y
                s += w
                sx += wx
                sy += wy
                sxx += wx * x
                sxy += wx * y
                syy += wy * y
                sz += w * z
                sxz += wx * z
                syz += wy * z
        if used < _MIN_POINTS:
            return np.nan, np.nan
        before, lean, slant = a, b, c
        a, b, c = plane_of_moments(s, sx, sy, sxx, sxy, syy, sz, sxz, syz, _MIN_DETERMINANT)
        # Standard deviation about the plane, from the median of the distances.
        for f in range(_FINES):
            fine[f] = 0
        total = 0
        for k in range(count):
            f = int(abs(part[k, 2] - a - b * part[k, 0] - c * part[k, 1]) / _FINE)
            if f < _FINES:
                fine[f] += 1
                total += 1
        below, sigma = 0, np.nan
        for f in range(_FINES):
            if 2 * (below + fine[f]) >= total and fine[f] > 0:
                sigma = MAD_TO_SIGMA * (f + (0.5 * total - below) / fine[f]) * _FINE
                break
            below += fine[f]
        if max(abs(a - before), abs(b - lean), abs(c - slant)) < _CONVERGED:
            break
        scale = min(max(_TUKEY * sigma, DELTA), 2.0 * _FIRST_WIDTH)
    return a, sigma


@inner
def level_at(
    chainage: float, arc: float, cell: float, column: int, row: int, relief: Single, spread: Single
) -> tuple[float, float]:  # pragma: no cover - compiled
    """Return the offset of the lining at one place, interpolated between cells, and its tolerance; NaN if there is none."""
    rows, columns = relief.shape
    y, x = arc / cell - row - 0.5, chainage / cell - column - 0.5
    if not (-0.5 <= y <= rows - 0.5 and -0.5 <= x <= columns - 0.5):
        return np.nan, np.nan
    y, x = min(max(y, 0.0), rows - 1.0), min(max(x, 0.0), columns - 1.0)
    i, j = int(y), int(x)
    fy, fx = y - i, x - j
    total, plane, sigma = 0.0, 0.0, 0.0
    for m in range(2):
        for n in range(2):
            p, q = i + m, j + n
            if 0 <= p < rows and 0 <= q < columns and not math.isnan(relief[p, q]):
                weight = (fy if m else 1.0 - fy) * (fx if n else 1.0 - fx)
                total += weight
                plane += weight * relief[p, q]
                sigma += weight * spread[p, q]
    if total < 0.5:  # beyond the end of the lining by half a cell
        return np.nan, np.nan
    return plane / total, max(DELTA, SIGMAS * sigma / total)


@kernel
def _levels(
    chainage: Float, arc: Float, cell: float, column: int, row: int, relief: Single, spread: Single,
    level: Float, tolerance: Float, begin: int, end: int,
) -> None:  # fmt: skip  # pragma: no cover - compiled
    for i in range(begin, end):
        level[i], tolerance[i] = level_at(chainage[i], arc[i], cell, column, row, relief, spread)
