"""Points beyond the ends of a given axis, where the tunnel may continue."""

from __future__ import annotations

import numpy as np

from tunneldb.arrays import Float, Int64
from tunneldb.geometry.alignment import Alignment

MAX_DISTANCE = 200  # m beyond an end within which points are counted
REACH_SHARE = 0.99  # share of the points there that lie within their reach; a single stray does not extend it


class BeyondEnds:
    """Counts of points before the start and after the end of an axis, by metre.

    Parameters
    ----------
    alignment : Alignment
        Given axis, continued straight.
    limit : float
        Greatest distance of counted points from the axis, m.
    """

    def __init__(self, alignment: Alignment, limit: float) -> None:
        self.limit = limit
        # Vertices lie at whole spacings; the first and the last are beyond the given line.
        line, chainage = alignment.vertices, alignment.number * alignment.spacing
        self.ends = tuple(
            (a + (b - a) * (end - at) / (next_ - at), (b - a) / np.linalg.norm(b - a))
            for a, b, at, next_, end in (
                (line[1], line[0], chainage[1], chainage[0], alignment.start),
                (line[-2], line[-1], chainage[-2], chainage[-1], alignment.end),
            )
        )
        self.metres: Int64 = np.zeros((2, MAX_DISTANCE), np.int64)

    def add(self, xyz: Float) -> None:
        """Count points (n, 3), m, that are known to lie outside."""
        for metres, (end, outwards) in zip(self.metres, self.ends, strict=True):
            vector = xyz - end
            beyond = vector @ outwards
            lateral = np.sqrt(np.maximum((vector**2).sum(axis=1) - beyond**2, 0.0))
            counted = (beyond > 0.0) & (beyond < MAX_DISTANCE) & (lateral <= self.limit)
            metres += np.bincount(beyond[counted].astype(np.int64), minlength=MAX_DISTANCE)

    @property
    def points(self) -> tuple[int, int]:
        """Number of points before the start, and after the end."""
        return int(self.metres[0].sum()), int(self.metres[1].sum())

    @property
    def reach(self) -> tuple[float, float]:
        """Distances beyond start and end within which nearly all of them lie, m; 0 where there are none."""
        before, after = (self._reach(metres) for metres in self.metres)
        return before, after

    def _reach(self, metres: Int64) -> float:
        total = int(metres.sum())
        return float(np.searchsorted(np.cumsum(metres), REACH_SHARE * total)) + 1.0 if total else 0.0
