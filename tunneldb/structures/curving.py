"""Cylinders of any radius from strips of planes.

Noise hides the curvature of a wide vessel over a few voxels. Growing therefore divides it into plane strips, as wide as the sag
stays within the noise. Two adjacent strips show the curvature: a cylinder through both fits better than the two planes do. A
crease between flat plates has the opposite effect.
"""

from __future__ import annotations

import math

import numpy as np

from tunneldb.arrays import Float, Int32, Int64
from tunneldb.structures.growing import MIN_VOXELS, Grown
from tunneldb.structures.merging import Faces, MembersOf, distances, refit, sums_of, touching
from tunneldb.structures.models import AXIS, POINT, RADIUS, SIDE, WIDTH
from tunneldb.structures.voxel_grid import VoxelGrid

MIN_TURN, MAX_TURN = 1.0, 30.0
"""Limits of the angle between the normals of adjacent strips, degrees: registration errors are smaller."""

MIN_EXCESS = 1.3
"""Minimum ratio of the scatter of centroids about a strip's plane to that about the cylinder."""

MAX_EXCESS = 1.1
"""Maximum ratio of the scatter of a further face about the cylinder to that about its own plane."""


def curve(grid: VoxelGrid, starts: Int64, neighbours: Int32, faces: Faces, noise: float) -> Grown | None:
    """Replace strips of planes by cylinders; None if there are none.

    Parameters
    ----------
    grid, starts, neighbours
        Voxels, and which touch.
    faces : Faces
    noise : float
        Standard deviation of ranges, m.
    """
    strips = _Strips(grid, faces, noise)
    pairs = touching(faces.owner, starts, neighbours)
    beside: dict[int, set[int]] = {}
    for one, other in pairs.tolist():
        beside.setdefault(one, set()).add(other)
        beside.setdefault(other, set()).add(one)
    into, models = np.arange(len(faces.models)), faces.models.copy()
    for one, other in strips.turning(pairs):
        if into[one] != one or into[other] != other or models[one, RADIUS] or models[other, RADIUS]:
            continue
        model = strips.cylinder([one, other])
        if model is None:
            continue
        held, model = strips.extended([one, other], model, beside, into)
        into[held] = one
        models[one] = model
    if (into == np.arange(len(into))).all():
        return None
    owner = np.append(into, -1)[faces.owner].astype(np.int32)
    return Grown(owner, models, faces.rms)


class _Strips:
    """Voxels of faces, and the scatter of their centroids about planes and cylinders."""

    def __init__(self, grid: VoxelGrid, faces: Faces, noise: float) -> None:
        self.grid, self.models, self.noise = grid, faces.models, noise
        self.centroid, self.points = grid.centroids, grid.moments[:, 0]
        self.sums, self.held = sums_of(grid, faces.owner, len(faces.models)), MembersOf(faces.owner, len(faces.models))
        self.own = np.array([self.scatter(model, self.held(k)) for k, model in enumerate(faces.models)])

    def scatter(self, model: Float, voxels: Int64) -> float:
        """Return the rms distance of centroids from a model, m; that of a curved patch lies inside."""
        if not len(voxels):
            return 0.0
        off = distances(model, self.centroid[voxels])
        if model[RADIUS] > 0.0:
            off = off + model[SIDE] * self.grid.edge**2 / (24.0 * model[RADIUS])
        return float(np.sqrt(np.average(off**2, weights=self.points[voxels])))

    def turning(self, pairs: Int64) -> list[tuple[int, int]]:
        """Return the pairs of planes whose normals turn, the largest first."""
        flat = (self.models[pairs, RADIUS] == 0.0).all(axis=1)
        cosine = np.einsum("ni,ni->n", self.models[pairs[:, 0], AXIS], self.models[pairs[:, 1], AXIS])
        least, most = math.cos(math.radians(MAX_TURN)), math.cos(math.radians(MIN_TURN))
        pairs = pairs[flat & (cosine > least) & (cosine < most)]
        size = np.minimum(self.sums[pairs[:, 0], 0], self.sums[pairs[:, 1], 0])
        return [(int(one), int(other)) for one, other in pairs[np.argsort(-size, kind="stable")]]

    def cylinder(self, pair: list[int]) -> Float | None:
        """Fit a cylinder to two planes; None if these fit better."""
        model = _first(*(self.models[k] for k in pair), *(self.sums[k, 1:4] / self.sums[k, 0] for k in pair))
        if model is None or min(len(self.held(k)) for k in pair) < MIN_VOXELS:
            return None
        self._fit(pair, model)
        fits = all(self.own[k] > MIN_EXCESS * self.scatter(model, self.held(k)) for k in pair)
        return model if fits and np.isfinite(model).all() else None

    def extended(self, held: list[int], model: Float, beside: dict[int, set[int]], into: Int64) -> tuple[list[int], Float]:
        """Add faces that touch and fit a cylinder; return all its faces, and the cylinder fitted to them."""
        while True:
            near = set().union(*(beside.get(k, set()) for k in held)) - set(held)
            fit = [k for k in sorted(near) if into[k] == k and self._fits(model, k)]
            if not fit:
                return held, model
            held = held + fit
            self._fit(held, model)

    def _fits(self, model: Float, face: int) -> bool:
        """Return True if a face is of a cylinder: it fits as well as the face's own model, whose normals agree."""
        other = self.models[face]
        voxels = self.held(face)
        if other[RADIUS] > 0.0 and (abs(other[AXIS] @ model[AXIS]) < 0.98 or other[SIDE] != model[SIDE]):
            return False
        if other[RADIUS] == 0.0:
            middle = (self.sums[face, 1:4] / self.sums[face, 0]) - model[POINT]
            out = middle - (middle @ model[AXIS]) * model[AXIS]
            if model[SIDE] * float(out @ other[AXIS]) < math.cos(math.radians(MAX_TURN)) * np.linalg.norm(out):
                return False
        return self.scatter(model, voxels) < max(MAX_EXCESS * self.own[face], 0.5 * self.noise)

    def _fit(self, held: list[int], model: Float) -> None:
        refit(self.grid, self.centroid, self.sums[held[0]], np.concatenate([self.held(k) for k in held]), self.noise, model)


def _first(one: Float, other: Float, here: Float, there: Float) -> Float | None:
    """Return the cylinder that touches two planes at their middles."""
    axis = np.cross(one[AXIS], other[AXIS])
    axis /= np.linalg.norm(axis)
    across = there - here
    across -= (across @ axis) * axis
    turn = other[AXIS] - one[AXIS]
    radius = float(across @ turn) / float(turn @ turn)
    if radius == 0.0:
        return None
    model = np.zeros(WIDTH)
    model[POINT] = 0.5 * (here - radius * one[AXIS] + there - radius * other[AXIS])
    model[AXIS], model[RADIUS], model[SIDE] = axis, abs(radius), math.copysign(1.0, radius)
    return model
