"""Appendages: what stands off from the plane of the lining about it (Xu et al., 2018, eq. 21–23).

The planes are fitted to the offset image, where a curved lining is flat.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray
from scipy import ndimage

Single = NDArray[np.float32]
Mask = NDArray[np.bool_]

DELTA = 0.03
"""Distance from the plane from which a pixel is an appendage (eq. 23), m."""

PART = 1.0
"""Side of the part of the lining that a plane is fitted to, m."""

STEP = 0.25
"""Side of the middle of a part, for which its plane is used, m."""

MIN_PIXELS = 12
"""A part with fewer pixels on its plane takes the section surface for its plane."""

SCALES = np.array([0.06, 0.05, 0.04, 0.03, 0.03])
"""Distances from the plane, m, beyond which a pixel has no weight, fit after fit."""

_BIN, _BINS, _REACH = 0.01, 8, 2
_EVERY = 4  # of the pixels of a part every fourth is taken, in slanting lines: enough for three numbers


def distance_from_plane(offset: Single, pixel: float) -> Single:
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

    Returns
    -------
    (rows, columns) float32 array
        m, positive into the tunnel, NaN where there is no point.
    """
    step = max(1, round(STEP / pixel))
    margin = max(1, round((PART - STEP) / 2 / pixel))
    distance: Single = _distance(np.ascontiguousarray(offset), step, margin, SCALES, MIN_PIXELS)
    return distance


def appendages(offset: Single, pixel: float, delta: float = DELTA) -> Mask:
    """Mark pixels that don't lie on the lining (eq. 23), grown to swallow the mixed pixels of their edges.

    Parameters
    ----------
    offset : (rows, columns) float32 array
        Offset image, m, NaN where there is no point.
    pixel : float
        Side of a pixel, m.
    delta : float
        δ, m.

    Returns
    -------
    (rows, columns) bool array
    """
    distance = distance_from_plane(offset, pixel)
    with np.errstate(invalid="ignore"):
        off = np.abs(distance) >= delta
    # A pixel alone is an outlier, which has no edge.
    neighbours = ndimage.uniform_filter(off.astype(np.float32), 3, mode="constant") * 9.0
    body = off & (neighbours > 1.5)
    grown = ndimage.binary_dilation(body, ndimage.generate_binary_structure(2, 2), iterations=_growth(pixel))
    return np.asarray(off | grown, dtype=np.bool_)


def _growth(pixel: float) -> int:
    """Pixels by which an appendage is grown: two of 2 cm, fewer of larger ones."""
    return max(1, round(0.04 / pixel))


@njit(cache=True, nogil=True)
def _any(offset: Single, r0: int, r1: int, c0: int, c1: int) -> bool:  # pragma: no cover - compiled
    """Tell whether a part holds points."""
    for i in range(r0, r1):
        for j in range(c0, c1):
            if not np.isnan(offset[i, j]):
                return True
    return False


@njit(cache=True, nogil=True)
def _level(offset: Single, top: int, bottom: int, left: int, right: int) -> float:  # pragma: no cover - compiled
    """Offset near which most pixels of a part lie, those near the section surface counting more."""
    counts = np.zeros(2 * _BINS + 1)
    for i in range(top, bottom):
        for j in range(left + i % _EVERY, right, _EVERY):
            z = offset[i, j]
            if not np.isnan(z):
                k = int(np.floor(z / _BIN + 0.5)) + _BINS
                if 0 <= k <= 2 * _BINS:
                    counts[k] += 1.0
    best, level = 0.0, 0.0
    for k in range(2 * _BINS + 1):
        score = 0.0
        for m in range(max(k - _REACH, 0), min(k + _REACH, 2 * _BINS) + 1):
            score += counts[m]
        score *= 1.0 - abs(k - _BINS) / (2.0 * _BINS)
        if score > best:
            best, level = score, (k - _BINS) * _BIN
    return level


@njit(cache=True, nogil=True, parallel=True)
def _distance(
    offset: Single, step: int, margin: int, scales: NDArray[np.float64], min_pixels: int
) -> Single:  # pragma: no cover - compiled
    rows, columns = offset.shape
    out = np.empty((rows, columns), np.float32)
    across = (columns + step - 1) // step
    for tile in prange(((rows + step - 1) // step) * across):
        r0 = (tile // across) * step
        c0 = (tile % across) * step
        r1, c1 = min(r0 + step, rows), min(c0 + step, columns)
        top, bottom = max(r0 - margin, 0), min(r1 + margin, rows)
        left, right = max(c0 - margin, 0), min(c1 + margin, columns)
        if not _any(offset, r0, r1, c0, c1):
            out[r0:r1, c0:c1] = np.nan
            continue
        a, b, c = _level(offset, top, bottom, left, right), 0.0, 0.0
        mr, mc = 0.5 * (r0 + r1), 0.5 * (c0 + c1)
        for scale in scales:
            s0, sx, sy, sxx, sxy, syy, sz, sxz, syz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            used = 0
            for i in range(top, bottom):
                y = (i - mr) / (step + 2.0 * margin)
                for j in range(left + i % _EVERY, right, _EVERY):
                    z = offset[i, j]
                    if np.isnan(z):
                        continue
                    x = (j - mc) / (step + 2.0 * margin)
                    u = (z - (a + b * x + c * y)) / scale
                    if u >= 1.0 or u <= -1.0:
                        continue
                    w = (1.0 - u * u) ** 2
                    used += 1
                    s0 += w
                    sx += w * x
                    sy += w * y
                    sxx += w * x * x
                    sxy += w * x * y
                    syy += w * y * y
                    sz += w * z
                    sxz += w * x * z
                    syz += w * y * z
            if used < min_pixels or s0 <= 0.0:
                a, b, c = 0.0, 0.0, 0.0
                break
            xx, xy, yy = sxx - sx * sx / s0, sxy - sx * sy / s0, syy - sy * sy / s0
            xz, yz = sxz - sx * sz / s0, syz - sy * sz / s0
            determinant = xx * yy - xy * xy
            if determinant > 1e-6 * s0 * s0 * 0.0069:  # spread in both directions: 1/144 is that of a full square
                b = (xz * yy - yz * xy) / determinant
                c = (yz * xx - xz * xy) / determinant
            else:
                b, c = 0.0, 0.0
            a = (sz - b * sx - c * sy) / s0
        for i in range(r0, r1):
            y = (i - mr) / (step + 2.0 * margin)
            for j in range(c0, c1):
                x = (j - mc) / (step + 2.0 * margin)
                out[i, j] = offset[i, j] - (a + b * x + c * y)
    return out
