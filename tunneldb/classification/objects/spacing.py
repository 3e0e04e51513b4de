"""Spacing of points in a cloud, along the tunnel and across: profiles of a profiler may be far apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from tunneldb.arrays import Float

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
    def of(cls, places: Float) -> Spacing | None:
        """Measure the spacing on points; None without two different places.

        For each point of a sample, the nearest neighbour in the more longitudinal directions and the nearest in the others are
        used. The spacings are the medians of their distances, rounded to steps of a tenth, so that two stretches of the same
        survey have the same spacing.

        Parameters
        ----------
        places : (n, k) float array
            Distance along the tunnel, then one or two coordinates across it, m.
        """
        places = places[np.isfinite(places).all(axis=1)]
        if len(places) < 2:
            return None
        chosen = places[np.unique(np.linspace(0, len(places) - 1, _SAMPLES).astype(np.int64))]
        # Takes a third of the time to build; few queries follow.
        _, near = cKDTree(places, leafsize=64, compact_nodes=False, balanced_tree=False).query(
            chosen, k=min(_NEIGHBOURS, len(places))
        )
        step = np.abs(places[near] - chosen[:, None, :])
        crosswise = np.linalg.norm(step[..., 1:], axis=-1)
        length = np.hypot(step[..., 0], crosswise)
        length[length == 0.0] = np.inf
        ahead = step[..., 0] > crosswise
        found = [np.where(mask, length, np.inf).min(axis=1) for mask in (ahead, ~ahead)]
        medians = [float(np.median(f[np.isfinite(f)])) if np.isfinite(f).any() else np.inf for f in found]
        shortest = min(medians)
        if not np.isfinite(shortest):
            return None
        return cls(*(_rounded(m if np.isfinite(m) else shortest) for m in medians))

    @property
    def shrink(self) -> float:
        """Return the factor on distances along that makes them as dense as those across; 1 if they are no wider."""
        return min(1.0, self.across / self.along)


def _rounded(length: float) -> float:
    """Round a length to a geometric series with steps of a tenth."""
    return float(1.1 ** round(np.log(length) / np.log(1.1)))
