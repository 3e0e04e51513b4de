"""Detection of scans that were merged under one number: points of one number that were measured from several places.

A scanner measures at even angles: along a tunnel, its points become fewer with the distance from it, on both sides. Two
maxima with few points between them are two places. Thinning removes the maxima; but also a thinned scan has points between
the scanner and its farthest points.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Float, Int64

MIN_POINTS = 1000
"""Number of points of a scan below which nothing is concluded."""

MIN_SHARE = 0.2
"""Least share of a scan's points about each of the places. A wall across the tunnel, or a second scan of a detail from the same
tripod, has fewer: of 1,500 computed scans in front of a wall, one reaches 0.2, and 11 reach 0.15."""

MIN_RATIO = 3.0
"""Ratio of the points per metre at a maximum to those between two maxima; less is due to fixtures and wider sections."""

_STEP = 0.5  # m along the tunnel in which points are counted
_SMOOTH = 7  # steps of the running median: a wall across the tunnel, and a train's front, are thinner
_CERTAIN = 5.0  # standard deviations of the counts by which they differ


@dataclass(frozen=True)
class MergedScan:
    """Points of one number that were measured from several places.

    Attributes
    ----------
    scan_id : int
    share : float
        Share of all points.
    places : list of float
        The places along the tunnel, m, to about a metre.
    """

    scan_id: int
    share: float
    places: list[float]


def find_merged(along: Float, scan_id: Int64) -> list[MergedScan]:
    """Return the scans of a static scanner whose points were certainly measured from several places.

    Parameters
    ----------
    along, scan_id : (n,) float and int arrays
        Sample of points: distance along the tunnel, m, and number of the scan.
    """
    found = []
    numbers, counts = np.unique(scan_id, return_counts=True)
    for number, count in zip(numbers.tolist(), counts.tolist(), strict=True):
        if count >= MIN_POINTS and len(places := scanner_places(along[scan_id == number])) > 1:
            found.append(MergedScan(number, count / len(scan_id), places))
    return found


def scanner_places(along: Float) -> list[float]:
    """Return the places along the tunnel, m, that points (n,) were measured from, as their numbers per metre show it."""
    low, high = np.percentile(along, [0.1, 99.9])
    edges = np.arange(low, high + _STEP, _STEP)
    if len(edges) <= _SMOOTH:
        return [float(np.median(along))]
    points = np.histogram(along, edges)[0].astype(np.float64)
    counts = _running_median(points)
    middles = (edges[1:] + edges[:-1]) / 2.0
    parts = _split(counts, np.cumsum(points) / points.sum(), 0, len(counts))
    return [float(np.average(middles[first:last], weights=counts[first:last])) for first, last in parts]


def _split(counts: Float, share: Float, first: int, last: int) -> list[tuple[int, int]]:
    """Return the ranges about single maxima of counts within a range, each with the least share of the points."""
    part = counts[first:last]
    before, after = np.maximum.accumulate(part), np.maximum.accumulate(part[::-1])[::-1]
    lower = np.minimum(before, after)
    clear = (lower >= MIN_RATIO * part) & (lower - part > _CERTAIN * np.sqrt(lower))
    ahead = share[first:last] - (share[first - 1] if first else 0.0)
    clear &= (ahead >= MIN_SHARE) & (ahead[-1] - ahead >= MIN_SHARE)
    if not clear.any():
        return [(first, last)]
    cut = first + int(np.argmax(np.where(clear, lower - part, -np.inf)))
    return [*_split(counts, share, first, cut), *_split(counts, share, cut, last)]


def _running_median(counts: Float) -> Float:
    padded = np.pad(counts, _SMOOTH // 2, mode="edge")
    return np.asarray(np.median(np.lib.stride_tricks.sliding_window_view(padded, _SMOOTH), axis=1))
