"""Candidate positions of spheres of a known radius: each point votes for the place one radius behind its surface.

The normal of a small neighbourhood, followed inwards by the radius, ends at the centre of its sphere. The votes of a sphere
coincide, those of walls, cables and people scatter (Hough, 1962; Ballard, 1981, Pattern Recognition 13(2), for shapes of known
size). This separates a sphere from the wall that it touches or the tripod under it, with which it forms one cluster.
"""

from __future__ import annotations

import math

import numpy as np

from tunneldb.arrays import Float, Int64
from tunneldb.compiled import kernel, lower_bound
from tunneldb.geometry.normals import eigenvalues, normal
from tunneldb.threads import in_blocks

# In radii of the spheres:
REACH = 0.6  # radius of the neighbourhood for a normal
VOTE = 1.0 / 6.0  # edge of the cells of votes
NEIGHBOURHOOD = 1.35  # radius around a centre of the points that decide about the sphere

VOTERS = 8  # voting points in each cell of REACH: as many as a sphere of 60 points needs; more are redundant
NEIGHBOURS = 128  # approximate number of points examined around one
MIN_NEIGHBOURS = 6
GRAZING_COSINE = 0.25  # cosine of incidence below which a neighbourhood is not used for the noise
MIN_VOTES = 12  # minimum votes of a candidate; a fifth of a sphere of 60 points has as many
_BLOCK = 1024  # cells at a time
MIN_VOTER_SHARE = 0.25  # minimum share of the voters near a candidate that voted for it; on a plane it is 0.14


