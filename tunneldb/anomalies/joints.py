"""Joints: narrow straight dark lines, around the tunnel or along it, that must not tie leaks together."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tunneldb.anomalies.runs import adjacent_runs, column_runs, connected, pixels_of, row_runs
from tunneldb.arrays import Bool, Float, Int64

NARROW_AROUND, NARROW_ALONG = 0.08, 0.06
"""Joints are at most 2 cm wide; the beam, the pixels and grout widen them, but not to more, m. Along the tunnel there are
painted stripes of 10 cm, which are to stay in one piece."""

LONG_AROUND, LONG_ALONG = 1.0, 0.5
"""Water that runs down a wall keeps no straight line for longer, and runs along the tunnel no farther, m."""

STRAIGHT = 0.015
"""Standard deviation of the middle of a joint about a straight line, m: it is built to millimetres, pixels are larger."""

RING_SHORTEST, RING_LONGEST = 0.6, 12.0
"""Rings of a lining, from one joint around the tunnel to the next, are no shorter and no longer, m."""

STRETCH = 100.0
"""Length of tunnel over which rings repeat evenly, m; the next stretch begins half-way."""

BY_CHANCE = 1e-3
"""Spots that lie anywhere repeat as evenly in so small a share of stretches (Rayleigh's test, over all lengths of rings)."""

AS_PROFILES = 0.1
"""Whatever profiles show repeats as they do: lengths that differ by less from their distance, or a part of it, don't count."""

NEAR_RING = 1.0 / 6.0
"""A spot is of a ring's joint up to so much of the ring's length from it: profiles stand askew to rings."""

RESOLVED = 0.75
"""The same in pixels, at least: a line cannot be told to be straighter."""


PROFILES = 3.0
"""Where profiles lie apart, joints along the tunnel are seen over so many spacings: a spot of a single one is straight, too."""


def find_joints(dark: Bool, first: int, stop: int, pixel: float, spacing: float = 0.0) -> Bool:
    """Find the pixels of narrow straight lines around the tunnel or along it that are long enough.

    Profiles that lie apart can't tell how narrow is what goes around the tunnel: then only lines along it are found.

    Parameters
    ----------
    dark : (rows, columns) bool array
        Dark pixels.
    first, stop : int
        Columns that count.
    pixel : float
        Side of a pixel, m.
    spacing : float
        Distance of profiles along the tunnel, m; 0 where they lie as close as pixels.
    """
    found = np.zeros(dark.shape, np.bool_)
    if 2 * pixel > NARROW_AROUND:
        return found  # a line of two pixels may be anything
    for runs_of, image, width, length in (
        (row_runs, found, NARROW_AROUND, LONG_AROUND),
        (column_runs, found.T, NARROW_ALONG, max(LONG_ALONG, PROFILES * spacing)),
    ):
        if spacing and runs_of is row_runs:
            continue
        runs = runs_of(dark, first, stop)
        runs = runs[runs[:, 2] - runs[:, 1] <= max(2, round(width / pixel))]
        lines = round(length / pixel)
        if len(runs) >= lines:
            image[pixels_of(runs[_straight(runs, lines, max(STRAIGHT / pixel, RESOLVED))])] = True
    return found


def crossed_joints(chainage: Float, spacing: float) -> Float:
    """How evenly dark spots of single profiles repeat along the tunnel, as joints of rings do that profiles cross.

    A profile never stands quite as the rings do, and crosses the joint between two of them in some place only. What it shows
    there is like a leak that is narrower than profiles are apart, but it comes back with the length of the rings.

    Parameters
    ----------
    chainage : (n,) float array
        Of the spots, m.
    spacing : float
        Distance of the profiles, m. Rings as long as that, or as a part of it, can't be told.

    Returns
    -------
    (n,) float array
        Length of the mean of the spots' directions in the ring, 0 to 1, for those near the joint; 0 for the others, and
        where spots lie anywhere (Rayleigh's test; Mardia and Jupp, 2000).
    """
    found = np.zeros(len(chainage))
    per_metre = np.arange(1.0 / RING_LONGEST, 1.0 / RING_SHORTEST, 0.25 / STRETCH)
    beats = np.rint(per_metre * spacing)
    lengths = 1.0 / per_metre[(beats == 0.0) | (np.abs(per_metre * spacing - beats) > AS_PROFILES)]
    low = np.floor(chainage.min(initial=np.inf) / STRETCH) if len(chainage) else 0.0
    for number in range(2 * int(np.ceil((chainage.max(initial=0.0) / STRETCH) - low)) if len(chainage) else 0):
        start = (low + 0.5 * number) * STRETCH
        here = np.flatnonzero((chainage >= start) & (chainage < start + STRETCH))
        if not len(here) or not len(lengths):
            continue
        turns = (chainage[here] - start) / lengths[:, None]
        mean = np.exp(2j * np.pi * turns).mean(axis=1)
        best = int(np.argmax(np.abs(mean)))
        even = float(np.abs(mean[best]))
        if len(here) * even**2 < np.log(len(lengths) / BY_CHANCE):
            continue
        off = turns[best] - np.angle(mean[best]) / (2.0 * np.pi)
        near = here[np.abs(off - np.rint(off)) <= NEAR_RING]
        found[near] = np.maximum(found[near], even)
    return found


def _straight(runs: Int64, length: int, deviation: float) -> Bool:
    """Which runs, of a line and from a place up to another one each, are parts of a long straight joint across these lines.

    Parameters
    ----------
    runs : (n, 3) int array
        Line, first place and place behind the last one, in order.
    length : int
        Least number of lines that a joint runs across.
    deviation : float
        Greatest standard deviation of the middles of its runs about a straight line, pixels.
    """
    count, label = connected(len(runs), *adjacent_runs(runs))
    at, middle = runs[:, 0].astype(np.float64), 0.5 * (runs[:, 1] + runs[:, 2])

    def mean(values: NDArray[np.floating]) -> Float:
        return np.asarray(np.bincount(label, values, count)) / number

    number = np.bincount(label, minlength=count)
    at, middle = at - mean(at)[label], middle - mean(middle)[label]
    variance, covariance = mean(at * at), mean(at * middle)
    slope = covariance / np.maximum(variance, 1e-9)
    residual = np.sqrt(np.maximum(mean(middle * middle) - slope * covariance, 0.0))
    low, high = np.full(count, np.iinfo(np.int64).max), np.full(count, -1)
    np.minimum.at(low, label, runs[:, 0])
    np.maximum.at(high, label, runs[:, 0])
    lines = high - low + 1
    # One run a line: no net, no branches.
    straight = (lines >= length) & (residual <= deviation) & (np.abs(slope) < 0.1) & (number <= 1.2 * lines)
    return np.asarray(straight[label], dtype=np.bool_)
