"""The class of every point of a scene: the models of ground, lining, clusters and target spheres put together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numba import njit, prange

from tunneldb.arrays import Bool, Float, Int64, Single, UInt8
from tunneldb.classification.classes import PointClass
from tunneldb.classification.ground.model import Ground
from tunneldb.classification.lining_relief import Relief, level_at
from tunneldb.classification.objects.clusters import Cluster, Lookup, look_up
from tunneldb.geometry.plan_line import PlanLine
from tunneldb.geometry.surface import Surface

SPHERE_SKIN = 0.01
"""Points up to this far outside a target sphere are its own, m: three times a scanner's noise."""

BEHIND = (PointClass.NICHE, PointClass.LINING)
"""Classes of clusters that lie behind the lining's plane."""

_BLOCK = 4096
_UNASSIGNED, _GROUND, _LINING = int(PointClass.UNASSIGNED), int(PointClass.GROUND), int(PointClass.LINING)
_SPHERE, _NOISE = int(PointClass.SPHERE), int(PointClass.NOISE)


@dataclass(frozen=True)
class Scene:
    """What was found in a stretch of tunnel, from which any point of it gets its class.

    Attributes
    ----------
    line : PlanLine
        PlanLine along the tunnel, in whose frame the ground stands.
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

    line: PlanLine
    ground: Ground | None
    clusters: Sequence[Cluster]
    surface: Surface | None
    relief: Relief | None
    spheres: Float = field(default_factory=lambda: np.empty((0, 4)))

    def classes(self, xyz: Float) -> UInt8:
        """Class (:class:`tunneldb.classification.classes.PointClass`) of each point (n, 3) in the tunnel's SRID.

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

    def _off_ground(self, xyz: Float, spheres: Float) -> UInt8:
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
        return Lookup.of([cluster for cluster in self.clusters if cluster.klass != PointClass.NICHE]), Lookup.of(behind)


@njit(cache=True, nogil=True, parallel=True)
def _classes(
    xyz: Float, unrolled: Float, cell: float, column: int, row: int,
    relief: Single, spread: Single,
    inner_first: Int64, inner_last: Int64, inner_keys: Int64, inner_klass: UInt8,
    outer_first: Int64, outer_last: Int64, outer_keys: Int64, outer_klass: UInt8, spheres: Float,
) -> UInt8:  # fmt: skip  # pragma: no cover - compiled
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
def _spheres_near(xyz: Float, first: int, last: int, spheres: Float) -> Int64:  # pragma: no cover - compiled
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
def _in_sphere(x: float, y: float, z: float, spheres: Float, near: Int64) -> bool:  # pragma: no cover - compiled
    for k in near:
        dx, dy, dz = x - spheres[k, 0], y - spheres[k, 1], z - spheres[k, 2]
        reach = spheres[k, 3] + SPHERE_SKIN
        if dx * dx + dy * dy + dz * dz <= reach * reach:
            return True
    return False
