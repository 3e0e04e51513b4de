"""Planes of small neighbourhoods: normals and flatness from second moments (principal components)."""

from __future__ import annotations

import math

import numpy as np

from tunneldb.arrays import Float
from tunneldb.compiled import inner, kernel


def principal_planes(near: Float) -> tuple[Float, Float]:
    """Fit planes through neighbourhoods by their principal components.

    Parameters
    ----------
    near : (n, k, 3) float array
        Coordinates of the k points of each of n neighbourhoods, m.

    Returns
    -------
    values : (n, 3) float array
        Eigenvalues of the scatter matrix (sum of squares about the mean) of each, ascending, m².
    normals : (n, 3) float array
        Unit normals, with arbitrary sign.
    """
    near = near - near.mean(axis=1, keepdims=True)
    values, vectors = np.linalg.eigh(np.einsum("nki,nkj->nij", near, near))
    return values, vectors[:, :, 0]


def least_eigenvalues(moments: Float) -> Float:
    """Return the least eigenvalue (n,) of symmetric matrices, rows (n, 6) of xx, yy, zz, xy, xz and yz."""
    out = np.empty(len(moments))
    _least_eigenvalues(np.ascontiguousarray(moments), out)
    return out


@inner
def eigenvalues(
    xx: float, yy: float, zz: float, xy: float, xz: float, yz: float
) -> tuple[float, float, float]:  # pragma: no cover - compiled
    """Return the eigenvalues of a symmetric 3 × 3 matrix, ascending (Smith, 1961, Communications of the ACM 4(4))."""
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
    smallest = mean + 2.0 * spread * math.cos(angle + 2.0 * math.pi / 3.0)
    return smallest, 3.0 * mean - greatest - smallest, greatest


@inner
def normal(
    xx: float, yy: float, zz: float, xy: float, xz: float, yz: float, eigenvalue: float
) -> tuple[float, float, float]:  # pragma: no cover - compiled
    """Return the unit eigenvector of the least eigenvalue, by the longest cross product of two rows; zero if ambiguous."""
    a, b, c = xx - eigenvalue, yy - eigenvalue, zz - eigenvalue
    nx, ny, nz = xy * yz - xz * b, xz * xy - a * yz, a * b - xy * xy  # first and second row
    longest = nx * nx + ny * ny + nz * nz
    x, y, z = xy * c - xz * yz, xz * xz - a * c, a * yz - xy * xz  # first and third
    length = x * x + y * y + z * z
    if length > longest:
        longest, nx, ny, nz = length, x, y, z
    x, y, z = b * c - yz * yz, yz * xz - xy * c, xy * yz - b * xz  # second and third
    length = x * x + y * y + z * z
    if length > longest:
        longest, nx, ny, nz = length, x, y, z
    if not longest > 0.0:
        return 0.0, 0.0, 0.0
    longest = math.sqrt(longest)
    return nx / longest, ny / longest, nz / longest


@kernel
def _least_eigenvalues(moments: Float, out: Float) -> None:  # pragma: no cover - compiled
    for i in range(moments.shape[0]):
        out[i], _, _ = eigenvalues(moments[i, 0], moments[i, 1], moments[i, 2], moments[i, 3], moments[i, 4], moments[i, 5])
