"""Stationing: labels of places along a tunnel, as in ``sql/geometry/stationing.sql``."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple


class Equation(NamedTuple):
    """Start of a piece of stationing.

    Attributes
    ----------
    chainage : float
        Distance along the axis from which it is valid, m; the first of a tunnel is valid before that, too.
    station : float
        Station there, m.
    direction : int
        1 if stations grow with chainage, -1 if they decrease.
    """

    chainage: float
    station: float
    direction: int = 1


@dataclass(frozen=True)
class Stationing:
    """Stationing of a tunnel.

    Attributes
    ----------
    equations : sequence of Equation
        In ascending chainage; if empty, stations are chainages.
    """

    equations: Sequence[Equation] = ()

    def station(self, chainage: float) -> float:
        """Return the station (m) at a chainage (m); at an equation, the one ahead."""
        if not self.equations:
            return chainage
        begun = bisect_right(self.equations, chainage, key=lambda equation: equation.chainage)
        equation = self.equations[max(begun - 1, 0)]
        return equation.station + equation.direction * (chainage - equation.chainage)

    def label(self, chainage: float, decimals: int = 3) -> str:
        """Return the station at a chainage (m) as ``12+345.678``."""
        return chainage_label(self.station(chainage), decimals)


def chainage_label(metres: float, decimals: int = 3) -> str:
    """Return a chainage or a station (m) as ``12+345.678``, like ``tunnel_api.chainage_label``."""
    scale = 10**decimals
    units = round(scale * metres)
    kilometres, rest = divmod(abs(units), 1000 * scale)
    width = 4 + decimals if decimals else 3
    return f"{'-' if units < 0 else ''}{kilometres}+{rest / scale:0{width}.{decimals}f}"


KILOMETRE = 1000.0
