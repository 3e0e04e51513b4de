"""Target spheres: finding those of a known radius in a scan, and telling them from what else is round.

After Li et al. (2023, section 2.2, step 4): candidates, a sphere fitted to each by least squares, a check of its size against
the nominal radius ± ε. Their candidates are clusters as wide as a sphere (eq. 5 to 7), which a sphere on a tripod, at a
wall or behind a cable is not; here they are places that enough points vote for (`tunneldb.classification.targets.hough`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from tunneldb.arrays import Bool, Float, Int64
from tunneldb.classification.targets.fit import SphereFit, cells_of, coverage, fit_sphere
from tunneldb.classification.targets.hough import NEAR, REACH, PointGrid, hough_candidates
from tunneldb.classification.targets.refinement import refine_spheres

LEAST_POINTS = 30
"""Points on a sphere; with fewer, its centre is known to 1 or 2 mm at best and its radius not at all."""

FIRM_POINTS = 50
"""Points with which a sphere stands by itself; one with fewer must be seen better by another scan: by so few points, now and
then the top of a bollard, a shoulder or a heap of ballast is as round as a sphere."""

LEAST_COVERAGE = 0.15
"""Share of a sphere's surface that must be seen."""

# Of the points near the sphere, in the directions in which it is seen, this share lies on it: there is nothing in a sphere,
# and mostly nothing on it.
SHARE = 0.8

ROUGH = 0.8  # the quick fit's figures may fall short by so much of what the final ones must reach

NEIGHBOURS = 4  # of a point, whose residuals are compared with its own

# Cylinders about the centre: their rim in sectors of 22.5°, of which one sees 8; the wall behind a sphere fills 3 at most.
SECTORS, RIM = 16, 5
SLICES = 3  # along it, that must all hold points, so that a plane across it doesn't tell


@dataclass(frozen=True)
class Sphere:
    """A target sphere as one scan saw it.

    Attributes
    ----------
    centre : (3,) float64 array
        From the fit with the nominal radius, m.
    radius, radius_sigma : float
        Of the best sphere of any radius, the check, and its standard deviation, m.
    rms : float
        Root mean square distance of the points from the sphere of the nominal radius, m.
    sigma : float
        Standard deviation of the centre in space, m.
    coverage : float
        Share of its surface that is seen (`tunneldb.classification.targets.fit.coverage`).
    points : int
        Points that it was fitted to.
    firm : bool
        Whether it stands by itself (`FIRM_POINTS`).
    """

    centre: Float
    radius: float
    radius_sigma: float
    rms: float
    sigma: float
    coverage: float
    points: int
    firm: bool


@dataclass(frozen=True)
class Refusal:
    """Something round that was not taken for a target sphere.

    Attributes
    ----------
    centre : (3,) float64 array
        m.
    points : int
        Points on it.
    reason : str
        Why, for the report.
    """

    centre: Float
    points: int
    reason: str


def find_spheres(
    xyz: Float, observers: Float, radius: float, tolerance: float, noise: float = math.inf
) -> tuple[list[Sphere], list[Refusal]]:
    """Find the target spheres in one scan.

    Parameters
    ----------
    xyz : (n, 3) float64 array
        The scan's points, at least those that don't lie on walls and floor (`tunneldb.classification.targets.curvature`), m.
    observers : (n, 3) float64 array
        Where the scanner stood for each, m; NaN where that is not known.
    radius, tolerance : float
        Nominal radius; greatest difference of the fitted radius from it, and greatest rms, m.

    Returns
    -------
    spheres : list of Sphere
    refusals : list of Refusal
        What is a ball or nearly, but no such sphere.
    """
    points = PointGrid(xyz, REACH * radius)
    centres, noise = hough_candidates(points, observers, radius)
    there = refine_spheres(points, centres, radius)
    near_radius = np.abs(there.radius - radius) <= tolerance + 3.0 * there.radius_sigma
    other_ball = (there.radius_sigma <= tolerance / 4.0) & (there.seen >= 1.5 * LEAST_COVERAGE)  # for the report
    likely = np.flatnonzero(
        (there.on >= LEAST_POINTS)
        & (there.share >= ROUGH * SHARE)
        & (there.seen >= ROUGH * LEAST_COVERAGE)
        & (there.radius_sigma <= tolerance / 2.0 / ROUGH)
        & (near_radius | other_ball)
    )
    spheres: list[Sphere] = []
    refusals: list[Refusal] = []
    for k in likely[np.argsort(-there.on[likely], kind="stable")]:
        # Spheres are solid: there is no second one within a radius of a centre.
        if _is_taken(there.centres[k], radius, spheres) or _is_taken(there.centres[k], radius, refusals):
            continue
        near = points.order[points.around(there.centres[k : k + 1], 2.0 * radius)[0]]
        found = _fit_candidate(xyz[near], observers[near], there.centres[k], radius, tolerance, noise)
        if isinstance(found, Sphere):
            if not _is_taken(found.centre, radius, spheres):
                spheres.append(found)
        elif found is not None:
            refusals.append(found)
    return spheres, [refusal for refusal in refusals if not _is_taken(refusal.centre, radius, spheres)]


