"""Joints: narrow straight dark lines, around the tunnel or along it, that must not connect leaks."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tunneldb.anomalies.runs import adjacent_runs, column_runs, connected, pixels_of, row_runs
from tunneldb.arrays import Bool, Float, Int64

MAX_WIDTH_AROUND, MAX_WIDTH_ALONG = 0.08, 0.06
"""Maximum width of joints around the tunnel and along it, m: 2 cm, widened by beam, pixels and grout. Painted stripes of 10 cm
along the tunnel must stay in one piece."""

MIN_LENGTH_AROUND, MIN_LENGTH_ALONG = 1.0, 0.5
"""Minimum length of joints around the tunnel and along it, m: water on a wall is straight for less, and spreads less."""

MAX_DEVIATION = 0.015
"""Standard deviation of the middle of a joint about a straight line, m: joints are built to millimetres, pixels are larger."""

MIN_RING_LENGTH, MAX_RING_LENGTH = 0.6, 12.0
"""Minimum and maximum distance of joints around the tunnel (ring length), m."""

STRETCH = 100.0
"""Length of tunnel over which rings repeat evenly, m; the next stretch begins half-way."""

CHANCE_LEVEL = 1e-3
"""Share of stretches in which random spots repeat as evenly (Rayleigh's test, over all ring lengths)."""

PROFILE_TOLERANCE = 0.1
"""Tolerance around the profile distance and its fractions: spots on profiles repeat with it, so such lengths are ignored."""

MAX_JOINT_DISTANCE = 1.0 / 6.0
"""Maximum distance of a spot from a ring's joint, as a share of the ring length: profiles are skew to rings."""

MIN_PIXEL_DEVIATION = 0.75
"""Minimum of the same deviation in pixels: a finer straightness cannot be measured."""


MIN_LENGTH_SPACINGS = 3.0
"""Minimum length of joints along the tunnel if profiles are far apart, in spacings: a spot on one profile is straight too."""


def find_joints(dark: Bool, first: int, stop: int, pixel: float, spacing: float = 0.0) -> Bool:
    """Find the pixels of narrow straight lines around the tunnel or along it that are long enough.

    With profiles far apart the width of a line around the tunnel is unknown: then only lines along it are found.

    Parameters
    ----------
    dark : (rows, columns) bool array
        Dark pixels.
    first, stop : int
        Range of columns to process.
    pixel : float
        Side of a pixel, m.
    spacing : float
        Distance of profiles along the tunnel, m; 0 if they are as close as pixels.
    """
    found = np.zeros(dark.shape, np.bool_)
    if 2 * pixel > MAX_WIDTH_AROUND:
        return found  # a line of two pixels has no significance
    for runs_of, image, width, length in (
        (row_runs, found, MAX_WIDTH_AROUND, MIN_LENGTH_AROUND),
        (column_runs, found.T, MAX_WIDTH_ALONG, max(MIN_LENGTH_ALONG, MIN_LENGTH_SPACINGS * spacing)),
    ):
        if spacing and runs_of is row_runs:
            continue
        runs = runs_of(dark, first, stop)
        runs = runs[runs[:, 2] - runs[:, 1] <= max(2, round(width / pixel))]
        lines = round(length / pixel)
        if len(runs) >= lines:
            image[pixels_of(runs[_straight(runs, lines, max(MAX_DEVIATION / pixel, MIN_PIXEL_DEVIATION))])] = True
    return found


def crossed_joints(chainage: Float, spacing: float) -> Float:
    """Measure how evenly dry dark areas of single profiles repeat along the tunnel, as joints crossed by profiles do.

    A profile is never exactly parallel to the rings, and crosses the joint between two of them somewhere. The spot there looks
    like a leak narrower than the profile distance, but it repeats with the ring length.

    Parameters
    ----------
    chainage : (n,) float array
        Chainage of the spots, m.
    spacing : float
        Distance of the profiles, m. Rings of that length, or a fraction of it, cannot be detected.

    Returns
    -------
    (n,) float array
        Length of the mean of the spots' directions in the ring, 0 to 1, for spots near the joint; 0 for others, and for
        randomly placed spots (Rayleigh's test; Mardia and Jupp, 2000).
    """
    found = np.zeros(len(chainage))
    per_metre = np.arange(1.0 / MAX_RING_LENGTH, 1.0 / MIN_RING_LENGTH, 0.25 / STRETCH)
    beats = np.rint(per_metre * spacing)
    lengths = 1.0 / per_metre[(beats == 0.0) | (np.abs(per_metre * spacing - beats) > PROFILE_TOLERANCE)]
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
        if len(here) * even**2 < np.log(len(lengths) / CHANCE_LEVEL):
            continue
        off = turns[best] - np.angle(mean[best]) / (2.0 * np.pi)
        near = here[np.abs(off - np.rint(off)) <= MAX_JOINT_DISTANCE]
        found[near] = np.maximum(found[near], even)
    return found


def _straight(runs: Int64, length: int, deviation: float) -> Bool:
    """Select runs, from a line and a place up to another one each, that belong to a long straight joint across these lines.

    Parameters
    ----------
    runs : (n, 3) int array
        Line, first place and place behind the last one, in order.
    length : int
        Minimum number of lines that a joint crosses.
    deviation : float
        Maximum standard deviation of the middles of its runs about a straight line, pixels.
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
    # One run per line: no networks, no branches.
    straight = (lines >= length) & (residual <= deviation) & (np.abs(slope) < 0.1) & (number <= 1.2 * lines)
    return np.asarray(straight[label], dtype=np.bool_)
