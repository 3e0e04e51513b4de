"""Extract the ground of a tunnel from its points (Li et al. 2023, section 2.1, segment by segment)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from tunneldb.arrays import Float, Int64
from tunneldb.classification.ground.height_field import (
    blend_segments,
    extrapolate_edges,
    fill_gaps,
    in_lower_part,
    refine_heights,
)
from tunneldb.classification.ground.level_profile import is_round, level_ground, level_profiles
from tunneldb.classification.ground.model import COLUMN, Ground
from tunneldb.classification.ground.ransac import ransac_planes
from tunneldb.classification.ground.wall_foot import fit_walls, replace_outliers
from tunneldb.geometry.plan_line import PlanLine
from tunneldb.pointcloud.voxels import Voxels

MARGIN = 32
"""Maximum distance along the line on which a row depends, m: results of overlapping stretches agree."""

_STEP = 4  # of the segments along, m
_MIN_VOXELS = 12
_GAMMA_SPREADS = 3.5  # γ in standard deviations of the ground
_MIN_GAMMA = 0.01  # m
_PASSES = 3
_WALL_COLUMNS = 2  # columns at the walls


@dataclass(frozen=True)
class GroundSettings:
    """Parameters of the ground search.

    Attributes
    ----------
    voxel : float
        Edge of the voxels to which points are thinned, m.
    distance : float
        τ: maximum distance of a point on a plane, m.
    angle : float
        δ: maximum deviation of the ground's normals from the vertical, degrees.
    gamma : float
        Upper limit of γ, the thickness of the ground above its height, m.
    radius : float
        R: radius of the neighbourhood of a normal, m.
    """

    voxel: float = 0.1
    distance: float = 0.05
    angle: float = 15.0
    gamma: float = 0.1
    radius: float = 0.3

    @classmethod
    def of(cls, values: Mapping[str, float]) -> GroundSettings:
        """Make settings from the parameters ``ground.*``."""
        return cls(*(values[f"ground.{name}"] for name in ("voxel", "distance", "angle", "gamma", "radius")))


@dataclass(frozen=True)
class _Points:
    """Points of the tunnel's lower part, by rows of 1 m and columns of 0.1 m."""

    along: Float
    across: Float
    z: Float
    spread: Float
    cells: Int64
    start: int
    first: int
    rows: int
    columns: int


def find_ground(
    points: Float, line: PlanLine, settings: GroundSettings, seed: int = 0, spread: Float | None = None
) -> Ground | None:
    """Find the ground of a tunnel.

    Points are thinned to voxels (step 1). Every 4 m a plane is found in the lower 40 % of the tunnel by RANSAC with checked
    normals (steps 2, 3). Around it, column by column, the level seen along the segment is found: carriageways, walkways and
    camber, but not objects on them. Levels are blended from segment to segment and follow the points around them; γ (step 4) is
    3.5 times the standard deviation of the points. Walls are fitted just above.

    Parameters
    ----------
    points : (n, 3) float array
        m; points that are not finite are ignored.
    line : PlanLine
        Line along the tunnel.
    settings : GroundSettings
        Parameters.
    seed : int
        Seed of the random numbers; the result depends only on it, not on the order of the points.
    spread : (n,) float array, optional
        Standard deviation of the heights that each point represents, m, if it is the centroid of others.

    Returns
    -------
    Ground or None
        None without ground: too few points, or a tunnel without a floor.
    """
    lower = _lower_part(points, line, settings, spread)
    if lower is None:
        return None
    centres, coefficients = _segment_planes(lower, settings, seed)
    level = _segment_levels(lower, centres, coefficients, settings)
    rows = lower.start + np.arange(lower.rows + 1, dtype=np.float64)
    columns = (lower.first + np.arange(lower.columns, dtype=np.float64)) * COLUMN
    height = fill_gaps(blend_segments(rows, columns, centres, coefficients, level, _STEP))
    if not np.isfinite(height).any():
        return None
    height, gamma = _refine(lower, height, settings)
    low = np.maximum(gamma, settings.distance)
    foot, lean = fit_walls(lower.along, lower.across, lower.z, lower.cells, lower.start, height, low, seed)
    foot, lean = replace_outliers(foot, lean)
    height = _extended_to_walls(height, columns, foot, gamma)
    return Ground(lower.start, lower.first, height, gamma, foot, lean)


