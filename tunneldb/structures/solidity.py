"""Solid faces, which return every beam; a grating, a fence or leaves let most of them through.

A scanner turns in equal steps, so that a solid face has the same number of points per angle, at any place and orientation.
For a scan without that property, because it was thinned out, there is no result.
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from tunneldb.arrays import Bool, Float
from tunneldb.structures.contrast import Observed
from tunneldb.structures.face_raster import Layout
from tunneldb.structures.models import to_space

MIN_RETURNED_SHARE = 0.7
"""Minimum share of the beams that a solid face returns."""

EVEN = 0.3
"""Maximum ratio of the densities between the quantiles `QUANTILES`; otherwise the scan was thinned out."""

QUANTILES = (0.25, 0.5, 0.95)
"""Quantiles for low, usual and high density: up to a quarter of what a scan sees may be gratings and fences."""

MIN_DENSITY_POINTS = 60
"""Minimum number of points of a face for a density."""


def closed(occupied: Bool, pixels: int) -> Bool:
    """Close holes of up to so many pixels in a mask (rows, columns)."""
    padded = np.pad(occupied, pixels)
    out = ndimage.binary_closing(padded, iterations=pixels)
    return np.asarray(out[pixels : out.shape[0] - pixels, pixels : out.shape[1] - pixels])


def ray_densities(layout: Layout, face: int, seen: list[Observed], stations: Float) -> Float:
    """Return density and points of a face per step of azimuth and zenith (radians) for each scan (k, 2); NaN if too few."""
    u, v = layout.centres(face)
    out = np.full((len(stations), 2), np.nan)
    for one in seen:
        points = float(one.points.sum())
        if points < MIN_DENSITY_POINTS:
            continue
        row, column = np.divmod(one.pixel, one.columns)
        towards = stations[one.scan] - to_space(layout.models[face], u[column], v[row])
        # The steps of azimuth lie the closer to each other the farther up or down a beam goes.
        level = np.hypot(towards[:, 0], towards[:, 1]) / one.range_m
        occupied = np.zeros((len(v), len(u)), np.bool_)
        occupied[row, column] = True
        pixels = np.count_nonzero(closed(occupied, 2))
        angle = pixels * layout.pixel[face] ** 2 * np.mean(np.cos(one.angle) / (one.range_m**2 * np.maximum(level, 1e-3)))
        out[one.scan] = points / max(float(angle), 1e-12), points
    return out


def solid_faces(densities: Float) -> Bool:
    """Return True for solid faces (n,).

    Parameters
    ----------
    densities : (n, k, 2) float array
        Densities of all faces and scans, see `ray_densities`.
    """
    total, came_back = np.zeros(len(densities)), np.zeros(len(densities))
    for scan in range(densities.shape[1]):
        held = np.flatnonzero(np.isfinite(densities[:, scan, 0]))
        if not len(held):
            continue
        density, points = densities[held, scan].T
        order = np.argsort(density)
        share = np.cumsum(points[order]) / points.sum()
        low, usual, high = density[order[np.searchsorted(share, QUANTILES).clip(max=len(order) - 1)]]
        if low < usual * (1.0 - EVEN) or high > usual * (1.0 + EVEN):
            continue
        total[held] += points
        came_back[held] += points * np.minimum(density / usual, 1.0)
    return came_back >= MIN_RETURNED_SHARE * total
