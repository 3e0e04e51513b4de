"""Directions of a set of points, from its second moments: closed forms, for loops that look at millions of neighbourhoods."""

from __future__ import annotations

import math

from numba import njit


@njit(cache=True, nogil=True)
def eigenvalues(
    xx: float, yy: float, zz: float, xy: float, xz: float, yz: float
) -> tuple[float, float, float]:  # pragma: no cover - compiled
    """Eigenvalues of a symmetric 3 × 3 matrix, least first (Smith, 1961, Communications of the ACM 4(4))."""
    mean = (xx + yy + zz) / 3.0
    off = xy * xy + xz * xz + yz * yz
    spread = math.sqrt(((xx - mean) ** 2 + (yy - mean) ** 2 + (zz - mean) ** 2 + 2.0 * off) / 6.0)
    if spread < 1e-150:
        return mean, mean, mean
    a, b, c = (xx - mean) / spread, (yy - mean) / spread, (zz - mean) / spread
    d, e, f = xy / spread, xz / spread, yz / spread
    half = (a * (b * c - f * f) - d * (d * c - f * e) + e * (d * f - b * e)) / 2.0
    angle = math.acos(min(max(half, -1.0), 1.0)) / 3.0
    greatest = mean + 2.0 * spread * math.cos(angle)
    least = mean + 2.0 * spread * math.cos(angle + 2.0 * math.pi / 3.0)
    return least, 3.0 * mean - greatest - least, greatest


@njit(cache=True, nogil=True)
def normal(
    xx: float, yy: float, zz: float, xy: float, xz: float, yz: float, least: float
) -> tuple[float, float, float]:  # pragma: no cover - compiled
    """Unit eigenvector of the least eigenvalue, by the longest cross product of two rows; zero where it isn't one direction."""
    a, b, c = xx - least, yy - least, zz - least
    best, nx, ny, nz = 0.0, 0.0, 0.0, 0.0
    for x, y, z in (
        (xy * yz - xz * b, xz * xy - a * yz, a * b - xy * xy),  # first and second row
        (xy * c - xz * yz, xz * xz - a * c, a * yz - xy * xz),  # first and third
        (b * c - yz * yz, yz * xz - xy * c, xy * yz - b * xz),  # second and third
    ):
        length = x * x + y * y + z * z
        if length > best:
            best, nx, ny, nz = length, x, y, z
    if best == 0.0:
        return 0.0, 0.0, 0.0
    best = math.sqrt(best)
    return nx / best, ny / best, nz / best