def _lower_part(points: Float, line: PlanLine, settings: GroundSettings, spread: Float | None) -> _Points | None:
    """Return the lower part of each segment's points, thinned and sorted into rows and columns."""
    points = np.asarray(points, dtype=np.float64)
    kept = in_lower_part(*line.place(points), points[:, 2], float(_STEP))
    points = points[kept]
    voxels = Voxels(settings.voxel)
    voxels.add(points)
    if len(voxels) < _MIN_VOXELS:
        return None
    xyz, within = voxels.centroids(), voxels.spread()
    if spread is not None:
        number = voxels.index(points)
        mean = np.bincount(number, np.asarray(spread)[kept] ** 2, minlength=len(voxels)) / voxels.counts()
        within = np.sqrt(within**2 + mean)
    along, across = line.place(xyz)
    start, stop = math.floor(along.min()), math.floor(along.max()) + 1
    first = math.floor(across.min() / COLUMN + 0.5) - 1
    columns = math.floor(across.max() / COLUMN + 0.5) + 2 - first
    cell = (np.floor(along).astype(np.int64) - start) * columns + np.floor(across / COLUMN + 0.5).astype(np.int64) - first
    # In an order of the points themselves: sums and random draws do not depend on the input order.
    order = np.lexsort((xyz[:, 2], along, cell))
    cells = np.zeros((stop - start) * columns + 1, np.int64)
    np.cumsum(np.bincount(cell, minlength=len(cells) - 1), out=cells[1:])
    return _Points(
        along[order], across[order], xyz[order, 2], within[order], cells, start, first, stop - start, columns
    )  # fmt: skip


def _segment_planes(lower: _Points, settings: GroundSettings, seed: int) -> tuple[Float, Float]:
    """Return the middle of each segment, at multiples of 4 m, and its plane."""
    number = np.arange(lower.start // _STEP, (lower.start + lower.rows - 1) // _STEP + 1)
    metre = np.clip(np.stack([number * _STEP, (number + 1) * _STEP], axis=1) - lower.start, 0, lower.rows)
    bounds = lower.cells[metre * lower.columns]
    centres = (number + 0.5) * _STEP
    middle = np.repeat(centres, np.diff(bounds, axis=1)[:, 0])
    local = np.column_stack([lower.along - middle, lower.across, lower.z])
    starts = (np.int64(seed) << 32) + number.astype(np.int64) + 1_000_000
    found = ransac_planes(local, bounds, settings.distance, settings.angle, settings.radius, starts)
    return np.asarray(centres, dtype=np.float64), found.coefficients


def _segment_levels(lower: _Points, centres: Float, coefficients: Float, settings: GroundSettings) -> Float:
    """Return the levels of the ground around each segment's plane, column by column."""
    found = level_profiles(
        lower.along, lower.across, lower.z, lower.cells, lower.start, lower.columns,
        centres, coefficients, float(_STEP), settings.distance,
    )  # fmt: skip
    slope = math.tan(math.radians(settings.angle))
    columns = (lower.first + np.arange(lower.columns)) * COLUMN
    # A floor missing for a few metres is still a floor: two of three segments decide.
    bare = np.array([is_round(plane[2] * columns + level, slope) for plane, level in zip(coefficients, found, strict=True)])
    bare = ndimage.median_filter(bare.astype(np.uint8), 3, mode="nearest") > 0
    for k, level in enumerate(found):
        found[k] = np.nan if bare[k] else level_ground(level, slope)
    return found


def _refine(lower: _Points, height: Float, settings: GroundSettings) -> tuple[Float, Float]:
    """Return heights that follow the points, and γ."""
    gamma = np.full(len(height), min(settings.gamma, settings.distance))
    for _ in range(_PASSES):
        # Objects on the ground have less and less influence.
        height, number, square = refine_heights(
            lower.along, lower.across, lower.z, lower.spread, lower.cells, lower.start, lower.first, height, gamma
        )
        height = extrapolate_edges(height, _WALL_COLUMNS)
        spread = np.sqrt(square / np.maximum(number, 1.0))
        gamma = np.where(number > 0, np.clip(_GAMMA_SPREADS * spread, _MIN_GAMMA, settings.gamma), settings.gamma)
    return height, gamma


def _extended_to_walls(height: Float, columns: Float, foot: Float, gamma: Float) -> Float:
    """Extend the heights to the walls, or end them there."""
    out = height.copy()
    for i, row in enumerate(out):
        known = np.flatnonzero(np.isfinite(row))
        if not len(known):
            continue
        low, high = known[0], known[-1]
        beyond = gamma[i] + COLUMN
        if np.isfinite(foot[i, 0]):
            row[:low] = np.where(columns[:low] > foot[i, 0] - beyond, row[low], np.nan)
            row[columns < foot[i, 0] - beyond] = np.nan
        if np.isfinite(foot[i, 1]):
            row[high + 1 :] = np.where(columns[high + 1 :] < foot[i, 1] + beyond, row[high], np.nan)
            row[columns > foot[i, 1] + beyond] = np.nan
    return out
