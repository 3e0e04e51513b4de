"""Points that are neither ground nor lining: rails, niches, and clusters on the ground or in front of the lining."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from tunneldb.arrays import Bool, Float, Int64
from tunneldb.classification.classes import PointClass
from tunneldb.classification.ground.model import Ground
from tunneldb.classification.objects.clusters import Cluster, pieces
from tunneldb.classification.objects.dbscan import dbscan
from tunneldb.classification.objects.spacing import Spacing

RAIL_TOP = 0.35
"""Maximum height of bars along the ground, m: a rail of 0.17 m on a sleeper, with tolerance for a guard rail."""

RAIL_WIDTH = 0.35
"""Maximum width of bars, m, in columns of 0.1 m."""

RAIL_LENGTH = 5.0
"""Minimum length of bars, m."""

MAX_FIXTURE_DEPTH = 0.35
"""Maximum distance of fixtures from the wall, m; clusters that reach farther and stand on the ground are objects."""

MIN_RECESS_SIZE = 0.3
"""Minimum size of a recess behind the lining in two directions, m: less is the lining's own roughness."""

_COLUMN = 0.1
_MIN_FILLED_SHARE = 0.7  # minimum share of the metres of a bar that have points of it


@dataclass(frozen=True)
class ClusterSettings:
    """Parameters of the cluster search.

    Attributes
    ----------
    radius : float
        R of eq. 2, in point spacings.
    min_points : int
        P_min of eq. 2.
    region : float
        t of eq. 1: upper limit of the region of interest, as a share of the tunnel's height.
    """

    radius: float = 3.0
    min_points: int = 4
    region: float = 0.4

    @classmethod
    def of(cls, values: Mapping[str, float]) -> ClusterSettings:
        """Make settings from the parameters ``cluster.*``."""
        return cls(values["cluster.radius"], int(values["cluster.min_points"]), values["cluster.region"])


@dataclass(frozen=True)
class ResidualPoints:
    """Points that are neither ground nor lining.

    Attributes
    ----------
    xyz : (n, 3) float array
        m.
    along, across : (n,) float arrays
        In the frame of the line, m.
    height : (n,) float array
        Height above the ground, m; above the lowest point of the tunnel if there is no ground.
    depth : (n,) float array
        Distance from the lining's plane, m, positive into the tunnel; NaN without lining.
    top : (n,) float array
        Height of the region of interest there (H of eq. 1), m.
    """

    xyz: Float
    along: Float
    across: Float
    height: Float
    depth: Float
    top: Float

    def __len__(self) -> int:
        return len(self.xyz)

    def __getitem__(self, chosen: Bool | Int64) -> ResidualPoints:
        parts = (self.xyz, self.along, self.across, self.height, self.depth, self.top)
        return ResidualPoints(*(part[chosen] for part in parts))

    def clusters(self, klass: int, known: bool) -> list[Cluster]:
        """Make one cluster, or its pieces, of all points; ``known``: True if heights refer to a ground."""
        return pieces(klass, self.xyz, self.along, self.height if known else np.full(len(self), np.nan))


def find_clusters(
    residual: ResidualPoints, spacing: Spacing, settings: ClusterSettings, ground: Ground | None
) -> list[Cluster]:
    """Find clusters of points that are neither ground nor lining, with their classes; noise is left out.

    Behind the lining's plane, a cluster wide enough is a niche. In front of it, bars along the ground are removed first, so
    that objects on rails are not classified as rails. DBSCAN (eq. 2–4) finds the rest. A cluster that does not touch the ground
    and touches the wall, or is above the region of interest (eq. 1), is a fixture. A cluster that stands on the ground, or is
    free in the region, is an object. A cluster that touches both ground and wall is a fixture if it is flat; else it is split
    into the part on the wall and the part off it.
    """
    with np.errstate(invalid="ignore"):
        behind = residual.depth < 0.0
    found = [
        cluster
        for recess in _groups(residual[behind], spacing, settings)
        if _is_wide(recess)
        for cluster in recess.clusters(PointClass.NICHE, ground is not None)
    ]
    return found + sort_clusters(residual[~behind], spacing, settings, ground)


def sort_clusters(
    residual: ResidualPoints, spacing: Spacing, settings: ClusterSettings, ground: Ground | None
) -> list[Cluster]:
    """Classify clusters of points that are neither ground nor behind the lining: rails, objects and fixtures."""
    known = ground is not None
    found: list[Cluster] = []
    rails = bars(residual.along, residual.across, residual.height) if known else np.zeros(len(residual), np.bool_)
    if rails.any():
        found += residual[rails].clusters(PointClass.RAIL, known)
    radius = settings.radius * spacing.across
    for group in _groups(residual[~rails], spacing, settings):
        found += _sorted(group, radius, spacing, settings, known)
    return found


