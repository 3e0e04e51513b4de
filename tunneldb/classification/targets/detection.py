"""Detection of target spheres of a known radius in a scan, and rejection of other round objects.

After Li et al. (2023, section 2.2, step 4): candidates, a sphere fitted to each by least squares, and a check of its size
against the nominal radius ± ε. Their candidates are clusters as wide as a sphere (eq. 5 to 7), which fails for a sphere on a
tripod, at a wall or behind a cable. Here candidates are places with enough votes (`tunneldb.classification.targets.hough`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from tunneldb.arrays import Bool, Float, Int64
from tunneldb.classification.targets.fit import SphereFit, cells_of, coverage, fit_sphere
from tunneldb.classification.targets.hough import NEIGHBOURHOOD, REACH, PointGrid, hough_candidates
from tunneldb.classification.targets.refinement import refine_spheres

MIN_POINTS = 30
"""Minimum number of points on a sphere; with fewer, its centre has an error of 1 or 2 mm at best and its radius is unknown."""

FIRM_POINTS = 50
"""Number of points from which a sphere is accepted alone; with fewer it must be seen better by another scan. With so few
points, the top of a bollard, a shoulder or a heap of ballast is sometimes as round as a sphere."""

MIN_COVERAGE = 0.15
"""Minimum share of a sphere's surface that is seen."""

# Minimum share of points on the sphere, among those near it in the directions in which it is seen: a sphere is empty inside
# and mostly free outside.
MIN_SHARE_ON_SPHERE = 0.8

QUICK_FIT_FACTOR = 0.8  # factor on the limits of the final fit that the quick fit must reach

NEIGHBOURS = 4  # of a point, whose residuals are compared with its own

# Cylinders around the centre: their rim in sectors of 22.5°, of which 8 are visible; the wall behind a sphere fills at most 3.
SECTORS, RIM = 16, 5
SLICES = 3  # along it; all must have points, so that a plane across it is not classified as a cylinder


