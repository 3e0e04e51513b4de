"""What a scan file holds, found in one pass over it, and a random share of its points to judge it by."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tunneldb.arrays import Float, Int64
from tunneldb.errors import InputError
from tunneldb.pointcloud.formats.table import format_of
from tunneldb.pointcloud.points import CHUNK, Raw, on_earth

SAMPLE = 400_000  # points, up to twice as many
PLACES, RUN = 20, 50_000  # runs of points of which values are looked at, and points of each: a chunk of LAZ


class UniformSample:
    """A random share of points that come chunk by chunk, each with the same chance; never more than twice `most`.

    Attributes
    ----------
    share : float
        Share of all points that is kept.
    """

    def __init__(self, most: int = SAMPLE) -> None:
        self.most, self.share = most, 1.0
        self._random = np.random.default_rng(1)
        self._kept: list[tuple[Float, Float, Int64]] = []
        self._count = 0

    def add(self, raw: Raw, first: int) -> None:
        """Add a chunk, whose points are numbered from `first` on."""
        chance = self._random.random(len(raw))
        chosen = np.flatnonzero(chance < self.share)
        xyz = np.column_stack([np.asarray(stored)[chosen] for stored in (raw.x, raw.y, raw.z)]) * raw.scales + raw.offsets
        good = on_earth(xyz).all(axis=1)
        self._kept.append((chance[chosen][good], xyz[good], chosen[good] + first))
        self._count += int(good.sum())
        while self._count > 2 * self.most:
            self.share /= 2.0
            self._kept = [tuple(part[kept[0] < self.share] for part in kept) for kept in self._kept]  # type: ignore[misc]
            self._count = sum(len(kept[0]) for kept in self._kept)

    @property
    def xyz(self) -> Float:
        """Coordinates (n, 3), m."""
        return np.concatenate([np.empty((0, 3)), *(kept[1] for kept in self._kept)])

    @property
    def numbers(self) -> Int64:
        """Numbers (n,) of the points in the file."""
        return np.concatenate([np.empty(0, np.int64), *(kept[2] for kept in self._kept)])


@dataclass(frozen=True)
class Contents:
    """What a scan file holds.

    Attributes
    ----------
    points : int
        Points that are valid.
    misplaced : int
        How many of them have a coordinate that is NaN or infinite.
    low, high : (3,) float64 array
        Box of the others, in the file's unit.
    times : (float, float) or None
        First and last ``gps_time``; None where the file has none, or all are the same.
    untimed : int
        Points whose time is NaN or infinite.
    scans : dict of int to int
        Points of each scan number.
    xyz : (n, 3) float64 array
        A random share of the points.
    numbers : (n,) int64 array
        Their numbers in the file.
    share : float
        How large a share that is.
    """

    points: int
    misplaced: int
    low: Float
    high: Float
    times: tuple[float, float] | None
    untimed: int
    scans: dict[int, int]
    xyz: Float
    numbers: Int64
    share: float


def read_contents(path: Path, progress: Callable[[int], None] = lambda count: None) -> Contents:
    """Read a scan file once, in chunks of constant memory.

    Parameters
    ----------
    path : Path
    progress : callable
        Takes the number of points of each chunk.

    Raises
    ------
    InputError
        If it cannot be read.
    """
    sample, scans = UniformSample(), dict[int, int]()
    points = misplaced = untimed = 0
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    first, last, timed = np.inf, -np.inf, False
    for raw in format_of(path).read(path, None, CHUNK, None):
        sample.add(raw, points)
        points += len(raw)
        placed = [
            np.asarray(values) * scale + offset
            for values, scale, offset in zip((raw.x, raw.y, raw.z), raw.scales, raw.offsets, strict=True)
        ]
        right = np.logical_and.reduce([on_earth(values) for values in placed])
        misplaced += len(raw) - int(right.sum())
        low = np.fmin(low, [_least(values[right]) for values in placed])
        high = np.fmax(high, [-_least(-values[right]) for values in placed])
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
        raise InputError(f"{path}: none of its {points} points has coordinates")
    times = (first, last) if timed and first < last else None
    return Contents(points, misplaced, low, high, times, untimed, scans, sample.xyz, sample.numbers, sample.share)


def _least(values: NDArray[Any]) -> float:
    """Least of the values that are finite; infinity if none is."""
    finite = values[np.isfinite(values)]
    return float(finite.min()) if len(finite) else np.inf


def read_values(path: Path, dimension: str, points: int) -> NDArray[Any]:
    """Values of a dimension in runs of points spread evenly over a file, NaN among them; all where they are few.

    Parameters
    ----------
    path : Path
    dimension : str
    points : int
        How many the file has.

    Raises
    ------
    InputError
        If they cannot be read as one number a point.
    """
    runs = -(-points // RUN)
    chosen = np.unique(np.linspace(0, runs - 1, min(runs, PLACES)).astype(int)) * RUN
    ranges = [(int(begin), min(int(begin) + RUN, points)) for begin in chosen]
    parts = [np.array(raw.intensity) for raw in format_of(path).read(path, dimension, CHUNK, ranges)]
    return np.concatenate(parts)


def read_near(path: Path, contents: Contents, near: NDArray[np.bool_]) -> Float:
    """Coordinates (n, 3), m, of runs of points in which most of some points of the random share lie: these at full density.

    Parameters
    ----------
    near : (n,) bool array
        Which points of the share they are.
    """
    runs, counts = np.unique(contents.numbers[near] // RUN, return_counts=True)
    chosen = np.sort(runs[np.argsort(-counts, kind="stable")[:PLACES]]) * RUN
    ranges = [(int(begin), min(int(begin) + RUN, contents.points)) for begin in chosen]
    parts = [
        np.column_stack([np.asarray(stored) for stored in (raw.x, raw.y, raw.z)]) * raw.scales + raw.offsets
        for raw in format_of(path).read(path, None, CHUNK, ranges)
    ]
    xyz = np.concatenate([np.empty((0, 3)), *parts])
    return np.asarray(xyz[on_earth(xyz).all(axis=1)])
