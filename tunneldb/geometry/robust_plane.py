"""Robust planes of a lining, not affected by fixtures in front of it or recesses in it."""

from __future__ import annotations

from tunneldb.arrays import Float
from tunneldb.compiled import inner

DELTA = 0.03
"""Distance from the plane from which a pixel is an appendage (eq. 23), m."""


@inner
def central_mode(counts: Float, classes: int, reach: int) -> int:  # pragma: no cover - compiled
    """Return the class at the centre of most of a histogram, with more weight near its middle; -1 if it is empty.

    Parameters
    ----------
    counts : (classes,) array
        Histogram; classes at its two ends have half the weight of those in its middle.
    classes : int
        Number of classes, odd.
    reach : int
        Number of classes on each side that are counted together.
    """
    half = classes // 2
    best, mode = 0.0, -1
    for k in range(classes):
        score = 0.0
        for m in range(max(k - reach, 0), min(k + reach, classes - 1) + 1):
            score += counts[m]
        score *= 1.0 - abs(k - half) / (2.0 * half)
        if score > best:
            best, mode = score, k
    return mode


@inner
def plane_of_moments(
    s: float,
    sx: float,
    sy: float,
    sxx: float,
    sxy: float,
    syy: float,
    sz: float,
    sxz: float,
    syz: float,
    min_determinant: float,
) -> tuple[float, float, float]:  # pragma: no cover - compiled
    """Fit the plane z = a + b x + c y by weighted least squares, from the sums of the weights and of their products.

    Parameters
    ----------
    s, sx, sy, sxx, sxy, syy, sz, sxz, syz : float
        Σw, Σwx, Σwy, Σwx², Σwxy, Σwy², Σwz, Σwxz and Σwyz; s > 0.
    min_determinant : float
        Determinant of the covariance of x and y up to which the points are treated as collinear: the plane is then level.

    Returns
    -------
    a, b, c : float
    """
    xx, xy, yy = sxx - sx * sx / s, sxy - sx * sy / s, syy - sy * sy / s
    xz, yz = sxz - sx * sz / s, syz - sy * sz / s
    determinant = xx * yy - xy * xy
    b, c = 0.0, 0.0
    if determinant > min_determinant * s * s:
        b = (xz * yy - yz * xy) / determinant
        c = (yz * xx - xz * xy) / determinant
    return (sz - b * sx - c * sy) / s, b, c
