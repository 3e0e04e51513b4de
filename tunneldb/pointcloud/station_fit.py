"""Comparison of stations with the points measured from them: the place from which a scan's directions are even."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Float, Int64, Intp

MIN_POINTS = 300
"""Number of points of a scan below which nothing is concluded."""

MIN_SHIFT = 3.0
"""Distance of a station from the place its scan was measured from, from which it is wrong, m."""

SAME_PLACE = 0.001
"""Greatest distance of stations at one place, m."""

_AZIMUTHS, _ELEVATIONS = 36, 16  # cells of 10 by 11 degrees
_DIRECTIONS = 2000  # points whose directions are counted
_STEP = 1.0  # m between places that are tried
_MAX_PLACES = 100
_MOVE, _MOVES = 0.4, 8  # m, and number of moves to the most even place near the best that was tried
_MIN_EVENNESS, _MIN_FILLING = 0.5, 0.85  # of directions as a scanner measures them
_GAIN, _FACTOR = 0.12, 1.5  # by which another place is more even than the station


@dataclass(frozen=True)
class Misfit:
    """Scan that was not measured from its station.

    Attributes
    ----------
    scan_id : int
        Its number.
    share : float
        Share of all points.
    shift : float
        Distance along the tunnel from the station to the place it was measured from, m.
    station : int or None
        Scan whose station is there.
    """

    scan_id: int
    share: float
    shift: float
    station: int | None


@dataclass(frozen=True)
class _Look:
    """Directions and extent of a scan: most even place along the tunnel, m, or its middle, and whether that is certain."""

    place: float
    half: float
    certain: bool
    outside: bool


def evenness(place: Float, scanner: Float) -> tuple[float, float]:
    """Return how evenly the directions of points (n, 3) from a scanner (3,) are spread: over all directions, and over theirs.

    Both are the exponential of the entropy of the counts of points in cells of azimuth and elevation, relative to the number
    of cells: of all cells, and of those with points. Scanners measure at even steps of both angles, so the latter is near 1 at
    the scanner's place; elsewhere near walls fill few cells.
    """
    away = place - scanner
    azimuth = np.arctan2(away[:, 1], away[:, 0]) / (2.0 * np.pi) + 0.5
    elevation = np.arctan2(away[:, 2], np.hypot(away[:, 0], away[:, 1])) / np.pi + 0.5
    cell = np.minimum((azimuth * _AZIMUTHS).astype(np.int64), _AZIMUTHS - 1) * _ELEVATIONS
    cell += np.minimum((elevation * _ELEVATIONS).astype(np.int64), _ELEVATIONS - 1)
    counts = np.bincount(cell, minlength=_AZIMUTHS * _ELEVATIONS)
    share = counts[counts > 0] / len(place)
    spread = float(np.exp(-np.sum(share * np.log(share))))
    return spread / len(counts), spread / len(share)


def find_misfits(place: Float, scan_id: Int64, scans: Int64, stations: Float) -> list[Misfit]:
    """Return the scans that were certainly measured from another place than their station.

    A scan is certain if its directions are even as a scanner measures them, but from another place; or, of thinned scans, if
    their points lie about each other's stations in a cycle, or stations at one place have points at several.

    Parameters
    ----------
    place, scan_id : (n, 3) float and (n,) int arrays
        Sample of points: distance along the tunnel's line, to the right, and height, m; numbers of their scans.
    scans, stations : (k,) int and (k, 3) float arrays
        Stations of scans, as the points.
    """
    where = dict(zip(scans.tolist(), stations, strict=True))
    numbers, counts = np.unique(scan_id, return_counts=True)
    order = np.argsort(scan_id, kind="stable")
    parts = dict(zip(numbers.tolist(), np.split(order, np.cumsum(counts)[:-1]), strict=True))
    looks = {scan: _look(place, part, where[scan]) for scan, part in parts.items() if scan in where and len(part) >= MIN_POINTS}
    wrong = {scan: look for scan, look in looks.items() if look.outside and abs(look.place - where[scan][0]) > MIN_SHIFT}
    nearest = {scan: _station_at(look, scan, where) for scan, look in wrong.items()}
    together = _at_one_place(looks, where)
    found = []
    for scan, look in wrong.items():
        if look.certain or scan in together or _in_cycle(scan, nearest):
            share = len(parts[scan]) / len(scan_id)
            found.append(Misfit(scan, share, look.place - float(where[scan][0]), nearest[scan]))
    return found


def _look(place: Float, part: Intp, station: Float) -> _Look:
    few = place[part[np.linspace(0, len(part) - 1, min(len(part), _DIRECTIONS)).astype(int)]]
    low, first, middle, third, high = np.percentile(few[:, 0], [1.0, 25.0, 50.0, 75.0, 99.0])
    step = max(_STEP, (high - low) / _MAX_PLACES)
    centre = np.percentile(few[:, 1:], [5.0, 95.0], axis=0).mean(axis=0)
    tried = [np.array([along, *across]) for along in np.arange(low, high + step, step) for across in (station[1:], centre)]
    best = _most_even(few, max(tried, key=lambda one: evenness(few, one)[0]))
    there, filled = evenness(few, best)
    here = evenness(few, station)[0]
    if there >= _MIN_EVENNESS and filled >= _MIN_FILLING:
        return _Look(float(best[0]), 2.0, True, there > here + _GAIN and there > _FACTOR * here)
    outside = not low - MIN_SHIFT <= station[0] <= high + MIN_SHIFT
    return _Look(float(middle), float(third - first) / 2.0, False, outside)


def _most_even(few: Float, place: Float) -> Float:
    """Return the place near a place from which directions to points are most even."""
    moves = _MOVE * np.concatenate([np.eye(3), -np.eye(3)])
    best, most = place, evenness(few, place)[0]
    for _ in range(_MOVES):
        found = max((evenness(few, best + move)[0], k) for k, move in enumerate(moves))
        if found[0] <= most:
            break
        best, most = best + moves[found[1]], found[0]
    return best


def _station_at(look: _Look, scan: int, where: dict[int, Float]) -> int | None:
    """Return the scan whose station is nearest to the place that a scan was measured from; None if none is near."""
    others = [other for other in where if other != scan and abs(where[other][0] - look.place) <= max(look.half, 2.0)]
    return min(others, key=lambda other: abs(where[other][0] - look.place), default=None)


def _at_one_place(looks: dict[int, _Look], where: dict[int, Float]) -> set[int]:
    """Return scans whose stations are at one place, although they were measured from several."""
    found = set()
    for scan, look in looks.items():
        for other, second in looks.items():
            same = np.linalg.norm(where[scan] - where[other]) < SAME_PLACE
            if same and abs(look.place - second.place) > MIN_SHIFT:
                found.add(scan)
    return found


def _in_cycle(scan: int, nearest: dict[int, int | None]) -> bool:
    """Return True if the stations that scans fit lead back to a scan."""
    following = nearest.get(scan)
    for _ in nearest:
        if following is None or following == scan:
            break
        following = nearest.get(following)
    return following == scan
