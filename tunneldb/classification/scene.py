"""Class of every point of a scene, from the models of ground, lining, clusters and target spheres."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from tunneldb.arrays import Float, Int64, Single, UInt8
from tunneldb.classification.classes import PointClass
from tunneldb.classification.ground.model import Ground
from tunneldb.classification.lining_relief import Relief, level_at
from tunneldb.classification.objects.clusters import Cluster, Lookup, look_up
from tunneldb.compiled import kernel
from tunneldb.geometry.plan_line import PlanLine
from tunneldb.geometry.surface import Surface
from tunneldb.threads import in_blocks

SPHERE_SKIN = 0.01
"""Thickness outside a target sphere within which points belong to it, m: three times a scanner's noise."""

RECESSED_CLASSES = (PointClass.NICHE, PointClass.LINING)
"""Classes of clusters behind the lining's plane."""

_BLOCK = 1 << 16  # points
_BOX = 4096  # points whose box is compared with the spheres
_UNASSIGNED, _GROUND, _LINING = int(PointClass.UNASSIGNED), int(PointClass.GROUND), int(PointClass.LINING)
_SPHERE, _NOISE = int(PointClass.SPHERE), int(PointClass.NOISE)


@dataclass(frozen=True)
class Scene:
    """Models found in a stretch of tunnel, which give the class of any of its points.

    Attributes
    ----------
    line : PlanLine
        Line along the tunnel, in whose frame the ground is.
    ground : Ground or None
        The ground, if there is one.
    clusters : sequence of Cluster
        Objects in the tunnel and fixtures; pieces of lining too.
    surface : Surface or None
        Surface of the sections, if there is one.
    relief : Relief or None
        Relief of the lining relative to that surface, if there is one.
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
        """Return the class (:class:`tunneldb.classification.classes.PointClass`) of each point (n, 3) in the tunnel's SRID.

        The first that applies: within a target sphere, sphere; in the ground model, ground; near enough to the lining's plane,
        lining; in the cells of a cluster, that cluster's class; otherwise noise. Points off the ground that the surface does
        not reach are unassigned.
        """
        xyz = np.ascontiguousarray(xyz, dtype=np.float64)
        if self.ground is None:
            out = self._off_ground(xyz)
        else:
            along, across = self.line.place(xyz)
            ground = self.ground.is_ground(along, across, xyz[:, 2])
            out = np.full(len(xyz), _GROUND, np.uint8)
            out[~ground] = self._off_ground(xyz[~ground])
        spheres = np.ascontiguousarray(self.spheres, dtype=np.float64)
        if len(spheres):
            in_blocks(lambda begin, end: _mark_spheres(xyz, spheres, begin, end, out), len(xyz), _BLOCK)
        return out

    def _off_ground(self, xyz: Float) -> UInt8:
        """Return the class of points that are not ground; only these need to be unrolled."""
        if self.surface is None or self.relief is None:
            unrolled, relief = np.zeros((3, len(xyz))), Relief.none()
        else:
            places, relief = self.surface.unroll(xyz), self.relief
            unrolled = np.stack([places.chainage, places.arc, places.offset])
        inner, outer = self._lookups
        out = np.empty(len(xyz), np.uint8)

        def work(begin: int, end: int) -> None:
            _classes(
                xyz, unrolled, relief.cell, relief.column, relief.row, relief.offset, relief.spread,
                inner.first, inner.last, inner.keys, inner.klass,
                outer.first, outer.last, outer.keys, outer.klass,
                begin, end, out,
            )  # fmt: skip

        in_blocks(work, len(xyz), _BLOCK)
        return out

    @cached_property
    def _lookups(self) -> tuple[Lookup, Lookup]:
        """Return the cells of the clusters in front of the lining and of those behind it."""
        if self.relief is None:
            return Lookup.of(list(self.clusters)), Lookup.of([])
        behind = [cluster for cluster in self.clusters if cluster.klass in RECESSED_CLASSES]
        return Lookup.of([cluster for cluster in self.clusters if cluster.klass != PointClass.NICHE]), Lookup.of(behind)


@kernel
def _classes(
    xyz: Float, unrolled: Float, cell: float, column: int, row: int,
    relief: Single, spread: Single,
    inner_first: Int64, inner_last: Int64, inner_keys: Int64, inner_klass: UInt8,
    outer_first: Int64, outer_last: Int64, outer_keys: Int64, outer_klass: UInt8,
    begin: int, end: int, out: UInt8,
) -> None:  # fmt: skip  # pragma: no cover - compiled
    for i in range(begin, end):
        if np.isnan(unrolled[0, i]):
            out[i] = _UNASSIGNED
            continue
        plane, tolerance = level_at(unrolled[0, i], unrolled[1, i], cell, column, row, relief, spread)
        off = (unrolled[2, i] - plane) / tolerance
        if abs(off) <= 1.0:
            out[i] = _LINING
            continue
        x, y, z = xyz[i, 0], xyz[i, 1], xyz[i, 2]
        if off < 0.0:
            klass = look_up(x, y, z, outer_first, outer_last, outer_keys, outer_klass)
        else:
            klass = look_up(x, y, z, inner_first, inner_last, inner_keys, inner_klass)
        if klass == 0:  # no cluster: the lining's rough edge, or in the air
            klass = _LINING if abs(off) <= 2.0 else _NOISE
        out[i] = klass


@kernel
def _mark_spheres(xyz: Float, spheres: Float, begin: int, end: int, out: UInt8) -> None:  # pragma: no cover - compiled
    """Classify the points within a target sphere; only spheres that reach into the box of some points are tested."""
    for first in range(begin, end, _BOX):
        last = min(first + _BOX, end)
        x0, y0, z0 = xyz[first, 0], xyz[first, 1], xyz[first, 2]
        x1, y1, z1 = x0, y0, z0
        for i in range(first + 1, last):
            x0, y0, z0 = min(x0, xyz[i, 0]), min(y0, xyz[i, 1]), min(z0, xyz[i, 2])
            x1, y1, z1 = max(x1, xyz[i, 0]), max(y1, xyz[i, 1]), max(z1, xyz[i, 2])
        for k in range(spheres.shape[0]):
            x, y, z, reach = spheres[k, 0], spheres[k, 1], spheres[k, 2], spheres[k, 3] + SPHERE_SKIN
            outside = x + reach < x0 or x - reach > x1 or y + reach < y0 or y - reach > y1 or z + reach < z0 or z - reach > z1
            if outside:
                continue
            for i in range(first, last):
                dx, dy, dz = xyz[i, 0] - x, xyz[i, 1] - y, xyz[i, 2] - z
                if dx * dx + dy * dy + dz * dz <= reach * reach:
                    out[i] = _SPHERE
