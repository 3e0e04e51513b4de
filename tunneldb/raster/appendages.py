"""Fixtures: pixels off the plane of the lining around them (Xu et al., 2018, eq. 21–23); and recesses of the lining.

The planes are fitted to the offset image, where a curved lining is flat.
"""

from __future__ import annotations

import numpy as np

from tunneldb.arrays import Bool, Int32, Single
from tunneldb.compiled import inner, inner_sums, point_inner, point_kernel
from tunneldb.geometry.robust_plane import DELTA, central_mode, plane_of_moments
from tunneldb.threads import in_blocks

PART = 2.0
"""Side of the part of the lining for one plane, m: signs and boxes are smaller than half of it."""

STEP = 0.25
"""Side of the middle of a part, to which its plane is applied, m."""

MIN_PIXELS = 12
"""Minimum number of pixels on the plane of a part; with fewer the section surface is used as its plane."""

SCALES = np.array([0.06, 0.05, 0.04, 0.03, 0.03])
"""Distances from the plane, m, beyond which a pixel has no weight, in successive fits."""

_BIN, _BINS, _REACH = 0.01, 8, 2
_SAMPLES = 6  # samples of each row of a part, in oblique lines: some hundred suffice for three numbers
_NONE = np.float32(1e9)  # an offset far from any plane
_SUPPORT = 0.15  # minimum share of pixels around a recessed one at its depth: one profile, minus an outlier


def distance_from_plane(offset: Single, pixel: float, corner: tuple[int, int] = (0, 0)) -> Single:
    """Return the signed distance of each pixel from the local plane of the lining (eq. 22).

    Each plane is fitted by reweighted least squares (Tukey's weights of decreasing width), so that fixtures and niches do not
    attract it. It starts level, at the offset within 0.08 m of the section surface with most pixels; of two such offsets the
    one nearer to the surface is preferred, because the lining is there.

    Parameters
    ----------
    offset : (rows, columns) float32 array
        Offset image, m, NaN without a point.
    pixel : float
        Side of a pixel, m.
    corner : (int, int)
        Row and column of its first pixel in a larger image. A pixel farther than :func:`reach` from the part's edges has the
        same distance in any part.

    Returns
    -------
    (rows, columns) float32 array
        m, positive into the tunnel, NaN without a point.
    """
    step, margin = _sides(pixel)
    every, side = _every(pixel), step + 2 * margin
    (rows, columns), (row, column) = offset.shape, corner
    down, across = row // step, column // step  # the first tiles, which may begin before the image
    tall, wide = (row + rows - 1) // step - down + 1, (column + columns - 1) // step - across + 1
    samples = _samples(
        offset, row - down * step + margin, column - across * step + margin,
        tall * step + 2 * margin, wide * step + 2 * margin, row - column, every,
    )  # fmt: skip
    x, y = _places(side, every)
    distance: Single = np.full(offset.shape, np.nan, np.float32)
    offset = np.ascontiguousarray(offset)

    def tiles(begin: int, end: int) -> None:
        z, counts = np.full(x.shape[1], _NONE, np.float32), np.empty((2, 2 * _BINS + 2), np.int32)
        _distance(
            offset, samples, x, y, SCALES.astype(np.float32), step, margin, every,
            row, column, down, across, wide, begin, end, z, counts, distance,
        )  # fmt: skip

    in_blocks(tiles, tall, 4)
    return distance


def recessed(offset: Single, distance: Single, pixel: float, delta: float = DELTA) -> Bool:
    """Mark pixels on a surface behind their plane: the back of a niche or of a bolt pocket.

    Around such a pixel, over 0.1 m, those with points are on one slope of up to 45°, within δ; one may be an outlier. So edges,
    with their mixed pixels, are not recesses, nor are scattered points behind the wall.

    Parameters
    ----------
    offset, distance : (rows, columns) float32 arrays
        Offset image, m, and the result of :func:`distance_from_plane` for it.
    pixel : float
        Side of a pixel, m.
    delta : float
        δ, m.
    """
    marked: Bool = np.zeros(offset.shape, np.bool_)
    _recessed(np.ascontiguousarray(offset), np.ascontiguousarray(distance), float(delta), _growth(pixel), float(pixel), marked)
    return marked


def off_plane(distance: Single, recess: Bool, pixel: float, delta: float = DELTA) -> Bool:
    """Mark pixels neither on their plane (eq. 23) nor in a recess, dilated to include the mixed pixels of their edges.

    Parameters
    ----------
    distance : (rows, columns) float32 array
        Result of :func:`distance_from_plane`.
    recess : (rows, columns) bool array
        Result of :func:`recessed`.
    pixel : float
        Side of a pixel, m.
    delta : float
        δ, m.
    """
    marked: Bool = np.zeros(distance.shape, np.bool_)
    _grow(np.ascontiguousarray(distance), np.ascontiguousarray(recess), float(delta), _growth(pixel), _thin(pixel), marked)
    return marked


