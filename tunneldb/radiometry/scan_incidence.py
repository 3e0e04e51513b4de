"""Range and incidence of a single scan without a tunnel: normals from neighbouring points."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from tunneldb.arrays import Float
from tunneldb.geometry.normals import principal_planes

NEIGHBOURS = 20
"""Number of points for a plane, the point itself included."""

MAX_SURFACE_VARIATION = 0.01
"""Maximum surface variation (Pauly et al., 2002: least eigenvalue divided by their sum) for a usable normal."""

BLOCK = 100_000
"""Number of points at a time."""


def incidence_cosine(xyz: Float, scanner: Float) -> Float:
    """Return the cosine of the incidence angle at points (n, 3), seen from positions (n, 3); NaN if not flat.

    The normal is that of the plane through the nearest neighbours, on the side of the scanner.
    """
    cosine = np.full(len(xyz), np.nan)
    if len(xyz) < NEIGHBOURS:
        return cosine
    tree = cKDTree(xyz)
    for first in range(0, len(xyz), BLOCK):
        part = slice(first, first + BLOCK)
        at = xyz[part]
        values, normals = principal_planes(xyz[tree.query(at, NEIGHBOURS, workers=-1)[1]])
        towards = scanner[part] - at
        towards = towards / np.linalg.norm(towards, axis=1, keepdims=True)
        seen = np.abs(np.einsum("ni,ni->n", normals, towards))
        # Collinear points, for example of a single profile, have no normal.
        flat = (values[:, 0] <= MAX_SURFACE_VARIATION * values.sum(axis=1)) & (values[:, 1] > 10.0 * values[:, 0])
        cosine[part] = np.where(flat, seen, np.nan)
    return cosine
