"""Find the scene: lining and clusters, with or without the sections of a survey."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import ndimage

from tunneldb.arrays import Float
from tunneldb.classification.ground.model import COLUMN, Ground
from tunneldb.classification.lining_relief import Relief, Wall
from tunneldb.classification.objects.clusters import Cluster
from tunneldb.classification.objects.objects import ClusterSettings, ResidualPoints, find_clusters, sort_clusters
from tunneldb.classification.objects.spacing import Spacing
from tunneldb.classification.scene import Scene
from tunneldb.classification.sections import find_lining, surface_through
from tunneldb.geometry.plan_line import PlanLine
from tunneldb.geometry.section_outliers import SectionOutliers
from tunneldb.geometry.surface import Surface


def find_scene(
    points: Float, line: PlanLine, surface: Surface, ground: Ground | None, settings: ClusterSettings | None = None
) -> Scene:
    """Find lining and clusters in points of survey density around the surface of the sections.

    Parameters
    ----------
    points : (n, 3) float array
        In the tunnel's SRID, m.
    line : PlanLine
        Axis along which chainage is measured.
    surface : Surface
        Surface of the sections.
    ground : Ground or None
        The ground, if there is one.
    settings : ClusterSettings, optional
        Parameters ``cluster.*``.

    Returns
    -------
    Scene
        Without target spheres.
    """
    settings = settings or ClusterSettings()
    points = np.ascontiguousarray(points, dtype=np.float64)
    places = surface.unroll(points)
    along, across = line.place(points)
    off = np.isfinite(places.chainage)
    if ground is not None:
        off &= ~ground.is_ground(along, across, points[:, 2])
    chainage, arc, offset = places.chainage[off], places.arc[off], places.offset[off]
    along, across, points = along[off], across[off], points[off]
    relief = Relief.of(chainage, arc, offset, Wall.of(ground, line, surface), SectionOutliers.of(surface))
    plane, tolerance = relief.level(chainage, arc)
    depth = offset - plane
    with np.errstate(invalid="ignore"):
        lining = np.abs(depth) <= tolerance
    unrolled = np.column_stack([chainage, arc])
    spacing = Spacing.of(unrolled[lining]) or Spacing.of(unrolled)
    clusters: list[Cluster] = []
    if spacing is not None:
        height = heights_above_ground(ground, along, across, points[:, 2])
        top = settings.region * tunnel_heights(along, height)
        residual = ~lining
        left = ResidualPoints(
            points[residual], along[residual], across[residual], height[residual], depth[residual], top[residual]
        )
        clusters = find_clusters(left, spacing, settings, ground)
    return Scene(line, ground, clusters, surface, relief)


def find_bare_scene(points: Float, line: PlanLine, ground: Ground | None, settings: ClusterSettings | None = None) -> Scene:
    """Find lining and clusters in a cloud without axis and sections.

    Clusters of the region of interest (Li et al. 2023, eq. 1–4) that are large and whose normals are coherent are lining;
    initially everything above the region is too. If they close around the middle of the tunnel, sections are fitted to them and
    to the ground. With these, lining, niches, fixtures and objects are classified as in a survey, which removes the fixtures
    above the region that the paper classifies as lining. If they do not close, there is no tunnel and no lining.

    Parameters
    ----------
    points : (n, 3) float array
        m; preferably thinned to voxels.
    line : PlanLine
        Line along the cloud.
    ground : Ground or None
        The ground, if there is one.
    settings : ClusterSettings, optional
        Parameters ``cluster.*``.

    Returns
    -------
    Scene
        Without surface and relief if there is no lining.
    """
    settings = settings or ClusterSettings()
    points = np.ascontiguousarray(points, dtype=np.float64)
    if len(points) == 0:
        return Scene(line, ground, [], None, None)
    along, across = line.place(points)
    z = points[:, 2]
    floor = np.zeros(len(points), np.bool_) if ground is None else ground.is_ground(along, across, z)
    height = heights_above_ground(ground, along, across, z)
    spacing = Spacing.of(np.column_stack([along, across, z])[~floor])
    if spacing is None:
        return Scene(line, ground, [], None, None)
    top = settings.region * tunnel_heights(along, height)
    off = np.flatnonzero(~floor)
    residual = ResidualPoints(points[off], along[off], across[off], height[off], np.full(len(off), np.nan), top[off])
    kept = floor.copy()
    kept[off] = find_lining(residual, spacing, settings)
    surface = surface_through(line, along[kept], across[kept], z[kept], kept[kept] & ~floor[kept])
    if surface is None:
        return Scene(line, ground, sort_clusters(residual, spacing, settings, ground), None, None)
    return find_scene(points, line, surface, ground, settings)


def heights_above_ground(ground: Ground | None, along: Float, across: Float, z: Float) -> Float:
    """Return the height of points (n,) above the ground, m, or above the lowest point of their metre without ground.

    In gaps and beyond the ends the ground continues level from its nearest place in the row.
    """
    if ground is None or not np.isfinite(ground.height).any():
        return z - _quantile_of_metre(along, z, 0.0)
    hidden = np.isnan(ground.height)
    nearest = ndimage.distance_transform_edt(hidden, sampling=(10.0, 1.0), return_distances=False, return_indices=True)
    whole = replace(ground, height=ground.height[tuple(nearest)])
    rows, columns = ground.height.shape
    inside = np.clip(along, ground.start, ground.start + rows - 1)
    clipped = np.clip(across, ground.first * COLUMN, (ground.first + columns - 1) * COLUMN - 1e-9)
    return z - whole.height_at(inside, np.maximum(clipped, ground.first * COLUMN))


def tunnel_heights(along: Float, height: Float) -> Float:
    """Return the height of the tunnel at each point (n,), m, without the highest thousandth of the points of its metre."""
    return _quantile_of_metre(along, height, 0.999)


def _quantile_of_metre(along: Float, value: Float, share: float) -> Float:
    """Return a quantile of the values of each point's metre along the tunnel."""
    if len(along) == 0:
        return np.empty(0)
    metre = np.floor(along).astype(np.int64)
    metre -= metre.min()
    # Few bits: NumPy sorts these in linear time.
    order = np.argsort(metre.astype(np.min_scalar_type(metre.max())), kind="stable")
    value, count = value[order], np.bincount(metre)
    ends = np.cumsum(count)
    quantile = np.full(len(count), np.nan)
    for m in np.flatnonzero(count).tolist():
        at = int(share * (count[m] - 1))
        quantile[m] = np.partition(value[ends[m] - count[m] : ends[m]], at)[at]
    return quantile[metre]