def reach(pixel: float) -> int:
    """Return the maximum distance, in pixels, of data that a pixel's result depends on."""
    step, margin = _sides(pixel)
    return step + margin + _growth(pixel) + _thin(pixel)


def _sides(pixel: float) -> tuple[int, int]:
    """Return the side of the middle of a part and the width around it, pixels."""
    return max(1, round(STEP / pixel)), max(1, round((PART - STEP) / 2 / pixel))


def _every(pixel: float) -> int:
    """Return the interval of the sampled pixels of a row."""
    step, margin = _sides(pixel)
    return max(1, (step + 2 * margin) // _SAMPLES)


def _growth(pixel: float) -> int:
    """Return the number of pixels by which a fixture is dilated: two of 2 cm, fewer of larger ones."""
    return max(1, round(0.04 / pixel))


def _thin(pixel: float) -> int:
    """Return the number of pixels to either side for another pixel of a thin cable, if profiles are apart: 0.1 m."""
    return max(1, round(0.1 / pixel))


def _samples(offset: Single, skip_rows: int, skip_columns: int, rows: int, columns: int, slant: int, every: int) -> Single:
    """Return every n-th pixel of each row, in oblique lines, with a margin; _NONE without a point."""
    samples = np.full((rows, columns // every + 2), _NONE, np.float32)
    for i in range(min(every, len(offset))):
        # The columns whose number is that of the row, modulo n; the same for every n-th row.
        shift = (i + slant + skip_columns) % every - skip_columns
        skip = max(0, -(shift // every))
        values = offset[i::every, shift + every * skip :: every][:, : samples.shape[1] - skip]
        taken = samples[i + skip_rows : skip_rows + len(offset) : every, skip : skip + values.shape[1]]
        taken[:] = np.where(np.isnan(values), _NONE, values)
    return samples


def _places(side: int, every: int) -> tuple[Single, Single]:
    """Return the places of a part's samples for each phase: x (every, n) and y (n,), in sides from its middle."""
    each = side // every
    room = (side * each + 63) // 64 * 64  # whole vectors
    x, y = np.zeros((every, room), np.float32), np.zeros(room, np.float32)
    row, phase = np.arange(side), np.arange(every)
    first = (phase[:, None] + row) % every
    x[:, : side * each] = ((first[:, :, None] + every * np.arange(each) - 0.5 * side) / side).reshape(every, -1)
    y[: side * each] = np.repeat((row - 0.5 * side) / side, each)
    return x, y


@point_kernel
def _distance(
    offset: Single, samples: Single, x: Single, y: Single, scales: Single, step: int, margin: int, every: int,
    row: int, column: int, down: int, across: int, wide: int, begin: int, end: int, z: Single, counts: Int32, out: Single,
) -> None:  # fmt: skip  # pragma: no cover - compiled
    """Write the distances of rows of tiles; ``z`` is memory for a part's samples, ``counts`` for two histograms of them."""
    rows, columns = offset.shape
    side = step + 2 * margin
    each = side // every
    total = np.empty(2 * _BINS + 1)
    half, per_bin = np.float32(_BINS + 1.5), np.float32(1.0 / _BIN)
    for tile_row in range(begin, end):
        top = (down + tile_row) * step - row
        r0, r1 = top if top > 0 else 0, top + step if top + step < rows else rows
        for tile in range(wide):
            left = (across + tile) * step - column
            c0, c1 = left if left > 0 else 0, left + step if left + step < columns else columns
            selected = False
            for i in range(r0, r1):
                for j in range(c0, c1):
                    selected |= not np.isnan(offset[i, j])
                if selected:
                    break
            if not selected:
                continue
            for k in range(2 * _BINS + 2):
                counts[0, k] = counts[1, k] = 0
            phase = (top + row - left - column) % every
            for i in range(side):
                # Index of the row's first sample in the part among all its samples.
                first = (tile * step + (phase + i) % every) // every
                for k in range(each):
                    value = samples[tile_row * step + i, first + k]
                    z[i * each + k] = value
                    # Class of 1 cm; the last one is for samples far from the section surface.
                    place = value * per_bin + half
                    counts[k & 1, int(place) - 1 if 1.0 <= place < 2 * _BINS + 2.0 else 2 * _BINS + 1] += 1
            for k in range(2 * _BINS + 1):
                total[k] = counts[0, k] + counts[1, k]
            mode = central_mode(total, 2 * _BINS + 1, _REACH)
            a, b, c = _plane(x[phase], y, z, (mode - _BINS) * _BIN if mode >= 0 else 0.0, scales)
            for i in range(r0, r1):
                down_part = (i - top - 0.5 * step) / side
                for j in range(c0, c1):
                    along = (j - left - 0.5 * step) / side
                    out[i, j] = offset[i, j] - np.float32(a + b * along + c * down_part)


@inner
def _plane(
    x: Single, y: Single, z: Single, level: float, scales: Single
) -> tuple[float, float, float]:  # pragma: no cover - compiled
    """Fit a plane a + b x + c y to points, starting from a level."""
    a, b, c = level, 0.0, 0.0
    for k in range(scales.shape[0]):
        used, s0, sx, sy, sxx, sxy, syy, sz, sxz, syz = _moments(
            x, y, z, np.float32(a), np.float32(b), np.float32(c), np.float32(1.0) / scales[k]
        )
        if used < MIN_PIXELS or s0 <= 0.0:
            return 0.0, 0.0, 0.0
        # Spread in both directions: 1/144 is that of a full square.
        a, b, c = plane_of_moments(s0, sx, sy, sxx, sxy, syy, sz, sxz, syz, 1e-6 * 0.0069)
    return a, b, c


# Sums may be computed in any order, so that several are computed at once.
@inner_sums
def _moments(
    x: Single, y: Single, z: Single, a: np.float32, b: np.float32, c: np.float32, per_scale: np.float32
) -> tuple[float, ...]:  # pragma: no cover - compiled
    """Return sums over points weighted by their distance from a plane (Tukey): number, weight, and moments."""
    one, zero = np.float32(1.0), np.float32(0.0)
    used, s0, sx, sy, sxx, sxy, syy, sz, sxz, syz = zero, zero, zero, zero, zero, zero, zero, zero, zero, zero
    for k in range(x.shape[0]):
        u = (z[k] - (a + b * x[k] + c * y[k])) * per_scale
        w = one - u * u
        w = w if w > zero else zero
        used += one if w > zero else zero
        w = w * w
        wx, wy = w * x[k], w * y[k]
        s0 += w
        sx += wx
        sy += wy
        sxx += wx * x[k]
        sxy += wx * y[k]
        syy += wy * y[k]
        sz += w * z[k]
        sxz += wx * z[k]
        syz += wy * z[k]
    return (
        float(used), float(s0), float(sx), float(sy), float(sxx), float(sxy), float(syy), float(sz), float(sxz), float(syz),
    )  # fmt: skip


@point_kernel
def _recessed(
    offset: Single, distance: Single, delta: float, half: int, steepest: float, out: Bool
) -> None:  # pragma: no cover - compiled
    rows, columns = offset.shape
    enough = _SUPPORT * ((2 * half + 1) * (2 * half + 1))
    for i in range(rows):
        for j in range(columns):
            if not distance[i, j] <= -delta:
                continue
            down, along = 0.0, 0.0  # the slope, per pixel
            if half <= i < rows - half:
                down = (offset[i + half, j] - offset[i - half, j]) / (2.0 * half)
            if half <= j < columns - half:
                along = (offset[i, j + half] - offset[i, j - half]) / (2.0 * half)
            down = down if abs(down) <= steepest else 0.0  # nor if unknown
            along = along if abs(along) <= steepest else 0.0
            alike, other = 0, 0
            for m in range(_from(i - half), _until(i + half + 1, rows)):
                for n in range(_from(j - half), _until(j + half + 1, columns)):
                    gap = abs(offset[m, n] - offset[i, j] - down * (m - i) - along * (n - j))
                    alike += gap < delta
                    other += gap >= delta
                if other > 1:
                    break
            out[i, j] = other <= 1 and alike >= enough


@point_kernel
def _grow(
    distance: Single, recess: Bool, delta: float, growth: int, thin: int, out: Bool
) -> None:  # pragma: no cover - compiled
    """Mark pixels off the plane, and those around them; a single pixel is an outlier without an edge."""
    rows, columns = distance.shape
    for i in range(rows):
        for j in range(columns):
            if not (abs(distance[i, j]) >= delta) or recess[i, j]:
                continue
            out[i, j] = True
            beside = 0
            for m in range(_from(i - 1), _until(i + 2, rows)):
                for n in range(_from(j - 1), _until(j + 2, columns)):
                    beside += abs(distance[m, n]) >= delta
            # With similar pixels before or behind it, or above or below, it belongs to a cable.
            for turn in range(2 if beside == 1 else 0):
                tall, wide = (1, thin) if turn == 0 else (thin, 1)
                alike = 0
                for m in range(_from(i - tall), _until(i + tall + 1, rows)):
                    for n in range(_from(j - wide), _until(j + wide + 1, columns)):
                        alike += abs(distance[m, n]) >= delta and abs(distance[m, n] - distance[i, j]) < delta
                if alike > 1:
                    beside = 2
            # From the edge the dilation reaches as far as from within.
            if 1 < beside < 9:
                for m in range(_from(i - growth), _until(i + growth + 1, rows)):
                    for n in range(_from(j - growth), _until(j + growth + 1, columns)):
                        out[m, n] = True


@point_inner
def _from(index: int) -> int:  # pragma: no cover - compiled
    return index if index > 0 else 0


@point_inner
def _until(index: int, count: int) -> int:  # pragma: no cover - compiled
    return index if index < count else count
