"""Where spheres of a known radius may be: each point votes for the place one radius behind the surface that it lies on.

The normal of a small neighbourhood, followed inwards by the radius, ends at the centre of the sphere that the neighbourhood
lies on; the votes of a sphere meet, those of walls, cables and people scatter (Hough, 1962; Ballard, 1981, Pattern
Recognition 13(2), for shapes of known size). Thereby a sphere is told from the wall that it touches or the tripod under
it, with which it makes one cluster.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange

from tunneldb.arrays import Float, Int64
from tunneldb.geometry.normals import eigenvalues, normal

# In radii of the spheres:
REACH = 0.6  # of the neighbourhood that gives a normal
VOTE = 1.0 / 6.0  # edge of the cells of votes
NEAR = 1.35  # around a centre, what can lie on the sphere or tell that it is none

VOTERS = 8  # points that vote, of each cell of REACH: as many as a sphere of 60 points needs; more say the same again
NEIGHBOURS = 128  # points looked at around one, about
LEAST_NEIGHBOURS = 6
GRAZING = 0.25  # cosine of incidence below which a neighbourhood says nothing of the noise
VOTES = 12  # that make a candidate; a fifth of a sphere of 60 points has as many
SHARE = 0.25  # of the voters near a candidate that have voted for it; of a plane 0.14 do


class Scattered:
    """Points in order of the cells that they lie in, so that those near a place are found at once.

    Parameters
    ----------
    xyz : (n, 3) float64 array
        Points, m.
    edge : float
        Edge of a cell, m.

    Attributes
    ----------
    order : (n,) int array
        Where each of the points in order comes from.
    xyz : (n, 3) array
        The points in order, from `low`.
    """

    def __init__(self, xyz: Float, edge: float) -> None:
        self.edge = edge
        self.low: Float = np.floor(xyz.min(axis=0) / edge) * edge if len(xyz) else np.zeros(3)
        shifted = xyz - self.low
        place = np.floor(shifted / edge).astype(np.int64)
        self.span: Int64 = place.max(axis=0, initial=0) + 5
        key = ((place[:, 0] + 2) * self.span[1] + place[:, 1] + 2) * self.span[2] + place[:, 2] + 2
        self.order: Int64 = np.argsort(key, kind="stable")
        self.key: Int64 = key[self.order]
        self.xyz: Float = np.ascontiguousarray(shifted[self.order])
        self.start: Int64 = np.flatnonzero(np.concatenate([[True], np.diff(self.key) > 0])) if len(xyz) else np.zeros(0, int)

    def around(self, place: Float, reach: float) -> Int64:
        """Numbers (k,) of the points, as they were given, within a distance of a place (3,)."""
        return self.order[around(self.xyz, self.key, self.span, self.edge, place - self.low, reach)]


def hough_candidates(points: Scattered, eyes: Float, radius: float) -> tuple[Float, float]:
    """Places where the centre of a sphere may be.

    Parameters
    ----------
    points : Scattered
        One scan's points, in cells of `REACH` radii.
    eyes : (n, 3) float64 array
        Where the scanner stood for each point, as they were given, m; NaN where it is not known.
    radius : float
        Of the spheres, m.

    Returns
    -------
    centres : (k, 3) float64 array
        By falling number of votes, m.
    noise : float
        Standard deviation of a range, m, where surfaces are smooth: that which a quarter of the neighbourhoods stay below,
        by their distances from their planes and the incidence. Infinite where nothing tells.
    """
    if len(points.key) == 0:
        return np.zeros((0, 3)), math.inf
    stop = np.append(points.start[1:], len(points.key))
    votes, voters, scatter = _vote(
        points.xyz, np.ascontiguousarray(eyes[points.order] - points.low), points.key, points.start, stop, points.span,
        REACH * radius, radius,
    )  # fmt: skip
    scatter = scatter[np.isfinite(scatter)]
    noise = float(np.quantile(scatter, 0.25)) if len(scatter) else math.inf
    votes, voters = votes[np.isfinite(votes[:, 0])], points.xyz[voters]
    if len(votes) < VOTES:
        return np.zeros((0, 3)), math.inf
    cast = Scattered(votes, VOTE * radius)
    centres, counts = _peaks(cast.xyz, cast.key, cast.start, np.append(cast.start[1:], len(votes)), cast.span)
    centres += cast.low
    seen = Scattered(voters, radius)
    near = _count(seen.xyz, seen.key, seen.span, seen.edge, centres - seen.low, (1.0 + 2.0 * VOTE) * radius)
    good = counts >= SHARE * near
    centres, counts = centres[good], counts[good]
    order = np.lexsort((*centres.T, -counts))
    return centres[order] + points.low, noise


@njit(cache=True, nogil=True, inline="always")
def _run(key: Int64, first: int, last: int) -> tuple[int, int]:  # pragma: no cover - compiled
    return int(np.searchsorted(key, first)), int(np.searchsorted(key, last + 1))


@njit(cache=True, nogil=True)
def around(xyz: Float, key: Int64, span: Int64, edge: float, place: Float, reach: float) -> Int64:  # pragma: no cover
    """Numbers of the points in order within a distance of a place, both from their low corner."""
    found = np.empty(64, np.int64)
    count = 0
    low = np.floor((place - reach) / edge).astype(np.int64)
    high = np.floor((place + reach) / edge).astype(np.int64)
    for ix in range(max(low[0], -2), min(high[0], span[0] - 3) + 1):
        for iy in range(max(low[1], -2), min(high[1], span[1] - 3) + 1):
            column = ((ix + 2) * span[1] + iy + 2) * span[2] + 2
            begin, end = _run(key, column + max(low[2], -2), column + min(high[2], span[2] - 3))
            for i in range(begin, end):
                dx, dy, dz = xyz[i, 0] - place[0], xyz[i, 1] - place[1], xyz[i, 2] - place[2]
                if dx * dx + dy * dy + dz * dz > reach * reach:
                    continue
                if count == len(found):
                    more = np.empty(2 * count, np.int64)
                    more[:count] = found
                    found = more
                found[count] = i
                count += 1
    return found[:count]


@njit(cache=True, nogil=True, parallel=True)
def _count(xyz: Float, key: Int64, span: Int64, edge: float, places: Float, reach: float) -> Int64:  # pragma: no cover
    counts = np.empty(len(places), np.int64)
    for k in prange(len(places)):
        counts[k] = len(around(xyz, key, span, edge, places[k], reach))
    return counts


@njit(cache=True, nogil=True, parallel=True)
def _vote(
    xyz: Float, eyes: Float, key: Int64, start: Int64, stop: Int64, span: Int64, reach: float, radius: float
) -> tuple[Float, Int64, Float]:  # pragma: no cover - compiled
    """Votes (2m, 3), NaN where there is none, who cast them (m,), and the noise of the ranges there (m,), NaN for unknown."""
    cells = len(start)
    first = np.zeros(cells + 1, np.int64)
    for c in range(cells):
        first[c + 1] = first[c] + min(stop[c] - start[c], VOTERS)
    votes = np.full((2 * first[cells], 3), np.nan)
    voters = np.empty(first[cells], np.int64)
    scatter = np.full(first[cells], np.nan)
    for c in prange(cells):
        begins, ends = np.empty(9, np.int64), np.empty(9, np.int64)
        there = 0
        for column in range(9):
            middle = key[start[c]] + ((column // 3 - 1) * span[1] + column % 3 - 1) * span[2]
            begins[column], ends[column] = _run(key, middle - 1, middle + 1)
            there += ends[column] - begins[column]
        stride = max(1, there // NEIGHBOURS)
        held, asked = stop[c] - start[c], first[c + 1] - first[c]
        for v in range(asked):
            i = start[c] + v * held // asked
            voters[first[c] + v] = i
            x, y, z = xyz[i, 0], xyz[i, 1], xyz[i, 2]
            n = 0
            sx, sy, sz, xx, yy, zz, xy, xz, yz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for column in range(9):
                for j in range(begins[column], ends[column], stride):
                    dx, dy, dz = xyz[j, 0] - x, xyz[j, 1] - y, xyz[j, 2] - z
                    if dx * dx + dy * dy + dz * dz > reach * reach:
                        continue
                    n += 1
                    sx, sy, sz = sx + dx, sy + dy, sz + dz
                    xx, yy, zz = xx + dx * dx, yy + dy * dy, zz + dz * dz
                    xy, xz, yz = xy + dx * dy, xz + dx * dz, yz + dy * dz
            if n < LEAST_NEIGHBOURS:
                continue
            sx, sy, sz = sx / n, sy / n, sz / n
            xx, yy, zz = xx / n - sx * sx, yy / n - sy * sy, zz / n - sz * sz
            xy, xz, yz = xy / n - sx * sy, xz / n - sx * sz, yz / n - sy * sz
            least, middle, greatest = eigenvalues(xx, yy, zz, xy, xz, yz)
            # A thread of points has no normal, a heap of them neither.
            if middle < 0.05 * greatest or least > 0.25 * middle:
                continue
            nx, ny, nz = normal(xx, yy, zz, xy, xz, yz, least)
            # The middle of a cap lies below its top, by half of what its points lie from the axis, squared, over the radius.
            deep = radius - (middle + greatest) / (2.0 * radius)
            side = nx * (eyes[i, 0] - x) + ny * (eyes[i, 1] - y) + nz * (eyes[i, 2] - z)
            sight = math.sqrt((eyes[i, 0] - x) ** 2 + (eyes[i, 1] - y) ** 2 + (eyes[i, 2] - z) ** 2)
            cosine = 1.0 if math.isnan(side) else abs(side) / sight
            if n > 3 and cosine > GRAZING:
                scatter[first[c] + v] = math.sqrt(max(least, 0.0) * n / (n - 3)) / cosine
            at = 2 * (first[c] + v)
            if side <= 0.0 or math.isnan(side):
                votes[at, 0], votes[at, 1], votes[at, 2] = x + sx + deep * nx, y + sy + deep * ny, z + sz + deep * nz
            if side > 0.0 or math.isnan(side):
                at += 1
                votes[at, 0], votes[at, 1], votes[at, 2] = x + sx - deep * nx, y + sy - deep * ny, z + sz - deep * nz
    return votes, voters, scatter


@njit(cache=True, nogil=True, parallel=True)
def _peaks(
    xyz: Float, key: Int64, start: Int64, stop: Int64, span: Int64
) -> tuple[Float, Int64]:  # pragma: no cover - compiled
    """Mean of the votes in the 27 cells around each cell with more votes there than its neighbours have, and their number."""
    cells = len(start)
    keys = key[start]
    total = np.zeros(cells, np.int64)
    for c in prange(cells):
        for column in range(9):
            middle = keys[c] + ((column // 3 - 1) * span[1] + column % 3 - 1) * span[2]
            begin, end = _run(keys, middle - 1, middle + 1)
            for j in range(begin, end):
                total[c] += stop[j] - start[j]
    best = total >= VOTES
    for c in prange(cells):
        if total[c] >= VOTES:
            for column in range(9):
                middle = keys[c] + ((column // 3 - 1) * span[1] + column % 3 - 1) * span[2]
                begin, end = _run(keys, middle - 1, middle + 1)
                for j in range(begin, end):
                    if total[j] > total[c] or (total[j] == total[c] and j < c):
                        best[c] = False
    chosen = np.flatnonzero(best)
    centres = np.zeros((len(chosen), 3))
    for k in prange(len(chosen)):
        c = chosen[k]
        for column in range(9):
            middle = keys[c] + ((column // 3 - 1) * span[1] + column % 3 - 1) * span[2]
            begin, end = _run(keys, middle - 1, middle + 1)
            for j in range(begin, end):
                for i in range(start[j], stop[j]):
                    for a in range(3):
                        centres[k, a] += xyz[i, a]
        for a in range(3):
            centres[k, a] /= total[c]
    return centres, total[chosen]
