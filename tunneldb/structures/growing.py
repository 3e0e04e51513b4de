"""Faces grown over voxels: planes and cylinders (Ono et al., 3.1, with models in the place of normals alone).

From the flattest voxel on, a plane is grown over its neighbours, and where normals turn about an axis a cylinder, too; the
one that explains more points stays. Each voxel is compared with the face's own model: the distance of its centroid, the spread
of its points and its normal.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Float, Int32, Int64
from tunneldb.compiled import inner, kernel
from tunneldb.geometry.normals import eigenvalues, normal
from tunneldb.structures.models import WIDTH, distance, fit_cylinder, fit_plane, gradient, seen_angle
from tunneldb.structures.voxel_grid import VoxelGrid, VoxelPlanes
from tunneldb.threads import in_blocks

TOLERANCE = 2.5
"""Maximum distance of a centroid from the face, in standard deviations of the noise."""

MAX_SPREAD = 2.5
"""Maximum spread of a voxel's points about the face, in standard deviations of the noise."""

MIN_TOLERANCE = 0.001
"""Lower limit of both, m: coordinates are rounded, and sheets are not perfectly flat."""

MIN_NOISE, MAX_NOISE, UNKNOWN_NOISE = 0.0003, 0.006, 0.002
"""Limits of the noise, m: rougher surfaces are rock or soil, and without flat surfaces it is unknown."""

TURN = 18.0
"""Maximum angle between the normals of a face's voxels and its own, degrees: with few points they scatter."""

MAX_RADIUS = 3.0
"""Maximum radius of a cylinder, m: vessels and ducts. Larger ones are flat over the width of a beam or pipe."""

MIN_RADIUS_SIGMAS = 4.0
"""Minimum radius of a cylinder, in standard deviations of the noise."""

MIN_ANGLE = 50.0
"""Minimum angle over which a cylinder is seen, degrees: with less its radius is unknown."""

MIN_POINTS, MIN_VOXELS = 60, 8
"""Minimum number of points and of voxels of a face."""

PATCH = 150
"""Number of voxels used to test whether normals turn about an axis."""

VAIN = 3
"""Number of unsuccessful cylinder patches with a voxel from which no cylinder is tried at it."""

MAX_REGROWTHS = 6
"""Maximum number of times that a plane is grown again from its seed with the improved plane."""

MAX_SURFACE_VARIATION = 0.06
"""Surface variation above which no face is started: vegetation, bundles of cables."""


@dataclass(frozen=True)
class Grown:
    """Faces of voxels.

    Attributes
    ----------
    owner : (n,) int32 array
        Face of each voxel, -1 for none.
    models : (k, WIDTH) float array
        Their models, see `models`.
    rms : (k,) float array
        Distance of the centroids from the model, or of the points from a plane, m.
    """

    owner: Int32
    models: Float
    rms: Float


def noise_of(planes: VoxelPlanes, towards: Float) -> float:
    """Estimate the standard deviation of ranges, m: of points about flat surfaces, over the cosine of incidence.

    Parameters
    ----------
    planes : VoxelPlanes
    towards : (n, 3) float array
        Unit vectors from the voxels to the scanner.
    """
    cosine = np.einsum("ni,ni->n", planes.normal, towards)
    flat = (planes.variation < 0.01) & (cosine > 0.5)
    if not flat.any():
        return UNKNOWN_NOISE
    return float(np.clip(np.median(planes.rms[flat] / cosine[flat]), MIN_NOISE, MAX_NOISE))


def grow(grid: VoxelGrid, starts: Int64, neighbours: Int32, planes: VoxelPlanes, towards: Float, noise: float) -> Grown:
    """Grow the faces of a grid.

    Parameters
    ----------
    grid, starts, neighbours, planes
        Voxels, which touch, and the plane of each.
    towards : (n, 3) float array
        Unit vectors to the scanner: noise is along the beam, so that an oblique surface shows less of it.
    noise : float
        Standard deviation of ranges, m.
    """
    # What is as flat as noise lets it be is equally so; of that, where most points are comes first.
    cosine = np.einsum("ni,ni->n", planes.normal, towards)
    rough = np.maximum(planes.rms / np.maximum(noise * cosine, MIN_NOISE), 1.2)
    owner = np.full(len(grid), -1, np.int32)
    centroid, bounds = grid.centroids, np.append(np.unique(grid.scan, return_index=True)[1], len(grid))
    found: list[tuple[Float, Float]] = [(np.empty((0, WIDTH)), np.empty(0))] * (len(bounds) - 1)

    def of_scan(number: int, _: int) -> None:
        here = slice(bounds[number], bounds[number + 1])
        order = np.lexsort([-planes.support[here], np.round(rough[here], 1)])
        order = order[planes.variation[here][order] < MAX_SURFACE_VARIATION]
        beside = starts[here.start : here.stop + 1]
        most = (here.stop - here.start) // MIN_VOXELS + 1
        models, rms = np.zeros((most, WIDTH)), np.zeros(most)
        count = _grow_all(
            order, grid.moments[here], centroid[here], planes.normal[here], towards[here], beside - beside[0],
            neighbours[beside[0] : beside[-1]] - np.int32(here.start), noise, grid.edge, owner[here], models, rms,
        )  # fmt: skip
        found[number] = models[:count], rms[:count]

    in_blocks(of_scan, len(found), 1)
    first = np.cumsum([0, *(len(rms) for _, rms in found)])
    for number, start in enumerate(first[:-1].tolist()):
        part = owner[bounds[number] : bounds[number + 1]]
        part[part >= 0] += start
    return Grown(owner, *(np.concatenate(part) for part in zip(*found, strict=True)))


