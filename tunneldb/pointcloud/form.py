"""Form of a tunnel's point cloud without any other information: size, density, profile spacing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from tunneldb.arrays import Float
from tunneldb.geometry.centreline import centreline_through
from tunneldb.geometry.plan_line import PlanLine

BALL = 1.0  # m; greater than the profile spacing, smaller than a tunnel
BALLS = 400
WINDOW = 5.0  # m along the tunnel in which profiles are searched
MAX_GAP_SPREAD = 0.3
"""Greatest relative spread of gaps between profiles. For points at random places, half of the length is in gaps that differ by
1.0 of their median; gaps between profiles differ by less than 0.3."""

_EVEN = 0.25  # m; voxel edge; one point of each voxel is used to find the line
_SLICE = 5.0  # m
_MIN_COUNT = 20  # least number of points in a slice, and of gaps for a spacing
_MAX_BINS = 500
_NEAREST = 2000


@dataclass(frozen=True)
class TunnelForm:
    """Size of a tunnel, in the file's unit, and its line.

    Attributes
    ----------
    line : PlanLine
    length : float
        Length along the line.
    width, height : float
        Medians over sections 5 m long, from the 1st to the 99th percentile.
    """

    line: PlanLine
    length: float
    width: float
    height: float


def tunnel_form(xyz: Float) -> TunnelForm | None:
    """Return the size of the tunnel that points (n, 3) were measured in; None if no line runs through them."""
    even = xyz[_one_a_voxel(xyz, _EVEN)]
    try:
        line = centreline_through(even)
    except ValueError:
        return None
    along, across = line.place(even)
    first, last = np.percentile(along, [0.1, 99.9])
    sizes = []
    count = max(1, round((last - first) / _SLICE))
    if count > len(even):
        return None
    edges = np.linspace(first, last, count + 1)
    slices = np.searchsorted(edges, along) - 1
    for number in range(len(edges) - 1):
        inside = slices == number
        if inside.sum() >= _MIN_COUNT:
            sizes.append([np.subtract(*np.percentile(values[inside], [99.0, 1.0])) for values in (across, even[:, 2])])
    if not sizes:
        return None
    width, height = np.median(sizes, axis=0)
    return TunnelForm(line, float(last - first), float(width), float(height))


def surface_density(xyz: Float, share: float) -> tuple[float, float, float]:
    """Return the points per square unit of surface, from a random sample (n, 3): 10th percentile, median, 90th percentile.

    Points of the sample within 1 m are counted around each of 400 places, and divided by the share of the sample and by π m²,
    as if the surface were a plane. The places are chosen independently of the density. In corners the density is up to twice
    too high, on a vault hardly, and at the cloud's ends it is half. A metre holds several profiles, so gaps between profiles
    are included. The median is accurate to 20 %.
    """
    seeds = _one_a_voxel(xyz, BALL)
    chosen = np.random.default_rng(1).permutation(seeds)[:BALLS]
    others = cKDTree(xyz).query_ball_point(xyz[chosen], BALL, return_length=True) - 1
    low, median, high = np.percentile(others / share / (np.pi * BALL**2), [10.0, 50.0, 90.0])
    return float(low), float(median), float(high)


def profile_spacing(along: Float, across: Float, z: Float) -> float | None:
    """Return the spacing of a profiler's profiles along the tunnel, from all points of a few metres; None if there is none.

    In a narrow strip along the wall, points of profiles follow each other at even steps; points of a static scanner, or of
    several passes, at steps of any length.

    Parameters
    ----------
    along, across, z : (n,) float arrays
        Distance along the tunnel and to the right of its line, height, m.
    """
    if len(along) < _MIN_COUNT:
        return None
    places = np.column_stack([along, across, z])
    some = np.unique(np.linspace(0, len(places) - 1, _NEAREST).astype(int))
    near = cKDTree(places).query(places[some], k=2)[0][:, 1]
    near = near[near > 0.0]
    if not len(near):
        return None
    u, w = across - np.median(across), z - np.mean(np.percentile(z, [1.0, 99.0]))
    radius = float(np.median(np.hypot(u, w)))
    width = 3.0 * float(np.median(near))
    strips = np.floor(np.arctan2(u, w) * radius / width).astype(np.int64)
    chosen = np.random.default_rng(1).permutation(np.unique(strips))[:_MAX_BINS]
    kept = np.isin(strips, chosen)
    order = np.lexsort([along[kept], strips[kept]])
    strip, ordered = strips[kept][order], along[kept][order]
    gaps = np.diff(ordered)[np.diff(strip) == 0]
    gaps = np.sort(gaps[gaps > 0.0])
    # Half of the length is in gaps below the median: points within a profile have little weight.
    lengths = np.cumsum(gaps)
    if len(gaps) < _MIN_COUNT:
        return None
    low, median, high = (float(gaps[np.searchsorted(lengths, part * lengths[-1])]) for part in (0.25, 0.5, 0.75))
    if high - low > MAX_GAP_SPREAD * median:
        return None
    return median


def _one_a_voxel(xyz: Float, edge: float) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Return the index of the first point in each voxel."""
    cells = np.floor((xyz - xyz.min(axis=0)) / edge).astype(np.int64)
    size = cells.max(axis=0) + 1
    keys = (cells[:, 0] * size[1] + cells[:, 1]) * size[2] + cells[:, 2]
    return np.asarray(np.unique(keys, return_index=True)[1])
