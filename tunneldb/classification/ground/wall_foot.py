"""Feet of the walls on the ground, and the walls' lean just above them."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from tunneldb.arrays import Float, Int64
from tunneldb.classification.ground.model import COLUMN
from tunneldb.classification.ground.ransac import best_plane

_MAX_HEIGHT = 0.6  # maximum height of points of the wall, m
_INWARD, _OUTWARD = 0.35, 0.9  # and their distance from the ground's edge, m
_ALONG = 2  # and their distance before and behind a row, m
_PLANE_TOLERANCE = 0.02  # of the wall's plane, m
_TRIALS = 60
_MIN_POINTS = 15
_MAX_SLOPE_ALONG, _MAX_SLOPE_UP = 0.15, 3.0  # maximum slope of a wall, to the right for each metre along and up
_FITS = 5  # with Tukey's weights
_NEIGHBOURS = 9  # rows whose median a foot must be near
_FOOT_TOLERANCE = 0.05  # m


def fit_walls(
    along: Float, across: Float, z: Float, cells: Int64, start: int, height: Float, low: Float, seed: int
) -> tuple[Float, Float]:
    """Fit foot and lean of the left and the right wall at each row, (rows, 2) each; NaN where no wall is seen.

    The wall is the plane that has, by RANSAC, most of the points just above the outermost ground; a surface curved in height is
    then fitted to these by least squares.

    Parameters
    ----------
    along, across, z : (n,) float arrays
        Points in rows and columns, m.
    cells : (metres * columns + 1,) int array
        First point of each cell.
    height : (rows, columns) float array
        Ground, m.
    low : (rows,) float array
        Height above the ground from which a point certainly belongs to the wall, m.
    seed : int
        Seed of the random numbers.
    """
    rows, columns = height.shape
    metres = (len(cells) - 1) // columns
    walls, planes, points = [], [], []
    inward, outward = int(_INWARD / COLUMN + 0.5), int(_OUTWARD / COLUMN + 0.5)
    known = np.isfinite(height)
    ends = np.column_stack([known.argmax(axis=1), columns - 1 - known[:, ::-1].argmax(axis=1)])
    for i in np.flatnonzero(known.any(axis=1)).tolist():
        near = np.arange(max(i - _ALONG, 0), min(i + _ALONG, metres))
        for side in range(2):
            edge = int(ends[i, side])
            left, right = (edge - outward, edge + inward) if side == 0 else (edge - inward, edge + outward)
            begin, end = cells[near * columns + max(left, 0)], cells[near * columns + min(right + 1, columns)]
            count = end - begin
            if count.sum() < _MIN_POINTS:
                continue
            at = np.repeat(begin - (np.cumsum(count) - count), count) + np.arange(count.sum())
            metre = np.repeat(near, count)
            share = along[at] - start - metre
            up = z[at] - (height[metre, edge] * (1.0 - share) + height[metre + 1, edge] * share)
            kept = (up > low[i]) & (up < _MAX_HEIGHT)
            if np.count_nonzero(kept) < _MIN_POINTS:
                continue
            near_wall = np.column_stack([along[at] - start - i, up, across[at]])[kept]
            draw = seed + 2 * (i + start + 1_000_000) + side
            plane, number = best_plane(near_wall, draw, _reach, _TRIALS, min_inliers=_MIN_POINTS)
            if number:
                walls.append(2 * i + side)
                planes.append(plane)
                points.append(near_wall)
    foot, lean = np.full(2 * rows, np.nan), np.full(2 * rows, np.nan)
    if walls:
        surface = _fitted(points, np.array(planes))
        foot[walls], lean[walls] = surface[:, 0], surface[:, 2]
    return foot.reshape(rows, 2), lean.reshape(rows, 2)


def _fitted(points: list[Float], planes: Float) -> Float:
    """Fit surfaces across = c0 + c1 along + c2 up + c3 up², (w, 4), to the points of some walls with Tukey's weights.

    Parameters
    ----------
    points : list of (n, 3) float arrays
        Points of each wall: along, up, across.
    planes : (w, 3) float array
        Initial planes.
    """
    count = len(points)
    wall = np.repeat(np.arange(count), [len(p) for p in points])
    along, up, across = np.concatenate(points).T
    terms = [np.ones(len(up)), along, up, up**2, across]
    surface = np.column_stack([planes, np.zeros(count)])
    reach = (1.5 * _PLANE_TOLERANCE * np.sqrt(1.0 + planes[:, 2] ** 2))[wall]
    selected = np.diag([1e-9, 1e-9, 1e-9, 0.01 + 1e-9])  # no curvature unless the points show one
    for _ in range(_FITS):
        e = across - sum(c[wall] * term for c, term in zip(surface.T, terms[:4], strict=True))
        weight = np.maximum(1.0 - (e / reach) ** 2, 0.0) ** 2
        normal = np.empty((count, 4, 5))
        for i in range(4):
            for j in range(i, 5):
                normal[:, i, j] = np.bincount(wall, weight * terms[i] * terms[j], count)
                if j < 4:
                    normal[:, j, i] = normal[:, i, j]
        surface = np.linalg.solve(normal[:, :, :4] + selected, normal[:, :, 4:])[:, :, 0]
    return np.asarray(surface, dtype=np.float64)


def _reach(planes: Float) -> Float:
    """Return the maximum distance across of an inlier from each wall (t, 3), m; 0 for a wall too oblique or leaning."""
    possible = (np.abs(planes[:, 1]) <= _MAX_SLOPE_ALONG) & (np.abs(planes[:, 2]) <= _MAX_SLOPE_UP)
    return np.where(possible, _PLANE_TOLERANCE * np.sqrt(1.0 + planes[:, 2] ** 2), 0.0)


def replace_outliers(foot: Float, lean: Float) -> tuple[Float, Float]:
    """Remove feet and leans of the walls, (rows, 2) each, at niches, doors and objects by the wall.

    A foot far from the running median of the rows is replaced by it; leans are the running median of the remaining ones.
    """
    foot, lean = foot.copy(), lean.copy()
    for side in range(2):
        median = _running_median(foot[:, side])
        with np.errstate(invalid="ignore"):
            outlier = ~(np.abs(foot[:, side] - median) < _FOOT_TOLERANCE)
        leaning = _running_median(np.where(outlier, np.nan, lean[:, side]))
        foot[outlier, side] = median[outlier]
        lean[:, side] = leaning
    return foot, lean


def _running_median(values: Float) -> Float:
    """Return the running median of known values; NaN if fewer than three are known."""

    def middle(window: Float) -> float:
        known = window[np.isfinite(window)]
        return float(np.median(known)) if len(known) >= 3 else float("nan")

    return np.asarray(ndimage.generic_filter(values, middle, size=_NEIGHBOURS, mode="constant", cval=np.nan))