@inner
def _spread(row: Float, c: Float, gx: float, gy: float, gz: float) -> float:  # pragma: no cover - compiled
    """Return the variance of a voxel's points along a direction, m²."""
    n = row[0]
    return (
        gx * gx * (row[4] / n - c[0] * c[0])
        + gy * gy * (row[5] / n - c[1] * c[1])
        + gz * gz * (row[6] / n - c[2] * c[2])
        + 2.0 * gx * gy * (row[7] / n - c[0] * c[1])
        + 2.0 * gx * gz * (row[8] / n - c[0] * c[2])
        + 2.0 * gy * gz * (row[9] / n - c[1] * c[2])
    )


@inner
def _spread_over(
    seed: int, model: Float, least_cosine: float, loose: float, noise: float, sag: float, refit: bool,
    moments: Float, centroid: Float, normals: Float, towards: Float, starts: Int64, neighbours: Int32,
    owner: Int32, mark: Int32, stamp: int, queue: Int32, total: Float,
) -> int:  # pragma: no cover - compiled  # fmt: skip
    """Grow a face from a seed; the number of its voxels, which are in ``queue``, their moments summed in ``total``."""
    queue[0], mark[seed] = seed, stamp
    total[:] = moments[seed]
    count, at, fitted = 1, 0, 8
    while at < count:
        i = queue[at]
        at += 1
        for e in range(starts[i], starts[i + 1]):
            j = neighbours[e]
            if owner[j] != -1 or mark[j] == stamp:
                continue
            x, y, z = centroid[j, 0], centroid[j, 1], centroid[j, 2]
            off = distance(model, x, y, z)
            gx, gy, gz = gradient(model, x, y, z)
            n = moments[j, 0]
            spread = max(_spread(moments[j], centroid[j], gx, gy, gz), 0.0)
            if model[6] > 0.0:  # the centroid of a curved patch lies inside
                tx = model[4] * gz - model[5] * gy
                ty = model[5] * gx - model[3] * gz
                tz = model[3] * gy - model[4] * gx
                off += model[7] * max(_spread(moments[j], centroid[j], tx, ty, tz), 0.0) / (2.0 * model[6])
            sigma = noise * abs(gx * towards[j, 0] + gy * towards[j, 1] + gz * towards[j, 2])
            if abs(off) > loose * max(TOLERANCE * sigma, MIN_TOLERANCE):
                continue
            widest = loose * max(MAX_SPREAD * sigma, 1.5 * MIN_TOLERANCE) + sag
            if spread + off * off > widest * widest:
                continue
            turn = normals[j, 0] * gx + normals[j, 1] * gy + normals[j, 2] * gz
            known = normals[j, 0] != 0.0 or normals[j, 1] != 0.0 or normals[j, 2] != 0.0
            if known and turn < least_cosine:
                continue
            if not known and n < 2.0:
                continue
            mark[j] = stamp
            queue[count] = j
            count += 1
            for k in range(10):
                total[k] += moments[j, k]
            if refit and count == fitted:
                fit_plane(total, model)
                fitted = fitted + fitted // 2
    return count


