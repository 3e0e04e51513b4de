"""Plane of a ring, fitted robustly against single wrong points, and the ring's directions in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from tunneldb.arrays import Float
from tunneldb.robust import MAD_TO_SIGMA
from tunneldb.shape.limits import LEVEL_OWN_SIGMA, MAX_OUTLIER_SHARE, MAX_TESTED_SINGLY
from tunneldb.shape.tukey import CUT, weights

OFF_PLANE_LIMIT = 0.05
"""Distance from the plane of the other prisms, along the tunnel, beyond which a prism does not belong to it, m."""

_TRIPLES = 200
_STEPS = 20
_MIN_SPREAD = 1e-4  # m; points of a drawing are exactly in their plane


@dataclass(frozen=True)
class RingPlane:
    """Plane of a ring, with the directions from which clock positions are counted.

    Attributes
    ----------
    origin : (3,) float array
        A point of the plane, m.
    normal, right, up : (3,) float arrays
        Unit vectors: up-chainage, level to the right, and upwards in the plane.
    spread : float
        Standard deviation of the points from it, m; 0 if the plane was given.
    """

    origin: Float
    normal: Float
    right: Float
    up: Float
    spread: float

    @classmethod
    def across(cls, origin: Float, normal: Float, spread: float = 0.0) -> RingPlane:
        """Make a plane through a point, across a direction that is not vertical."""
        normal = normal / np.linalg.norm(normal)
        right = np.array([normal[1], -normal[0], 0.0])
        right /= np.linalg.norm(right)
        return cls(origin, normal, right, np.cross(right, normal), spread)

    def project(self, xyz: Float) -> Float:
        """Return coordinates (n, 2) in the plane, right and up of the origin, of points (n, 3), m."""
        return (xyz - self.origin) @ np.column_stack([self.right, self.up])

    def along(self, xyz: Float) -> Float:
        """Return the distance (n,) of points (n, 3) from the plane, up-chainage positive, m."""
        return (xyz - self.origin) @ self.normal

    def to_space(self, plane: Float) -> Float:
        """Return points (n, 3) for coordinates (n, 2) in the plane, m."""
        return self.origin + plane @ np.vstack([self.right, self.up])


def fit_plane(xyz: Float, ahead: Float) -> RingPlane | None:
    """Fit a plane orthogonally.

    Parameters
    ----------
    xyz : (n, 3) float array
        Points of a ring, m, n ≥ 4.
    ahead : (3,) float array
        Direction up-chainage; the normal points that way.

    Returns
    -------
    RingPlane or None
        None if the points lie on a line, or in a horizontal plane.

    Notes
    -----
    Few points: least squares without points far from the plane of all others. Prisms are set up by hand, and within
    `OFF_PLANE_LIMIT` each says equally well where the ring is. Many points: Tukey's weights, starting from
    the triple with the least median of distances (Rousseeuw, 1984).
    """
    origin = np.median(xyz, axis=0)
    found = _few(xyz - origin) if len(xyz) <= MAX_TESTED_SINGLY else _many(xyz - origin)
    if found is None:
        return None
    middle, normal, spread = found
    if np.hypot(normal[0], normal[1]) < 1e-6:
        return None
    return RingPlane.across(origin + middle, normal if normal @ ahead > 0.0 else -normal, spread)


def _few(near: Float) -> tuple[Float, Float, float] | None:
    """Return point, normal and spread of the plane of few points, tested one by one."""
    used = np.ones(len(near), bool)
    for left in range(int(np.ceil(len(near) * MAX_OUTLIER_SHARE)), -1, -1):
        found = _principal(near[used], np.ones(int(used.sum())))
        if found is None:
            return None
        middle, normal = found
        off = (near[used] - middle) @ normal
        freedom = len(off) - 3
        spread = float(np.sqrt(off @ off / max(freedom, 1)))
        wrong = _aside(near[used] - middle, normal, off) if left and freedom > 2 else None
        if wrong is None:
            break
        used[np.flatnonzero(used)[wrong]] = False
    return middle, normal, spread


def _aside(centred: Float, normal: Float, off: Float) -> int | None:
    """Return a point more than `OFF_PLANE_LIMIT` off the plane of the others, if they agree too well for chance; else None."""
    design = np.column_stack([np.ones(len(off)), centred - np.outer(off, normal)])
    share = 1.0 - np.einsum("ij,ji->i", design, np.linalg.pinv(design))
    share = np.maximum(share, 1e-6)
    lifted = off**2 / share
    worst = int(np.argmax(lifted))
    freedom = len(off) - 4
    left = max(float(off @ off - lifted[worst]), 0.0) / freedom
    chance = student.isf(LEVEL_OWN_SIGMA / (2 * len(off)), freedom)
    return worst if abs(off[worst]) / share[worst] > OFF_PLANE_LIMIT and lifted[worst] > left * chance**2 else None


def _many(near: Float) -> tuple[Float, Float, float] | None:
    """Return point, normal and spread of the plane of many points."""
    begun = _best_triple(near)
    if begun is None:
        return None
    middle, normal = begun
    for _ in range(_STEPS):
        off = (near - middle) @ normal
        scale = max(MAD_TO_SIGMA * float(np.median(np.abs(off))), _MIN_SPREAD)
        weight = weights(off / (CUT * scale))
        found = _principal(near, weight)
        if found is None:
            return None
        still = abs(found[1] @ normal) > 1.0 - 1e-14
        middle, normal = found
        if still:
            break
    off = (near - middle) @ normal
    return middle, normal, float(np.sqrt(weight @ off**2 / weight.sum()))


def _principal(near: Float, weight: Float) -> tuple[Float, Float] | None:
    """Return the centroid of weighted points, and their axis of least spread; None if they lie on a line."""
    middle = weight @ near / weight.sum()
    centred = near - middle
    values, axes = np.linalg.eigh((centred * weight[:, None]).T @ centred)
    return None if values[1] < 1e-6 * values[2] else (middle, axes[:, 0])


def _best_triple(near: Float) -> tuple[Float, Float] | None:
    """Return point and normal of the plane through three of the points that is nearest to half of all."""
    random = np.random.default_rng(len(near))
    triples = random.integers(0, len(near), (_TRIPLES, 3))
    first = near[triples[:, 0]]
    normals = np.cross(near[triples[:, 1]] - first, near[triples[:, 2]] - first)
    area = np.linalg.norm(normals, axis=1)
    wide = area > 0.1 * area.max()  # long thin triangles give poor planes
    if not area.max() > 0.0:
        return None
    first, normals = first[wide], normals[wide] / area[wide, None]
    some = near[:: max(len(near) // 500, 1)]
    off = np.abs(some @ normals.T - np.einsum("ij,ij->i", first, normals))
    best = int(np.argmin(np.median(off, axis=0)))
    return first[best], normals[best]
