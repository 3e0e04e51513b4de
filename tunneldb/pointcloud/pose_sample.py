"""Random sample of the points of a scan, for the comparison with scanner positions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Float, Int32

MAX_POINTS = 60_000
"""Maximum number of points of a file that are compared with scanner positions, on loading as on inspection."""


@dataclass(frozen=True)
class SampledPoints:
    """Points of a scan.

    Attributes
    ----------
    xyz : (n, 3) float64 array
        m.
    time : (n,) float64 array
        ``gps_time``, s.
    scan_id : (n,) int32 array
        Number of the scan.
    """

    xyz: Float
    time: Float
    scan_id: Int32

    def __len__(self) -> int:
        return len(self.xyz)


class PoseSample:
    """Random sample of points that are read in chunks, all with the same probability; at most MAX_POINTS."""

    def __init__(self, max_points: int = MAX_POINTS) -> None:
        self.max_points, self.share = max_points, 1.0
        self._random = np.random.default_rng(1)
        self._parts: list[SampledPoints] = []

    def add(self, xyz: Float, time: Float, scan_id: Int32) -> None:
        """Add a chunk: coordinates (n, 3), m, times (n,), s, and scan numbers (n,)."""
        count = len(xyz)
        if not count:
            return
        while count * self.share > self.max_points:
            self._halve()
        wanted = int(count * self.share + self._random.random())
        chosen = np.arange(count) if wanted >= count else self._random.integers(0, count, wanted)
        self._parts.append(SampledPoints(xyz[chosen], time[chosen], scan_id[chosen]))
        while sum(map(len, self._parts)) > self.max_points:
            self._halve()

    def _halve(self) -> None:
        self.share /= 2.0
        self._parts = [self._half(part) for part in self._parts]

    def _half(self, part: SampledPoints) -> SampledPoints:
        kept = self._random.random(len(part)) < 0.5
        return SampledPoints(part.xyz[kept], part.time[kept], part.scan_id[kept])

    @property
    def points(self) -> SampledPoints:
        """The sample."""
        none = SampledPoints(np.empty((0, 3)), np.empty(0), np.empty(0, np.int32))
        parts = [none, *self._parts]
        return SampledPoints(
            np.concatenate([part.xyz for part in parts]),
            np.concatenate([part.time for part in parts]),
            np.concatenate([part.scan_id for part in parts]),
        )