@inner
def _turning(
    seed: int, moments: Float, centroid: Float, normals: Float, starts: Int64, neighbours: Int32,
    owner: Int32, mark: Int32, stamp: int, queue: Int32, model: Float,
) -> int:  # pragma: no cover - compiled  # fmt: skip
    """Count the voxels around a seed, written to ``queue``, whose normals turn about an axis; 0 if they do not.

    A first cylinder into ``model`` then.
    """
    queue[0], mark[seed] = seed, stamp
    count, at = 1, 0
    while at < count and count < PATCH:
        i = queue[at]
        at += 1
        for e in range(starts[i], starts[i + 1]):
            j = neighbours[e]
            if owner[j] != -1 or mark[j] == stamp or count >= PATCH:
                continue
            turn = 0.0
            for k in range(3):
                turn += normals[i, k] * normals[j, k]
            if turn < 0.8:
                continue
            mark[j] = stamp
            queue[count] = j
            count += 1
    if count < MIN_VOXELS:
        return 0
    nn, weight = np.zeros(6), 0.0
    mean, middle = np.zeros(3), np.zeros(3)
    for m in range(count):
        i = queue[m]
        w = min(moments[i, 0], 20.0)
        nn[0] += w * normals[i, 0] * normals[i, 0]
        nn[1] += w * normals[i, 1] * normals[i, 1]
        nn[2] += w * normals[i, 2] * normals[i, 2]
        nn[3] += w * normals[i, 0] * normals[i, 1]
        nn[4] += w * normals[i, 0] * normals[i, 2]
        nn[5] += w * normals[i, 1] * normals[i, 2]
        for k in range(3):
            mean[k] += w * normals[i, k]
            middle[k] += w * centroid[i, k]
        weight += w
    nn /= weight
    mean /= weight
    middle /= weight
    least, between, _ = eigenvalues(nn[0], nn[1], nn[2], nn[3], nn[4], nn[5])
    if between < 0.003 or between < 4.0 * least:  # spread of 3° and more, across the axis
        return 0
    ax, ay, az = normal(nn[0], nn[1], nn[2], nn[3], nn[4], nn[5], least)
    if ax == 0.0 and ay == 0.0 and az == 0.0:
        return 0
    # Radius and axis by least squares from centroid = axis point + radius × normal, across the axis.
    product, square = 0.0, 0.0
    for m in range(count):
        i = queue[m]
        w = min(moments[i, 0], 20.0)
        na = (normals[i, 0] - mean[0]) * ax + (normals[i, 1] - mean[1]) * ay + (normals[i, 2] - mean[2]) * az
        for k in range(3):
            axis = ax if k == 0 else ay if k == 1 else az
            d = normals[i, k] - mean[k] - na * axis
            product += w * d * (centroid[i, k] - middle[k])
            square += w * d * d
    if square <= 0.0:
        return 0
    radius = product / square
    if not 0.003 < abs(radius) < MAX_RADIUS:
        return 0
    for k in range(3):
        model[k] = middle[k] - radius * mean[k]
    model[3], model[4], model[5] = ax, ay, az
    model[6], model[7] = abs(radius), 1.0 if radius > 0.0 else -1.0
    return count


@kernel
def _grow_all(
    order: Int64, moments: Float, centroid: Float, normals: Float, towards: Float, starts: Int64, neighbours: Int32,
    noise: float, edge: float, owner: Int32, models: Float, rms: Float,
) -> int:  # pragma: no cover - compiled  # fmt: skip
    n = centroid.shape[0]
    mark, tried, vain = np.full(n, -1, np.int32), np.zeros(n, np.bool_), np.zeros(n, np.uint8)
    queue, other, near = np.empty(n + 1, np.int32), np.empty(n + 1, np.int32), np.empty(PATCH, np.int32)
    plane, round_, total, sums = np.zeros(WIDTH), np.zeros(WIDTH), np.zeros(10), np.zeros(10)
    cosine = math.cos(math.radians(TURN))
    stamp, faces = 0, 0
    for s in range(order.shape[0]):
        seed = order[s]
        if owner[seed] != -1 or tried[seed]:
            continue
        plane[:] = 0.0
        for k in range(3):
            plane[k], plane[3 + k] = centroid[seed, k], normals[seed, k]
        count = 0
        deviation = 0.0
        before = 0
        for turn in range(MAX_REGROWTHS):
            stamp += 1
            count = _spread_over(
                seed, plane, cosine, 1.0, noise, 0.0, turn == 0, moments, centroid, normals, towards, starts,
                neighbours, owner, mark, stamp, queue, total,
            )  # fmt: skip
            deviation = fit_plane(total, plane)
            if turn > 0 and count < 1.02 * before:
                break
            before = count
        points = total[0]
        stamp += 1
        kind = 0
        patch = 0
        if vain[seed] < VAIN:
            patch = _turning(seed, moments, centroid, normals, starts, neighbours, owner, mark, stamp, near, round_)
        if patch > 0:
            held, rest = 0, np.inf
            for turn in range(3):
                stamp += 1
                loose = 2.0 if turn == 0 else 1.0
                # Voxels as wide as the radius is have no normal to speak of.
                limit = cosine if round_[6] > 4.0 * edge else math.cos(math.radians(40.0))
                sag = edge * edge / (8.0 * round_[6])
                held = _spread_over(
                    seed, round_, limit, loose, noise, sag, False, moments, centroid, normals, towards, starts,
                    neighbours, owner, mark, stamp, other, sums,
                )  # fmt: skip
                if held < MIN_VOXELS:
                    break
                rest = fit_cylinder(moments, centroid, other, held, noise, round_, 8)
                if not round_[6] < MAX_RADIUS:
                    held = 0
                    break
            if (
                held >= MIN_VOXELS
                and sums[0] > 1.15 * points
                and rest < 1.5 * noise + 0.0005
                and round_[6] > MIN_RADIUS_SIGMAS * noise
                and seen_angle(round_, centroid, other, held) >= math.radians(MIN_ANGLE)
            ):
                kind, count, points, deviation = 1, held, sums[0], rest
            else:
                for m in range(patch):
                    vain[near[m]] = min(vain[near[m]] + 1, VAIN)
        if (kind == 0 and (count < MIN_VOXELS or points < MIN_POINTS)) or points < MIN_POINTS:
            tried[seed] = True
            continue
        for m in range(count):
            owner[queue[m] if kind == 0 else other[m]] = faces
        models[faces] = plane if kind == 0 else round_
        rms[faces] = deviation
        faces += 1
    return faces
