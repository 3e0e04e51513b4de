"""Refine candidates quickly, all together, to the best fit of a sphere of the radius; most are rejected."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tunneldb.arrays import Bool, Float, Int64
from tunneldb.classification.targets.fit import BANDS, SECTORS, cells_of
from tunneldb.classification.targets.hough import NEIGHBOURHOOD, PointGrid
from tunneldb.threads import in_blocks

# In radii of the spheres:
FIRST_REACH = 0.25  # distance from the sphere of points with weight at first,
LAST_REACH = 0.1  # and at the end
PASSES = 12

_BLOCK = 256  # candidates at a time
_CELLS = BANDS * SECTORS


class RefinedSpheres(NamedTuple):
    """Refined candidates, k of them.

    Attributes
    ----------
    centres : (k, 3) float64 array
        NaN if the centre moved away by a radius or had no points, m.
    on : (k,) int array
        Number of points within `LAST_REACH` radii of the sphere.
    share : (k,) float64 array
        Share on the sphere of the points in and near it, in the directions in which it is seen.
    seen : (k,) float64 array
        Seen share of its surface, as `tunneldb.classification.targets.fit.coverage`, about the mean direction of the points on
        it.
    radius, radius_sigma : (k,) float64 arrays
        Radius of the best sphere with free radius, and its standard deviation, m; infinite if there is none.
    """

    centres: Float
    on: Int64
    share: Float
    seen: Float
    radius: Float
    radius_sigma: Float


def refine_spheres(points: PointGrid, centres: Float, radius: float) -> RefinedSpheres:
    """Fit spheres of a radius (m) to candidates (k, 3) by Gauss-Newton steps with Tukey's weights of decreasing reach."""
    count = len(centres)
    found = RefinedSpheres(
        np.full((count, 3), np.nan), np.zeros(count, np.int64), np.zeros(count), np.zeros(count),
        np.full(count, np.inf), np.full(count, np.inf),
    )  # fmt: skip

    def work(begin: int, end: int) -> None:
        start = centres[begin:end]
        near, candidate = points.around(start, (NEIGHBOURHOOD + FIRST_REACH) * radius)
        xyz, start = points.xyz[near], start - points.low
        centre, kept = _fit_centres(xyz, candidate, start, radius)
        # Points and numbers of the remaining candidates.
        chosen = kept[candidate]
        xyz, candidate = xyz[chosen], (np.cumsum(kept) - 1)[candidate[chosen]]
        number, centre = begin + np.flatnonzero(kept), centre[kept]
        found.centres[number] = centre + points.low
        found.on[number], found.share[number], found.seen[number] = _extent(xyz, candidate, centre, radius)
        found.radius[number], found.radius_sigma[number] = _fit_radii(xyz, candidate, centre, radius)

    in_blocks(work, count, _BLOCK)
    return found


def _equations(
    xyz: Float, candidate: Int64, centre: Float, radius: Float, reach: Float, free: bool
) -> tuple[Float, Float, Int64, Float]:
    """Build the normal equations of spheres with Tukey's weights.

    Parameters
    ----------
    xyz, candidate : (n, 3) and (n,) arrays
        Points, and for each the number of its sphere.
    centre, radius, reach : (k, 3), (k,) and (k,) arrays
        Spheres, and the maximum distance of points with weight, m.
    free : bool
        True if the radius is unknown too.

    Returns
    -------
    matrix, vector : (k, m, m) and (k, m) arrays
        m is 3, or 4 with the radius.
    count, squares : (k,) arrays
        Number of points with weight, and the weighted sum of their squared distances, m².
    """
    out = xyz - centre[candidate]
    far = np.sqrt(out[:, 0] * out[:, 0] + out[:, 1] * out[:, 1] + out[:, 2] * out[:, 2])
    off = far - radius[candidate]
    drawing = (np.abs(off) < reach[candidate]) & (far > 0.0)
    out, far, off, candidate = out[drawing], far[drawing], off[drawing], candidate[drawing]
    weight = 1.0 - (off / reach[candidate]) ** 2
    weight = weight * weight
    slope = [*(out / far[:, None]).T, *([np.ones(len(far))] if free else [])]

    def total(values: Float) -> Float:
        return np.asarray(np.bincount(candidate, values, minlength=len(centre)), np.float64)

    vector = np.stack([total(weight * one * off) for one in slope], axis=-1)
    matrix = np.stack([np.stack([total(weight * one * other) for other in slope], axis=-1) for one in slope], axis=-2)
    return matrix, vector, np.bincount(candidate, minlength=len(centre)), total(weight * off * off)


