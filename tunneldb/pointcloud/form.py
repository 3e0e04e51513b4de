"""What a cloud of a tunnel looks like before anything is known of it: its size, its density, its profiles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from tunneldb.arrays import Float
from tunneldb.geometry.centreline import centreline_through
from tunneldb.geometry.plan_line import PlanLine

BALL = 1.0  # m; wider than profiles lie apart, smaller than a tunnel
BALLS = 400
WINDOW = 5.0  # m along the tunnel in which profiles are looked for
REGULAR = 0.3
"""Half of a length along which points of random places lie is in gaps that differ by 1.0 of their median; gaps between
profiles differ by less than this."""

_EVEN = 0.25  # m; edge of the voxels of which a point each tells the line
_SLICE = 5.0  # m
_LEAST = 20  # points of a slice, and gaps of a spacing
_MOST_BINS = 500
_NEAREST = 2000


@dataclass(frozen=True)
class TunnelForm:
    """Size of a tunnel, in the file's unit, and the line that it follows.

    Attributes
    ----------
    line : PlanLine
    length : float
        Along the line.
    width, height : float
        Medians of what sections 5 m long measure from the 1st to the 99th percentile.
    """

    line: PlanLine
    length: float
    width: float
    height: float


def tunnel_form(xyz: Float) -> TunnelForm | None:
    """Size of the tunnel that points (n, 3) are of; None where no line runs through them."""
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
        if inside.sum() >= _LEAST:
            sizes.append([np.subtract(*np.percentile(values[inside], [99.0, 1.0])) for values in (across, even[:, 2])])
    if not sizes:
        return None
    width, height = np.median(sizes, axis=0)
    return TunnelForm(line, float(last - first), float(width), float(height))


def surface_density(xyz: Float, share: float) -> tuple[float, float, float]:
    """Points per square unit of surface, of a random share of all points (n, 3): 10th percentile, median, 90th.

    About each of 400 places, chosen so that no part of the surface has more for being denser, the share's points within
    1 m are counted, and divided by the share and by π m², as if the surface there were a plane: in corners it is up to
    twice as much, on a vault hardly more, and at the cloud's ends half of it. A metre holds several profiles, so what is
    between them counts. The median is good to a fifth.
    """
    seeds = _one_a_voxel(xyz, BALL)
    chosen = np.random.default_rng(1).permutation(seeds)[:BALLS]
    others = cKDTree(xyz).query_ball_point(xyz[chosen], BALL, return_length=True) - 1
    low, median, high = np.percentile(others / share / (np.pi * BALL**2), [10.0, 50.0, 90.0])
    return float(low), float(median), float(high)


def profile_spacing(along: Float, across: Float, z: Float) -> float | None:
    """Distance of a profiler's profiles along the tunnel, of all points of a few metres of it; None where it can't be told.

    Seen in a narrow strip along the wall, the points of profiles follow each other in steps that are alike; those of a
    scanner that stood still, or of several passes, in steps of any length.

    Parameters
    ----------
    along, across, z : (n,) float arrays
        Distance along the tunnel and to the right of its line, height, m.
    """
    if len(along) < _LEAST:
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
    chosen = np.random.default_rng(1).permutation(np.unique(strips))[:_MOST_BINS]
    kept = np.isin(strips, chosen)
    order = np.lexsort([along[kept], strips[kept]])
    strip, ordered = strips[kept][order], along[kept][order]
    gaps = np.diff(ordered)[np.diff(strip) == 0]
    gaps = np.sort(gaps[gaps > 0.0])
    # Half of the length lies in gaps below the median: points within a profile hardly count.
    lengths = np.cumsum(gaps)
    if len(gaps) < _LEAST:
        return None
    low, median, high = (float(gaps[np.searchsorted(lengths, part * lengths[-1])]) for part in (0.25, 0.5, 0.75))
    if high - low > REGULAR * median:
        return None
    return median


def _one_a_voxel(xyz: Float, edge: float) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Numbers of points, the first in each voxel."""
    cells = np.floor((xyz - xyz.min(axis=0)) / edge).astype(np.int64)
    size = cells.max(axis=0) + 1
    keys = (cells[:, 0] * size[1] + cells[:, 1]) * size[2] + cells[:, 2]
    return np.asarray(np.unique(keys, return_index=True)[1])
