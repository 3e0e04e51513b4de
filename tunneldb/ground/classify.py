"""The class of every point of a scene: the models of ground, lining, clusters and target spheres put together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray
from scipy import ndimage

from tunneldb.geometry.surface import Surface
from tunneldb.ground.classes import Klass
from tunneldb.ground.cluster import Cluster, Lookup, look_up
from tunneldb.ground.line import Line
from tunneldb.ground.lining import Prior, Relief, Wall, level_at
from tunneldb.ground.model import COLUMN, Ground
from tunneldb.ground.spacing import Spacing
from tunneldb.ground.things import ClusterSettings, Rest, find_clusters

Float = NDArray[np.float64]
Int = NDArray[np.int64]
Bool = NDArray[np.bool_]
Bytes = NDArray[np.uint8]

SPHERE_SKIN = 0.01
"""Points up to this far outside a target sphere are its own, m: three times a scanner's noise."""

BEHIND = (Klass.NICHE, Klass.LINING)
"""Classes of clusters that lie behind the lining's plane."""

_BLOCK = 4096
_UNASSIGNED, _GROUND, _LINING = int(Klass.UNASSIGNED), int(Klass.GROUND), int(Klass.LINING)
_SPHERE, _NOISE = int(Klass.SPHERE), int(Klass.NOISE)


@dataclass(frozen=True)
class Scene:
    """What was found in a stretch of tunnel, from which any point of it gets its class.

    Attributes
    ----------
    line : Line
        Line along the tunnel, in whose frame the ground stands.
    ground : Ground or None
        The ground, if there is one.
    clusters : sequence of Cluster
        What stands in the tunnel or hangs on its lining; pieces of lining, too.
    surface : Surface or None
        Surface of the sections, if there is one.
    relief : Relief or None
        The lining about that surface, if there is one.
    spheres : (k, 4) float array
        Target spheres: x, y, z of the centre and radius, m.
    """

    line: Line
    ground: Ground | None
    clusters: Sequence[Cluster]
    surface: Surface | None
    relief: Relief | None
    spheres: Float = field(default_factory=lambda: np.empty((0, 4)))

    def classes(self, xyz: Float) -> Bytes:
        """Class (:class:`tunneldb.ground.classes.Klass`) of each point (n, 3) in the tunnel's SRID.

        What is within a target sphere is a sphere; else what the ground model holds is ground; what is near enough to the
        lining's plane is lining; the rest belongs to the cluster in whose cells it lies, or is noise. Points off the ground
        that the surface does not reach are unassigned.
        """
        xyz = np.ascontiguousarray(xyz, dtype=np.float64)
        spheres = np.ascontiguousarray(self.spheres, dtype=np.float64)
        if self.ground is None:
            return self._off_ground(xyz, spheres)
        along, across = self.line.place(xyz)
        ground = self.ground.is_ground(along, across, xyz[:, 2])
        out = np.full(len(xyz), _GROUND, np.uint8)
        out[~ground] = self._off_ground(xyz[~ground], spheres)
        if len(spheres):
            out[ground & _in_spheres(xyz, spheres)] = _SPHERE
        return out

    def _off_ground(self, xyz: Float, spheres: Float) -> Bytes:
        """Class of points that are not ground; these alone need to be unrolled."""
        if self.surface is None or self.relief is None:
            unrolled, relief = np.zeros((3, len(xyz))), Relief.none()
        else:
            places, relief = self.surface.unroll(xyz), self.relief
            unrolled = np.stack([places.chainage, places.arc, places.offset])
        inner, outer = self._lookups
        return np.asarray(
            _classes(
                xyz, unrolled, relief.cell, relief.column, relief.row, relief.offset, relief.spread,
                inner.first, inner.last, inner.keys, inner.klass, outer.first, outer.last, outer.keys, outer.klass, spheres,
            )
        )  # fmt: skip

    @cached_property
    def _lookups(self) -> tuple[Lookup, Lookup]:
        """Cells of the clusters before the lining and of those behind it."""
        if self.relief is None:
            return Lookup.of(list(self.clusters)), Lookup.of([])
        behind = [cluster for cluster in self.clusters if cluster.klass in BEHIND]
        return Lookup.of([cluster for cluster in self.clusters if cluster.klass != Klass.NICHE]), Lookup.of(behind)


