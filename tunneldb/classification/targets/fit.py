"""Fit of a sphere to points, and its quality (Li et al., 2023, eq. 8 and 14-16).

The centre comes from a fit with the radius fixed at the nominal one. A free radius shifts the centre along the line of sight:
on half a sphere with 3 mm of range noise, the error is two to three times as large, and more on a smaller visible cap. The free
radius serves to distinguish a target from a ball of another size.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from tunneldb.arrays import Bool, Float, Int64
from tunneldb.robust import MAD_TO_SIGMA

GRAZING_COSINE = 0.25
"""Cosine of incidence (75.5°) below which a point is not used if the scanner position is known: at the limb of a sphere
a beam measures a range between that of the sphere and that of the background."""

HIDDEN_COSINE = -0.1
"""Cosine of incidence below which a point cannot be on the sphere: the sphere itself would hide it."""

MIN_WEIGHT_COSINE = 0.6
"""Lower limit of the cosine of incidence in weights. The distance of a point from the sphere scatters by range noise × the
cosine of incidence, so oblique points have more weight; beyond this limit the sphere's curvature over the noise makes that
untrue."""

BAND = 3.0  # standard deviations from the sphere within which points are on it
MIN_SPREAD = 0.0005  # m; rounding of files

SOFT_LIMIT = 1.5  # standard deviations beyond which the influence of a residual grows less than in proportion
STEPS = 25

BANDS, SECTORS = 8, 6
"""Cells of equal area for coverage: bands across the direction to the scanner, and sectors around it."""


@dataclass(frozen=True)
class SphereFit:
    """Sphere of the nominal radius through points.

    Attributes
    ----------
    centre : (3,) float64 array
        m.
    covariance : (3, 3) float64 array
        Covariance of the centre, m².
    free_centre : (3,) float64 array
        Centre of the best sphere with free radius, m.
    radius, radius_sigma : float
        Radius of that sphere, and its standard deviation, m.
    rms : float
        Root mean square of the distances of the points from the sphere of the nominal radius, m.
    expected : float
        Value of `rms` for ranges with a standard deviation of 1, from the incidence; 1 if that is not known.
    on : (n,) bool array
        True for points on the sphere, grazing ones included.
    used : (n,) bool array
        True for points used by the fit.
    """

    centre: Float
    covariance: Float
    free_centre: Float
    radius: float
    radius_sigma: float
    rms: float
    expected: float
    on: Bool
    used: Bool

    @property
    def sigma(self) -> float:
        """Standard deviation of the centre in space, m: root of the sum of its variances along three axes."""
        return math.sqrt(float(np.trace(self.covariance)))


def fit_sphere(points: Float, observers: Float, start: Float, radius: float, widest: float) -> SphereFit | None:
    """Fit a sphere of known radius.

    Points within three standard deviations of the sphere are on it. The standard deviation is that of these points, from their
    median, so that other points nearby do not count. Both are iterated until they agree.

    Parameters
    ----------
    points, observers : (n, 3) float64 arrays
        Points near the sphere, and the scanner position for each, m; NaN if not known.
    start : (3,) float64 array
        Approximate centre, to a fifth of the radius, m.
    radius : float
        m.
    widest : float
        Maximum distance from the sphere of points on it, m.

    Returns
    -------
    SphereFit or None
        None if fewer than 6 points are on it, or the fit moves away from the start by a radius.

    Notes
    -----
    scipy's least squares with its soft L1 loss; residuals are distances from the sphere in their standard deviations.
    """
    centre, band = start, widest
    for _ in range(STEPS):
        before = centre
        distance, cosine = _seen(points, observers, centre, radius)
        near = (np.abs(distance) <= widest) & ~(cosine < GRAZING_COSINE)
        # From all nearby points, not only those within the band: these would decrease with each iteration.
        spread = max(MAD_TO_SIGMA * float(np.median(np.abs(distance[near]))), MIN_SPREAD) if near.any() else widest
        used = near & (np.abs(distance) <= band)
        if used.sum() < 6:
            return None
        scale = spread * np.clip(cosine[used], MIN_WEIGHT_COSINE, 1.0)
        scale[np.isnan(scale)] = spread
        centre = _step(points[used], scale, centre, radius)
        if not np.linalg.norm(centre - start) < radius:
            return None
        narrower = min(widest, BAND * spread)
        if np.linalg.norm(centre - before) < 1e-6 and abs(narrower - band) < 1e-6:
            break
        band = narrower
    centre, covariance = _solve(points[used], scale, centre, radius, free=False)
    distance, cosine = _seen(points, observers, centre, radius)
    on = (np.abs(distance) <= band) & ~(cosine < HIDDEN_COSINE)
    solution, wider = _solve(points[used], scale, np.append(centre, radius), radius, free=True)
    radius_sigma = math.sqrt(wider[3, 3]) if wider[3, 3] > 0.0 else math.inf  # a plane has no radius
    expected = _rms(np.nan_to_num(cosine[used], nan=1.0))
    return SphereFit(
        centre, covariance, solution[:3], float(solution[3]), radius_sigma, _rms(distance[used]), expected, on, used
    )  # fmt: skip


def _rms(values: Float) -> float:
    return math.sqrt(float(values @ values) / len(values))


def _seen(points: Float, observers: Float, centre: Float, radius: float) -> tuple[Float, Float]:
    """Return the distance of each point from the sphere, outwards positive, and its cosine of incidence, or NaN."""
    out = points - centre
    far = np.maximum(np.linalg.norm(out, axis=1), 1e-9)
    sight = observers - points
    length = np.linalg.norm(sight, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        cosine = np.einsum("ij,ij->i", out, sight) / (far * length)
    return far - radius, cosine


def _step(points: Float, scale: Float, centre: Float, radius: float) -> Float:
    """Make one Gauss-Newton step with the weights of the soft L1 loss."""
    out = points - centre
    far = np.linalg.norm(out, axis=1)
    residual = (far - radius) / scale
    weight = 1.0 / np.sqrt(1.0 + (residual / SOFT_LIMIT) ** 2)
    slope = out / (far * scale)[:, None]
    stepped: Float = centre + np.linalg.lstsq((slope.T * weight) @ slope, (slope.T * weight) @ residual, rcond=1e-9)[0]
    return stepped


def _solve(points: Float, scale: Float, start: Float, radius: float, free: bool) -> tuple[Float, Float]:
    """Return the best centre (and radius) and its covariance; ``scale`` is the standard deviation of each distance."""
    middle = points.mean(axis=0)
    near = points - middle
    begin = np.array(start, float)
    begin[:3] -= middle

    def out_of(x: Float) -> tuple[Float, Float]:
        out = near - x[:3]
        return out, np.linalg.norm(out, axis=1)

    def residuals(x: Float) -> Float:
        return (out_of(x)[1] - (x[3] if free else radius)) / scale

    def slopes(x: Float) -> Float:
        out, far = out_of(x)
        slope = -out / (far * scale)[:, None]
        return np.column_stack([slope, -1.0 / scale]) if free else slope

    result = least_squares(residuals, begin, slopes, method="trf", loss="soft_l1", f_scale=SOFT_LIMIT, xtol=1e-10)
    # Variance of robust estimates (Huber, 1981, section 7.6): influence of each residual, and its derivative.
    r = residuals(result.x)
    jacobian = slopes(result.x)
    bend = 1.0 + (r / SOFT_LIMIT) ** 2
    influence, rate = r / np.sqrt(bend), bend**-1.5
    inverse = np.linalg.pinv(jacobian.T @ (jacobian * rate[:, None]))
    freedom = max(len(r) - len(begin), 1)
    # As if residuals were alike in all directions: their own size in each direction would be mostly chance.
    inner = (jacobian.T @ jacobian) * float(influence @ influence) / freedom
    solution = result.x.copy()
    solution[:3] += middle
    return solution, inverse @ inner @ inverse


def coverage(points: Float, centre: Float, towards: Float) -> float:
    """Return the seen share of a sphere's surface: of 48 cells of equal area, those with a point; half for a hemisphere.

    Parameters
    ----------
    points : (n, 3) float64 array
        Points on the sphere, m.
    centre : (3,) float64 array
        m.
    towards : (3,) float64 array
        Direction to the scanner, which orients the cells: 8 bands of equal height across it, so that the facing hemisphere has
        4 bands, each divided into 6 sectors of 60°.
    """
    return len(np.unique(cells_of(points - centre, towards))) / (BANDS * SECTORS)


def cells_of(out: Float, towards: Float) -> Int64:
    """Return the cell of each point (n,), 0 to 47, as `coverage` counts them.

    Parameters
    ----------
    out : (n, 3) float array
        Points, relative to the centre of their sphere.
    towards : (3,) or (n, 3) float array
        Direction that orients the cells.
    """
    axis = towards / np.linalg.norm(towards, axis=-1, keepdims=True)
    # Any direction across the axis, and the one across both.
    side = np.cross(axis, np.where(np.abs(axis[..., 2:]) < 0.9, [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]))
    side /= np.linalg.norm(side, axis=-1, keepdims=True)
    other = np.cross(axis, side)
    out = out / np.maximum(np.linalg.norm(out, axis=1), 1e-12)[:, None]
    band = np.clip(np.floor((1.0 - (out * axis).sum(axis=1)) * BANDS / 2.0), 0, BANDS - 1)
    angle = np.arctan2((out * other).sum(axis=1), (out * side).sum(axis=1)) / (2.0 * np.pi) + 0.5
    return (band * SECTORS + np.clip(np.floor(angle * SECTORS), 0, SECTORS - 1)).astype(np.int64)


def distance_error(centre: Float, truth: Float) -> float:
    """Return E_distance (eq. 14): distance of a centre from the true one, m."""
    return float(np.linalg.norm(np.asarray(centre) - np.asarray(truth)))


def fit_ratio(distance: float, radius: float, true_radius: float) -> float:
    """Return R_fit (eq. 15 and 16): share of the true sphere's volume that the fitted one overlaps, 0 to 1.

    Parameters
    ----------
    distance : float
        Distance of the two centres, m.
    radius, true_radius : float
        m.
    """
    smaller, larger = sorted((radius, true_radius))
    whole = 4.0 / 3.0 * math.pi * true_radius**3
    if distance >= smaller + larger:
        return 0.0
    if distance <= larger - smaller:  # one is inside the other: eq. 16 has no angle then
        return 4.0 / 3.0 * math.pi * smaller**3 / whole
    alpha = (radius**2 + distance**2 - true_radius**2) / (2.0 * radius * distance)
    beta = (true_radius**2 + distance**2 - radius**2) / (2.0 * true_radius * distance)
    h1, h2 = radius * (1.0 - alpha), true_radius * (1.0 - beta)
    common = math.pi / 3.0 * ((3.0 * radius - h1) * h1**2 + (3.0 * true_radius - h2) * h2**2)
    return common / whole
