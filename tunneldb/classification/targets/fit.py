"""Fitting a sphere to points, and how far it is one (Li et al., 2023, eq. 8 and 14-16).

The centre comes from a fit whose radius is held at the nominal one. A free radius draws the centre along the line of sight:
on half a sphere at 3 mm of range noise, it is two to three times as far off, the more the smaller the cap that is seen.
The free radius serves to tell a target from a ball of another size.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from tunneldb.arrays import Bool, Float, Int64
from tunneldb.robust import MAD_TO_SIGMA

GRAZING = 0.25
"""Cosine of incidence (75.5°) below which a point isn't used where the scanner's place is known: at the limb of a sphere
a beam measures a range between that of the sphere and that of what is behind it."""

BEHIND = -0.1
"""Cosine of incidence below which a point can't lie on the sphere: the sphere itself would hide it."""

SLANT = 0.6
"""The distance of a point from the sphere scatters by the noise of the range × the cosine of incidence, so points seen
slantingly weigh more; no more than at this cosine, since beyond the sphere's curvature over the noise makes it untrue."""

BAND = 3.0  # standard deviations from the sphere within which points are on it
LEAST_SPREAD = 0.0005  # m; files round to as much

SOFT = 1.5  # standard deviations beyond which a residual draws less than in proportion
STEPS = 25

BANDS, SECTORS = 8, 6
"""Coverage is counted on cells of equal area: bands across the direction to the scanner, and sectors around it."""


@dataclass(frozen=True)
class SphereFit:
    """A sphere of the nominal radius through points.

    Attributes
    ----------
    centre : (3,) float64 array
        m.
    covariance : (3, 3) float64 array
        Of the centre, m².
    free_centre : (3,) float64 array
        Of the best sphere of any radius, m.
    radius, radius_sigma : float
        Of that sphere, and its standard deviation, m.
    rms : float
        Root mean square of the distances of the points from the sphere of the nominal radius, m.
    expected : float
        What `rms` would be if ranges had a standard deviation of 1, by the incidence; 1 where that is not known.
    on : (n,) bool array
        Points that lie on the sphere, grazing ones included.
    used : (n,) bool array
        Those that it was fitted to.
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

    Points within three standard deviations of the sphere are on it; the standard deviation is that of the points found so,
    from their median (so what else is near does not count), and the two are brought to agree by turns.

    Parameters
    ----------
    points, observers : (n, 3) float64 arrays
        What is near the sphere, and where the scanner stood for each, m; NaN where that is not known.
    start : (3,) float64 array
        Where its centre is, to a fifth of the radius, m.
    radius : float
        m.
    widest : float
        Points farther from the sphere are never on it, m.

    Returns
    -------
    SphereFit or None
        None if fewer than 6 points are on it, or the fit leads away from the start by a radius.

    Notes
    -----
    scipy's least squares with its soft L1 loss; residuals are distances from the sphere in units of their standard deviation.
    """
    centre, band = start, widest
    for _ in range(STEPS):
        before = centre
        distance, cosine = _seen(points, observers, centre, radius)
        near = (np.abs(distance) <= widest) & ~(cosine < GRAZING)
        # From all that is near, not only from what is within the band: that would be less from turn to turn.
        spread = max(MAD_TO_SIGMA * float(np.median(np.abs(distance[near]))), LEAST_SPREAD) if near.any() else widest
        used = near & (np.abs(distance) <= band)
        if used.sum() < 6:
            return None
        scale = spread * np.clip(cosine[used], SLANT, 1.0)
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
    on = (np.abs(distance) <= band) & ~(cosine < BEHIND)
    solution, wider = _solve(points[used], scale, np.append(centre, radius), radius, free=True)
    radius_sigma = math.sqrt(wider[3, 3]) if wider[3, 3] > 0.0 else math.inf  # a plane has no radius
    expected = _rms(np.nan_to_num(cosine[used], nan=1.0))
    return SphereFit(
        centre, covariance, solution[:3], float(solution[3]), radius_sigma, _rms(distance[used]), expected, on, used
    )  # fmt: skip


def _rms(values: Float) -> float:
    return math.sqrt(float(values @ values) / len(values))