@njit(cache=True, nogil=True, parallel=True)
def _classes(
    xyz: Float, unrolled: Float, cell: float, column: int, row: int,
    relief: NDArray[np.float32], spread: NDArray[np.float32],
    inner_first: Int, inner_last: Int, inner_keys: Int, inner_klass: Bytes,
    outer_first: Int, outer_last: Int, outer_keys: Int, outer_klass: Bytes, spheres: Float,
) -> Bytes:  # fmt: skip  # pragma: no cover - compiled
    count = xyz.shape[0]
    out = np.empty(count, np.uint8)
    for block in prange((count + _BLOCK - 1) // _BLOCK):
        first, last = block * _BLOCK, min(count, (block + 1) * _BLOCK)
        near = _spheres_near(xyz, first, last, spheres)
        for i in range(first, last):
            x, y, z = xyz[i, 0], xyz[i, 1], xyz[i, 2]
            if _in_sphere(x, y, z, spheres, near):
                out[i] = _SPHERE
                continue
            if np.isnan(unrolled[0, i]):
                out[i] = _UNASSIGNED
                continue
            plane, tolerance = level_at(unrolled[0, i], unrolled[1, i], cell, column, row, relief, spread)
            off = (unrolled[2, i] - plane) / tolerance
            if abs(off) <= 1.0:
                out[i] = _LINING
                continue
            if off < 0.0:
                klass = look_up(x, y, z, outer_first, outer_last, outer_keys, outer_klass)
            else:
                klass = look_up(x, y, z, inner_first, inner_last, inner_keys, inner_klass)
            if klass == 0:  # no cluster: of the lining's rough edge, or in the air
                klass = _LINING if abs(off) <= 2.0 else _NOISE
            out[i] = klass
    return out


@njit(cache=True, nogil=True, parallel=True)
def _in_spheres(xyz: Float, spheres: Float) -> Bool:  # pragma: no cover - compiled
    """Tell which points lie within a target sphere."""
    count = xyz.shape[0]
    out = np.zeros(count, np.bool_)
    for block in prange((count + _BLOCK - 1) // _BLOCK):
        first, last = block * _BLOCK, min(count, (block + 1) * _BLOCK)
        near = _spheres_near(xyz, first, last, spheres)
        if near.shape[0] > 0:
            for i in range(first, last):
                out[i] = _in_sphere(xyz[i, 0], xyz[i, 1], xyz[i, 2], spheres, near)
    return out


@njit(cache=True, nogil=True)
def _spheres_near(xyz: Float, first: int, last: int, spheres: Float) -> Int:  # pragma: no cover - compiled
    """Numbers of the spheres that reach into the box of a block of points."""
    near = np.empty(spheres.shape[0], np.int64)
    if spheres.shape[0] == 0:
        return near
    low, high = xyz[first].copy(), xyz[first].copy()
    for i in range(first + 1, last):
        for axis in range(3):
            low[axis] = min(low[axis], xyz[i, axis])
            high[axis] = max(high[axis], xyz[i, axis])
    count = 0
    for k in range(spheres.shape[0]):
        reach = spheres[k, 3] + SPHERE_SKIN
        apart = False
        for axis in range(3):
            apart |= spheres[k, axis] + reach < low[axis] or spheres[k, axis] - reach > high[axis]
        if not apart:
            near[count] = k
            count += 1
    return near[:count]


@njit(cache=True, nogil=True)
def _in_sphere(x: float, y: float, z: float, spheres: Float, near: Int) -> bool:  # pragma: no cover - compiled
    for k in near:
        dx, dy, dz = x - spheres[k, 0], y - spheres[k, 1], z - spheres[k, 2]
        reach = spheres[k, 3] + SPHERE_SKIN
        if dx * dx + dy * dy + dz * dz <= reach * reach:
            return True
    return False


def find_scene(
    points: Float, line: Line, surface: Surface, ground: Ground | None, settings: ClusterSettings | None = None
) -> Scene:
    """Find lining and clusters in points of survey density about the surface of the sections.

    Parameters
    ----------
    points : (n, 3) float array
        In the tunnel's SRID, m.
    line : Line
        The axis, along which is chainage.
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
    relief = Relief.of(chainage, arc, offset, Wall.of(ground, line, surface), Prior.of(surface))
    plane, tolerance = relief.level(chainage, arc)
    depth = offset - plane
    with np.errstate(invalid="ignore"):
        lining = np.abs(depth) <= tolerance
    spacing = Spacing.of(chainage[lining], arc[lining]) or Spacing.of(chainage, arc)
    clusters: list[Cluster] = []
    if spacing is not None:
        height = heights(ground, along, across, points[:, 2])
        top = settings.region * tops(along, height)
        rest = ~lining
        left = Rest(points[rest], along[rest], across[rest], height[rest], depth[rest], top[rest])
        clusters = find_clusters(left, spacing, settings, ground)
    return Scene(line, ground, clusters, surface, relief)


def heights(ground: Ground | None, along: Float, across: Float, z: Float) -> Float:
    """Height of points (n,) above the ground, m, or above the lowest point of their metre where there is no ground.

    Where the ground has a gap, or ends, it goes on level from its nearest place in the row.
    """
    if ground is None or not np.isfinite(ground.height).any():
        return z - _of_metre(along, z, 0.0)
    hidden = np.isnan(ground.height)
    nearest = ndimage.distance_transform_edt(hidden, sampling=(10.0, 1.0), return_distances=False, return_indices=True)
    whole = replace(ground, height=ground.height[tuple(nearest)])
    rows, columns = ground.height.shape
    inside = np.clip(along, ground.start, ground.start + rows - 1)
    beside = np.clip(across, ground.first * COLUMN, (ground.first + columns - 1) * COLUMN - 1e-9)
    return z - whole.height_at(inside, np.maximum(beside, ground.first * COLUMN))


def tops(along: Float, height: Float) -> Float:
    """Height of the tunnel at each point (n,), m: that of all but the highest thousandth of points of its metre."""
    return _of_metre(along, height, 0.999)


def _of_metre(along: Float, value: Float, share: float) -> Float:
    """Quantile of the values of each point's metre along the tunnel."""
    if len(along) == 0:
        return np.empty(0)
    metre = np.floor(along).astype(np.int64)
    order = np.lexsort((value, metre))
    first = np.searchsorted(metre[order], np.arange(metre.min(), metre.max() + 2))
    at = first[:-1] + np.floor(share * (np.diff(first) - 1)).astype(np.int64)
    found = value[order[np.clip(at, 0, len(value) - 1)]]  # metres without points are not asked for
    return np.asarray(found[metre - metre.min()], dtype=np.float64)
