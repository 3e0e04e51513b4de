"""Spacing of points in a cloud, along the tunnel and across: a profiler's profiles may stand far apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Float = NDArray[np.float64]

_SAMPLES, _NEIGHBOURS = 2000, 128


@dataclass(frozen=True)
class Spacing:
    """Typical distance of neighbouring points on a surface.

    Attributes
    ----------
    along, across : float
        Along the tunnel and across it, m.
    """

    along: float
    across: float

    @classmethod
    def of(cls, along: Float, across: Float) -> Spacing | None:
        """Measure it on points (n,) of a surface laid flat, m; None for points without two different places.

        Of each of some points that neighbour is taken that is the nearest among those more along than across of it, and the
        nearest among the others; their medians are the spacings.
        """
        plane = np.column_stack([along, across])
        plane = plane[np.isfinite(plane).all(axis=1)]
        if len(plane) < 2:
            return None
        chosen = plane[np.unique(np.linspace(0, len(plane) - 1, _SAMPLES).astype(np.int64))]
        _, near = cKDTree(plane).query(chosen, k=min(_NEIGHBOURS, len(plane)))
        step = np.abs(plane[near] - chosen[:, None, :])
        length = np.hypot(step[..., 0], step[..., 1])
        length[length == 0.0] = np.inf
        ahead = step[..., 0] > step[..., 1]
        found = [np.where(mask, length, np.inf).min(axis=1) for mask in (ahead, ~ahead)]
        medians = [float(np.median(f[np.isfinite(f)])) if np.isfinite(f).any() else np.inf for f in found]
        shortest = min(medians)
        if not np.isfinite(shortest):
            return None
        return cls(*(m if np.isfinite(m) else shortest for m in medians))

    @property
    def shrink(self) -> float:
        """Number that distances along are multiplied by to be as close as those across; 1 where they are no wider."""
        return min(1.0, self.across / self.along)
