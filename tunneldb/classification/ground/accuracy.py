"""Agreement of a filter's ground with reference ground (Li et al. 2023, eq. 9 to 13; errors of the ISPRS)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike


@dataclass(frozen=True)
class Agreement:
    """Confusion counts of ground points.

    Attributes
    ----------
    ground, missed : int
        True ground points that were found (a0) and missed (b0).
    false_ground, other : int
        Other points classified as ground (c0) and as other (d0).
    """

    ground: int
    missed: int
    false_ground: int
    other: int

    @classmethod
    def of(cls, truth: ArrayLike, found: ArrayLike) -> Agreement:
        """Compare arrays (n,) that are True for ground points."""
        true, selected = np.asarray(truth, dtype=np.bool_), np.asarray(found, dtype=np.bool_)
        if true.shape != selected.shape:
            raise ValueError(f"reference of {true.shape} and result of {selected.shape} points do not match")
        both = int(np.count_nonzero(true & selected))
        missed, false_ground = int(np.count_nonzero(true)) - both, int(np.count_nonzero(selected)) - both
        return cls(both, missed, false_ground, true.size - both - missed - false_ground)

    def __add__(self, more: Agreement) -> Agreement:
        """Return the sum of both."""
        return Agreement(
            self.ground + more.ground, self.missed + more.missed, self.false_ground + more.false_ground, self.other + more.other
        )  # fmt: skip

    @property
    def type_one(self) -> float:
        """Return the missed share of the true ground (eq. 9); NaN without any."""
        return _share(self.missed, self.ground + self.missed)

    @property
    def type_two(self) -> float:
        """Return the share of the other points classified as ground (eq. 10); NaN without any."""
        return _share(self.false_ground, self.false_ground + self.other)

    @property
    def total(self) -> float:
        """Return the share of all points classified wrongly (eq. 11); NaN without any."""
        return _share(self.missed + self.false_ground, self._all)

    @property
    def kappa(self) -> float:
        """Return the agreement beyond chance (eq. 12, 13): 1 is perfect; NaN if chance alone agrees fully."""
        if not self._all:
            return float("nan")
        agreed = (self.ground + self.other) / self._all
        chance = (
            (self.ground + self.missed) * (self.ground + self.false_ground)
            + (self.false_ground + self.other) * (self.missed + self.other)
        ) / self._all**2
        return _share(agreed - chance, 1.0 - chance)

    @property
    def _all(self) -> int:
        return self.ground + self.missed + self.false_ground + self.other


def _share(part: float, whole: float) -> float:
    return part / whole if whole else float("nan")