def _is_taken(centre: Float, radius: float, found: Sequence[Sphere] | Sequence[Refusal]) -> bool:
    return any(float(np.linalg.norm(centre - other.centre)) < radius for other in found)


def _fit_candidate(
    points: Float, observers: Float, start: Float, radius: float, tolerance: float, noise: float
) -> Sphere | Refusal | None:
    """Fit a sphere to the points around a candidate; None for what isn't even round."""
    fit = fit_sphere(points, observers, start, radius, 3.0 * tolerance)
    if fit is None or fit.on.sum() < LEAST_POINTS or fit.radius_sigma > tolerance / 2.0:
        return None  # of a plane or a small cap, it cannot be told within the tolerance whether it is a sphere
    count, most = int(fit.used.sum()), _greatest_rms(fit, tolerance, noise)
    towards = _scanner_direction(points[fit.on], observers[fit.on], fit.centre)
    seen = coverage(points[fit.on], fit.centre, towards)
    if seen < LEAST_COVERAGE or _share_on(points, fit, towards, radius, tolerance) < SHARE:
        return None
    if abs(fit.radius - radius) > math.hypot(tolerance, 2.0 * fit.radius_sigma):
        return _other_ball(points, observers, fit, radius, tolerance, noise)
    if _is_cylinder(points, fit, radius, tolerance):
        return Refusal(fit.centre, count, "it is a cylinder, or the end of one")
    if fit.rms > most:
        return None
    if _deformation(points[fit.used], fit, radius) > tolerance / 3.0:
        return Refusal(fit.centre, count, "it is round, but no sphere")
    firm = int(fit.on.sum()) >= FIRM_POINTS
    return Sphere(fit.centre, fit.radius, fit.radius_sigma, fit.rms, fit.sigma, seen, count, firm)


def _greatest_rms(fit: SphereFit, tolerance: float, noise: float) -> float:
    """By how much points of a sphere may scatter, m: chance hardly makes so few do so by more; noise is known to a tenth."""
    by_chance = 1.0 + 3.0 / math.sqrt(2.0 * float(fit.used.sum()))
    return min(tolerance, 1.1 * by_chance * noise * fit.expected)


def _other_ball(
    points: Float, observers: Float, fit: SphereFit, radius: float, tolerance: float, noise: float
) -> Refusal | None:
    """What is a sphere, but of another radius: a lamp, a helmet."""
    if not radius / 2.0 < fit.radius < 2.0 * radius:
        return None
    other = fit_sphere(points, observers, fit.free_centre, fit.radius, 3.0 * tolerance)
    if other is None or other.on.sum() < LEAST_POINTS or other.rms > _greatest_rms(other, tolerance, noise):
        return None
    if abs(other.radius - radius) <= math.hypot(tolerance, 2.0 * other.radius_sigma):
        return None
    reason = f"its radius is {1e3 * other.radius:.1f} ± {1e3 * other.radius_sigma:.1f} mm"
    return Refusal(other.centre, int(other.used.sum()), reason)


def _scanner_direction(points: Float, observers: Float, centre: Float) -> Float:
    """Direction in which the scanner is, in the mean; that of the points themselves where it isn't known."""
    sight = observers - centre
    sight = sight[np.isfinite(sight[:, 0])]
    out = sight if len(sight) else points - centre
    mean: Float = (out / np.linalg.norm(out, axis=1)[:, None]).mean(axis=0)
    return mean if np.linalg.norm(mean) > 1e-6 else np.array([0.0, 0.0, 1.0])