@dataclass(frozen=True)
class Sphere:
    """Target sphere as one scan saw it.

    Attributes
    ----------
    centre : (3,) float64 array
        Centre from the fit with the nominal radius, m.
    radius, radius_sigma : float
        Radius of the best sphere with free radius, the check, and its standard deviation, m.
    rms : float
        Root mean square distance of the points from the sphere of the nominal radius, m.
    sigma : float
        Standard deviation of the centre in space, m.
    coverage : float
        Seen share of its surface (`tunneldb.classification.targets.fit.coverage`).
    points : int
        Number of points it was fitted to.
    firm : bool
        True if it is accepted alone (`FIRM_POINTS`).
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
    """Round object that was not accepted as a target sphere.

    Attributes
    ----------
    centre : (3,) float64 array
        m.
    points : int
        Number of points on it.
    reason : str
        Reason, for the report.
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
        Points of the scan, at least those not on walls and floor (`tunneldb.classification.targets.curvature`), m.
    observers : (n, 3) float64 array
        Scanner position for each point, m; NaN if not known.
    radius, tolerance : float
        Nominal radius; maximum difference of the fitted radius from it, and maximum rms, m.

    Returns
    -------
    spheres : list of Sphere
    refusals : list of Refusal
        Spheres, or nearly spheres, that are no such target.
    """
    points = PointGrid(xyz, REACH * radius)
    centres, noise = hough_candidates(points, observers, radius)
    there = refine_spheres(points, centres, radius)
    near_radius = np.abs(there.radius - radius) <= tolerance + 3.0 * there.radius_sigma
    other_ball = (there.radius_sigma <= tolerance / 4.0) & (there.seen >= 1.5 * MIN_COVERAGE)  # for the report
    likely = np.flatnonzero(
        (there.on >= MIN_POINTS)
        & (there.share >= QUICK_FIT_FACTOR * MIN_SHARE_ON_SPHERE)
        & (there.seen >= QUICK_FIT_FACTOR * MIN_COVERAGE)
        & (there.radius_sigma <= tolerance / 2.0 / QUICK_FIT_FACTOR)
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
    """Fit a sphere to the points around a candidate; None if they are not round at all."""
    fit = fit_sphere(points, observers, start, radius, 3.0 * tolerance)
    if fit is None or fit.on.sum() < MIN_POINTS or fit.radius_sigma > tolerance / 2.0:
        return None  # on a plane or a small cap, a sphere cannot be confirmed within the tolerance
    count, max_rms = int(fit.used.sum()), _greatest_rms(fit, tolerance, noise)
    towards = _scanner_direction(points[fit.on], observers[fit.on], fit.centre)
    seen = coverage(points[fit.on], fit.centre, towards)
    if seen < MIN_COVERAGE or _share_on(points, fit, towards, radius, tolerance) < MIN_SHARE_ON_SPHERE:
        return None
    if abs(fit.radius - radius) > math.hypot(tolerance, 2.0 * fit.radius_sigma):
        return _other_ball(points, observers, fit, radius, tolerance, noise)
    if _is_cylinder(points, fit, radius, tolerance):
        return Refusal(fit.centre, count, "cylinder, or end of a cylinder")
    if fit.rms > max_rms:
        return None
    if _deformation(points[fit.used], fit, radius) > tolerance / 3.0:
        return Refusal(fit.centre, count, "round, but not a sphere")
    firm = int(fit.on.sum()) >= FIRM_POINTS
    return Sphere(fit.centre, fit.radius, fit.radius_sigma, fit.rms, fit.sigma, seen, count, firm)


def _greatest_rms(fit: SphereFit, tolerance: float, noise: float) -> float:
    """Return the maximum scatter of the points of a sphere, m: rarely exceeded by chance; noise is known to a tenth."""
    by_chance = 1.0 + 3.0 / math.sqrt(2.0 * float(fit.used.sum()))
    return min(tolerance, 1.1 * by_chance * noise * fit.expected)


def _other_ball(
    points: Float, observers: Float, fit: SphereFit, radius: float, tolerance: float, noise: float
) -> Refusal | None:
    """Return the refusal of a sphere of another radius: a lamp, a helmet."""
    if not radius / 2.0 < fit.radius < 2.0 * radius:
        return None
    other = fit_sphere(points, observers, fit.free_centre, fit.radius, 3.0 * tolerance)
    if other is None or other.on.sum() < MIN_POINTS or other.rms > _greatest_rms(other, tolerance, noise):
        return None
    if abs(other.radius - radius) <= math.hypot(tolerance, 2.0 * other.radius_sigma):
        return None
    reason = f"radius {1e3 * other.radius:.1f} ± {1e3 * other.radius_sigma:.1f} mm"
    return Refusal(other.centre, int(other.used.sum()), reason)


def _scanner_direction(points: Float, observers: Float, centre: Float) -> Float:
    """Return the mean direction to the scanner; that of the points themselves if it is unknown."""
    sight = observers - centre
    sight = sight[np.isfinite(sight[:, 0])]
    out = sight if len(sight) else points - centre
    mean: Float = (out / np.linalg.norm(out, axis=1)[:, None]).mean(axis=0)
    return mean if np.linalg.norm(mean) > 1e-6 else np.array([0.0, 0.0, 1.0])


def _share_on(points: Float, fit: SphereFit, towards: Float, radius: float, tolerance: float) -> float:
    """Return the share of points on the sphere among those in and near it, in the directions in which it is seen."""
    far = np.linalg.norm(points - fit.centre, axis=1)
    on = np.abs(far - radius) <= 1.5 * tolerance
    near = far <= NEIGHBOURHOOD * radius
    if not on.any():
        return 0.0
    selected = np.unique(cells_of(points[on] - fit.centre, towards))
    return float(on.sum()) / float(np.isin(cells_of(points[near] - fit.centre, towards), selected).sum())


def _is_cylinder(points: Float, fit: SphereFit, radius: float, tolerance: float) -> bool:
    """Return True if the surface continues beyond the sphere as a cylinder of its radius: a bollard, a post, a pipe.

    Points along the cylinder on a third of its rim count, from where it is two tolerances off the sphere at its end.
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
    """Return the deviation of the surface under the noise from the sphere, rms, m; 0 if not significant.

    Noise differs from point to point, shape hardly does: the correlation of the residuals of neighbours (Moran's I, 1950,
    Biometrika 37) is the shape's share of their variance. By chance it scatters by about √(2 / (points × neighbours)).
    """
    residual = np.linalg.norm(points - fit.centre, axis=1) - radius
    _, near = cKDTree(points).query(points, NEIGHBOURS + 1)
    alike = float((residual * residual[near[:, 1:]].mean(axis=1)).sum() / (residual @ residual))
    if alike <= 3.0 * math.sqrt(2.0 / (NEIGHBOURS * len(points))):
        return 0.0
    return math.sqrt(alike) * fit.rms


def _axes(count: int) -> Float:
    """Return directions spread evenly (Fibonacci lattice), vertical ones, and two more across each: (count + 2, 3, 3)."""
    k = np.arange(count) + 0.5
    z = np.concatenate([1.0 - 2.0 * k / count, [-1.0, 1.0]])
    angle = np.append(np.pi * (1.0 + math.sqrt(5.0)) * k, [0.0, 0.0])
    across = np.sqrt(1.0 - z * z)
    axis = np.column_stack([across * np.cos(angle), across * np.sin(angle), z])
    side = np.column_stack([-np.sin(angle), np.cos(angle), np.zeros(count + 2)])
    return np.stack([axis, side, np.cross(axis, side)], axis=1)


_AXES = _axes(400)  # 10° apart; posts are vertical


def join(centres: Float, scans: Int64, radius: float) -> Int64:
    """Group rows that are the same sphere, seen from several scans.

    Spheres are solid, so the centres of two are at least two radii apart. Rows nearer to each other than one radius are the
    same, unless they come from one scan. The nearest are joined first.

    Parameters
    ----------
    centres : (n, 3) float64 array
        m.
    scans : (n,) int array
        Scan of each row.
    radius : float
        m.

    Returns
    -------
    (n,) int array
        Group of each row, from 0, in the order of their first rows.
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
    """Return True for rows (n,) of a sphere that is firm in some row of its group, from `join`."""
    return np.isin(group, group[firm])