class PointGrid:
    """Points in order of their cells, for finding those near a place quickly.

    Parameters
    ----------
    xyz : (n, 3) float64 array
        Points, m.
    edge : float
        Edge of a cell, m.

    Attributes
    ----------
    order : (n,) int array
        Index of each ordered point in the input.
    xyz : (n, 3) array
        Points in order, relative to `low`.
    key : (n,) int array
        Number of the cell of each, in the order of x, y, z; `span` cells fit along each axis, two of them at each end empty.
    start : (k,) int array
        First point of each filled cell.
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

    @property
    def bounds(self) -> Int64:
        """Return the first point of each filled cell, and the number of all points at the end."""
        return np.append(self.start, len(self.key))

    def around(self, places: Float, reach: float) -> tuple[Int64, Int64]:
        """Find points within a distance of places (k, 3).

        Returns
        -------
        points, place : (m,) int arrays
            Numbers of points in order, and of their places; place by place, increasing.
        """
        places = places - self.low
        low = np.maximum(np.floor((places - reach) / self.edge).astype(np.int64), -2)
        high = np.minimum(np.floor((places + reach) / self.edge).astype(np.int64), self.span - 3)
        steps = (high - low).max(axis=0, initial=-1) + 1
        ix, iy = (np.arange(n) for n in steps[:2].clip(min=0))
        # Columns of cells around each place: (k, steps along x, steps along y).
        x, y = low[:, 0, None, None] + ix[:, None], low[:, 1, None, None] + iy
        column = ((x + 2) * self.span[1] + y + 2) * self.span[2] + 2
        begin = np.searchsorted(self.key, column + low[:, 2, None, None])
        end = np.searchsorted(self.key, column + high[:, 2, None, None], side="right")
        end[(x > high[:, 0, None, None]) | (y > high[:, 1, None, None])] = 0
        points, run = ranges(begin.ravel(), end.ravel())
        place = run // max(len(ix) * len(iy), 1)
        away = self.xyz[points] - places[place]
        near = away[:, 0] * away[:, 0] + away[:, 1] * away[:, 1] + away[:, 2] * away[:, 2] <= reach * reach
        return points[near], place[near]


def ranges(begin: Int64, end: Int64) -> tuple[Int64, Int64]:
    """Return whole numbers of ranges (n,), one range after the other, and the number of the range of each."""
    length = np.maximum(end - begin, 0)
    owner = np.repeat(np.arange(len(begin)), length)
    return np.arange(len(owner)) + np.repeat(begin - np.cumsum(length) + length, length), owner


def hough_candidates(points: PointGrid, observers: Float, radius: float) -> tuple[Float, float]:
    """Find possible centres of spheres.

    Parameters
    ----------
    points : PointGrid
        Points of one scan, in cells of `REACH` radii.
    observers : (n, 3) float64 array
        Scanner position for each point, in input order, m; NaN if not known.
    radius : float
        Radius of the spheres, m.

    Returns
    -------
    centres : (k, 3) float64 array
        By decreasing number of votes, m.
    noise : float
        Standard deviation of a range on smooth surfaces, m: the lower quartile of the neighbourhoods, from their distances from
        their planes and the incidence. Infinite if not known.
    """
    if len(points.key) == 0:
        return np.zeros((0, 3)), math.inf
    votes, voters, scatter = _votes(points, observers, radius)
    scatter = scatter[np.isfinite(scatter)]
    noise = float(np.quantile(scatter, 0.25)) if len(scatter) else math.inf
    votes, places = votes[np.isfinite(votes[:, 0])], points.xyz[voters]
    if len(votes) < MIN_VOTES:
        return np.zeros((0, 3)), math.inf
    centres, counts = _peaks(PointGrid(votes, VOTE * radius))
    _, near = PointGrid(places, radius).around(centres, (1.0 + 2.0 * VOTE) * radius)
    good = counts >= MIN_VOTER_SHARE * np.bincount(near, minlength=len(centres))
    centres, counts = centres[good], counts[good]
    order = np.lexsort((*centres.T, -counts))
    return centres[order] + points.low, noise


def _votes(points: PointGrid, observers: Float, radius: float) -> tuple[Float, Int64, Float]:
    """Return votes (2m, 3), NaN if there is none, their voters (m,), and the range noise there (m,), NaN if unknown."""
    bounds = points.bounds
    first = np.append(0, np.cumsum(np.minimum(np.diff(bounds), VOTERS)))
    votes = np.full((2 * first[-1], 3), np.nan)
    voters, scatter = np.empty(first[-1], np.int64), np.full(first[-1], np.nan)
    seen_from = np.ascontiguousarray(observers[points.order] - points.low)
    row, layer = int(points.span[2]), int(points.span[1] * points.span[2])

    def work(begin: int, end: int) -> None:
        columns = np.empty((9, 2), np.int64)
        _vote(
            points.xyz, seen_from, points.key, bounds, first, row, layer, REACH * radius, float(radius), columns,
            votes, voters, scatter, begin, end,
        )  # fmt: skip

    in_blocks(work, len(points.start), _BLOCK)
    return votes, voters, scatter


def _peaks(votes: PointGrid) -> tuple[Float, Int64]:
    """Return the mean of the votes in the 27 cells around each local maximum, and their number."""
    bounds = votes.bounds
    keys = votes.key[votes.start]
    columns = [(x * votes.span[1] + y) * votes.span[2] for x in (-1, 0, 1) for y in (-1, 0, 1)]
    begin = np.stack([np.searchsorted(keys, keys + column - 1) for column in columns], axis=1)
    end = np.stack([np.searchsorted(keys, keys + column + 1, side="right") for column in columns], axis=1)
    total = (bounds[end] - bounds[begin]).sum(axis=1)
    chosen = np.flatnonzero(total >= MIN_VOTES)
    neighbours, run = ranges(begin[chosen].ravel(), end[chosen].ravel())
    own = chosen[run // len(columns)]
    # The first of equal ones.
    beaten = (total[neighbours] > total[own]) | ((total[neighbours] == total[own]) & (neighbours < own))
    chosen = np.setdiff1d(chosen, own[beaten])
    cast, run = ranges(bounds[begin[chosen]].ravel(), bounds[end[chosen]].ravel())
    near = run // len(columns)
    sums = [np.bincount(near, votes.xyz[cast, axis], minlength=len(chosen)) for axis in range(3)]
    return np.column_stack(sums) / total[chosen, None] + votes.low, total[chosen]


@kernel
def _vote(
    xyz: Float, observers: Float, key: Int64, bounds: Int64, first: Int64, row: int, layer: int, reach: float, radius: float,
    columns: Int64, votes: Float, voters: Int64, scatter: Float, begin: int, end: int,
) -> None:  # fmt: skip  # pragma: no cover - compiled
    """Let points of the cells from begin to end vote; columns is working memory for the columns of cells around one."""
    for c in range(begin, end):
        at, there = np.int64(0), 0
        for column in range(9):
            middle = key[bounds[c]] + (column // 3 - 1) * layer + (column % 3 - 1) * row
            at = lower_bound(key, middle - 1, at, key.shape[0])
            columns[column, 0] = at
            at = lower_bound(key, middle + 2, at, key.shape[0])
            columns[column, 1] = at
            there += at - columns[column, 0]
        stride = max(1, there // NEIGHBOURS)
        selected, asked = bounds[c + 1] - bounds[c], first[c + 1] - first[c]
        for v in range(asked):
            i = bounds[c] + v * selected // asked
            voters[first[c] + v] = i
            x, y, z = xyz[i, 0], xyz[i, 1], xyz[i, 2]
            n = 0
            sx, sy, sz, xx, yy, zz, xy, xz, yz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for column in range(9):
                for j in range(columns[column, 0], columns[column, 1], stride):
                    dx, dy, dz = xyz[j, 0] - x, xyz[j, 1] - y, xyz[j, 2] - z
                    if dx * dx + dy * dy + dz * dz > reach * reach:
                        continue
                    n += 1
                    sx, sy, sz = sx + dx, sy + dy, sz + dz
                    xx, yy, zz = xx + dx * dx, yy + dy * dy, zz + dz * dz
                    xy, xz, yz = xy + dx * dy, xz + dx * dz, yz + dy * dz
            if n < MIN_NEIGHBOURS:
                continue
            sx, sy, sz = sx / n, sy / n, sz / n
            xx, yy, zz = xx / n - sx * sx, yy / n - sy * sy, zz / n - sz * sz
            xy, xz, yz = xy / n - sx * sy, xz / n - sx * sz, yz / n - sy * sz
            least, middle, greatest = eigenvalues(xx, yy, zz, xy, xz, yz)
            # A line of points has no normal, nor has a cluster.
            if middle < 0.05 * greatest or least > 0.25 * middle:
                continue
            nx, ny, nz = normal(xx, yy, zz, xy, xz, yz, least)
            # The middle of a cap is below its top, by half of the squared distance of its points from the axis over the radius.
            deep = radius - (middle + greatest) / (2.0 * radius)
            ox, oy, oz = observers[i, 0] - x, observers[i, 1] - y, observers[i, 2] - z
            side = nx * ox + ny * oy + nz * oz
            cosine = 1.0 if math.isnan(side) else abs(side) / math.sqrt(ox * ox + oy * oy + oz * oz)
            if n > 3 and cosine > GRAZING_COSINE:
                scatter[first[c] + v] = math.sqrt(max(least, 0.0) * n / (n - 3)) / cosine
            at = 2 * (first[c] + v)
            if not side > 0.0:
                votes[at, 0], votes[at, 1], votes[at, 2] = x + sx + deep * nx, y + sy + deep * ny, z + sz + deep * nz
            if not side <= 0.0:
                votes[at + 1, 0], votes[at + 1, 1], votes[at + 1, 2] = (
                    x + sx - deep * nx,
                    y + sy - deep * ny,
                    z + sz - deep * nz,
                )