def _share_on(points: Float, fit: SphereFit, towards: Float, radius: float, tolerance: float) -> float:
    """Share of the points in and near the sphere, in the directions in which it is seen, that lie on it."""
    far = np.linalg.norm(points - fit.centre, axis=1)
    on = np.abs(far - radius) <= 1.5 * tolerance
    near = far <= NEAR * radius
    if not on.any():
        return 0.0
    held = np.unique(cells_of(points[on] - fit.centre, towards))
    return float(on.sum()) / float(np.isin(cells_of(points[near] - fit.centre, towards), held).sum())


def _is_cylinder(points: Float, fit: SphereFit, radius: float, tolerance: float) -> bool:
    """Whether the surface goes on beyond the sphere as a cylinder of its radius: a bollard, a post, a pipe.

    From where a cylinder has left the sphere that it ends in by two tolerances, points along it on a third of its rim tell.
    """
    out = points[~fit.on] - fit.centre
    begin = math.sqrt(radius**2 - max(radius - 2.0 * tolerance, 0.0) ** 2)
    step = (2.0 * radius - begin) / SLICES
    for axis, side, other in _AXES:
        along, x, y = out @ axis, out @ side, out @ other
        chosen = (along > begin) & (along < 2.0 * radius) & (np.abs(np.hypot(x, y) - radius) <= tolerance)
        if chosen.sum() < RIM * SLICES:
            continue
        sector = np.floor((np.arctan2(y[chosen], x[chosen]) / (2.0 * np.pi) + 0.5) * SECTORS).astype(np.int64) % SECTORS
        place = np.zeros((SECTORS, SLICES), np.bool_)
        place[sector, np.minimum(((along[chosen] - begin) / step).astype(np.int64), SLICES - 1)] = True
        if place.all(axis=1).sum() >= RIM:
            return True
    return False


def _deformation(points: Float, fit: SphereFit, radius: float) -> float:
    """By how much the surface under the noise differs from the sphere, rms, m; 0 where that can't be told from chance.

    Noise differs from point to point, and a shape hardly does: the correlation of the residuals of neighbours (Moran's I, 1950,
    Biometrika 37) is the shape's share of their variance. By chance it scatters by about √(2 / (points × neighbours)).
    """
    residual = np.linalg.norm(points - fit.centre, axis=1) - radius
    _, near = cKDTree(points).query(points, NEIGHBOURS + 1)
    alike = float((residual * residual[near[:, 1:]].mean(axis=1)).sum() / (residual @ residual))
    if alike <= 3.0 * math.sqrt(2.0 / (NEIGHBOURS * len(points))):
        return 0.0
    return math.sqrt(alike) * fit.rms


def _axes(count: int) -> Float:
    """Directions spread evenly (Fibonacci lattice), straight up and down, and two more across each: (count + 2, 3, 3)."""
    k = np.arange(count) + 0.5
    z = np.concatenate([1.0 - 2.0 * k / count, [-1.0, 1.0]])
    angle = np.append(np.pi * (1.0 + math.sqrt(5.0)) * k, [0.0, 0.0])
    across = np.sqrt(1.0 - z * z)
    axis = np.column_stack([across * np.cos(angle), across * np.sin(angle), z])
    side = np.column_stack([-np.sin(angle), np.cos(angle), np.zeros(count + 2)])
    return np.stack([axis, side, np.cross(axis, side)], axis=1)


_AXES = _axes(400)  # 10° apart; posts stand upright


def join(centres: Float, scans: Int64, radius: float) -> Int64:
    """Tell which rows are the same sphere, seen from several scans.

    Spheres are solid, so the centres of two are two radii apart or more; rows nearer to each other than one radius are the
    same, unless they come from one scan. The nearest are joined first.

    Parameters
    ----------
    centres : (n, 3) float64 array
        m.
    scans : (n,) int array
        Scan of each.
    radius : float
        m.

    Returns
    -------
    (n,) int array
        Group of each, from 0, in the order of their first rows.
    """
    count = len(centres)
    group = np.arange(count)
    gap = np.linalg.norm(centres[:, None] - centres[None], axis=2) if count else np.zeros((0, 0))
    rows, columns = np.nonzero(np.triu(gap < radius, 1))
    for pair in np.lexsort((columns, rows, gap[rows, columns])):
        one, other = group[rows[pair]], group[columns[pair]]
        if one != other and not np.intersect1d(scans[group == one], scans[group == other]).size:
            group[group == max(one, other)] = min(one, other)
    return np.unique(group, return_inverse=True)[1].astype(np.int64)


def confirmed(group: Int64, firm: Bool) -> Bool:
    """Whether each row (n,) is of a sphere that stands by itself in some row of its group, as `join` has them."""
    return np.isin(group, group[firm])
