"""Appendages: what stands off from the plane of the lining about it (Xu et al., 2018, eq. 21–23); and recesses of the lining.

The planes are fitted to the offset image, where a curved lining is flat.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from tunneldb.arrays import Bool, Int32, Single
from tunneldb.geometry.robust_plane import DELTA

PART = 2.0
"""Side of the part of the lining that a plane is fitted to, m: signs and boxes are smaller than half of it."""

STEP = 0.25
"""Side of the middle of a part, for which its plane is used, m."""

MIN_PIXELS = 12
"""A part with fewer pixels on its plane takes the section surface for its plane."""

SCALES = np.array([0.06, 0.05, 0.04, 0.03, 0.03])
"""Distances from the plane, m, beyond which a pixel has no weight, fit after fit."""

_BIN, _BINS, _REACH = 0.01, 8, 2
_SAMPLES = 6  # pixels of each row of a part that are taken, in slanting lines: some hundred are enough for three numbers
_NONE = np.float32(1e9)  # an offset that no plane comes near
_SUPPORT = 0.15  # share of the pixels about one in a recess that must lie at its depth: one profile's, less an outlier


def distance_from_plane(offset: Single, pixel: float, corner: tuple[int, int] = (0, 0)) -> Single:
    """Distance of each pixel from the local plane of the lining (eq. 22), signed.

    Each plane is fitted by reweighted least squares (Tukey's weights, ever narrower), so that appendages and
    niches don't draw it to themselves. It begins level, at the offset within 0.08 m of the section surface
    where most pixels lie; of two such offsets the one nearer to the surface is preferred: that is where the
    lining is.

    Parameters
    ----------
    offset : (rows, columns) float32 array
        Offset image, m, NaN where there is no point.
    pixel : float
        Side of a pixel, m.
    corner : (int, int)
        Row and column of its first pixel in an image of which this is a part. A pixel farther than :func:`reach` from the
        part's edges has the same distance whichever part it is seen in.

    Returns
    -------
    (rows, columns) float32 array
        m, positive into the tunnel, NaN where there is no point.
    """
    distance: Single = _distance(
        np.ascontiguousarray(offset), *_sides(pixel), _every(pixel), *corner, SCALES.astype(np.float32), MIN_PIXELS
    )
    return distance


def recessed(offset: Single, distance: Single, pixel: float, delta: float = DELTA) -> Bool:
    """Mark pixels behind their plane that lie on a surface there: the back of a niche or of a bolt pocket.

    About such a pixel, over 0.1 m, those with points lie on one slope of up to 45°, within δ; one may be an outlier. So
    neither its edges are recesses, with the mixed pixels there, nor what lies scattered behind the wall.

    Parameters
    ----------
    offset, distance : (rows, columns) float32 arrays
        Offset image, m, and what :func:`distance_from_plane` returned for it.
    pixel : float
        Side of a pixel, m.
    delta : float
        δ, m.
    """
    marked: Bool = _recessed(offset, distance, delta, _growth(pixel), pixel)
    return marked


def off_plane(distance: Single, recess: Bool, pixel: float, delta: float = DELTA) -> Bool:
    """Mark pixels that lie neither on their plane (eq. 23) nor in a recess, grown to swallow the mixed pixels of their edges.

    Parameters
    ----------
    distance : (rows, columns) float32 array
        What :func:`distance_from_plane` returned.
    recess : (rows, columns) bool array
        What :func:`recessed` returned.
    pixel : float
        Side of a pixel, m.
    delta : float
        δ, m.
    """
    marked: Bool = _grown(distance, recess, delta, _growth(pixel), _look(pixel))
    return marked


def reach(pixel: float) -> int:
    """How far, in pixels, what a pixel is judged by lies from it at most."""
    step, margin = _sides(pixel)
    return step + margin + _growth(pixel) + _look(pixel)


def _sides(pixel: float) -> tuple[int, int]:
    """Side of the middle of a part and width of what lies about it, pixels."""
    return max(1, round(STEP / pixel)), max(1, round((PART - STEP) / 2 / pixel))


def _every(pixel: float) -> int:
    """Of the pixels of a row one in so many is taken."""
    step, margin = _sides(pixel)
    return max(1, (step + 2 * margin) // _SAMPLES)


def _growth(pixel: float) -> int:
    """Pixels by which an appendage is grown: two of 2 cm, fewer of larger ones."""
    return max(1, round(0.04 / pixel))


def _look(pixel: float) -> int:
    """Pixels to either side in which a pixel of a thin cable has another one, though profiles are apart: 0.1 m."""
    return max(1, round(0.1 / pixel))


@njit(cache=True, nogil=True, parallel=True)
def _distance(
    offset: Single, step: int, margin: int, every: int, row: int, column: int, scales: Single, min_pixels: int
) -> Single:  # pragma: no cover - compiled
    rows, columns = offset.shape
    out = np.empty((rows, columns), np.float32)
    side = step + 2 * margin
    down, across = row // step, column // step  # the first tiles, which may begin before the image
    tall, wide = (row + rows - 1) // step - down + 1, (column + columns - 1) // step - across + 1
    first_row, first_column = down * step - margin, across * step - margin
    thin = _thinned(
        offset, row - first_row, column - first_column, tall * step + 2 * margin, wide * step + 2 * margin, row - column, every
    )
    x, y = _places(side, every)
    each = side // every
    for tile_row in prange(tall):
        z = np.full(x.shape[1], _NONE, np.float32)
        counts = np.empty((2, 2 * _BINS + 2), np.int32)
        top = (down + tile_row) * step - row
        for tile in range(wide):
            left = (across + tile) * step - column
            r0, r1, c0, c1 = max(top, 0), min(top + step, rows), max(left, 0), min(left + step, columns)
            if not _any(offset, r0, r1, c0, c1):
                out[r0:r1, c0:c1] = np.nan
                continue
            counts[:] = 0
            phase = (top + row - left - column) % every
            for i in range(side):
                # Where the row's first sample in the part lies among all its samples.
                begin = (tile * step + (phase + i) % every) // every
                for k in range(each):
                    value = thin[tile_row * step + i, begin + k]
                    z[i * each + k] = value
                    counts[k & 1, _bin(value)] += 1
            a, b, c = _plane(x[phase], y, z, _level(counts), scales, min_pixels)
            for i in range(r0, r1):
                down_part = (i - top - 0.5 * step) / side
                for j in range(c0, c1):
                    along = (j - left - 0.5 * step) / side
                    out[i, j] = offset[i, j] - np.float32(a + b * along + c * down_part)
    return out


@njit(cache=True, nogil=True)
def _thinned(
    offset: Single, skip_rows: int, skip_columns: int, rows: int, columns: int, slant: int, every: int
) -> Single:  # pragma: no cover - compiled
    """Every n-th pixel of each row, in slanting lines, with a margin; _NONE where there is no point."""
    thin = np.full((rows, columns // every + 2), _NONE, np.float32)
    for i in range(offset.shape[0]):
        # The columns whose number is that of the row, but for multiples of n.
        shift = (i + slant + skip_columns) % every
        for m in range(thin.shape[1]):
            j = shift + every * m - skip_columns
            if 0 <= j < offset.shape[1] and not np.isnan(offset[i, j]):
                thin[i + skip_rows, m] = offset[i, j]
    return thin


@njit(cache=True, nogil=True)
def _places(side: int, every: int) -> tuple[Single, Single]:  # pragma: no cover - compiled
    """Where the samples of a part lie in it, for each phase: x (every, n) and y (n,), in sides from its middle."""
    each = side // every
    room = (side * each + 63) // 64 * 64  # whole vectors
    x, y = np.zeros((every, room), np.float32), np.zeros(room, np.float32)
    for i in range(side):
        for k in range(each):
            for phase in range(every):
                x[phase, i * each + k] = ((phase + i) % every + every * k - 0.5 * side) / side
            y[i * each + k] = (i - 0.5 * side) / side
    return x, y


@njit(cache=True, nogil=True)
def _any(offset: Single, r0: int, r1: int, c0: int, c1: int) -> bool:  # pragma: no cover - compiled
    """Tell whether a tile holds points."""
    for i in range(r0, r1):
        for j in range(c0, c1):
            if not np.isnan(offset[i, j]):
                return True
    return False


@njit(cache=True, nogil=True)
def _bin(z: np.float32) -> int:  # pragma: no cover - compiled
    """Class of 1 cm of an offset, the last one for what lies nowhere near the section surface."""
    k = (
        np.int32(min(max(z * np.float32(1.0 / _BIN), np.float32(-_BINS - 1)), np.float32(_BINS + 1)) + np.float32(_BINS + 1.5))
        - 1
    )
    return int(k) if 0 <= k <= 2 * _BINS else 2 * _BINS + 1


@njit(cache=True, nogil=True)
def _level(counts: Int32) -> float:  # pragma: no cover - compiled
    """Offset near which most samples lie, those near the section surface counting more."""
    best, level = 0.0, 0.0
    for k in range(2 * _BINS + 1):
        score = 0.0
        for m in range(max(k - _REACH, 0), min(k + _REACH, 2 * _BINS) + 1):
            score += counts[0, m] + counts[1, m]
        score *= 1.0 - abs(k - _BINS) / (2.0 * _BINS)
        if score > best:
            best, level = score, (k - _BINS) * _BIN
    return level


@njit(cache=True, nogil=True)
def _plane(
    x: Single, y: Single, z: Single, level: float, scales: Single, min_pixels: int
) -> tuple[float, float, float]:  # pragma: no cover - compiled
    """Plane a + b x + c y through points, fitted from a level on."""
    a, b, c = level, 0.0, 0.0
    for scale in scales:
        used, s0, sx, sy, sxx, sxy, syy, sz, sxz, syz = _weighted(
            x, y, z, np.float32(a), np.float32(b), np.float32(c), np.float32(1.0) / scale
        )
        if used < min_pixels or s0 <= 0.0:
            return 0.0, 0.0, 0.0
        xx, xy, yy = sxx - sx * sx / s0, sxy - sx * sy / s0, syy - sy * sy / s0
        xz, yz = sxz - sx * sz / s0, syz - sy * sz / s0
        determinant = xx * yy - xy * xy
        if determinant > 1e-6 * s0 * s0 * 0.0069:  # spread in both directions: 1/144 is that of a full square
            b = (xz * yy - yz * xy) / determinant
            c = (yz * xx - xz * xy) / determinant
        else:
            b, c = 0.0, 0.0
        a = (sz - b * sx - c * sy) / s0
    return a, b, c


@njit(cache=True, nogil=True, fastmath={"reassoc", "contract", "nsz", "nnan"})
def _weighted(
    x: Single, y: Single, z: Single, a: np.float32, b: np.float32, c: np.float32, per_scale: np.float32
) -> tuple[float, ...]:  # pragma: no cover - compiled
    """Sums over points weighted by their distance from a plane: how many have weight, weight, and its moments.

    Sums may be taken in any order, so that several are taken at once.
    """
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


@njit(cache=True, nogil=True)
def _recessed(
    offset: Single, distance: Single, delta: float, half: int, steepest: float
) -> Bool:  # pragma: no cover - compiled
    rows, columns = offset.shape
    out = np.zeros((rows, columns), np.bool_)
    enough = _SUPPORT * (2 * half + 1) ** 2
    for i in range(rows):
        for j in range(columns):
            if not distance[i, j] <= -delta:
                continue
            down, along = 0.0, 0.0  # the slope, per pixel
            if half <= i < rows - half:
                down = (offset[i + half, j] - offset[i - half, j]) / (2 * half)
            if half <= j < columns - half:
                along = (offset[i, j + half] - offset[i, j - half]) / (2 * half)
            down = down if abs(down) <= steepest else 0.0  # nor where it is unknown
            along = along if abs(along) <= steepest else 0.0
            alike, other = 0, 0
            for m in range(max(i - half, 0), min(i + half + 1, rows)):
                for n in range(max(j - half, 0), min(j + half + 1, columns)):
                    gap = abs(offset[m, n] - offset[i, j] - down * (m - i) - along * (n - j))
                    alike += gap < delta
                    other += gap >= delta
                if other > 1:
                    break
            out[i, j] = other <= 1 and alike >= enough
    return out


@njit(cache=True, nogil=True)
def _goes_on(distance: Single, i: int, j: int, delta: float, look: int) -> bool:  # pragma: no cover - compiled
    """Tell whether a pixel off the plane has others before or behind it, or above or below, that stand off alike."""
    rows, columns = distance.shape
    for tall, wide in ((1, look), (look, 1)):
        alike = 0
        for m in range(max(i - tall, 0), min(i + tall + 1, rows)):
            for n in range(max(j - wide, 0), min(j + wide + 1, columns)):
                alike += abs(distance[m, n]) >= delta and abs(distance[m, n] - distance[i, j]) < delta
        if alike > 1:
            return True
    return False


@njit(cache=True, nogil=True)
def _grown(distance: Single, recess: Bool, delta: float, growth: int, look: int) -> Bool:  # pragma: no cover - compiled
    """Pixels off the plane, and those about them; a pixel alone is an outlier, which has no edge."""
    rows, columns = distance.shape
    out = np.zeros((rows, columns), np.bool_)
    for i in range(rows):
        for j in range(columns):
            if abs(distance[i, j]) >= delta and not recess[i, j]:
                beside = 0
                for m in range(max(i - 1, 0), min(i + 2, rows)):
                    for n in range(max(j - 1, 0), min(j + 2, columns)):
                        beside += abs(distance[m, n]) >= delta
                out[i, j] = True
                # From the rim the growth reaches as far as from within.
                if 1 < beside < 9 or (beside == 1 and _goes_on(distance, i, j, delta, look)):
                    out[max(i - growth, 0) : i + growth + 1, max(j - growth, 0) : j + growth + 1] = True
    return out