def _seen(points: Float, observers: Float, centre: Float, radius: float) -> tuple[Float, Float]:
    """Distance of each point from the sphere, outwards positive, and cosine of incidence there (NaN without an observer)."""
    out = points - centre
    far = np.maximum(np.linalg.norm(out, axis=1), 1e-9)
    sight = observers - points
    length = np.linalg.norm(sight, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        cosine = np.einsum("ij,ij->i", out, sight) / (far * length)
    return far - radius, cosine


def _step(points: Float, scale: Float, centre: Float, radius: float) -> Float:
    """One Gauss-Newton step with the weights of the soft L1 loss."""
    out = points - centre
    far = np.linalg.norm(out, axis=1)
    residual = (far - radius) / scale
    weight = 1.0 / np.sqrt(1.0 + (residual / SOFT) ** 2)
    slope = out / (far * scale)[:, None]
    stepped: Float = centre + np.linalg.lstsq((slope.T * weight) @ slope, (slope.T * weight) @ residual, rcond=1e-9)[0]
    return stepped


def _solve(points: Float, scale: Float, start: Float, radius: float, free: bool) -> tuple[Float, Float]:
    """Best centre (and radius) and its covariance; ``scale`` is the standard deviation of each point's distance."""
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

    result = least_squares(residuals, begin, slopes, method="trf", loss="soft_l1", f_scale=SOFT, xtol=1e-10)
    # Variance of robust estimates (Huber, 1981, section 7.6): the influence of each residual, and how fast it changes.
    r = residuals(result.x)
    jacobian = slopes(result.x)
    bend = 1.0 + (r / SOFT) ** 2
    influence, rate = r / np.sqrt(bend), bend**-1.5
    inverse = np.linalg.pinv(jacobian.T @ (jacobian * rate[:, None]))
    freedom = max(len(r) - len(begin), 1)
    # As if residuals were alike in all directions: their own size in each would say less of it than of chance.
    inner = (jacobian.T @ jacobian) * float(influence @ influence) / freedom
    solution = result.x.copy()
    solution[:3] += middle
    return solution, inverse @ inner @ inverse


def coverage(points: Float, centre: Float, towards: Float) -> float:
    """Share of a sphere's surface that is seen: of 48 cells of equal area, those that hold a point; half for a hemisphere.

    Parameters
    ----------
    points : (n, 3) float64 array
        Points on the sphere, m.
    centre : (3,) float64 array
        m.
    towards : (3,) float64 array
        Direction that the cells are laid out by, to the scanner: 8 bands of equal height across it, so that the hemisphere
        that faces it is 4 bands, each cut into 6 sectors of 60°.
    """
    return len(np.unique(cells_of(points - centre, towards))) / (BANDS * SECTORS)


def cells_of(out: Float, towards: Float) -> Int64:
    """Cell of each point (n,), 0 to 47, as `coverage` counts them.

    Parameters
    ----------
    out : (n, 3) float array
        Points, from the centre of their sphere.
    towards : (3,) or (n, 3) float array
        Direction that the cells are laid out by.
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
    """E_distance (eq. 14): distance of a centre from the true one, m."""
    return float(np.linalg.norm(np.asarray(centre) - np.asarray(truth)))


def fit_ratio(distance: float, radius: float, true_radius: float) -> float:
    """R_fit (eq. 15 and 16): share of the true sphere's volume that the fitted one has in common with it, 0 to 1.

    Parameters
    ----------
    distance : float
        Of the two centres, m.
    radius, true_radius : float
        m.
    """
    smaller, larger = sorted((radius, true_radius))
    whole = 4.0 / 3.0 * math.pi * true_radius**3
    if distance >= smaller + larger:
        return 0.0
    if distance <= larger - smaller:  # one lies within the other: eq. 16 has no angle then
        return 4.0 / 3.0 * math.pi * smaller**3 / whole
    alpha = (radius**2 + distance**2 - true_radius**2) / (2.0 * radius * distance)
    beta = (true_radius**2 + distance**2 - radius**2) / (2.0 * true_radius * distance)
    h1, h2 = radius * (1.0 - alpha), true_radius * (1.0 - beta)
    common = math.pi / 3.0 * ((3.0 * radius - h1) * h1**2 + (3.0 * true_radius - h2) * h2**2)
    return common / whole