def bars(along: Float, across: Float, height: Float) -> Bool:
    """Return True for points of rails and other long, thin, low bars along the ground.

    Columns of 0.1 m are examined metre by metre: a bar fills a column, or its neighbours, for most of 5 m, and it is thin.

    Parameters
    ----------
    along, across : (n,) float arrays
        In the frame of the line, m.
    height : (n,) float array
        Above the ground, m.
    """
    with np.errstate(invalid="ignore"):
        low = (height > 0.0) & (height <= RAIL_TOP)
    out = np.zeros(len(along), np.bool_)
    if not low.any():
        return out
    i, j = np.floor(along).astype(np.int64), np.floor(across / _COLUMN).astype(np.int64)
    row, column = int(i[low].min()), int(j[low].min())
    shape = int(i[low].max()) - row + 1, int(j[low].max()) - column + 1
    if shape[0] < RAIL_LENGTH:
        return out
    filled = np.zeros(shape, np.bool_)
    filled[i[low] - row, j[low] - column] = True
    metres = round(RAIL_LENGTH)
    wide = ndimage.maximum_filter1d(filled, 3, axis=1)
    share = ndimage.uniform_filter1d(wide.astype(np.float64), metres, axis=0, mode="constant")
    reach = ndimage.uniform_filter1d(np.ones(shape), metres, axis=0, mode="constant")
    # A bar shows in its column and in those beside it; the run of such columns is at most three wider than the bar.
    steady = share / reach >= _MIN_FILLED_SHARE
    runs = ndimage.label(steady, structure=[[0, 0, 0], [1, 1, 1], [0, 0, 0]])[0]
    widths = np.bincount(runs.ravel())
    widths[0] = 0
    thin = (runs > 0) & (widths[runs] <= round(RAIL_WIDTH / _COLUMN) + 2)
    bar = _long(thin, metres)[i[low] - row, j[low] - column]
    # Objects on a bar or beside it are higher than the bar is elsewhere.
    top = ndimage.labeled_comprehension(height[low], bar, np.arange(bar.max() + 1), _highest, np.float64, 0.0)
    top[0] = 0.0
    out[low] = height[low] <= top[bar]
    return out


def _highest(height: Float) -> float:
    """Return the height of most points of a bar, plus a margin."""
    return float(np.quantile(height, 0.9)) + 0.02


def _long(thin: Bool, metres: int) -> Int64:
    """Assign numbers to bars that are long enough, 0 for none; a bar may shift by a column from one metre to the next."""
    labels, count = ndimage.label(thin, structure=np.ones((3, 3)))
    lengths = np.array([0, *(rows.stop - rows.start for rows, _ in ndimage.find_objects(labels, count))])
    return np.where(lengths[labels] >= metres, labels, 0).astype(np.int64)


def _groups(residual: ResidualPoints, spacing: Spacing, settings: ClusterSettings) -> list[ResidualPoints]:
    """Cluster by DBSCAN, with distances along shrunk to the spacing across."""
    if len(residual) == 0:
        return []
    places = np.column_stack([residual.along * spacing.shrink, residual.across, residual.xyz[:, 2]])
    labels = dbscan(places, settings.radius * spacing.across, settings.min_points)
    order = np.argsort(labels, kind="stable")
    bounds = np.searchsorted(labels[order], np.arange(labels.max() + 2))
    return [residual[order[first:last]] for first, last in itertools.pairwise(bounds)]


def _is_wide(group: ResidualPoints) -> bool:
    """Return True if a cluster is larger than ``MIN_RECESS_SIZE`` in two directions."""
    extent = np.ptp(np.column_stack([group.along, group.across, group.xyz[:, 2]]), axis=0)
    return int((extent >= MIN_RECESS_SIZE).sum()) >= 2


def _sorted(group: ResidualPoints, radius: float, spacing: Spacing, settings: ClusterSettings, known: bool) -> list[Cluster]:
    """Classify the clusters of one group of points in front of the lining."""
    depth = np.where(np.isnan(group.depth), np.inf, group.depth)
    on_wall = float(depth.min()) <= radius
    if not _stands(group, radius):
        free = not on_wall and bool((group.height < group.top).any())
        return group.clusters(PointClass.OBJECT if free else PointClass.APPENDAGE, known)
    if not on_wall:
        return group.clusters(PointClass.OBJECT, known)
    if (depth <= MAX_FIXTURE_DEPTH).mean() >= 0.95:
        return group.clusters(PointClass.APPENDAGE, known)
    off = depth > radius
    parted = group[off]
    found: list[Cluster] = []
    residual = np.ones(len(parted), np.bool_)
    places = np.column_stack([parted.along * spacing.shrink, parted.across, parted.xyz[:, 2]])
    labels = dbscan(places, radius, settings.min_points)
    for label in range(int(labels.max(initial=-1)) + 1):
        part = parted[labels == label]
        residual[labels == label] = False
        found += part.clusters(PointClass.OBJECT if _stands(part, radius) else PointClass.APPENDAGE, known)
    hanging = np.concatenate([np.flatnonzero(~off), np.flatnonzero(off)[residual]])
    return found + group[hanging].clusters(PointClass.APPENDAGE, known)


def _stands(group: ResidualPoints, radius: float) -> bool:
    """Return True if a cluster reaches down to the ground."""
    with np.errstate(invalid="ignore"):
        return bool((group.height <= radius).any())
