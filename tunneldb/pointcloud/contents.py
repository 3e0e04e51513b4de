"""Contents of a scan file, found in one pass, and a random sample of its points."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tunneldb.arrays import Float, Int32, Int64
from tunneldb.errors import InputError
from tunneldb.geometry.units import IN_METRES, Units
from tunneldb.pointcloud.formats.raw import read_raw
from tunneldb.pointcloud.points import Raw, on_earth
from tunneldb.pointcloud.pose_sample import SampledPoints

SAMPLE = 400_000  # points; the sample has at most twice as many
RUNS, RUN_POINTS = 20, 50_000  # runs of points whose values are examined, and points of a run (a chunk of LAZ)


class UniformSample:
    """Random sample of points that are read in chunks, all with the same probability; at most twice `most` points.

    Attributes
    ----------
    share : float
        Share of all points that is in the sample.
    """

    def __init__(self, max_points: int = SAMPLE) -> None:
        self.max_points, self.share = max_points, 1.0
        self._random = np.random.default_rng(1)
        self._kept: list[tuple[Float, Float, Int64, Float, Int32]] = []
        self._count = 0

    def add(self, raw: Raw, first: int) -> None:
        """Add a chunk whose points are numbered from `first` on."""
        chance = self._random.random(len(raw))
        chosen = np.flatnonzero(chance < self.share)
        xyz = np.column_stack([np.asarray(stored)[chosen] for stored in (raw.x, raw.y, raw.z)]) * raw.scales + raw.offsets
        good = on_earth(xyz).all(axis=1)
        numbers = chosen[good]
        time = np.zeros(len(numbers)) if raw.time is None else np.asarray(raw.time, np.float64)[numbers]
        scan_id = np.asarray(raw.scan_id)[numbers].astype(np.int32)
        self._kept.append((chance[numbers], xyz[good], numbers + first, time, scan_id))
        self._count += int(good.sum())
        while self._count > 2 * self.max_points:
            self.share /= 2.0
            self._kept = [tuple(part[kept[0] < self.share] for part in kept) for kept in self._kept]  # type: ignore[misc]
            self._count = sum(len(kept[0]) for kept in self._kept)

    @property
    def xyz(self) -> Float:
        """Coordinates of the sample (n, 3), m."""
        return np.concatenate([np.empty((0, 3)), *(kept[1] for kept in self._kept)])

    @property
    def numbers(self) -> Int64:
        """Indices (n,) of the sampled points in the file."""
        return np.concatenate([np.empty(0, np.int64), *(kept[2] for kept in self._kept)])

    @property
    def points(self) -> SampledPoints:
        """The sample with its times, 0 if the file has none, and scan numbers."""
        time = np.concatenate([np.empty(0), *(kept[3] for kept in self._kept)])
        return SampledPoints(self.xyz, time, np.concatenate([np.empty(0, np.int32), *(kept[4] for kept in self._kept)]))


@dataclass(frozen=True)
class Contents:
    """Contents of a scan file.

    Attributes
    ----------
    points : int
        Number of valid points.
    misplaced : int
        Number of valid points with a coordinate that is NaN or infinite.
    low, high : (3,) float64 array
        Bounding box of the other points, m.
    times : (float, float) or None
        First and last ``gps_time``; None if the file has none, or all are equal.
    untimed : int
        Number of points whose time is NaN or infinite.
    scans : dict of int to int
        Number of points of each scan number.
    sample : SampledPoints
        Random sample of the points.
    numbers : (n,) int64 array
        Their indices in the file.
    share : float
        Share of the points that is in the sample.
    """

    points: int
    misplaced: int
    low: Float
    high: Float
    times: tuple[float, float] | None
    untimed: int
    scans: dict[int, int]
    sample: SampledPoints
    numbers: Int64
    share: float

    @property
    def xyz(self) -> Float:
        """Coordinates of the sample (n, 3)."""
        return self.sample.xyz


def read_contents(path: Path, progress: Callable[[int], None] = lambda count: None, units: Units = IN_METRES) -> Contents:
    """Read a scan file once, in chunks of constant memory.

    Parameters
    ----------
    path : Path
    progress : callable
        Function of the number of points of each chunk.
    units : Units
        Units of the file's coordinates.

    Raises
    ------
    InputError
        If it cannot be read.
    """
    sample, scans = UniformSample(), dict[int, int]()
    points = misplaced = untimed = 0
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    first, last, timed = np.inf, -np.inf, False
    for raw in read_raw(path, None, units=units):
        sample.add(raw, points)
        points += len(raw)
        placed = [
            np.asarray(values) * scale + offset
            for values, scale, offset in zip((raw.x, raw.y, raw.z), raw.scales, raw.offsets, strict=True)
        ]
        right = np.logical_and.reduce([on_earth(values) for values in placed])
        misplaced += len(raw) - int(right.sum())
        low = np.fmin(low, [_finite_minimum(values[right]) for values in placed])
        high = np.fmax(high, [-_finite_minimum(-values[right]) for values in placed])
        numbers, counts = np.unique(np.asarray(raw.scan_id), return_counts=True)
        for number, count in zip(numbers.tolist(), counts.tolist(), strict=True):
            scans[number] = scans.get(number, 0) + count
        if raw.time is not None:
            timed = True
            good = raw.time[np.isfinite(raw.time)]
            untimed += len(raw) - len(good)
            first, last = min(first, float(good.min(initial=np.inf))), max(last, float(good.max(initial=-np.inf)))
        progress(len(raw))
    if points == misplaced:
        raise InputError(f"{path}: none of its {points} points has valid coordinates")
    times = (first, last) if timed and first < last else None
    return Contents(points, misplaced, low, high, times, untimed, scans, sample.points, sample.numbers, sample.share)


def _finite_minimum(values: NDArray[Any]) -> float:
    """Return the least finite value; infinity if none is finite."""
    finite = values[np.isfinite(values)]
    return float(finite.min()) if len(finite) else np.inf


def read_values(path: Path, dimension: str, points: int) -> NDArray[Any]:
    """Read values of a dimension, NaN included, in runs of points spread evenly over a file; all values of a small file.

    Parameters
    ----------
    path : Path
    dimension : str
    points : int
        Number of points in the file.

    Raises
    ------
    InputError
        If they cannot be read as one number per point.
    """
    runs = -(-points // RUN_POINTS)
    chosen = np.unique(np.linspace(0, runs - 1, min(runs, RUNS)).astype(int)) * RUN_POINTS
    ranges = [(int(begin), min(int(begin) + RUN_POINTS, points)) for begin in chosen]
    parts = [np.array(raw.intensity) for raw in read_raw(path, dimension, ranges=ranges)]
    return np.concatenate(parts)


def read_near(path: Path, contents: Contents, near: NDArray[np.bool_], units: Units = IN_METRES) -> Float:
    """Read coordinates (n, 3), m, at full density in the runs of points that hold most of some points of the sample.

    Parameters
    ----------
    near : (n,) bool array
        True for these points of the sample.
    units : Units
        Units of the file's coordinates.
    """
    runs, counts = np.unique(contents.numbers[near] // RUN_POINTS, return_counts=True)
    chosen = np.sort(runs[np.argsort(-counts, kind="stable")[:RUNS]]) * RUN_POINTS
    ranges = [(int(begin), min(int(begin) + RUN_POINTS, contents.points)) for begin in chosen]
    parts = [
        np.column_stack([np.asarray(stored) for stored in (raw.x, raw.y, raw.z)]) * raw.scales + raw.offsets
        for raw in read_raw(path, None, ranges=ranges, units=units)
    ]
    xyz = np.concatenate([np.empty((0, 3)), *parts])
    return np.asarray(xyz[on_earth(xyz).all(axis=1)])