def _fit_centres(xyz: Float, candidate: Int64, start: Float, radius: float) -> tuple[Float, Bool]:
    """Return fitted centres (k, 3) of spheres of a radius, and True for those worth keeping."""
    centre, kept = start.copy(), np.ones(len(start), np.bool_)
    for step in range(PASSES):
        reach = radius * max(LAST_REACH, FIRST_REACH * 0.85**step)
        alike = np.full(len(start), radius), np.full(len(start), reach)
        matrix, vector, _, _ = _equations(xyz, candidate, centre, *alike, free=False)
        trace = np.trace(matrix, axis1=1, axis2=2)
        kept &= trace >= 4.0
        if not kept.any():
            break
        # Across a nearly flat patch the centre is not determined: it stays there.
        matrix = matrix[kept] + 1e-3 * trace[kept, None, None] * np.eye(3)
        centre[kept] += np.linalg.solve(matrix, vector[kept, :, None])[..., 0]
        kept &= ((centre - start) ** 2).sum(axis=1) <= radius * radius
        selected = kept[candidate]
        xyz, candidate = xyz[selected], candidate[selected]
    return centre, kept


def _fit_radii(xyz: Float, candidate: Int64, centre: Float, radius: float) -> tuple[Float, Float]:
    """Return the radius of the best sphere with free radius, and its standard deviation; infinite if there is none."""
    count = len(centre)
    state = np.column_stack([centre, np.full(count, radius)])
    sigma, lost = np.full(count, np.inf), np.zeros(count, np.bool_)
    reach = np.full(count, FIRST_REACH * radius)
    for step in range(PASSES):
        matrix, vector, drawing, squares = _equations(xyz, candidate, state[:, :3], state[:, 3], reach, free=True)
        lost |= drawing < 6
        total = np.where(lost, 1.0, matrix[:, 3, 3])
        lost |= np.abs(np.linalg.det(matrix / total[:, None, None])) < 1e-12
        kept = np.flatnonzero(~lost)
        state[kept] += np.linalg.solve(matrix[kept], vector[kept, :, None])[..., 0]
        lost |= ~((state[:, 3] > 0.2 * radius) & (state[:, 3] < 5.0 * radius))
        reach = np.maximum(0.9 * reach, LAST_REACH * radius)
        if step == PASSES - 1:
            kept = np.flatnonzero(~lost)
            sigma[kept] = np.sqrt(np.linalg.inv(matrix[kept])[:, 3, 3] * squares[kept] / matrix[kept, 3, 3])
    return np.where(lost, np.inf, state[:, 3]), sigma


def _extent(xyz: Float, candidate: Int64, centre: Float, radius: float) -> tuple[Int64, Float, Float]:
    """Return the points on each sphere, their share of those near it where it is seen, and the seen share of its surface."""
    count = len(centre)
    out = xyz - centre[candidate]
    far = np.sqrt(out[:, 0] * out[:, 0] + out[:, 1] * out[:, 1] + out[:, 2] * out[:, 2])
    on = np.abs(far - radius) <= LAST_REACH * radius
    number = np.bincount(candidate[on], minlength=count)
    towards = np.column_stack([np.bincount(candidate[on], out[on, axis], minlength=count) for axis in range(3)])
    known = (number > 0) & (np.linalg.norm(towards, axis=1) > 0.0)
    near = (far <= NEIGHBOURHOOD * radius) & (far > 0.0) & known[candidate]
    sphere, held_by = candidate[near], on[near]
    cell = sphere * _CELLS + cells_of(out[near], towards[sphere])
    there = np.bincount(cell, minlength=count * _CELLS).reshape(count, _CELLS)
    selected = np.bincount(cell[held_by], minlength=count * _CELLS).reshape(count, _CELLS) > 0
    among = np.where(selected, there, 0).sum(axis=1)
    share = np.where(known, number, 0) / np.maximum(among, 1)
    return np.where(known, number, 0), share, selected.mean(axis=1)
